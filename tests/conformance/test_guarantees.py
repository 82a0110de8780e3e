"""The page about guarantees under faults is what was recorded, and so is the evidence that packs name."""

import json
import os
from importlib.metadata import version

import pytest

from cqos_core.packs.guarantee import FAULTS, LINK
from cqos_dds.pack import PACK as DDS
from cqos_mqtt.pack import PACK as MQTT
from tests.conformance.guarantees import DOCUMENT, RECORDED, SHOWN, SLOW, cases, document, seen_in

PRODUCTS = {"cyclonedds": DDS, "fastdds": DDS, "mosquitto": MQTT}
DEPARTURES: dict[tuple[str, str, str], str] = {}
"""Runs that contradict C-QoS, by product, design and fault, each with the reason why it stays so."""


@pytest.fixture(scope="module")
def recorded():
    return json.loads(RECORDED.read_text(encoding="utf-8"))


def test_the_page_is_what_was_recorded():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), "run: python -m tests.conformance.guarantees"


@pytest.mark.parametrize("name", PRODUCTS)
def test_every_guarantee_was_kept(recorded, name):
    runs = recorded[name]["runs"]
    assert {(each["design"], each["fault"]) for each in runs} == {
        (design, LINK if fault is None else str(fault)) for design, _, fault in cases(name)
    }
    wrong = [each for each in runs if each["contradicted"] and (name, each["design"], each["fault"]) not in DEPARTURES]
    assert wrong == []


@pytest.mark.parametrize("name", PRODUCTS)
def test_every_cell_that_a_pack_calls_proven_was_seen(recorded, name):
    one = recorded[name]
    proofs = [each for each in PRODUCTS[name].implementations.proofs if f"{each.product} {each.version}" == one["by"]]
    proven = {(each.guarantee, each.fault) for each in proofs if each.guarantee in SHOWN}
    assert proven
    assert seen_in(one["runs"]) == proven
    assert {fault for _, fault in proven} <= {LINK, *FAULTS}


@pytest.mark.parametrize("name", PRODUCTS)
def test_each_guarantee_is_broken_where_it_is_not_given(recorded, name):
    """The other side of the boundary is seen too, save for order, which no run of one pair breaks."""
    runs = recorded[name]["runs"]
    assert SLOW in {each["fault"].partition("=")[0] for each in runs}
    harmed = {word for each in runs for word in each["harmed"] if each["kept"][word] is None}
    assert {"loss_free", "duplicate_free", "late_join"} <= harmed


def test_the_recorded_version_is_the_one_that_is_installed(recorded):
    if os.environ.get("CI") != "true":
        pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")
    assert recorded["cyclonedds"]["by"] == f"Cyclone DDS {version('cyclonedds')}", (
        "run: python -m tests.conformance.guarantees cyclonedds"
    )
