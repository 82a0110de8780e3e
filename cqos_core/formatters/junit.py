"""JUnit XML, which CI dashboards read: a system is a suite, a topic is a test.

A test passes if its topic's pairs fit, fails with an error that stands, and is skipped where neither can be said:
the verdict is unknown, or what does not fit was accepted. So nothing is green that was not found to fit.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as ET

from cqos_core.formatters import wording
from cqos_core.formatters.places import Places

# XML has no way to write most control characters; this spells them.
from cqos_core.formatters.terminal import clean
from cqos_core.model.report import Severity, Verdict

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.model.report import Finding, Report
    from cqos_core.model.style import Style

_COUNTED: Final = ("tests", "failures", "errors", "skipped")


def render_junit(report: Report, style: Style) -> str:
    """Return the report as a JUnit document, with a test suite for each system that was checked by itself."""
    suites = ET.Element("testsuites")
    parts = report.parts or (report,)
    alike = Counter(map(wording.heading, parts))
    for part in parts:
        name = wording.heading(part)
        # Dashboards put together what has one name.
        apart = f" ({part.sources[0]})" if name and alike[name] > 1 and part.sources else ""
        _add_suite(suites, clean(f"{name}{apart}" or "C-QoS"), part, style)
    for name in _COUNTED:
        suites.set(name, str(sum(int(suite.attrib[name]) for suite in suites)))
    ET.indent(suites)
    text = ET.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _add_suite(suites: ET.Element, name: str, report: Report, style: Style) -> None:
    suite = ET.SubElement(suites, "testsuite", name=name)
    cases = _Cases(suite, report, style)
    cases.add_all()
    failures, skipped = (len(suite.findall(f"testcase/{kind}")) for kind in ("failure", "skipped"))
    suite.attrib |= dict(zip(_COUNTED, map(str, (len(suite), failures, 0, skipped)), strict=True))
    counts = [
        wording.counts(report, style),
        *wording.assumed(report),
        *(f"not checked: {item}" for item in report.not_checked),
    ]
    ET.SubElement(suite, "system-out").text = _lines(
        [f"{report.verdict}{wording.beside(report)}: {counts[0]}", *counts[1:]]
    )


class _Cases:
    """Adds test cases to a suite: one for each topic, one for each rule that spoke of no topic."""

    def __init__(self, suite: ET.Element, report: Report, style: Style) -> None:
        self._suite = suite
        self._class = suite.attrib["name"]
        self._places = Places(report.findings, style.sources)
        self._show = style.show
        self._verdicts: dict[str, Verdict] = {}
        self._findings: dict[str, list[Finding]] = {}
        for group in report.groups:
            known = self._verdicts.get(group.topic, Verdict.COMPATIBLE)
            self._verdicts[group.topic] = max(known, group.verdict, key=lambda verdict: verdict.rank)
        for finding in report.findings:
            for name in _tests(finding):
                self._findings.setdefault(name, []).append(finding)

    def add_all(self) -> None:
        """Topics with pairs first, in their order, then what only findings speak of."""
        for name in dict.fromkeys([*self._verdicts, *self._findings]):
            self._add(name)

    def _add(self, name: str) -> None:
        case = ET.SubElement(self._suite, "testcase", classname=self._class, name=clean(name))
        findings = self._findings.get(name, [])
        errors = [finding for finding in findings if _stands_as_error(finding)]
        verdict = self._verdicts.get(name, Verdict.COMPATIBLE)
        if errors:
            self._fail(case, errors)
        elif verdict is not Verdict.COMPATIBLE:
            ET.SubElement(case, "skipped", message=clean(_reason(verdict, findings)))
        others = [f for f in findings if not _stands_as_error(f) and f.severity.rank <= self._show.rank]
        if others:
            ET.SubElement(case, "system-out").text = _lines(map(self._line, others))

    def _fail(self, case: ET.Element, errors: list[Finding]) -> None:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        message = clean(errors[0].message + more)
        failure = ET.SubElement(case, "failure", message=message, type=clean(errors[0].code))
        lines = [line for error in errors for line in (self._line(error), *map(_indented, wording.helps(error)))]
        failure.text = _lines(lines)

    def _line(self, finding: Finding) -> str:
        place = "" if finding.place is None else f"{wording.position(self._places.exact(finding.place))}: "
        accepted = "" if finding.accepted is None else f" (accepted: {finding.accepted})"
        return f"{place}{finding.severity}[{finding.code}] {finding.message}{accepted}"


def _stands_as_error(finding: Finding) -> bool:
    return finding.severity is Severity.ERROR and finding.accepted is None


def _tests(finding: Finding) -> list[str]:
    """Names of the tests a finding belongs to."""
    topics = [topic for topic in (finding.topic, *finding.more_topics) if topic is not None]
    return topics or [f"{finding.code} {finding.name}"]


def _reason(verdict: Verdict, findings: Iterable[Finding]) -> str:
    accepted = [finding.accepted for finding in findings if finding.accepted is not None]
    if accepted:
        return f"{verdict}, accepted: {'; '.join(dict.fromkeys(accepted))}"
    causes = [finding.message for finding in findings if finding.verdict is verdict]
    return f"{verdict}: {'; '.join(causes)}" if causes else str(verdict)


def _indented(sentence: str) -> str:
    return f"  help: {sentence}"


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(map(clean, lines))
