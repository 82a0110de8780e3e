"""What happened in one run of the simulator, and the instances of processes in it."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass
class Log:
    """What happened in one run; times in nanoseconds.

    Attributes:
        fired: by node, when it fired.
        waited: nodes of catches at which a token was.
        taken: by node of a catch, when it took a sample, and when that was sent.
        outside: by topic, when a sample came that the model does not send.
        reading: one of `READINGS`.
        punctual: no timer was late.
        prompt: samples arrive when they are sent.
        instant: what takes no time took none.
        end: when the run ended.
        whole: whether it reached its end, and not the bound of steps.
    """

    fired: dict[int, list[int]] = field(default_factory=lambda: defaultdict(list))
    waited: set[int] = field(default_factory=set)
    taken: dict[int, list[tuple[int, int]]] = field(default_factory=lambda: defaultdict(list))
    outside: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    reading: str = ""
    punctual: bool = True
    prompt: bool = True
    instant: bool = True
    end: int = 0
    whole: bool = True


class Scope:
    """An instance of a process or of a sub-process, with the tokens at each node. Only an event sub-process goes on in one that is ``halted``."""

    def __init__(self, position: int, outer: Scope | None, done: Callable[[], None], *, by_event: bool = False) -> None:
        self.position, self.outer, self.done, self.by_event = position, outer, done, by_event
        self.tokens, self.ended, self.halted = 0, False, False
        self.depth: int = 0 if outer is None else outer.depth + 1
        self.arrived: dict[int, list[int]] = defaultdict(list)
        self.at: Counter[int] = Counter()

    @property
    def open(self) -> bool:
        around = self.outer is None or (self.outer.open if self.by_event else self.outer.alive)
        return around and not self.ended

    @property
    def alive(self) -> bool:
        return self.open and not self.halted


class Mail:
    """The messages that message flows bring to an event; each is kept until one token takes it."""

    def __init__(self) -> None:
        self.kept = 0
        self.waiting: list[tuple[Callable[[], bool], Callable[[], None]]] = []

    def wait(self, alive: Callable[[], bool], do: Callable[[], None]) -> None:
        """Call ``do`` for messages, as long as ``alive`` says so."""
        self.waiting.append((alive, do))
        self._give()

    def come(self) -> None:
        """Bring a message."""
        self.kept += 1
        self._give()

    def _give(self) -> None:
        self.waiting = [each for each in self.waiting if each[0]()]
        while self.kept and self.waiting:
            self.kept -= 1
            self.waiting[0][1]()
            self.waiting = [each for each in self.waiting if each[0]()]
