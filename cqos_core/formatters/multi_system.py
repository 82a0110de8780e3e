"""Combines the reports of several systems, and keeps findings about the configuration once."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.matching.pipeline import context
from cqos_core.model.coverage import Coverage, joined
from cqos_core.model.finding import Finding, Severity, Side, Verdict
from cqos_core.model.folder_suggestion import ProblemWithLines
from cqos_core.model.grouping import grouped
from cqos_core.model.report import Assumption, Report
from cqos_core.model.system import Part

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from cqos_core.model.problems import Problem

_UNUSED: Final = "CQ601"
_ABOUT_CONFIGURATION: Final = frozenset({_UNUSED, "CQ602", "CQ603", "CQ604"})


def without_repetition(reports: Sequence[Report], configurations: Sequence[Collection[str]]) -> list[Report]:
    """Return the reports with each finding about a configuration in the first one only.

    ``configurations`` are the configuration files of each report. An exception is unused only if no system under the
    configuration needs it.
    """
    alike = grouped(
        (frozenset(files), {_key(finding, files) for finding in report.findings})
        for report, files in zip(reports, configurations, strict=True)
    )
    said = set()
    kept = []
    for report, files in zip(reports, configurations, strict=True):
        everywhere = set.intersection(*alike[frozenset(files)])
        findings = []
        for finding in report.findings:
            key = _key(finding, files)
            if key is None or (key not in said and (finding.code != _UNUSED or key in everywhere)):
                findings.append(finding)
                said.add(key)
        kept.append(replace(report, findings=tuple(findings)))
    return kept


def _key(finding: Finding, configuration: Collection[str]) -> tuple[str, str] | None:
    """Return the identity of a finding about a configuration; None for any other finding."""
    place = finding.place
    if finding.code not in _ABOUT_CONFIGURATION or (place is not None and place.source not in configuration):
        return None
    return finding.code, f"{place} {finding.message}"


def combined_report(reports: Sequence[Report], problems: Sequence[Problem] = ()) -> Report:
    """Combine the reports of separate systems into one; inputs that could not be read become findings.

    The verdict is the worst one, and never ``compatible`` if an input was not read.
    """
    if len(reports) == 1 and not problems:
        return reports[0]
    verdicts = [report.verdict for report in reports]
    if problems or not verdicts:
        verdicts.append(Verdict.UNKNOWN)
    unread = tuple(map(_finding, problems))
    parts = (_unreadable(unread, problems),) if problems else ()
    return Report(
        verdict=max(verdicts, key=lambda verdict: verdict.rank),
        groups=tuple(group for report in reports for group in report.groups),
        findings=(*unread, *(finding for report in reports for finding in report.findings)),
        not_checked=tuple(dict.fromkeys(text for report in reports for text in report.not_checked)),
        system=reports[0].system if len(reports) == 1 else "",
        sources=tuple(dict.fromkeys(_sources(reports, problems))),
        endpoints=sum(report.endpoints for report in reports),
        topics=sum(report.topics for report in reports),
        partial=bool(reports) and all(report.partial for report in reports),
        unmatched=sum(report.unmatched for report in reports),
        hypothetical=sum(report.hypothetical for report in reports),
        parts=(*parts, *reports),
        assumed=_assumed(reports),
        coverage=joined(each.coverage for each in (*parts, *reports)),
    )


def _unreadable(findings: tuple[Finding, ...], problems: Sequence[Problem]) -> Report:
    """Return the report of inputs that could not be read."""
    files = tuple(dict.fromkeys(_sources((), problems)))
    left_out = tuple(Part("file", cause=each.message, place=each.place) for each in problems)
    return Report(Verdict.UNKNOWN, findings=findings, sources=files, coverage=Coverage(unread=left_out))


def _assumed(reports: Sequence[Report]) -> tuple[Assumption, ...]:
    """Return the assumptions of the reports; an option has the values that all reports with it share."""
    found: dict[str, tuple[str, ...]] = {}
    for each in (assumed for report in reports for assumed in report.assumed):
        known = found.get(each.option, each.values)
        found[each.option] = tuple(value for value in known if value in each.values)
    return tuple(Assumption(option, found[option]) for option in sorted(found))


def _sources(reports: Iterable[Report], problems: Iterable[Problem]) -> Iterator[str]:
    for report in reports:
        yield from report.sources
    for problem in problems:
        if problem.place is not None:
            yield problem.place.source


def _finding(problem: Problem) -> Finding:
    info = context().find_rule(problem.code)
    return Finding(
        code=problem.code,
        name=info.name if info is not None else "unreadable-input",
        severity=Severity.ERROR,
        message=problem.message,
        sides=(Side("system", (), place=problem.place),),
        help="\n".join((problem.help or "", *problem.lines)) if isinstance(problem, ProblemWithLines) else problem.help,
    )
