"""The page about guarantees under faults is what was recorded, and so is the evidence that packs name."""

import json
from importlib.metadata import version

import pytest

from tests.conformance.guarantees import DDS_DESIGNS, DOCUMENT, RECORDED, document

PRODUCTS = ("cyclonedds", "fastdds")


@pytest.fixture(scope="module")
def recorded():
    return json.loads(RECORDED.read_text(encoding="utf-8"))


def test_the_page_is_what_was_recorded():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), "run: python -m tests.conformance.guarantees"


@pytest.mark.parametrize("name", PRODUCTS)
def test_every_guarantee_was_kept(recorded, name):
    runs = recorded[name]["runs"]
    assert {each["design"] for each in runs} == set(DDS_DESIGNS)
    assert [each for each in runs if each["contradicted"]] == []


@pytest.mark.parametrize("name", PRODUCTS)
def test_each_guarantee_is_broken_where_it_is_not_given(recorded, name):
    """The other side of the boundary is seen too, save for order, which no run of one pair breaks."""
    runs = recorded[name]["runs"]
    harmed = {word for each in runs for word in each["harmed"] if each["kept"][word] is None}
    assert {"loss_free", "duplicate_free", "late_join"} <= harmed


def test_the_recorded_version_is_the_one_that_is_installed(recorded):
    assert recorded["cyclonedds"]["by"] == f"Cyclone DDS {version('cyclonedds')}", (
        "run: python -m tests.conformance.guarantees cyclonedds"
    )
