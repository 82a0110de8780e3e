"""What all implementations of DDS have in common when they run a pair: settings, domain, faults."""

from __future__ import annotations

import random
import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar, Final
from uuid import uuid4

from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs import INFINITE
from cqos_core.packs.prover import End, Event, NotRunnableError, Outcome, Plan
from cqos_live.dds.prove.settings import encoded, parsed
from cqos_live.dds.prove.stage import Cast, Program, Running, run

_SECOND: Final = 1_000_000_000
_SETTLE: Final = 0.5


class Implementation(ABC):
    """An implementation of DDS whose ends are programs."""

    title: ClassVar[str]
    recover: ClassVar[float] = 2.0
    """Seconds after which a writer has sent again what was lost."""
    faults: ClassVar[frozenset[str]] = frozenset(
        {"link_outage", "subscriber_restart", "publisher_restart", "slow_reader"}
    )

    @property
    def assumes(self) -> Mapping[str, str]:
        """Options with which the pack judges as this implementation behaves, for the type that the programs send."""
        return {"implementation": self.implementation(), "extensibility": "final"}

    @abstractmethod
    def implementation(self) -> str:
        """Return the value of the option ``implementation`` for what is installed."""

    @abstractmethod
    def missing(self) -> str | None:
        """Say what is not installed, and how to install it."""

    @abstractmethod
    def version(self) -> str:
        """Return the version that runs."""

    @abstractmethod
    def starter(self) -> Callable[[], Running]:
        """Return what starts the program of an end; the program may have to be made first."""

    def further(self, lease: float | None) -> Mapping[str, str]:  # noqa: ARG002 - for those that are configured so
        """Return further settings of the program; ``lease`` is the participant's, in seconds."""
        return {}

    def prove(self, plan: Plan, report: Callable[[Event], None] = lambda _event: None) -> Outcome:
        """Run the pair on loopback, on a domain and a topic of its own."""
        if why := self.missing():
            raise NotRunnableError(why)
        if plan.fault is not None and plan.fault.kind not in self.faults:
            raise NotRunnableError(f"{self.title} has no {plan.fault.kind}; it runs {', '.join(sorted(self.faults))}")
        shared: dict[str, int | str] = {"domain": free_domain(), "topic": f"cqos_{uuid4().hex}"}
        cast = Cast(
            f"{self.title} {self.version()}",
            self._program(plan, plan.publisher, shared | {"role": PUBLISHER}),
            self._program(plan, plan.subscriber, shared | {"role": SUBSCRIBER}),
            settle=_SETTLE,
            recover=self.recover,
            pause=_pause(plan),
        )
        return run(plan, cast, report)

    def _program(self, plan: Plan, end: End, further: Mapping[str, int | str]) -> Program:
        values = {name: text for name, text in end.values.items() if name != "taken_every"}
        settings: dict[str, object] = {**parsed(values), **further}
        settings["keyed"] = int(plan.facts.get("keyed") == "true")
        settings["extensibility"] = end.participant.get("extensibility", "final")
        if pause := _pause(plan):
            settings["taken_every"] = round(pause * _SECOND)
        lease = _seconds(end.participant.get("participant_lease"))
        if lease is not None:
            settings["lease"] = round(lease * _SECOND)
        settings.update(self.further(lease))
        return Program(self.starter(), {name: encoded(value) for name, value in settings.items()})


def _pause(plan: Plan) -> float:
    """Return the seconds between two takes of the subscriber."""
    if plan.fault is not None and plan.fault.kind == "slow_reader":
        return plan.fault.seconds
    return _seconds(plan.subscriber.values.get("taken_every")) or 0.0


def _seconds(text: str | None) -> float | None:
    from cqos_core.packs import Duration

    if text is None:
        return None
    value = Duration().parse(text)
    return None if value == INFINITE else value / _SECOND


def free_domain() -> int:
    """Return a domain that no participant on this machine has joined.

    Raises:
        NotRunnableError: all of them are taken.
    """
    for domain in random.sample(range(100, 232), 132):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
            try:
                port.bind(("127.0.0.1", 7400 + 250 * domain + 10))
            except OSError:
                continue
            return domain
    raise NotRunnableError("all DDS domains from 100 to 231 are in use on this machine; end some participants")
