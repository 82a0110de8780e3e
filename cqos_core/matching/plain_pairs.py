"""Topics of one publisher and one subscriber, as most topics are: functions alone tell which rules report on them.

The functions are those of `cqos_core.matching.rule_set`, looked up once for what many profiles have in common. Where the same rules
report for certain, the result is the same. `cqos_core.matching.topic_shape` makes it, once, and takes all other topics.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

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
    from cqos_core.language.compiled import Reporting
    from cqos_core.matching.topic_shape import ShapeResult
    from cqos_core.resolving.resolved import ProfileFrame, QosProfile, Resolved

_MOST_RESULTS: Final = 1_000


class _Test(NamedTuple):
    """A function whose bits are of the rules that may report.

    Attributes:
        counted: the bits that count.
        exact: the bits of rules that then report for certain.
        shift: where its bits stand among those of all functions.
    """

    reporting: Reporting
    counted: int
    exact: int
    shift: int


class PlainPairs(NamedTuple):
    """What functions tell of pairs of profiles that have as much in common as two others.

    Attributes:
        pair, publisher, subscriber: what is asked of two profiles, of the publisher's, and of the subscriber's.
        results: by the bits of the rules that report.
    """

    pair: tuple[_Test, ...]
    publisher: tuple[_Test, ...]
    subscriber: tuple[_Test, ...]
    results: dict[int, ShapeResult]

    def keep(self, bits: int, result: ShapeResult) -> None:
        """Keep the result where these rules report."""
        if len(self.results) >= _MOST_RESULTS:
            self.results.clear()
        self.results[bits] = result


_KNOWN: Final[dict[tuple[ProfileFrame, ProfileFrame, bool, bool], PlainPairs]] = {}


def reporting_rules(one: Resolved, other: Resolved) -> tuple[PlainPairs, int] | None:
    """Return which rules report on two endpoints that are alone on their topic, as bits; None where functions alone do not tell."""
    if one.endpoint.role != PUBLISHER:
        one, other = other, one
    if one.endpoint.role != PUBLISHER or other.endpoint.role != SUBSCRIBER or one.is_copy or other.is_copy:
        return None
    publisher, subscriber = one.like, other.like
    if publisher.unread or publisher.refused or subscriber.unread or subscriber.refused:
        return None
    observed = one.endpoint.observed, other.endpoint.observed
    key = publisher.frame, subscriber.frame, *observed
    known = _KNOWN.get(key)
    if known is None:
        known = _known(publisher, subscriber, *observed)
        if known is None:
            return None
        keep(_KNOWN, key, known)
    a, b = one.known, other.known
    bits = 0
    for tests, first, second in ((known.pair, a, b), (known.publisher, a, a), (known.subscriber, b, b)):
        for reporting, counted, exact, shift in tests:
            found = reporting(first, second) & counted
            if found:
                if found & ~exact:
                    return None
                bits |= found << shift
    return known, bits


def _known(publisher: QosProfile, subscriber: QosProfile, offering: bool, requesting: bool) -> PlainPairs | None:  # noqa: FBT001 - observed ends
    """Return what is known of profiles that have as much in common with others as these; None before there are functions for it."""
    pack = publisher.pack
    if subscriber.needs or publisher.from_peers or subscriber.from_peers:
        return None
    ends = (publisher, PUBLISHER, offering), (subscriber, SUBSCRIBER, requesting)
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
            for profile, role, seen in ends
        ),
    ]
    tests: list[tuple[_Test, ...]] = []
    shift = 0
    for asked in found:
        ready = []
        for rules, first, second, concerned, plain in asked:
            function = rules.ready(first, second)
            if function is None:
                return None
            reporting, counted, exact = function
            if counted & concerned:
                ready.append(_Test(reporting, counted & concerned, exact if plain else 0, shift))
            shift += len(rules.rules)
        tests.append(tuple(ready))
    pair, offered, requested = tests
    return PlainPairs(pair, offered, requested, {0: QUIET})
