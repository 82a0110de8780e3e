"""Some random pairs and the pair errors of the examples, on the middleware itself; `dev.py conformance` runs many more."""

import json
import os

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_dds.prove import cyclone, fast
from tests.conformance.proofs import (
    EXAMPLES,
    IMPLEMENTATIONS,
    LIMIT,
    RECORDED,
    ROOT,
    example_trials,
    proofs,
    random_trials,
)

PAIRS = 6
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


def test_larger_runs_are_recorded_and_without_disagreement():
    for name, one in json.loads(RECORDED.read_text(encoding="utf-8")).items():
        assert one["agree"] == one["pairs"] >= (20 if name == EXAMPLES else 200), name
        assert one["slowest"] <= LIMIT, name
