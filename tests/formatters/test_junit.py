"""What a test of a topic comes to."""

from xml.etree import ElementTree as ET

import pytest

from cqos_core.formatters.junit import render_junit
from cqos_core.model.finding import Finding, Severity, Verdict
from cqos_core.model.report import Group, Report
from cqos_core.model.style import Style


def case(verdict, *findings):
    report = Report(verdict, (Group("t", ("p",), ("s",), verdict, "x"),), findings)
    [found] = ET.fromstring(render_junit(report, Style())).iter("testcase")  # noqa: S314 - our own text
    return [(part.tag, part.get("message")) for part in found]


def finding(severity=Severity.ERROR, verdict=None, accepted=None):
    return Finding("X101", "bad-thing", severity, "a bad thing", topic="t", verdict=verdict, accepted=accepted)


@pytest.mark.parametrize(
    ("verdict", "findings", "expected"),
    [
        (Verdict.COMPATIBLE, [], []),
        (Verdict.COMPATIBLE, [finding(Severity.NOTE)], []),
        (Verdict.COMPATIBLE, [finding(Severity.WARNING)], [("system-out", None)]),
        (Verdict.COMPATIBLE, [finding()], [("failure", "a bad thing")]),
        (Verdict.COMPATIBLE, [finding(), finding()], [("failure", "a bad thing (and 1 more)")]),
        (Verdict.UNKNOWN, [], [("skipped", "unknown")]),
        (
            Verdict.UNKNOWN,
            [finding(Severity.WARNING, Verdict.UNKNOWN)],
            [("skipped", "unknown: a bad thing"), ("system-out", None)],
        ),
        (
            Verdict.INCOMPATIBLE,
            [finding(Severity.NOTE, Verdict.INCOMPATIBLE)],
            [("skipped", "incompatible: a bad thing")],
        ),
        (
            Verdict.INCOMPATIBLE,
            [finding(accepted="we know")],
            [("skipped", "incompatible, accepted: we know"), ("system-out", None)],
        ),
    ],
)
def test_outcome(verdict, findings, expected):
    assert case(verdict, *findings) == expected


def test_systems_that_were_checked_apart_are_suites_of_their_own():
    def part(name, source, verdict, *findings):
        return Report(verdict, (Group("t", ("p",), ("s",), verdict, "x"),), findings, system=name, sources=(source,))

    parts = (
        part("robot", "a.yaml", Verdict.INCOMPATIBLE, finding()),
        part("robot", "b.yaml", Verdict.COMPATIBLE),
        part("", "c.yaml", Verdict.UNKNOWN),
    )
    groups = tuple(group for each in parts for group in each.groups)
    whole = Report(Verdict.INCOMPATIBLE, groups, parts[0].findings, parts=parts)
    document = ET.fromstring(render_junit(whole, Style()))  # noqa: S314 - our own text
    assert document.attrib == {"tests": "3", "failures": "1", "errors": "0", "skipped": "1"}
    outcomes = {
        (suite.get("name"), case.get("classname"), case.get("name")): [part.tag for part in case]
        for suite in document.iter("testsuite")
        for case in suite.iter("testcase")
    }
    names = ("robot (a.yaml)", "robot (b.yaml)", "c.yaml")
    assert outcomes == {
        (name, name, "t"): tags for name, tags in zip(names, (["failure"], [], ["skipped"]), strict=True)
    }
