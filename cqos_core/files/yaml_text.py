"""Writes readable YAML: short maps on one line, long ones over several, and quotes only if needed.

The importers read back the same texts, whatever characters they have.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import Final, TypeAlias

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import ScalarNode, flow_text, is_null, quoted_where_needed
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.dataclass import dataclass
from cqos_core.model.source import Source

_WIDTH: Final = 100
_LONGEST_KEY: Final = 1000  # YAML wants `?` before a longer one
_STEP: Final = "  "


@dataclass(frozen=True, slots=True)
class Raw:
    """A value in YAML, on one line."""

    text: str


@dataclass(slots=True)
class Block:
    """A map with one line for each entry.

    Attributes:
        comments: behind entries, by key.
        apart: whether empty lines separate the entries.
    """

    entries: dict[str, Node]
    comments: dict[str, str] = field(default_factory=dict)
    apart: bool = False


Node: TypeAlias = "Raw | Block | dict[str, Node] | list[Node]"


def scalar(text: str) -> Raw:
    """Return a text as a scalar that is read back as the same text, and never as null."""
    plain = ScalarNode(text, None, None, plain=True)
    return Raw(quoted_where_needed(ScalarNode(text, None, None, plain=not is_null(plain))))


def value(text: str) -> Raw:
    """Return the text of a setting: as a list or map in flow form if it is one, else as a scalar."""
    return Raw(text) if text[:1] in {"[", "{"} and _same_flow(text) else scalar(text)


def _same_flow(text: str) -> bool:
    reading = SourceReading(Source("", text.encode("utf-8", "replace")), [], [])
    tree = read_tree(reading)
    return not reading.problems and len(tree.documents) == 1 and flow_text(tree.documents[0]) == text


def comment(text: str) -> str:
    """Return a text as a comment of one line; line ends in it are escaped."""
    plain = text if text.isprintable() else text.encode("unicode_escape").decode("ascii")
    return f"# {plain}"


def document(entries: Block, head: Iterable[str] = ()) -> str:
    """Write a whole document, with ``head`` as comments before it."""
    lines = [*(comment(text) for text in head), *_block(entries, "")]
    return "\n".join(lines) + "\n"


def _block(block: Block, indent: str) -> list[str]:
    lines: list[str] = []
    for key, node in block.entries.items():
        entry = _entry(key, node, indent)
        if key in block.comments:
            entry[0] += f"  {comment(block.comments[key])}"
        if block.apart and lines and len(entry) > 1:
            lines.append("")
        lines += entry
    return lines


def _entry(key: str, node: Node, indent: str) -> list[str]:
    name = scalar(key).text
    head = f"{name}:" if len(name) < _LONGEST_KEY else f"? {name}\n{indent}:"
    flow = None if isinstance(node, Block) else _flow(node)
    if flow is not None and (isinstance(node, Raw) or len(indent) + len(head) + len(flow) < _WIDTH):
        return [f"{indent}{head} {flow}"]
    return [f"{indent}{head}", *_below(node, indent + _STEP)]


def _below(node: Node, indent: str) -> list[str]:
    if isinstance(node, Block):
        return _block(node, indent)
    if isinstance(node, list):
        return [line for item in node for line in _item(item, indent)]
    if isinstance(node, dict):
        return _block(Block(node), indent)
    return [f"{indent}{node.text}"]


def _item(node: Node, indent: str) -> list[str]:
    flow = None if isinstance(node, Block) else _flow(node)
    if flow is not None and (isinstance(node, Raw) or len(indent) + len(flow) + 2 < _WIDTH):
        return [f"{indent}- {flow}"]
    first, *rest = _below(node, indent + _STEP)
    return [f"{indent}- {first[len(indent) + 2 :]}", *rest]


def _flow(node: Node) -> str | None:
    """Return a value on one line; None if a part of it needs several."""
    if isinstance(node, Raw):
        return node.text
    if isinstance(node, Block):
        return None
    if isinstance(node, list):
        items = [_flow(item) for item in node]
        return None if None in items else f"[{', '.join(map(str, items))}]"
    parts = []
    for key, inner in node.items():
        name, flow = scalar(key).text, _flow(inner)
        if flow is None or len(name) >= _LONGEST_KEY:
            return None
        parts.append(f"{name}: {flow}")
    return f"{{{', '.join(parts)}}}"
