"""Groups of one side of a topic, sorted by the values that a rule reads."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from cqos_core.language.relation import positions
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.matching.topic_groups import GroupKey
    from cqos_core.resolving.qos_profile import QosProfile


@dataclass(slots=True)
class ValueGroup:
    """Groups of one side that a rule cannot tell apart; ``mask`` has their bits."""

    first: GroupKey
    members: list[int] = field(default_factory=list)
    mask: int = 0

    @property
    def profile(self) -> QosProfile:
        """The values of one of them."""
        return self.first.profile


class ValueGroups:
    """The value groups of one side, in order, with look-up by mask."""

    def __init__(self, each: list[ValueGroup]) -> None:
        self.each = each

    def within(self, mask: int) -> list[ValueGroup]:
        """Return the value groups with bits in ``mask``."""
        return [self.each[at] for at in sorted({self._at[position] for position in positions(mask)})]

    def first(self, mask: int) -> ValueGroup:
        """Return the first value group in ``mask``, which has all or no bits of each."""
        return self.each[self._at[(mask & -mask).bit_length() - 1]]

    def count(self, mask: int) -> int:
        """Return the number of value groups with bits in ``mask``."""
        single, wide = self._by_width
        return (mask & single).bit_count() + sum(1 for one in wide if one.mask & mask)

    def by_tags(self, mask: int) -> Iterator[tuple[frozenset[int], int]]:
        """Yield the groups in ``mask``, as bits, by the acceptances that name them."""
        return ((tags, mask & same) for tags, same in self._tagged.items() if mask & same)

    @cached_property
    def _at(self) -> dict[int, int]:
        return {position: at for at, one in enumerate(self.each) for position in one.members}

    @cached_property
    def _by_width(self) -> tuple[int, list[ValueGroup]]:
        single = sum(one.mask for one in self.each if len(one.members) == 1)
        return single, [one for one in self.each if len(one.members) > 1]

    @cached_property
    def _tagged(self) -> dict[frozenset[int], int]:
        found: dict[frozenset[int], int] = {}
        for one in self.each:
            found[one.first.tags] = found.get(one.first.tags, 0) | one.mask
        return found


def value_groups(groups: Iterable[GroupKey], indices: Sequence[int]) -> ValueGroups:
    """Sort one side's groups by the values that a rule reads, and by the acceptances that name them."""
    found: dict[Any, ValueGroup] = {}
    for position, group in enumerate(groups):
        values = group.profile.values
        key = (tuple([values[index] for index in indices]), group.profile.unmatched, group.tags)
        each = found.get(key)
        if each is None:
            each = found[key] = ValueGroup(group)
        each.members.append(position)
        each.mask |= 1 << position
    return ValueGroups(list(found.values()))
