"""Pairs of DDS under faults, run on an implementation: what is observed, and what the pack claims of the same pair."""

from __future__ import annotations

import importlib
import json
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from cqos_core import explain
from cqos_core.language.domains import Duration
from cqos_core.packs.prover import End, Fault, Plan
from cqos_dds.pack import PACK

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.packs.prover import Event, Outcome

PERIOD: Final = 0.05
SLACK: Final = 1.0
"""Seconds that a busy machine may be late."""
REPAIR: Final = 3.0
"""Seconds in which what was lost has arrived again, and both ends have found each other again."""
FACTS: Final = {"period": "50ms", "keyed": "false", "size": "8"}
KEEP: Final = {"reliability": "reliable", "reliability.max_blocking_time": "infinite", "history": "keep_all"}
STORE: Final = {**KEEP, "durability": "transient_local"}
SHORT: Final = {"reliability": "reliable", "durability": "transient_local"}
STORED: Final = {**STORE, "durability_service.history_kind": "keep_all"}


@dataclass(frozen=True)
class Scenario:
    """One pair under one fault.

    Attributes:
        fault: None while connected; ``slow_reader`` is a fact about a connected reader, and ``lost_packets`` are those that a link
            loses which counts as connected.
        seconds: how long the fault lasts.
        lease: of both participants, in seconds.
        early: how many samples are written before the reader starts.
        only_during: whether nothing is written before the fault and after it.
        on: the implementation that does so, if not all.
        seen: the guarantees that this run shows to hold, each claimed by the pack.
        lost: the guarantees that this run shows to be lost, none claimed by the pack.
    """

    name: str
    offered: Mapping[str, str]
    requested: Mapping[str, str]
    fault: str | None = None
    seconds: float = 0.0
    lease: int = 10
    early: int = 0
    only_during: bool = False
    on: str = ""
    seen: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()

    @property
    def column(self) -> str:
        """The column of the table of guarantees and faults."""
        return "link" if self.fault in {None, "slow_reader", "lost_packets"} else str(self.fault)

    @property
    def injected(self) -> Fault | None:
        """What is done to the run."""
        kind = "link_outage" if self.fault == "lost_packets" else self.fault
        return Fault(kind, self.seconds) if kind else None


