"""The default form: short, nothing lost, one finding for one cause, many findings behind a summary."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from cqos_core import check
from cqos_core.files.edited_files import replacements_of
from cqos_core.formatters.causes import causes
from cqos_core.formatters.multi_system import combined_report
from cqos_core.formatters.phrases import shown
from cqos_core.formatters.text import render_text
from cqos_core.model.finding import Fact, Finding, Severity, Side, Verdict
from cqos_core.model.problems import InputError
from cqos_core.model.report import Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style
from cqos_core.testing import judge_case, load_cases
from tests.effort import EXPLORE

ROOT = Path(__file__).parents[2]
SYSTEMS = sorted(
    str(path.relative_to(ROOT))
    for folder in ("examples", "tests/cli/mistakes")
    for ending in ("yaml", "bpmn", "xml")
    for path in (ROOT / folder).rglob(f"*.{ending}")
)
CASES = {path: path.parents[2].name for path in sorted(ROOT.glob("plugins/*/tests/cases/*.yml"))}
PACKS = {"dds_full": "dds", "ros2": "ros2", "mqtt": "mqtt"}


@cache
def checked(path):
    """The report of a file, and the texts that it was made of; None of a file that is no system."""
    try:
        report = check(ROOT / path)
    except InputError:
        return None
    return report, {name: Path(name).read_bytes() for name in report.sources}


def style_of(sources, **changes):
    return Style(sources=sources, replaced=lambda edits: replacements_of(sources, edits), **changes)


def findings_in(text):
    """The blocks of a report that are findings."""
    heads = tuple(f"{severity}[" for severity in Severity)
    return [block.splitlines() for block in text.split("\n\n") if block.startswith(heads)]


def assert_short_and_complete(report, sources):
    """Every finding is short, and nothing that is wrong is out of reach."""
    style = style_of(sources, listed=True)
    text = render_text(report, style)
    blocks = findings_in(text)
    assert all(len(block) <= 8 for block in blocks)
    found = causes(shown(report, style), style)
    assert len(blocks) == len(found)
    for block, cause in zip(blocks, found, strict=True):
        assert block[0].startswith(f"{cause.first.severity}[{cause.first.code}]")
        assert all(finding.code in "\n".join(block) for finding in cause.findings)
    for code in {finding.code for cause in found for finding in cause.findings}:
        one = findings_in(render_text(report, replace(style, codes=(code.lower(),))))
        assert len(one) == len([each for each in report.findings if code in (each.code, *each.more_codes)])
    if not found and not report.partial:
        assert text.count("\n") == 1, "a correct design is one line"
    return text


@pytest.mark.parametrize("path", SYSTEMS)
def test_each_finding_of_an_example_is_short_and_none_is_out_of_reach(path):
    if (done := checked(path)) is not None:
        assert_short_and_complete(*done)


@pytest.mark.explored
@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_each_finding_of_a_case_is_short_and_none_is_out_of_reach(path):
    """Of each expectation the first case: what is written differs by rule and verdict, hardly by the values."""
    cases = load_cases(path, PACKS[CASES[path]])
    firsts = {case.content["expect"]: case for case in reversed(cases)}
    for case in cases if EXPLORE else firsts.values():
        result = judge_case(case)
        assert_short_and_complete(Report(result.verdict, findings=tuple(result.findings)), {})


def test_the_first_screen_of_many_findings_is_a_summary():
    report, sources = checked("examples/mobile_robot.yaml")
    text = render_text(report, style_of(sources))
    assert text.count("\n") <= 40
    for code in {finding.code for finding in report.findings if finding.severity is not Severity.NOTE}:
        assert f"  {code} " in text
    assert text.startswith("23 findings of 22 causes in ")
    assert ": 8 errors, 15 warnings\n" in text
    assert "`--show all`" in text
    assert len(findings_in(text)) >= 1


@pytest.mark.parametrize("listed", [False, True])
def test_colours_change_no_character(listed):
    report, sources = checked("examples/mobile_robot.yaml")
    plain = render_text(report, style_of(sources, listed=listed))
    colored = render_text(report, style_of(sources, listed=listed, color=True))
    assert "\x1b[1;31merror" in colored
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == plain


@pytest.mark.parametrize("width", [40, 60, 80, 200])
def test_a_finding_is_short_in_any_terminal(width):
    report, sources = checked("examples/mobile_robot.yaml")
    blocks = findings_in(render_text(report, style_of(sources, listed=True, width=width)))
    assert len(blocks) == 22
    assert all(len(block) <= 8 for block in blocks)


def test_the_summary_of_several_systems_names_their_files_and_the_gravest_finding():
    def part(name, severity):
        place = Place(f"fleet/{name}.yaml", 3)
        found = [
            Finding(f"{severity.upper()[0]}{n}", "bad", severity, "bad", sides=(Side("system", (), place=place),))
            for n in range(6)
        ]
        return Report(Verdict.UNKNOWN, findings=tuple(found), system=name)

    text = render_text(combined_report([part("a", Severity.WARNING), part("b", Severity.ERROR)]), Style())
    first, second, third, *_ = text.splitlines()
    assert first == "12 findings below fleet/: 6 errors, 6 warnings"
    assert second == "  in a.yaml 6, b.yaml 6"
    assert third.split() == ["error", "E0", "1", "bad", "b.yaml:3"]
    assert findings_in(text)[0][0] == "error[E0] bad: bad"
    assert "`--show E0`" in text
    assert text.splitlines()[-1].startswith("total: 2 systems: ")


def test_ten_findings_are_no_summary():
    findings = [Finding(f"X{n}", "bad-thing", Severity.ERROR, "a bad thing") for n in range(10)]
    few = render_text(Report(Verdict.UNKNOWN, findings=tuple(findings)), Style())
    assert len(findings_in(few)) == 10
    more = render_text(Report(Verdict.UNKNOWN, findings=(*findings, replace(findings[0], code="X10"))), Style())
    assert more.startswith("11 findings: 11 errors\n")


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("examples/smart_agriculture.bpmn", [["BP101", "BP101", "BP102", "BP102"]]),
        ("examples/incidents/fast-late-reader/system.yaml", [["DDS519", "DDS330"]]),
        (
            "examples/smart_agriculture_incompatible.bpmn",
            [["ROS101"], ["ROS104"], ["BP101", "BP101", "BP102", "BP102"]],
        ),
    ],
)
def test_one_cause_is_one_finding(path, expected):
    report, sources = checked(path)
    style = style_of(sources)
    assert [[each.code for each in cause.findings] for cause in causes(shown(report, style), style)] == expected


IGNORED = """cqos: 1
protocol: ros2
options: {ros2: {rmw: micro_ros}}
participants:
  a: {publishes: {/a: {deadline: 1s, liveliness: manual_by_topic}, /b: {deadline: 1s}}}
  b: {publishes: {/c: {deadline: 1s, liveliness: manual_by_topic}}}
  c: {subscribes: {/a: {}, /b: {}, /c: {}}}
