"""Topics of one publisher and one subscriber, as most topics are: functions alone tell which rules report on them.

The functions are those of `cqos_core.matching.rule_set`, looked up once for what many profiles have in common. Where the same rules
report for certain, the result is the same. `cqos_core.matching.topic_shape` makes it, once, and takes all other topics.
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
    from cqos_core.resolving.resolved import ProfileFrame, QosProfile, Resolved

_MOST_RESULTS: Final = 1_000
_Ends: TypeAlias = "tuple[QosProfile, QosProfile, bool, bool]"
"""Profiles of a publisher and a subscriber, and whether either was observed."""


class _Test(NamedTuple):
    """A function with a bit for each rule that may report.

    Attributes:
        counted: the bits that count.
        exact: the bits of rules that then report for certain.
        shift: where its bits stand among those of all functions.
        first, second: the ends that it reads: 0 the publisher, 1 the subscriber.
    """

    reporting: Reporting
    counted: int
    exact: int
    shift: int
    first: int
    second: int


class PlainPairs(NamedTuple):
    """What functions tell of pairs of profiles that have as much in common as two others.

    Attributes:
        tests: what is asked of two profiles, of the publisher's, and of the subscriber's.
        results: by the bits of the rules that report.
    """

    tests: tuple[_Test, ...]
    results: dict[int, ShapeResult]

    def keep(self, bits: int, result: ShapeResult) -> None:
        """Keep the result where these rules report."""
        if len(self.results) >= _MOST_RESULTS:
            self.results.clear()
        self.results[bits] = result


_KNOWN: Final[dict[tuple[ProfileFrame, ProfileFrame, bool, bool], PlainPairs]] = {}


def reporting_rules(one: Resolved, other: Resolved) -> tuple[PlainPairs, int] | None:
    """Return which rules report on two endpoints that are alone on their topic, as bits; None where functions alone do not tell."""
    if one.kin.role != PUBLISHER:
        one, other = other, one
    if one.kin.role != PUBLISHER or other.kin.role != SUBSCRIBER or one.is_copy or other.is_copy:
        return None
    known = _functions((one.like, other.like, one.kin.observed, other.kin.observed))
    bits = None if known is None else _bits(known, one.known, other.known)
    return None if known is None or bits is None else (known, bits)


def _functions(ends: _Ends) -> PlainPairs | None:
    """Return what functions tell of such profiles; None where they do not tell all."""
    publisher, subscriber, offering, requesting = ends
    if publisher.unread or publisher.refused or subscriber.unread or subscriber.refused:
        return None
    key = publisher.frame, subscriber.frame, offering, requesting
    known = _KNOWN.get(key)
    if known is None and (known := _known(ends)):
        keep(_KNOWN, key, known)
    return known


def _bits(known: PlainPairs, *ends: Sequence[Any]) -> int | None:
    """Return as bits the rules that report for certain; None where functions alone do not tell."""
    bits = 0
    for reporting, counted, exact, shift, first, second in known.tests:
        found = reporting(ends[first], ends[second]) & counted
        if found:
            if found & ~exact:
                return None
            bits |= found << shift
    return bits


def _known(ends: _Ends) -> PlainPairs | None:
    """Return what is known of profiles that have as much in common with others as these; None before there are functions for it."""
    publisher, subscriber, offering, requesting = ends
    pack = publisher.pack
    if subscriber.needs or publisher.from_peers or subscriber.from_peers:
        return None
    # Where the rules of pairs have functions, others with as much in common are many.
    at_once = None not in [rules(pack).ready(publisher, subscriber) for rules in (meeting_rules, pair_rules)]
    sides = (publisher, PUBLISHER, offering), (subscriber, SUBSCRIBER, requesting)
    assuming = read_in_worlds(pack, publisher.frame, 0) | read_in_worlds(pack, subscriber.frame, 1)
    # Rules, the bits of those that count, and whether all that a rule says follows from the fact that it reports.
    found = [
        [
            (meeting_rules(pack), publisher, subscriber, -1, False),
            (pair_rules(pack), publisher, subscriber, -1, True),
            *([(undecided_meetings(pack), publisher, subscriber, assuming, False)] if assuming else ()),
        ],
        *(
            [
                (of_one(pack, role, seen), profile, profile, -1, True),
                (refusing_rules(pack, seen), profile, profile, -1, True),
                (signal_rules(pack), profile, profile, -1, False),
            ]
            for profile, role, seen in sides
        ),
    ]
    tests: list[_Test] = []
    shift = 0
    for ends_of, asked in zip(((0, 1), (0, 0), (1, 1)), found, strict=True):
        for rules, first, second, concerned, plain in asked:
            function = rules.ready(first, second, at_once=at_once)
            if function is None:
                return None
            reporting, counted, exact = function
            if counted & concerned:
                tests.append(_Test(reporting, counted & concerned, exact if plain else 0, shift, *ends_of))
            shift += len(rules.rules)
    return PlainPairs(tuple(tests), {0: QUIET})
