"""The DDS pack against a running Cyclone DDS: every value of every policy, and many random combinations.

More random pairs, or others: ``CQOS_CONFORMANCE_PAIRS=20000 CQOS_CONFORMANCE_SEED=7 pytest tests/conformance``.
"""

import os

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_core import check_pair
from tests.conformance.comparison import CHOICES, judge, pairs_of, random_pairs, section
from tests.conformance.cyclone import TYPES, Cyclone
from tests.conformance.table import DOCUMENT, PAIRS, RANDOM_PAIRS, SECTIONS, SEED, document, running, seen

NUMBER = int(os.environ.get("CQOS_CONFORMANCE_PAIRS", PAIRS))
CHOSEN_SEED = int(os.environ.get("CQOS_CONFORMANCE_SEED", SEED))


@pytest.mark.parametrize("name", [name for name in SECTIONS if name != RANDOM_PAIRS])
def test_every_value_against_every_value(name):
    assert seen(name).disagreements == []


@pytest.mark.parametrize("extensibility", TYPES)
def test_the_default_representation_follows_the_type(extensibility):
    asked = section(Cyclone(extensibility), pairs_of(("data_representation",)), extensibility)
    assert asked.disagreements == []


def test_random_pairs():
    chosen = (NUMBER, CHOSEN_SEED) != (PAIRS, SEED)
    asked = section(running(), random_pairs(NUMBER, CHOSEN_SEED)) if chosen else seen(RANDOM_PAIRS)
    matching = sum(each.matched is True for each in asked.seen)
    refused = sum(each.matched is None for each in asked.seen)
    print(f"{NUMBER} random pairs, seed {CHOSEN_SEED}: {matching} match, {refused} cannot be created")  # noqa: T201 - with -s
    assert asked.disagreements == [], f"seed {CHOSEN_SEED}"
    assert min(matching, refused, NUMBER - matching - refused) > NUMBER / 20, "the dice are loaded"


@pytest.mark.parametrize(
    ("offered", "stored"),
    [
        ({"history.depth": "10"}, 1),
        ({"history": "keep_all"}, 1),
        ({"history.depth": "10", "durability_service.history_depth": "5"}, 5),
        ({"history.depth": "2", "durability_service.history_depth": "5"}, 5),
        ({"history.depth": "2", "durability_service.history_kind": "keep_all"}, 8),
    ],
)
def test_what_transient_local_writers_store_is_said_by_the_durability_service(offered, stored):
    """The facts behind DDS203, DDS212 and DDS353."""
    durable = {"durability": "transient_local", "reliability": "reliable"}
    replayed = running().replayed({**durable, **offered}, {**durable, "history": "keep_all"}, written=8)
    assert replayed == list(range(8))[-stored:]
    report = check_pair("dds", {**durable, **offered}, {**durable, "depth": 8}, {"implementation": "cyclonedds"})
    stored_less = offered.get("history") == "keep_all" or int(offered["history.depth"]) > stored
    assert ("DDS353" in [finding.code for finding in report.findings]) is stored_less


@pytest.mark.parametrize("weak", ["offered", "requested"])
def test_nothing_is_replayed_to_or_from_best_effort(weak):
    """The fact behind DDS330."""
    durable = {"durability": "transient_local", "reliability": "reliable"}
    weaker = {**durable, "reliability": "best_effort"}
    offered = weaker if weak == "offered" else durable
    assert running().replayed(offered, weaker, written=3) == []


def test_random_pairs_try_every_policy():
    tried = {name for pair in random_pairs(500, CHOSEN_SEED) for settings in pair for name in settings}
    assert tried == set(CHOICES)


def test_a_check_says_what_is_compared_here():
    options = {"implementation": "cyclonedds", "extensibility": "final"}
    pairs = list(random_pairs(50, CHOSEN_SEED))
    for (offered, requested), judged in zip(pairs, judge(pairs, **options), strict=True):
        report = check_pair("dds", offered, requested, options)
        if judged.matched is not None:
            assert (report.verdict == "compatible") is judged.matched


def test_the_table_in_the_docs_is_what_was_seen():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), "run: python -m tests.conformance.table"
