"""What rules say of one publisher and one subscriber that are alone on their topic, as most topics are.

Functions over values tell which rules report: one of each set of rules of `cqos_core.matching.rule_set`, looked up once for what
many profiles share. Where they tell it for certain, the same rules always say the same, so it is worked out once:
`cqos_core.matching.topic_shape` does that, and judges all other topics too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.matching.judge import (
    meeting_rules,
    of_one,
    pair_rules,
    read_in_worlds,
    refusing_rules,
    signal_rules,
    undecided_meetings,
)
from cqos_core.matching.topic_shape import QUIET
from cqos_core.model.memory import keep
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.language.compiled import Reporting
    from cqos_core.matching.topic_shape import ShapeResult
    from cqos_core.resolving.qos_profile import ProfileFrame, QosProfile
    from cqos_core.resolving.resolved import Resolved

_MOST_OUTCOMES: Final = 1_000
Reports: TypeAlias = "tuple[int, int, int]"
"""The rules that report: over both ends, over the publisher and over the subscriber, as bits."""
NOTHING: Final[Reports] = (0, 0, 0)
_Ends: TypeAlias = "tuple[QosProfile, QosProfile, bool, bool]"
"""Profiles of a publisher and a subscriber, and whether each was observed."""


class _Function(NamedTuple):
    """A function with a bit for each rule that may report.

    Attributes:
        counted: the bits that count.
        exact: the bits of rules that then report for certain.
        shift: where its bits stand among those of the others.
    """

    reporting: Reporting
    counted: int
    exact: int
    shift: int


_Functions: TypeAlias = "tuple[_Function, ...]"


class Outcomes(NamedTuple):
    """What is known of pairs of profiles that have as much in common as two others.

    Attributes:
        of_pair: what is asked of both ends.
        of_ends: what is asked of the publisher, and of the subscriber.
        results: what a topic comes to, by the rules that report.
    """

    of_pair: _Functions
    of_ends: tuple[_Functions, _Functions]
    results: dict[Reports, ShapeResult]

    def keep(self, reports: Reports, result: ShapeResult) -> None:
        """Keep what a topic comes to where these rules report."""
        keep(self.results, reports, result, _MOST_OUTCOMES)


_OUTCOMES: Final[dict[tuple[ProfileFrame, ProfileFrame, bool, bool], Outcomes]] = {}


def reporting_rules(one: Resolved, other: Resolved) -> tuple[Outcomes, Reports] | None:
    """Return which rules report on two endpoints that are alone on their topic; None where functions alone do not tell."""
    offering, requesting = one.kin, other.kin
    if offering.role != PUBLISHER:
        one, other, offering, requesting = other, one, requesting, offering
    if offering.role != PUBLISHER or requesting.role != SUBSCRIBER or one.is_copy or other.is_copy:
        return None
    known = _outcomes((one.like, other.like, offering.observed, requesting.observed))
    if known is None:
        return None
    here, there = one.known, other.known
    of_pair = _told(known.of_pair, here, there)
    of_publisher = _told(known.of_ends[0], here, here)
    of_subscriber = _told(known.of_ends[1], there, there)
    if of_pair is None or of_publisher is None or of_subscriber is None:
        return None
    return known, (of_pair, of_publisher, of_subscriber)


def _told(functions: _Functions, first: Sequence[Any], second: Sequence[Any]) -> int | None:
    """Return as bits the rules that report for certain; None where functions alone do not tell."""
    bits = 0
    for reporting, counted, exact, shift in functions:
        found = reporting(first, second) & counted
        if found:
            if found & ~exact:
                return None
            bits |= found << shift
    return bits


def _outcomes(ends: _Ends) -> Outcomes | None:
    """Return what is known of pairs of such profiles; None where functions do not tell all, or there are none yet."""
    publisher, subscriber, offering, requesting = ends
    if publisher.unread or publisher.refused or subscriber.unread or subscriber.refused:
        return None
    key = publisher.frame, subscriber.frame, offering, requesting
    known = _OUTCOMES.get(key)
    if known is None and (known := _new_outcomes(ends)):
        keep(_OUTCOMES, key, known)
    return known


def _new_outcomes(ends: _Ends) -> Outcomes | None:
    publisher, subscriber, offering, requesting = ends
    pack = publisher.pack
    if subscriber.needs or publisher.from_peers or subscriber.from_peers:
        return None
    # Where the rules of pairs have functions, others with as much in common are many.
    at_once = None not in [rules(pack).ready(publisher, subscriber) for rules in (meeting_rules, pair_rules)]
    assuming = read_in_worlds(pack, publisher.frame, 0) | read_in_worlds(pack, subscriber.frame, 1)

    def functions(asked: Sequence[tuple[Any, int, bool]], first: QosProfile, second: QosProfile) -> _Functions | None:
        """Take rules, the bits of those that count, and whether all that a rule says follows from the fact that it reports."""
        made: list[_Function] = []
        shift = 0
        for rules, concerned, plain in asked:
            function = rules.ready(first, second, at_once=at_once)
            if function is None:
                return None
            reporting, counted, exact = function
            if counted & concerned:
                made.append(_Function(reporting, counted & concerned, exact if plain else 0, shift))
            shift += len(rules.rules)
        return tuple(made)

    over_both = [(meeting_rules(pack), -1, False), (pair_rules(pack), -1, True)]
    over_both += [(undecided_meetings(pack), assuming, False)] if assuming else []
    of_pair = functions(over_both, publisher, subscriber)
    of_ends = [
        functions(
            [
                (of_one(pack, role, seen), -1, True),
                (refusing_rules(pack, seen), -1, True),
                (signal_rules(pack), -1, False),
            ],
            profile,
            profile,
        )
        for profile, role, seen in ((publisher, PUBLISHER, offering), (subscriber, SUBSCRIBER, requesting))
    ]
    if of_pair is None or of_ends[0] is None or of_ends[1] is None:
        return None
    return Outcomes(of_pair, (of_ends[0], of_ends[1]), {NOTHING: QUIET})
