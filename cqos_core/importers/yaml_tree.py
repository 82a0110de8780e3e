"""YAML and JSON to trees with places, from the events of the C parser: no objects are constructed, nothing recurses.

A map of texts becomes one node, whose parts are made when one reads them: most of a large file is such maps. PyYAML's own composer makes
a node of every text, and recurses on the C stack, where deep nesting ends the process; here it is a loop with a limit.
"""

from __future__ import annotations

from dataclasses import field
from itertools import chain
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from cqos_core.importers.source_reading import described, shown
from cqos_core.importers.tree import (
    COLUMN_BITS,
    NULL,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TextMap,
    flow_text,
    is_null,
    kind_of,
    scalar,
)
from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place
from cqos_core.model.spelling import nearest
from cqos_core.model.system import ImportNote

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    import yaml

    from cqos_core.importers.source_reading import SourceReading
    from cqos_core.importers.tree import Node
    from cqos_core.model.problems import Problem

DEEPEST: Final = 64
"""The deepest nesting of lists and maps; system files need about ten levels."""

MOST_REPEATED: Final = 10_000_000
"""The most characters and values that aliases may repeat altogether, so that a small file cannot stand for a huge one."""

_PREFIX = "tag:yaml.org,2002:"
_NONSPECIFIC = "!"
_TAGGED_KINDS = {"null": "null", "bool": "flag", "int": "number", "float": "number"}
_MERGE = "<<"
_SPECIAL = NULL | {_MERGE}


@dataclass(slots=True)
class Tree:
    """The documents of one source.

    Attributes:
        documents: their roots; documents without content are left out.
        templates: every scalar with ``${`` in it.
        glued: every plain key without a value that has a colon within, as in ``{depth:5}``.
        texts: every text, with itself if it is nothing but a text wherever it stands: so equal ones are one object, whose hash is known.
            None stands with what means nothing or something else where it is plain, mentions a variable, or begins a call that a comma cut.
    """

    documents: list[Node] = field(default_factory=list)
    templates: list[ScalarNode] = field(default_factory=list)
    glued: list[ScalarNode] = field(default_factory=list)
    texts: dict[str, str | None] = field(default_factory=dict)


Repeated: TypeAlias = Literal["refuse", "keep", "last", "merge"]
"""Treatments of a key that stands twice in one map, by the program that owns the format: it refuses it; takes both; takes the last;
or joins maps and takes the last of other values. A program that does not refuse them takes empty keys too."""


def read_tree(reading: SourceReading, *, repeated: Repeated = "refuse") -> Tree:
    """Read the source as YAML, or as JSON where it is JSON that YAML refuses (tabs, surrogate pairs, long keys).

    Problems are in ``reading.problems``; the tree then holds the documents before the fault. A key that stands twice
    in one map is a problem, unless ``repeated`` is the treatment of it by the format's own program.
    """
    import yaml

    before = len(reading.problems)
    composer = _Composer(reading, repeated=repeated)
    try:
        # Both in here: the pure parser reads the first bytes when it is made, the C parser at the first event.
        parser = getattr(yaml, "CSafeLoader", yaml.SafeLoader)(reading.source.data)
        composer.compose(parser.get_event)
    except _RefusedError:
        pass
    except yaml.YAMLError as error:
        if not _looks_like_json(reading.source.data):
            _explain(reading, error)
            return composer.tree
        earlier = reading.problems[before:]
        del reading.problems[before:]
        return _read_json(reading, error, earlier)
    return composer.tree


def _explain(reading: SourceReading, error: yaml.YAMLError) -> None:
    from cqos_core.importers.yaml_errors import explain

    explain(reading, error)


