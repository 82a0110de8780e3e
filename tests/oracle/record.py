"""Writes docs/conformance-behaviour.md: random runs of the simulator beside the findings about behaviour.

The command has three forms.

python -m tests.oracle.record              write it from what was recorded.
python -m tests.oracle.record RUNS MODELS  first record so many runs of each case, and so many random models.
python -m tests.oracle.record more         first record what has changed since: new cases, all twins, and the random models.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any, Final

from tests.behaviour.model_text import model
from tests.behaviour.test_cases import cases
from tests.conformance.origin import build_of, origin
from tests.oracle.checks import CHECKED, POSSIBLE, Oracle, cause, faults, follows, holds, is_reported, lacks
from tests.oracle.random_models import random_model

ROOT: Final = Path(__file__).resolve().parents[2]
DOCUMENT: Final = ROOT / "docs" / "conformance-behaviour.md"
RECORDED: Final = Path(__file__).with_name("recorded.json")
FIRST_SEED: Final = 100
"""Seed of the first random model; the others follow."""
_RUNS: Final = 40
_MORE: Final = 400
"""So many more runs of a random model try a fault that is not reported."""
_TRIES: Final = 300
"""So many runs try a silent twin."""
_LONG: Final = 15_000
"""Steps of a run of a silent twin."""
REASONS: Final = {
    "a date with an offset is not read": "C-QoS does not read this text. The fault is there.",
    "the pool has a mark of several without a number": "The number of participants has no limit. Each run has one.",
    "it is called by a name that an engine computes": "An engine may call the process from anywhere. The simulator calls it from here.",
    "a way around the first throw": "Nothing arrives. C-QoS follows what certainly happens before, and a way leads around it.",
    "the answer may come just in time": "Answer and timer are due at the same time. The timer comes first in these runs.",
    **dict.fromkeys(
        ("they are in different domains", "the strongest one is in another partition"),
        "The ends form no pair. The simulator knows no domains and no partitions.",
    ),
    **dict.fromkeys(
        (
            "it is retained for as long",
            "it is retained, and the older version has no expiry",
            "it is retained, and the version is not stated",
            "a retained message comes again for each token",
        ),
        "A retained message comes again. The simulator knows none: it keeps samples by their durability.",
    ),
    "as often as that": "Three calls begin at once, so no random run has their samples at equal distances.",
    "the topic may have instances, each with a queue": "Each sample may be of another instance. The simulator knows none.",
    "an inclusive gateway takes several ways": "It takes any of them. No random run takes enough of them each time.",
    "a flow leads to a start event, which takes none": "The model is not valid, so C-QoS claims nothing.",
    "no pair rests on it": "No subscriber is in the model, so nothing depends on the fault.",
}
"""Why no run of a twin is without the fault."""
PAGE: Final = """# Conformance of findings about behaviour

Written by `python -m tests.oracle.record` from random runs of a simulator. The simulator moves tokens with random delays over the control
flow of a model. It knows nothing of the analysis. Tasks take any time, also for ever. Timers are never early. Gateways choose freely.
Signals arrive late or get lost.

Recorded on {date}, {build}. {more}Runs have the seeds from 0, random models the seeds from {first}.

## Findings and runs

{models} models of the cases have findings of these codes. Each has {runs} random runs. A finding holds in a run where the run shows what it
says. A run shows nothing of a deadline before the first sample, and nothing of what the finding assumes away: a late timer (BP113), a
sample that is under way (BP107). BP108 says what may happen, so a run shows it or nothing.

{claims}

{twins} silent twins lack a finding of their example. {twins_free} of them have a run without the fault, among {tries}. The others:

{without}

## Faults and findings

{random} random models have {random_runs} runs each, and {random_more} more where a fault is not reported. A fault is what all of these runs have: a
throw that never fires, a catch at which no token ever is, or a deadline that the throws of a participant miss. `follows`: a
reported topic that no run throws is the cause.

{recall}

{share} % of the faults are reported by name, {both} % with those that follow. Those that are not reported have these causes. A fault of the
first cause goes away where samples of each signal also come from outside.

{causes}

A fault that no finding names may be none: a run without it exists, and no random run found it.

## Public models

4,723 BPMN files of five public repositories (bpmn-miwg-test-suite, bpmn-for-research, fbpmn, BPMN-Analyzer, bpmn-elements) were checked
on 2026-11-23, with `bpmn.message_flows=true` for ROS 2. 1,801 have pairs. 16 had findings about behaviour, and each was read beside its diagram.
7 were false alarms, of two causes that are now cases: a sequence flow without a target, and a message that no message flow brings. The
9 others are true. In 1, two processes wait for each other. 1 has a loop that no flow enters, and 3 wait for a signal that nothing
sends (warnings). In 4, a sample is sent before the token waits for it (warnings).

## What is not simulated

