"""How often events happen at most: a number at once, and a rate. Exact, and never less than in any run.

A bound (a, r) of a node says: by any time t since the system started, it happened at most a + r·t times. Delays and losses only
make that fewer. Where nothing is known there is no bound.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.components import components, turns
from cqos_core.behaviour.graph import ENTERED
from cqos_core.behaviour.waiting import Waits, timer_wait
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Sequence

    from cqos_core.behaviour.graph import Graph, Wiring
    from cqos_core.model.flow import Timer

_MOST_ORIGINS: Final = 3


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something happens at most by a time t, in nanoseconds: ``once + rate * t``.

    Attributes:
        origins: positions of the timers that limit the rate; a few of them.
        alone: it rests on the assumption that a start without trigger happens once in each participant.
        signals: it rests on the assumption that nothing else publishes on the topics of start events.
    """

    once: Fraction
    rate: Fraction = Fraction(0)
    origins: tuple[int, ...] = ()
    alone: bool = False
    signals: bool = False

    def times(self, factor: int | Fraction) -> Rate:
        """Return the bound of as many at a time."""
        return replace(self, once=self.once * factor, rate=self.rate * factor)

    def excludes(self, gap: int) -> bool:
        """Whether it is certain that at some time more than ``gap`` nanoseconds pass without it."""
        return self.rate * gap < 1

    @property
    def mean_period(self) -> int | None:
        """The mean time between two of them is at least this many nanoseconds; None where there are finitely many."""
        return int(1 / self.rate) if self.rate else None


NEVER: Final = Rate(Fraction(0))
ONCE: Final = Rate(Fraction(1))
_ALONE: Final = Rate(Fraction(1), alone=True)


def added(bounds: Iterable[Rate | None]) -> Rate | None:
    """Return the bound of all together."""
    once, rate, origins, alone, signals = Fraction(0), Fraction(0), dict[int, None](), False, False
    for each in bounds:
        if each is None:
            return None
        once, rate = once + each.once, rate + each.rate
        origins.update(dict.fromkeys(each.origins))
        alone, signals = alone or each.alone, signals or each.signals
    return Rate(once, rate, tuple(origins)[:_MOST_ORIGINS], alone, signals)


def tightest(bounds: Iterable[Rate | None]) -> Rate | None:
    """Return the bound of what happens only together with all of them."""
    known = [each for each in bounds if each is not None]
    return min(known, key=lambda each: (each.rate, each.once), default=None)


def scaled(bound: Rate | None, factor: int | None) -> Rate | None:
    """Return the bound of as many at a time, None where that number has no limit."""
    return None if bound is None or factor is None else bound.times(factor)


_OUTSIDE: Final = frozenset({"signal", "message", "timer", "conditional"})
_CHOOSING: Final = frozenset({"exclusive", "event_based"})
_TURNING: Final = _CHOOSING | {"catch", "throw", "task", "call", "subprocess", "parallel", "inclusive", "boundary"}
"""Kinds of nodes that a loop may consist of, where its turns are counted."""


