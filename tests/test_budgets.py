"""Budgets: what goes over links, what histories keep, and which links are certainly overloaded."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from cqos_core.api import check, context, read
from cqos_core.behaviour.paths.budgets import budgets_of_system
from cqos_core.behaviour.paths.link_facts import rate_text
from cqos_core.cli.explain import explain
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.finding import Verdict

FILE = """
cqos: 1
protocol: dds
options: {dds: {implementation: cyclonedds}}
topics: {image: {period: 100ms, size: 60000, keyed: false}}
participants:
  camera: {publishes: {image: {reliability: reliable, depth: 3}}}
  desk: {subscribes: {image: {reliability: best_effort, depth: 2}}}
links: {radio: {participants: desk, rate: 4.7Mbit/s, loss: 1%, mtu: 1500, round_trip: 20ms}}
"""


def changed(*changes):
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text.encode()


def spent(data):
    return budgets_of_system(Pipeline(read(data), context()))


def reported(data):
    return [(each.code, each.severity.value) for each in check(data).findings if each.code.startswith("CQ8")]


@pytest.mark.parametrize(
    ("changes", "codes"),
    [
        ([("4.7Mbit", "4.95Mbit")], []),
        ([("4.7Mbit", "4.8Mbit")], [("CQ813", "warning")]),
        ([], [("CQ812", "error")]),
        ([("rate: 4.7Mbit/s, ", "")], []),
        ([("size: 60000, ", "")], []),
        ([("period: 100ms, ", "")], []),
        ([("participants: desk", "participants: camera")], [("CQ812", "error")]),
        ([("participants: desk", "participants: [camera, desk]")], []),
        ([("participants: desk", "participants: desk, topics: [other]")], []),
        ([("participants: desk", "participants: 'de*', topics: ['im*']")], [("CQ812", "error")]),
        # What may be thinned out, or may not arrive at all, is not certain.
        ([("depth: 2", "depth: 2, time_based_filter: 1s")], [("CQ813", "warning")]),
        ([("reliability: reliable", "reliability: best_effort"), ("{reliability: best_effort, depth: 2", "{reliability: reliable, depth: 2")], []),
        # Publishers share the period of a topic: one on the other side may keep it alone.
        ([("  desk: {subscribes", "  desk: {publishes: {image: }, subscribes")], [("CQ813", "warning")]),
        ([("4.7Mbit/s", "fast")], [("CQ811", "error")]),
        ([("loss: 1%", "loss: 150%"), ("4.7Mbit", "9Mbit")], [("CQ811", "error")]),
        ([("mtu: 1500", "mtu: 15"), ("4.7Mbit", "9Mbit")], [("CQ811", "error")]),
        ([("round_trip: 20ms", "round_trip: 20"), ("4.7Mbit", "9Mbit")], [("CQ811", "error")]),
    ],
)  # fmt: skip
def test_what_is_reported(changes, codes):
    assert reported(changed(*changes)) == codes


def test_what_readers_of_fast_dds_confirm_goes_the_other_way():
    def back(period: str, reliability: str) -> float | None:
        text = FILE.replace("cyclonedds", "fastdds_2_9").replace("100ms", period).replace("best_effort", reliability)
        text = text.replace("desk: {subscribes", "desk: {publishes: {status: }, subscribes")
        text = text.replace("keyed: false}}", "keyed: false}, status: {period: 1s, size: 500, keyed: false}}")
        text = text.replace("camera: {publishes", "camera: {subscribes: {status: }, publishes")
        likely: float | None = next(each.likely for each in spent(text.encode()).loads if not each.inward)
        return likely

    assert back("100ms", "best_effort") == 664
    assert back("100ms", "reliable") == 664 + 10 * 152
    assert back("1ms", "reliable") == 664 + 200 * 152


def test_an_overload_leaves_the_verdict_of_pairs_alone():
    report = check(FILE.encode())
    assert report.verdict is Verdict.COMPATIBLE
    (finding,) = report.findings
    assert (
        finding.message == "link `radio`: samples to `desk` take at least 4.8Mbit/s, and it carries 4.7Mbit/s: `image`"
    )


def test_figures_of_a_link():
    (stream,) = spent(FILE.encode()).streams
    (load,) = spent(FILE.encode()).loads
    assert stream.packets(None) == 5
    assert stream.packets(1500) == 45
    assert stream.bytes_of_sample(None) == 60_436
    assert stream.bytes_of_sample(1500) == 60_436 + 40 * 20
    assert load.certain == 600_000
    ((topic, lost),) = load.lost
    assert (topic, round(lost, 4)) == ("image", round(1 - 0.99**45, 4))


BROKER = """
cqos: 1
protocol: mqtt
options: {mqtt: {protocol_version: "5.0"}}
brokers: {hub: {}}
topics: {t: {period: 100ms, size: 200}}
participants:
  a: {broker: hub, client_id: a, publishes: {t: {qos: 2}}}
  b: {broker: hub, client_id: b, subscribes: {t: {qos: 1}}}
  c: {broker: hub, client_id: c, subscribes: {t: {qos: 0}}}
