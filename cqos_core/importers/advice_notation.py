"""Translates advice, which is written in YAML, into the notation of the file: JSON or TOML."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, ScalarNode, is_null, kind_of
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.problems import Problem
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.source import Source
from cqos_core.model.system import ImportNote

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.importers.tree import Node

T = TypeVar("T", Problem, ImportNote)

_QUOTED: Final = regular_expression(r"`([^`\n]{1,300})`")
_BARE_KEY: Final = regular_expression(r"[A-Za-z0-9_-]+")


def in_notation(problem: T) -> T:
    """Return a problem or a note with its advice in the notation of its file."""
    if problem.place is None or not problem.help:
        return problem
    return replace(problem, help=advice_for(problem.help, problem.place.source))


def advice_for(advice: str, name: str) -> str:
    """Return advice whose texts in back quotes are in the notation of a file."""
    write = _NOTATIONS.get(name.lower().rpartition(".")[2])
    return advice if write is None else _QUOTED.sub(lambda found: f"`{_written(found[1], write)}`", advice)


def _written(text: str, write: Callable[[MappingNode], str]) -> str:
    """Return entries of a map in another notation; other text stays as it is."""
    whole = text.startswith("{")
    reading = SourceReading(Source("advice", (text if whole else f"{{{text}}}").encode()), [], [])
    roots = read_tree(reading).documents
    if reading.problems or len(roots) != 1 or not isinstance(roots[0], MappingNode) or ": " not in text:
        return text
    written = write(roots[0])
    return f"{{{written}}}" if whole else written


def _json_entries(node: MappingNode) -> str:
    return ", ".join(
        f"{json.dumps(name, ensure_ascii=False)}: {_json(value)}" for name, (_, value) in node.entries.items()
    )


def _json(node: Node) -> str:
    if isinstance(node, MappingNode):
        return f"{{{_json_entries(node)}}}"
    if isinstance(node, ScalarNode):
        return _scalar(node) if not is_null(node) else "null"
    return f"[{', '.join(map(_json, node.items))}]"


def _toml_entries(node: MappingNode) -> str:
    names = {name: name if _BARE_KEY.fullmatch(name) else json.dumps(name, ensure_ascii=False) for name in node.entries}
    return ", ".join(f"{names[name]} = {_toml(value)}" for name, (_, value) in node.entries.items())


def _toml(node: Node) -> str:
    if isinstance(node, MappingNode):
        return f"{{ {_toml_entries(node)} }}"
    if isinstance(node, ScalarNode):
        return _scalar(node)
    return f"[{', '.join(map(_toml, node.items))}]"


def _scalar(node: ScalarNode) -> str:
    """Return a number, a flag, or what stands for a text still to be chosen, as it is; a text in quotes."""
    bare = kind_of(node) in {"number", "flag"} or node.text == "…"
    return node.text if bare else json.dumps(node.text, ensure_ascii=False)


_NOTATIONS: Final = {"json": _json_entries, "toml": _toml_entries}
