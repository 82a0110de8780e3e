"""Tables of text that fit into a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import Any, Final

from cqos_core.formatters.terminal import cells, clean

_GAP: Final = "  "
_WHOLE: Final[dict[str, Any]] = {"break_long_words": False, "break_on_hyphens": False}


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
        broken = [textwrap.wrap(text, max(room, 1), **_WHOLE) or [""] for text, room in zip(row, widths, strict=True)]
        for pieces in zip_longest(*broken, fillvalue=""):
            padded = [piece + " " * (room - cells(piece)) for piece, room in zip(pieces, widths, strict=True)]
            if number:
                padded = [paint(piece, column) for column, piece in enumerate(padded)]
            lines.append(_GAP.join(padded).rstrip())
    return lines


def _longest_word(column: Sequence[str]) -> int:
    return max(cells(word) for text in column for word in (text.split() or [""]))


def _fitting(widths: list[int], floors: Sequence[int], width: int) -> list[int]:
    """Narrow the widest columns until all fit, or all have their longest word only."""
    excess = sum(widths) + len(_GAP) * (len(widths) - 1) - width
    while excess > 0 and (giving := [index for index, room in enumerate(widths) if room > floors[index]]):
        widths[max(giving, key=widths.__getitem__)] -= 1
        excess -= 1
    return widths
