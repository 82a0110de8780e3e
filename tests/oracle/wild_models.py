"""Wild random models: every kind of activity and start, joins that cannot fire, nodes to which no flow leads, and stray flows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tests.oracle.random_models import Pool

if TYPE_CHECKING:
    from random import Random

_GATEWAYS: Final = ("xor", "and", "or", "complex")
_LOOPS: Final = ("", "", " times=2", " times=3", " loop=2", " loop=any")
_CALLED: Final = "PQ"


def wild_model(random: Random) -> dict[str, str]:
    """Return the text of each of two or three pools, and of a process that call activities run."""
    pools = {f"{name}{random.choice(('', '', '', '*2', '*'))}": name for name in "ABC"[: random.randint(2, 3)]}
    texts = {header: _WildPool(random, name.lower()).text() for header, name in pools.items()}
    return {**texts, f"-{_CALLED}": _WildPool(random, "q", called=True).text()}


class _WildPool(Pool):
    """One random process that a person would hardly draw."""

    def __init__(self, random: Random, prefix: str, *, called: bool = False) -> None:
        super().__init__(random, prefix)
        self.called = called
        self.scope = ""

    def text(self) -> str:
        """Return the lines of the process."""
        for _ in range(self.random.choice((1 if self.called else 0, 1, 1, 1, 1, 2))):
            self._way(self._node(f"start {'' if self.called else self._start()}"), 0)
        if self.random.random() < 0.2:
            self._way(self._node(f"catch {self._signal()}"), 1)
        if self.random.random() < 0.2:
            self._event_subprocess()
        gates = [line.split(":")[0] for line in self.lines if line.split()[1] in _GATEWAYS and " in=" not in line]
        for _ in range(self.random.randint(0, 2)):
            if len(gates) > 1:
                self._flow(*self.random.sample(gates, 2))
        return "\n".join(self.lines)

    def _start(self) -> str:
        cycles = (f"R/PT{self._time()}S", f"R/PT{self._time()}S", f"R{self.random.randint(0, 3)}/PT{self._time()}S")
        one = self.random.choice(("", *cycles, self._signal(), f"PT{self._time()}S", "message", "2030-01-01T00:00:00Z"))
        also = self.random.choice(("", "", "", self._signal()))
        return f"{one} {also}" if one else one

    def _way(self, start: str, depth: int) -> None:
        end = self.random.choice(("end", f"end {self._signal()} {self._deadline()}", "end terminate", "end error"))
        self._flow(self._blocks(start, depth), self._node(end))

    def _kinds(self, depth: int) -> list:  # type: ignore[type-arg]
        calls = [] if self.called else [self._call]
        inner = [self._subprocess, self._subprocess, self._mismatch] if depth < 2 else []
        return [*super()._kinds(depth), *calls, *inner]

    def _call(self, before: str, _depth: int) -> str:
        return self._after(before, f"call calls={_CALLED}{self.random.choice(('', ' times=2'))}")

    def _mismatch(self, before: str, depth: int) -> str:
        fork, join = self._after(before, self.random.choice(_GATEWAYS)), self._node(self.random.choice(_GATEWAYS))
        for _ in range(2):
            self._flow(self._blocks(fork, depth + 1), join)
        return join

    def _subprocess(self, before: str, depth: int) -> str:
        kind = self.random.choice(("sub", "sub", "sub", "adhoc", "transaction"))
        name = self._after(before, f"{kind}{self.random.choice(_LOOPS) if kind == 'sub' else ''}")
        outer, self.scope = self.scope, name
        self._way(self._node("start"), depth + 1)
        self.scope = outer
        if self.random.random() < 0.5:
            trigger = self.random.choice((self._signal(), f"R/PT{self._time()}S", f"PT{self._time()}S", "error"))
            self._way(self._node(f"boundary {trigger} on={name} {self.random.choice(('', 'keep'))}"), depth + 1)
        return name

    def _event_subprocess(self) -> None:
        self.scope = self._node("eventsub")
        trigger = self.random.choice((self._signal(), f"R/PT{self._time()}S", f"PT{self._time()}S", "error"))
        self._way(self._node(f"start {trigger} {self.random.choice(('', 'keep'))}"), 2)
        self.scope = ""

    def _node(self, kind: str) -> str:
        return super()._node(f"{kind} in={self.scope}" if self.scope else kind)
