"""Chains: what is certain, excluded and open, step by step."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from cqos_core import Session
from cqos_core.api import check, context, read
from cqos_core.behaviour.paths.chains import chain_times
from cqos_core.behaviour.paths.time_ranges import TimeRange, read_range
from cqos_core.cli.explain import explain
from cqos_core.language.values import INFINITE
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.finding import Verdict
from cqos_core.model.problems import InputError, InvalidValueError

MS = 1_000_000
FILE = """
cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds, repair_time: 0s}}
topics:
  /scan: {type: a/msg/Scan, period: 50ms}
  /cmd: {type: a/msg/Cmd, period: 20ms}
participants:
  lidar: {publishes: {/scan: {reliability: reliable}}}
  fusion: {subscribes: {/scan: }, publishes: {/cmd: }}
  motors: {subscribes: {/cmd: }}
chains:
  stop:
    steps:
      - lidar
      - {at: fusion, latency: <=5ms, takes: 5ms..20ms}
      - {at: motors, latency: <=2ms, takes: <=1ms}
    max_age: 100ms
    max_gap: 30ms
"""


def changed(*changes):
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text.encode()


def reported(data):
    return [(each.code, each.severity.value) for each in check(data).findings if each.code.startswith("CQ8")]


def times(data):
    (found,) = chain_times(Pipeline(read(data), context()))
    return found


def test_a_chain_that_holds_says_nothing():
    report = check(FILE.encode())
    assert report.verdict is Verdict.COMPATIBLE
    assert report.findings == ()
    found = times(FILE.encode())
    assert found.age == TimeRange(5 * MS, 78 * MS)
    assert found.gap == TimeRange(20 * MS, 23 * MS)
    assert [each.age.high for each in found.steps] == [0, 75 * MS, 78 * MS]


@pytest.mark.parametrize(
    ("changes", "codes"),
    [
        ([("max_age: 100ms", "max_age: 78ms")], []),
        ([("max_age: 100ms", "max_age: 77ms")], [("CQ805", "warning")]),
        ([("max_age: 100ms", "max_age: 5ms")], [("CQ805", "warning")]),
        ([("max_age: 100ms", "max_age: 4ms")], [("CQ803", "error")]),
        ([("max_gap: 30ms", "max_gap: 23ms")], []),
        ([("max_gap: 30ms", "max_gap: 22ms")], [("CQ805", "warning")]),
        ([("max_gap: 30ms", "max_gap: 20ms")], [("CQ805", "warning")]),
        ([("max_gap: 30ms", "max_gap: 19ms")], [("CQ804", "error")]),
        # What nothing bounds is never met, and one missing fact is one finding.
        ([("latency: <=2ms, ", "")], [("CQ805", "warning")]),
        ([("takes: 5ms..20ms", "takes: '>=5ms'")], [("CQ805", "warning")]),
        ([(", takes: 5ms..20ms", "")], [("CQ805", "warning")]),
        ([(", period: 50ms", "")], [("CQ805", "warning")]),
        ([(", period: 20ms", "")], [("CQ805", "warning")]),
        ([("takes: 5ms..20ms", "takes: {unknown: never measured}")], [("CQ805", "warning")]),
        # A step that states how long it waits needs no period of what it reads.
        ([(", period: 50ms", ""), ("at: fusion, ", "at: fusion, waits: <=10ms, ")], []),
        # A deadline that is offered is a promise; a derived or a missing one is none.
        ([(", period: 50ms", ""), ("{reliability: reliable}", "{reliability: reliable, history: keep_all, deadline: 50ms}")], []),
        ([("{reliability: reliable}", "{reliability: best_effort}"), ("{/scan: },", "{/scan: {reliability: best_effort}},")],
         [("CQ805", "warning")]),
        # A pair that is incompatible is reported as such, and only once.
        ([("{reliability: reliable}", "{reliability: best_effort}")], []),
        ([("motors: {subscribes: {/cmd: }}", "motors: {subscribes: {/cmd2: }}")], [("CQ802", "error")]),
        (
            [("motors: {subscribes: {/cmd: }}", "motors: {external: true, subscribes: {/cmd2: }}")],
            [("CQ802", "warning")],
        ),
        ([("- lidar", "- radar")], [("CQ801", "error")]),
        ([("takes: <=1ms", "takes: 1")], [("CQ801", "error")]),
        ([("takes: <=1ms", "takes: 2ms..1ms")], [("CQ801", "error")]),
        ([("max_age: 100ms", "max_age: soon")], [("CQ801", "error")]),
        ([("publishes: {/cmd: }", "publishes: {/cmd: , /log: }"), ("{/cmd: }}\nchains", "{/cmd: , /log: }}\nchains")],
         [("CQ801", "error")]),
        (
            [
                ("publishes: {/cmd: }", "publishes: {/cmd: , /log: }"),
                ("{/cmd: }}\nchains", "{/cmd: , /log: }}\nchains"),
                ("{at: motors, ", "{at: motors, topic: /cmd, "),
            ],
            [],
        ),
        ([("- lidar", "- lidar/publisher/scan"), ("{at: motors, ", "{at: motors/subscriber/cmd, ")], []),
    ],
)  # fmt: skip
def test_what_is_reported(changes, codes):
    data = changed(*changes)
    assert reported(data) == codes
    verdict = check(data).verdict
    assert verdict is (Verdict.INCOMPATIBLE if "best_effort" in str(changes[0]) and len(changes) == 1 else verdict)


def test_a_promise_is_named_as_an_assumption():
    found = times(
        changed(
            (", period: 50ms", ""),
            ("{reliability: reliable}", "{reliability: reliable, history: keep_all, deadline: 50ms}"),
        )
    )
    assert "`lidar/publisher/scan` keeps the gap that its settings promise" in found.steps[1].assumed
    assert "`fusion` uses the newest sample of `/scan`" in found.steps[1].assumed


def test_an_expiry_that_counts_in_the_broker_bounds_no_latency():
    text = """
