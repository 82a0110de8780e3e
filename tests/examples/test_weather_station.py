"""The weather station over two protocols: it fits, and each single slip is found on the hop where it is made."""

from pathlib import Path

import pytest

import cqos_core as cqos

FILE = Path(__file__).parents[2] / "examples" / "mixed" / "weather_station.yaml"
TEXT = FILE.read_text(encoding="utf-8")

SLIPS = [
    # What is written instead of what, and where which need is lost.
    ("topic: req_weather_data, reliability: reliable", "topic: req_weather_data, reliability: best_effort", "ROS504"),
    ("topic: field/weather/request, qos: 1", "topic: field/weather/request, qos: 0", "MQTT101"),
    # It is retained, but a session that goes on does not read it again.
    ("topic: field/weather/answer, qos: 1", "topic: field/weather/answer, qos: 0", "MQTT108"),
    ("message_expiry_interval: 120", "message_expiry_interval: 241", "MQTT502"),
    (", lifespan: 1min", "", "ROS519"),
    (
        "id: drone/request, reliability: reliable, depth: 5",
        "id: drone/request, reliability: reliable, depth: 1",
        "ROS505",
    ),
]


def test_it_fits():
    report = cqos.check(FILE)
    assert report.verdict == "compatible"
    assert [each.code for each in report.findings if each.severity != "note"] == []


@pytest.mark.parametrize(("right", "wrong", "code"), SLIPS)
def test_each_slip_is_found_on_its_hop(right, wrong, code):
    assert TEXT.count(right) == 1
    report = cqos.check(TEXT.replace(right, wrong).encode())
    errors = {each.code for each in report.findings if each.severity == "error"}
    assert errors == ({code} if code else set()), [each.message for each in report.findings]


def test_the_way_back_is_explained_hop_by_hop():
    pair = cqos.explain(FILE, publisher="station/answer", subscriber="drone/answer")
    assert [(hop.protocol, hop.bridge) for hop in pair.hops] == [("mqtt", "mqtt_client"), ("ros2", None)]
    given = {each.word: each.value for each in pair.guarantees}
    assert given["latest"] == "yes"
    assert given["max_age"] == "182s"
    assert given["liveness"] == "none"
