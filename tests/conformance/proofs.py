"""Random pairs and the pair errors of the examples, run by the provers of the packs: does reality agree with each verdict?

python -m tests.conformance.proofs 200 2026            run so many pairs on each implementation of DDS, and record what comes out
python -m tests.conformance.proofs 200 2026 fastdds    the same on one of them
python -m tests.conformance.proofs 200 2026 examples   only the pair errors of the examples, each with its fixes
"""

from __future__ import annotations

import json
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Final

from cqos_core import check
from cqos_core.analysis.run_plan import named, prepare
from cqos_core.api import context
from cqos_core.files.path_loader import load_paths
from cqos_core.files.source_reader import read_texts
from cqos_core.files.system_merge import merge
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.prover import NotRunnableError, Outcome
from cqos_live.prove.outcomes import disagreements, fixed, summary
from tests.conformance.comparison import random_pairs
from tests.conformance.origin import origin
from tests.made_up_protocol import pair_system

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.analysis.run_plan import Trial
    from cqos_core.model.system import System
    from cqos_core.packs.prover import Plan

ROOT: Final = Path(__file__).resolve().parents[2]
RECORDED: Final = Path(__file__).with_name("proofs.json")
IMPLEMENTATIONS: Final = ("cyclonedds", "fastdds")
EXAMPLES: Final = "examples"
LIMIT: Final = 5.0
"""Seconds that one run may take."""
_AT_ONCE: Final = 2
_CHANCE: Final = {"liveliness.lease_duration": "1ns"}
_LEASE: Final = {"liveliness.lease_duration": "500ms"}


@dataclass(frozen=True)
class Proof:
    """One run, and what it contradicts."""

    name: str
    trial: Trial
    outcome: Outcome
    seconds: float
    wrong: list[str]

    def __str__(self) -> str:
        """Say what was run, and what happened."""
        return (
            f"{self.name} on {self.outcome.by}: C-QoS says {self.trial.report.verdict}, {summary(self.outcome)} "
            f"({self.seconds:.1f} s){''.join(f'; {each}' for each in self.wrong)}"
        )


def prove(name: str, trial: Trial) -> Proof | None:
    """Run one pair; None where no run can show it, such as that of a Will, which the broker publishes."""
    began = time.monotonic()
    try:
        outcome = trial.run()
    except NotRunnableError as error:
        sys.stderr.write(f"{name}: {error}\n")
        return None
    return Proof(name, trial, outcome, time.monotonic() - began, disagreements(trial, outcome, context()))


def random_trials(number: int, seed: int, implementation: str) -> Iterator[tuple[str, Trial]]:
    """Plan random pairs of the DDS pack. A lease of 1 ns has run out before anything arrives: what happens then is chance."""
    for position, pair in enumerate(random_pairs(number, seed)):
        offered, requested = ({**end, **(_LEASE if end.items() >= _CHANCE.items() else {})} for end in pair)
        system = pair_system("dds", offered, requested, {}, {}, {})
        name = f"pair {position} of seed {seed}: {offered}, {requested}"
        yield name, prepare(system, PUBLISHER, SUBSCRIBER, context(), implementation)


def example_trials(path: Path, implementation: str = "") -> Iterator[tuple[str, Trial]]:
    """Plan one pair of each pair error of an example, a file or a folder, and the same with its fixes in the files."""
    where = context()
    loaded = load_paths([str(path)]).systems
    if not loaded:
        return
    files = [file for file, _ in loaded]
    system = named(merge([each for _, each in loaded]), where)
    for publisher, subscriber in pair_errors(system):
        name = f"{path.name} {publisher} {subscriber}"
        try:
            trial = prepare(system, publisher, subscriber, where, implementation)
        except NotRunnableError as error:
            sys.stderr.write(f"{name}: {error}\n")
            continue
        yield name, trial
        repaired = fixed(trial, where, again=lambda texts: merge(read_texts(files, texts)))
        if repaired is not None:
            yield f"{name}, fixed", repaired[0]


