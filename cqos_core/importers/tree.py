"""A tree of text with places: YAML, JSON and TOML documents before their interpretation.

Scalars stay the text they were written as. Callers ask for the meaning of a plain scalar in YAML 1.2's core schema (a number, a
flag, nothing) only where it matters. So `no`, `1:30` and `2027-01-01` are text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import field
from itertools import chain, repeat
from typing import Any, Final, Literal, TypeAlias

from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular_expressions import regular_expression

Kind: TypeAlias = Literal["null", "flag", "number", "text"]

NULL: Final = frozenset(("", "~", "null", "Null", "NULL"))
_TRUE = frozenset(("true", "True", "TRUE"))
_FALSE = frozenset(("false", "False", "FALSE"))
_INTEGER = regular_expression(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_REAL = regular_expression(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


@dataclass(slots=True, eq=False)
class ScalarNode:
    """One word or text.

    Attributes:
        text: without quotes, escapes resolved.
        line, column: one-based, of its first character; None where the format's parser does not tell.
        plain: neither quoted nor said to be text, so that it may stand for a number, a flag or nothing.
    """

    text: str
    line: int | None
    column: int | None
    plain: bool


@dataclass(slots=True, eq=False)
class SequenceNode:
    """A list."""

    line: int | None
    column: int | None
    items: list[Node] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class MappingNode:
    """A map, in the order of the document; entries merged by `<<` come last.

    Attributes:
        entries: the text of a key to the key and its value.
        end: one-based line on which something else begins, None where the format's parser does not tell.
        repeated: further keys and values of names that are among the entries, in a format that allows them.
    """

    line: int | None
    column: int | None
    entries: dict[str, tuple[ScalarNode, Node]] = field(default_factory=dict)
    end: int | None = None
    repeated: list[tuple[ScalarNode, Node]] | None = None

    def is_flat(self) -> bool:
        """Whether it has values, and each is a scalar."""
        return bool(self.entries) and all(isinstance(value, ScalarNode) for _, value in self.entries.values())


class TextMap(MappingNode):
    """A map of texts, as most in a large file are. Its entries are made when they are read.

    Attributes:
        names: its keys, each once. Maps of one source with the same keys have the same tuple.
        texts: its values; none is null.
        spots: where a key and its value stand, in turn: see `COLUMN_BITS`.
    """

    __slots__ = ("names", "spots", "texts")
    names: tuple[str, ...]
    texts: tuple[str, ...]
    spots: tuple[int, ...]

    def __init__(
        self,
        line: int,
        column: int,
        end: int,
        names: tuple[str, ...],
        texts: tuple[str, ...],
        spots: tuple[int, ...],
    ) -> None:
        """Make a map whose entries do not exist yet."""
        self.line, self.column, self.end, self.repeated = line, column, end, None
        self.names, self.texts, self.spots = names, texts, spots

    def __getattr__(self, name: str) -> Any:
        """Make the entries."""
        if name != "entries":
            raise AttributeError(name)
        line = self.line or 0
        nodes = map(scalar, chain.from_iterable(zip(self.names, self.texts, strict=True)), self.spots, repeat(line))
        self.entries = {key.text: (key, value) for key, value in zip(nodes, nodes, strict=True)}
        return self.entries

    def value(self, name: str) -> ScalarNode:
        """Return the value of a key."""
        at = self.names.index(name)
        return scalar(self.texts[at], self.spots[2 * at + 1], self.line or 0)

    def is_flat(self) -> bool:
        """See `MappingNode.is_flat`."""
        return True


COLUMN_BITS: Final = 32
"""Where a scalar stands is kept as one number, its spot. The lowest bit tells whether it is plain; then come so many bits of its column,
from 0, and then its line below that of its list or map. On that line spots are small numbers, which Python need not make."""
_COLUMNS: Final = (1 << COLUMN_BITS) - 1


def place_of(spot: int, line: int) -> tuple[int, int]:
    """Return the one-based line and column of a spot below a line."""
    return line + (spot >> COLUMN_BITS + 1), (spot >> 1 & _COLUMNS) + 1


def scalar(text: str, spot: int, line: int) -> ScalarNode:
    """Return the node of a text at a spot below a line."""
    return ScalarNode(text, *place_of(spot, line), plain=spot & 1 == 1)


Node: TypeAlias = ScalarNode | SequenceNode | MappingNode


def is_null(node: Node) -> bool:
    """Whether nothing is stated here: an empty value, ``~`` or ``null``."""
    return isinstance(node, ScalarNode) and node.plain and node.text in NULL


def stated(entries: MappingNode, name: str) -> Node | None:
    """Return the value of a key, None where it is not there or states nothing."""
    _, value = entries.entries.get(name, (None, None))
    return None if value is None or is_null(value) else value


def walk(roots: Iterable[Node]) -> Iterator[Node]:
    """Yield ``roots`` and every key and value below them, each once and in the order of the document."""
    seen: set[int] = set()
    waiting = [*roots][::-1]
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        yield node
        if isinstance(node, SequenceNode):
            waiting += reversed(node.items)
        elif isinstance(node, MappingNode):
            waiting += reversed([part for entry in node.entries.values() for part in entry])


def flag(node: ScalarNode) -> bool | None:
    """Return the flag a plain scalar stands for, None where it stands for something else."""
    if not node.plain:
        return None
    return True if node.text in _TRUE else False if node.text in _FALSE else None


_LONGEST_NUMBER = 40


def whole_number(node: ScalarNode) -> int | None:
    """Return the integer a plain scalar stands for, None where it stands for something else or is absurdly long."""
    text = node.text
    if node.plain and text.isascii() and text.isdigit() and len(text) <= _LONGEST_NUMBER:
        return int(text)
    if not node.plain or len(text) > _LONGEST_NUMBER or not _INTEGER.fullmatch(text):
        return None
    return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))


def kind_of(node: ScalarNode) -> Kind:
    """Return the kind of a scalar in the core schema of YAML 1.2."""
    if not node.plain:
        return "text"
    text = node.text
    if text in NULL:
        return "null"
    if text in _TRUE or text in _FALSE:
        return "flag"
    return "number" if _INTEGER.fullmatch(text) or _REAL.fullmatch(text) else "text"


# Text that needs no quotes in a flow collection and is read back unchanged: no indicator at the start,
# none that ends a plain scalar within, single blanks only.
_SAFE = regular_expression(r"[A-Za-z0-9_./$+][A-Za-z0-9_./$+@%^()=;<>~*-]*(?: [A-Za-z0-9_./$+@%^()=;<>~*-]+)*")
_ESCAPED = regular_expression("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")
_LONGEST_SIMPLE_KEY = 1000  # YAML wants `?` before a key of more than 1024 characters


def flow_text(node: Node) -> str:
    """Return the value as YAML in flow form on one line, from which the same value is read back.

    A scalar alone is its bare text, as people write it; within a list or map it is quoted where it has to be.
    """
    return node.text if isinstance(node, ScalarNode) else part_text(node)


def part_text(node: Node) -> str:
    """Return the value as it may stand behind a key or in a list, quoted where it has to be."""
    if isinstance(node, ScalarNode):
        return quoted_where_needed(node)
    if isinstance(node, SequenceNode):
        return f"[{', '.join(map(part_text, node.items))}]"
    return f"{{{', '.join(f'{_flow_key(key)}: {part_text(value)}' for key, value in node.entries.values())}}}"


def _flow_key(key: ScalarNode) -> str:
    text = quoted_where_needed(key)
    return text if len(text) < _LONGEST_SIMPLE_KEY else f"? {text} "


def quoted_where_needed(node: ScalarNode) -> str:
    """Return a scalar as it may stand in a flow collection, from which the same scalar is read back."""
    text = node.text
    seen_as = kind_of(ScalarNode(text, None, None, plain=True))
    if seen_as == "text":
        return text if _SAFE.fullmatch(text) else _quoted(text)
    if node.plain:
        return text or "null"
    return _quoted(text)


def _quoted(text: str) -> str:
    import json

    return _ESCAPED.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(text, ensure_ascii=False))
