"""Simulates tokens with random delays over the control flow of a model.

It knows nothing of the analysis. Time passes in tasks (also for ever), in catches and in timers, which are late or exact and never
early. Gateways choose freely. A signal reaches each catch that waits, late or not at all.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from functools import partial
from heapq import heappop, heappush
from itertools import count
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from random import Random

    from cqos_core.model.flow import ControlFlow, FlowNode, Trigger

SECOND: Final = 1_000_000_000
MOST_STEPS: Final = 1_500
"""Steps after which a run ends, whatever time it is."""
_SEVERAL: Final = 3
_INSIDE: Final = frozenset({"subprocess", "transaction", "adhoc"})
_GIVEN_OUTSIDE: Final = frozenset(
    {"message", "conditional", "unknown", "error", "escalation", "compensation", "cancel"}
)


@dataclass
class Log:
    """What happened in one run; times in nanoseconds.

    Attributes:
        fired: by node, when it fired.
        waited: nodes of catches at which a token was.
        end: when the run ended.
        whole: whether it reached its end, and not the bound of steps.
    """

    fired: dict[int, list[int]] = field(default_factory=lambda: defaultdict(list))
    waited: set[int] = field(default_factory=set)
    end: int = 0
    whole: bool = True


class _Scope:
    """An instance of a process or of a sub-process."""

    def __init__(self, position: int, outer: _Scope | None, done: Callable[[], None]) -> None:
        self.position, self.outer, self.done = position, outer, done
        self.tokens, self.ended = 0, False
        self.arrived: dict[int, list[int]] = defaultdict(list)

    @property
    def alive(self) -> bool:
        return not self.ended and (self.outer is None or self.outer.alive)


class Simulation:
    """One run."""

    def __init__(
        self,
        flow: ControlFlow,
        topics: Mapping[str, str],
        random: Random,
        horizon: int,
        *,
        calm: bool = False,
        external: Iterable[str] = (),
    ) -> None:
        """``topics``: by endpoint. In a ``calm`` run nothing is late or lost, and tasks take no second or one. ``external``: thrown outside too."""
        self.external = tuple(external)
        self.flow, self.random, self.horizon, self.calm = flow, random, horizon, calm
        self.topics = [frozenset(topics[each] for each in node.endpoints if each in topics) for node in flow.nodes]
        self.out: dict[int, list[tuple[int, int]]] = defaultdict(list)
        self.into: dict[int, list[int]] = defaultdict(list)
        for number, (start, end) in enumerate(flow.flows):
            self.out[start].append((number, end))
            self.into[end].append(number)
        self.inside: dict[int, list[int]] = defaultdict(list)
        self.boundaries: dict[int, list[int]] = defaultdict(list)
        for position, node in enumerate(flow.nodes):
            if node.parent is not None:
                self.inside[node.parent].append(position)
            if node.kind == "boundary" and node.attached is not None:
                self.boundaries[node.attached].append(position)
        self.now, self.log = 0, Log()
        self.queue: list[tuple[int, int, Callable[[], None]]] = []
        self.order = count()
        self.waiting: dict[str, list[tuple[Callable[[], bool], Callable[[], None]]]] = defaultdict(list)
        self.pace = random.choice((0, SECOND))
        self.habits: dict[int, tuple[int, int]] = {}
        self.has_habits = random.random() < 0.4
        self.idle_starts = random.random() < 0.5

    def run(self) -> Log:
        """Run until the horizon."""
        for position, node in enumerate(self.flow.nodes):
            if node.kind == "process" and (node.has_pool or node.participants):
                self._set_up(position, node)
        for topic in self.external:
            self._often(lambda topic=topic: self._deliver(topic))  # type: ignore[misc]
        steps = 0
        while self.queue and self.queue[0][0] <= self.horizon:
            steps += 1
            if steps > MOST_STEPS:
                self.log.whole, self.log.end = False, self.now
                return self.log
            self.now, _, do = heappop(self.queue)
            do()
        self.log.end = self.horizon
        return self.log

    # Time

    def _after(self, delay: int | None, do: Callable[[], None]) -> None:
        if delay is not None:
            heappush(self.queue, (self.now + delay, next(self.order), do))

    def _some_time(self) -> int | None:
        """Return how long something takes that has no bound; None: for ever."""
        if self.calm:
            return self.pace
        kind = self.random.random()
        if kind < 0.1:
            return None
        return 0 if kind < 0.4 else int(self.random.expovariate(1.0) * self.random.choice((SECOND, self.horizon / 50)))

    def _late(self, wait: int) -> int:
        return wait if self.calm or self.random.random() < 0.5 else wait + int(self.random.expovariate(4.0) * wait)

    # Processes

    def _set_up(self, position: int, node: FlowNode) -> None:
        for _, limit in node.participants or (("", 1),):
            here = self.random.randint(1, limit or _SEVERAL) if limit != 1 and not self.calm else (limit or 1)
            for _ in range(here):
                self._set_up_one(position)

    def _set_up_one(self, process: int) -> None:
        starts = [each for each in self.inside[process] if self.flow.nodes[each].kind == "start"]
        plain = [each for each in starts if not self.flow.nodes[each].triggers]
        if plain or not starts:
            self._instance(process, plain)
        for start in starts:
            for trigger in self.flow.nodes[start].triggers:
                self._arm_start(process, start, trigger)
        if starts and not plain and self.idle_starts:
            self._instance(process, [])
        for each in self.inside[process]:
            if self.flow.nodes[each].kind == "event_start" and not self.into[each]:
                self._instance(process, [each])

    def _arm_start(self, process: int, start: int, trigger: Trigger) -> None:
        def begin() -> None:
            self._instance(process, [start])

        if trigger.kind == "signal":
            for topic in self.topics[start]:
                self.waiting[topic].append((lambda: True, begin))
        elif trigger.kind == "timer" and trigger.timer is not None:
            self._tick(trigger, lambda: True, begin, first=0 if self.calm else None)
        else:
            self._often(begin)

    def _often(self, do: Callable[[], None]) -> None:
        """Let something outside happen again and again, or hardly ever."""
        pause = max(1, self.horizon // self.random.choice((3, 40, 200)))
        if self.calm:
            pause = SECOND

        def again() -> None:
            do()
            self._after(pause if self.calm else int(self.random.expovariate(1.0) * pause) + 1, again)

        if self.calm or self.random.random() < 0.8:
            self._after(0, again)

    def _tick(
        self,
        trigger: Trigger,
        alive: Callable[[], bool],
        do: Callable[[], None],
        *,
        first: int | None = None,
        once: bool = False,
    ) -> None:
        """Fire a timer: once, or in a cycle."""
        timer = trigger.timer
        assert timer is not None
        wait = timer.wait
        if wait is None:
            wait = SECOND if self.calm else max(1, int(self.horizon / self.random.choice((5, 100, 300))))
        left = 1 if timer.kind != "cycle" or once else timer.count
        most = None if left is None else [left]

        def fire() -> None:
            if not alive():
                return
            do()
            if most is not None:
                most[0] -= 1
            if most is None or most[0] > 0:
                self._after(max(1, self._late(wait)), fire)

        if first is None:
            first = (
                self._late(wait) if timer.kind != "cycle" or once else self.random.choice((0, wait, self._late(wait)))
            )
        self._after(first, fire)

    def _instance(self, process: int, starts: list[int]) -> None:
        scope = _Scope(process, None, lambda: None)
        self._begin(scope, starts)

    def _begin(self, scope: _Scope, starts: list[int]) -> None:
        """Put tokens on starts, and on nodes that no flow leads to."""
        nodes = self.flow.nodes
        free = [
            each
            for each in self.inside[scope.position]
            if not self.into[each]
            and nodes[each].kind not in {"start", "boundary", "event_start"}
            and not (nodes[each].by_event or nodes[each].compensates or _catches_link(nodes[each]))
        ]
        if starts and not self.idle_starts:
            free = []
        for each in self.inside[scope.position]:
            if nodes[each].by_event:
                self._arm_event_subprocess(scope, each)
        scope.tokens += len(starts) + len(free)
        for each in (*starts, *free):
            self._after(0, lambda each=each: self._enter(scope, each, None))  # type: ignore[misc]
        if not scope.tokens:
            self._finish(scope)

    def _finish(self, scope: _Scope) -> None:
        if not scope.ended:
            scope.ended = True
            scope.done()

    def _arm_event_subprocess(self, scope: _Scope, position: int) -> None:
        for start in (each for each in self.inside[position] if self.flow.nodes[each].kind == "start"):
            node = self.flow.nodes[start]

            def begin(node: FlowNode = node, start: int = start) -> None:
                if node.interrupting:
                    scope.tokens += 1
                inner = _Scope(position, scope, lambda: self._gone(scope) if node.interrupting else None)
                self._begin(inner, [start])

            for trigger in node.triggers:
                self._arm(start, trigger, lambda: scope.alive, begin, again=not node.interrupting)

    # Tokens

    def _enter(self, scope: _Scope, position: int, flow: int | None) -> None:
        if not scope.alive:
            return
        node = self.flow.nodes[position]
        kind = node.kind
        if kind in {"start", "end", "throw", "boundary"}:
            self._fire(scope, position, node)
        elif kind == "catch":
            self._wait(scope, {position: position})
        elif kind in {"event_based", "event_start"}:
            self._wait(scope, {end: end for _, end in self.out[position]})
        elif kind == "task" or (kind == "call" and node.calls is None):
            self._work(scope, position, lambda done, _inner: self._after(self._some_time(), done))
        elif kind == "call" or kind in _INSIDE:
            self._work(scope, position, lambda done, inner: self._run_inside(position, done, inner))
        elif kind == "parallel":
            self._join(scope, position, flow)
        else:
            self._choose(scope, position, kind)

    def _choose(self, scope: _Scope, position: int, kind: str) -> None:
        ways = self.out[position]
        if not ways:
            self._gone(scope)
        elif kind in {"exclusive", "unknown"}:
            if position not in self.habits or not self.has_habits:
                self.habits[position] = self.random.choice(ways)
            self._go(scope, [self.habits[position]])
        else:
            self._go(scope, self.random.sample(ways, self.random.randint(1, len(ways))))

    def _join(self, scope: _Scope, position: int, flow: int | None) -> None:
        needed = self.into[position]
        here = scope.arrived[position]
        here.append(-1 if flow is None else flow)
        if len(needed) > 1:
            if not set(needed) <= set(here):
                return
            for each in needed:
                here.remove(each)
            scope.tokens -= len(needed) - 1
        self._leave(scope, position)

    def _go(self, scope: _Scope, ways: list[tuple[int, int]]) -> None:
        scope.tokens += len(ways) - 1
        for number, end in ways:
            self._after(0, lambda number=number, end=end: self._enter(scope, end, number))  # type: ignore[misc]

    def _leave(self, scope: _Scope, position: int) -> None:
        ways = self.out[position]
        if ways:
            self._go(scope, ways)
        else:
            self._gone(scope)

    def _gone(self, scope: _Scope) -> None:
        scope.tokens -= 1
        if scope.tokens <= 0 and scope.alive:
            self._finish(scope)

    def _fire(self, scope: _Scope, position: int, node: FlowNode) -> None:
        self.log.fired[position].append(self.now)
        if node.kind in {"end", "throw"}:
            kinds = {each.kind for each in node.triggers}
            if "signal" in kinds:
                self._broadcast(position)
            if "terminate" in kinds:
                self._finish(scope)
                return
            for trigger in node.triggers:
                if trigger.kind == "link":
                    targets = [each for each in self.inside[scope.position] if self._catches(each, trigger.link)]
                    if targets:
                        self._after(0, partial(self._enter_link, scope, targets[0]))
                        return
        self._leave(scope, position)

    def _catches(self, position: int, link: str) -> bool:
        node = self.flow.nodes[position]
        return node.kind == "catch" and any(each.kind == "link" and each.link == link for each in node.triggers)

    def _enter_link(self, scope: _Scope, position: int) -> None:
        if scope.alive:
            self._fire(scope, position, self.flow.nodes[position])

    def _broadcast(self, position: int) -> None:
        for topic in self.topics[position]:
            self._deliver(topic)

    def _deliver(self, topic: str) -> None:
        """Let a sample arrive after some time, at all that wait then; each of them may lose it."""

        def arrive() -> None:
            there = [(alive, do) for alive, do in self.waiting[topic] if alive()]
            self.waiting[topic] = list(there)
            for alive, do in there:
                if alive() and (self.calm or self.random.random() > 0.1):
                    do()

        self._after(0 if self.calm else self._some_time(), arrive)

    # Waiting

    def _arm(
        self, position: int, trigger: Trigger, alive: Callable[[], bool], do: Callable[[], None], *, again: bool = False
    ) -> None:
        """Call ``do`` when a trigger happens, as long as ``alive`` says so."""
        if trigger.kind == "signal":
            for topic in self.topics[position]:
                self.waiting[topic].append((alive, do))
        elif trigger.kind == "timer" and trigger.timer is not None:
            self._tick(trigger, alive, do, once=not again)
        elif trigger.kind in _GIVEN_OUTSIDE:
            self._after(self._some_time(), lambda: do() if alive() else None)

    def _wait(self, scope: _Scope, events: Mapping[int, int]) -> None:
        """Wait for the first of several events."""
        over = [False]

        def ended(position: int) -> None:
            if not over[0] and scope.alive:
                over[0] = True
                self._fire(scope, position, self.flow.nodes[position])

        for position in events:
            node = self.flow.nodes[position]
            self.log.waited.add(position)
            if not node.triggers:
                self._after(self._some_time(), lambda position=position: ended(position))  # type: ignore[misc]
            for trigger in node.triggers:
                self._arm(
                    position,
                    trigger,
                    lambda: not over[0] and scope.alive,
                    lambda position=position: ended(position),  # type: ignore[misc]
                )

    # Activities

    def _work(self, scope: _Scope, position: int, start: Callable[[Callable[[], None], _Scope], None]) -> None:
        """Do an activity as often as it says, while its boundary events wait."""
        node = self.flow.nodes[position]
        inner = _Scope(position, scope, lambda: None)
        most = _SEVERAL if node.times is None else node.times
        left = [most if self.calm else self.random.randint(min(node.least_times, most), most)]

        def done() -> None:
            if not inner.alive:
                return
            left[0] -= 1
            if left[0] <= 0:
                inner.ended = True
                self._leave(scope, position)

        for boundary in self.boundaries[position]:
            self._arm_boundary(scope, inner, boundary)
        if left[0] <= 0:
            left[0] = 1
            self._after(0, done)
            return
        for _ in range(left[0]):
            start(done, inner)

    def _arm_boundary(self, scope: _Scope, inner: _Scope, position: int) -> None:
        node = self.flow.nodes[position]
        self.log.waited.add(position)

        def caught() -> None:
            if node.interrupting:
                inner.ended = True
            else:
                scope.tokens += 1
            self._fire(scope, position, node)

        for trigger in node.triggers:
            self._arm(position, trigger, lambda: inner.alive, caught, again=not node.interrupting)

    def _run_inside(self, position: int, done: Callable[[], None], inner: _Scope) -> None:
        node = self.flow.nodes[position]
        body = position if node.calls is None else node.calls
        scope = _Scope(body, inner, done)
        inside = self.inside[body]
        starts = [each for each in inside if self.flow.nodes[each].kind == "start"]
        if node.calls is not None:
            starts = [each for each in starts if not self.flow.nodes[each].triggers]
        if node.kind == "adhoc":
            starts = [each for each in inside if self.random.random() < 0.7]
        self._begin(scope, starts)


def _catches_link(node: FlowNode) -> bool:
    return node.kind == "catch" and any(each.kind == "link" for each in node.triggers)
