"""Runs a plan with two programs, one for each end, that speak lines of text.

A program reads lines from its standard input: first ``set NAME VALUE`` for each setting and ``start``, then commands:
``send FIRST LAST MILLISECONDS``, ``cut``, ``restore``. It ends when its input ends, so that it never outlives the command.
It writes one line for each event: ``WHAT NUMBER TEXT``, with ``-`` where the event has no number, and ``done -`` after each
``send``. ``seen -`` says that it has discovered the other end, so that the two match now or never.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import IO, Final, Protocol

from cqos_core.model.problems import CqosError
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.prover import Event, Fault, Outcome, Plan, numbers

_START: Final = 60.0
"""Seconds that a program may take until its end is created, on a machine that is busy."""
_END: Final = 2.0
_EARLY: Final = 0.02  # seconds between samples that are sent before the subscriber starts
DISCOVERY: Final = 5.0
"""Seconds that the two may take to discover each other, on a machine that is busy."""
_TAIL: Final = 20  # lines of a program's errors that are shown


class Running(Protocol):
    """A program that was started, as `subprocess.Popen` has it."""

    stdin: IO[str]
    stdout: IO[str]
    stderr: IO[str]

    def kill(self) -> None:
        """Send SIGKILL."""

    def wait(self) -> int:
        """Return the exit code once the program has ended."""


@dataclass(frozen=True, slots=True)
class Program:
    """What is run for one end: what starts it, and the settings that it is given."""

    start: Callable[[], Running]
    settings: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Cast:
    """The programs of one run.

    Attributes:
        by: the implementation with its version.
        settle: seconds without an event after which nothing more is expected to arrive.
        recover: the same after a fault, when lost samples are sent again late.
        pause: seconds between two takes of the subscriber.
    """

    by: str
    publisher: Program
    subscriber: Program
    settle: float
    recover: float
    pause: float = 0.0


def run(plan: Plan, cast: Cast, report: Callable[[Event], None] = lambda _event: None) -> Outcome:
    """Run a plan and return what happened; nothing is left running.

    Raises:
        CqosError: a program does not start.
    """
    with closing(_Stage(plan, cast, report)) as stage, suppress(_CrashError):
        stage.play()
    return stage.outcome()


class _CrashError(Exception):
    """A program ended by itself, and the run with it."""


class _Stage:
    """A run that is under way."""

    def __init__(self, plan: Plan, cast: Cast, report: Callable[[Event], None]) -> None:
        self.plan, self.cast, self.report = plan, cast, report
        self.events: list[Event] = []
        self.lines: SimpleQueue[tuple[str, _Process, list[str] | None]] = SimpleQueue()
        self.processes: dict[str, _Process] = {}
        self.began = time.monotonic()
        self.done = 0  # commands to send that were completed
        self.seen: set[str] = set()  # roles of ends that have discovered the other one
        self.faulty = plan.fault is not None and plan.fault.kind != "slow_reader"

    def close(self) -> None:
        """End both programs."""
        with ExitStack() as stack:
            for process in self.processes.values():
                stack.callback(process.end)

    # The play

    def play(self) -> None:
        """Run from the start of both ends to the last sample that arrives."""
        plan = self.plan
        if plan.early:
            self.start(PUBLISHER)
            self.until_created(PUBLISHER)
            self.send(0, plan.early, min(plan.period, _EARLY))
            self.start(SUBSCRIBER)
        else:
            self.start(SUBSCRIBER)
            self.start(PUBLISHER)
            self.until_created(PUBLISHER)
        self.until_created(SUBSCRIBER)
        if self.happened("refused"):
            return
        self.wait(lambda: self.decided() or bool(self.seen), DISCOVERY)
        # a writer whose lease ends at once is never discovered
        self.wait(lambda: self.decided() or len(self.seen) == len(self.processes), self.cast.settle * 2)
        self.wait(self.decided, self.cast.settle / 2)
        if plan.early:
            self.wait(
                lambda: not self.outcome().lost, self.cast.settle + self.cast.pause
            )  # what was sent before it came
        if plan.fault is None or not self.faulty:
            self.send(plan.early, plan.samples)
        else:
            self.with_fault(plan.fault)
        self.until_quiet()

    def with_fault(self, fault: Fault) -> None:
        """Send samples before the fault, while it lasts, and after it."""
        plan = self.plan
        number = plan.samples - plan.early
        before = (number - plan.during) // 3
        gone = {"publisher_restart": PUBLISHER, "subscriber_restart": SUBSCRIBER}.get(fault.kind)
        during = plan.early + before
        after = during if gone == PUBLISHER else during + (plan.during or before)
        self.send(plan.early, during)
        self.wait(lambda: not self.outcome().lost, self.cast.settle)
        if gone is not None:
            self.processes[gone].end()
            self.happen(gone, "killed")
        else:
            self.write_both("cut")
            self.happen("link", "cut")
        until = time.monotonic() + fault.seconds
        self.send(during, after)
        self.wait(lambda: False, until - time.monotonic())
        if gone is not None:
            self.start(gone)
            self.until_created(gone)
            self.wait(self.matched, self.cast.recover * 2)
        else:
            self.write_both("restore")
            self.happen("link", "restored")
        self.send(after, plan.samples)

    # Steps

    def start(self, role: str) -> None:
        """Start the program of an end, again if it ran before."""
        program = self.cast.publisher if role == PUBLISHER else self.cast.subscriber
        if role in self.processes:
            self.happen(role, "started")
        process = self.processes[role] = _Process(role, program, self.lines)
        for name, value in program.settings.items():
            process.write(f"set {name} {value}")
        process.write("start")

    def send(self, first: int, end: int, period: float | None = None) -> None:
        """Let the publisher send samples, and wait until it has."""
        period = self.plan.period if period is None else period
        if first >= end:
            return
        before = self.done
        self.processes[PUBLISHER].write(f"send {first} {end - 1} {period * 1000:g}")
        self.wait(lambda: self.done > before, _START + (end - first) * (period + 0.5))
        if self.done == before:
            raise CqosError(f"the publisher of `{self.plan.topic}` on {self.cast.by} did not send in time")

    def write_both(self, line: str) -> None:
        """Give both ends a line."""
        for process in self.processes.values():
            process.write(line)

    def until_created(self, role: str) -> None:
        """Wait until an end says that it is there, or that it is refused."""
        process = self.processes[role]
        self.wait(lambda: process.answered, _START)
        if not process.answered:
            raise CqosError(f"the {role} of `{self.plan.topic}` on {self.cast.by} did not start within {_START:g} s")

    def until_quiet(self) -> None:
        """Wait until all arrived and nothing arrives twice, or nothing more is expected."""
        end = time.monotonic() + self.plan.patience
        quiet = self.cast.recover if self.faulty and self.matched() else self.cast.settle
        while (now := time.monotonic()) < end:
            seen = len(self.outcome().arrived)
            complete = bool(seen) and not self.outcome().lost
            self.wait(
                lambda seen=seen: len(self.outcome().arrived) > seen,  # type: ignore[misc]
                min(end - now, self.cast.pause + (self.cast.settle / 2 if complete else quiet)),
            )
            if len(self.outcome().arrived) == seen:
                return

    def decided(self) -> bool:
        """Whether the two are connected, or an end has said why not."""
        return self.matched() or self.happened("incompatible")

    def happened(self, what: str) -> bool:
        """Whether an end reported this."""
        return any(event.what == what for event in self.events)

    def matched(self) -> bool:
        """Whether the two ends are connected, as both of them see it now."""
        state: dict[str, bool] = {PUBLISHER: False, SUBSCRIBER: False}
        for event in self.events:
            if event.who in state and event.what in {"matched", "unmatched"}:
                state[event.who] = event.what == "matched"
            elif event.what == "killed":
                state[event.who] = False
        return all(state.values())

    # Events

    def happen(self, who: str, what: str, number: int | None = None, text: str = "") -> None:
        """Add an event to the timeline."""
        event = Event(time.monotonic() - self.began, who, what, number, text)
        self.events.append(event)
        self.report(event)

    def wait(self, enough: Callable[[], bool], seconds: float) -> None:
        """Take in what the ends say until it is enough, or so many seconds have gone by."""
        until = time.monotonic() + seconds
        while not enough():
            try:
                role, process, words = self.lines.get(timeout=max(0.0, until - time.monotonic()))
            except Empty:
                return
            self.take_in(role, process, words)

    def take_in(self, role: str, process: _Process, words: list[str] | None) -> None:
        """Turn one line of a program into an event."""
        if words is None:
            if not process.killed:
                reason = f"its program ended with exit code {process.process.wait()}: {process.errors() or 'no reason given'}"
                if not process.answered:
                    raise CqosError(f"the {role} on {self.cast.by} did not start; {reason}")
                self.happen(role, "crashed", None, reason)
                raise _CrashError
            return
        what, number, text = words
        if what == "done":
            self.done += 1
        elif what == "seen":
            self.seen.add(role)
        else:
            process.answered |= what in {"created", "refused"}
            self.happen(role, what, None if number == "-" else int(number), text)

    def outcome(self) -> Outcome:
        """Return what happened so far."""
        refused = {event.who: event.text for event in self.events if event.what in {"refused", "crashed"}}
        named = dict.fromkeys(event.text for event in self.events if event.what == "incompatible" and event.text)
        return Outcome(
            self.cast.by,
            tuple(self.events),
            None if refused else self.happened("matched"),
            numbers(self.events, "sent"),
            numbers(self.events, "arrived"),
            tuple(named),
            refused,
        )


class _Process:
    """A program of one end."""

    def __init__(self, role: str, program: Program, lines: SimpleQueue[tuple[str, _Process, list[str] | None]]) -> None:
        self.role, self.lines = role, lines
        self.killed = False
        self.answered = False
        self.tail: deque[str] = deque(maxlen=_TAIL)
        self.process = program.start()
        self.threads = [
            threading.Thread(target=target, args=(stream,), daemon=True)
            for target, stream in ((self._listen, self.process.stdout), (self._keep, self.process.stderr))
        ]
        for thread in self.threads:
            thread.start()

    def _listen(self, stream: IO[str]) -> None:
        for line in stream:
            what, _, rest = line.rstrip("\n").partition(" ")
            number, _, text = rest.partition(" ")
            self.lines.put((self.role, self, [what, number or "-", text]))
        self.lines.put((self.role, self, None))

    def _keep(self, stream: IO[str]) -> None:
        self.tail.extend(line.rstrip() for line in stream)

    def write(self, line: str) -> None:
        """Give the program a line; where it has ended, its output says so."""
        with suppress(BrokenPipeError):
            self.process.stdin.write(line + "\n")
            self.process.stdin.flush()

    def end(self) -> None:
        """Kill the program; what it has written is still read."""
        self.killed = True
        self.process.kill()
        self.process.wait()
        with suppress(BrokenPipeError):  # what was not read is of no use any more
            self.process.stdin.close()
        for thread in self.threads:
            thread.join()
        for stream in (self.process.stdout, self.process.stderr):
            stream.close()

    def errors(self) -> str:
        """Return the last lines of what the program printed as errors."""
        self.threads[1].join(_END)
        return " ".join(self.tail)
