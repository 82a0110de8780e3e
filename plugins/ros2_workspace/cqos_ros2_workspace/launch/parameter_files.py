"""YAML files of launches: as plain values, and parameter files as sections for patterns of node names."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, SequenceNode, flag, is_null, kind_of, whole_number
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Place
from cqos_core.model.source import Source
from cqos_core.packs.document_importer import only_document
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.tree import Node, ScalarNode

SECTION: Final = "ros__parameters"
EVERY: Final = "/**"
DEEPEST: Final = 20
_LONGEST_NUMBER: Final = 40
_FLAGS: Final = {"yes": True, "on": True, "no": False, "off": False}


def tree_of(data: bytes, path: str, place: Place | None) -> Node | Unknown:
    """Return the root of the one document of a YAML file."""
    reading = SourceReading(Source(path, data), [], [])
    try:
        root = only_document(reading, repeated="merge")
    except InputError as error:
        return Unknown(error.problems[0].message, error.problems[0].place or place)
    if root is None or reading.problems:
        problem = reading.problems[0]
        return Unknown(problem.message, problem.place or place)
    return root


def plain_yaml(data: bytes, path: str, place: Place | None) -> Any:
    """Return what a YAML file holds, as Python values."""
    root = tree_of(data, path, place)
    return root if isinstance(root, Unknown) else plain(root)


def plain_text(text: str) -> Any:
    """Return the value that a text is in YAML, the text itself where it is none."""
    root = tree_of(text.encode(errors="replace"), "<text>", None) if text.strip() else None
    return text if root is None or isinstance(root, Unknown) else plain(root)


def plain(node: Node, known: dict[int, Any] | None = None) -> Any:
    """Return a node as Python values; what aliases repeat is one value, so that a small file stays small."""
    known = {} if known is None else known
    if id(node) not in known:
        if isinstance(node, MappingNode):
            known[id(node)] = {name: plain(value, known) for name, (_, value) in node.entries.items()}
        elif isinstance(node, SequenceNode):
            known[id(node)] = [plain(item, known) for item in node.items]
        else:
            known[id(node)] = _scalar(node)
    return known[id(node)]


def _scalar(node: ScalarNode) -> Any:
    if is_null(node):
        return None
    value = flag(node)
    if value is None and node.plain:
        value = _FLAGS.get(node.text.lower())
    if value is not None:
        return value
    number = whole_number(node)
    if number is not None:
        return number
    short = len(node.text) <= _LONGEST_NUMBER
    return (
        float(node.text.lower().replace(".inf", "inf").replace(".nan", "nan"))
        if short and kind_of(node) == "number"
        else node.text
    )


def sections(node: Node, above: str, place: Place, depth: int = 0) -> Iterator[tuple[str, Place, Node]]:
    """Yield the sections of a parameter file: for which pattern of node names each is, its place, and its parameters."""
    if not isinstance(node, MappingNode) or depth > DEEPEST:
        return
    for name, (key, value) in node.entries.items():
        if name == SECTION:
            yield above or EVERY, place, value
        else:
            here = Place(place.source, key.line, key.column)
            yield from sections(value, f"{above}/{name.strip('/')}", here, depth + 1)


def covers(pattern: str, full_name: str) -> bool:
    """Whether a section is for a node (rclcpp: is_node_name_matched)."""
    if "*" not in pattern:
        return pattern == full_name
    expression = re.escape(pattern).replace("/\\*\\*", "(?:/\\w+)*").replace("/\\*", "/\\w+")
    return re.fullmatch(expression, full_name) is not None
