"""Random models in the form of `tests.behaviour.model_text`: structured processes that throw and catch a few signals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from random import Random

_SIGNALS: Final = ("x", "y", "z")
_DEADLINES: Final = (2, 5, 20)
_TIMES: Final = (1, 3, 10, 60)
_DEEPEST: Final = 2


def random_model(random: Random) -> dict[str, str]:
    """Return the text of each of two or three pools."""
    return {name: Pool(random, name.lower()).text() for name in "ABC"[: random.randint(2, 3)]}


class Pool:
    """One random process."""

    def __init__(self, random: Random, prefix: str) -> None:
        self.random, self.prefix = random, prefix
        self.lines: list[str] = []
        self.number = 0

    def text(self) -> str:
        """Return the lines of the process."""
        triggers = [
            "",
            "",
            f"R/PT{self._time()}S",
            f"R{self.random.randint(1, 4)}/PT{self._time()}S",
            self._signal(),
            self._signal(),
        ]
        start = self._node(f"start {self.random.choice([*triggers, 'message'])}")
        last = self._blocks(start, 0)
        end = self._node(self.random.choice(("end", f"end {self._signal()} {self._deadline()}")))
        self._flow(last, end)
        if self.random.random() < 0.15:
            self._flow(self._node(f"catch {self._signal()}"), self._node(f"end {self._signal()}"))
        return "\n".join(self.lines)

    def _blocks(self, before: str, depth: int) -> str:
        for _ in range(self.random.randint(1, 3)):
            before = self.random.choice(self._kinds(depth))(before, depth)
        return before

    def _kinds(self, depth: int) -> list:  # type: ignore[type-arg]
        flat = [self._step, self._step, self._step]
        return flat if depth >= _DEEPEST else [*flat, self._branches, self._race, self._loop, self._guarded]

    def _step(self, before: str, _depth: int) -> str:
        kind = self.random.choice(
            (
                f"throw {self._signal()} {self._deadline()}",
                f"catch {self._signal()}",
                f"catch PT{self._time()}S",
                "task",
            )
        )
        return self._after(before, kind)

    def _branches(self, before: str, depth: int) -> str:
        kind = self.random.choice(("xor", "and", "or"))
        fork, join = self._after(before, kind), self._node(kind)
        for _ in range(2):
            self._flow(self._blocks(fork, depth + 1), join)
        return join

    def _race(self, before: str, depth: int) -> str:
        fork, join = self._after(before, "event"), self._node("xor")
        for kind in (f"catch {self._signal()}", f"catch PT{self._time()}S"):
            self._flow(self._blocks(self._after(fork, kind), depth + 1), join)
        return join

    def _loop(self, before: str, depth: int) -> str:
        top = self._after(before, "xor")
        bottom = self._after(self._blocks(top, depth + 1), "xor")
        self._flow(bottom, top)
        return bottom

    def _guarded(self, before: str, _depth: int) -> str:
        task = self._after(before, "task")
        trigger = self.random.choice((self._signal(), f"PT{self._time()}S"))
        keep = self.random.choice(("", "keep"))
        boundary = self._node(f"boundary {trigger} on={task} {keep}")
        self._flow(boundary, self._node(f"end {self._signal()} {self._deadline()}"))
        return task

    def _after(self, before: str, kind: str) -> str:
        name = self._node(kind)
        self._flow(before, name)
        return name

    def _node(self, kind: str) -> str:
        self.number += 1
        name = f"{self.prefix}{self.number}"
        self.lines.append(f"{name}: {' '.join(kind.split())}")
        return name

    def _flow(self, start: str, end: str) -> None:
        self.lines.append(f"{start} -> {end}")

    def _signal(self) -> str:
        return self.random.choice(_SIGNALS)

    def _time(self) -> int:
        return self.random.choice(_TIMES)

    def _deadline(self) -> str:
        return self.random.choice(("", f"deadline={self.random.choice(_DEADLINES)}"))
