"""The mobile robot: every marked mistake is found, each fixed line removes its findings, and no other finding is loud."""

import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import cqos_core as cqos

HERE = Path(__file__).parent
ROBOT = HERE.parents[1] / "examples" / "mobile_robot.yaml"
GOLDEN = HERE / "mobile_robot.findings.txt"
TEXT = ROBOT.read_text(encoding="utf-8")

# Number of a mistake to the wrong text in its line, and the right one.
FIXES = {
    1: ("deadline: 5ms", "deadline: 20ms"),
    2: ("/image_raw:", "image_raw:"),
    3: (", deadline: 40ms", ""),
    4: ("odom:", "odometry/filtered:"),
    5: ("TwistStamped", "Twist"),
    6: ("{depth: 10}", "sensor_data"),
    7: (", lifespan: 200ms", ""),
    8: ("latched", "tf_static_listener"),
    9: ("system_default", "transient_local"),
    10: ("latched", "latest"),
    11: ("profile: latched, ", ""),
    12: (", deadline: 200ms", ""),
    13: ("{liveliness: manual_by_topic, lease_duration: 1s}", "default"),
    14: ("7", "0"),
    15: ("{depth: 100, reliability: reliable}", "tf_static_listener"),
    16: ("{depth: 0}", "default"),
    17: ("volatile", "transient_local"),
    18: ("reliability: reliable", "reliability: best_effort"),
    19: ("depth: 1", "depth: 5"),
    20: ("best_effort", "reliable"),
    21: ("best_available", "{profile: best_available, starts_after: base_controller}"),
}


class Mistake(NamedTuple):
    """A comment `# MISTAKE n: … (CODE, …)`, and the number of the line below it."""

    line: int
    codes: frozenset[str]


def marked(text):
    """All marked mistakes by number."""
    found = {}
    lines = text.splitlines()
    for number, line in enumerate(lines, start=1):
        if "MISTAKE" in line:
            match = re.fullmatch(r" *# MISTAKE (\d+): .+ \(([A-Z]+\d+(?:, [A-Z]+\d+)*)\)", line)
            assert match, f"line {number} is not in the form of the others: {line.strip()}"
            found[int(match[1])] = Mistake(number + 1, frozenset(match[2].split(", ")))
    return found


MISTAKES = marked(TEXT)


def lines_of(finding):
    """Every line that a finding points to."""
    places = [place for side in finding.sides for place in (side.place, *(fact.place for fact in side.facts))]
    return {place.line for place in places if place is not None}


def loud(report):
    """Errors and warnings."""
    return [finding for finding in report.findings if finding.severity is not cqos.Severity.NOTE]


def fix(text, *numbers):
    lines = text.splitlines()
    for number in numbers:
        old, new = FIXES[number]
        index = MISTAKES[number].line - 1
        assert lines[index].count(old) == 1
        lines[index] = lines[index].replace(old, new)
    return "\n".join(lines).encode()


def identity(finding):
    return finding.severity, finding.code, finding.endpoints


def written(report):
    """One line per finding: severity, code, endpoints."""
    return "".join(f"{f.severity} {f.code} {' '.join(f.endpoints)}".rstrip() + "\n" for f in report.findings)


def test_the_findings_are_exactly_these():
    report = cqos.check(ROBOT)
    assert written(report) == GOLDEN.read_text(encoding="utf-8")
    assert report.verdict == "incompatible"
    assert report.endpoints >= 60


def test_every_mistake_is_found_and_everything_else_is_a_note():
    report = cqos.check(ROBOT)
    expected = {(mistake.line, code) for mistake in MISTAKES.values() for code in mistake.codes}
    found = set()
    for finding in report.findings:
        here = {(line, finding.code) for line in lines_of(finding)} & expected
        assert here or finding.severity is cqos.Severity.NOTE, finding.message
        found |= here
    assert found == expected


def test_mistakes_are_numbered_one_after_the_other():
    assert list(MISTAKES) == list(range(1, len(MISTAKES) + 1))
    assert set(FIXES) == set(MISTAKES)


@cache
def all_found():
    return {identity(finding): finding.code for finding in cqos.check(TEXT.encode()).findings}


@pytest.mark.parametrize("number", MISTAKES)
def test_a_fixed_line_removes_exactly_its_own_findings(number):
    before = all_found()
    after = {identity(finding) for finding in loud(cqos.check(fix(TEXT, number)))}
    gone = {code for key, code in before.items() if key not in after and key[0] is not cqos.Severity.NOTE}
    assert gone == {code for code in MISTAKES[number].codes if code != "ROS311"}
    assert after <= set(before)


@pytest.mark.parametrize("rmw", ["", "cyclonedds", "fastdds", "connext"])
def test_without_its_mistakes_the_robot_is_clean(rmw):
    options = {"ros2": {"rmw": rmw}} if rmw else {}
    report = cqos.check(fix(TEXT, *MISTAKES), options=options)
    assert [finding.message for finding in loud(report)] == []
    assert "ROS311" not in {finding.code for finding in report.findings}
    assert report.verdict == "compatible"
