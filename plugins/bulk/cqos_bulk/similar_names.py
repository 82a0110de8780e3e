"""Topics with one side only whose names may be those of others: few of many, so that only these are compared letter by letter.

Two names that differ by a typing error have the same digits, and lengths that differ by one at most. Two that a pack folds to
one name have that in common. No other names are similar, so a few numbers for each name are enough.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.packs.meeting import Meeting

    Batches = Callable[[], Iterable[Sequence[Sequence[str]]]]

OFFERED, REQUESTED, BUSY = 1, 2, 4
"""What is on a topic: publishers only, subscribers only, or both."""


class _OnlyDigits(dict[int, "str | None"]):
    """Which characters of names count: digits, and the end of a line."""

    def __missing__(self, code: int) -> str | None:
        letter = chr(code)
        self[code] = letter if letter.isdigit() or letter == "\n" else None
        return self[code]


_ONLY_DIGITS: Final = _OnlyDigits()


def _digits(names: Sequence[str]) -> list[str]:
    """Return the digits of each name, of many at once."""
    found = "\n".join(names).translate(_ONLY_DIGITS).split("\n")
    return found if len(found) == len(names) else [name.translate(_ONLY_DIGITS).replace("\n", "") for name in names]


def _numbers(batch: Sequence[Sequence[str]], meeting: Meeting) -> Iterator[tuple[str, str, int, list[int]]]:
    """Yield system, name, and the numbers of each topic of a batch: by digits and length, and by each fold."""
    systems, names = batch
    folds = [(at, fold) for at, (_, fold) in enumerate(meeting.folds)]
    for system, name, digits in zip(systems, names, _digits(names), strict=True):
        folded = [hash((system, at, fold(name))) for at, fold in folds]
        yield system, name, hash((system, digits)) + len(name), folded


class _Seen:
    """By a number of what similar names have in common, what is on topics with it."""

    def __init__(self) -> None:
        self.sides: dict[int, int] = {}

    def add(self, number: int, folded: list[int], sides: int) -> None:
        """Note a topic."""
        for each in (number, *folded):
            self.sides[each] = self.sides.get(each, 0) | sides

    def meets(self, number: int, folded: list[int], sides: int) -> bool:
        """Whether a topic with one of ``sides`` may have a similar name."""
        seen = self.sides
        return any(seen.get(each, 0) & sides for each in (number, number - 1, number + 1, *folded))


def similar_topics(names: Mapping[int, Batches], meeting: Meeting) -> Iterator[tuple[str, str, int]]:
    """Yield the topics of one side that may be meant by another, or mean it, and those of both sides that may be meant.

    Args:
        names: by what is on a topic, what gives batches of such topics: their systems, and their names.
        meeting: of the pack.

    Yields:
        System, name, and what is on the topic; see `OFFERED`.
    """
    seen = _Seen()

    def topics(sides: int) -> Iterator[tuple[str, str, int, list[int]]]:
        for batch in names[sides]():
            yield from _numbers(batch, meeting)

    for sides in (OFFERED, REQUESTED):
        for _, _, number, folded in topics(sides):
            seen.add(number, folded, sides)
    for system, name, number, folded in topics(BUSY) if seen.sides else ():
        if seen.meets(number, folded, OFFERED | REQUESTED):
            seen.add(number, folded, BUSY)
            yield system, name, BUSY
    for sides in (OFFERED, REQUESTED):
        for system, name, number, folded in topics(sides):
            if seen.meets(number, folded, OFFERED + REQUESTED + BUSY - sides):
                yield system, name, sides
