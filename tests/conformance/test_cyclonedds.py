"""The packs of DDS and ROS 2 against a running Cyclone DDS: every value of every policy, many random combinations.

More random pairs, or others: ``CQOS_CONFORMANCE_PAIRS=20000 CQOS_CONFORMANCE_SEED=7 pytest tests/conformance``.
"""

import json
import os
from importlib.metadata import version

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_core import check_pair
from tests.conformance.comparison import Section, judge, pairs_of, random_pairs, section
from tests.conformance.cyclone import TYPES, Cyclone, sample_type
from tests.conformance.table import (
    ALL_SECTIONS,
    DOCUMENT,
    PAIRS,
    RANDOM_PAIRS,
    RECORDED,
    SEED,
    SUBJECTS,
    document,
    running,
    seen,
)

NUMBER = int(os.environ.get("CQOS_CONFORMANCE_PAIRS", PAIRS))
CHOSEN_SEED = int(os.environ.get("CQOS_CONFORMANCE_SEED", SEED))


def compared(protocol: str) -> Section:
    """The random pairs of this run."""
    if (NUMBER, CHOSEN_SEED) == (PAIRS, SEED):
        return seen(protocol, RANDOM_PAIRS)
    subject = SUBJECTS[protocol]
    return section(running(), random_pairs(NUMBER, CHOSEN_SEED, subject), subject)


@pytest.mark.parametrize(("protocol", "name"), [each for each in ALL_SECTIONS if each[1] != RANDOM_PAIRS])
def test_every_value_against_every_value(protocol, name):
    assert seen(protocol, name).disagreements == []


@pytest.mark.parametrize("extensibility", TYPES)
def test_the_default_representation_follows_the_type(extensibility):
    asked = section(Cyclone(extensibility), pairs_of(("data_representation",)), extensibility=extensibility)
    assert asked.disagreements == []


@pytest.mark.parametrize("protocol", SUBJECTS)
def test_random_pairs(protocol):
    asked = compared(protocol)
    matching, refused = asked.matching, asked.not_created
    print(f"{NUMBER} random pairs of {protocol}, seed {CHOSEN_SEED}: {matching} match, {refused} cannot be created")  # noqa: T201 - with -s
    assert asked.disagreements == [], f"seed {CHOSEN_SEED}"
    assert min(matching, NUMBER - matching - refused) > NUMBER / 20, "the dice are loaded"
    # All that ROS 2 can say can be created.
    assert (refused > NUMBER / 20) if protocol == "dds" else refused == 0


def test_larger_runs_are_recorded_and_without_disagreement():
    for protocol, one in json.loads(RECORDED.read_text(encoding="utf-8")).items():
        assert one["agree"] == one["pairs"] >= 20_000, protocol
        assert one["Cyclone DDS"] == version("cyclonedds"), "run: python -m tests.conformance.table 20000 2026"


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
def test_the_durability_service_limits_what_transient_local_writers_store(offered, stored):
    """The facts behind DDS203, DDS212 and DDS353."""
    durable = {"durability": "transient_local", "reliability": "reliable"}
    [replayed] = running().replayed([({**durable, **offered}, {**durable, "history": "keep_all"})], written=8)
    assert replayed == list(range(8))[-stored:]
    report = check_pair("dds", {**durable, **offered}, {**durable, "depth": 8}, {"implementation": "cyclonedds"})
    stored_less = offered.get("history") == "keep_all" or int(offered["history.depth"]) > stored
    assert ("DDS353" in [finding.code for finding in report.findings]) is stored_less


TWO_MEMBERS = {"value": int, "more": int}


@pytest.mark.parametrize(
    ("reader", "matched"),
    [
        (sample_type("Sample", {"value": int}), True),
        (sample_type("Example", {"value": int}), True),
        (sample_type("Sample", TWO_MEMBERS), False),
        (sample_type("Example", TWO_MEMBERS), False),
    ],
    ids=["one type", "another name", "other members", "another name and other members"],
)
def test_types_are_compared_by_their_members(reader, matched):
    """The fact behind DDS213 and DDS402."""
    assert running().meet(sample_type("Sample", {"value": int}), reader) is matched
    report = check_pair("dds", {"type": "Sample"}, {"type": reader.__idl_typename__}, {"implementation": "cyclonedds"})
    assert "DDS402" not in [finding.code for finding in report.findings]


@pytest.mark.parametrize("weak", ["offered", "requested"])
def test_nothing_is_replayed_to_or_from_best_effort(weak):
    """The fact behind DDS330."""
    durable = {"durability": "transient_local", "reliability": "reliable"}
    weaker = {**durable, "reliability": "best_effort"}
    offered = weaker if weak == "offered" else durable
    assert running().replayed([(offered, weaker)], written=3) == [[]]


@pytest.mark.parametrize("protocol", SUBJECTS)
def test_random_pairs_try_every_policy(protocol):
    subject = SUBJECTS[protocol]
    tried = {name for pair in random_pairs(500, CHOSEN_SEED, subject) for settings in pair for name in settings}
    assert tried == set(subject.choices)


@pytest.mark.parametrize("protocol", SUBJECTS)
def test_a_check_says_what_is_compared_here(protocol):
    subject = SUBJECTS[protocol]
    pairs = list(random_pairs(50, CHOSEN_SEED, subject))
    for (offered, requested), judged in zip(pairs, judge(pairs, subject, **subject.options), strict=True):
        report = check_pair(protocol, offered, requested, subject.options)
        if judged.matched is not None:
            assert (report.verdict == "compatible") is judged.matched


def test_the_table_in_the_docs_is_what_was_seen():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), "run: python -m tests.conformance.table"
