"""Converts places to ranges of the protocol: zero-based lines, columns in the units of the client."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from lsprotocol.types import Position, PositionEncodingKind, Range

from cqos_core.model.dataclass import dataclass
from cqos_core.model.encoding import Lines, codec, decode, encoding_of
from cqos_core.model.excerpt import exact, span

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.source import Replacement

_ASTRAL = 0xFFFF
START = Range(Position(0, 0), Position(0, 0))
"""The range of findings without a place."""


def encoded(text: str) -> bytes:
    """Return the bytes of a text in the encoding that it declares."""
    data = text.encode("utf-8", "replace")
    declared = codec(encoding_of(data)) or "utf-8"
    return data if declared == "utf-8" else text.encode(declared, "replace")


@lru_cache(maxsize=64)
def lines_of(data: bytes) -> Lines:
    """Return the lines of a source."""
    return Lines(decode(data))


@dataclass(frozen=True, slots=True)
class Units:
    """Counts characters in the units of the client: UTF-16, or another encoding that both chose."""

    encoding: str = PositionEncodingKind.Utf16.value

    def count(self, text: str) -> int:
        """Return how many units a text has."""
        if self.encoding == PositionEncodingKind.Utf32.value:
            return len(text)
        if self.encoding == PositionEncodingKind.Utf8.value:
            return len(text.encode("utf-8", "replace"))
        return len(text) + (0 if text.isascii() else sum(ord(each) > _ASTRAL for each in text))

    def characters(self, line: str, units: int) -> int:
        """Return how many characters the first ``units`` of a line are; a split character is counted."""
        if line.isascii() or self.encoding == PositionEncodingKind.Utf32.value:
            return min(units, len(line))
        passed = 0
        for number, each in enumerate(line):
            if passed >= units:
                return number
            passed += self.count(each)
        return len(line)

    def position(self, lines: Lines, line: int, column: int) -> Position:
        """Return the position of a one-based line and column."""
        return Position(line - 1, self.count(lines.line(line)[: column - 1]))

    def at(self, lines: Lines, position: Position) -> tuple[int, int]:
        """Return the one-based line and column of a position."""
        line = position.line + 1
        return line, self.characters(lines.line(line), position.character) + 1

    def range(self, lines: Lines, line: int, column: int, width: int) -> Range:
        """Return the range of some characters of one line."""
        return Range(self.position(lines, line, column), self.position(lines, line, column + width))

    def replaced(self, lines: Lines, change: Replacement) -> Range:
        """Return the range of what an edit replaces."""
        first, last = lines.position(change.start), lines.position(change.end)
        return Range(self.position(lines, *first), self.position(lines, *last))

    def of(self, place: Place | None, sources: Mapping[str, bytes]) -> Range:
        """Return the range of the value, attribute or tag at a place; the start of the file if it has no line."""
        found = located(place, sources)
        return START if found is None else self.range(lines_of(sources[found[0]]), *found[1:])


def located(place: Place | None, sources: Mapping[str, bytes]) -> tuple[str, int, int, int] | None:
    """Return source, line, column and width of a place; None if its line or source is not known."""
    if place is None or place.line is None or place.source not in sources:
        return None
    place = exact([place], sources)[place]
    lines = lines_of(sources[place.source])
    shown = span(place, sources)
    if place.line is None or shown is None:
        return None
    text = lines.line(place.line)
    column = len(text) - len(text.lstrip()) + 1 if place.column is None else min(place.column, len(text) + 1)
    return place.source, place.line, column, max(1, min(shown.width, len(text) - column + 1))
