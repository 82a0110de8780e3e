"""Findings on their way through what puts them together, kept so that a change of one costs what it is put together with."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

    from cqos_core.checking.findings import Made


@dataclass(frozen=True, slots=True, eq=False)
class Item:
    """A finding on its way, compared by identity.

    Attributes:
        order: its place among those that it may be put together with.
        excuses: positions of the acceptances that excuse it.
    """

    order: tuple[Any, ...]
    made: Made
    excuses: Sequence[int] = ()


class Stage:
    """Puts items with equal keys together; items that come and go make others come and go."""

    def __init__(
        self, key_of: Callable[[Item], Hashable], together: Callable[[Sequence[Item]], Sequence[Item]]
    ) -> None:
        """Put items together that ``key_of`` gives equal keys, by ``together``, which is given them in their order."""
        self._key_of = key_of
        self._together = together
        self._items: dict[Hashable, list[Item]] = {}
        self._made: dict[Hashable, Sequence[Item]] = {}

    def change(self, gone: Iterable[Item], came: Iterable[Item]) -> tuple[list[Item], list[Item]]:
        """Take items away and add others; return which results go and which come."""
        touched: dict[Hashable, None] = {}
        for each in gone:
            key = self._key_of(each)
            self._items[key].remove(each)
            touched[key] = None
        for each in came:
            key = self._key_of(each)
            self._items.setdefault(key, []).append(each)
            touched[key] = None
        old: list[Item] = []
        new: list[Item] = []
        for key in touched:
            old += self._made.pop(key, ())
            items = self._items[key]
            if items:
                items.sort(key=attrgetter("order"))
                self._made[key] = tuple(self._together(items))
                new += self._made[key]
            else:
                del self._items[key]
        return old, new

    def __iter__(self) -> Iterator[Item]:
        """All results."""
        for made in self._made.values():
            yield from made
