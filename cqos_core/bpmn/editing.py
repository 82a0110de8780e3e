"""Adds settings to BPMN elements as attributes of the namespace ``http://qos``."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Final

from cqos_core.model.encoding import Lines
from cqos_core.model.excerpt import NAMESPACES, exact
from cqos_core.model.regular_expressions import re
from cqos_core.model.source import Replacement

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place

_QOS: Final = NAMESPACES["qos"]
_BOUND: Final = re.compile(rf"""\sxmlns:([^\s=:]+)\s*=\s*["']{re.escape(_QOS)}["']""")
_START: Final = re.compile(r"<[^\s<>/!?=]++")


def insert(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """Add attributes to the start tag at ``place``; the namespace too, where the document does not bind it."""
    if place.element is None or place.line is None:
        return None
    found = exact([place], {place.source: text.encode()})[place]
    start = Lines(text).start(found.line) if found.line is not None and found.column is not None else None
    tag = _START.match(text, start + (found.column or 1) - 1) if start is not None else None
    if tag is None:
        return None
    bound = _BOUND.search(text)
    prefix = bound[1] if bound else "qos"
    added = "" if bound else f' xmlns:{prefix}="{_QOS}"'
    added += "".join(f' {prefix}:{name}="{escape(value)}"' for name, value in settings.items())
    return Replacement(tag.end(), tag.end(), added)
