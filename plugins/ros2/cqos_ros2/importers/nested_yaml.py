"""YAML within a text of a YAML document, as rosbag2 wrote it up to version 8, with places in the outer document."""

from __future__ import annotations

from typing import Final

from cqos_core.importers.source_reading import SourceReading, shown
from cqos_core.importers.tree import Node, ScalarNode, walk
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source

_NEAR: Final = 400
"""How far apart two words of such a text may stand."""


def read_embedded(text: ScalarNode, reading: SourceReading, name: str) -> Node | None:
    """Return the document in ``text``, the value of ``name``; None if it is empty, or no YAML, which is reported."""
    data = text.text.encode("utf-8", "surrogatepass")
    inner = SourceReading(Source(reading.source.name, data), [], [])
    try:
        documents = read_tree(inner).documents
    except InputError as error:
        inner.problems[:] = error.problems
    if inner.problems:
        first = inner.problems[0]
        line = f", in line {first.place.line} of it" if first.place is not None and first.place.line else ""
        reading.problem(first.code, f"the text of {shown(name)}{line}: {first.message}", text, first.help)
        return None
    if not documents:
        return None
    _relocate(documents[0], text, reading)
    return documents[0]


def _relocate(document: Node, text: ScalarNode, reading: SourceReading) -> None:
    """Give all nodes below ``document`` the places where their words stand in the outer source.

    However the text is quoted, folded or escaped, its words follow each other there as they do in the text. A list or
    map begins with its first word.
    """
    lines = reading.lines
    start = lines.start(text.line or 0)
    cursor = (start or 0) + (text.column or 1) - 1
    begun: list[Node] = []
    for node in walk([document]):
        node.line, node.column = text.line, text.column
        begun.append(node)
        if start is not None and isinstance(node, ScalarNode) and node.text:
            found = lines.text.find(node.text, cursor, cursor + len(node.text) + _NEAR)
            if found >= 0:
                for each in begun:
                    each.line, each.column = lines.position(found)
                cursor = found + len(node.text)
            begun.clear()
