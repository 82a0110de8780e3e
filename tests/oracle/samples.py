"""Samples of the simulator: who takes them when they come, and what becomes of them while no token waits."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

READINGS: Final = ("at_token", "standing_unbuffered", "standing_buffered")
"""What becomes of a sample while no token waits: it comes again to a later subscription, is gone, or waits in a queue."""


@dataclass(frozen=True)
class Kept:
    """What an endpoint says of samples that are not taken at once.

    Attributes:
        again: they come again to later subscriptions, if the other end says so too.
        depth: how many of them; None: all.
        life: nanoseconds after which they are gone; None: never.
    """

    again: bool = False
    depth: int | None = 1
    life: int | None = None


@dataclass(frozen=True)
class Sample:
    sent: int
    publisher: Kept

    def lives(self, now: int) -> bool:
        return self.publisher.life is None or now - self.sent <= self.publisher.life


@dataclass(frozen=True)
class Subscription:
    """A subscription: where, whether it still exists, and what a sample does."""

    position: int
    alive: Callable[[], bool]
    do: Callable[[], None]


class Samples:
    """The samples of one run.

    Attributes:
        taken: by node of a catch, when it took a sample, and when that was sent.
    """

    def __init__(
        self, reading: str, after: Callable[[int, Callable[[], None]], None], clock: Callable[[], int]
    ) -> None:
        """``after`` does something after some nanoseconds, and ``clock`` says what time it is."""
        self.reading, self.after, self.clock = reading, after, clock
        self.taken: dict[int, list[tuple[int, int]]] = defaultdict(list)
        self.waiting: dict[str, list[Subscription]] = defaultdict(list)
        self.history: dict[str, list[Sample]] = defaultdict(list)
        self.queued: dict[tuple[str, int], deque[Sample]] = {}

    def queue(self, position: int, topics: Iterable[str], depth: int | None) -> None:
        """Give a catch a queue for samples of topics."""
        if self.reading == "standing_buffered":
            self.queued |= {(topic, position): deque(maxlen=depth) for topic in topics}

    def arrive(self, topic: str, sample: Sample, is_lost: Callable[[], bool]) -> None:
        """Give a sample to all that wait now; each of them may lose it."""
        there = [each for each in self.waiting[topic] if each.alive()]
        self.waiting[topic] = list(there)
        for each in there:
            if not is_lost():
                self.take(each, sample)
        busy = {each.position for each in there}
        for (queued, position), queue in self.queued.items():
            if queued == topic and position not in busy:
                queue.append(sample)

    def take(self, waiting: Subscription, sample: Sample) -> None:
        """Let a subscription have a sample, if both still exist."""
        if waiting.alive() and sample.lives(self.clock()):
            self.taken[waiting.position].append((self.clock(), sample.sent))
            waiting.do()

    def subscribe(self, topic: str, waiting: Subscription, kept: Kept) -> None:
        """Wait for samples of a topic; earlier ones may come now, as the reading has it."""
        self.waiting[topic].append(waiting)
        for sample in self._again(topic, kept) if self.reading == "at_token" else ():
            self.after(0, partial(self.take, waiting, sample))
        queue = self.queued.get((topic, waiting.position))
        while queue:
            sample = queue.popleft()
            if sample.lives(self.clock()):
                self.after(0, partial(self.take, waiting, sample))
                return

    def _again(self, topic: str, kept: Kept) -> Sequence[Sample]:
        again = [each for each in self.history[topic] if each.publisher.again and kept.again]
        depth = min((each.publisher.depth for each in again if each.publisher.depth is not None), default=None)
        return again[-depth:] if depth else again
