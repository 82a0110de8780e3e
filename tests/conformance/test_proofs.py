"""Some random pairs and the pair errors of the examples, on the middleware itself; `dev.py conformance` runs many more."""

import json
import os
from itertools import islice

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_core.api import context
from cqos_live.dds.prove import cyclone, fast
from cqos_live.prove.outcomes import disagreements
from tests.conformance.proofs import (
    EXAMPLES,
    IMPLEMENTATIONS,
    LIMIT,
    RECORDED,
    ROOT,
    digest,
    example_trials,
    proofs,
    random_trials,
    replayed,
    trials_of,
)
from tests.effort import EXPLORE

PAIRS = 6
JUDGED_AGAIN = 30
"""So many of the recorded pairs of each kind are judged again in each run of the tests."""
PROVERS = {"cyclonedds": cyclone.PROVER, "fastdds": fast.PROVER}


def here(implementation):
    """Skip where an implementation is not installed; in CI, fail."""
    missing = PROVERS[implementation].missing()
    if missing is not None and os.environ.get("CI") != "true":
        pytest.skip(missing)
    assert missing is None


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_random_pairs_do_what_their_verdicts_say(implementation):
    here(implementation)
    assert [str(each) for each in proofs(random_trials(PAIRS, 7, implementation)) if each.wrong] == []


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_pair_errors_of_an_example_and_their_fixes(implementation):
    here(implementation)
    trials = example_trials(ROOT / "examples" / "smart_agriculture_incompatible.bpmn", implementation)
    found = list(proofs(trials))
    assert [(str(each.trial.report.verdict), bool(each.outcome.arrived)) for each in found] == [
        ("incompatible", False),
        ("compatible", True),
    ]
    assert [str(each) for each in found if each.wrong] == []


@pytest.fixture(scope="module")
def recorded():
    return json.loads(RECORDED.read_text(encoding="utf-8"))


@pytest.mark.explored
@pytest.mark.parametrize(("name", "least"), [*((name, 200) for name in IMPLEMENTATIONS), (EXAMPLES, 20)])
def test_recorded_runs_contradict_no_current_verdict(recorded, name, least, monkeypatch):
    """The verdicts are those of now, the outcomes those of the record; a row whose plan has changed since shows nothing."""
    one = recorded[name]
    for by in one["by"]:  # judged as what was recorded behaves, whatever is installed here
        title, _, version = by.rpartition(" ")
        for prover in PROVERS.values():
            if prover.title == title:
                monkeypatch.setattr(prover, "version", lambda version=version: version)
    assert len(one["rows"]) >= least
    tried = len(one["rows"]) if EXPLORE else JUDGED_AGAIN
    rows = {row["name"]: row for row in one["rows"]}
    current = {
        text.partition(":")[0]: trial
        for text, trial in islice(trials_of(name, least, one["seed"]), tried)
        if rows.get(text.partition(":")[0], {}).get("plan") == digest(trial.plan)
    }
    assert len(current) >= 0.9 * tried, f"run: python -m tests.conformance.proofs 200 2026 {name}"
    wrong = {key: disagreements(trial, replayed(rows[key]), context()) for key, trial in current.items()}
    assert {key: each for key, each in wrong.items() if each} == {}


def test_each_recorded_run_took_no_more_than_the_limit(recorded):
    assert set(recorded) == {*IMPLEMENTATIONS, EXAMPLES}
    for one in recorded.values():
        assert one["seconds"]["most"] == max(row["seconds"] for row in one["rows"]) <= one["seconds"]["limit"] == LIMIT
