"""The format ``sarif``: SARIF 2.1.0 for code scanning services."""

from __future__ import annotations

import os
import re
from itertools import islice
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from cqos_core.formatters import phrases
from cqos_core.formatters.fingerprint import fingerprint
from cqos_core.formatters.json_report import dump
from cqos_core.formatters.places import Places, relative
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.model.finding import Finding, Side
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style

_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_MEMBERS = 100  # of one finding: viewers show a few, and the JSON report has them all
_MOST_FIXED = 200  # findings: for each fix its file is read again

_IGNORES = re.compile(r"#\s*cqos:\s*ignore\[")

Json = dict[str, Any]


def render_sarif(report: Report, style: Style) -> str:
    """Return the report as a SARIF log with one run; accepted findings are suppressed results."""
    rules = _rules(report, style)
    numbers = {rule["id"]: number for number, rule in enumerate(rules)}
    places = Places(report.findings, style.sources)
    version = {"version": style.tool_version} if style.tool_version else {}
    run: Json = {
        "tool": {"driver": {"name": "C-QoS", **version, "rules": rules}},
        "columnKind": "unicodeCodePoints",
        "artifacts": [
            {"location": {"uri": uri}} for uri in dict.fromkeys(_uri(source, style) for source in report.sources)
        ],
        "results": [
            _Result(report, finding, places, style).build(numbers[finding.code], with_fixes=number < _MOST_FIXED)
            for number, finding in enumerate(report.findings)
        ],
        "properties": {
            "verdict": report.verdict.value,
            "verdictWords": report.verdict_words,
            "topics": report.topics,
            "pairs": report.pair_count,
            "notChecked": list(report.not_checked),
            "assumed": [*phrases.assumed(report)],
            "coverage": report.coverage.to_dict(),
        },
    }
    log = {"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}
    return dump(log, indent=2) + "\n"


def _rules(report: Report, style: Style) -> list[Json]:
    """Return a description of each rule, as far as its findings tell."""
    by_code = grouped((finding.code, finding) for finding in report.findings)
    return [_rule(code, findings, style) for code, findings in sorted(by_code.items())]


def _rule(code: str, findings: list[Finding], style: Style) -> Json:
    """Return what all findings of a code have in common; rules of a team share one code."""
    names = {finding.name for finding in findings}
    reasons = {finding.because for finding in findings if finding.because}
    name = names.pop() if len(names) == 1 else ""
    rule: Json = {"id": code}
    if name:
        rule |= {"name": name, "shortDescription": {"text": name.replace("-", " ")}}
    reason = [*reasons] if len(reasons) == 1 else []
    if reason:
        rule["fullDescription"] = {"text": reason[0]}
    clauses = sorted({finding.clause for finding in findings if finding.clause})
    help_lines = [f"See `cqos rule {code}`.", *(f"Clause: {clause}" for clause in clauses)]
    rule["help"] = {"text": "\n".join(help_lines), "markdown": "\n\n".join([*reason, *help_lines])}
    if url := style.rule_url(code):
        rule["helpUri"] = url
    return rule


def _uri(source: str, style: Style) -> str:
    """Return the URI of a file."""
    path = relative(source, style)
    escaped = quote(path.encode("utf-8", "surrogatepass"))
    if path.startswith("/"):
        return f"file://{escaped}"
    # The colon behind a drive letter must stay.
    return f"file:///{escaped.replace('%3A', ':', 1)}" if os.path.splitdrive(source)[0] else escaped


class _Result:
    """Builds the result for one finding."""

    def __init__(self, report: Report, finding: Finding, places: Places, style: Style) -> None:
        self._style = style
        self._report = report
        self._finding = finding
        self._places = places

    def build(self, rule_index: int, *, with_fixes: bool) -> Json:
        """Return the result, with the index of its rule."""
        finding = self._finding
        related = list(self._related())
        fixes = list(self._fixes()) if with_fixes else []
        return {
            "ruleId": finding.code,
            "ruleIndex": rule_index,
            "level": finding.severity.value,
            "message": {"text": phrases.message_and_helps(finding)},
            "locations": self._locations(),
            **({"relatedLocations": related} if related else {}),
            **({"fixes": fixes} if fixes else {}),
            "partialFingerprints": {"cqos/v1": fingerprint(finding)},
            # Once one result has this property, all of them must, and an empty list means not suppressed.
            "suppressions": self._suppressions(),
            "properties": {
                "topics": [topic for topic in (finding.topic, *finding.more_topics) if topic is not None],
                "verdict": None if finding.verdict is None else finding.verdict.value,
                "pairs": finding.pairs,
            },
        }

    def _suppressions(self) -> list[Json]:
        if self._finding.accepted is None:
            return []
        kind = "inSource" if self._accepted_beside() else "external"
        return [{"kind": kind, "status": "accepted", "justification": self._finding.accepted}]

    def _accepted_beside(self) -> bool:
        """Whether a comment at one of its places accepts the finding."""
        sources, reason = self._style.sources, self._finding.accepted or ""
        lines = (
            Lines(decode(sources[place.source])).line(place.line)
            for side in self._finding.sides
            for place in (side.place, *(fact.place for fact in side.facts))
            if place is not None and place.line is not None and place.source in sources
        )
        return any(_IGNORES.search(line) and reason in line for line in lines)

    def _locations(self) -> list[Json]:
        """Return the one location of the result; services refuse a result without any."""
        place = self._finding.place
        location: Json = {}
        if place is not None:
            location["physicalLocation"] = self._physical(place)
        elif len(self._report.sources) == 1:
            location["physicalLocation"] = {"artifactLocation": {"uri": _uri(self._report.sources[0], self._style)}}
        # Ids are unique in one source only, and names in a location must be unique.
        logical = list(islice(dict.fromkeys(self._logical(place)), _MEMBERS))
        if logical:
            location["logicalLocations"] = [{"fullyQualifiedName": name, "kind": kind} for name, kind in logical]
        return [location] if location else []

    def _logical(self, place: Place | None) -> Iterator[tuple[str, str]]:
        """Yield names and kinds of logical locations: the members of the first side, then the element."""
        yield from ((member, side.role) for side in self._finding.sides[:1] for member in side.members)
        if place is not None and place.element is not None:
            yield place.element, "element"

    def _physical(self, place: Place) -> Json:
        physical: Json = {"artifactLocation": {"uri": _uri(place.source, self._style)}}
        exact = self._places.exact(place)
        if exact.line is not None:
            physical["region"] = {"startLine": exact.line, **self._columns(place, exact.column)}
        return physical

    def _columns(self, place: Place, column: int | None) -> Json:
        if column is None:
            return {}
        excerpt = self._places.excerpt(place)
        return {"startColumn": column, **({"endColumn": column + excerpt.width} if excerpt else {})}

    def _fixes(self) -> Iterator[Json]:
        """Yield the fixes that change files, the best first."""
        for remedy in self._finding.remedies:
            replaced = self._style.replaced(remedy.edits) if remedy.edits else {}
            if replaced:
                yield {
                    "description": {"text": phrases.fix(remedy)},
                    "artifactChanges": [self._change(source, made) for source, made in replaced.items()],
                }

    def _change(self, source: str, made: Sequence[tuple[int, int, str]]) -> Json:
        lines = Lines(decode(self._style.sources[source]))
        return {
            "artifactLocation": {"uri": _uri(source, self._style)},
            "replacements": [
                {"deletedRegion": _region(lines, start, end), "insertedContent": {"text": text}}
                for start, end, text in made
            ],
        }

    def _related(self) -> Iterator[Json]:
        """Yield the other values and sides, each with its text."""
        main = self._finding.place
        stated = dict.fromkeys(stated for side in self._finding.sides for stated in _stated(side))
        others = [(place, text) for place, text in stated if place != main]
        for number, (place, text) in enumerate(others, 1):
            yield {"id": number, "physicalLocation": self._physical(place), "message": {"text": text}}


def _region(lines: Lines, start: int, end: int) -> Json:
    line, column = lines.position(start)
    last, behind = lines.position(end)
    return {"startLine": line, "startColumn": column, "endLine": last, "endColumn": behind}


def _stated(side: Side) -> Iterator[tuple[Place, str]]:
    who = phrases.listed(side.members) or side.role
    for fact in side.facts:
        if (place := fact.place or side.place) is not None:
            label = phrases.label(side.label, fact)
            yield place, f"{who}: {fact.policy} {phrases.value(fact)}{label and f', {label}'}"
    if not side.facts and side.place is not None:
        yield side.place, f"{who}{side.label and f', {side.label}'}"
