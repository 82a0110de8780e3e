"""The format ``junit``, for CI dashboards: a system is a suite, a topic is a test.

A test passes if its topic's pairs fit, fails with an error that stands, and is skipped where neither can be said:
the verdict is unknown, or what does not fit was accepted. So nothing is green that was not found to fit.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as ET

from cqos_core.formatters import phrases
from cqos_core.formatters.places import Places

# XML cannot hold most control characters, so they are spelled.
from cqos_core.formatters.terminal import clean
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style

_COUNTED: Final = ("tests", "failures", "errors", "skipped")


def render_junit(report: Report, style: Style) -> str:
    """Return the report as a JUnit document, with a test suite for each system that was checked by itself."""
    suites = ET.Element("testsuites")
    parts = report.parts or (report,)
    alike = Counter(map(phrases.heading, parts))
    for part in parts:
        name = phrases.heading(part)
        # Dashboards merge suites of one name.
        apart = f" ({part.sources[0]})" if name and alike[name] > 1 and part.sources else ""
        _add_suite(suites, clean(f"{name}{apart}" or "C-QoS"), part, style)
    for name in _COUNTED:
        suites.set(name, str(sum(int(suite.attrib[name]) for suite in suites)))
    ET.indent(suites)
    text = ET.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _add_suite(suites: ET.Element, name: str, report: Report, style: Style) -> None:
    """Add a suite with a test for each topic with pairs, and one for each other subject of findings."""
    suite = ET.SubElement(suites, "testsuite", name=name)
    verdicts: dict[str, Verdict] = {}
    for group in report.groups:
        known = verdicts.get(group.topic, Verdict.COMPATIBLE)
        verdicts[group.topic] = max(known, group.verdict, key=lambda verdict: verdict.rank)
    findings = grouped((test, finding) for finding in report.findings for test in _tests(finding))
    places = Places(report.findings, style.sources)
    for test in dict.fromkeys([*verdicts, *findings]):
        case = ET.SubElement(suite, "testcase", classname=name, name=clean(test))
        _fill(case, verdicts.get(test, Verdict.COMPATIBLE), findings.get(test, []), places, style)
    failures, skipped = (len(suite.findall(f"testcase/{kind}")) for kind in ("failure", "skipped"))
    suite.attrib |= dict(zip(_COUNTED, map(str, (len(suite), failures, 0, skipped)), strict=True))
    ET.SubElement(suite, "system-out").text = _lines(
        [
            f"{report.verdict_words}{phrases.beside(report)}: {phrases.counts(report, style, asks=False)}",
            *(phrases.coverage(report) if report.coverage.unread else ()),
            *phrases.assumed(report),
            *(f"not checked: {item}" for item in report.not_checked),
        ]
    )


def _fill(case: ET.Element, verdict: Verdict, findings: Sequence[Finding], places: Places, style: Style) -> None:
    """Add failure, skip reason and other findings to a test."""
    errors = [finding for finding in findings if _stands_as_error(finding)]
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        message = clean(errors[0].message + more)
        failure = ET.SubElement(case, "failure", message=message, type=clean(errors[0].code))
        failure.text = _lines(
            line for error in errors for line in (_line(error, places), *map(_indented, phrases.helps(error)))
        )
    elif verdict is not Verdict.COMPATIBLE:
        ET.SubElement(case, "skipped", message=clean(_reason(verdict, findings)))
    others = [f for f in findings if not _stands_as_error(f) and f.severity.rank <= style.show.rank]
    if others:
        ET.SubElement(case, "system-out").text = _lines(_line(finding, places) for finding in others)


def _line(finding: Finding, places: Places) -> str:
    place = "" if finding.place is None else f"{phrases.position(places.exact(finding.place))}: "
    accepted = "" if finding.accepted is None else f" (accepted: {finding.accepted})"
    return f"{place}{finding.severity}[{finding.code}] {finding.message}{accepted}"


def _stands_as_error(finding: Finding) -> bool:
    return finding.severity is Severity.ERROR and finding.accepted is None


def _tests(finding: Finding) -> list[str]:
    """Return the names of the tests that a finding belongs to."""
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