cqos: 1
protocol: mqtt
options: {mqtt: {protocol_version: "5.0"}}
topics: {temp: {period: 1s}}
participants:
  sensor: {publishes: {temp: {qos: 1, message_expiry_interval: 5s}}}
  control: {subscribes: {temp: {qos: 1}}}
chains: {c: {steps: [sensor, {at: control}], max_age: 6s}}
"""
    assert reported(text.encode()) == [("CQ805", "warning")]
    assert reported(text.replace("{at: control}", "{at: control, latency: <=6s}").encode()) == []


def test_a_chain_leads_over_bridges():
    data = changed(
        ("motors: {subscribes: {/cmd: }}", "motors: {domain: 7, subscribes: {/cmd: }}\n  a: {}\n  b: {domain: 7}"),
        ("chains:", "bridges:\n  x: {routes: [{from: {participant: a, topic: /cmd}, to: {participant: b}}]}\nchains:"),
    )
    found = times(data)
    assert found.steps[-1].bridges == ("x",)
    assert found.age == TimeRange(5 * MS, 78 * MS)


def test_the_message_names_values_and_steps():
    (finding,) = (each for each in check(changed(("max_age: 100ms", "max_age: 4ms"))).findings if each.code == "CQ803")
    assert finding.message == "chain `stop`: data at `motors` is at least 5ms old, and `max_age` is 4ms"
    assert str(finding.place).endswith(":18:14")
    assert finding.notes[1].endswith("latency 0s to 5ms, waits 0s to 50ms, takes 5ms to 20ms; age 5ms to 75ms")


def test_a_session_equals_a_fresh_check_after_each_edit():
    system = read(FILE.encode())
    session = Session(system)
    assert session.report().findings == ()
    endpoint = next(each for each in system.endpoints if each.id == "motors/subscriber/cmd")
    session.remove(endpoint.id)
    assert [each.code for each in session.report().findings if each.code[:3] == "CQ8"] == ["CQ802"]
    session.put(endpoint)
    assert session.report().findings == ()


def test_a_message_keeps_chains_and_links():
    from cqos_core.remote.messages import from_message, system_message

    data = changed(("chains:", "links:\n  radio: {participants: lidar, topics: [/scan], rate: 1Mbit/s}\nchains:"))
    system = read(data)
    back = from_message(system_message(system))
    assert (back.chains, back.links) == (system.chains, system.links)


def test_explain_shows_every_step(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_bytes(FILE.encode())
    shown = CliRunner().invoke(explain, ["--chains", str(file)])
    assert shown.exit_code == 0
    assert "max_age 100ms holds: 5ms to 78ms" in shown.output
    (chain,) = json.loads(CliRunner().invoke(explain, ["--chains", str(file), "--format", "json"]).output)["chains"]
    assert chain["requirements"][0] == {"word": "max_age", "limit": "100ms", "holds": "yes"}
    assert chain["steps"][1]["waits"] == {"at_least": "0s", "at_most": "50ms"}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("20ms", (20 * MS, 20 * MS)),
        ("<=20ms", (0, 20 * MS)),
        ("<= 20 ms", (0, 20 * MS)),
        (">=5ms", (5 * MS, None)),
        ("5ms..20ms", (5 * MS, 20 * MS)),
        ("5ms..infinite", (5 * MS, None)),
    ],
)
def test_ranges_that_can_be_read(text, found):
    assert read_range(text) == found
    assert INFINITE not in found


@pytest.mark.parametrize(
    "text", ["", "20", "20ms..5ms", "20ms..", "..20ms", "<=5ms..20ms", "<20ms", "-1ms", "infinite"]
)
def test_ranges_that_cannot_be_read(text):
    with pytest.raises(InvalidValueError, match="expected a range of durations"):
        read_range(text)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("- lidar", "- {topic: /scan}", "a step of a chain needs `at`"),
        ("max_age:", "max_agee:", "a chain has no key `max_agee`"),
        ("latency: <=5ms", "latencies: <=5ms", "a step of a chain has no key `latencies`"),
        ("    steps:\n", "    step:\n", "a chain has no key `step`; did you mean `steps`?"),
        ("    steps:\n", "    places:\n", "a chain needs `steps`"),
    ],
)
def test_the_form_is_strict(old, new, said):
    with pytest.raises(InputError) as refused:
        read(changed((old, new)))
    assert any(said in problem.message for problem in refused.value.problems)
