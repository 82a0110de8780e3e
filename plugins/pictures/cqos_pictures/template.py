"""Templates without logic, in the notation of Mustache. Every value is escaped; there is no way to write one that is not.

``{{name}}`` is a value. ``{{#name}}…{{/name}}`` repeats for a list, and appears once for anything else that is true.
``{{^name}}…{{/name}}`` appears where that is false or empty. ``{{>name}}`` is another template. Names are looked up from the inside out.
``{{.}}`` is the item itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any, TypeAlias

from cqos_core.formatters.terminal import clean

_TAG = re.compile(r"\{\{([#^/>]?)\s*([\w.]+)\s*\}\}")
_ALONE = re.compile(r"(?m)^[ \t]*(\{\{[#^/>][^}]*\}\})[ \t]*\n")

_Part: TypeAlias = "str | tuple[str, str, _Parts]"
_Parts: TypeAlias = "tuple[_Part, ...]"


def data_file(name: str) -> str:
    """Return the text of a file in ``html/``."""
    return (files(__package__) / "html" / name).read_text(encoding="utf-8")


def render_template(name: str, values: dict[str, Any]) -> str:
    """Return the template ``name.html`` with values."""
    return "".join(_render(_template(name), (values,)))


@cache
def _template(name: str) -> _Parts:
    text = re.sub(r"(?m)^[ \t]+", "", _ALONE.sub(r"\1", data_file(f"{name}.html")))
    return _parsed(_TAG.split(text), 0)[0]


def _parsed(pieces: Sequence[str], at: int) -> tuple[_Parts, int]:
    """Return what stands from a piece to the end of its section, and the piece behind that."""
    parts: list[_Part] = [pieces[at]]
    at += 1
    while at < len(pieces):
        kind, name = pieces[at : at + 2]
        inner: _Parts = ()
        if kind == "/":
            return tuple(parts), at + 2
        if kind in {"#", "^"}:
            inner, at = _parsed(pieces, at + 2)
        else:
            at += 2
        parts += ((kind, name, inner), pieces[at])
        at += 1
    return tuple(parts), at


def _render(parts: _Parts, values: tuple[Any, ...]) -> Iterator[str]:
    for part in parts:
        if isinstance(part, str):
            yield part
            continue
        kind, name, inner = part
        if kind == ">":
            yield from _render(_template(name), values)
            continue
        value = _value(name, values)
        if not kind:
            yield escape(clean(str(value)))
        elif kind == "^":
            yield from _render(inner, values) if not value else ()
        elif isinstance(value, (list, tuple)):
            for each in value:
                yield from _render(inner, (*values, each))
        elif value:
            yield from _render(inner, (*values, value))


def _value(name: str, values: tuple[Any, ...]) -> Any:
    if name == ".":
        return values[-1]
    return next(each[name] for each in reversed(values) if isinstance(each, dict) and name in each)
