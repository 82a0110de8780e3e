"""What a test of a topic comes to."""

from xml.etree import ElementTree as ET

import pytest

from cqos_core.formatters.junit import render_junit
from cqos_core.formatters.style import Style
from cqos_core.report import Finding, Group, Report, Severity, Verdict


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