SCENARIOS: Final = (
    Scenario("reliable and keep_all", KEEP, KEEP, seen=("latest", "loss_free", "duplicate_free", "ordered")),
    Scenario(
        "a program that takes too seldom",
        {"reliability": "reliable", "history.depth": "2"},
        {"reliability": "reliable", "history.depth": "2"},
        "slow_reader",
        0.5,
        seen=("latest",),
        lost=("loss_free",),
    ),
    Scenario(
        "a history for as long as the program takes nothing",
        {"reliability": "reliable", "history.depth": "100"},
        {"reliability": "reliable", "history.depth": "100"},
        "slow_reader",
        0.5,
        seen=("latest", "loss_free", "duplicate_free", "ordered"),
    ),
    Scenario(
        "a lifespan and a program that takes seldom",
        {**KEEP, "lifespan": "100ms"},
        KEEP,
        "slow_reader",
        0.5,
        seen=("max_age",),
    ),
    Scenario(
        "packets that are lost, and keep_all",
        KEEP,
        KEEP,
        "lost_packets",
        0.5,
        seen=("latest", "loss_free", "max_gap"),
    ),
    Scenario(
        "packets that are lost, and a history for as long as a repair takes",
        {"reliability": "reliable", "history.depth": "100"},
        {"reliability": "reliable", "history.depth": "200"},
        "lost_packets",
        0.5,
        seen=("latest", "loss_free", "max_gap"),
    ),
    Scenario(
        "packets that are lost, and a history of one sample",
        {"reliability": "reliable"},
        KEEP,
        "lost_packets",
        0.5,
        seen=("latest",),
        lost=("loss_free", "max_gap"),
    ),
    Scenario(
        "an outage shorter than the participant lease",
        KEEP,
        KEEP,
        "link_outage",
        1.0,
        seen=("latest", "loss_free", "duplicate_free", "ordered"),
    ),
    Scenario(
        "an outage longer than the participant lease",
        KEEP,
        KEEP,
        "link_outage",
        4.0,
        lease=1,
        seen=("latest", "duplicate_free", "ordered", "liveness"),
        lost=("loss_free",),
    ),
    Scenario(
        "an outage longer than the participant lease of durable ends",
        STORED,
        STORE,
        "link_outage",
        4.0,
        lease=1,
        seen=("latest", "loss_free"),
    ),
    Scenario(
        "a lifespan shorter than the outage",
        {**KEEP, "lifespan": "500ms"},
        KEEP,
        "link_outage",
        1.5,
        seen=("max_age",),
    ),
    Scenario(
        "a lifespan shorter than the outage, and nothing newer",
        {**KEEP, "lifespan": "300ms"},
        KEEP,
        "link_outage",
        2.0,
        only_during=True,
        lost=("latest",),
    ),
    Scenario(
        "a lifespan longer than the outage, and nothing newer",
        {**KEEP, "lifespan": "30s"},
        KEEP,
        "link_outage",
        2.0,
        only_during=True,
        seen=("latest",),
    ),
    Scenario(
        "an outage longer than the writer keeps",
        {"reliability": "reliable", "history.depth": "8"},
        KEEP,
        "link_outage",
        1.0,
        seen=("latest",),
        lost=("loss_free",),
    ),
    Scenario(
        "an outage and a repair shorter than both keep",
        {"reliability": "reliable", "history.depth": "100"},
        {"reliability": "reliable", "history.depth": "200"},
        "link_outage",
        1.0,
        seen=("latest", "loss_free"),
    ),
    Scenario(
        "a durable reader that starts again with a filter",
        STORED,
        {**STORE, "time_based_filter": "200ms"},
        "subscriber_restart",
        1.0,
        on="cyclonedds",  # Fast DDS has no filter
        lost=("offline",),
    ),
    Scenario(
        "a durable reader that is away for longer than the writer keeps",
        {**SHORT, "history.depth": "1", "durability_service.history_depth": "1"},
        STORE,
        "subscriber_restart",
        1.0,
        lost=("offline",),
    ),
    Scenario(
        "a durable reader that is away and found again within what the writer keeps",
        {**SHORT, "history.depth": "200", "durability_service.history_depth": "200"},
        {**SHORT, "history.depth": "200"},
        "subscriber_restart",
        1.0,
        seen=("offline",),
    ),
    Scenario(
        "a durable reader that starts again",
        STORED,
        STORE,
        "subscriber_restart",
        1.0,
        seen=("latest", "loss_free", "ordered", "late_join", "offline"),
        lost=("duplicate_free",),
    ),
    Scenario(
        "a volatile reader that starts again",
        KEEP,
        KEEP,
        "subscriber_restart",
        1.0,
        seen=("duplicate_free", "ordered"),
        lost=("loss_free",),
    ),
    Scenario(
        "a writer that starts again",
        KEEP,
        KEEP,
        "publisher_restart",
        4.0,
        lease=1,
        seen=("latest", "duplicate_free", "ordered", "liveness"),
    ),
    Scenario("a late reader", STORED, STORE, early=8, seen=("late_join",)),
)


def prover(name: str) -> Any:
    """Load what runs pairs on an implementation."""
    module, _, attribute = PACK.provers[name].partition(":")
    return getattr(importlib.import_module(module), attribute)


def run(scenario: Scenario, on: Any) -> Outcome:
    """Run a scenario."""
    participant = {**on.assumes, "participant_lease": f"{scenario.lease}s"}
    plan = Plan(
        "dds",
        "t",
        End("writer", scenario.offered, participant),
        End("reader", scenario.requested, participant),
        facts=FACTS,
        samples=30 if scenario.lease > 1 else 90,  # so that some are sent after both found each other again
        during=30 if scenario.only_during else 0,
        early=scenario.early,
        period=PERIOD,
        fault=scenario.injected,
        patience=12.0,
    )
    outcome: Outcome = on.prove(plan)
    return outcome