"""
UNSET = """cqos: 1
protocol: ros2
participants:
  a: {publishes: {/a: {durability: system_default}, /b: {durability: system_default}}}
  b: {subscribes: {/a: {durability: transient_local}, /b: {durability: transient_local}}}
"""
PROFILE = """cqos: 1
protocol: ros2
profiles: {shared: {depth: 0}}
participants:
  a: {publishes: {/a: shared, /b: shared}}
  b: {subscribes: {/a: , /b: }}
"""
MISSPELT = """cqos: 1
protocol: ros2
participants:
  a: {publishes: {/a: {reliability: relaible}, /b: {durability: volatlie}}}
  b: {subscribes: {/a: , /b: }}
"""


NEEDING = """cqos: 1
protocol: mqtt
options: {mqtt: {outage: 1min, protocol_version: '5.0'}}
topics: {t: {period: 1s}}
participants:
  sensor: {client: {clean_start: false, session_expiry_interval: 3600}, publishes: {t: {qos: 1}}}
  viewer:
    client: {clean_start: false, session_expiry_interval: 3600}
    subscribes: {t: {qos: 1, taken_every: 0ms, needs: {loss_free: true, survives: [broker_stop]}}}
"""


@pytest.mark.parametrize(
    ("text", "code", "sizes"),
    [
        (IGNORED, "CQ205", [5]),
        (UNSET, "ROS102", [1]),  # the check itself puts them together
        (PROFILE, "ROS303", [2]),
        (MISSPELT, "CQ203", [1, 1]),
        (NEEDING, "MQTT416", [1]),
    ],
    ids=[
        "ignored by one middleware",
        "one option not set",
        "one line of a profile",
        "two mistakes",
        "two missing facts",
    ],
)
def test_findings_share_a_cause_or_not(text, code, sizes, tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(text)
    report = check(file)
    found = causes(shown(report, Style()), Style())
    assert [len(cause.findings) for cause in found if cause.first.code == code] == sizes


def test_what_to_write_is_the_line_of_the_file():
    report, sources = checked("examples/mobile_robot.yaml")
    text = render_text(report, style_of(sources))
    assert "\n  write: line 57: color/image_raw: {profile: sensor_data, reliability: reliable}\n" in text


def test_of_a_long_line_the_part_around_its_change_is_shown():
    line = "x" * 200 + " old " + "y" * 200
    fact = Fact("policy", "old", "explicit", Place("f", 1, 202))
    report = Report(Verdict.INCOMPATIBLE, findings=(_with_fix(fact),))
    style = Style(sources={"f": line.encode()}, replaced=lambda _: {"f": [(201, 204, "new")]}, width=60)
    (written,) = (each for each in render_text(report, style).splitlines() if "write:" in each)
    assert "xxx new yyy" in written
    assert len(written) <= 60


def _with_fix(fact):
    from cqos_core.model.finding import Edit, Remedy

    fix = Remedy(
        "publisher",
        ("a",),
        "policy",
        "new",
        "configuration",
        "offer new",
        edits=(Edit(fact.place, "policy", "old", "new"),),
    )
    return Finding(
        "X1", "bad", Severity.ERROR, "bad", sides=(Side("publisher", ("a",), "set", (fact,)),), remedies=(fix,)
    )
