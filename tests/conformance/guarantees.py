"""Writes docs/conformance-guarantees.md: guarantees under faults that are injected into running middleware.

python -m tests.conformance.guarantees            write it from what was recorded
python -m tests.conformance.guarantees cyclonedds  first run all designs on this implementation, and record what comes out
"""

from __future__ import annotations

import json
import os
import platform
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.analysis.run_plan import named, prepare
from cqos_core.api import context, read
from cqos_core.packs.guarantee import FAULTS
from cqos_core.packs.prover import Fault
from cqos_live.prove.outcomes import claims, disagreements, kept_by, summary
from tests.conformance.origin import build_of, origin

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.packs.prover import Plan

ROOT: Final = Path(__file__).resolve().parents[2]
DOCUMENT: Final = ROOT / "docs" / "conformance-guarantees.md"
RECORDED: Final = Path(__file__).with_name("guarantees.json")
Design = dict[str, Any]
Case = tuple[str, Design, Fault | None]

LINK: Final = "link"
SLOW: Final = "slow_reader"
COLUMNS: Final = (LINK, SLOW, *FAULTS)
SHOWN: Final = ("latest", "loss_free", "duplicate_free", "ordered", "late_join")
"""Words that the run of one pair can show."""
EARLY: Final = 3
_AT_ONCE: Final = 2

INTRODUCTION: Final = """# Conformance of guarantees

Written by `python -m tests.conformance.guarantees` from runs against {products}, with
faults really injected: links are cut, programs and brokers are stopped and killed, readers take slowly.
[Prove it](prove.md) describes how, [guarantees](guarantees.md) what the words mean.

Each run sends {early} samples before the subscriber starts, 20 after that, and more while a link or a subscriber is gone. A cell says in how many runs the guarantee was kept,
of those in which C-QoS gives it. In brackets: how many of the other runs, in which C-QoS does not give it or does not know,
lost or repeated something. `-`: no run of this kind gives it.
"""
DESIGNS_HEADER: Final = ("design", *COLUMNS)


def dds(offered: Mapping[str, Any], requested: Mapping[str, Any], **topic: Any) -> Design:
    """Return a system of one pair of DDS."""
    return {
        "cqos": 1,
        "protocol": "dds",
        "options": {"dds": {"round_trip_time": "5ms", "repair_time": "500ms", "rediscovery_time": "500ms"}},
        "topics": {"t": {"period": "20ms", "keyed": False, "size": 8, **topic}},
        "participants": {"p": {"publishes": {"t": dict(offered)}}, "s": {"subscribes": {"t": dict(requested)}}},
    }


_RELIABLE: Final = {"reliability": "reliable"}
_ALL: Final = {**_RELIABLE, "reliability.max_blocking_time": "infinite", "history": "keep_all"}
_LATCHED: Final = {**_ALL, "durability": "transient_local"}
_STORED: Final = {**_LATCHED, "durability_service.history_kind": "keep_all"}
_TAKEN: Final = {"taken_every": "50ms"}
DDS_DESIGNS: Final = {
    "best effort": dds({"reliability": "best_effort"}, {"reliability": "best_effort"}),
    "reliable, keep_last 1": dds(_RELIABLE, {**_RELIABLE, **_TAKEN}),
    "reliable, keep_last 1 writer, keep_all reader": dds(_RELIABLE, {**_ALL, **_TAKEN}),
    "reliable, keep_all": dds(_ALL, {**_ALL, **_TAKEN}),
    "reliable, keep_last 50": dds({**_RELIABLE, "history.depth": 50}, {**_RELIABLE, "history.depth": 50, **_TAKEN}),
    "transient_local, keep_last 1": dds(
        {**_RELIABLE, "durability": "transient_local"}, {**_RELIABLE, "durability": "transient_local", **_TAKEN}
    ),
    "transient_local, keep_all": dds(_STORED, {**_LATCHED, **_TAKEN}),
}
DDS_FAULTS: Final = (
    None,
    Fault(SLOW, 0.3),
    Fault("link_outage", 1.0),
    Fault("subscriber_restart", 0.5),
    Fault("publisher_restart", 0.5),
)


def paused(plan: Plan, name: str) -> Plan:
    """Let the reader of a short queue pause for much longer than the samples take, so that its queue overflows on a busy machine too."""
    return replace(plan, fault=Fault(SLOW, 3.0)) if name == "a short queue" else plan


def cases(on: str) -> list[Case]:
    """Return the designs that run on an implementation, each with each fault."""
    if on == "mosquitto":
        runs: list[Case] = import_module("tests.conformance.spin_comparison").cases()
        return runs
    return [(name, design, fault) for (name, design), fault in product(DDS_DESIGNS.items(), DDS_FAULTS)]


