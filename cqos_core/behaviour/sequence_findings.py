"""Findings about what happens before what: BP106, BP107 and BP113. They are about events that happen at most once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.catch_option import AT_TOKEN, BUFFERED, OPTION, OWNER, UNBUFFERED
from cqos_core.behaviour.finding_parts import THROWN, behaviour_finding, draft_fix, time_text
from cqos_core.behaviour.policy_values import finite_value, is_one_of, keep_for_late_joiners, storage_time
from cqos_core.language.policy import ENDPOINT
from cqos_core.matching.judge import failed_match_conditions
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity, Side, Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.finding_facts import fact

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Sequence

    from cqos_core.behaviour.flow_model import FlowModel
    from cqos_core.model.finding import Finding
    from cqos_core.resolving.resolved_endpoint import Resolved


_CLOCKS: Final = "the clocks of both devices agree"

_IN_ORDER: Final = "samples of different topics arrive in the order in which they are sent"


@dataclass(frozen=True, slots=True)
class _Once:
    """A sample that is sent once, and certainly before a token waits for it.

    Attributes:
        age: its least age in nanoseconds when the token comes.
    """

    throw: int
    catch: int
    age: int


def sequence_findings(model: FlowModel, reading: str | None) -> list[Finding]:
    """Return findings about samples that come before a token waits for them; ``reading`` is the option ``bpmn.catch``, if stated."""
    found: list[Finding] = []
    for once in _sent_before(model):
        for publisher in model.ends(once.throw):
            for subscriber in model.ends(once.catch):
                if _meet(publisher, subscriber):
                    found += _late(once, publisher, subscriber, reading)
    found += _timeouts(model)
    return found


def _meet(publisher: Resolved, subscriber: Resolved) -> bool:
    """Whether two ends form a pair."""
    same = publisher.role == PUBLISHER and subscriber.role == SUBSCRIBER and publisher.key == subscriber.key
    return same and not failed_match_conditions(publisher.profile, subscriber.profile)


def _only_throw(model: FlowModel, topic: Hashable) -> int | None:
    """Return the only event that publishes on a topic, if it does so at most once."""
    behaviour = model.behaviour
    throws = behaviour.graph.thrown_at.get(topic, [])
    alone = len(throws) == 1 and not behaviour.signals.is_open(topic)
    return throws[0] if alone and behaviour.is_once(throws[0]) else None


def _sent_before(model: FlowModel) -> Iterator[_Once]:
    behaviour = model.behaviour
    for at, node in enumerate(behaviour.graph.nodes):
        if node.kind != "catch" or not node.endpoints or not behaviour.is_once(at):
            continue
        topic = behaviour.order.heard(at)
        throw = None if topic is None else _only_throw(model, topic)
        age = None if throw is None else behaviour.order.since(throw, at)
        if throw is not None and age is not None and at in behaviour.reachable.arrived:
            yield _Once(throw, at, age)


def _late(once: _Once, publisher: Resolved, subscriber: Resolved, reading: str | None) -> Iterator[Finding]:
    timing = publisher.pack.timing
    assumed = [
        "a process whose start has no trigger runs once in each participant",
        f"no other program publishes on `{subscriber.shown}`",
    ]
    life = finite_value(publisher, timing.lifespan)
    sent = f"`{publisher.id}` sends the only sample of `{subscriber.shown}`"
    if life is not None and life < once.age:
        message = (
            f"{sent}, which lives for {time_text(life)}; "
            f"a token reaches `{subscriber.id}` {time_text(once.age)} later at the earliest"
        )
        index = publisher.pack.vocabulary.indices[ENDPOINT, timing.lifespan]
        life_of = Side(
            PUBLISHER, (publisher.id,), THROWN, (fact(publisher, publisher.profile, index),), publisher.endpoint.place
        )
        fix = draft_fix([publisher], timing.lifespan, once.age)
        yield behaviour_finding("BP106", message, [subscriber], beside=[life_of], assumed=[*assumed, _CLOCKS], fix=fix)
        return
    kept, stored = keep_for_late_joiners(publisher, subscriber), storage_time(publisher, subscriber)
    certain = [is_one_of(each, timing.certain) for each in (publisher, subscriber)]
    if not timing.kept[0] or kept is None or None in certain:
        return
    expired = kept and stored is not None and stored < once.age
    # A best-effort late joiner may miss kept samples, but not for certain.
    lost = {AT_TOKEN: expired or not kept, UNBUFFERED: True, BUFFERED: False}
    if reading is not None:
        lost = {reading: lost[reading]}
    if not any(lost.values()):
        return
    label = {True: Verdict.INCOMPATIBLE, False: Verdict.COMPATIBLE}
    worlds = {f"{OWNER}.{OPTION}={name}": label[is_lost] for name, is_lost in lost.items()}
    names = " and ".join(name for name, is_lost in lost.items() if is_lost)
    message = f"{sent} before a token waits for it at `{subscriber.id}`, so it never arrives with {names}"
    policies = [timing.kept[0]]
    # A sample that is sent just before may still be under way.
    severity = Severity.ERROR if reading is not None and once.age else None
    spare = once.age - (stored or 0 if expired and lost.get(AT_TOKEN) else 0)
    under_way = f"a sample is under way for less than {time_text(spare)}" if once.age else _IN_ORDER
    worlds = {} if reading is not None else worlds
    yield behaviour_finding(
        "BP107",
        message,
        [subscriber],
        policies=policies,
        worlds=worlds,
        assumed=[*assumed, under_way],
        severity=severity,
    )


def _timeouts(model: FlowModel) -> Iterator[Finding]:
    """Yield findings about answers that come after the timer of their gateway."""
    behaviour = model.behaviour
    graph = behaviour.graph
    for gateway, node in enumerate(graph.nodes):
        if node.kind != "event_based" or not behaviour.is_once(gateway):
            continue
        timers = [each.timer for at in graph.after[gateway] for each in graph.nodes[at].triggers]
        dues = [each.due for each in timers if each is not None and each.due is not None]
        requests = _requests(model, gateway) if dues else []
        for catch in graph.after[gateway] if requests else ():
            wait = _answered(model, requests, catch) if graph.before[catch] == [gateway] else None
            if wait is not None and wait > min(dues) and any(map(model.partners_here, model.ends(catch))):
                yield _timeout(model, catch, wait, min(dues))


def _requests(model: FlowModel, gateway: int) -> list[int]:
    """Return the throws from which a token comes to a gateway in no time, over merges at most; each publishes once, and alone.

    Only one token comes to the gateway. So it comes when the request is sent, or no request is sent.
    """
    graph = model.behaviour.graph
    found, waiting, seen = [], [*graph.before[gateway]], {gateway}
    while waiting:
        at = waiting.pop()
        if at in seen:
            continue
        seen.add(at)
        if graph.nodes[at].kind == "exclusive" and len(graph.after[at]) == 1:
            waiting += graph.before[at]
        elif graph.nodes[at].kind == "throw" and graph.throws[at]:
            found += [at] if all(_only_throw(model, topic) == at for topic in graph.throws[at]) else []
    return sorted(found)


def _answered(model: FlowModel, requests: Sequence[int], catch: int) -> int | None:
    """Return the least time from a request to its answer; None if open."""
    order = model.behaviour.order
    topic = order.heard(catch)
    throws = [] if topic is None else model.behaviour.graph.thrown_at.get(topic, [])
    times = []
    for each in throws:
        known = [time for request in requests if (time := order.since(request, each)) is not None]
        if not known:
            return None
        times.append(max(known))
    return min(times, default=None)


def _timeout(model: FlowModel, catch: int, wait: int, due: int) -> Finding:
    ends = model.ends(catch)
    name = model.behaviour.graph.nodes[catch].id
    message = (
        f"the answer at `{name}` comes {time_text(wait)} after the request at the earliest, "
        f"but the wait for it ends after {time_text(due)}"
    )
    assumed = [
        "a process whose start has no trigger runs once in each participant",
        f"no other program publishes on `{ends[0].shown}`",
        f"the timer is late by less than {time_text(wait - due)}",
    ]
    return behaviour_finding("BP113", message, ends, assumed=assumed)
