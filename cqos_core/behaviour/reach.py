"""Which events may ever happen: the least set of nodes, with every condition, delay and message as favourable as possible.

What is not in it happens in no run (BPMN 2.0.2, 13.2 to 13.5).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.model.flow import WITHIN

if TYPE_CHECKING:
    from collections.abc import Hashable
    from collections.abc import Set as AbstractSet

    from cqos_core.behaviour.graph import Graph, Wiring

_WAITING: Final = frozenset({"start", "catch", "boundary"})


@dataclass(frozen=True, slots=True)
class Reached:
    """What may happen.

    Attributes:
        arrived: nodes at which a token may arrive, or that may wait for their event.
        fired: nodes that may happen.
        thrown: topics on which something may be published.
    """

    arrived: AbstractSet[int]
    fired: AbstractSet[int]
    thrown: AbstractSet[Hashable]


def reached(graph: Graph, signals: Wiring, *, missing: bool) -> Reached:
    """Return what may happen; with ``missing``, also what waits for a topic on which nothing publishes."""
    return _Search(graph, signals, missing=missing).run()


class _Search:
    """One search from all that happens by itself."""

    def __init__(self, graph: Graph, signals: Wiring, *, missing: bool) -> None:
        self._graph = graph
        self._signals = signals
        self._missing = missing
        self._arrived: set[int] = set()
        self._fired: set[int] = set()
        self._thrown: set[Hashable] = set()
        self._incoming: dict[int, int] = {}
        self._waiting: list[int] = []
        links: dict[tuple[int, str], list[int]] = {}
        for at, node in enumerate(graph.nodes):
            if node.kind == "catch":
                for each in node.triggers:
                    if each.kind == "link":
                        links.setdefault((graph.process[at], each.link), []).append(at)
        self._links = links

    def run(self) -> Reached:
        """Return what is reached in the end."""
        graph = self._graph
        linked = {
            (graph.process[at], each.link)
            for at, node in enumerate(graph.nodes)
            if node.kind in {"throw", "end"}
            for each in node.triggers
        }
        for at, node in enumerate(graph.nodes):
            open_ended = not graph.drawn[at] or node.kind in {"unknown", "event_start"}
            unattached = node.kind == "boundary" and graph.attached[at] is None
            if open_ended or unattached or (node.kind == "process" and self._runs_alone(at)):
                self._fire(at)
            elif node.kind == "start" and graph.nodes[graph.parent[at]].kind == "process":
                self._start(at)
        for key, catches in self._links.items():
            if key not in linked:
                for at in catches:
                    self._fire(at)
        while self._waiting:
            self._follow(self._waiting.pop())
        return Reached(self._arrived, self._fired, self._thrown)

    def _runs_alone(self, process: int) -> bool:
        """Whether a process without any start event begins by itself."""
        graph = self._graph
        starts = any(graph.nodes[at].kind in {"start", "event_start"} for at in graph.inside[process])
        return not starts and (graph.nodes[process].has_pool or graph.called_anywhere)

    def _start(self, at: int) -> None:
        """Let the start event of a process wait for its triggers; without any it happens with its process."""
        node = self._graph.nodes[at]
        own = self._graph.nodes[self._graph.process[at]].has_pool or self._graph.called_anywhere
        if node.triggers or own:
            self._arrive(at)

    def _arrive(self, at: int) -> None:
        """Put a token on a node, or let it wait."""
        if at in self._arrived:
            return
        self._arrived.add(at)
        if self._graph.nodes[at].kind not in _WAITING or self._may_happen(at):
            self._fire(at)

    def _may_happen(self, at: int) -> bool:
        """Whether what an event waits for may come."""
        node, topics = self._graph.nodes[at], self._graph.catches[at]
        heard = self._graph.heard(at)
        others = [each for each in node.triggers if each.kind != heard]
        if not topics or (others and not node.all_triggers):
            return True
        met = [self._comes(topic) for topic in topics]
        return all(met) if node.all_triggers else any(met)

    def _comes(self, topic: Hashable) -> bool:
        missing = self._missing and topic not in self._graph.thrown_at
        return topic in self._thrown or missing or self._signals.is_open(topic)

    def _fire(self, at: int) -> None:
        if at not in self._fired:
            self._arrived.add(at)
            self._fired.add(at)
            self._waiting.append(at)

    def _follow(self, at: int) -> None:
        """Do what follows when a node happens."""
        graph, node = self._graph, self._graph.nodes[at]
        for event in graph.boundary[at]:
            self._arrive(event)
        for following in graph.after[at]:
            self._step(following)
        if node.kind in WITHIN:
            self._enter(at)
        for process in graph.called[at]:
            self._call(process)
        if node.kind == "start":
            self._fire(graph.parent[at])
        if node.kind in {"throw", "end"}:
            for each in node.triggers:
                for catch in self._links.get((graph.process[at], each.link), ()) if each.kind == "link" else ():
                    self._fire(catch)
        for topic in graph.throws[at] - self._thrown:
            self._thrown.add(topic)
            for catch in graph.caught_at.get(topic, ()):
                if catch in self._arrived and self._may_happen(catch):
                    self._fire(catch)

    def _step(self, at: int) -> None:
        """Let a token come over one more flow."""
        self._incoming[at] = self._incoming.get(at, 0) + 1
        if self._graph.nodes[at].kind != "parallel" or self._incoming[at] == len(self._graph.before[at]):
            self._arrive(at)

    def _enter(self, at: int) -> None:
        """Begin what is in a process or a sub-process."""
        graph = self._graph
        anyhow = graph.nodes[at].kind in {"adhoc", "transaction"}
        for inside in graph.inside[at]:
            node = graph.nodes[inside]
            if node.by_event:
                for each in graph.inside[inside]:
                    if graph.nodes[each].kind == "start":
                        self._arrive(each)
            elif anyhow or node.compensates or graph.is_entry(inside):
                self._arrive(inside)

    def _call(self, process: int) -> None:
        """Begin a process that a call activity runs."""
        graph = self._graph
        starts = [at for at in graph.inside[process] if graph.nodes[at].kind in {"start", "event_start"}]
        for at in starts:
            if not graph.nodes[at].triggers:
                self._fire(at)
        if not starts:
            self._fire(process)
