"""Converts findings and problems to diagnostics, with the other places as related information."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

from lsprotocol.types import (
    CodeDescription,
    Diagnostic,
    DiagnosticRelatedInformation,
    DiagnosticSeverity,
    Location,
)
from pygls.uris import from_fs_path

from cqos_core.files.source_files import read_path
from cqos_core.formatters import phrases
from cqos_core.model.finding import Severity
from cqos_core.model.problems import InputError
from cqos_lsp.positions import START, located

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.model.finding import Finding, Side
    from cqos_core.model.problems import Problem
    from cqos_core.model.settings import Place
    from cqos_lsp.document_checks import Analysis, CheckResult, Texts
    from cqos_lsp.positions import Units

SOURCE: Final = "cqos"
_SEVERITIES: Final = {
    Severity.ERROR: DiagnosticSeverity.Error,
    Severity.WARNING: DiagnosticSeverity.Warning,
    Severity.NOTE: DiagnosticSeverity.Hint,
}
_MOST_RELATED: Final = 20
_NOTES: Final = "notes"


def uri_of(path: str, known: Mapping[str, str] = {}) -> str:
    """Return the URI of a file: that of the client, if it is ``known`` by real path, else one from the path."""
    return known.get(os.path.realpath(path)) or from_fs_path(os.path.abspath(path)) or path  # noqa: PTH100 - a link keeps its name


def shown_findings(analysis: Analysis, *, notes: bool) -> list[Finding]:
    """Return the findings to show: errors and warnings that are not accepted, and notes if they are asked for."""
    notes = notes or _NOTES in analysis.project.config.show
    return [
        each
        for each in analysis.report.findings
        if each.accepted is None and (notes or each.severity is not Severity.NOTE)
    ]


def diagnostics_of(
    checked: CheckResult, texts: Texts, units: Units, *, notes: bool, documentation: str
) -> dict[str, list[Diagnostic]]:
    """Return all diagnostics by real path; a finding that several systems share is there once."""
    writer = _Writer(units, documentation)
    found: dict[str, dict[tuple[object, ...], Diagnostic]] = {}
    for analysis in checked.analyses:
        if checked.is_current(analysis):
            for finding in shown_findings(analysis, notes=notes):
                path, diagnostic = writer.finding(finding, analysis)
                found.setdefault(os.path.realpath(path), {}).setdefault(_key(diagnostic), diagnostic)
    for problem in checked.problems:
        path, diagnostic = writer.problem(problem, texts)
        found.setdefault(os.path.realpath(path), {}).setdefault(_key(diagnostic), diagnostic)
    return {path: [*by_key.values()] for path, by_key in found.items()}


def _key(diagnostic: Diagnostic) -> tuple[object, ...]:
    start = diagnostic.range.start
    return start.line, start.character, diagnostic.code, diagnostic.message


class _Writer:
    def __init__(self, units: Units, documentation: str) -> None:
        self._units = units
        self._documentation = documentation.rstrip("/")

    def finding(self, finding: Finding, analysis: Analysis) -> tuple[str, Diagnostic]:
        """Return the file of a finding, and its diagnostic."""
        sources = analysis.sources
        place = finding.place
        diagnostic = Diagnostic(
            range=self._units.of(place, sources),
            message="\n".join(_sentences(finding)),
            severity=_SEVERITIES[finding.severity],
            code=finding.code,
            code_description=self._description(finding.code),
            source=SOURCE,
            related_information=[*self._related(finding, place, sources)][:_MOST_RELATED],
        )
        return place.source if place is not None and place.source in sources else analysis.files[0], diagnostic

    def problem(self, problem: Problem, texts: Texts) -> tuple[str, Diagnostic]:
        """Return the file of a problem, and its diagnostic."""
        place = problem.place
        name = "" if place is None else place.source
        message = problem.message if problem.help is None else f"{problem.message}\nhelp: {problem.help}"
        diagnostic = Diagnostic(
            range=START if place is None else self._units.of(place, _source_of(name, texts)),
            message=message,
            severity=DiagnosticSeverity.Error,
            code=problem.code,
            code_description=self._description(problem.code),
            source=SOURCE,
        )
        return name, diagnostic

    def _description(self, code: str) -> CodeDescription | None:
        return CodeDescription(f"{self._documentation}/rules/{code}") if self._documentation else None

    def _related(
        self, finding: Finding, shown: Place | None, sources: Mapping[str, bytes]
    ) -> Iterator[DiagnosticRelatedInformation]:
        """Yield the other places of a finding, each with its values."""
        seen = {located(shown, sources)}
        for side in finding.sides:
            for place, text in _stated(side):
                found = located(place, sources)
                if found is not None and found not in seen:
                    seen.add(found)
                    location = Location(uri_of(found[0]), self._units.of(place, sources))
                    yield DiagnosticRelatedInformation(location, text)


def _stated(side: Side) -> Iterable[tuple[Place | None, str]]:
    """Return the places of the stated values of a side with texts; without any, the place of the side."""
    facts = [fact for fact in side.facts if fact.place is not None and fact.origin != "default"]
    if not facts:
        values = ", ".join(f"{fact.policy} {phrases.value(fact)}" for fact in side.facts)
        return [(side.place, ": ".join(filter(None, [f"{side.role} `{side.name}`", values])))]
    return [
        (fact.place, f"{phrases.label(side.label, fact) or side.role}: {fact.policy} {phrases.value(fact)}")
        for fact in facts
    ]


def _sentences(finding: Finding) -> Iterator[str]:
    yield finding.message
    if finding.because:
        yield f"why: {finding.because}"
    if finding.help is not None:
        yield f"help: {finding.help}"
    yield from (f"note: {note}" for note in finding.notes)


def _source_of(name: str, texts: Texts) -> dict[str, bytes]:
    """Return the open text of a file, else its content, by its name."""
    data = texts.get(os.path.realpath(name))
    if data is None:
        try:
            data = read_path(name).data
        except InputError:
            return {}
    return {name: data}
