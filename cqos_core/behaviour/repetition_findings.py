"""Findings about repeated processes and bursts: BP108, BP109, BP117 and BP118."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.behaviour.catch_option import AT_TOKEN, BUFFERED, OPTION, OWNER
from cqos_core.behaviour.finding_parts import behaviour_finding, draft_fix, time_text
from cqos_core.behaviour.policy_values import finite_value, is_one_of, keep_for_late_joiners, required_value
from cqos_core.language.policy import TOPIC
from cqos_core.model.finding import Verdict
from cqos_core.model.system import SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator

    from cqos_core.behaviour.flow_model import FlowModel
    from cqos_core.model.finding import Finding
    from cqos_core.resolving.resolved_endpoint import Resolved

_ONCE = "a process whose start has no trigger runs once in each participant"


def repetition_findings(model: FlowModel, reading: str | None) -> list[Finding]:
    """Return findings about answers to earlier requests, bursts, and samples that nobody takes; ``reading`` is the option ``bpmn.catch``."""
    found: list[Finding] = []
    for at, node in enumerate(model.behaviour.graph.nodes):
        for end in model.ends(at):
            if node.kind in {"start", "catch"} and end.role == SUBSCRIBER:
                if reading in {None, AT_TOKEN} and node.kind == "catch":
                    found += _earlier_answer(model, at, end, reading)
                if reading in {None, BUFFERED} and node.kind == "catch":
                    found += _taken_once(model, at, end, reading)
                if reading not in {None, AT_TOKEN} and node.kind == "start":
                    found += _kept_for_restarts(model, end)
    return [*found, *_bursts(model)]


def _fact(end: Resolved, name: str) -> bool:
    """Whether a fact of a topic holds, or may hold."""
    index = end.pack.vocabulary.indices.get((TOPIC, name))
    return index is not None and end.profile.values[index] != 0


def _worlds(reading: str | None, name: str) -> dict[str, Verdict]:
    return {f"{OWNER}.{OPTION}={name}": Verdict.INCOMPATIBLE} if reading is None else {}


def _earlier_answer(model: FlowModel, at: int, end: Resolved, reading: str | None) -> Iterator[Finding]:
    """Yield a finding if a timer repeats the process, and a kept answer to an earlier request may be taken."""
    graph, order = model.behaviour.graph, model.behaviour.order
    starts = [each for each in graph.inside[graph.process[at]] if graph.nodes[each].kind == "start"]
    timers = [each.timer for start in starts for each in graph.nodes[start].triggers]
    topic = order.heard(at)
    if len(timers) != 1 or timers[0] is None or timers[0].kind != "cycle" or not timers[0].wait or topic is None:
        return
    requests = {each for throw in order.before(at) for each in graph.throws[throw]}
    answers = [_started_by(model, each) for each in graph.thrown_at.get(topic, ())]
    timing, publishers = end.pack.timing, model.partners_here(end)
    lives = [finite_value(each, life) for each in publishers for life in (timing.lifespan, timing.kept_for)]
    kept = all(keep_for_late_joiners(each, end) for each in publishers)
    short = any(life is not None and life < timers[0].wait for life in lives)
    if publishers and answers and all(each in requests for each in answers) and kept and not short:
        message = (
            f"with {AT_TOKEN}, `{end.id}` may take the answer to an earlier request on `{end.shown}`: both ends keep it, "
            f"for no less than the {time_text(timers[0].wait)} between two rounds"
        )
        worlds = _worlds(reading, AT_TOKEN)
        yield behaviour_finding("BP108", message, [end], policies=[timing.kept[0]], worlds=worlds)


def _started_by(model: FlowModel, throw: int) -> Hashable | None:
    """Return the only topic whose samples start the process of a throw."""
    graph = model.behaviour.graph
    starts = [each for each in graph.inside[graph.process[throw]] if graph.nodes[each].kind == "start"]
    return model.behaviour.order.heard(starts[0]) if len(starts) == 1 else None


def _taken_once(model: FlowModel, at: int, end: Resolved, reading: str | None) -> Iterator[Finding]:
    """Yield a finding if a process takes one sample, and an endless publisher that keeps all blocks in the end."""
    behaviour, timing = model.behaviour, end.pack.timing
    topic = behaviour.order.heard(at)
    bound = None if topic is None else behaviour.on_topic(topic)
    if bound is None or not bound.rate or not behaviour.is_once(at) or len(model.nodes([end])) != 1:
        return
    same = [each for each in model.on(topic, SUBSCRIBER) if each.participant is end.participant]
    publishers = model.partners_here(end)
    everything = publishers and all(is_one_of(each, timing.unlimited) for each in (end, *publishers))
    if len(same) == 1 and everything and all(is_one_of(each, timing.certain) for each in (end, *publishers)):
        message = (
            f"with {BUFFERED}, `{end.id}` takes one sample of `{end.shown}`, later ones fill its queue, "
            f"and publisher `{publishers[0].id}` blocks in the end"
        )
        policies, worlds = [timing.unlimited[0]], _worlds(reading, BUFFERED)
        yield behaviour_finding("BP118", message, [end], policies=policies, worlds=worlds, assumed=[_ONCE])


def _kept_for_restarts(model: FlowModel, end: Resolved) -> Iterator[Finding]:
    """Yield a finding if samples are kept for late joiners although the subscription exists from the start."""
    timing, publishers = end.pack.timing, model.partners_here(end)
    index = end.pack.vocabulary.indices.get((TOPIC, timing.latched))
    stated = index is not None and end.written(index) is not None
    if (
        publishers
        and all(keep_for_late_joiners(each, end) for each in publishers)
        and not (stated and _fact(end, timing.latched))
    ):
        message = (
            f"samples of `{end.shown}` are kept for later subscribers, and `{end.id}` is later only after a restart"
        )
        yield behaviour_finding("BP117", message, [end], policies=[timing.kept[0]])


def _bursts(model: FlowModel) -> Iterator[Finding]:
    """Yield findings if a subscriber requires `loss_free` and a burst is larger than the history of the publisher."""
    for end, topics in model.subscribers():
        # A history keeps its depth for each instance.
        if not required_value(end, "loss_free") or _fact(end, end.pack.timing.keyed):
            continue
        for topic in topics:
            for publisher in model.partners(end, [topic]):
                timing, depth = publisher.pack.timing, finite_value(publisher, publisher.pack.timing.depth)
                size = max((_burst(model, each, topic) for each in model.nodes([publisher])), default=0)
                if depth is not None and depth < size and is_one_of(publisher, timing.unlimited) is False:
                    message = (
                        f"subscriber `{end.id}` needs loss_free, but publisher `{publisher.id}` sends {size} samples at once "
                        f"and keeps {depth}"
                    )
                    yield behaviour_finding("BP109", message, [end], fix=draft_fix([publisher], timing.depth, size))


def _burst(model: FlowModel, at: int, topic: Hashable) -> int:
    """Return how many samples of a topic follow each other from a throw on without a step that takes time."""
    graph = model.behaviour.graph
    if at not in model.behaviour.reachable.fired:
        return 0
    size, seen, around = 1, {at}, graph.parent[at]
    following = graph.after[at]
    while len(following) == 1 and following[0] not in seen and topic in graph.throws[following[0]]:
        size += 1
        seen.add(following[0])
        following = graph.after[following[0]]
    inside = {graph.nodes[each].kind for each in graph.inside[around]}
    node = graph.nodes[around]
    whole = inside <= {"start", "throw", "end"} and all(len(graph.after[each]) < 2 for each in graph.inside[around])  # noqa: PLR2004
    return size * node.least_times if whole and node.kind == "subprocess" and not node.by_event else size