def _looks_like_json(data: bytes) -> bool:
    return data[:64].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xfe\xff \t\r\n").startswith(b"{")


def _read_json(reading: SourceReading, yaml_error: yaml.YAMLError, earlier: list[Problem]) -> Tree:
    """Read as JSON what YAML refused with the ``earlier`` problems.

    What is neither is explained in the words of what its name says it is.
    """
    from cqos_core.importers.json_events import JsonError, json_events

    before = len(reading.problems)
    composer = _Composer(reading)
    try:
        composer.compose(json_events(reading.source.data).__next__)
    except _RefusedError:
        pass
    except JsonError as error:
        del reading.problems[before:]
        if reading.source.name.lower().endswith(".json"):
            where = Place(reading.source.name, error.line, error.column)
            reading.problem("CQ001", f"this is not JSON: {error}", where, error.advice)
        else:
            reading.problems += earlier
            _explain(reading, yaml_error)
        return Tree()
    return composer.tree


def read_json5(reading: SourceReading) -> Tree:
    """Read the source as JSON5. Problems are in ``reading.problems``; the tree is empty then."""
    from cqos_core.importers.json_events import JsonError, json5_events

    composer = _Composer(reading)
    try:
        composer.compose(json5_events(reading.source.data).__next__)
    except _RefusedError:
        return Tree()
    except JsonError as error:
        where = Place(reading.source.name, error.line, error.column)
        reading.problem("CQ001", f"this is not JSON5: {error}", where, error.advice)
        return Tree()
    return composer.tree


class _RefusedError(Exception):
    """The document is larger or deeper than it may be; the problem is already reported."""


@dataclass(slots=True, eq=False)
class _Anchored:
    """The node of an anchor, None while it is still being read; its size in values and characters, and its depth."""

    node: Node | None = None
    size: int = 0
    height: int = 0


def _both(name: str, first: Node, second: Node) -> str:
    """Say what to write in place of a key that stands twice, with these values."""
    if isinstance(first, MappingNode) and isinstance(second, MappingNode):
        joined = flow_text(MappingNode(None, None, {**first.entries, **second.entries}))
        if first.entries.keys().isdisjoint(second.entries) and len(joined) <= _LONGEST_JOINED:
            return f"write both under one key, `{name}: {joined}`, or remove one of them"
        one, other = map(flow_text, (first, second))
        if max(len(one), len(other)) <= _LONGEST_KEPT:
            topic = "/" in name and first.is_flat() and second.is_flat()
            more = f"; for two endpoints of one topic write a list: `{name}: [{one}, {other}]`" if topic else ""
            return f"keep `{name}: {one}` or `{name}: {other}`{more}"
        return f"write what stands below both under one `{name}`, or remove one of them"
    one, other = (f"{name}: {flow_text(each)}" for each in (first, second))
    most = _LONGEST_KEPT if one != other and not isinstance(first, MappingNode | SequenceNode) else 0
    return f"keep `{one}` or `{other}`" if max(len(one), len(other)) <= most else "keep one of them"


_ALIAS: Final = regular_expression(r"<<\s*:\s*(\*[\w-]+)")
_LONGEST_KEPT: Final = 60
_LONGEST_JOINED: Final = 120


class _Composer:
    """Turns a stream of events into a `Tree`."""

    def __init__(self, reading: SourceReading, *, repeated: Repeated = "refuse") -> None:
        self.reading = reading
        self.twice = repeated
        self.tree = Tree()
        self.names: dict[tuple[str, ...], tuple[str, ...]] = {}
        self.anchors: dict[str, _Anchored] = {}
        self.counted: dict[int, _Anchored] = {}  # of the document, by the identity of their nodes
        self.repeated = 0
        self.above: list[tuple[Any, list[Node | str], list[int], int]] = []
        """The lists and maps within which one is being read: the event of each, its parts so far with their spots, its line from 0."""
        self.nameless: set[int] = set()  # keys that are reported for their anchor
        self.placeholders: set[int] = set()  # aliases that are reported

    def compose(self, next_event: Callable[[], Any]) -> None:
        """Read events to the end of the stream; what the parser raises goes through."""
        from yaml.events import (
            AliasEvent,
            DocumentStartEvent,
            MappingEndEvent,
            MappingStartEvent,
            ScalarEvent,
            SequenceEndEvent,
            SequenceStartEvent,
            StreamEndEvent,
        )

        known, above = self.tree.texts.get, self.above
        opened: Any = None
        items: list[Node | str] = []
        spots: list[int] = []
        first, is_flat = 0, False
        while True:
            event = next_event()
            kind = type(event)
            if kind is ScalarEvent:
                part: Node | str | None = known(event.value)
                if part is None or event.anchor is not None or event.tag is not None:
                    part = self.scalar(event)
                    is_flat = is_flat and type(part) is str
                items.append(part)
                mark = event.start_mark
                spots.append((mark.line - first << COLUMN_BITS | mark.column) << 1 | event.implicit[0])
                continue
            if kind is MappingStartEvent or kind is SequenceStartEvent:
                above.append((opened, items, spots, first))
                if event.anchor is not None or event.tag is not None or len(above) > DEEPEST:
                    self.open(event, is_map=kind is MappingStartEvent)
                opened, items, spots, first, is_flat = event, [], [], event.start_mark.line, True
                continue
            node: Node
            if kind is MappingEndEvent or kind is SequenceEndEvent:
                end = event.start_mark.line + 1 if kind is MappingEndEvent else None
                node = self.close(opened, end, items, spots, is_flat=is_flat)
                opened, items, spots, first = above.pop()
            elif kind is AliasEvent:
                node = self.alias(event.anchor, event.start_mark.line + 1, event.start_mark.column + 1)
            elif kind is StreamEndEvent:
                break
            else:
                if kind is DocumentStartEvent:
                    self.anchors.clear()
                continue
            items.append(node)
            spots.append(0)
            is_flat = False
        self.tree.documents += [node for node in _nodes(items, spots, 1) if not is_null(node)]

    def scalar(self, event: Any) -> ScalarNode | str:
        """Return a text that is nothing else anywhere; or the node of a scalar that has something to it, even if only its anchor."""
        text: str = event.value
        mark = event.start_mark
        is_only_text = text not in _SPECIAL and "${" not in text and text.count("(") <= text.count(")")
        self.tree.texts.setdefault(text, text if is_only_text else None)
        if is_only_text and event.tag is None and event.anchor is None:
            return text
        node = ScalarNode(text, mark.line + 1, mark.column + 1, event.implicit[0])
        if "${" in text:
            self.tree.templates.append(node)
        if event.tag is not None:
            self.scalar_tag(node, event.tag)
        if event.anchor is not None:
            if not text and node.plain and self.twice == "refuse":
                self.names_nothing(node, event.anchor)
            self.anchors[event.anchor] = self.count(node)
        return node

    def open(self, event: Any, *, is_map: bool) -> None:
        """Begin a list or map that has something to it."""
        mark = event.start_mark
        place = Place(self.reading.source.name, mark.line + 1, mark.column + 1)
        if len(self.above) > DEEPEST:
            self.refuse(f"lists and maps are nested deeper than {DEEPEST} here", place)
        if event.tag is not None and event.tag not in {_NONSPECIFIC, f"{_PREFIX}{'map' if is_map else 'seq'}"}:
            self.unknown_tag(place, event.tag)
        if event.anchor is not None:
            self.anchors[event.anchor] = _Anchored()

    def close(
        self, opened: Any, end: int | None, items: list[Node | str], spots: list[int], *, is_flat: bool
    ) -> SequenceNode | MappingNode:
        """Return a list, or a map that has an ``end``; ``is_flat`` tells that its parts are all texts."""
        mark = opened.start_mark
        line, column = mark.line + 1, mark.column + 1
        node: SequenceNode | MappingNode
        if end is None:
            node = SequenceNode(line, column, [*_nodes(items, spots, line)])
        elif is_flat and items and (names := self.different(items[::2])) is not None:
            node = TextMap(line, column, end, names, tuple(items[1::2]), tuple(spots))  # type: ignore[arg-type]
        else:
            node = MappingNode(line, column, {}, end)
            self.fill(node, _nodes(items, spots, line))
        if opened.anchor is not None:
            self.anchors[opened.anchor] = self.counted[id(node)] = self.count(node)
        return node

    def different(self, names: list[Any]) -> tuple[str, ...] | None:
        """Return keys as the tuple that all maps with them have; None where one stands twice."""
        found: tuple[str, ...] = (*names,)
        known = self.names.get(found)
        if known is None and len({*found}) == len(found):
            known = self.names[found] = found
        return known

    def count(self, node: Node) -> _Anchored:
        """Return what a node counts for where it is repeated."""
        if isinstance(node, ScalarNode):
            return _Anchored(node, 1 + len(node.text))
        parts = node.items if isinstance(node, SequenceNode) else chain.from_iterable(node.entries.values())
        size, height = 1, 0
        for part in parts:
            below = self.counted.get(id(part)) or self.count(part)
            size += below.size
            height = max(height, 0 if isinstance(part, ScalarNode) else below.height + 1)
        return _Anchored(node, size, height)

    def alias(self, name: str, line: int, column: int) -> Node:
        """Return what an alias stands for, or a text in its place where it stands for nothing."""
        placeholder = ScalarNode(f"*{name}", line, column, plain=False)
        anchored = self.anchors.get(name)
        if anchored is None:
            message = f"`*{name}` refers to an anchor `&{name}` that does not stand before it"
            near = nearest(name, self.anchors)
            advice = (
                f"did you mean `*{near}`?" if near else f"write `&{name}` before what it stands for, above this line"
            )
            advice += f'; a profile is written by its name alone, `{name}`; a pattern in quotes, "*{name}"'
            self.reading.problem("CQ017", message, placeholder, advice)
            self.placeholders.add(id(placeholder))
            return placeholder
        if anchored.node is None:
            self.reading.problem("CQ002", f"`*{name}` stands within `&{name}`, which it repeats", placeholder)
            return placeholder
        self.repeated += anchored.size
        if self.repeated > MOST_REPEATED:
            self.refuse("aliases repeat more than any real file needs", placeholder)
        if len(self.above) + anchored.height >= DEEPEST:
            self.refuse(f"aliases nest lists and maps deeper than {DEEPEST} here", placeholder)
        return anchored.node

    def names_nothing(self, node: ScalarNode, name: str) -> None:
        """Refuse an anchor that has no value: it was meant as a name, or as a reference."""
        self.nameless.add(id(node))
        message = f"`&{name}` names an anchor, and no value follows"
        advice = f'if this is a name or pattern, write it in quotes: "&{name}"'
        if name in self.anchors:
            advice = f"write `*{name}` to take what the anchor `&{name}` names"
        self.reading.problem("CQ017", message, node, advice)

    def refuse(self, message: str, where: Node | Place) -> None:
        """Stop reading."""
        self.reading.problem("CQ002", f"{message}, which is refused", where)
        raise _RefusedError

    # Maps

    def fill(self, node: MappingNode, parts: Iterator[Node]) -> None:
        """Make entries of keys and values that follow each other."""
        entries = node.entries
        merge: tuple[ScalarNode, Node] | None = None
        for key, value in zip(parts, parts, strict=True):
            if not isinstance(key, ScalarNode):
                self.reading.problem("CQ009", "a key must be a text, found a list or map", key)
                continue
            name = key.text
            if name in entries:
                self.again(node, key, value)
            elif name == _MERGE and key.plain:
                if merge is not None:
                    self.duplicate(key, merge[0], self.both_merged(merge[0], key))
                merge = (key, value)
            else:
                entries[name] = (key, value)
                if not name and self.twice == "refuse" and id(key) not in self.nameless:
                    self.reading.problem("CQ009", "a key is empty", key)
                elif ":" in name and key.plain and isinstance(value, ScalarNode) and value.plain and not value.text:
                    self.tree.glued.append(key)
        if merge is not None:
            self.merge(node, *merge)

    def again(self, node: MappingNode, key: ScalarNode, value: Node) -> None:
        """Take in a key that the map has already, as the program does that owns the format."""
        first, before = node.entries[key.text]
        if self.twice == "refuse":
            self.duplicate(key, first, _both(key.text, before, value))
        elif self.twice == "keep":
            node.repeated = node.repeated or []
            node.repeated.append((key, value))
        elif self.twice == "merge" and isinstance(before, MappingNode) and isinstance(value, MappingNode):
            joined = MappingNode(before.line, before.column, dict(before.entries), value.end)
            node.entries[key.text] = (first, joined)
            for name, (inner, below) in value.entries.items():
                if name in joined.entries:
                    self.again(joined, inner, below)
                else:
                    joined.entries[name] = (inner, below)
        else:
            node.entries[key.text] = (key, value)
            if flow_text(before) != flow_text(value):
                message = (
                    f"key {shown(key.text)} stands twice in one map, first on line {first.line}; the last one counts"
                )
                # Most such keys have nothing to do with quality of service, and their owner reads them without a word.
                self.reading.notes.append(ImportNote("CQ005", "note", message, self.reading.place(key)))

    def duplicate(self, key: ScalarNode, first: ScalarNode, advice: str) -> None:
        """Name both places of a key that stands twice in one map."""
        message = f"key {shown(key.text)} stands twice in one map, first on line {first.line}, column {first.column}"
        self.reading.problem("CQ005", message, key, advice)

    def both_merged(self, first: ScalarNode, second: ScalarNode) -> str:
        """Say how what two keys ``<<`` merge is written as one list."""
        rests = (self.reading.rest_of_line(key.line, key.column or 1) for key in (first, second))
        names = [found[1] for rest in rests if (found := _ALIAS.match(rest))]
        both = ", ".join(names) if len({*names}) > 1 else "*first, *second"
        return f"list what is merged: `<<: [{both}]`"

    def merge(self, node: MappingNode, key: ScalarNode, value: Node) -> None:
        """Add the entries that ``<<`` brings; what the map states itself wins, then the first in the list."""
        for merged in value.items if isinstance(value, SequenceNode) else [value]:
            if isinstance(merged, MappingNode):
                for name, entry in merged.entries.items():
                    node.entries.setdefault(name, entry)
            elif id(merged) not in self.placeholders:
                name = merged.text if isinstance(merged, ScalarNode) and merged.text.isidentifier() else "name"
                advice = f"write `<<: *{name}`"
                if name not in self.anchors:
                    advice += f" with the anchor `&{name}` at a map"
                self.reading.problem("CQ009", f"`<<` merges maps, found {described(merged)}", key, advice)

    # Tags

    def scalar_tag(self, node: ScalarNode, tag: str) -> None:
        """Take in what a tag says of a scalar: text, or what it is without the tag anyway."""
        if tag in {_NONSPECIFIC, f"{_PREFIX}str"}:
            node.plain = False
            return
        node.plain = True
        if _TAGGED_KINDS.get(tag.removeprefix(_PREFIX)) != kind_of(node):
            self.unknown_tag(node, tag)

    def unknown_tag(self, where: Node | Place, tag: str) -> None:
        """Say that a tag means nothing here."""
        written = f"!!{tag.removeprefix(_PREFIX)}" if tag.startswith(_PREFIX) else tag
        text = where.text if isinstance(where, ScalarNode) else ""
        whole = f"{written.removesuffix(':')} {text}".strip()
        advice = f'remove it; if it belongs to the text, write the text in quotes: "{whole}"'
        self.reading.problem("CQ018", f"the tag {shown(written)} means nothing here", where, advice)


def _nodes(parts: Iterable[Node | str], spots: Iterable[int], line: int) -> Iterator[Node]:
    """Yield the parts of a list or map that begins on a line as nodes."""
    for part, spot in zip(parts, spots, strict=True):
        yield scalar(part, spot, line) if type(part) is str else part  # type: ignore[misc]
