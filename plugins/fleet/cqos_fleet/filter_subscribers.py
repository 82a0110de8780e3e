"""Subscribers whose filters match more topics than the one of their own name.

For each such far topic: its subscribers, those of one participant that overlap, and those that have a partner.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.model.caches import keep

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

_REMEMBERED: Final = 100_000


class Visitors(NamedTuple):
    """The subscribers of a set of far topics.

    Attributes:
        groups: how many there are by far topic, end, and whether another subscriber of their participant is among them.
        overlapping: the owners that have several of them.
    """

    groups: Counter[tuple[int, int, bool]]
    overlapping: frozenset[int]


FAR: Final = {"far": "number", "owner": "number", "p": "number"}
"""The columns of the subscribers of far topics: number of the topic, owner, and end."""


class FarEnds:
    """The subscribers of far topics, as arrays in order of topic and owner.

    Attributes:
        p, owner: of each of them.
        met: whether each has a partner.
    """

    def __init__(self, number: int, batches: Iterable[Sequence[Sequence[int]]]) -> None:
        """Take the subscribers of ``number`` topics: columns of `FAR`, in their order."""
        self.owner, self.p, far = array("q"), array("q"), array("q")
        for topics, owners, ends in batches:
            far.extend(topics)
            self.owner.extend(owners)
            self.p.extend(ends)
        self.met = bytearray(len(far))
        self._starts = array("q", [bisect_left(far, each) for each in range(number + 1)])
        self._open = array("q", [last - first for first, last in pairwise(self._starts)])
        self._groups: dict[int, Counter[int]] = {}
        self._visitors: dict[int, Visitors] = {}

    def positions(self, far: int) -> range:
        """Return where the subscribers of a far topic are."""
        return range(self._starts[far], self._starts[far + 1])

    def groups(self, far: int) -> Counter[int]:
        """Return how many subscribers of a far topic there are by end."""
        found = self._groups.get(far)
        if found is None:
            of_topic = Counter(self.p[self._starts[far] : self._starts[far + 1]])
            found = keep(self._groups, far, of_topic, _REMEMBERED)
        return found

    def visitors(self, number: int, topics: Sequence[int]) -> Visitors:
        """Return the subscribers of the set of far topics of a number."""
        found = self._visitors.get(number)
        if found is None:
            found = keep(self._visitors, number, self._together(topics), _REMEMBERED)
        return found

    def _together(self, topics: Sequence[int]) -> Visitors:
        groups = Counter({(far, p, False): count for far in topics for p, count in self.groups(far).items()})
        # An owner with several of the topics has one that is not the largest of them.
        small = sorted(topics, key=lambda far: len(self.positions(far)))[:-1]
        candidates = dict.fromkeys(self.owner[at] for far in small for at in self.positions(far))
        overlapping = set()
        for owner in candidates:
            rows = [*self.of(owner, topics)]
            if len({far for far, _ in rows}) > 1:
                overlapping.add(owner)
                for far, at in rows:
                    p = self.p[at]
                    groups[far, p, False] -= 1
                    groups[far, p, True] += 1
        return Visitors(+groups, frozenset(overlapping))

    def of(self, owner: int, topics: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Yield the subscribers of one owner: far topic and position."""
        for far in topics:
            here = self.positions(far)
            for at in range(bisect_left(self.owner, owner, here.start, here.stop), here.stop):
                if self.owner[at] != owner:
                    break
                yield far, at

    def pair(self, far: int, p: int, only: Callable[[int], bool]) -> None:
        """Note that subscribers of a far topic and an end have a partner: those whose owner is wanted."""
        for at in self.positions(far) if self._open[far] else ():
            if self.p[at] == p and not self.met[at] and only(self.owner[at]):
                self.pair_one(far, at)

    def pair_one(self, far: int, at: int) -> None:
        """Note that the subscriber at a position has a partner."""
        self._open[far] -= not self.met[at]
        self.met[at] = True
