"""Topics with one side only whose names may be those of others: few of many, so that only these are compared letter by letter.

Two names that differ by a typing error have the same digits, and lengths that differ by one at most. Two that a pack folds to
one name have that in common. No other names are similar, so a few numbers for each name are enough.
"""

from __future__ import annotations

from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    import narwhals as nw

    from cqos_core.packs.topic_matching import TopicMatching
    from cqos_fleet.table_store import TableStore

    Batches = Callable[[], Iterable[Sequence[Sequence[str]]]]

NAMED: Final = {"system": "text", "topic": "text", "sides": "number"}
"""The columns of topics, with what is on each."""
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


def _numbers(batch: Sequence[Sequence[str]], meeting: TopicMatching) -> list[list[int]]:
    """Return numbers of the topics of a batch: a list by digits and length, and one for each fold."""
    systems, names = batch
    known = zip(systems, _digits(names), names, strict=True)
    found = [[hash((system, digits)) + len(name) for system, digits, name in known]]
    for at, (_, fold) in enumerate(meeting.folds):
        found.append([hash((system, at, fold(name))) for system, name in zip(systems, names, strict=True)])
    return found


def _meeting(numbers: Sequence[Sequence[int]], seen: set[int]) -> list[int]:
    """Return the positions of topics that have a number in common with those seen; lengths may differ by one."""
    by_length, *folded = numbers
    found = {at for at, each in enumerate(by_length) if each in seen or each - 1 in seen or each + 1 in seen}
    return sorted(found.union(*({at for at, each in enumerate(some) if each in seen} for some in folded)))


def keep_similar(
    names: Mapping[int, nw.LazyFrame[Any]],
    meeting: TopicMatching,
    store: TableStore,
    more: Iterable[tuple[str, str, int]] = (),
) -> nw.LazyFrame[Any]:
    """Keep the topics that `similar_topics` yields of tables by what is on a topic, and more, as table ``similar``.

    Table ``names`` with the number of each kind has the names that were compared.
    """
    for sides, topics in names.items():
        store.keep(f"names{sides}", topics.select("system", "topic"))
    found = similar_topics({sides: partial(store.batches, f"names{sides}") for sides in names}, meeting)
    with store.spooled("similar", NAMED) as out:
        for row in chain(found, more):
            out.add(*row)
    return store.scan("similar")


def similar_topics(names: Mapping[int, Batches], meeting: TopicMatching) -> Iterator[tuple[str, str, int]]:
    """Yield the topics of one side that may be meant by another, or mean it, and those of both sides that may be meant.

    Args:
        names: by what is on a topic, what gives batches of such topics: their systems, and their names.
        meeting: of the pack.

    Yields:
        System, name, and what is on the topic; see `OFFERED`.
    """
    seen: dict[int, set[int]] = {sides: set() for sides in (OFFERED, REQUESTED, BUSY)}
    for sides in (OFFERED, REQUESTED):
        for batch in names[sides]():
            seen[sides].update(*_numbers(batch, meeting))
    alone = seen[OFFERED] | seen[REQUESTED]
    for batch in names[BUSY]() if alone else ():
        numbers = _numbers(batch, meeting)
        for at in _meeting(numbers, alone):
            seen[BUSY].update(each[at] for each in numbers)
            yield batch[0][at], batch[1][at], BUSY
    del alone
    for sides, other in ((OFFERED, REQUESTED), (REQUESTED, OFFERED)):
        others = seen[other] | seen[BUSY]
        for batch in names[sides]():
            for at in _meeting(_numbers(batch, meeting), others):
                yield batch[0][at], batch[1][at], sides
