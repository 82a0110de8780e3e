"""Least waiting times of tokens, from literal timers. Tasks, gateways and messages count as zero."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cqos_core.behaviour.graph import Graph

_DEEPEST: Final = 40
"""The most nested sub-processes and calls; deeper ones count as zero."""


def timer_wait(graph: Graph, at: int) -> int:
    """Return the least nanoseconds from the arrival of a token at an event until it happens."""
    node = graph.nodes[at]
    waits = [each.timer.wait for each in node.triggers if each.timer is not None and each.timer.kind == "duration"]
    if node.kind not in {"catch", "boundary"} or not waits or None in waits:
        return 0
    known = [each for each in waits if each is not None]
    if node.all_triggers:
        return max(known)
    return min(known) if len(known) == len(node.triggers) else 0


class WaitTimes:
    """The least times to pass nodes, each computed once."""

    def __init__(self, graph: Graph) -> None:
        """Begin without any."""
        self._graph = graph
        self._passing: dict[int, int] = {}

    def passing(self, at: int, depth: int = 0) -> int:
        """Return the least time from the arrival of a token at a node until it leaves."""
        if at not in self._passing:
            self._passing[at] = 0  # while it is computed, for calls of itself
            self._passing[at] = self._through(at, depth)
        return self._passing[at]

    def _through(self, at: int, depth: int) -> int:
        graph, node = self._graph, self._graph.nodes[at]
        if node.kind in {"catch", "boundary"}:
            return timer_wait(graph, at)
        if depth > _DEEPEST or node.least_times < 1:
            return 0
        if node.kind == "subprocess":
            return self._inside(at, depth + 1)
        if node.kind == "call":
            return min((self._inside(each, depth + 1) for each in graph.called[at]), default=0)
        return 0

    def _inside(self, around: int, depth: int) -> int:
        """Return the least time from start to end of a process or sub-process."""
        graph = self._graph
        inside = graph.inside[around]
        entries = [
            at
            for at in inside
            if graph.is_entry(at) or (graph.nodes[at].kind == "start" and not graph.nodes[at].triggers)
        ]
        loose = any(graph.nodes[at].by_event or graph.nodes[at].kind in {"unknown", "event_start"} for at in inside)
        if loose or not graph.drawn[around] or any(_is_odd(graph, at) for at in inside):
            return 0
        arrivals = shortest_times(entries, lambda at: self.steps(at, depth))
        ends = [arrivals[at] + self.passing(at, depth) for at in inside if at in arrivals and not graph.after[at]]
        return min(ends, default=0)

    def steps(self, at: int, depth: int = 0) -> Iterator[tuple[int, int]]:
        """Yield the next nodes of a token, each with the least time from arrival to arrival."""
        graph = self._graph
        for event in graph.boundary[at]:
            yield event, 0
        time = self.passing(at, depth)
        for following in graph.after[at]:
            yield following, time


def _is_odd(graph: Graph, at: int) -> bool:
    """Whether a node sends tokens elsewhere than over flows."""
    return any(each.kind in {"link", "unknown"} for each in graph.nodes[at].triggers)


def shortest_times(starts: Iterable[int], steps: Callable[[int], Iterable[tuple[int, int]]]) -> dict[int, int]:
    """Return the least time to each node that some ``starts`` reach (Dijkstra 1959)."""
    times: dict[int, int] = {}
    waiting = [(0, at) for at in sorted(starts)]
    while waiting:
        time, at = heappop(waiting)
        if at in times:
            continue
        times[at] = time
        for following, more in steps(at):
            if following not in times:
                heappush(waiting, (time + more, following))
    return times