def pair_errors(system: System) -> list[tuple[str, str]]:
    """Return one pair of each group of pairs that are incompatible."""
    report = check(system)
    return [(group.publishers[0], group.subscribers[0]) for group in report.groups if group.verdict == "incompatible"]


def proofs(trials: Iterable[tuple[str, Trial]]) -> Iterator[Proof]:
    """Run pairs, a few at a time."""
    planned = list(trials)
    for each in planned[:1]:
        prove(*each)  # what is compiled on first use is compiled now
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        yield from (each for each in pool.map(lambda each: prove(*each), planned) if each is not None)


def record(number: int, seed: int, names: Sequence[str]) -> int:
    """Run random pairs of implementations, and the examples; write down what comes out, and return how many differ."""
    recorded = json.loads(RECORDED.read_text(encoding="utf-8")) if RECORDED.exists() else {}
    wrong = 0
    for name in names:
        found = list(proofs(trials_of(name, number, seed)))
        for each in found:
            if each.wrong or each.seconds > LIMIT:
                sys.stderr.write(f"{each}\n")
        wrong += sum(bool(each.wrong) for each in found)
        times = [each.seconds for each in found]
        recorded[name] = {
            **origin(),
            "seed": seed,
            "by": sorted({each.outcome.by for each in found}),
            "seconds": {"median": round(median(times), 1), "most": round(max(times), 1), "limit": LIMIT},
            "rows": [_row(each) for each in found],
        }
        _write(recorded)
    return wrong


def trials_of(name: str, number: int, seed: int) -> Iterator[tuple[str, Trial]]:
    """Plan what is recorded under a name: random pairs of an implementation, or the examples."""
    if name != EXAMPLES:
        return random_trials(number, seed, name)
    folder = ROOT / "examples"
    # Each incident is a system of its own; together they would pair ends that never met.
    systems = [*(path for path in folder.iterdir() if path.name != "incidents"), *(folder / "incidents").iterdir()]
    return (each for path in sorted(systems) for each in example_trials(path))


def _write(recorded: Mapping[str, Any]) -> None:
    """Write a row to a line."""
    text = json.dumps(recorded, indent=1)
    rows = re.sub(r"\n {4,}", " ", text)  # what is nested deeper than a row is on its line
    RECORDED.write_text(re.sub(r"\n {3}(?=[\]}])", "", rows) + "\n", encoding="utf-8")


def _row(proof: Proof) -> dict[str, Any]:
    """Return what happened, from which `replayed` makes it again; the values of a pair follow from the seed."""
    outcome = proof.outcome
    return {
        "name": proof.name.partition(":")[0],
        "plan": digest(proof.trial.plan),
        "by": outcome.by,
        "not_created": dict(outcome.not_created),
        "matched": outcome.matched,
        "refused": list(outcome.refused),
        "sent": list(outcome.sent),
        "arrived": list(outcome.arrived),
        "seconds": round(proof.seconds, 1),
    }


def digest(plan: Plan) -> str:
    """Return a text that is the same for equal plans."""
    stated = {name: value for name, value in asdict(plan).items() if name != "needs" or value}
    stated["subscriber"]["values"].pop("strongest_writer", None)  # of other writers, which a run does not have
    return sha256(json.dumps(stated, sort_keys=True).encode()).hexdigest()[:12]


def replayed(row: Mapping[str, Any]) -> Outcome:
    """Return the outcome of a recorded run, without its timeline."""
    refused, sent, arrived = (tuple(row[name]) for name in ("refused", "sent", "arrived"))
    return Outcome(row["by"], (), row["matched"], sent, arrived, refused, row["not_created"])


if __name__ == "__main__":
    count, chosen, *rest = sys.argv[1:]
    sys.exit(1 if record(int(count), int(chosen), rest or (*IMPLEMENTATIONS, EXAMPLES)) else 0)
