"""Reading a JSON report back where it is not what it should be, and its documentation."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from cqos_core.formatters.json_report import render_json, report_from_json
from cqos_core.model.coverage import Coverage
from cqos_core.model.finding import Verdict
from cqos_core.model.problems import CqosError
from cqos_core.model.report import Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style
from cqos_core.model.system import Part

DOCUMENTATION = Path(__file__).parent.parent.parent / "docs" / "json-report.md"
EXAMPLE = re.compile(r"(?<=```json\n).*?(?=```\n)", re.DOTALL)


def test_example_in_the_documentation_is_real(request, reports, style):
    # One finding and its group are enough to show every kind of object.
    whole = reports["realistic"]
    example = replace(
        whole,
        groups=whole.groups[1:2],
        findings=whole.findings[:1],
        not_checked=whole.not_checked[:1],
        endpoints=2,
        topics=1,
        coverage=Coverage(
            2, unread=(Part("node", "/slam", "no node file", Place("robot.launch.py", 8)),), totals={"node": 14}
        ),
    )
    text = DOCUMENTATION.read_text(encoding="utf-8")
    if request.config.getoption("--update-golden", default=False):
        text = EXAMPLE.sub(lambda _: render_json(example, style), text)
        DOCUMENTATION.write_text(text, encoding="utf-8")
    assert EXAMPLE.findall(text) == [render_json(example, style)]


def test_columns_found_in_the_source_are_written(reports, style):
    report = report_from_json(render_json(reports["diagram"], style))
    places = [fact.place for side in report.findings[0].sides for fact in side.facts]
    assert [str(place) for place in places] == [
        "smart.bpmn:6:3 (Station_CatchReq)",
        "smart.bpmn:4:103 (Drone_ThrowReq)",
    ]


def test_bytes_and_unknown_keys_are_read(any_report):
    document = json.loads(render_json(any_report, Style()))
    document["later"] = {"version": 2}
    assert report_from_json(json.dumps(document).encode()) == any_report


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "this is no JSON report"),
        ("[" * 100_000, "this is no JSON report"),
        (b"\xff", "this is no JSON report"),
        ("[]", "no object with a `version`"),
        ('{"runs": []}', "no object with a `version`"),
        ('{"version": 2}', "version 2, this C-QoS reads version 1"),
        ('{"version": true}', "`report.version` should be a whole number, found true"),
        ('{"version": 1}', "`report.counts` should be an object, found nothing"),
    ],
)
def test_what_is_no_report_is_refused(text, message):
    with pytest.raises(CqosError, match=re.escape(message)):
        report_from_json(text)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (
            ("verdict",),
            "fine",
            '`report.verdict` should be one of compatible, unknown, incompatible, found "fine"',
        ),
        (("groups",), {}, "`report.groups` should be a list of objects, found {}"),
        (("groups", 0), 1, "`report.groups[0]` should be an object, found 1"),
        (("sources",), [1], "`report.sources` should be a list of texts, found [1]"),
        (("findings", 0, "message"), None, "`report.findings[0].message` should be text, found nothing"),
        (("findings", 0, "pairs"), 1.5, "`report.findings[0].pairs` should be a whole number, found 1.5"),
        (("findings", 0, "remedies", 0, "role"), "broker", "should be one of publisher, subscriber"),
        (
            ("findings", 3, "worlds", "ros2.rmw=connext"),
            3,
            "worlds.ros2.rmw=connext` should be text, found 3",
        ),
        (
            ("findings", 0, "sides", 0, "facts", 0, "place", "line"),
            "x",
            "`report.findings[0].sides[0].facts[0].place.line` should be a whole number",
        ),
    ],
)
def test_a_damaged_report_is_refused_with_the_damaged_field(reports, path, value, message):
    document = json.loads(render_json(reports["realistic"], Style()))
    *parents, last = path
    node = document
    for key in parents:
        node = node[key]
    node[last] = value
    with pytest.raises(CqosError, match=re.escape(message)):
        report_from_json(json.dumps(document))


def test_half_characters_are_escaped():
    text = render_json(Report(Verdict.UNKNOWN, system="\udcff"), Style())
    assert '"system": "\\udcff"' in text
