"""Fixes say what they multiply: memory of histories and traffic, from stated periods and sizes only."""

import json

import pytest

from cqos_core.api import check
from cqos_core.formatters.json_report import report_from_json
from cqos_core.formatters.phrases import fix

STORE = """
cqos: 1
protocol: dds
options: {dds: {implementation: cyclonedds}}
topics: {image: {period: 100ms, size: 60000, keyed: false}}
participants:
  camera: {publishes: {image: {reliability: reliable, durability: transient_local}}}
  desk: {subscribes: {image: {reliability: reliable, durability: transient_local, depth: 200, needs: {late_join: 100}}}}
"""
READERS = """
cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
topics: {image: {period: 100ms, size: 60000, keyed: false}}
participants:
  camera: {publishes: {image: {reliability: best_effort}}}
  desk: {subscribes: {image: {reliability: best_effort}}}
"""
MORE = "".join(f"  viewer{number}: {{subscribes: {{image: {{reliability: reliable}}}}}}\n" for number in range(4))


def costs(text, code):
    """By policy, what the fixes of a finding cost."""
    (finding,) = (each for each in check(text.encode()).findings if each.code == code)
    return {f"{each.policy}={each.value}": each.costs for each in finding.remedies}


def test_a_deeper_store_multiplies_memory():
    found = costs(STORE, "DDS520")
    assert found["durability_service.history_depth=100"] == ("multiplies memory by 100: at most 6MB, 60kB before",)
    assert found["durability_service.history_kind=keep_all"] == ("removes the limit of memory: at most 60kB before",)


@pytest.mark.parametrize(
    ("old", "new"),
    [("size: 60000, ", ""), ("late_join: 100", "late_join: 100"), ("durability: transient_local}}}\n", "durability: transient_local, durability_service.history_depth: 60}}}\n")],
)  # fmt: skip
def test_no_growth_is_named_where_a_fact_is_absent_or_the_growth_is_small(old, new):
    text = STORE.replace(old, new, 1)
    expected = old == new
    assert bool(costs(text, "DDS520")["durability_service.history_depth=100"]) == expected


def test_traffic_grows_with_the_readers_that_a_fix_connects():
    offer = costs(READERS + MORE, "ROS101")["reliability=reliable"]
    assert offer == (
        "multiplies traffic of `/image` by 5.01: 24.2Mbit/s with a copy for each receiver, 4.83Mbit/s before",
    )
    assert costs((READERS + MORE).replace("period: 100ms, ", ""), "ROS101")["reliability=reliable"] == ()
    # A topic on which nothing flows is repaired, and that is no growth.
    dead = READERS.replace(
        "desk: {subscribes: {image: {reliability: best_effort", "desk: {subscribes: {image: {reliability: reliable"
    )
    assert costs(dead, "ROS101")["reliability=reliable"] == ()


def test_texts_and_json_have_it():
    report = check(STORE.encode())
    (finding,) = (each for each in report.findings if each.code == "DDS520")
    remedy = next(each for each in finding.remedies if each.costs)
    assert fix(remedy).endswith("(multiplies memory by 100: at most 6MB, 60kB before)")
    document = report.to_dict()
    (stated,) = (each for each in document["findings"] if each["code"] == "DDS520")
    assert stated["remedies"][0]["costs"] == list(remedy.costs)
    again = report_from_json(json.dumps(document))
    (read,) = (each for each in again.findings if each.code == "DDS520")
    assert read.remedies == finding.remedies
