"""Subscribers that hear more topics than that of their own name: those of each topic, those of one participant that overlap, those with a partner."""

from __future__ import annotations

from array import array
from collections import Counter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

_REMEMBERED: Final = 100_000


class Visitors(NamedTuple):
    """The subscribers of a set of far topics.

    Attributes:
        groups: how many there are by far topic, end, and whether another subscriber of their participant is among them.
        overlapping: the owners that have several of them.
    """

    groups: Counter[tuple[int, int, bool]]
    overlapping: frozenset[int]


class FarEnds:
    """The subscribers of far topics, as arrays in order of topic and owner."""

    def __init__(self) -> None:
        """Begin without any."""
        self._added = tuple(array("q") for _ in range(3))
        self._visitors: dict[int, Visitors] = {}

    def add(self, far: int, p: int, owner: int) -> None:
        """Add one."""
        for column, value in zip(self._added, (far, p, owner), strict=True):
            column.append(value)

    def settle(self, number: int) -> None:
        """Put those of ``number`` far topics in order, when all are added."""
        import numpy as np

        far, p, owner = (np.frombuffer(each, dtype=np.int64) if each else np.empty(0, np.int64) for each in self._added)
        order = np.lexsort((p, owner, far))
        self.p, self.owner = p[order], owner[order]
        self._starts = np.searchsorted(far[order], np.arange(number + 1))
        self.met = np.zeros(len(order), dtype=bool)
        self._open = np.diff(self._starts)
        self._groups: dict[int, Counter[int]] = {}

    def slice(self, far: int) -> slice:
        """Return where the subscribers of a far topic are."""
        return slice(int(self._starts[far]), int(self._starts[far + 1]))

    def groups(self, far: int) -> Counter[int]:
        """Return how many subscribers of a far topic there are by end."""
        found = self._groups.get(far)
        if found is None:
            if len(self._groups) >= _REMEMBERED:
                self._groups.clear()
            found = self._groups[far] = Counter(self.p[self.slice(far)].tolist())
        return found

    def visitors(self, number: int, topics: Sequence[int]) -> Visitors:
        """Return the subscribers of the set of far topics of a number."""
        found = self._visitors.get(number)
        if found is None:
            if len(self._visitors) >= _REMEMBERED:
                self._visitors.clear()
            found = self._visitors[number] = self._together(topics)
        return found

    def _together(self, topics: Sequence[int]) -> Visitors:
        groups = Counter({(far, p, False): count for far in topics for p, count in self.groups(far).items()})
        # Who is among several is among those of a smaller topic.
        small = sorted(topics, key=lambda far: self._starts[far + 1] - self._starts[far])[:-1]
        candidates = dict.fromkeys(owner for far in small for owner in self.owner[self.slice(far)].tolist())
        overlapping = set()
        for owner in candidates:
            rows = [*self.of(owner, topics)]
            if len({far for far, _ in rows}) > 1:
                overlapping.add(owner)
                for far, at in rows:
                    p = int(self.p[at])
                    groups[far, p, False] -= 1
                    groups[far, p, True] += 1
        return Visitors(+groups, frozenset(overlapping))

    def of(self, owner: int, topics: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Yield the subscribers of one owner: far topic and position."""
        for far in topics:
            here = self.slice(far)
            own = self.owner[here]
            first, last = (int(own.searchsorted(owner, side)) for side in ("left", "right"))
            for at in range(here.start + first, here.start + last):
                yield far, at

    def meet(self, far: int, p: int, only: Any) -> None:
        """Note that subscribers of a far topic and an end have a partner.

        Args:
            far: the topic.
            p: the end.
            only: from the owners, as an array, which of them; None: all.
        """
        if self._open[far]:
            here = self.slice(far)
            found = self.p[here] == p
            if only is not None:
                found &= only(self.owner[here])
            self.met[here] |= found
            self._open[far] = int((~self.met[here]).sum())


def among(owners: Collection[int], *, wanted: bool) -> Any:
    """Return what says which owners of an array are among some, or are not."""
    import numpy as np

    listed = np.fromiter(owners, dtype=np.int64, count=len(owners))
    return lambda array: np.isin(array, listed, invert=not wanted)
