"""Upper bounds on how often events happen: a number at once, and a rate. No run exceeds a bound.

A bound (a, r) of a node means: until any time t since the start of the system, it happens at most a + r·t times. Delays and losses
only lower that. An unknown rate has no bound.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import ceil
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.components import components, turns
from cqos_core.behaviour.graph import ENTERED
from cqos_core.behaviour.least_wait_times import WaitTimes, timer_wait
from cqos_core.language.values import INFINITE
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from cqos_core.behaviour.graph import Graph, Wiring
    from cqos_core.model.flow import Timer

_MOST_ORIGINS: Final = 3
_SHOWN: Final = 1_000_000  # nanoseconds


@dataclass(frozen=True, slots=True)
class Rate:
    """The most often something happens until a time t in nanoseconds: ``once + rate * t``.

    Attributes:
        origins: positions of a few timers that limit the rate.
        alone: it assumes that a start without trigger happens once in each participant.
        signals: it assumes that nothing else publishes on the topics of start events.
    """

    once: Fraction
    rate: Fraction = Fraction(0)
    origins: tuple[int, ...] = ()
    alone: bool = False
    signals: bool = False

    def times(self, factor: int | Fraction) -> Rate:
        """Return the bound of ``factor`` events at a time."""
        return replace(self, once=self.once * factor, rate=self.rate * factor)

    def excludes(self, gap: int) -> bool:
        """Whether some gap between two events is certainly longer than ``gap`` nanoseconds."""
        return self.rate * gap < 1

    @property
    def shortest_gap(self) -> int:
        """The shortest gap in nanoseconds that the events can keep, in whole milliseconds."""
        return ceil(1 / self.rate / _SHOWN) * _SHOWN if self.rate else INFINITE

    @property
    def mean_period(self) -> int | None:
        """The least mean nanoseconds between two events, rounded for people; None if there are finitely many."""
        if not self.rate:
            return None
        exact = int(1 / self.rate)
        return exact - exact % _SHOWN if exact > _SHOWN else exact


NEVER: Final = Rate(Fraction(0))
ONCE: Final = Rate(Fraction(1))
_DEAD: Final = Rate(Fraction(0), signals=True)
_ALONE: Final = Rate(Fraction(1), alone=True)


def sum_of_rates(bounds: Iterable[Rate | None]) -> Rate | None:
    """Return the sum of bounds; None if one is missing."""
    once, rate, origins, alone, signals = Fraction(0), Fraction(0), dict[int, None](), False, False
    for each in bounds:
        if each is None:
            return None
        once, rate = once + each.once, rate + each.rate
        origins.update(dict.fromkeys(each.origins))
        alone, signals = alone or each.alone, signals or each.signals
    return Rate(once, rate, tuple(origins)[:_MOST_ORIGINS], alone, signals)


def is_single(bound: Rate | None) -> bool:
    """Whether something happens at most once."""
    return bound is not None and bound.once <= 1 and not bound.rate


def tightest(bounds: Iterable[Rate | None]) -> Rate | None:
    """Return the smallest of some bounds."""
    known = [each for each in bounds if each is not None]
    return min(known, key=lambda each: (each.rate, each.once), default=None)


def scaled(bound: Rate | None, factor: int | None) -> Rate | None:
    """Return the bound of ``factor`` events at a time; None without limit."""
    return None if bound is None or factor is None else bound.times(factor)


_OUTSIDE: Final = frozenset({"signal", "message", "timer", "conditional"})
_CHOOSING: Final = frozenset({"exclusive", "event_based"})
_TURNING: Final = _CHOOSING | {
    "start",
    "end",
    "catch",
    "throw",
    "task",
    "call",
    "subprocess",
    "parallel",
    "inclusive",
    "boundary",
}
"""Kinds of nodes in loops whose turns are counted."""


class EventRates:
    """The bounds of all nodes and topics.

    Attributes:
        bounds: by position: how often a node happens or is entered; behind the nodes, those of topics.
    """

    def __init__(
        self, graph: Graph, signals: Wiring, happening: AbstractSet[int], earlier: EventRates | None = None
    ) -> None:
        """Compute all bounds.

        Args:
            graph: the nodes.
            signals: what they throw and catch.
            happening: the nodes that may happen.
            earlier: known bounds, which limit loops that wait for samples.
        """
        self._graph = graph
        self._happening = happening
        self._earlier = earlier
        self._leaving: dict[int, tuple[int, Rate | None]] = {}
        self._sources: dict[int, tuple[int, Rate | None]] = {}
        self._signals = signals
        self._waits = WaitTimes(graph)
        self._size = len(graph.nodes)
        self._thrown = [*graph.thrown_at]
        self._topics = {topic: self._size + number for number, topic in enumerate(self._thrown)}
        self.bounds: list[Rate | None] = [None] * (self._size + len(self._thrown))
        for group in components(range(len(self.bounds)), self._depends):
            if len(group) == 1 and group[0] not in self._depends(group[0]):
                bound = self.bounds[group[0]] = self._count(group[0])
                self._sources.setdefault(group[0], (group[0], bound))
            else:
                self._turn(group)

    def of_topic(self, topic: Hashable) -> Rate | None:
        """Return how often processes publish on a topic; None also if something else may publish there."""
        at = self._topics.get(topic)
        return None if at is None or self._signals.is_open(topic) else self.bounds[at]

    def throws(self, at: int) -> Rate | None:
        """Return how often a node throws."""
        return scaled(self.bounds[at], self._graph.nodes[at].times)

    def token(self, at: int) -> int | None:
        """Return the source of the only token that may reach a node, once; None if there may be more tokens."""
        source, bound = self._sources.get(at, (None, None))
        return source if is_single(bound) else None

    def _depends(self, at: int) -> Sequence[int]:
        """Return the positions on which the bound of a node or topic depends."""
        graph = self._graph
        if at >= self._size:
            return graph.thrown_at[self._thrown[at - self._size]]
        node, parent = graph.nodes[at], graph.parent[at]
        if at not in self._happening:
            return []
        if node.kind == "process" or node.by_event:
            return [each for each in graph.inside[at] if graph.nodes[each].kind == "start"] or graph.calls[at]
        topics = [self._topics[each] for each in graph.catches[at] or () if each in self._topics]
        if node.kind == "boundary":
            activity = graph.attached[at]
            activities = [] if activity is None else [activity]
            return activities if node.interrupting else [*topics, *activities]
        if node.kind == "start" and graph.nodes[parent].by_event:
            return [*topics, graph.parent[parent]]
        if node.kind == "start" and graph.nodes[parent].kind == "process":
            return topics if node.triggers else graph.calls[parent]
        return graph.before[at] or [parent]

    def _count(self, at: int) -> Rate | None:
        """Return the bound of a node or topic outside of loops."""
        graph = self._graph
        if at >= self._size:
            return sum_of_rates(self.throws(each) for each in graph.thrown_at[self._thrown[at - self._size]])
        node = graph.nodes[at]
        if at not in self._happening:
            return _DEAD
        open_ended = not graph.drawn[at] or graph.parent[at] in graph.loose
        if open_ended or node.compensates or node.kind in {"unknown", "event_start", "transaction", "complex"}:
            return None
        if node.kind == "process" or node.by_event:
            return self._instances_of(at)
        if node.kind == "boundary":
            activity = graph.attached[at]
            return None if activity is None else self._event(at, self._left(activity, at))
        if node.kind == "start":
            return self._start(at)
        if any(each.kind in {"link", "unknown"} for each in node.triggers if node.kind == "catch"):
            return None
        if not graph.before[at]:
            waits = node.kind == "event_based" or graph.is_alone(at)
            return None if waits else self._inside(graph.parent[at])
        if len(graph.before[at]) > 1 and node.kind == "parallel":
            return tightest(self._left(each, at) for each in graph.before[at])
        coming, sources = self._coming([at])
        if len(coming) == 1 and sources:
            ((self._sources[at]),) = sources.items()
        return sum_of_rates(coming)

    def _coming(
        self, group: Iterable[int], inside: AbstractSet[int] = frozenset()
    ) -> tuple[list[Rate | None], Mapping[int, Rate | None]]:
        """Return how often tokens come to some nodes over flows from outside of ``inside``, and their sources.

        A token from one source takes one of several paths.
        """
        ways: list[Rate | None] = []
        sources: dict[int, Rate | None] = {}
        passed: dict[int, list[Rate | None]] = {}
        for at in group:
            for each in self._graph.before[at]:
                source = self._source(each)
                if source is not None and each not in inside:
                    sources[source[0]] = source[1]
                    passed.setdefault(source[0], []).append(self._left(each, at))
                elif each not in inside:
                    ways.append(self._left(each, at))
        together = [tightest([sources[source], sum_of_rates(bounds)]) for source, bounds in passed.items()]
        return [*ways, *together], sources

    def _source(self, at: int) -> tuple[int, Rate | None] | None:
        """Return the source of a token that leaves a node once, over one flow; None if it may leave more often."""
        if at in self._leaving:
            return self._leaving[at] if self._leaves_once(at) else None
        graph = self._graph
        return self._sources.get(at) if graph.nodes[at].kind in _CHOOSING or len(graph.after[at]) == 1 else None

    def _leaves_once(self, at: int) -> bool:
        """Whether a token in the loop of a node leaves the loop there at most once."""
        graph = self._graph
        alone = graph.nodes[at].kind in _CHOOSING or (len(graph.after[at]) == 1 and not graph.throws[at])
        return alone and at in self._leaving

    def _left(self, at: int, following: int) -> Rate | None:
        """Return how often tokens go from a node to a following node, or to its boundary event."""
        if self._graph.attached[following] == at:
            once = at in self._leaving and self._graph.nodes[following].interrupting
        else:
            once = self._leaves_once(at)
        return tightest([self.bounds[at], self._leaving[at][1]]) if once else self.bounds[at]

    def _instances_of(self, at: int) -> Rate | None:
        """Return how often a process or an event sub-process begins."""
        graph = self._graph
        kinds = {graph.nodes[each].kind for each in graph.inside[at]}
        if "event_start" in kinds:
            return None
        if "start" in kinds:
            idle = [scaled(_ALONE, self._several(at))] if graph.idles(at) else []
            return sum_of_rates(
                [*idle, *(self.bounds[each] for each in graph.inside[at] if graph.nodes[each].kind == "start")]
            )
        return None if graph.nodes[at].by_event else self._untriggered(at)

    def _inside(self, around: int) -> Rate | None:
        """Return how often the content of a process or sub-process begins."""
        node = self._graph.nodes[around]
        return scaled(self.bounds[around], node.times) if node.kind in ENTERED else None

    def _several(self, process: int) -> int | None:
        """Return how many participants run a process; None without limit."""
        several = [each for _, each in self._graph.nodes[process].participants]
        return None if None in several else sum(each for each in several if each is not None)

    def _untriggered(self, process: int) -> Rate | None:
        """Return how often a process begins by itself, or because it is called."""
        graph = self._graph
        if graph.called_anywhere:
            return None
        own = scaled(_ALONE, self._several(process)) if graph.nodes[process].has_pool else NEVER
        return sum_of_rates(
            [own, *(scaled(self.bounds[each], graph.nodes[each].times) for each in graph.calls[process])]
        )

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
        """Return how often an event happens during an activity that begins ``around`` often."""
        node = self._graph.nodes[at]
        if not node.triggers or not _OUTSIDE.issuperset({each.kind for each in node.triggers}):
            return None
        return around if node.interrupting else self._triggered(at, around)

    def _triggered(self, at: int, each: Rate | None) -> Rate | None:
        """Return how often an event is triggered that waits ``each`` often."""
        if each is None:
            return None
        node = self._graph.nodes[at]
        bounds = [_of_timer(trigger.timer, each, at) for trigger in node.triggers if trigger.timer is not None]
        kind = self._graph.heard(at)
        if any(trigger.kind == kind for trigger in node.triggers):
            topics = self._graph.catches[at]
            heard = [self.of_topic(topic) for topic in topics] if topics and each.rate == 0 else [None]
            together = tightest(heard) if node.all_triggers else sum_of_rates(heard)
            bounds.append(None if together is None else replace(together.times(each.once), signals=True))
        if any(trigger.timer is None and trigger.kind != kind for trigger in node.triggers):
            bounds.append(None)
        return tightest(bounds) if node.all_triggers else sum_of_rates(bounds)

    def _turn(self, group: Sequence[int]) -> None:
        """Set the bounds of a loop: from entering tokens, the least time of a turn, and the samples that each turn takes."""
        entering = self._entering(group)
        if entering is None:
            return
        self._leaving |= dict.fromkeys(group, (group[0], entering))
        if entering.rate:
            return
        inside = set(group)
        timers = [at for at in sorted(inside) if at < self._size and timer_wait(self._graph, at)][:_MOST_ORIGINS]
        for at, time in turns(group, self._steps).items():
            if time:
                origins = tuple(timers) or entering.origins
                self.bounds[at] = replace(entering, rate=entering.once / time, origins=origins)
        for at, bound in self._sampled(group, entering).items():
            self.bounds[at] = tightest([self.bounds[at], bound])

    def _steps(self, at: int) -> Iterator[tuple[int, int]]:
        """Yield the next positions of a token or of its samples, each with the least time."""
        graph = self._graph
        if at >= self._size:
            yield from ((each, 0) for each in graph.caught_at.get(self._thrown[at - self._size], ()))
        else:
            yield from self._waits.steps(at)
            yield from ((self._topics[each], 0) for each in graph.throws[at])

    def _sampled(self, group: Sequence[int], entering: Rate) -> dict[int, Rate]:
        """Return bounds of loop nodes whose every turn takes a sample: each token makes one turn more than there are samples."""
        taken = {at: bound for at in group if at < self._size and (bound := self._taken(at)) is not None}
        rest = {at: [each for each, _ in self._steps(at) if each not in taken] for at in group if at not in taken}
        inside = set(rest)
        rest = {at: [each for each in following if each in inside] for at, following in rest.items()}
        turning = {
            at
            for part in components(rest, rest.__getitem__)
            for at in part
            if len(part) > 1 or part[0] in rest[part[0]]
        }
        samples = sum_of_rates(taken.values())
        if not taken or samples is None:
            return {}
        bound = sum_of_rates([entering, replace(samples.times(entering.once), signals=True)])
        return {} if bound is None else dict.fromkeys(set(group) - turning, bound)

    def _taken(self, at: int) -> Rate | None:
        """Return the most samples for one token at a catch that needs one; None also if a sample may come again."""
        node, topics = self._graph.nodes[at], self._graph.catches[at]
        heard = self._graph.heard(at)
        needs = node.kind == "catch" or (node.kind == "boundary" and node.interrupting)
        if self._earlier is None or not needs or not topics or any(each.kind != heard for each in node.triggers):
            return None
        if self._graph.replayed[at]:
            return None
        heard_bounds = [self._earlier.of_topic(topic) for topic in topics]
        return tightest(heard_bounds) if node.all_triggers else sum_of_rates(heard_bounds)

    def _entering(self, group: Sequence[int]) -> Rate | None:
        """Return how many tokens enter a loop; None if tokens may multiply in it, or it is not understood."""
        graph, inside = self._graph, set(group)
        entering: list[Rate | None] = []
        for at in group:
            if at >= self._size:
                entering += self._entering_samples(at, inside)
                continue
            node = graph.nodes[at]
            links = any(each.kind in {"link", "unknown"} for each in node.triggers)
            if (
                node.kind not in _TURNING
                or node.compensates
                or node.by_event
                or links
                or not graph.drawn[at]
                or graph.parent[at] in graph.loose
            ):
                return None
            staying = sum(1 for each in graph.after[at] if each in inside)
            staying += sum(1 for each in graph.throws[at] if self._topics[each] in inside)
            if graph.parent[at] in inside or (staying > 1 and node.kind not in _CHOOSING):
                return None
            if node.kind == "boundary":
                if not node.interrupting or not _OUTSIDE.issuperset({each.kind for each in node.triggers}):
                    return None
            elif node.kind == "start":
                entering.append(self._starting(at, inside))
        nodes = [at for at in group if at < self._size]
        return sum_of_rates([*entering, *self._coming(nodes, inside)[0]])

    def _entering_samples(self, at: int, inside: AbstractSet[int]) -> list[Rate | None]:
        """Return how often samples come to a topic of a loop from outside; a sample of the loop starts one process of it."""
        graph, topic = self._graph, self._thrown[at - self._size]
        starts = [each for each in graph.caught_at.get(topic, ()) if each in inside]
        if len(starts) != 1 or self._signals.is_open(topic):
            return [None]
        return [self.throws(each) for each in graph.thrown_at[topic] if each not in inside]

    def _starting(self, at: int, inside: AbstractSet[int]) -> Rate | None:
        """Return how often a process of a loop is started from outside of the loop."""
        graph, node = self._graph, self._graph.nodes[at]
        topics, process = graph.catches[at], graph.parent[at]
        kinds = {each.kind for each in node.triggers}
        plain = graph.nodes[process].kind == "process" and not node.all_triggers and kinds == {graph.heard(at)}
        if not plain or not topics or self._several(process) != 1:
            return None
        return sum_of_rates(self.of_topic(each) for each in topics if self._topics.get(each) not in inside)


def _of_timer(timer: Timer, each: Rate, at: int) -> Rate | None:
    """Return how often a timer fires that is started ``each`` often."""
    if timer.count is not None:
        return each.times(timer.count)
    if timer.kind != "cycle" or not timer.wait or each.rate:
        return None
    return replace(each, rate=each.once / timer.wait, origins=(at,))
