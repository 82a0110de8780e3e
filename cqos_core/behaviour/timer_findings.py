"""Findings about how often samples come: BP101 to BP105, BP114 and BP115.

A publisher that sends at most a + r·t samples until any time t keeps no gap g with r·g < 1: with gaps of at most g from the first
sample on, at time t there would be at least (t - t0) / g samples, which is more for a large t.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.behaviour.event_rates import added
from cqos_core.behaviour.finding_parts import behaviour_finding, draft, time_text
from cqos_core.behaviour.policy_values import finite, is_one_of, needed
from cqos_core.model.finding import Fact, Side
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from cqos_core.behaviour.event_rates import Rate
    from cqos_core.behaviour.flow_model import Drawn
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.model.finding import Finding
    from cqos_core.resolving.resolved import Resolved

MEAN_PERIOD = "mean_period_at_least"
"""The name of the fact that follows from timers."""


def timer_findings(drawn: Drawn) -> list[Finding]:
    """Report deadlines, leases and requirements that timers exclude."""
    publishing = [
        (each.participant.participant.id, topic, each)
        for topic, ends in drawn.topics.items()
        for each in ends
        if each.role == PUBLISHER and not each.is_copy
    ]
    thrown = grouped(((owner, topic), each) for owner, topic, each in publishing)
    sending = grouped((owner, each) for owner, _, each in publishing)
    found: list[Finding] = []
    for (owner, topic), ends in thrown.items():
        found += _offered(drawn, ends)
        found += _manual(drawn, ends, sending[owner])
        found += _owners(drawn, topic, ends)
    for end, topics in drawn.subscribers():
        found += _requested(drawn, topics, end)
    return found


def _sent(drawn: Drawn, ends: Sequence[Resolved]) -> Rate | None:
    """Return how often endpoints are published to; None where something else than a drawn event may do so."""
    drawn_ends = [each for each in ends if drawn.nodes([each])]
    return drawn.behaviour.thrown(drawn.nodes(ends)) if len(drawn_ends) == len(ends) else None


def _offered(drawn: Drawn, ends: Sequence[Resolved]) -> Iterator[Finding]:
    """Report an offered gap that is certainly exceeded, and its consequence for exclusive owners."""
    timing = ends[0].pack.timing
    gaps = [finite(each, timing.gap) for each in ends]
    known = [gap for gap in gaps if gap is not None]
    bound = _sent(drawn, ends)
    if not known or len(known) != len(gaps) or bound is None or not bound.once or not bound.excludes(max(known)):
        return
    subject = _subject(ends)
    promised = f"offers {timing.gap} {time_text(max(known))}"
    message = f"{subject} {promised}, but sends {often(bound)}{why(drawn, bound)}"
    code = "BP101" if bound.rate else "BP103"
    notes = assumed(bound, max(known))
    timers, fix = timers_of(drawn, bound), draft(ends, timing.gap, bound.shortest_gap)
    yield behaviour_finding(code, message, ends, policies=[timing.gap], beside=timers, assumed=notes, fix=fix)


def _owners(drawn: Drawn, topic: TopicKey, ends: Sequence[Resolved]) -> Iterator[Finding]:
    """Report that ownership passes on, where the participant of some endpoints is the strongest and keeps no gap."""
    timing, gap, bound = ends[0].pack.timing, finite(ends[0], ends[0].pack.timing.gap), _sent(drawn, ends)
    if len(ends) != 1 or gap is None or bound is None or not bound.once or not bound.excludes(gap):
        return
    for end in drawn.on(topic, SUBSCRIBER):
        if is_one_of(end, timing.owned) and _is_strongest(ends[0], drawn.partners(end, [topic])):
            message = (
                f"{_subject([end])} takes samples of the strongest publisher, `{ends[0].id}`, which offers {timing.gap} "
                f"{time_text(gap)} and sends {often(bound)}, so ownership passes on each time"
            )
            policies, notes = [timing.owned[0]], assumed(bound, gap)
            yield behaviour_finding(
                "BP115", message, [end], policies=policies, beside=timers_of(drawn, bound), assumed=notes
            )


def _is_strongest(owner: Resolved, everybody: Sequence[Resolved]) -> bool:
    """Whether all publishers are exclusive, and one is stronger than each of one or more others."""
    timing = owner.pack.timing
    strengths = {each.id: finite(each, timing.strength) for each in everybody}
    own = strengths.pop(owner.id, None)
    weaker = own is not None and all(each is not None and each < own for each in strengths.values())
    return weaker and bool(strengths) and all(is_one_of(each, timing.owned) for each in everybody)


def _manual(drawn: Drawn, ends: Sequence[Resolved], sending: Sequence[Resolved]) -> Iterator[Finding]:
    """Report a lease that runs out between two samples, where only these assert liveliness."""
    timing = ends[0].pack.timing
    for end in ends:
        lease = finite(end, timing.lease)
        on_topic, by_participant = (
            is_one_of(end, each) for each in (timing.asserted_on_topic, timing.asserted_by_participant)
        )
        if lease is None or not (on_topic or by_participant):
            continue
        bound = _sent(drawn, ends if on_topic else sending)
        if bound is None or not bound.once or not bound.excludes(lease):
            continue
        where = "" if on_topic else " on all topics"
        message = (
            f"{_subject([end])} asserts its liveliness by sending, within {time_text(lease)}, "
            f"but its participant sends {often(bound)}{where}{why(drawn, bound)}"
        )
        notes = [
            "a publisher asserts its liveliness by sending only",
            *assumed(bound, lease),
        ]
        policies = [timing.asserted_on_topic[0], timing.lease]
        timers = timers_of(drawn, bound)
        fix = draft([end], timing.lease, bound.shortest_gap)
        yield behaviour_finding("BP105", message, [end], policies=policies, beside=timers, assumed=notes, fix=fix)
        return


def _requested(drawn: Drawn, topics: Iterable[Hashable], end: Resolved) -> Iterator[Finding]:
    """Report a requested gap, or a required one, that all publishers together certainly exceed."""
    timing = end.pack.timing
    gap, required = finite(end, timing.gap), needed(end, "max_gap")
    asked = (gap is not None or required is not None) and drawn.partners(end, topics)
    bound = added(map(drawn.behaviour.on_topic, topics)) if asked else None
    if bound is None or not bound.once:
        return
    sent = f"but `{end.shown}` gets {often(bound)}{why(drawn, bound)}"
    timers = timers_of(drawn, bound)
    if gap is not None and bound.excludes(gap):
        message = f"{_subject([end])} requests {timing.gap} {time_text(gap)}, {sent}"
        notes = assumed(bound, gap, outside=end.shown)
        fix = draft([end], timing.gap, bound.shortest_gap)
        yield behaviour_finding("BP102", message, [end], policies=[timing.gap], beside=timers, assumed=notes, fix=fix)
    if required is not None and bound.excludes(required):
        message = f"{_subject([end])} needs max_gap {time_text(required)}, {sent}"
        notes = assumed(bound, required, outside=end.shown)
        yield behaviour_finding("BP114", message, [end], beside=timers, assumed=notes)


def _subject(ends: Sequence[Resolved]) -> str:
    ids = sorted({each.id for each in ends})
    more = f" (and {len(ids) - 1} more)" if len(ids) > 1 else ""
    return f"{ends[0].role} `{ids[0]}`{more}"


def often(bound: Rate) -> str:
    """Say how often at most, in words."""
    period = bound.mean_period
    if period is not None:
        return f"at most one sample in {time_text(period)} on average"
    return f"at most {bound.once} sample{'s' if bound.once > 1 else ''} in all"


def why(drawn: Drawn, bound: Rate) -> str:
    """Say which timers limit a rate."""
    said = []
    for at in bound.origins:
        node = drawn.behaviour.graph.nodes[at]
        timer = next((each.timer for each in node.triggers if each.timer is not None), None)
        if timer is not None and timer.wait is not None:
            does = "fires every" if timer.kind == "cycle" else "delays each turn by"
            said.append(f"timer `{node.id}` {does} {time_text(timer.wait)}")
    return f": {' and '.join(said)}" if said else ""


def timers_of(drawn: Drawn, bound: Rate) -> list[Side]:
    """Return the timer that limits a rate, with the mean period as a fact."""
    period = bound.mean_period
    if period is None or not bound.origins:
        return []
    node = drawn.behaviour.graph.nodes[bound.origins[0]]
    stated = Fact(MEAN_PERIOD, time_text(period), f"from the timer at {node.id}", node.place)
    return [Side("timer", (node.id,), "fires here", (stated,), node.place)]


def assumed(bound: Rate, gap: int, outside: str = "") -> Iterable[str]:
    """Return the assumptions that a claim rests on, in words."""
    longest = max(gap, bound.mean_period or 0)
    yield f"devices stay up for longer than {time_text(longest)}"
    if bound.alone:
        yield "a process whose start has no trigger runs once in each participant"
    if outside:
        yield f"no other program publishes on `{outside}`"
    if bound.signals and not outside:
        yield "no other program publishes the signals that start processes"


def mean_periods(drawn: Drawn, publisher: str, subscriber: str) -> tuple[tuple[str, str], ...]:
    """Return the least mean period of a publisher's participant on its topic, and of all samples of a subscriber, with their timers."""
    found = []
    for ends in drawn.topics.values():
        own = [each for each in ends if each.id == publisher and not each.is_copy]
        owner = own[0].participant.participant.id if own else None
        sending = [each for each in ends if each.role == PUBLISHER and each.participant.participant.id == owner]
        found += [(f"{MEAN_PERIOD} of what `{owner}` publishes", _sent(drawn, sending))] if own else []
    found += [
        (f"{MEAN_PERIOD} of what `{subscriber}` gets", added(map(drawn.behaviour.on_topic, topics)))
        for end, topics in drawn.subscribers()
        if end.id == subscriber
    ]
    return tuple(
        (name, f"{time_text(rate.mean_period)}{why(drawn, rate)}")
        for name, rate in found
        if rate is not None and rate.mean_period is not None and rate.origins
    )
