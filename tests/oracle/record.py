"""Writes docs/conformance-behaviour.md: random runs of the simulator beside the findings about behaviour.

The command has two forms.

python -m tests.oracle.record              write it from what was recorded
python -m tests.oracle.record RUNS MODELS  first record so many runs of each case, and so many random models
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from datetime import datetime, timezone
from pathlib import Path
from random import Random
from typing import Any, Final

from tests.behaviour.drawing import model
from tests.behaviour.test_cases import cases
from tests.oracle.checks import CHECKED, Oracle, faults, follows, holds, is_reported, lacks
from tests.oracle.random_models import random_model

ROOT: Final = Path(__file__).resolve().parents[2]
DOCUMENT: Final = ROOT / "docs" / "conformance-behaviour.md"
RECORDED: Final = Path(__file__).with_name("recorded.json")
FIRST_SEED: Final = 100
"""Seed of the first random model; the others follow."""
_RUNS: Final = 40
_MORE: Final = 3
"""So many times the runs of a random model try a fault that is not reported."""
PAGE: Final = """# Conformance of findings about behaviour

Written by `python -m tests.oracle.record` from random runs of a simulator. The simulator moves tokens with random delays over the control
flow of a model. It knows nothing of the analysis. Tasks take any time, also for ever. Timers are never early. Gateways choose freely.
Signals arrive late or get lost.

Recorded on {date}, commit {commit}. Runs have the seeds from 0, random models the seeds from {first}.

## Findings and runs

{models} models of the cases have findings of these codes. Each has {runs} random runs. A finding holds in a run where the run shows what it
says. A run shows nothing of a deadline before the first sample.

{claims}

{twins} silent twins lack a finding of their example. {twins_free} of them have a run without the fault.

## Faults and findings

{random} random models have {random_runs} runs each, and {random_more} more where a fault is not reported. A fault is what all of these runs have: a
throw that never fires, a catch at which no token ever is, or a deadline that the throws of a participant miss. `follows`: a
reported topic that no run throws is the cause.

{recall}

{share} % of the faults are reported, or follow from a reported one. The others that were looked at have three causes:

- **Order.** The only throw of a signal comes after the last moment at which a token waits for it. The analysis takes every signal to come in time.
- **Rates around circles of signals.** A process starts by a signal that it throws itself, which has no bound in the analysis.
- **Rare runs.** A run without the fault exists, and no random run found it.

BP105 to BP109, BP113 to BP115, BP117 and BP118 rest on QoS, on order or on readings of a catch. The simulator does not check them.
"""


def drawn(case: dict[str, Any]) -> Oracle:
    """Return a case as its oracle."""
    stated = {name: case[name] for name in ("protocol", "external", "options") if name in case}
    return Oracle(model(case["model"], **stated))


def examples(runs: int) -> dict[str, Any]:
    """Run each case, and each silent twin until a run lacks the fault of its example."""
    answers: dict[str, Counter[str]] = {code: Counter() for code in CHECKED}
    expected: dict[str, list[str]] = {}
    models = twins = free = 0
    for each in cases():
        case, name = each.values[0], str(each.id)
        oracle = drawn(case)
        models += bool(oracle.claims)
        for number in range(runs if oracle.claims else 0):
            log = oracle.run(number)
            for claim in oracle.claims:
                answers[claim.code][str(holds(claim, log))] += 1
        base = next((found for found in expected if name.startswith(f"{found}: ")), None)
        if base is None:
            expected[name] = case.get("expect", [])
            continue
        for text in set(expected[base]) - set(case.get("expect", [])):
            code, _, members = text.split(" ")
            missing = oracle.claim(code, tuple(members.split(","))) if code in CHECKED else None
            if missing is not None:
                twins += 1
                free += any(lacks(missing, oracle.run(number)) for number in range(min(runs, 300)))
    return {"models": models, "runs": runs, "answers": answers, "twins": twins, "free": free}


def recall(models: int) -> dict[str, Any]:
    """Run random models, and count the faults by what is reported of them."""
    found: Counter[str] = Counter()
    for seed in range(FIRST_SEED, FIRST_SEED + models):
        oracle = Oracle(model(random_model(Random(seed))))  # noqa: S311
        wrong, left = faults(oracle, _RUNS, also=_MORE * _RUNS)
        assert wrong == [], (seed, wrong)
        for fault in left:
            kind = (
                "reported"
                if is_reported(fault, oracle)
                else "follows"
                if follows(fault, oracle, _RUNS)
                else "not reported"
            )
            found[f"{fault.code} {kind}"] += 1
    return {"models": models, "found": found}


def document() -> str:
    """Return the page."""
    one = json.loads(RECORDED.read_text(encoding="utf-8"))
    shown, random = one["examples"], one["random"]
    claims = [
        [code, *(str(shown["answers"][code].get(answer, 0)) for answer in ("True", "None", "False"))]
        for code in CHECKED
    ]
    kinds = ("reported", "follows", "not reported")
    names = {"BP111": "throw never fires", "BP112": "no token at a catch", "BP101": "deadline missed"}
    counted = {code: [random["found"].get(f"{code} {kind}", 0) for kind in kinds] for code in names}
    known = sum(row[0] + row[1] for row in counted.values())
    total = sum(sum(row) for row in counted.values())
    return PAGE.format(
        date=one["date"],
        commit=one["commit"][:12],
        first=FIRST_SEED,
        models=shown["models"],
        runs=shown["runs"],
        claims=_table(["code", "holds", "shows nothing", "contradicted"], claims),
        twins=shown["twins"],
        twins_free=shown["free"],
        random=random["models"],
        random_runs=_RUNS,
        random_more=_MORE * _RUNS,
        recall=_table(["fault", *kinds], [[names[code], *map(str, row)] for code, row in counted.items()]),
        share=round(100 * known / max(total, 1)),
    )


def _table(header: list[str], rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in [header, ["-" * len(name) for name in header], *rows])


def record(runs: int, models: int) -> None:
    """Run everything and record it."""
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True)
    recorded = {
        "date": datetime.now(timezone.utc).date().isoformat(),
        "commit": commit.stdout.strip(),
        "examples": examples(runs),
        "random": recall(models),
    }
    RECORDED.write_text(json.dumps(recorded, indent=1, sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        record(int(sys.argv[1]), int(sys.argv[2]))
    DOCUMENT.write_text(document(), encoding="utf-8")
    counted = json.loads(RECORDED.read_text(encoding="utf-8"))["examples"]["answers"]
    sys.exit(any(answers.get("False") for answers in counted.values()))
