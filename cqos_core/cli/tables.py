"""Tables of text that fit into a terminal."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

from cqos_core.formatters.terminal import cells, clean

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_GAP: Final = "  "


def table(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    width: int,
    paint: Callable[[str, int], str] = lambda text, _column: text,
) -> list[str]:
    """Return the lines of a table; cells that are too long for ``width`` columns of a terminal are broken at spaces.

    Args:
        header: names of the columns.
        rows: texts, as many as there are columns.
        width: columns of the terminal.
        paint: colours a piece of text, padding and all, for the column of that number; not asked for the header.
    """
    texts = [[clean(text) for text in row] for row in (header, *rows)]
    columns = list(zip(*texts, strict=True))
    widths = _fitting([max(map(cells, column)) for column in columns], list(map(_longest_word, columns)), width)
    lines = []
    for number, row in enumerate(texts):
        broken = [_broken(text, room) for text, room in zip(row, widths, strict=True)]
        for pieces in _side_by_side(broken):
            padded = [_padded(piece, room) for piece, room in zip(pieces, widths, strict=True)]
            if number:
                padded = [paint(piece, column) for column, piece in enumerate(padded)]
            lines.append(_GAP.join(padded).rstrip())
    return lines


def _longest_word(column: Sequence[str]) -> int:
    return max(cells(word) for text in column for word in (text.split() or [""]))


def _fitting(widths: list[int], floors: Sequence[int], width: int) -> list[int]:
    """Take from the widest columns until all fit, or none can give any more."""
    excess = sum(widths) + len(_GAP) * (len(widths) - 1) - width
    while excess > 0:
        giving = [index for index in range(len(widths)) if widths[index] > floors[index]]
        if not giving:
            break
        widest = max(giving, key=lambda index: widths[index])
        widths[widest] -= 1
        excess -= 1
    return widths


def _broken(text: str, room: int) -> list[str]:
    return textwrap.wrap(text, max(room, 1), break_long_words=False, break_on_hyphens=False) or [""]


def _side_by_side(columns: Sequence[Sequence[str]]) -> list[list[str]]:
    height = max(map(len, columns))
    return [[column[line] if line < len(column) else "" for column in columns] for line in range(height)]


def _padded(text: str, room: int) -> str:
    return text + " " * (room - cells(text))