def claimed(scenario: Scenario, on: Any) -> dict[str, str]:
    """What the pack claims, by word."""
    lease = {**on.assumes, "participant_lease": f"{scenario.lease}s"}
    within = {name: f"{round(REPAIR * 1000)}ms" for name in ("repair_time", "rediscovery_time")}
    options = {"round_trip_time": "5ms", "outage": f"{round(scenario.seconds * 1000)}ms", **within}
    if scenario.fault != "link_outage":
        options.pop("outage")
    taken = f"{round(scenario.seconds * 1000) if scenario.fault == 'slow_reader' else 0}ms"
    document = {
        "cqos": 1,
        "protocol": "dds",
        "options": {"dds": options},
        "topics": {"t": dict(FACTS)},
        "participants": {
            "a": {**lease, "publishes": {"t": dict(scenario.offered)}},
            "b": {**lease, "subscribes": {"t": {**scenario.requested, "taken_every": taken}}},
        },
    }
    report = explain(json.dumps(document).encode(), publisher="a/publisher/t", subscriber="b/subscriber/t")
    return {each.word: next(c.value for c in each.cells if c.fault == scenario.column) for each in report.guarantees}


def seconds(text: str) -> float:
    """Read a duration."""
    return Duration().parse(text) / 1e9


def moment(event: Event) -> float:
    """Return when something happened in a run, which has a clock."""
    assert event.at is not None
    return event.at


def observed(scenario: Scenario, outcome: Outcome, claim: Mapping[str, str]) -> dict[str, bool]:
    """Whether each guarantee held in a run; those with a number, as much of it as is claimed."""
    started = [moment(e) for e in outcome.events if e.who == "subscriber" and e.what == "started"]
    arrived = [(moment(e), e.number) for e in outcome.events if e.what == "arrived" and e.number is not None]
    before = [number for at, number in arrived if not started or at < started[0]]
    after = [number for at, number in arrived if started and at >= started[0]]
    numbers = before + after
    sent = {e.number: moment(e) for e in outcome.events if e.what == "sent" and e.number is not None}
    restarted = scenario.fault == "subscriber_restart"
    again = next((moment(e) for e in outcome.events if e.what in {"restored", "started"}), None)
    held = {
        "latest": bool(sent) and bool(numbers) and max(numbers) == max(sent),
        "loss_free": set(sent) <= set(numbers),
        "duplicate_free": len(numbers) == len(set(numbers)),
        "ordered": all(a < b for part in (before, after) for a, b in pairwise(part)),
        "late_join": bool(set(range(scenario.early)) <= set(numbers))
        if scenario.early
        else restarted and {n for n, at in sent.items() if again is not None and at < again} <= set(after),
        "offline": restarted and set(sent) <= set(numbers),
    }
    if claim.get("max_age", "none") not in {"none", "unknown"}:
        limit = seconds(claim["max_age"])
        held["max_age"] = all(at - sent[n] <= limit + SLACK / 4 for at, n in arrived if n in sent)
    gap = max((later - earlier for (earlier, _), (later, _) in pairwise(arrived)), default=0.0)
    promised = claim.get("max_gap", "none")
    held["max_gap"] = gap <= (PERIOD + SLACK / 4 if promised in {"none", "unknown"} else seconds(promised) + SLACK)
    if claim.get("liveness", "none") not in {"none", "unknown"}:
        limit = seconds(claim["liveness"])
        gone = next((moment(e) for e in outcome.events if e.what in {"cut", "killed"}), None)
        noticed = [moment(e) for e in outcome.events if e.who == "subscriber" and e.what in {"unmatched", "not_alive"}]
        held["liveness"] = gone is not None and any(gone <= at <= gone + limit + SLACK for at in noticed)
    return held
