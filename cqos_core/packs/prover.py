"""The interface of provers, which run pairs on middleware: the plan of a run, and its outcome."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from typing import Final, Protocol

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError

FAULTS: Final = {
    "link_outage": "the link between the two is cut for this time",
    "subscriber_restart": "the subscriber is killed, and started again after this time",
    "publisher_restart": "the publisher is killed, and started again after this time",
    "broker_stop": "the broker ends in order (SIGTERM), and is started again after this time",
    "broker_crash": "the broker is killed (SIGKILL), and started again after this time",
    "slow_reader": "the subscriber takes what arrived once in this time",
}
"""Kinds of faults, and their effects."""


class NotRunnableError(CqosError):
    """A plan cannot be run here; the message says why and what to install or change."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault in the middle of a run.

    Attributes:
        kind: one of `FAULTS`.
        seconds: how long; of a slow reader, the time between two takes.
    """

    kind: str
    seconds: float

    def __str__(self) -> str:
        """Give the spelling of the command line."""
        return f"{self.kind}={self.seconds:g}s"


@dataclass(frozen=True, slots=True)
class End:
    """One end of a pair. All values are resolved, by policy name, as text in the spelling of YAML.

    Attributes:
        id: of the endpoint in the system.
        values: of endpoint-level policies. A policy without a known value is left out.
        participant: of participant-level and option-level policies.
    """

    id: str
    values: Mapping[str, str]
    participant: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Plan:
    """One run of one pair.

    Attributes:
        protocol: id of the pack whose policies the values are of.
        topic: the name on which the publisher publishes; `filter` is the subscriber's, where it is another.
        facts: topic-level values.
        broker: broker-level values.
        samples: how many samples are sent, numbered from 0.
        early: how many of them are sent before the subscriber starts, without waiting for the period.
        during: how many of them are sent while a fault lasts; 0: a third of those that are not early.
        period: seconds between two samples.
        fault: what is injected once some of the samples that are not early have been sent. A slow reader is slow throughout.
        patience: seconds after which the run ends once all samples are sent, whatever is still missing.
        needs: what the subscriber needs, by word; durations in nanoseconds.
    """

    protocol: str
    topic: str
    publisher: End
    subscriber: End
    filter: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    broker: Mapping[str, str] = field(default_factory=dict)
    samples: int = 20
    early: int = 0
    during: int = 0
    period: float = 0.02
    fault: Fault | None = None
    patience: float = 5.0
    needs: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Event:
    """One line of the timeline.

    Attributes:
        at: seconds since the run began; None where steps have an order and no time.
        who: ``publisher``, ``subscriber``, ``link`` or ``broker``.
        what: one word: ``created``, ``refused`` (it could not be created), ``crashed``, ``matched``, ``unmatched``, ``incompatible``,
            ``sent``, ``arrived``, ``killed``, ``started``, ``stopped``, ``cut``, ``restored``; packs may add others.
        number: of the sample.
        text: the policy, the reason, or what else there is to say.
    """

    at: float | None
    who: str
    what: str
    number: int | None = None
    text: str = ""


def numbers(events: Iterable[Event], what: str) -> tuple[int, ...]:
    """Return the numbers of the samples with such an event, in order."""
    return tuple(each.number for each in events if each.what == what and each.number is not None)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of one run.

    Attributes:
        by: the implementation with its version: ``Cyclone DDS 11.0.1``.
        events: in order of time.
        not_created: by role, the reason why the middleware did not create this end, or how its program ended.
        matched: whether the middleware ever connected the two; None where an end was not created.
        refused: policies that the middleware named as the reason of not matching.
        sent: the numbers of samples sent, in order.
        arrived: the numbers of samples that the subscriber took, in order, repetitions included.
        answers: guarantees that all runs keep (true) or some run breaks, where a prover decides that itself; the events are
            then those of one run for each that is broken.
    """

    by: str
    events: tuple[Event, ...]
    matched: bool | None
    sent: tuple[int, ...] = ()
    arrived: tuple[int, ...] = ()
    refused: tuple[str, ...] = ()
    not_created: Mapping[str, str] = field(default_factory=dict)
    answers: Mapping[str, bool] = field(default_factory=dict)

    @property
    def lost(self) -> tuple[int, ...]:
        """Numbers that were sent and never arrived."""
        there = set(self.arrived)
        return tuple(number for number in self.sent if number not in there)

    @property
    def repeated(self) -> tuple[int, ...]:
        """Numbers that arrived more than once."""
        return tuple(number for number, times in Counter(self.arrived).items() if times > 1)

    @property
    def ordered(self) -> bool:
        """Whether no sample arrived for the first time after one that was sent later."""
        first = list(dict.fromkeys(self.arrived))
        return first == sorted(first)


class Prover(Protocol):
    """Runs pairs on one implementation. A pack names it by ``"module:object"`` in `RulePack.provers`.

    Attributes:
        title: ``Cyclone DDS``.
        faults: the kinds of `FAULTS` that it injects.
        assumes: options, by name, with which the pack judges as this implementation behaves.
    """

    title: str
    faults: frozenset[str]
    assumes: Mapping[str, str]

    def missing(self) -> str | None:
        """Return what is not installed here and how to install it, or None."""

    def prove(self, plan: Plan, report: Callable[[Event], None] = ...) -> Outcome:
        """Run the plan; hand each event to ``report`` when it happens, and leave nothing running.

        Raises:
            NotRunnableError: the plan has something that this prover cannot run.
        """
