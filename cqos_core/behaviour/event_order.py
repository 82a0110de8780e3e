"""The order of events, and the least time between them: in one process by dominance, across processes by signals with one source.

If a path leads around an event, and only one token may reach either, the event happens earlier or never.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from typing import Final

from cqos_core.behaviour.graph import ENTERED, Graph, Wiring, link_catches
from cqos_core.behaviour.least_wait_times import WaitTimes, shortest_times, timer_wait
from cqos_core.model.flow import WITHIN
from cqos_core.model.grouping import grouped

_FARTHEST: Final = 6
"""The most signals over which an order is followed."""
_BUDGET: Final = 40
"""The most steps of all searches for each node of the model; beyond that, no order is claimed."""


class Order:
    """The order of the events of all processes."""

    def __init__(self, graph: Graph, signals: Wiring, token: Callable[[int], int | None]) -> None:
        """Compute dominators and least times; ``token`` returns the only token that may come to a node."""
        self._graph = graph
        self._token = token
        self._signals = signals
        self._waits = WaitTimes(graph)
        self._size = len(graph.nodes)
        self._root = 2 * self._size
        steps = self._steps()
        self._arrival = shortest_times([self._root], lambda at: steps.get(at, ()))
        self._dominator = _dominators(self._root, steps)
        self._left = _BUDGET * self._size

    def since(self, first: int, last: int, hops: int = 0) -> int | None:
        """Return the least nanoseconds from one event until a token arrives at another; None if no order is certain.

        The first event happens at most once.
        """
        if first == last:
            return 0
        if last not in self._arrival or hops > _FARTHEST:
            return None
        found: int | None = None
        for at in self.before(last):
            if at == first:
                return self._between(first, last)
            topic = self.heard(at)
            if topic is None:
                continue
            times = [self.since(first, each, hops + 1) for each in self._graph.thrown_at.get(topic, ())]
            known = [each for each in times if each is not None]
            if known and len(known) == len(times):
                time = min(known) + self._between(at, last)
                found = time if found is None else max(found, time)
        if found is None and self._token(first) is not None and self._token(first) == self._token(last):
            self._left -= len(self._graph.inside[self._graph.parent[first]])
            found = shortest_times([first], self._waits.steps).get(last) if self._left > 0 else None
        return found

    def heard(self, at: int) -> Hashable | None:
        """Return the only topic that an event waits for; None if it may happen otherwise."""
        node, topics = self._graph.nodes[at], self._graph.catches[at]
        if node.kind not in {"start", "catch", "boundary"} or topics is None or len(topics) != 1:
            return None
        (topic,) = topics
        heard = self._graph.heard(at)
        alone = all(each.kind == heard for each in node.triggers)
        return topic if alone and not self._signals.is_open(topic) else None

    def _between(self, first: int, last: int) -> int:
        return self._arrival[last] - self._arrival[first] - timer_wait(self._graph, first)

    def before(self, at: int) -> Iterator[int]:
        """Yield the events that certainly happen before a token arrives at a node, the nearest first."""
        while (at := self._dominator.get(at, self._root)) != self._root and self._left > 0:
            self._left -= 1
            if at < self._size:
                yield at

    def _steps(self) -> dict[int, list[tuple[int, int]]]:
        """Return the steps of tokens; positions beyond those of the nodes are ends of sub-processes."""
        graph, root = self._graph, self._root
        steps: dict[int, list[tuple[int, int]]] = {at: [] for at in (*range(self._size), root)}
        links = link_catches(graph)
        for at, node in enumerate(graph.nodes):
            done = at
            if node.kind in WITHIN and node.kind != "process":
                done = self._size + at
                steps.setdefault(done, [])
                self._enter(at, done, steps)
            elif node.kind == "process":
                self._enter(at, None, steps)
            time = timer_wait(graph, at) if done == at else 0
            if node.kind == "call":
                time = self._waits.passing(at)
            steps[done] += [(following, time) for following in graph.after[at]]
            steps[at] += [(event, 0) for event in graph.boundary[at]]
            for each in node.triggers if node.kind in {"throw", "end"} else ():
                steps[at] += [(to, 0) for to in links.get((graph.process[at], each.link), ()) if each.kind == "link"]
            loose = node.kind in {"unknown", "event_start", "process"} or node.compensates or not graph.drawn[at]
            loose = loose or graph.parent[at] in graph.loose
            linked = node.kind == "catch" and any(each.kind == "link" for each in node.triggers)
            if loose or linked or (node.kind == "boundary" and graph.attached[at] is None):
                steps[root].append((at, 0))
        return steps

    def _enter(self, around: int, done: int | None, steps: dict[int, list[tuple[int, int]]]) -> None:
        """Add the steps from the start of a process or sub-process to its first nodes, and from its last nodes to its end."""
        graph, node = self._graph, self._graph.nodes[around]
        odd = node.kind not in ENTERED or node.least_times < 1 or not graph.inside[around]
        for at in graph.inside[around]:
            inner = graph.nodes[at]
            odd = odd or inner.by_event
            starts = inner.kind == "start" or inner.by_event or graph.is_entry(at)
            if starts or node.kind not in ENTERED:
                steps[around].append((at, 0))
            if done is not None and not graph.after[at] and not inner.by_event:
                end = self._size + at if inner.kind in WITHIN else at
                steps.setdefault(end, []).append((done, 0))
        if done is not None and odd:
            steps[around].append((done, 0))


def _dominators(root: int, steps: dict[int, list[tuple[int, int]]]) -> dict[int, int]:
    """Return the nearest dominator of each node that is reached (Cooper, Harvey and Kennedy 2001)."""
    order: list[int] = []
    seen = {root}
    work = [(root, iter(steps[root]))]
    while work:
        at, rest = work[-1]
        for other, _ in rest:
            if other not in seen:
                seen.add(other)
                work.append((other, iter(steps.get(other, ()))))
                break
        else:
            work.pop()
            order.append(at)
    rank = {at: number for number, at in enumerate(order)}
    before = grouped((other, at) for at in order for other, _ in steps.get(at, ()))
    found = {root: root}
    changed = True
    while changed:
        changed = False
        for at in reversed(order[:-1]):
            known = [each for each in before[at] if each in found]
            nearest = known[0]
            for each in known[1:]:
                nearest = _common(nearest, each, found, rank)
            if found.get(at) != nearest:
                found[at] = nearest
                changed = True
    return found


def _common(one: int, other: int, found: dict[int, int], rank: dict[int, int]) -> int:
    while one != other:
        while rank[one] < rank[other]:
            one = found[one]
        while rank[other] < rank[one]:
            other = found[other]
    return one
