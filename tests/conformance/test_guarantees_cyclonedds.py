"""What the DDS pack says that a reader gets, against what a reader of a running Cyclone DDS gets."""

import os
import time
from collections.abc import Mapping
from itertools import product

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_core import check_pair
from tests.conformance.cyclone import Keyed, Settings, taken
from tests.conformance.table import running

WRITTEN = 8
CYCLONE = {"implementation": "cyclonedds", "extensibility": "final"}
RELIABLE = {"reliability": "reliable"}
DURABLE = {**RELIABLE, "durability": "transient_local"}
STORES: list[Settings] = [
    {},
    {"history": "keep_all", "resource_limits.max_samples": "3"},
    {"durability_service.history_depth": "5"},
    {"durability_service.history_kind": "keep_all"},
    {"durability_service.history_kind": "keep_all", "durability_service.max_samples_per_instance": "3"},
    {"durability_service.history_depth": "5", "durability_service.max_samples": "3"},
]
HISTORIES: list[Settings] = [
    {},
    {"history.depth": "4"},
    {"history": "keep_all"},
    {"history": "keep_all", "resource_limits.max_samples": "3"},
    {"history": "keep_all", "resource_limits.max_samples_per_instance": "3"},
]


def judged(offered: Settings, requested: Settings, needs: Mapping[str, str | int], **topic: str) -> str:
    return check_pair("dds", offered, requested, CYCLONE, topic, needs=needs).verdict.value


def given(offered: Settings, requested: Settings) -> int:
    """How many samples the pack says a late reader gets, of those written."""
    verdicts = [judged(offered, requested, {"late_join": number}) for number in range(1, WRITTEN + 1)]
    number = verdicts.count("compatible")
    assert verdicts == ["compatible"] * number + ["incompatible"] * (WRITTEN - number)
    return number


def test_late_readers_get_as_many_samples_as_they_are_given():
    pairs = [({**DURABLE, **store}, {**DURABLE, **history}) for store, history in product(STORES, HISTORIES)]
    replayed = running().replayed(pairs, WRITTEN)
    wrong = [
        (*pair, len(samples)) for pair, samples in zip(pairs, replayed, strict=True) if len(samples) != given(*pair)
    ]
    assert wrong == []


@pytest.mark.parametrize("durability", ["volatile", "transient", "persistent"])
@pytest.mark.parametrize("asked", ["volatile", "transient_local"])
def test_without_a_durability_service_nothing_else_is_kept(durability, asked):
    offered = {**RELIABLE, "durability": durability, "durability_service.history_kind": "keep_all"}
    requested = {**RELIABLE, "durability": asked, "history": "keep_all"}
    if durability != "volatile" or asked == "volatile":
        assert running().replayed([(offered, requested)], WRITTEN) == [[]]
    assert given(offered, requested) == 0


@pytest.mark.parametrize(("durability", "again"), [("transient_local", [0]), ("volatile", [])])
def test_a_reader_that_starts_again_gets_again_what_is_kept(durability, again):
    """The fact behind DDS517: the sample has been there before."""
    requested = {**RELIABLE, "durability": durability}
    writer, start = running().connected(DURABLE, requested)
    reader = start()
    writer.write(running().type(0))
    assert taken(reader, 1) == [0]
    del reader
    assert taken(start(), 1) == again
    needs: dict[str, str | int] = {"duplicate_free": "true", "survives": "[subscriber_restart]"}
    assert judged(DURABLE, requested, needs) == ("incompatible" if again else "compatible")


@pytest.mark.parametrize(("separation", "last"), [("0s", WRITTEN - 1), ("500ms", 0)])
def test_a_filter_drops_the_newest_sample_too(separation, last):
    """The fact behind DDS539; by the standard a reliable reader gets the last sample in the end."""
    requested = {**RELIABLE, "history": "keep_all", "time_based_filter": separation}
    writer, start = running().connected({**RELIABLE, "history": "keep_all"}, requested)
    reader = start()
    for number in range(WRITTEN):
        writer.write(running().type(number))
    time.sleep(0.6)
    assert taken(reader, WRITTEN)[-1] == last
    verdict = judged(RELIABLE, requested, {"latest": "true"}, period="1ms")
    assert verdict == ("compatible" if last else "incompatible")


