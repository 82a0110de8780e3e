"""The format ``rdjson``: the Reviewdog Diagnostic Format, which reviewdog shows in reviews of any forge.

Columns count bytes of UTF-8: https://github.com/reviewdog/reviewdog/tree/master/proto/rdf
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters import phrases
from cqos_core.formatters.json_report import dump
from cqos_core.formatters.places import Places, relative
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.finding import Severity

if TYPE_CHECKING:
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style

_SEVERITIES: Final = {Severity.ERROR: "ERROR", Severity.WARNING: "WARNING", Severity.NOTE: "INFO"}
_MOST_FIXED: Final = 200  # findings: for each fix its file is read again

Json = dict[str, Any]


def render_rdjson(report: Report, style: Style) -> str:
    """Return one diagnostic for each finding that is not accepted, with its fix if that changes one place in its file."""
    findings = [finding for finding in phrases.shown(report, style) if finding.accepted is None]
    writer = _Diagnostics(Places(findings, style.sources), style, next(iter(report.sources), ""))
    listed = [writer.diagnostic(each, fixed=number < _MOST_FIXED) for number, each in enumerate(findings)]
    address = {"url": style.documentation} if style.documentation else {}
    return dump({"source": {"name": "C-QoS", **address}, "diagnostics": listed}, indent=2) + "\n"


class _Diagnostics:
    """Writes the diagnostics of one report; those without a place refer to the file ``whole``."""

    def __init__(self, places: Places, style: Style, whole: str) -> None:
        self._places = places
        self._style = style
        self._whole = whole
        self._lines: dict[str, Lines] = {}

    def diagnostic(self, finding: Finding, *, fixed: bool) -> Json:
        """Return the diagnostic of a finding."""
        url = self._style.rule_url(finding.code)
        suggestions = self._suggestions(finding) if fixed else []
        return {
            "message": phrases.message_and_helps(finding),
            "location": self._location(finding.place),
            "severity": _SEVERITIES[finding.severity],
            "code": {"value": finding.code, **({"url": url} if url else {})},
            **({"suggestions": suggestions} if suggestions else {}),
        }

    def _location(self, place: Place | None) -> Json:
        if place is None:
            return {"path": relative(self._whole, self._style)}
        exact = self._places.exact(place)
        path = {"path": relative(place.source, self._style)}
        if exact.line is None:
            return path
        start: Json = {"line": exact.line}
        if exact.column is not None:
            before = self._text(place.source).line(exact.line)[: exact.column - 1]
            start["column"] = 1 + (_bytes(before) if before else exact.column - 1)
        return {**path, "range": {"start": start}}

    def _suggestions(self, finding: Finding) -> list[Json]:
        """Return the fix that ``cqos check --fix`` would take, if it replaces one text in the file of the finding."""
        source = "" if finding.place is None else finding.place.source
        remedy = next((each for each in finding.remedies if each.is_automatic), None)
        replaced = self._style.replaced(remedy.edits) if remedy is not None else {}
        if list(replaced) != [source] or len(replaced[source]) != 1:
            return []
        [(start, end, text)] = replaced[source]
        return [{"range": {"start": self._position(source, start), "end": self._position(source, end)}, "text": text}]

    def _position(self, source: str, offset: int) -> Json:
        lines = self._text(source)
        line, column = lines.position(offset)
        return {"line": line, "column": 1 + _bytes(lines.line(line)[: column - 1])}

    def _text(self, source: str) -> Lines:
        if source not in self._lines:
            self._lines[source] = Lines(decode(self._style.sources.get(source, b"")))
        return self._lines[source]


def _bytes(text: str) -> int:
    return len(text.encode("utf-8", "surrogatepass"))
