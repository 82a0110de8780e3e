"""What rules say of one publisher and one subscriber that are alone on their topic, as most are, and so the verdict of the two.

Functions over values tell which rules may report: one for those over both ends, and one for those about an end, which is asked once.
Where the same rules report, and those that are not certain read equal values, a topic comes to the same: `cqos_core.matching.topic_outcomes`
works that out once.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.language.relation import positions
from cqos_core.matching.judge import about_one, over_both
from cqos_core.matching.topic_groups import GroupKey, TopicShape
from cqos_core.matching.topic_outcomes import QUIET, judge_shape
from cqos_core.model.caches import MOST_LETTERS, keep, letters
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.language.condition_compiler import CompiledConditions, Reporting
    from cqos_core.matching.rule_set import RuleSet
    from cqos_core.matching.topic_outcomes import TopicOutcome
    from cqos_core.resolving.parts import ProfileParts
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

_MOST_OUTCOMES: Final = 1_000


class EndKind:
    """Ends of one role whose profiles differ in known values only.

    Attributes:
        like: the profile of one of them.
        observed: whether they were observed.
        rules: those about one of them.
        shift: where the bits of these rules stand among those of all rules that speak of a pair.
    """

    def __init__(self, like: QosProfile, role: str, observed: bool) -> None:  # noqa: FBT001 - as in `GroupKey`
        """Take what they have in common."""
        pack = like.pack
        self.like, self.observed = like, observed
        self.rules: RuleSet = about_one(pack, role, observed)
        self.shift = len(over_both(pack).rules)
        if role == SUBSCRIBER:
            self.shift += len(about_one(pack, PUBLISHER, False).rules)

    @cached_property
    def function(self) -> CompiledConditions:
        """The function with a bit for each of these rules that may report."""
        function = self.rules.function(self.like, self.like, at_once=True)
        assert function is not None  # noqa: S101 - at once
        return function


_KINDS: Final[dict[tuple[object, ...], EndKind]] = {}


def kind_of(like: QosProfile, role: str, observed: bool) -> EndKind:  # noqa: FBT001 - as in `GroupKey`
    """Return the kind of an end from a profile that differs from its own in known values only."""
    key = (like.frame, like.unread, like.refused, role, observed)
    return _KINDS.get(key) or keep(_KINDS, key, EndKind(like, role, observed))


class PairEnd:
    """One end of such a pair; rules about it alone are asked once.

    Attributes:
        kind: what it has in common with others.
        parts: of its profile, where that is not made yet.
        values: those of its profile that are known.
        bits: of the rules about it that may report.
    """

    __slots__ = ("_like", "bits", "kind", "parts", "values")

    def __init__(self, kind: EndKind, like: QosProfile, parts: ProfileParts | None) -> None:
        """Take its profile; where there are parts of that, one of the same kind."""
        self.kind = kind
        self._like, self.parts = like, parts
        self.values: Sequence[Any] = like.known if parts is None else parts.known
        self.bits = kind.function.reporting(self.values, self.values) << kind.shift

    @property
    def profile(self) -> QosProfile:
        """Its profile; most outcomes are known without."""
        return self._like if self.parts is None else self.parts.made()[0]


_Read: TypeAlias = "tuple[tuple[int, ...], tuple[int, ...]]"


class _Outcomes(NamedTuple):
    """What is known of pairs of two kinds.

    Attributes:
        reporting: the function with a bit for each of the rules over both ends that may report.
        results: what a topic comes to, by the bits of the rules that may report, and by what those read that are not certain.
        inexact: the bits of the latter.
        read: by such bits, the positions of the values that these rules read of each end.
    """

    reporting: Reporting
    results: dict[object, TopicOutcome]
    inexact: int
    read: dict[int, _Read]


_OUTCOMES: Final[dict[tuple[EndKind, EndKind], _Outcomes]] = {}


def _outcomes(publisher: EndKind, subscriber: EndKind, *, at_once: bool) -> _Outcomes | None:
    """Return what is known of pairs of two kinds; None before they are enough for a function: ``at_once`` they are expected to be."""
    rules = over_both(publisher.like.pack)
    function = rules.function(publisher.like, subscriber.like, at_once=at_once)
    if function is None:
        return None
    inexact = (1 << publisher.shift) - 1 & ~function.exact
    for each in (publisher, subscriber):
        inexact |= ((1 << len(each.rules.rules)) - 1 & ~each.function.exact) << each.shift
    of_profiles = (code for each in (publisher, subscriber) for code in (*each.like.unread, *each.like.refused))
    results: dict[object, TopicOutcome] = {} if any(of_profiles) else {0: QUIET}
    return keep(_OUTCOMES, (publisher, subscriber), _Outcomes(function.reporting, results, inexact, {}))


def outcome(publisher: PairEnd, subscriber: PairEnd, known: _Outcomes | None = None) -> TopicOutcome:
    """Return what a topic with these two ends comes to; they need nothing, and take no values from each other.

    ``known``: what is known of pairs of their kinds, for one who looked it up.
    """
    if known is None:
        kinds = publisher.kind, subscriber.kind
        known = _OUTCOMES.get(kinds) or _outcomes(*kinds, at_once=True)
        assert known is not None  # noqa: S101 - at once
    bits = known.reporting(publisher.values, subscriber.values) | publisher.bits | subscriber.bits
    return known.results.get(bits) or _result(known, bits, publisher, subscriber)


def _result(known: _Outcomes, bits: int, publisher: PairEnd, subscriber: PairEnd) -> TopicOutcome:
    key: object = bits
    left = bits & known.inexact
    if left:
        first, second = known.read.get(left) or keep(known.read, left, _read(left, publisher.kind, subscriber.kind))
        key = (bits, *[publisher.values[at] for at in first], *[subscriber.values[at] for at in second])
        found = known.results.get(key)
        if found is not None:
            return found
    sides = ((GroupKey(each.profile, each.kind.observed, frozenset(), False, 1),) for each in (publisher, subscriber))
    found = judge_shape(TopicShape(publisher.kind.like.pack, *sides))
    return keep(known.results, key, found, _MOST_OUTCOMES) if letters(key) <= MOST_LETTERS else found


def _read(left: int, publisher: EndKind, subscriber: EndKind) -> _Read:
    """Return which values some rules read of each end."""
    found: tuple[dict[int, None], dict[int, None]] = ({}, {})
    both = over_both(publisher.like.pack).rules
    for position in positions(left):
        read: tuple[Sequence[int], Sequence[int]]
        if position < publisher.shift:
            read = both[position].bound.sides
        else:
            kind = publisher if position < subscriber.shift else subscriber
            at = position - kind.shift
            bound = kind.rules.rules[at].bound
            if kind.rules.bits["signal"] >> at & 1:  # which may be over all of either side
                read = ((*bound.own, *bound.aggregated),) * 2
            else:
                read = (bound.own, ()) if kind is publisher else ((), bound.own)
        for values, places in zip(found, read, strict=True):
            values.update(dict.fromkeys(places))
    return tuple(found[0]), tuple(found[1])


def outcome_of(one: Resolved, other: Resolved) -> TopicOutcome | None:
    """Return what a topic with these two endpoints alone comes to.

    None where they are no such pair, and before there are enough like them for functions.
    """
    offering, requesting = one.representative, other.representative
    if offering.role != PUBLISHER:
        one, other, offering, requesting = other, one, requesting, offering
    if offering.role != PUBLISHER or requesting.role != SUBSCRIBER or one.is_copy or other.is_copy:
        return None
    first, second = one.like, other.like
    if second.needs or first.from_peers or second.from_peers:
        return None
    kinds = kind_of(first, PUBLISHER, offering.observed), kind_of(second, SUBSCRIBER, requesting.observed)
    known = _OUTCOMES.get(kinds) or _outcomes(*kinds, at_once=False)
    if known is None:
        return None
    return outcome(PairEnd(kinds[0], first, one.parts), PairEnd(kinds[1], second, other.parts), known)
