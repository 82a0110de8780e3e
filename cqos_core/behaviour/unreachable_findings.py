"""Findings about events that never happen: BP110 to BP112. They depend on no settings."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from cqos_core.behaviour.finding_parts import behaviour_finding
from cqos_core.model.finding import Severity, Side
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator

    from cqos_core.behaviour.flow_model import FlowModel
    from cqos_core.behaviour.reachability import ReachableEvents
    from cqos_core.model.finding import Finding

_LONGEST = 6
_COMPLETE = "all files of the system are given"
_DRAWN = "messages come only over the drawn message flows"
_PASSED = "a token leaves each task over its only flow"
_ORDERED = (
    _COMPLETE,
    "a process whose start has no trigger runs once in each participant",
    "no other program publishes the signals that processes wait for",
)


def unreachable_findings(model: FlowModel) -> list[Finding]:
    """Return findings about topics without any sample, and about events that no token reaches."""
    certain, alone = model.behaviour.reachable, model.behaviour.reachable_alone
    found = [*_never_thrown(model, certain, None), *_dead_events(model, certain)]
    if alone.thrown != certain.thrown:
        # These wait for topics without publisher, which is a warning of its own.
        found += _never_thrown(model, alone, certain)
    return found


def _never_thrown(model: FlowModel, reached: ReachableEvents, louder: ReachableEvents | None) -> Iterator[Finding]:
    graph, signals = model.behaviour.graph, model.behaviour.signals
    severity = None if louder is None else Severity.WARNING
    for topic, throws in graph.thrown_at.items():
        if topic in reached.thrown or signals.is_open(topic) or (louder and topic not in louder.thrown):
            continue
        publishers, subscribers = model.on(topic, PUBLISHER), model.on(topic, SUBSCRIBER)
        if not publishers or not subscribers:
            continue
        way = _waiting(model, reached, topic)
        late = louder is None and topic in model.behaviour.reachable_in_any_order.thrown
        message = f"no run publishes on `{publishers[0].shown}`{': ' if way else ''}{way}"
        beside, assumed = _never_started(model, reached, topic), _assumed(model, reached, ordered=late)
        least = Severity.WARNING if late else severity
        yield behaviour_finding("BP110", message, publishers, beside=beside, assumed=assumed, severity=least)
        if louder is not None:
            yield from _dead_throws(model, reached, throws)


def _never_started(model: FlowModel, reached: ReachableEvents, topic: Hashable) -> Iterator[Side]:
    """Yield the other events of processes that only samples of a topic start."""
    graph = model.behaviour.graph
    starts = [at for at in graph.caught_at.get(topic, ()) if graph.nodes[at].kind == "start"]
    processes = {graph.process[at] for at in starts if graph.process[at] not in reached.fired}
    for process in sorted(processes):
        ends = [
            end
            for at in graph.within(process)
            if graph.nodes[at].kind != "start" and topic not in graph.throws[at]
            for end in model.ends(at)
        ]
        if ends:
            members = tuple(dict.fromkeys(each.id for each in ends))
            yield Side("event", members, "never happens either", place=ends[0].endpoint.place)


def _waiting(model: FlowModel, reached: ReachableEvents, topic: Hashable) -> str:
    """Return in words what the throws of a topic wait for, step by step, up to a circle."""
    graph = model.behaviour.graph
    seen: dict[Hashable, None] = {}
    steps: list[str] = []
    while topic not in seen and len(steps) < _LONGEST:
        seen[topic] = None
        throw = graph.thrown_at.get(topic, [None])[0]
        catch = None if throw is None else _blocking(model, reached, throw)
        if throw is None or catch is None:
            break
        topics = sorted((each for each in graph.catches[catch] or () if each not in reached.thrown), key=str)
        if not topics:
            break
        topic = topics[0]
        shown = _shown(model, topic)
        steps.append(f"`{graph.nodes[throw].id}` waits for `{shown}` at `{graph.nodes[catch].id}`")
    circle = ", so each waits for the other" if topic in seen and len(steps) > 1 else ""
    return ", ".join(steps) + circle


def _blocking(model: FlowModel, reached: ReachableEvents, event: int) -> int | None:
    """Return the nearest node at or before an event where a token waits in vain."""
    graph = model.behaviour.graph
    waiting, seen = deque([event]), {event}
    while waiting:
        at = waiting.popleft()
        if at in reached.blocks:
            return at
        before = [*graph.before[at], graph.parent[at], *graph.calls[at]]
        activity = graph.attached[at]
        before += [] if activity is None else [activity]
        if graph.nodes[at].kind == "process" or graph.nodes[at].by_event:
            before += [each for each in graph.inside[at] if graph.nodes[each].kind == "start"]
        for each in before:
            if each not in seen and each not in reached.fired:
                seen.add(each)
                waiting.append(each)
    return None


def _dead_events(model: FlowModel, reached: ReachableEvents) -> Iterator[Finding]:
    graph = model.behaviour.graph
    yield from _dead_throws(model, reached, [at for at, topics in enumerate(graph.throws) if topics])
    for at, node in enumerate(graph.nodes):
        ends = model.ends(at) if node.kind in {"catch", "boundary"} else ()
        if ends and at not in reached.arrived and graph.process[at] in reached.fired:
            late, assumed = _in_vain(model, reached, at, ordered=at in model.behaviour.reachable_in_any_order.arrived)
            message = f"no token reaches `{node.id}`, so it never waits for `{ends[0].shown}`{late}"
            yield behaviour_finding("BP112", message, ends, assumed=assumed)


def _in_vain(model: FlowModel, reached: ReachableEvents, at: int, *, ordered: bool) -> tuple[str, tuple[str, ...]]:
    """Return in words where a token waits in vain before an event, if the order of events or a choice causes that; and the assumptions."""
    if not ordered:
        return "", _assumed(model, reached, ordered=False)
    graph = model.behaviour.graph
    waiting = _blocking(model, reached, at)
    if waiting is None:
        return "", _assumed(model, reached, ordered=True)
    block, name = reached.blocks[waiting], graph.nodes[waiting].id
    gateway = "" if block.gateway is None else graph.nodes[block.gateway].id
    shown = _shown(model, block.topic)
    senders = " or ".join(sorted({f"`{graph.nodes[each.source].id}`" for each in graph.brought[waiting]}))
    words = {
        "late": f"all that publishes `{shown}` happens only after `{name}` has stopped waiting",
        "branch": f"`{name}` waits for `{shown}`, which is published only if a token takes another branch of `{gateway}`",
        "silent": f"`{name}` waits for `{shown}`, on which no run publishes",
        "together": f"`{name}` waits for two branches of `{gateway}`, of which a token takes one",
        "message": f"no message comes from {senders} while `{name}` waits",
        "join": f"the inclusive join `{name}` waits for a token that waits for it at `{gateway}`",
    }
    return f": {words[block.kind]}", _assumed(model, reached, ordered=True)


def _assumed(model: FlowModel, reached: ReachableEvents, *, ordered: bool) -> tuple[str, ...]:
    """Return the assumptions of a claim; one that holds in any order of events, and whatever waits, needs the fewest."""
    if not ordered and reached is model.behaviour.reachable:
        return (_COMPLETE,)
    kinds = {each.kind for each in reached.blocks.values()}
    joins, messages = (_PASSED,) if "join" in kinds else (), (_DRAWN,) if "message" in kinds else ()
    return (*(_ORDERED if ordered else (_COMPLETE,)), *joins, *messages)


def _shown(model: FlowModel, topic: Hashable) -> str:
    """Return the name of a topic for people."""
    return next((each.shown for each in model.topics.get(topic, ())), "")  # type: ignore[call-overload]


def _dead_throws(model: FlowModel, reached: ReachableEvents, throws: list[int]) -> Iterator[Finding]:
    graph, certain = model.behaviour.graph, model.behaviour.reachable
    for at in throws:
        ends = [each for each in model.ends(at) if each.role == PUBLISHER]
        if ends and at not in reached.fired and graph.process[at] in reached.fired:
            ordered = reached is certain and at in model.behaviour.reachable_in_any_order.fired
            late, assumed = _in_vain(model, reached, at, ordered=ordered)
            severity = Severity.WARNING if ordered or at in certain.fired else None
            message = f"no token reaches `{graph.nodes[at].id}`, so it never publishes on `{ends[0].shown}`{late}"
            yield behaviour_finding("BP111", message, ends, assumed=assumed, severity=severity)
