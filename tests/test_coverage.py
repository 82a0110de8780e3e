"""What a report says of its inputs: what was read, and what was not although it may decide."""

from __future__ import annotations

import json

import pytest

from cqos_core import check
from cqos_core.formatters.json_report import report_from_json
from cqos_core.model.coverage import Coverage
from cqos_core.model.system import Part
from tests.command import run
from tests.modeler.drawings import CATCH, THROW, Event, Pool, drawing

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
        assert "not known whole: `Other`" in listed


@pytest.mark.parametrize(
    ("topic", "required", "code"), [("rain", 100, 0), (None, 66, 0), (None, 67, 1), (None, 100, 1), (None, 0, 0)]
)
def test_a_run_may_require_a_share(tmp_path, topic, required, code):
    (tmp_path / "a.bpmn").write_text(a_drawing(topic), encoding="utf-8")
    done = run(["check", "a.bpmn", "--require-coverage", required], tmp_path)
    assert done.code == code
    told = f"coverage is 66 %, less than the {required} % required"
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
    assert run(["check", "a.bpmn", "b.yaml", "--each", "--require-coverage", 80], tmp_path).code == 0
    assert run(["check", "a.bpmn", "b.yaml", "--each", "--require-coverage", 81], tmp_path).code == 1


def test_a_file_that_cannot_be_read_is_not_covered(tmp_path):
    (tmp_path / "a.yaml").write_text(FITTING.decode(), encoding="utf-8")
    (tmp_path / "b.yaml").write_text("cqos: 1\nparticipants: [\n", encoding="utf-8")
    done = run(["check", "a.yaml", "b.yaml", "--each", "--format", "json"], tmp_path)
    assert done.code == 2
    assert [each["kind"] for each in json.loads(done.out)["coverage"]["unread"]] == ["file"]
