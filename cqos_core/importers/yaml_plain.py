"""Reads YAML in the form in which most system files are written, in a fifth of the time of its events: one entry on each line.

A check of such files does not import PyYAML, which takes 11 ms.

An entry is a key with nothing, a text, or a list or map of texts between brackets after it; comments may stand anywhere. A source with
anything else in it, or with a mistake, has no answer here: `cqos_core.importers.yaml_tree` reads it from its events.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode
from cqos_core.model.regular import regular_expression
from cqos_core.model.rows import Pattern

if TYPE_CHECKING:
    import re
    from collections.abc import Iterable

    from cqos_core.importers.tree import Node
    from cqos_core.model.rows import LinesOf, Row

_DEEPEST: Final = 32
# Nothing here is an indicator of YAML, nor does it become one beside what may stand next to it.
_KEY: Final = r"[A-Za-z0-9_/][A-Za-z0-9_./-]{0,199}"
_TEXT: Final = r"[A-Za-z0-9_./][A-Za-z0-9_./()-]*(?:[ ][A-Za-z0-9_./()-]+)*"
_QUOTED: Final = r""""[ !#-\[\]-~]*"|'[ -&(-~]*'"""
_VALUE: Final = rf"(?:{_TEXT}|{_QUOTED})"
_LIST: Final = rf"\[[ ]*(?:{_VALUE}(?:,[ ]*{_VALUE})*)?[ ]*\]"
_FLAT: Final = rf"\{{[ ]*(?:{_KEY}:[ ]+{_VALUE}(?:,[ ]*{_KEY}:[ ]+{_VALUE})*)?[ ]*\}}"
_PART: Final = rf"{_KEY}:[ ]+(?:{_VALUE}|{_FLAT}|{_LIST})"
_MAP: Final = rf"\{{[ ]*(?:{_PART}(?:,[ ]*{_PART})*)?[ ]*\}}"
_OF_TEXTS: Final = rf"\{{[ ]*{_KEY}:[ ]+{_TEXT}(?:,[ ]*{_KEY}:[ ]+{_TEXT})*[ ]*\}}"
_LINE: Final = regular_expression(
    rf"([ ]*)(?:({_KEY}):(?:[ ]+(?:({_TEXT})|({_QUOTED})|({_OF_TEXTS})|(\{{[^\n#]*\}})|(\[[^\n#]*\])))?[ ]*)?(?:(?<![^ \n])\#[ -~]*)?(?:\n|\Z)"
)
_OF_TEXTS_AT: Final = 5
_IS_MAP: Final = regular_expression(_MAP)
_IS_LIST: Final = regular_expression(_LIST)
_PAIR: Final = regular_expression(rf"({_KEY}):[ ]+(?:({_TEXT})|({_QUOTED})|({_FLAT})|({_LIST}))")
_WORDS: Final = regular_expression(rf"({_KEY}):[ ]+({_TEXT})")
_NULL: Final = frozenset({"null", "Null", "NULL"})
_ITEM: Final = regular_expression(rf"({_TEXT})|({_QUOTED})")


def plain_tree(data: bytes) -> MappingNode | None:
    """Return the root of the only document of a source; None where that is not written in the plain form."""
    if not data.isascii() or b"${" in data:
        return None
    parser = _Plain(data.decode("ascii"))
    try:
        return parser.root()
    except _NotPlainError:
        vars(parser).clear()  # maps know what reads their entries, which shall not be a cycle
        return None


class EntryLines(MappingNode):
    """A map that has a line for each entry; its entries are made when they are read, if all are maps of texts between brackets.

    Attributes:
        rows: of such a map, for each entry the pattern and the texts of its settings around its key and the place of that:
            pattern, key, place, texts. None of any other.
        lines: of its source; set by what takes the rows.
    """

    __slots__ = ("_parser", "lines", "rows")
    rows: list[Row] | None
    lines: LinesOf

    def __init__(self, line: int | None, column: int | None, parser: _Plain) -> None:
        """Begin without entries."""
        self.line, self.column, self.end, self.repeated = line, column, None, None
        self._parser, self.rows = parser, []

    def __getattr__(self, name: str) -> Any:
        """Make the entries."""
        if name != "entries":
            raise AttributeError(name)
        self.entries = self._parser.entries(self.rows or (), self.line or 0, self.column or 0)
        return self.entries

    def are_settings(self, but: frozenset[str]) -> bool:
        """Whether the entries are rows of settings under other names than some."""
        patterns = {pattern for pattern, *_ in self.rows or ()}
        return bool(patterns) and but.isdisjoint([name for each in patterns for name, *_ in each.said[0]])


class _NotPlainError(Exception):
    """Something has to be read from the events of YAML."""


class _Plain:
    """Goes through one source."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._texts: dict[str, str] = {}  # equal ones are one object, whose hash is known from then on
        self._patterns: dict[tuple[str, ...], Pattern] = {}
        self._top = EntryLines(None, None, self)
        self._indent = -1
        self._above: list[tuple[int, EntryLines]] = []
        self._waiting: tuple[ScalarNode, int] | None = None  # a key without a value, and where one would stand

    def root(self) -> MappingNode:
        """Read all lines, and return the map that they are."""
        text, known, at, line = self.text, self._texts.setdefault, 0, 0
        size, next_line = len(text), _LINE.match
        while at < size:
            found = next_line(text, at)
            if found is None:
                raise _NotPlainError
            start, at, line = at, found.end(), line + 1
            name = found[2]
            if name is None:
                if text[at - 1] != "\n":  # the last line ends elsewhere to YAML
                    raise _NotPlainError
                continue
            column = found.end(1) - start
            if column != self._indent or self._waiting is not None:
                self._go_to(column, line)
            if found.lastindex == _OF_TEXTS_AT and self._is_row(found):
                continue
            entries, self._top.rows = self._top.entries, None
            if name in entries:
                raise _NotPlainError
            key = ScalarNode(known(name, name), line, column + 1, plain=True)
            value = self._value(found, start, line)
            if value is None:
                self._waiting = key, found.end(2) - start + 2
            else:
                entries[key.text] = (key, value)
        return self._end(line)

    def _go_to(self, column: int, line: int) -> None:
        """Go to the map whose keys stand at a column, which begins here if it is further right."""
        waiting, self._waiting = self._waiting, None
        if column > self._indent:
            self._above.append((self._indent, self._top))
            inner = EntryLines(line, column + 1, self)
            if waiting is not None:
                self._top.entries[waiting[0].text] = (waiting[0], inner)
            if (waiting is None and (self._indent >= 0 or column)) or len(self._above) > _DEEPEST:
                raise _NotPlainError
            self._indent, self._top = column, inner
            return
        self._nothing(waiting)
        while column < self._indent:
            self._close(self._top, line)
            self._indent, self._top = self._above.pop()
        if column != self._indent:
            raise _NotPlainError

    def _nothing(self, waiting: tuple[ScalarNode, int] | None) -> None:
        """Let a key that waits for its value state nothing."""
        if waiting is not None:
            key, column = waiting
            self._top.entries[key.text] = (key, ScalarNode("", key.line, column, plain=True))

    def _end(self, line: int) -> MappingNode:
        """End all maps after the last line, and return the outermost."""
        if self._indent < 0:
            raise _NotPlainError
        self._nothing(self._waiting)
        (_, _), *opened = *self._above, (0, self._top)
        del self._above, self._top  # maps know what reads their entries, which shall not be a cycle
        for _, each in opened:
            self._close(each, line + 1)
        return opened[0][1]

    def _close(self, ended: EntryLines, line: int) -> None:
        """End a map before a line."""
        ended.end = line
        if ended.rows and len({name for _, name, *_ in ended.rows}) < len(ended.rows):
            raise _NotPlainError

    def _is_row(self, found: re.Match[str]) -> bool:
        """Add a line with a map of texts between brackets as a row, if the lines of its map before it are rows."""
        rows, known = self._top.rows, self._texts.setdefault
        keys, texts = zip(*_WORDS.findall(found[_OF_TEXTS_AT]), strict=True)
        if rows is None or not _NULL.isdisjoint(texts):
            return False
        pattern = self._patterns.get(keys)
        if pattern is None:
            if len({*keys}) < len(keys):
                raise _NotPlainError
            said = tuple([(known(key, key), "", "", False) for key in keys]), ()
            pattern = self._patterns[keys] = Pattern(said, [*range(len(keys))])
        rows.append((pattern, known(found[2], found[2]), found.start(2), *[known(text, text) for text in texts]))
        return True

    def entries(self, rows: Iterable[Row], line: int, column: int) -> dict[str, tuple[ScalarNode, Node]]:
        """Return the entries that are rows of a map, which begins on a line and in a column."""
        made: dict[str, tuple[ScalarNode, Node]] = {}
        before = None
        for _, name, at, *_ in rows:
            start = at - column + 1
            line += 0 if before is None else self.text.count("\n", before, start)
            found, before = _LINE.match(self.text, start), start
            value = None if found is None else self._value(found, start, line)
            if value is None or name in made:
                raise _NotPlainError
            made[name] = ScalarNode(name, line, column, plain=True), value
        return made

    def _value(self, found: re.Match[str], start: int, line: int) -> Node | None:
        """Return the value on a line that begins at ``start``; None where the line has none."""
        match found.lastindex:
            case 3:
                text = self._texts.setdefault(found[3], found[3])
                return ScalarNode(text, line, found.start(3) - start + 1, plain=True)
            case 4:
                return ScalarNode(found[4][1:-1], line, found.start(4) - start + 1, plain=False)
            case 5:
                return self._map(*found.span(5), start, line)
            case 6 if _IS_MAP.fullmatch(self.text, *found.span(6)):
                return self._map(found.start(6), found.end(6), start, line)
            case 7 if _IS_LIST.fullmatch(self.text, *found.span(7)):
                return self._list(found.start(7), found.end(7), start, line)
            case 6 | 7:
                raise _NotPlainError
        return None

    def _map(self, start: int, end: int, line_start: int, line: int) -> MappingNode:
        """Read a map between brackets."""
        known, before = self._texts.setdefault, line_start - 1
        node = MappingNode(line, start - before, {}, line)
        entries = node.entries
        for found in _PAIR.finditer(self.text, start + 1, end):
            name, word, quoted, within, _ = found.groups()
            if name in entries:
                raise _NotPlainError
            key = ScalarNode(known(name, name), line, found.start() - before, plain=True)
            value: Node
            if word is not None:
                value = ScalarNode(known(word, word), line, found.start(2) - before, plain=True)
            elif quoted is not None:
                value = ScalarNode(quoted[1:-1], line, found.start(3) - before, plain=False)
            elif within is not None:
                value = self._map(found.start(4), found.end(4), line_start, line)
            else:
                value = self._list(found.start(5), found.end(5), line_start, line)
            entries[key.text] = (key, value)
        return node

    def _list(self, start: int, end: int, line_start: int, line: int) -> SequenceNode:
        """Read a list between brackets."""
        before = line_start - 1
        items: list[Node] = [
            ScalarNode(found[1] or found[2][1:-1], line, found.start() - before, plain=found[1] is not None)
            for found in _ITEM.finditer(self.text, start, end)
        ]
        return SequenceNode(line, start - before, items)
