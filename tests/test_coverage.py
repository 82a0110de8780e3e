"""What a report says of its inputs: what was read, and what was not although it may decide."""

from __future__ import annotations

import json
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from cqos_core import InputError, Session, check, read
from cqos_core.formatters import phrases
from cqos_core.formatters.github import render_github
from cqos_core.formatters.json_report import report_from_json
from cqos_core.formatters.junit import render_junit
from cqos_core.formatters.markdown import render_markdown
from cqos_core.formatters.multi_system import combined_report
from cqos_core.formatters.sarif import render_sarif
from cqos_core.model.coverage import Coverage
from cqos_core.model.finding import Verdict, plural
from cqos_core.model.report import Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style
from cqos_core.model.system import Part
from cqos_pictures.page import render_html
from tests.command_process import run
from tests.modeler.drawings import CATCH, THROW, Event, Pool, drawing

ROOT = Path(__file__).parents[1]

FITTING = b"""cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
participants:
  a: {publishes: {/t: }}
  b: {subscribes: {/t: }}
"""
NODE = Part("node", "/slam", "no node file")


@pytest.mark.parametrize(
    ("covered", "percent"),
    [
        (Coverage(), 100),
        (Coverage(4), 100),
        (Coverage(4, unclear=("a",)), 75),
        (Coverage(4, unread=(NODE,)), 80),
        (Coverage(999, unread=(NODE,)), 99),  # 99.9 %, and not all
        (Coverage(4, unread=(Part("variable", "X", endpoints=0),)), 99),
        (Coverage(0, unread=(NODE,)), 0),
        (Coverage(0, unread=(Part("file", endpoints=0),)), 0),
        (Coverage(3, unclear=("a",), unread=(NODE, Part("include", endpoints=2))), 33),
    ],
)
def test_the_percentage_counts_endpoints_and_is_100_only_of_all(covered, percent):
    assert covered.percent == percent


def a_drawing(topic=None):
    """A publisher and a subscriber that fit, and an event that throws a topic; without any, its topic is an expression."""
    other = Event("Other", THROW, topic or "${next}")
    return drawing(Pool("A", (Event("Out", THROW, "weather"), other)), Pool("B", (Event("In", CATCH, "weather"),)))


def test_a_system_that_was_read_is_compatible_without_more_words():
    report = check(FITTING)
    assert report.verdict_words == "compatible"
    assert report.coverage == Coverage(2)
    assert str(report) == "compatible, 1 pair judged"


def test_a_system_of_which_something_was_not_read_is_compatible_as_far_as_read():
    report = check(a_drawing().encode())
    assert report.verdict_words == "compatible as far as read"
    assert [each.kind for each in report.coverage.unread] == ["event"]
    assert report.coverage.unclear == ("Other",)
    assert report.coverage.percent == 66
    assert str(report).startswith("<bytes>: compatible as far as read, 1 pair judged\n")


def test_an_endpoint_that_states_what_is_not_known_is_not_known_whole():
    report = check(FITTING.replace(b"{publishes: {/t: }}", b"{publishes: {/t: {reliability: often}}}"))
    assert report.coverage.unclear == ("a/publisher/t",)
    assert report.coverage.percent == 50


def test_the_command_says_it_on_the_total_line_and_lists_it(tmp_path):
    (tmp_path / "a.bpmn").write_text(a_drawing(), encoding="utf-8")
    (line,) = (each for each in run(["check", "a.bpmn"], tmp_path).out.splitlines() if "judged" in each)
    assert ": compatible as far as read: " in line
    assert line.endswith("; not read: 1 event (listed with --show coverage)")
    for form in ("text", "full", "concise"):
        listed = run(["check", "a.bpmn", "--show", "coverage", "--format", form], tmp_path).out
        assert "coverage: 66 %: 2 of 3 endpoints known whole\n" in listed
        assert "not read: event: the topic `${next}` is known at run time only" in " ".join(listed.split())
        assert "not known whole" not in listed  # which is said of the event already
        assert "--show coverage" not in listed


@pytest.mark.parametrize(
    ("topic", "required", "code"), [("rain", 100, 0), (None, 66, 0), (None, 67, 1), (None, 100, 1), (None, 0, 0)]
)
def test_a_run_may_require_a_share(tmp_path, topic, required, code):
    (tmp_path / "a.bpmn").write_text(a_drawing(topic), encoding="utf-8")
    done = run(["check", "a.bpmn", "--require-coverage", required], tmp_path)
    assert done.code == code
    told = f"a.bpmn: coverage is 66 %, less than the {required} % required"
    assert (told in done.err) is bool(code)


