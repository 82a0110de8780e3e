"""Inclusive joins that wait for their own successor, and so for ever (BPMN 2.0.2, 13.4.3).

An inclusive gateway waits while a token may still come over a flow that has none, without passing the gateway. Say a parallel gateway
sends one token to the join, and one to a parallel join that also waits for what follows the inclusive join. That token may still come
to the inclusive join, and cannot go on before it.

All tokens of a claim are of one instance of a process or sub-process. Before the join first happens, nothing has happened to which
each way leads through it. So what is said of that time needs no count of tokens.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.graph import ENTERED, UNENTERED

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.behaviour.graph import Graph

_PASSING: Final = frozenset({"task", "subprocess", "call", "throw", "catch"})
"""Kinds of nodes that a token leaves over their only flow, if no boundary event takes it."""
_BRANCHES: Final = 2
_MOST: Final = 100
"""The most pairs of an inclusive and a parallel join that are compared."""


def stuck_joins(graph: Graph) -> dict[int, int]:
    """Return the inclusive joins that never happen, each with the parallel join that waits for it and for which it waits."""
    joins = [at for at, node in enumerate(graph.nodes) if node.kind == "inclusive" and _is_join(graph, at)]
    pairs = ((at, each) for at in joins[:_MOST] for each in _ahead(graph, [at], {at}) if _is_parallel(graph, each))
    return {at: other for at, other in islice(pairs, _MOST) if _wait_for_each_other(graph, at, other)}


def _is_parallel(graph: Graph, at: int) -> bool:
    return graph.nodes[at].kind == "parallel" and _is_join(graph, at)


def _is_join(graph: Graph, at: int) -> bool:
    around = graph.parent[at]
    known = graph.nodes[around].kind in ENTERED and around not in graph.loose and graph.drawn[at]
    return known and len(set(graph.before[at])) == len(graph.before[at]) >= _BRANCHES


def _wait_for_each_other(graph: Graph, at: int, other: int) -> bool:
    """Whether a parallel join waits for an inclusive one, and that for a token which waits at the parallel one."""
    if not any(_only_through(graph, each, {at}) for each in graph.before[other]):
        return False
    coming = {each for each in _ahead(graph, [other], {at}) if at in graph.after[each]}
    if not coming or not all(_only_through(graph, each, {at, other}) for each in coming):
        return False
    splits = {split for each in graph.before[other] if (split := _split(graph, each, other)) is not None}
    return any(
        all(_only_through(graph, each, {at, other, split}) for each in graph.before[at] if each not in coming)
        for split in splits
    )


def _split(graph: Graph, at: int, following: int) -> int | None:
    """Return the parallel gateway that sends a token over single flows to a node; ``at`` is the node before that."""
    seen = {following}
    while at not in seen:
        seen.add(at)
        node = graph.nodes[at]
        if node.kind == "parallel":
            return at
        linked = any(each.kind == "link" for each in node.triggers)
        single = len(graph.before[at]) == 1 == len(graph.after[at])
        if node.kind not in _PASSING or not single or linked or graph.boundary[at] or node.by_event or node.compensates:
            return None
        (at,) = graph.before[at]
    return None


def _ahead(graph: Graph, first: Iterable[int], around: set[int]) -> Iterator[int]:
    """Yield the nodes to which flows lead, also those of boundary events, without passing some nodes."""
    waiting, seen = [*first], set(first)
    while waiting:
        at = waiting.pop()
        yield at
        for each in (*graph.after[at], *graph.boundary[at]):
            if each not in seen and each not in around:
                seen.add(each)
                waiting.append(each)


def _only_through(graph: Graph, at: int, through: set[int]) -> bool:
    """Whether a token comes to a node, or is there, only after one of some nodes of the same scope has happened."""
    waiting, seen = [at], {at}
    while waiting:
        at = waiting.pop()
        if at in through:
            continue
        node, activity = graph.nodes[at], graph.attached[at]
        linked = node.kind == "catch" and any(each.kind == "link" for each in node.triggers)
        before = graph.before[at] if activity is None else [activity]
        odd = (
            node.by_event or node.compensates or node.kind == "unknown" or (activity is None and node.kind in UNENTERED)
        )
        if odd or linked or not before or any(graph.parent[each] != graph.parent[at] for each in before):
            return False
        for each in before:
            if each not in seen:
                seen.add(each)
                waiting.append(each)
    return True