def run(on: str, case: Case) -> dict[str, Any]:
    """Run one design under one fault: what C-QoS gives, and whether it was kept."""
    name, design, fault = case
    where = context()
    system = named(read(json.dumps(design).encode(), importer="yaml"), where)
    trial = prepare(system, "p/publisher/t", "s/subscriber/t", where, on, fault)
    plan = paused(trial.plan, name)
    trial = replace(trial, plan=replace(plan, early=EARLY, samples=plan.samples - plan.early + EARLY, patience=10.0))
    outcome = trial.run()
    given = claims(trial.report, trial.plan.fault)
    return {
        "by": outcome.by,
        "design": name,
        "fault": LINK if fault is None else str(fault),
        "given": {word: given[word] for word in SHOWN if word in given},
        "kept": {word: kept_by(word, given.get(word, ""), trial.plan, outcome) for word in SHOWN},
        "harmed": [word for word in SHOWN if kept_by(word, _whole(word), trial.plan, outcome) is False],
        "seen": summary(outcome),
        "contradicted": disagreements(trial, outcome, where),
    }


def _whole(word: str) -> str:
    """Return the most that a word can give in these runs."""
    return str(EARLY) if word == "late_join" else "yes"


def record(names: Iterable[str]) -> int:
    """Run all designs on implementations, record what comes out, and return how often that contradicts C-QoS."""
    recorded = json.loads(RECORDED.read_text(encoding="utf-8")) if RECORDED.exists() else {}
    wrong = 0
    for on in names:
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            runs = list(pool.map(lambda case, on=on: run(on, case), cases(on)))
        recorded[on] = {
            **origin(),
            "machine": f"{platform.system()} on {platform.machine()} with {os.cpu_count()} processors",
            "by": runs[0].pop("by"),
            "runs": runs,
        }
        for each in runs:
            each.pop("by", None)
            for text in each["contradicted"]:
                sys.stderr.write(f"{on}, {each['design']}, {each['fault']}: {text}\n")
        RECORDED.write_text(json.dumps(recorded, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        wrong += sum(len(each["contradicted"]) for each in runs)
    return wrong


def document() -> str:
    """Return the page."""
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    products = [one["by"] for one in recorded.values()]
    parts = [INTRODUCTION.format(products=" and ".join([", ".join(products[:-1]), products[-1]]), early=EARLY)]
    for one in recorded.values():
        runs = one["runs"]
        columns = [column for column in COLUMNS if any(column_of(each) == column for each in runs)]
        rows = [[word, *(_cell(word, column, runs) for column in columns)] for word in SHOWN]
        parts += [f"## {one['by']}", _when(one), table(["guarantee", *titles(columns)], rows)]
        wrong = [[each["design"], each["fault"], text] for each in runs for text in each["contradicted"]]
        if wrong:
            parts += ["Departures:", table(["design", "fault", "what happens"], wrong)]
        designs = dict.fromkeys(each["design"] for each in runs)
        rows = [[name, *(_what(name, column, runs) for column in columns)] for name in designs]
        parts += ["Samples that arrived:", table(["design", *titles(columns)], rows)]
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def _when(one: Mapping[str, Any]) -> str:
    kept = [each["kept"][word] for each in one["runs"] for word in SHOWN if each["kept"][word] is not None]
    where = f"on {one['date']}, {one['machine']}, {build_of(one)}"
    return f"{len(one['runs'])} runs {where}. {sum(kept)} of {len(kept)} guarantees were kept."


def seen_in(runs: Iterable[Mapping[str, Any]]) -> set[tuple[str, str]]:
    """Return each guarantee that was given and kept in a run, with its fault; a slow reader is one that stays connected."""
    return {
        (word, LINK if column_of(each) == SLOW else column_of(each))
        for each in runs
        for word in SHOWN
        if each["kept"][word]
    }


def titles(columns: Sequence[str]) -> list[str]:
    return ["connected" if column == LINK else column for column in columns]


def column_of(one: Mapping[str, Any]) -> str:
    kind: str = one["fault"].partition("=")[0]
    return kind


def _cell(word: str, column: str, runs: Sequence[Mapping[str, Any]]) -> str:
    here = [each for each in runs if column_of(each) == column]
    given = [each for each in here if each["kept"][word] is not None]
    others = [each for each in here if each["kept"][word] is None]
    harmed = sum(word in each["harmed"] for each in others)
    text = f"{sum(each['kept'][word] for each in given)} of {len(given)}" if given else "-"
    return f"{text} ({harmed} of {len(others)})" if others else text


def _what(design: str, column: str, runs: Sequence[Mapping[str, Any]]) -> str:
    found = [each["seen"] for each in runs if each["design"] == design and column_of(each) == column]
    return found[0] if found else ""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["-" * len(name) for name in header], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    contradicted = record(sys.argv[1:])
    DOCUMENT.write_text(document(), encoding="utf-8")
    sys.exit(1 if contradicted else 0)