BP117 says that a subscription exists from the start, which holds by the option that it rests on. The simulator does not check it.
"""


MORE: Final = "New cases, the silent twins and the random models are of commit {}. "


def drawn(case: dict[str, Any]) -> Oracle:
    """Return a case as its oracle."""
    stated = {name: case[name] for name in ("protocol", "external", "options") if name in case}
    return Oracle(model(case["model"], **stated))


def examples(runs: int, before: dict[str, Any] | None = None) -> dict[str, Any]:
    """Run each case that is not known from before, and each silent twin until a run lacks the fault of its example."""
    known: dict[str, list[str]] = before["claims"] if before else {}
    answers = {code: Counter(before["answers"][code] if before else {}) for code in CHECKED}
    expected: dict[str, set[str]] = {}
    claims: dict[str, list[str]] = {}
    without: list[str] = []
    twins = 0
    for each in cases():
        case, name = each.values[0], str(each.id)
        oracle = drawn(case)
        if oracle.claims:
            claims[name] = sorted(map(str, oracle.claims))
        for number in range(runs if oracle.claims and name not in known else 0):
            log = oracle.run(number)
            for claim in oracle.claims:
                answers[claim.code][str(holds(claim, log))] += 1
        base = next((found for found in expected if name.startswith(f"{found}: ")), None)
        said = {" ".join(text.split(" ")[::2]) for text in case.get("expect", [])}
        if base is None:
            expected[name] = said
            continue
        for code, members in (text.split(" ") for text in sorted(expected[base] - said)):
            missing = (
                oracle.claim(code, tuple(members.split(","))) if code in CHECKED and code not in POSSIBLE else None
            )
            if missing is None or is_reported(missing, oracle):
                continue
            twins += 1
            if not any(lacks(missing, oracle.run(number, steps=_LONG)) for number in range(_TRIES)):
                without.append(f"{name}: {missing}")
    assert all(claims.get(name) == said for name, said in known.items()), "a case has changed: record all of them"
    return {"claims": claims, "runs": runs, "answers": answers, "twins": twins, "without": without}


def recall(models: int) -> dict[str, Any]:
    """Run random models, and count the faults by what is reported of them."""
    found: Counter[str] = Counter()
    causes: Counter[str] = Counter()
    for seed in range(FIRST_SEED, FIRST_SEED + models):
        oracle = Oracle(model(random_model(Random(seed))))  # noqa: S311
        wrong, left = faults(oracle, _RUNS, also=_MORE)
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
            if kind == "not reported":
                causes[cause(fault, oracle, _MORE)] += 1
    return {"models": models, "found": found, "causes": causes}


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
    named = sum(row[0] for row in counted.values())
    known = sum(row[0] + row[1] for row in counted.values())
    total = sum(sum(row) for row in counted.values())
    return PAGE.format(
        date=one["date"],
        build=build_of(one),
        more=MORE.format(one["more"][:12]) if "more" in one else "",
        first=FIRST_SEED,
        models=len(shown["claims"]),
        runs=shown["runs"],
        claims=_table(["code", "holds", "shows nothing", "contradicted"], claims),
        twins=shown["twins"],
        twins_free=shown["twins"] - len(shown["without"]),
        tries=_TRIES,
        without=_table(["twin", "finding", "reason"], [_explained(each) for each in shown["without"]]),
        random=random["models"],
        random_runs=_RUNS,
        random_more=_MORE,
        recall=_table(["fault", *kinds], [[names[code], *map(str, row)] for code, row in counted.items()]),
        share=round(100 * named / max(total, 1)),
        both=round(100 * known / max(total, 1)),
        causes=_table(["cause", "faults"], [[name, str(number)] for name, number in sorted(random["causes"].items())]),
    )


def _explained(twin: str) -> list[str]:
    name, finding = twin.rsplit(": ", 1)
    return [name, finding, REASONS.get(name.rsplit(": ", 1)[1], "")]


def _table(header: list[str], rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in [header, ["-" * len(name) for name in header], *rows])


def record(runs: int, models: int, before: dict[str, Any] | None = None) -> None:
    """Run everything and record it, or what has changed since ``before``."""
    made = origin()
    recorded = {
        **made,
        **({"commit": before["commit"], "cqos": before["cqos"], "more": made["commit"]} if before else {}),
        "examples": examples(runs, before and before["examples"]),
        "random": recall(models),
    }
    RECORDED.write_text(json.dumps(recorded, indent=1, sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:] == ["more"]:
        earlier = json.loads(RECORDED.read_text(encoding="utf-8"))
        record(earlier["examples"]["runs"], earlier["random"]["models"], earlier)
    elif len(sys.argv) > 1:
        record(int(sys.argv[1]), int(sys.argv[2]))
    DOCUMENT.write_text(document(), encoding="utf-8")
    counted = json.loads(RECORDED.read_text(encoding="utf-8"))["examples"]["answers"]
    sys.exit(any(answers.get("False") for answers in counted.values()))