class Counting:
    """The bounds of all nodes.

    Attributes:
        bounds: by position of a node how often it happens, or is entered; then those of topics.
    """

    def __init__(self, graph: Graph, signals: Wiring) -> None:
        """Count once."""
        self._graph = graph
        self._signals = signals
        self._waits = Waits(graph)
        self._size = len(graph.nodes)
        self._thrown = [*graph.thrown_at]
        self._topics = {topic: self._size + number for number, topic in enumerate(self._thrown)}
        self.bounds: list[Rate | None] = [None] * (self._size + len(self._thrown))
        for group in components(range(len(self.bounds)), self._depends):
            if len(group) == 1 and group[0] not in self._depends(group[0]):
                self.bounds[group[0]] = self._count(group[0])
            else:
                self._turn(group)

    def of_topic(self, topic: Hashable) -> Rate | None:
        """Return how often the processes publish on a topic; None also where something else may, or has to, publish there."""
        at = self._topics.get(topic)
        return None if at is None or self._signals.is_open(topic) else self.bounds[at]

    def throws(self, at: int) -> Rate | None:
        """Return how often a node throws."""
        return scaled(self.bounds[at], self._graph.nodes[at].times)

    def _depends(self, at: int) -> Sequence[int]:
        """Return what the bound of a node or a topic follows from."""
        graph = self._graph
        if at >= self._size:
            return graph.thrown_at[self._thrown[at - self._size]]
        node, parent = graph.nodes[at], graph.parent[at]
        if node.kind == "process" or node.by_event:
            return [each for each in graph.inside[at] if graph.nodes[each].kind == "start"] or graph.calls[at]
        topics = [self._topics[each] for each in graph.catches[at] or () if each in self._topics]
        if node.kind == "boundary":
            activity = graph.attached[at]
            return topics if activity is None else [*topics, activity]
        if node.kind == "start" and graph.nodes[parent].by_event:
            return [*topics, graph.parent[parent]]
        if node.kind == "start" and graph.nodes[parent].kind == "process":
            return topics if node.triggers else graph.calls[parent]
        return graph.before[at] or [parent]

    def _count(self, at: int) -> Rate | None:
        """Return the bound of what is in no loop, from the bounds of what it depends on."""
        graph = self._graph
        if at >= self._size:
            return added(self.throws(each) for each in graph.thrown_at[self._thrown[at - self._size]])
        node = graph.nodes[at]
        if not graph.drawn[at] or node.compensates or node.kind in {"unknown", "event_start", "transaction", "complex"}:
            return None
        if node.kind == "process" or node.by_event:
            return self._instances_of(at)
        if node.kind == "boundary":
            activity = graph.attached[at]
            return None if activity is None else self._event(at, self.bounds[activity])
        if node.kind == "start":
            return self._start(at)
        if any(each.kind in {"link", "unknown"} for each in node.triggers if node.kind == "catch"):
            return None
        if not graph.before[at]:
            waits = node.kind == "event_based" or graph.is_alone(at)
            return None if waits else self._inside(graph.parent[at])
        incoming = [self.bounds[each] for each in graph.before[at]]
        if len(incoming) > 1 and node.kind == "parallel":
            return tightest(incoming)
        return None if len(incoming) > 1 and node.kind == "inclusive" else added(incoming)

    def _instances_of(self, at: int) -> Rate | None:
        """Return how often a process or an event sub-process begins."""
        graph = self._graph
        kinds = {graph.nodes[each].kind for each in graph.inside[at]}
        if "event_start" in kinds:
            return None
        if "start" in kinds:
            return added(self.bounds[each] for each in graph.inside[at] if graph.nodes[each].kind == "start")
        return None if graph.nodes[at].by_event else self._untriggered(at)

    def _inside(self, around: int) -> Rate | None:
        """Return how often what is in a process or a sub-process is begun."""
        node = self._graph.nodes[around]
        return scaled(self.bounds[around], node.times) if node.kind in ENTERED else None

    def _several(self, process: int) -> int | None:
        """Return how many participants run a process, None where that has no limit."""
        several = [each for _, each in self._graph.nodes[process].participants]
        return None if None in several else sum(each for each in several if each is not None)

    def _untriggered(self, process: int) -> Rate | None:
        """Return how often a process begins by itself, or because it is called."""
        graph = self._graph
        if graph.called_anywhere:
            return None
        own = scaled(_ALONE, self._several(process)) if graph.nodes[process].has_pool else NEVER
        return added([own, *(scaled(self.bounds[each], graph.nodes[each].times) for each in graph.calls[process])])

    def _start(self, at: int) -> Rate | None:
        graph, node = self._graph, self._graph.nodes[at]
        parent = graph.parent[at]
        if graph.nodes[parent].by_event:
            return self._event(at, self._inside(graph.parent[parent]))
        if graph.nodes[parent].kind != "process":
            return self._inside(parent)
        if not node.triggers:
            return self._untriggered(parent)
        return self._triggered(at, scaled(ONCE, self._several(parent)))

    def _event(self, at: int, around: Rate | None) -> Rate | None:
        """Return how often an event happens while something else is done, which is begun so often."""
        node = self._graph.nodes[at]
        if not node.triggers or not _OUTSIDE.issuperset({each.kind for each in node.triggers}):
            return None
        return around if node.interrupting else self._triggered(at, around)

    def _triggered(self, at: int, each: Rate | None) -> Rate | None:
        """Return how often an event is triggered that waits as often."""
        if each is None:
            return None
        node = self._graph.nodes[at]
        bounds = [_of_timer(trigger.timer, each, at) for trigger in node.triggers if trigger.timer is not None]
        kind = self._graph.heard(at)
        if any(trigger.kind == kind for trigger in node.triggers):
            topics = self._graph.catches[at]
            heard = [self.of_topic(topic) for topic in topics] if topics and each.rate == 0 else [None]
            together = tightest(heard) if node.all_triggers else added(heard)
            bounds.append(None if together is None else replace(together.times(each.once), signals=True))
        if any(trigger.timer is None and trigger.kind != kind for trigger in node.triggers):
            bounds.append(None)
        return tightest(bounds) if node.all_triggers else added(bounds)

    def _turn(self, group: Sequence[int]) -> None:
        """Count the nodes of a loop: tokens that enter it and the least time of a turn."""
        entering = self._entering(group)
        if entering is None or entering.rate:
            return
        inside = set(group)
        timers = [at for at in sorted(inside) if timer_wait(self._graph, at)][:_MOST_ORIGINS]
        for at, time in turns(group, self._waits.steps).items():
            if time:
                origins = tuple(timers) or entering.origins
                self.bounds[at] = replace(entering, rate=entering.once / time, origins=origins)

    def _entering(self, group: Sequence[int]) -> Rate | None:
        """Return how many tokens enter a loop; None where there are more in it than that, or it is not understood."""
        graph, inside = self._graph, set(group)
        entering: list[Rate | None] = []
        for at in group:
            if at >= self._size or not graph.drawn[at]:
                return None
            node = graph.nodes[at]
            links = any(each.kind in {"link", "unknown"} for each in node.triggers)
            if node.kind not in _TURNING or node.compensates or node.by_event or links:
                return None
            staying = sum(1 for each in graph.after[at] if each in inside)
            if staying > 1 and node.kind not in _CHOOSING:
                return None
            if node.kind == "boundary":
                if not node.interrupting or not _OUTSIDE.issuperset({each.kind for each in node.triggers}):
                    return None
            elif node.kind == "inclusive" and len(graph.before[at]) > 1:
                return None
            entering += [self.bounds[each] for each in graph.before[at] if each not in inside]
        return added(entering)


def _of_timer(timer: Timer, each: Rate, at: int) -> Rate | None:
    """Return how often a timer fires that is started as often."""
    if timer.count is not None:
        return each.times(timer.count)
    if timer.kind != "cycle" or not timer.wait or each.rate:
        return None
    return replace(each, rate=each.once / timer.wait, origins=(at,))
