"""Findings about events that never happen: BP110 to BP112. They need no settings."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from cqos_core.behaviour.drawn import behaviour_finding
from cqos_core.model.report import Severity
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator

    from cqos_core.behaviour.drawn import Drawn
    from cqos_core.behaviour.reach import Reached
    from cqos_core.model.report import Finding

_LONGEST = 6
_COMPLETE = "all files of the system are given"


def unreachable_findings(drawn: Drawn) -> list[Finding]:
    """Report topics on which no run publishes, and events that no token reaches."""
    certain, alone = drawn.behaviour.reached, drawn.behaviour.reached_alone
    found = [*_never_thrown(drawn, certain, None), *_dead_events(drawn, certain)]
    if alone.thrown != certain.thrown:
        # That nothing publishes what these wait for is reported by itself, as a warning.
        found += _never_thrown(drawn, alone, certain)
    return found


def _never_thrown(drawn: Drawn, reached: Reached, louder: Reached | None) -> Iterator[Finding]:
    graph, signals = drawn.behaviour.graph, drawn.behaviour.signals
    severity = None if louder is None else Severity.WARNING
    for topic, throws in graph.thrown_at.items():
        if topic in reached.thrown or signals.is_open(topic) or (louder and topic not in louder.thrown):
            continue
        publishers, subscribers = drawn.on(topic, PUBLISHER), drawn.on(topic, SUBSCRIBER)
        if not publishers or not subscribers:
            continue
        way = _waiting(drawn, reached, topic)
        message = f"no run publishes on `{publishers[0].shown}`{': ' if way else ''}{way}"
        yield behaviour_finding("BP110", message, publishers, assumed=[_COMPLETE], severity=severity)
        if louder is not None:
            yield from _dead_throws(drawn, reached, throws)


def _waiting(drawn: Drawn, reached: Reached, topic: Hashable) -> str:
    """Say what the throws of a topic wait for, until something waits for an earlier one, or nothing is known."""
    graph = drawn.behaviour.graph
    seen: dict[Hashable, None] = {}
    steps: list[str] = []
    while topic not in seen and len(steps) < _LONGEST:
        seen[topic] = None
        throw = graph.thrown_at.get(topic, [None])[0]
        catch = None if throw is None else _blocking(drawn, reached, throw)
        if throw is None or catch is None:
            break
        topics = sorted((each for each in graph.catches[catch] or () if each not in reached.thrown), key=str)
        if not topics:
            break
        topic = topics[0]
        shown = next((each.shown for each in drawn.topics.get(topic, ())), "")  # type: ignore[call-overload]
        steps.append(f"`{graph.nodes[throw].id}` waits for `{shown}` at `{graph.nodes[catch].id}`")
    circle = ", so each waits for the other" if topic in seen and len(steps) > 1 else ""
    return ", ".join(steps) + circle


def _blocking(drawn: Drawn, reached: Reached, throw: int) -> int | None:
    """Return the nearest event before a throw that waits for what never comes."""
    graph = drawn.behaviour.graph
    waiting, seen = deque([throw]), {throw}
    while waiting:
        at = waiting.popleft()
        if at in reached.arrived and at not in reached.fired and graph.catches[at]:
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


def _dead_events(drawn: Drawn, reached: Reached) -> Iterator[Finding]:
    graph = drawn.behaviour.graph
    yield from _dead_throws(drawn, reached, [at for at, topics in enumerate(graph.throws) if topics])
    for at, node in enumerate(graph.nodes):
        ends = drawn.ends(at) if node.kind in {"catch", "boundary"} else ()
        if ends and at not in reached.arrived and graph.process[at] in reached.fired:
            message = f"no token reaches `{node.id}`, so it never waits for `{ends[0].shown}`"
            yield behaviour_finding("BP112", message, ends, assumed=[_COMPLETE])


def _dead_throws(drawn: Drawn, reached: Reached, throws: list[int]) -> Iterator[Finding]:
    graph, certain = drawn.behaviour.graph, drawn.behaviour.reached
    for at in throws:
        ends = [each for each in drawn.ends(at) if each.role == PUBLISHER]
        if ends and at not in reached.fired and graph.process[at] in reached.fired:
            severity = Severity.WARNING if at in certain.fired else None
            message = f"no token reaches `{graph.nodes[at].id}`, so it never publishes on `{ends[0].shown}`"
            yield behaviour_finding("BP111", message, ends, assumed=[_COMPLETE], severity=severity)
