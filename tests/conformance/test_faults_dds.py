"""What the DDS pack claims of pairs under faults, against what happens to them on running implementations.

Each run of the tests tries a few pairs, in which no claim rests on how fast the machine is; `dev.py conformance` tries all.
"""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from cqos_dds.pack import PACK
from cqos_ros2.pack import PACK as ROS2
from tests.conformance.faults import SCENARIOS, claimed, observed, prover, run
from tests.conformance.guarantees import RECORDED, seen_in
from tests.effort import EXPLORE

AT_ONCE = 6
NOT_GIVEN = {"no", "none", "unknown"}
ALWAYS = {
    "a program that takes too seldom",
    "packets that are lost, and a history of one sample",
    "an outage shorter than the participant lease",
    "an outage longer than the writer keeps",
    "a durable reader that is away for longer than the writer keeps",
    "a durable reader that starts again",
    "a volatile reader that starts again",
    "a late reader",
}
"""Those of each run: what is seen and what is lost, while connected, over an outage, after a restart, and late."""


def test_what_each_run_tries_is_there():
    assert ALWAYS <= {each.name for each in SCENARIOS}


@pytest.mark.explored
@pytest.mark.parametrize("name", PACK.implementations.provers)
def test_what_is_claimed_of_pairs_under_faults_is_seen(name):
    """All in one test, because the runs mostly wait, so that many of them go at the same time."""
    on = prover(name)
    if (why := on.missing()) and os.environ.get("CI") != "true":
        pytest.skip(why)
    scenarios = [each for each in SCENARIOS if each.on in {"", name} and (EXPLORE or each.name in ALWAYS)]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        outcomes = list(pool.map(lambda each: run(each, on), scenarios))
    wrong = {}
    for scenario, outcome in zip(scenarios, outcomes, strict=True):
        claim = claimed(scenario, on)
        held = observed(scenario, outcome, claim)
        found = {word: (claim[word], held[word]) for word in (*scenario.seen, *scenario.lost)}
        expected = {word: (word in scenario.seen) for word in found}
        if {word: kept for word, (_, kept) in found.items()} != expected or expected != {
            word: value not in NOT_GIVEN for word, (value, _) in found.items()
        }:
            wrong[scenario.name] = found
    assert wrong == {}


@pytest.mark.parametrize("pack", [PACK, ROS2], ids=lambda pack: pack.id)
def test_every_proof_has_its_run_and_every_run_its_proof(pack):
    runs = {(word, scenario.column) for scenario in SCENARIOS for word in scenario.seen}
    runs |= seen_in(json.loads(RECORDED.read_text(encoding="utf-8"))["cyclonedds"]["runs"])
    for value in {proof.value for proof in pack.implementations.proofs}:
        assert {(proof.guarantee, proof.fault) for proof in pack.implementations.proofs if proof.value == value} == runs
