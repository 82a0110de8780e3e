"""What the DDS pack claims of pairs under faults, against what happens to them on running implementations."""

import json
import os

import pytest

from cqos_dds.pack import PACK
from cqos_ros2.pack import PACK as ROS2
from tests.conformance.faults import SCENARIOS, claimed, observed, prover, run
from tests.conformance.guarantees import RECORDED, seen_in

NOT_GIVEN = {"no", "none", "unknown"}


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
@pytest.mark.parametrize("name", PACK.provers)
def test_what_is_claimed_of_a_pair_under_a_fault_is_seen(name, scenario):
    on = prover(name)
    if (why := on.missing()) and os.environ.get("CI") != "true":
        pytest.skip(why)
    claim = claimed(scenario, on)
    held = observed(scenario, run(scenario, on), claim)
    assert {word: (claim[word] not in NOT_GIVEN, held[word]) for word in scenario.seen} == dict.fromkeys(
        scenario.seen, (True, True)
    )
    assert {word: (claim[word] in NOT_GIVEN, held[word]) for word in scenario.lost} == dict.fromkeys(
        scenario.lost, (True, False)
    )


@pytest.mark.parametrize("pack", [PACK, ROS2], ids=lambda pack: pack.id)
def test_every_proof_has_its_run_and_every_run_its_proof(pack):
    runs = {(word, scenario.column) for scenario in SCENARIOS for word in scenario.seen}
    runs |= seen_in(json.loads(RECORDED.read_text(encoding="utf-8"))["cyclonedds"]["runs"])
    for value in {proof.value for proof in pack.proofs}:
        assert {(proof.guarantee, proof.fault) for proof in pack.proofs if proof.value == value} == runs
