"""SARIF: links to rules, and paths that fit a repository."""

import json
from functools import partial

import pytest

from cqos_core import check
from cqos_core.files.edited_files import replacements_of
from cqos_core.formatters.sarif import render_sarif
from cqos_core.model.finding import Fact, Finding, Severity, Side, Verdict
from cqos_core.model.report import Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style
from tests.command_process import run as command


def run(style, source="/repo/a/b.yaml"):
    side = Side("publisher", ("p",), place=Place(source, 1, 1))
    finding = Finding("X101", "a-rule", Severity.ERROR, "m", sides=(side,), because="it breaks", clause="Y 1.2")
    (found,) = json.loads(render_sarif(Report(Verdict.UNKNOWN, findings=(finding,), sources=(source,)), style))["runs"]
    return found


def test_rules_link_to_the_documentation_where_there_is_one():
    (rule,) = run(Style(documentation="https://example.org/docs/"))["tool"]["driver"]["rules"]
    assert rule["helpUri"] == "https://example.org/docs/rules/X101"
    assert rule["help"]["markdown"] == "it breaks\n\nSee `cqos rule X101`.\n\nClause: Y 1.2"
    assert "helpUri" not in run(Style())["tool"]["driver"]["rules"][0]


def test_paths_below_the_folder_of_the_run_are_relative():
    for style, uri in ((Style(folder="/repo"), "a/b.yaml"), (Style(folder="/re"), "file:///repo/a/b.yaml")):
        found = run(style)
        assert found["artifacts"][0]["location"]["uri"] == uri
        assert found["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == uri


def test_fixes_are_changes_of_the_files(tmp_path):
    text = "cqos: 1\nprotocol: ros2\nparticipants:\n  a: {publishes: {/t: {reliability: best_effort}}}\n  b: {subscribes: {/t: }}\n"
    file = tmp_path / "a.yaml"
    file.write_text(text, encoding="utf-8")
    sources = {str(file): file.read_bytes()}
    style = Style(folder=str(tmp_path), sources=sources, replaced=partial(replacements_of, sources))
    (log,) = json.loads(render_sarif(check(file), style))["runs"]
    offer, request = log["results"][0]["fixes"]
    assert offer == {
        "description": {"text": "offer reliability `reliable` on a/publisher/t"},
        "artifactChanges": [
            {
                "artifactLocation": {"uri": "a.yaml"},
                "replacements": [
                    {
                        "deletedRegion": {"startLine": 4, "startColumn": 37, "endLine": 4, "endColumn": 48},
                        "insertedContent": {"text": "reliable"},
                    }
                ],
            }
        ],
    }
    (added,) = request["artifactChanges"][0]["replacements"]
    assert added["deletedRegion"] == {"startLine": 5, "startColumn": 23, "endLine": 5, "endColumn": 23}
    assert added["insertedContent"] == {"text": " {reliability: best_effort}"}
    assert request["description"]["text"].endswith("(asks for less)")


def test_without_files_there_are_no_fixes():
    assert "fixes" not in run(Style())["results"][0]


@pytest.mark.parametrize("origin", ["topic", "option", "convention of /tf", "settled by all endpoints"])
def test_a_value_that_no_end_states_is_offered_by_none(origin):
    place = Place("f.yaml", 1)
    fact = Fact("period", "1s", origin, Place("f.yaml", 2))
    side = Side("publisher", ("a",), "offered here", (fact, Fact("depth", "1", "explicit", place)), place)
    finding = Finding("X101", "a-rule", Severity.ERROR, "m", sides=(side,))
    text = render_sarif(Report(Verdict.INCOMPATIBLE, findings=(finding,)), Style())
    assert f"a: period 1s ({origin}), set here" in text.replace("from option", "option")


@pytest.mark.parametrize(
    ("behind", "entry", "kind"),
    [
        ("  # cqos: ignore[ROS101] known", "", "inSource"),
        ("", "accept: [{rule: ROS101, because: known}]\n", "external"),
    ],
)
def test_a_suppression_says_where_it_stands(tmp_path, behind, entry, kind):
    text = (
        f"cqos: 1\nprotocol: ros2\n{entry}participants:\n  a: {{publishes: {{t: {{reliability: best_effort}}}}}}\n"
        f"  b:\n    subscribes:\n      t: {{reliability: reliable}}{behind}\n"
    )
    (tmp_path / "system.yaml").write_text(text)
    done = command(["check", "system.yaml", "--format", "sarif"], tmp_path)
    [result] = [each for each in json.loads(done.out)["runs"][0]["results"] if each["ruleId"] == "ROS101"]
    assert result["suppressions"] == [{"kind": kind, "status": "accepted", "justification": "known"}]
