"""Topics of one publisher and one subscriber about which no rule reports anything, as are most topics.

The functions that say so are those of `cqos_core.matching.rule_set`, looked up once for what many profiles have in common.
`cqos_core.matching.topic_shape` is what it means, and takes all other topics.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.matching.judge import (
    meeting_rules,
    of_one,
    pair_rules,
    read_in_worlds,
    refusing_rules,
    signal_rules,
    undecided_meetings,
)
from cqos_core.model.memory import keep
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.matching.rule_set import Ready
    from cqos_core.resolving.resolved import ProfileFrame, QosProfile, Resolved

_Tests: TypeAlias = "tuple[tuple[Ready, ...], tuple[Ready, ...], tuple[Ready, ...]]"
"""What has to return no bit of two profiles, of the publisher's, and of the subscriber's."""

_TESTS: Final[dict[tuple[ProfileFrame, ProfileFrame, bool, bool], _Tests]] = {}


def is_quiet(one: Resolved, other: Resolved) -> bool:
    """Whether two endpoints that are alone on their topic form a compatible pair without a finding."""
    if one.endpoint.role != PUBLISHER:
        one, other = other, one
    if one.endpoint.role != PUBLISHER or other.endpoint.role != SUBSCRIBER or one.is_copy or other.is_copy:
        return False
    publisher, subscriber = one.profile, other.profile
    if publisher.unread or publisher.refused or subscriber.unread or subscriber.refused:
        return False
    observed = one.endpoint.observed, other.endpoint.observed
    key = publisher.frame, subscriber.frame, *observed
    tests = _TESTS.get(key)
    if tests is None:
        tests = _tests(publisher, subscriber, *observed)
        if tests is None:
            return False
        keep(_TESTS, key, tests)
    a, b = publisher.known, subscriber.known
    of_pair, of_publisher, of_subscriber = tests
    for reporting, counted in of_pair:
        if reporting(a, b) & counted:
            return False
    for reporting, counted in of_publisher:
        if reporting(a, a) & counted:
            return False
    for reporting, counted in of_subscriber:  # noqa: SIM110 - as the above
        if reporting(b, b) & counted:
            return False
    return True


def _tests(publisher: QosProfile, subscriber: QosProfile, offering: bool, requesting: bool) -> _Tests | None:  # noqa: FBT001 - observed ends
    """Return what is asked of profiles that have as much in common with others as these; None before there are functions for it."""
    pack = publisher.pack
    if subscriber.needs or publisher.from_peers or subscriber.from_peers:
        return None
    pairs = [rules.ready(publisher, subscriber) for rules in (meeting_rules(pack), pair_rules(pack))]
    if open_meetings := read_in_worlds(pack, publisher.frame, 0) | read_in_worlds(pack, subscriber.frame, 1):
        found = undecided_meetings(pack).ready(publisher, subscriber)
        pairs.append(found and (found[0], found[1] & open_meetings))
    ends = [
        _all(
            rules.ready(profile, profile)
            for rules in (of_one(pack, role, seen), refusing_rules(pack, seen), signal_rules(pack))
        )
        for profile, role, seen in ((publisher, PUBLISHER, offering), (subscriber, SUBSCRIBER, requesting))
    ]
    together = _all(pairs), *ends
    return None if None in together else together  # type: ignore[return-value]


def _all(tests: Iterable[Ready | None]) -> tuple[Ready, ...] | None:
    """Return the tests, without those that never report; None where one is not there yet."""
    found = [*tests]
    return None if None in found else tuple([each for each in found if each and each[1]])