links: {radio: {participants: [PATTERNS]}}
"""


@pytest.mark.parametrize(
    ("patterns", "out", "into"),
    [("a", 1, 0), ("b", 0, 1), ("b, c", 0, 2), ("a, b", 1, 1), ("a, hub", 2, 0), ("hub", 2, 1), ("'*'", 0, 0)],
)
def test_messages_go_to_the_broker_once_and_from_it_to_each_receiver(patterns, out, into):
    found = spent(BROKER.replace("PATTERNS", patterns).encode())
    (stream,) = found.streams
    # One byte, a length of two, the name with its length, a packet identifier, properties; and PUBREL to the broker.
    assert stream.to_broker == ((40 + 1 + 2 + 3 + 2 + 1 + 200 + 4, 1),)
    assert stream.parts == ((40 + 1 + 2 + 3 + 2 + 1 + 200, 1),)
    copies = {load.inward: sum(len(each.receivers | each.perhaps) for each in load.streams) for load in found.loads}
    assert (copies.get(False, 0), copies.get(True, 0)) == (out, into)


def test_messages_of_an_unknown_version_have_no_figure_with_headers():
    (stream,) = spent(BROKER.replace('"5.0"', "3.1.1").encode()).streams
    assert stream.wire() == 10 * (40 + 1 + 2 + 3 + 2 + 200)
    text = BROKER.replace('options: {mqtt: {protocol_version: "5.0"}}\n', "")
    (stream,) = spent(text.encode()).streams
    assert stream.wire() is None
    assert stream.payload == 2_000


def test_a_long_message_is_cut_into_segments_of_tcp():
    (stream,) = spent(BROKER.replace("size: 200", "size: 20000").encode()).streams
    whole = 1 + 3 + 3 + 2 + 1 + 20_000
    assert stream.packets(1500) == 14
    assert stream.bytes_of_sample(1500) == whole + 14 * 40


def test_a_late_joiner_waits_for_what_is_kept():
    stored = ("reliability: reliable, depth: 3", "reliability: reliable, depth: 3, durability: transient_local")
    asked = ("reliability: best_effort, depth: 2", "reliability: reliable, depth: 3, durability: transient_local")
    (load,) = spent(changed(stored, asked)).loads
    ((topic, seconds),) = load.catching_up
    assert topic == "image"
    assert seconds == pytest.approx(60_000 * 8 / 4.7e6 + 0.02)


def test_histories_keep_depth_samples_of_each_instance():
    assert [(each.samples, each.size) for each in spent(FILE.encode()).histories] == [(3, 180_000), (2, 120_000)]
    keyed = spent(changed(("keyed: false", "keyed: true"), ("depth: 3", "depth: 3, max_instances: 4")))
    assert [each.samples for each in keyed.histories] == [12, None]
    everything = spent(changed(("depth: 3", "history: keep_all")))
    assert [each.samples for each in everything.histories] == [None, 2]


def test_explain_shows_them(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_bytes(FILE.encode())
    shown = CliRunner().invoke(explain, ["--budgets", str(file)])
    assert shown.exit_code == 0
    assert "link radio to desk: 4.8Mbit/s, 4.9Mbit/s with headers and copies, and it carries 4.7Mbit/s" in shown.output
    found = json.loads(CliRunner().invoke(explain, ["--budgets", str(file), "--format", "json"]).output)["budgets"]
    assert found["links"][0]["samples"] == 600_000
    assert found["histories"][1] == {
        "endpoint": "desk/subscriber/image",
        "topic": "image",
        "samples": 2,
        "bytes": 120_000,
    }


@pytest.mark.parametrize(
    ("rate", "text"), [(0, "0bit/s"), (125, "1kbit/s"), (1_250_000, "10Mbit/s"), (124_900, "999kbit/s")]
)
def test_rates_are_printed_in_bits(rate, text):
    assert rate_text(rate) == text
