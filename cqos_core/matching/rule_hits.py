"""Hits: a rule that reports, and the groups of endpoints concerned. Findings are made of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import field
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from cqos_core.language.relation import positions
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.matching.judge import Violation
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.resolving.qos_profile import QosProfile

G = TypeVar("G")
MOST_COMBINATIONS: Final = 25
"""Distinct combinations of values that one rule reports on one topic; the rest is put together in one finding."""


@dataclass(slots=True)
class Hit(Generic[G]):
    """A finding without words: one rule, equal values on each side.

    Its groups are positions in a shape, or those of a topic once `with_topic_groups` replaced them.

    Attributes:
        publishers, subscribers: the groups concerned, in order, as keys.
        pairs: the number of pairs concerned.
        tags: acceptances that name all its endpoints.
        more: how many combinations of values are put together here, where there are too many to list; else 0.
        example: one of them: a group per role.
        reached: the positions of `subscribers` as bits, for rules over pairs.
    """

    violation: Violation
    publishers: dict[G, None] = field(default_factory=dict)
    subscribers: dict[G, None] = field(default_factory=dict)
    pairs: int = 0
    tags: frozenset[int] = frozenset()
    more: int = 0
    example: dict[str, G] = field(default_factory=dict)
    reached: int = 0

    def side(self, role: str) -> dict[G, None]:
        """The groups of one role."""
        return self.publishers if role == PUBLISHER else self.subscribers


def add_reached(hit: Hit[int], groups: Mapping[int, int], example: Sequence[int] = ()) -> None:
    """Add publisher groups, each with subscriber groups as bits; one of ``example``, if it is met, stands for them."""
    publisher, mask = next(iter(groups.items()))
    first = next((each for each in example if mask >> each & 1), (mask & -mask).bit_length() - 1)
    hit.example = hit.example or {PUBLISHER: publisher, SUBSCRIBER: first}
    hit.publishers.update(dict.fromkeys(groups))
    reached = reduce(or_, groups.values())
    hit.subscribers.update(dict.fromkeys(positions(reached & ~hit.reached)))
    hit.reached |= reached


class EndpointHits(dict[tuple[Any, ...], Hit[G]]):
    """Hits of rules over single endpoints: one for equal values; beyond a few combinations one for all others."""

    def __init__(self) -> None:
        self._listed = Counter[tuple[str, str, bool]]()

    def note(self, violation: Violation, role: str, members: G, profile: QosProfile, tags: frozenset[int]) -> None:
        """Add the report of a rule about one group."""
        start = (violation_key(violation), role, violation.unknown)
        key: tuple[Any, ...] = (*start, tuple(profile.values[use.index] for use in violation.bound.bound.uses), tags)
        further = key not in self and self._listed[start] >= MOST_COMBINATIONS
        if further:
            key = (*start, tags)
        elif key not in self:
            self._listed[start] += 1
        hit = self.setdefault(key, Hit(violation, tags=tags))
        hit.more += further
        hit.side(role)[members] = None
        if further and not hit.example:
            hit.example = {role: members}


def with_topic_groups(topic: MatchedTopic, hit: Hit[int]) -> Hit[EndpointGroup]:
    """Return a hit with the groups of a topic."""
    groups: Mapping[str, Sequence[EndpointGroup]] = {PUBLISHER: topic.publishers, SUBSCRIBER: topic.subscribers}
    return Hit(
        hit.violation,
        {topic.publishers[at]: None for at in hit.publishers},
        {topic.subscribers[at]: None for at in hit.subscribers},
        hit.pairs,
        hit.tags,
        hit.more,
        {role: groups[role][at] for role, at in hit.example.items()},
    )


def violation_key(violation: Violation) -> str:
    """Return a key that tells rules apart, and the severities of one rule."""
    return f"{violation.bound.rule.code} {violation.bound.rule.severity}"