def test_instances_are_taken_one_by_one_without_ordered_access():
    """The fact behind DDS518."""
    settings = {**RELIABLE, "history": "keep_all"}
    writer, start = running().connected(settings, settings, Keyed)
    reader = start()
    for number in range(WRITTEN):
        writer.write(Keyed(number % 2, number))
    time.sleep(0.2)
    values = taken(reader, WRITTEN)
    assert sorted(values) == list(range(WRITTEN))
    assert values != sorted(values)
    assert [value for value in values if value % 2] == [1, 3, 5, 7]
    assert judged(settings, settings, {"ordered": "true"}, keyed="true") == "incompatible"


EXCLUSIVE = {**RELIABLE, "history": "keep_all", "ownership": "exclusive"}
BY_SOURCE = {**RELIABLE, "history": "keep_all", "destination_order": "by_source_timestamp"}
AN_HOUR = 3_600_000_000_000


@pytest.mark.parametrize(("strength", "arrive"), [("0", True), ("10", False)])
def test_an_exclusive_writer_is_heard_only_without_a_stronger_one(strength, arrive):
    """The fact behind DDS511 and DDS557 to DDS560."""
    writer, start = running().connected({**EXCLUSIVE, "ownership_strength": "1"}, EXCLUSIVE)
    reader = start()
    other = running().beside(writer, {**EXCLUSIVE, "ownership_strength": strength})
    other.write(running().type(-1))
    assert taken(reader, 1) == [-1]
    for number in range(WRITTEN):
        writer.write(running().type(number))
    assert taken(reader, WRITTEN) == (list(range(WRITTEN)) if arrive else [])
    for needs in ({"latest": "true"}, {"max_gap": "1s"}, {"loss_free": "true"}):
        assert judged(EXCLUSIVE, EXCLUSIVE, needs, period="1ms", keyed="false") == "unknown"


@pytest.mark.parametrize(("ahead", "arrive"), [(-AN_HOUR, True), (AN_HOUR, False)])
def test_by_source_a_writer_whose_clock_is_behind_is_not_heard(ahead, arrive):
    """The fact behind DDS512 and DDS561 to DDS564."""
    writer, start = running().connected(BY_SOURCE, BY_SOURCE)
    reader = start()
    other = running().beside(writer, BY_SOURCE)
    other.write(running().type(-1), timestamp=time.time_ns() + ahead)
    assert taken(reader, 1) == [-1]
    for number in range(WRITTEN):
        writer.write(running().type(number))
    assert taken(reader, WRITTEN) == (list(range(WRITTEN)) if arrive else [])
    for needs in ({"latest": "true"}, {"max_gap": "1s"}, {"loss_free": "true"}):
        assert judged(BY_SOURCE, BY_SOURCE, needs, period="1ms", keyed="false") == "unknown"


@pytest.mark.parametrize("settings", [EXCLUSIVE, BY_SOURCE])
def test_a_sole_writer_is_heard(settings):
    assert (
        judged(settings, settings, {"latest": "true"}, period="1ms", keyed="false", sole_writer="true") == "compatible"
    )


def test_a_filter_drops_what_is_kept_by_the_time_it_was_written():
    """The fact behind DDS555 and DDS556: what is replayed at once passes if it was not written at once."""
    requested = {**DURABLE, "history": "keep_all", "time_based_filter": "100ms"}
    offered = {**DURABLE, "history": "keep_all", "durability_service.history_kind": "keep_all"}
    writer, start = running().connected(offered, requested)
    now = time.time_ns()
    for number in range(WRITTEN):
        writer.write(running().type(number), timestamp=now - (WRITTEN - number) * 50_000_000)
    assert taken(start(), WRITTEN) == list(range(0, WRITTEN, 2))
    assert judged(offered, requested, {"late_join": WRITTEN}, period="50ms") == "incompatible"
    assert judged(offered, requested, {"offline": "1s"}, period="50ms") == "incompatible"
    assert judged(offered, requested, {"late_join": WRITTEN}, period="100ms") == "compatible"
