"""Simulates tokens with random delays over the control flow of a model.

It knows nothing of the analysis. Time passes in tasks (also for ever), in catches and in timers, which are late or exact and never
early. Gateways choose freely. A signal reaches each catch that waits, late or not at all.
A message of a message flow is kept until an event takes it. What becomes of a sample while no token
waits is the reading of a run.
"""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from heapq import heappop, heappush
from itertools import count
from typing import TYPE_CHECKING, Final

from tests.oracle.parts import Log, Mail, Scope
from tests.oracle.samples import READINGS, Kept, Sample, Samples, Subscription

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from random import Random

    from cqos_core.model.flow import ControlFlow, FlowNode, Trigger

SECOND: Final = 1_000_000_000
MOST_STEPS: Final = 4_000
"""Steps after which a run ends, whatever time it is."""
_SEVERAL: Final = 3
_DEEPEST: Final = 8
_INSIDE: Final = frozenset({"subprocess", "transaction", "adhoc"})
_EVENTS: Final = frozenset({"start", "end", "throw", "catch", "boundary"})
_GIVEN_OUTSIDE: Final = frozenset(
    {"message", "conditional", "unknown", "error", "escalation", "compensation", "cancel"}
)


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
        kept: Mapping[str, Kept] | None = None,
        reading: str = READINGS[1],
        steps: int = MOST_STEPS,
    ) -> None:
        """Prepare a run.

        Args:
            flow: what is drawn.
            topics: by endpoint.
            random: chooses.
            horizon: nanoseconds after which the run ends.
            calm: nothing is late or lost, and tasks take no second or one.
            external: topics that are thrown outside too.
            kept: by endpoint what becomes of samples that are not taken at once.
            reading: one of `READINGS`.
            steps: after which the run ends.
        """
        self.external, self.steps = tuple(external), steps
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
        self.kept_at = [[(kept or {}).get(each, Kept()) for each in node.endpoints] or [Kept()] for node in flow.nodes]
        self.now, self.log = 0, Log(reading=reading)
        self.queue: list[tuple[int, float, int, Callable[[], None]]] = []
        self.order = count()
        self.samples = Samples(reading, self._after, lambda: self.now)
        self.log.taken = self.samples.taken
        for position, node in enumerate(flow.nodes):
            if node.kind in {"catch", "boundary"}:
                self.samples.queue(position, self.topics[position], self.kept_at[position][0].depth)
        self.pace = random.choice((0, SECOND))
        self.habits: dict[int, tuple[int, int]] = {}
        self.has_habits = random.random() < 0.4
        self.idle_starts = random.random() < 0.5
        self.lost, self.endless = random.choice((0.0, 0.1, 0.4)), random.choice((0.0, 0.1))
        waits = [t.timer.wait or 0 for node in flow.nodes for t in node.triggers if t.timer is not None]
        self.longest = 3 * max([5 * SECOND, *waits])
        self.in_order = random.random() < 0.5
        self.lateness = random.choice((0.0, 0.25, 2.0))
        self.has_scales = random.random() < 0.5
        self.scales: dict[object, float] = {}
        self.least_times = random.random() < 0.3
        self.step = random.choice((0, 0, SECOND // 10, SECOND))
        self.log.instant, self.log.punctual = not self.step, calm or not self.lateness
        self.log.prompt = calm or random.random() < 0.4
        self.in_order = self.in_order or self.log.prompt
        self.apart = random.random() < 0.5
        self.brought: dict[int, Mail] = defaultdict(Mail)
        self.sends: dict[int, list[Mail]] = defaultdict(list)
        for start, end in flow.messages:
            if not flow.nodes[end].endpoints:
                self.sends[start].append(self.brought[end])
        self.joining: dict[tuple[Scope, int], None] = {}

    def run(self) -> Log:
        """Run until the horizon."""
        for position, node in enumerate(self.flow.nodes):
            if node.kind == "process" and (node.has_pool or node.participants):
                self._set_up(position, node)
        for topic in self.external:
            self._often(lambda topic=topic: self._outside(topic))  # type: ignore[misc]
        steps = 0
        while self.queue and self.queue[0][0] <= self.horizon:
            steps += 1
            if steps > self.steps:
                self.log.whole, self.log.end = False, self.now
                return self.log
            self.now, _, _, do = heappop(self.queue)
            do()
            self._go_on()
        self.log.end = self.horizon
        return self.log

    # Time

    def _after(self, delay: int | None, do: Callable[[], None]) -> None:
        if delay is not None:
            rank = 0.0 if self.in_order else self.random.random()
            heappush(self.queue, (self.now + delay, rank, next(self.order), do))

    def _some_time(self, what: object) -> int | None:
        """Return how long something takes that has no bound, in some runs a time of its own; None: for ever."""
        if self.calm:
            return self.pace
        if self.random.random() < self.endless:
            return None
        scales = (0, SECOND, self.horizon / 200, self.horizon / 50, self.horizon / 12)
        scale = self.scales.setdefault(what, self.random.choice(scales)) if self.has_scales else None
        if scale is None:
            scale = 0 if self.random.random() < 0.3 else self.random.choice(scales)
        return int(self.random.expovariate(1.0) * scale)

    def _late(self, wait: int) -> int:
        if self.calm or not self.lateness or self.random.random() < 0.5:
            return wait
        return wait + int(self.random.expovariate(1.0) * self.lateness * wait)

    # Processes

    def _set_up(self, position: int, node: FlowNode) -> None:
        for _, limit in node.participants or (("", 1),):
            here = self.random.randint(1, limit or _SEVERAL) if limit != 1 and not self.calm else (limit or 1)
            for number in range(here):
                # Devices are switched on at any time, in calm runs evenly spread over a cycle of their timers.
                waits = [t.timer.wait for at in self.inside[position] for t in self.flow.nodes[at].triggers if t.timer]
                spread = max([10 * SECOND, *(each for each in waits if each)])
                offset = spread * number // here if self.calm else int(self.random.random() * self.longest)
                self._after(offset if self.apart else 0, partial(self._set_up_one, position))

    def _set_up_one(self, process: int) -> None:
        starts = [each for each in self.inside[process] if self.flow.nodes[each].kind == "start"]
        plain = [each for each in starts if not self.flow.nodes[each].triggers]
        alone = self.flow.nodes[process].has_pool
        if alone and (plain or not starts):
            self._instance(process, plain)
        for start in starts:
            for trigger in self.flow.nodes[start].triggers:
                self._arm_start(process, start, trigger)
        if alone and starts and not plain and self.idle_starts:
            self._instance(process, [])
        for each in self.inside[process]:
            if self.flow.nodes[each].kind == "event_start" and not self.into[each]:
                self._instance(process, [each])

    def _arm_start(self, process: int, start: int, trigger: Trigger) -> None:
        def begin() -> None:
            self._instance(process, [start])

        if trigger.kind == "signal":
            for topic in self.topics[start]:
                self.samples.waiting[topic].append(Subscription(start, lambda: True, begin))
        elif trigger.kind == "timer" and trigger.timer is not None:
            self._tick(trigger, lambda: True, begin, first=0 if self.calm else None)
        elif trigger.kind == "message" and start in self.brought:
            self.brought[start].wait(lambda: True, begin)
        else:
            self._often(begin)

    def _often(self, do: Callable[[], None]) -> None:
        """Let something outside happen again and again, or hardly ever."""
        pause = max(1, self.horizon // self.random.choice((3, 40, 200)))
        if self.calm:
            pause = self.random.choice((SECOND, max(SECOND, self.horizon // 400)))

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
        if timer.kind == "duration" and wait and timer.due is None:
            wait = int(wait * self.random.choice((1, 31 / 28)))  # months and years
        if not wait:
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
        scope = Scope(process, None, lambda: None)
        self._begin(scope, starts)

    def _begin(self, scope: Scope, starts: list[int]) -> None:
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
        scope.at.update((*starts, *free))
        for each in (*starts, *free):
            self._after(0, lambda each=each: self._enter(scope, each, None))  # type: ignore[misc]
        if not scope.tokens:
            self._finish(scope)

    def _finish(self, scope: Scope) -> None:
        if not scope.ended:
            scope.ended = True
            scope.done()

    def _arm_event_subprocess(self, scope: Scope, position: int) -> None:
        for start in (each for each in self.inside[position] if self.flow.nodes[each].kind == "start"):
            node = self.flow.nodes[start]

            def begin(node: FlowNode = node, start: int = start) -> None:
                if node.interrupting:
                    scope.tokens, scope.halted = 1, True
                done = partial(self._gone, scope) if node.interrupting else lambda: None
                inner = Scope(position, scope, done, by_event=True)
                self._begin(inner, [start])

            for trigger in node.triggers:
                self._arm(start, trigger, lambda: scope.alive, begin, again=not node.interrupting)

    # Tokens

    def _enter(self, scope: Scope, position: int, flow: int | None) -> None:
        if not scope.alive:
            return
        node = self.flow.nodes[position]
        kind = node.kind
        if kind not in _EVENTS:
            self._send(position)
        if kind in {"start", "end", "throw", "boundary"}:
            self._fire(scope, position, node)
        elif kind == "catch":
            self._wait(scope, position, [position])
        elif kind in {"event_based", "event_start"}:
            self._wait(scope, position, [end for _, end in self.out[position]])
        elif kind == "task" or (kind == "call" and node.calls is None):
            self._work(scope, position, lambda done, inner: self._unknown_work(position, done, inner))
        elif kind == "call" or kind in _INSIDE:
            self._work(scope, position, lambda done, inner: self._run_inside(position, done, inner))
        elif kind == "parallel":
            self._join(scope, position, flow)
        elif kind == "inclusive" and len(self.into[position]) > 1:
            scope.arrived[position].append(-1 if flow is None else flow)
            self.joining[scope, position] = None
        else:
            self._choose(scope, position, kind)

    def _go_on(self) -> None:
        """Let inclusive gateways happen that wait for no further token (BPMN 2.0.2, 13.4.3)."""
        for scope, position in [*self.joining]:
            came = set(scope.arrived[position])
            if not scope.alive:
                del self.joining[scope, position]
            elif came and all(self._may_not_come(each, position, came) for each in scope.at if scope.at[each] > 0):
                for each in came:
                    scope.arrived[position].remove(each)
                if not scope.arrived[position]:
                    del self.joining[scope, position]
                scope.tokens -= len(came) - 1
                scope.at[position] -= len(came) - 1
                self._choose(scope, position, "inclusive")

    def _may_not_come(self, at: int, join: int, came: set[int]) -> bool:
        """Whether a token at a node comes over no flow of a join that has none, or also over one that has one."""
        if at == join:
            return True
        waiting, seen, ends = [at], {at}, set()
        while waiting:
            for number, end in self.out[waiting.pop()]:
                if end == join:
                    ends.add(number)
                elif end not in seen:
                    seen.add(end)
                    waiting.append(end)
        return ends <= came or bool(ends & came)

    def _choose(self, scope: Scope, position: int, kind: str) -> None:
        ways = self.out[position]
        if not ways:
            self._gone(scope, position)
        elif kind in {"exclusive", "unknown"}:
            if position not in self.habits or not self.has_habits:
                self.habits[position] = self.random.choice(ways)
            self._go(scope, position, [self.habits[position]])
        else:
            self._go(scope, position, self.random.sample(ways, self.random.randint(1, len(ways))))

    def _join(self, scope: Scope, position: int, flow: int | None) -> None:
        needed = self.into[position]
        here = scope.arrived[position]
        here.append(-1 if flow is None else flow)
        if len(needed) > 1:
            if not set(needed) <= set(here):
                return
            for each in needed:
                here.remove(each)
            scope.tokens -= len(needed) - 1
            scope.at[position] -= len(needed) - 1
        self._leave(scope, position)

    def _go(self, scope: Scope, position: int, ways: list[tuple[int, int]]) -> None:
        scope.at[position] -= 1
        scope.at.update(end for _, end in ways)
        scope.tokens += len(ways) - 1
        for number, end in ways:
            self._after(self.step, lambda number=number, end=end: self._enter(scope, end, number))  # type: ignore[misc]

    def _leave(self, scope: Scope, position: int) -> None:
        ways = self.out[position]
        if ways:
            self._go(scope, position, ways)
        else:
            self._gone(scope, position)

    def _gone(self, scope: Scope, position: int | None = None) -> None:
        if position is not None:
            scope.at[position] -= 1
        scope.tokens -= 1
        if scope.tokens <= 0 and scope.open:
            self._finish(scope)

    def _fire(self, scope: Scope, position: int, node: FlowNode) -> None:
        self.log.fired[position].append(self.now)
        self._send(position)
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
                        self._move(scope, position, targets[0])
                        self._after(0, partial(self._enter_link, scope, targets[0]))
                        return
        self._leave(scope, position)

    @staticmethod
    def _move(scope: Scope, position: int, to: int) -> None:
        """Move a token without a flow."""
        scope.at.subtract([position])
        scope.at.update([to])

    def _catches(self, position: int, link: str) -> bool:
        node = self.flow.nodes[position]
        return node.kind == "catch" and any(each.kind == "link" and each.link == link for each in node.triggers)

    def _enter_link(self, scope: Scope, position: int) -> None:
        if scope.alive:
            self._fire(scope, position, self.flow.nodes[position])

    def _broadcast(self, position: int) -> None:
        for topic in self.topics[position]:
            self._deliver(topic, Sample(self.now, self.kept_at[position][0]))

    def _send(self, position: int) -> None:
        """Send a message over each message flow of a node."""
        for mail in self.sends[position]:
            self._after(0 if self.log.prompt else self._some_time((position, "mail")), mail.come)

    def _outside(self, topic: str) -> None:
        self.log.outside[topic].append(self.now)
        self._deliver(topic, Sample(self.now, Kept()))

    def _deliver(self, topic: str, sample: Sample) -> None:
        """Let a sample arrive after some time, or at once."""
        self.samples.history[topic].append(sample)
        arrive = partial(self.samples.arrive, topic, sample, lambda: not self.calm and self.random.random() < self.lost)
        self._after(0 if self.log.prompt else self._some_time(topic), arrive)

    # Waiting

    def _arm(
        self, position: int, trigger: Trigger, alive: Callable[[], bool], do: Callable[[], None], *, again: bool = False
    ) -> None:
        """Call ``do`` when a trigger happens, as long as ``alive`` says so."""
        if trigger.kind == "signal":
            for topic in self.topics[position]:
                self.samples.subscribe(topic, Subscription(position, alive, do), self.kept_at[position][0])
        elif trigger.kind == "timer" and trigger.timer is not None:
            self._tick(trigger, alive, do, once=not again)
        elif trigger.kind == "message" and position in self.brought:
            self.brought[position].wait(alive, do)
        elif trigger.kind in _GIVEN_OUTSIDE:
            self._after(self._some_time((position, trigger.kind)), lambda: do() if alive() else None)

    def _wait(self, scope: Scope, waiting: int, events: Sequence[int]) -> None:
        """Wait at a node for the first of several events."""
        over = [False]

        def ended(position: int) -> None:
            if not over[0] and scope.alive:
                over[0] = True
                self._move(scope, waiting, position)
                self._fire(scope, position, self.flow.nodes[position])

        for position in events:
            node = self.flow.nodes[position]
            self.log.waited.add(position)
            if not node.triggers:
                self._after(self._some_time((position, "any")), lambda position=position: ended(position))  # type: ignore[misc]
            alive, end = lambda: not over[0] and scope.alive, partial(ended, position)
            if node.all_triggers:
                self._arm_all(position, alive, end)
                continue
            for trigger in node.triggers:
                self._arm(position, trigger, alive, end)

    def _arm_all(self, position: int, alive: Callable[[], bool], do: Callable[[], None]) -> None:
        """Call ``do`` when each trigger has happened, and each topic has brought a sample."""
        node, topics = self.flow.nodes[position], self.topics[position]
        others = [each for each in node.triggers if each.kind != "signal"]
        missing: set[object] = {*topics, *range(len(others))}

        def come(what: object) -> None:
            missing.discard(what)
            if not missing:
                do()

        for topic in topics:
            waiting = Subscription(position, alive, partial(come, topic))
            self.samples.subscribe(topic, waiting, self.kept_at[position][0])
        for number, trigger in enumerate(others):
            self._arm(position, trigger, alive, partial(come, number))

    # Activities

    def _work(self, scope: Scope, position: int, start: Callable[[Callable[[], None], Scope], None]) -> None:
        """Do an activity as often as it says, while its boundary events wait."""
        node = self.flow.nodes[position]
        inner = Scope(position, scope, lambda: None)
        most = _SEVERAL if node.times is None else node.times
        least = min(node.least_times, most)
        left = [least if self.least_times else most if self.calm else self.random.randint(least, most)]

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

    def _unknown_work(self, position: int, done: Callable[[], None], inner: Scope) -> None:
        """Do what takes any time; a call with a computed name may run any process that only calls run."""
        node = self.flow.nodes[position]
        called = [at for at, each in enumerate(self.flow.nodes) if each.kind == "process" and not each.has_pool]
        if (
            node.kind == "call"
            and node.called is None
            and called
            and inner.depth < _DEEPEST
            and self.random.random() < 0.8
        ):
            self._run_body(self.random.choice(called), done, inner)
        else:
            self._after(self._some_time(position), done)

    def _arm_boundary(self, scope: Scope, inner: Scope, position: int) -> None:
        node = self.flow.nodes[position]
        self.log.waited.add(position)

        def caught() -> None:
            if node.interrupting:
                inner.ended = True
                scope.at[inner.position] -= 1
            else:
                scope.tokens += 1
            scope.at[position] += 1
            self._fire(scope, position, node)

        for trigger in node.triggers:
            self._arm(position, trigger, lambda: inner.alive, caught, again=not node.interrupting)

    def _run_inside(self, position: int, done: Callable[[], None], inner: Scope) -> None:
        node = self.flow.nodes[position]
        self._run_body(position if node.calls is None else node.calls, done, inner)

    def _run_body(self, body: int, done: Callable[[], None], inner: Scope) -> None:
        kind = self.flow.nodes[body].kind
        scope = Scope(body, inner, done)
        inside = self.inside[body]
        starts = [each for each in inside if self.flow.nodes[each].kind == "start"]
        if kind == "process":
            starts = [each for each in starts if not self.flow.nodes[each].triggers]
        if kind == "adhoc":
            starts = [each for each in inside if self.random.random() < 0.7]
        self._begin(scope, starts)


def _catches_link(node: FlowNode) -> bool:
    return node.kind == "catch" and any(each.kind == "link" for each in node.triggers)
