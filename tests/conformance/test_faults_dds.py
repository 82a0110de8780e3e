"""What the DDS pack claims of pairs under faults, against what happens to them on running implementations."""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from cqos_dds.pack import PACK
from cqos_ros2.pack import PACK as ROS2
from tests.conformance.faults import SCENARIOS, claimed, observed, prover, run
from tests.conformance.guarantees import RECORDED, seen_in

AT_ONCE = 6
NOT_GIVEN = {"no", "none", "unknown"}


@pytest.mark.parametrize("name", PACK.provers)
def test_what_is_claimed_of_pairs_under_faults_is_seen(name):
    """All in one test, because the runs mostly wait, so that many of them go at the same time."""
    on = prover(name)
    if (why := on.missing()) and os.environ.get("CI") != "true":
        pytest.skip(why)
    scenarios = [each for each in SCENARIOS if each.on in {"", name}]
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
    for value in {proof.value for proof in pack.proofs}:
        assert {(proof.guarantee, proof.fault) for proof in pack.proofs if proof.value == value} == runs