def test_json_has_it_and_gives_it_back(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.bpmn").write_text(a_drawing(), encoding="utf-8")
    written = run(["check", "a.bpmn", "--format", "json"], tmp_path).out
    found = json.loads(written)["coverage"]
    assert found["percent"] == 66
    assert [each["kind"] for each in found["unread"]] == ["event"]
    assert report_from_json(written).coverage == check("a.bpmn").coverage


def test_several_systems_have_one_coverage(tmp_path):
    (tmp_path / "a.bpmn").write_text(a_drawing(), encoding="utf-8")
    (tmp_path / "b.yaml").write_text(FITTING.decode(), encoding="utf-8")
    total = run(["check", "a.bpmn", "b.yaml", "--each"], tmp_path).out.splitlines()[-1]
    assert total.startswith("total: 2 systems: 1 compatible, 1 compatible as far as read: ")
    assert run(["check", "a.bpmn", "b.yaml", "--each", "--require-coverage", 66], tmp_path).code == 0
    done = run(["check", "a.bpmn", "b.yaml", "--each", "--require-coverage", 67], tmp_path)
    assert done.code == 1  # although 80 % of both together were read
    assert "a.bpmn: coverage is 66 %, less than the 67 % required" in done.err
    assert "b.yaml: coverage" not in done.err


def test_a_file_that_cannot_be_read_is_not_covered(tmp_path):
    (tmp_path / "a.yaml").write_text(FITTING.decode(), encoding="utf-8")
    (tmp_path / "b.yaml").write_text("cqos: 1\nparticipants: [\n", encoding="utf-8")
    done = run(["check", "a.yaml", "b.yaml", "--each", "--format", "json"], tmp_path)
    assert done.code == 2
    assert [each["kind"] for each in json.loads(done.out)["coverage"]["unread"]] == ["file"]


def test_an_event_that_was_not_read_hides_no_endpoint_of_another_system():
    event = Coverage(
        1, unclear=("Other",), unread=(Part("event", place=Place("a.bpmn", element="Other"), endpoints=0),)
    )
    parts = [Report(Verdict.COMPATIBLE, coverage=each) for each in (event, Coverage(1, unclear=("Other",)))]
    told = [*phrases.coverage(combined_report(parts))]
    assert told[1:] == ["not read: event (a.bpmn)", "not known whole: `Other`"]


def test_a_report_without_endpoints_says_that_it_has_none():
    report = Report(Verdict.UNKNOWN, coverage=Coverage(unread=(Part("file", "a.launch", endpoints=0),)))
    assert [*phrases.coverage(report)] == ["coverage: no endpoint was read", "not read: file `a.launch`"]


@pytest.mark.parametrize(
    ("noun", "many"),
    [("pair", "pairs"), ("process", "processes"), ("box", "boxes"), ("branch", "branches"), ("mesh", "meshes")],
)
def test_several_parts_of_a_kind_are_counted_in_english(noun, many):
    report = Report(Verdict.COMPATIBLE, coverage=Coverage(unread=(Part(noun, "a"), Part(noun, "b"))))
    assert phrases.not_read(report) == [f"2 {many}"]
    assert plural(1, noun) == f"1 {noun}"


def test_formats_without_the_option_list_what_was_not_read_or_only_count_it():
    report = check(a_drawing().encode())
    for listing in (render_markdown(report, Style()), render_junit(report, Style())):
        assert "not read: event: the topic" in unescape(listing)
        assert "--show coverage" not in listing
    assert render_github(report, Style()).endswith("; not read: 1 event\n")


def test_formats_list_nothing_where_all_was_read():
    report = check(FITTING)
    assert "coverage" not in render_markdown(report, Style()) + render_junit(report, Style())


def test_sarif_has_it():
    report = check(a_drawing().encode())
    (found,) = json.loads(render_sarif(report, Style()))["runs"]
    assert found["properties"]["verdict"] == "compatible"
    assert found["properties"]["verdictWords"] == "compatible as far as read"
    assert found["properties"]["coverage"] == report.coverage.to_dict()


WITHOUT_PACK = FITTING.replace(b"participants:", b"participants:\n  c: {protocol: nats, publishes: {u: , t: }}")


def test_endpoints_that_no_pack_judges_were_not_read():
    report = check(WITHOUT_PACK)
    assert report.verdict_words == "compatible as far as read"
    assert [(each.kind, each.name, each.cause) for each in report.coverage.unread] == [
        ("endpoint", "c/publisher/t", "no installed pack judges protocol `nats`"),
        ("endpoint", "c/publisher/u", "no installed pack judges protocol `nats`"),
    ]
    assert report.coverage.percent == 50


def test_endpoints_without_a_protocol_were_not_read():
    (part, other) = check(b"cqos: 1\nparticipants: {a: {publishes: {t: }}, b: {subscribes: {t: }}}").coverage.unread
    assert {part.cause, other.cause} == {"no protocol is stated"}


def test_a_session_has_it_too_as_endpoints_without_a_pack_come_and_go():
    session = Session(read(WITHOUT_PACK))
    judged, alone = session.system.endpoints[-1], session.system.endpoints[0]
    assert alone.participant == "c"
    for edit in (
        lambda: session.put(replace(judged, settings={})),
        lambda: session.remove(alone.id),
        lambda: session.put(replace(judged, label="again")),
        lambda: session.put(alone),
    ):
        edit()
        session.changes()
        assert session.report().coverage == check(session.system).coverage


def test_an_event_outside_of_every_process_is_an_endpoint_that_was_not_read():
    model = (
        '<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL"><bpmn:signal id="S" name="topic"/>'
        '<bpmn:startEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent></bpmn:definitions>'
    )
    assert [(each.kind, each.endpoints) for each in check(model.encode()).coverage.unread] == [("event", 1)]


def test_a_page_has_the_words_of_the_verdict_in_its_title():
    assert "<title>&lt;bytes&gt;: compatible as far as read" in render_html(check(a_drawing().encode()), Style())


DESCRIBED_IN_PART = b"""cqos: 1
protocol: ros2
participants:
  talker: {publishes: {chatter: {}}}
  listener: {subscribes: {chatter: {}}}
unread:
  - {kind: node, name: teleop, cause: its source is in another repository, endpoints: 3, total: 4}
  - {kind: node, name: rviz}
  - section
"""


def test_a_system_file_names_parts_that_it_does_not_describe():
    report = check(DESCRIBED_IN_PART)
    assert report.verdict_words == "compatible as far as read"
    assert [(each.kind, each.name, each.cause, each.endpoints) for each in report.coverage.unread] == [
        ("node", "teleop", "its source is in another repository", 3),
        ("node", "rviz", "", 1),
        ("section", "", "", 1),
    ]
    assert (report.coverage.percent, dict(report.coverage.totals)) == (28, {"node": 4})
    assert [(each.code, str(each.severity)) for each in report.findings] == [("CQ219", "note")] * 3


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ("{name: teleop}", "a part that is not described needs `kind`"),
        ("{kind: node, endpoints: -1}", "`endpoints` must be a whole number, found `-1`"),
        ("{kind: node, total: some}", "`total` must be a whole number, found `some`"),
    ],
)
def test_a_part_that_cannot_be_read_is_an_error(stated: str, message: str):
    with pytest.raises(InputError) as caught:
        check(f"cqos: 1\nprotocol: ros2\nunread: [{stated}]".encode())
    assert message in str(caught.value)


@pytest.mark.parametrize("design", ["incidents/moveit-joints", "incidents/turtle-best-effort"])
def test_a_system_file_made_from_a_launch_says_what_was_not_read(design: str, tmp_path: Path):
    folder = ROOT / "examples" / design
    inputs = [*sorted(map(str, folder.glob("*.yaml"))), str(folder / "src")]
    (package,) = (folder / "src").iterdir()
    (launch,) = (package / "launch").iterdir()
    options = ["--launch", f"{package.name}:{launch.name}", "--option", "ros2.distro=humble"]
    converted = tmp_path / "system.yaml"
    assert run(["convert", *inputs, *options, "--to", "yaml", "--output", str(converted)], tmp_path).code == 0
    before = json.loads(run(["check", *inputs, *options, "--together", "--format", "json"], tmp_path).out)["coverage"]
    after = json.loads(run(["check", str(converted), "--format", "json"], tmp_path).out)["coverage"]
    assert before["unread"]
    for each in (*before["unread"], *after["unread"]):
        del each["place"]
    assert after == before
