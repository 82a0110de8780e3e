"""Findings about the rate of samples: BP101 to BP105, BP114 and BP115.

A publisher that sends at most a + r·t samples until any time t cannot keep a gap g with r·g < 1: with gaps of at most g from the first
sample at t0 on, there would be at least (t - t0) / g samples at time t, which is more for a large t.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.behaviour.event_rates import sum_of_rates
from cqos_core.behaviour.finding_parts import behaviour_finding, draft_fix, time_text
from cqos_core.behaviour.policy_values import finite_value, is_one_of, required_value
from cqos_core.model.finding import Fact, Side
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from cqos_core.behaviour.event_rates import Rate
    from cqos_core.behaviour.flow_model import FlowModel
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.finding import Finding
    from cqos_core.resolving.resolved_endpoint import Resolved

MEAN_PERIOD = "mean_period_at_least"
"""The name of the fact that is derived from timers."""


def timer_findings(model: FlowModel) -> list[Finding]:
    """Return findings about deadlines, leases and requirements that the timers cannot meet."""
    publishing = [
        (each.participant.participant.id, topic, each)
        for topic, ends in model.topics.items()
        for each in ends
        if each.role == PUBLISHER and not each.is_copy
    ]
    thrown = grouped(((owner, topic), each) for owner, topic, each in publishing)
    sending = grouped((owner, each) for owner, _, each in publishing)
    found: list[Finding] = []
    for (owner, topic), ends in thrown.items():
        found += _offered(model, ends)
        found += _manual(model, ends, sending[owner])
        found += _owners(model, topic, ends)
    for end, topics in model.subscribers():
        found += _requested(model, topics, end)
    return found


def _sent(model: FlowModel, ends: Sequence[Resolved]) -> Rate | None:
    """Return how often endpoints publish; None if others than drawn events may do so."""
    ends_of_model = [each for each in ends if model.nodes([each])]
    return model.behaviour.thrown(model.nodes(ends)) if len(ends_of_model) == len(ends) else None


def _offered(model: FlowModel, ends: Sequence[Resolved]) -> Iterator[Finding]:
    """Yield a finding if an offered gap is certainly exceeded."""
    timing = ends[0].pack.timing
    gaps = [finite_value(each, timing.gap) for each in ends]
    known = [gap for gap in gaps if gap is not None]
    bound = _sent(model, ends)
    if not known or len(known) != len(gaps) or bound is None or not bound.once or not bound.excludes(max(known)):
        return
    subject = _subject(ends)
    promised = f"offers {timing.gap} {time_text(max(known))}"
    message = f"{subject} {promised}, but sends {rate_in_words(bound)}{limiting_timers_in_words(model, bound)}"
    code = "BP101" if bound.rate else "BP103"
    notes = assumptions_in_words(bound, max(known))
    timers, fix = limiting_timer_sides(model, bound), draft_fix(ends, timing.gap, bound.shortest_gap)
    yield behaviour_finding(code, message, ends, policies=[timing.gap], beside=timers, assumed=notes, fix=fix)


def _owners(model: FlowModel, topic: TopicKey, ends: Sequence[Resolved]) -> Iterator[Finding]:
    """Yield findings if the strongest owner exceeds its gap, so that ownership changes each time."""
    timing, gap, bound = ends[0].pack.timing, finite_value(ends[0], ends[0].pack.timing.gap), _sent(model, ends)
    if len(ends) != 1 or gap is None or bound is None or not bound.once or not bound.excludes(gap):
        return
    for end in model.on(topic, SUBSCRIBER):
        if is_one_of(end, timing.owned) and _is_strongest(ends[0], model.partners(end, [topic])):
            message = (
                f"{_subject([end])} takes samples of the strongest publisher, `{ends[0].id}`, which offers {timing.gap} "
                f"{time_text(gap)} and sends {rate_in_words(bound)}, so ownership passes on each time"
            )
            policies, notes = [timing.owned[0]], assumptions_in_words(bound, gap)
            yield behaviour_finding(
                "BP115", message, [end], policies=policies, beside=limiting_timer_sides(model, bound), assumed=notes
            )


def _is_strongest(owner: Resolved, everybody: Sequence[Resolved]) -> bool:
    """Whether all publishers are exclusive, and one is stronger than each of one or more others."""
    timing = owner.pack.timing
    strengths = {each.id: finite_value(each, timing.strength) for each in everybody}
    own = strengths.pop(owner.id, None)
    weaker = own is not None and all(each is not None and each < own for each in strengths.values())
    return weaker and bool(strengths) and all(is_one_of(each, timing.owned) for each in everybody)


def _manual(model: FlowModel, ends: Sequence[Resolved], sending: Sequence[Resolved]) -> Iterator[Finding]:
    """Yield a finding if a lease expires between two samples, and only samples assert liveliness."""
    timing = ends[0].pack.timing
    for end in ends:
        lease = finite_value(end, timing.lease)
        on_topic, by_participant = (
            is_one_of(end, each) for each in (timing.asserted_on_topic, timing.asserted_by_participant)
        )
        if lease is None or not (on_topic or by_participant):
            continue
        bound = _sent(model, ends if on_topic else sending)
        if bound is None or not bound.once or not bound.excludes(lease):
            continue
        where = "" if on_topic else " on all topics"
        message = (
            f"{_subject([end])} asserts its liveliness by sending, within {time_text(lease)}, "
            f"but its participant sends {rate_in_words(bound)}{where}{limiting_timers_in_words(model, bound)}"
        )
        notes = [
            "a publisher asserts its liveliness by sending only",
            *assumptions_in_words(bound, lease),
        ]
        policies = [timing.asserted_on_topic[0], timing.lease]
        timers = limiting_timer_sides(model, bound)
        fix = draft_fix([end], timing.lease, bound.shortest_gap)
        yield behaviour_finding("BP105", message, [end], policies=policies, beside=timers, assumed=notes, fix=fix)
        return


def _requested(model: FlowModel, topics: Iterable[Hashable], end: Resolved) -> Iterator[Finding]:
    """Yield findings if all publishers together exceed a requested or required gap."""
    timing = end.pack.timing
    gap, required = finite_value(end, timing.gap), required_value(end, "max_gap")
    asked = (gap is not None or required is not None) and model.partners(end, topics)
    bound = sum_of_rates(map(model.behaviour.on_topic, topics)) if asked else None
    if bound is None or not bound.once:
        return
    sent = f"but `{end.shown}` gets {rate_in_words(bound)}{limiting_timers_in_words(model, bound)}"
    timers = limiting_timer_sides(model, bound)
    if gap is not None and bound.excludes(gap):
        message = f"{_subject([end])} requests {timing.gap} {time_text(gap)}, {sent}"
        notes = assumptions_in_words(bound, gap, outside=end.shown)
        fix = draft_fix([end], timing.gap, bound.shortest_gap)
        yield behaviour_finding("BP102", message, [end], policies=[timing.gap], beside=timers, assumed=notes, fix=fix)
    if required is not None and bound.excludes(required):
        message = f"{_subject([end])} needs max_gap {time_text(required)}, {sent}"
        notes = assumptions_in_words(bound, required, outside=end.shown)
        yield behaviour_finding("BP114", message, [end], beside=timers, assumed=notes)


def _subject(ends: Sequence[Resolved]) -> str:
    ids = sorted({each.id for each in ends})
    more = f" (and {len(ids) - 1} more)" if len(ids) > 1 else ""
    return f"{ends[0].role} `{ids[0]}`{more}"


def rate_in_words(bound: Rate) -> str:
    """Return a rate in words: ``at most one sample in 1s on average``."""
    period = bound.mean_period
    if period is not None:
        return f"at most one sample in {time_text(period)} on average"
    return f"at most {bound.once} sample{'s' if bound.once > 1 else ''} in all"


def limiting_timers_in_words(model: FlowModel, bound: Rate) -> str:
    """Return the timers that limit a rate, in words."""
    said = []
    for at in bound.origins:
        node = model.behaviour.graph.nodes[at]
        timer = next((each.timer for each in node.triggers if each.timer is not None), None)
        if timer is not None and timer.wait is not None:
            does = "fires every" if timer.kind == "cycle" else "delays each turn by"
            said.append(f"timer `{node.id}` {does} {time_text(timer.wait)}")
    return f": {' and '.join(said)}" if said else ""


def limiting_timer_sides(model: FlowModel, bound: Rate) -> list[Side]:
    """Return the timer that limits a rate as a side, with the mean period as a fact."""
    period = bound.mean_period
    if period is None or not bound.origins:
        return []
    node = model.behaviour.graph.nodes[bound.origins[0]]
    stated = Fact(MEAN_PERIOD, time_text(period), f"from the timer at {node.id}", node.place)
    return [Side("timer", (node.id,), "fires here", (stated,), node.place)]


def assumptions_in_words(bound: Rate, gap: int, outside: str = "") -> Iterable[str]:
    """Yield the assumptions of a claim, in words."""
    longest = max(gap, bound.mean_period or 0)
    yield f"devices stay up for longer than {time_text(longest)}"
    if bound.alone:
        yield "a process whose start has no trigger runs once in each participant"
    if outside:
        yield f"no other program publishes on `{outside}`"
    if bound.signals and not outside:
        yield "no other program publishes the signals that start processes"


def mean_periods(model: FlowModel, publisher: str, subscriber: str) -> tuple[tuple[str, str], ...]:
    """Return the least mean period of a publisher's participant on its topic, and of all samples of a subscriber, with their timers."""
    found = []
    for ends in model.topics.values():
        own = [each for each in ends if each.id == publisher and not each.is_copy]
        owner = own[0].participant.participant.id if own else None
        sending = [each for each in ends if each.role == PUBLISHER and each.participant.participant.id == owner]
        found += [(f"{MEAN_PERIOD} of what `{owner}` publishes", _sent(model, sending))] if own else []
    found += [
        (f"{MEAN_PERIOD} of what `{subscriber}` gets", sum_of_rates(map(model.behaviour.on_topic, topics)))
        for end, topics in model.subscribers()
        if end.id == subscriber
    ]
    return tuple(
        (name, f"{time_text(rate.mean_period)}{limiting_timers_in_words(model, rate)}")
        for name, rate in found
        if rate is not None and rate.mean_period is not None and rate.origins
    )
