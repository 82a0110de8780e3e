"""``--format html``: one file that needs nothing else, with a picture of each system, its topics, findings and guarantees."""

from __future__ import annotations

import hashlib
from base64 import b64encode
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters import wording
from cqos_core.model.report import Severity, Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_pictures import tables
from cqos_pictures.drawing import drawn
from cqos_pictures.findings import MOST_FINDINGS, Findings
from cqos_pictures.graph import graph_of, usage
from cqos_pictures.picture import picture_of
from cqos_pictures.picture_parts import Picture, PicturedEnd
from cqos_pictures.template import data_file, rendered
from cqos_pictures.words import WORDS, counted, some, spoken, symbol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.report import Report
    from cqos_core.model.style import Style
    from cqos_pictures.graph import Key

_MOST_SYSTEMS: Final = 20
_BAR: Final = 600


def render_html(report: Report, style: Style) -> str:
    """Return a page with everything of the report that a person can take in; what is left out is counted."""
    parts = sorted(report.parts or (report,), key=lambda each: -each.verdict.rank)
    numbers = count(1)
    systems = [_system(each, style, numbers) for each in parts[:_MOST_SYSTEMS]]
    name = wording.heading(report) or (f"{len(parts)} systems" if report.parts else "report")
    sheet, script = data_file("style.css"), data_file("script.js")
    values = {
        "title": f"{name}: {report.verdict}",
        "name": name,
        **_head(report),
        "version": style.tool_version,
        "several": bool(report.parts),
        "systems": systems,
        "more_systems": _listed(parts[_MOST_SYSTEMS:]),
        "single": not report.parts,
        "style_hash": _hash(sheet),
        "script_hash": _hash(script),
    }
    # Both are ours, and hold no name of a system; everything else is escaped.
    page = rendered("page", values)
    return page.replace("/*style*/", sheet, 1).replace("/*script*/", script, 1)


def _hash(text: str) -> str:
    return b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _head(report: Report) -> dict[str, Any]:
    pairs = {each: sum(group.pairs for group in report.groups if group.verdict is each) for each in Verdict}
    total = sum(pairs.values())
    bars, at = [], 0.0
    for verdict in reversed(Verdict):
        width = _BAR * pairs[verdict] / total if total else 0
        if width:
            bars.append({"verdict": verdict.value, "x": f"{at:.1f}", "width": f"{max(width, 2):.1f}"})
        at += width
    return {
        "verdict": report.verdict.value,
        "symbol": symbol(report.verdict),
        "bars": bars,
        "pairs": [
            {"verdict": verdict.value, "count": f"{number:,}"} for verdict, number in reversed(pairs.items()) if number
        ],
        "tiles": list(_tiles(report)),
        "bar_text": ", ".join(f"{number:,} {verdict}" for verdict, number in pairs.items()) + " pairs",
    }


def _tiles(report: Report) -> Iterator[dict[str, str]]:
    counts = [(report.topics, "topic"), (report.endpoints, "endpoint"), (report.pair_count, "pair")]
    counts += [(report.count(severity), severity.value) for severity in Severity]
    accepted = sum(finding.accepted is not None for finding in report.findings)
    for number, noun in counts:
        kind = noun if noun in {*Severity} and number else "plain"
        yield {"count": f"{number:,}", "noun": noun if number == 1 else f"{noun}s", "kind": kind}
    if accepted:
        yield {"count": f"{accepted:,}", "noun": "accepted", "kind": "plain"}


def _listed(reports: list[Report]) -> list[dict[str, str]]:
    return [{"name": wording.heading(each), "verdict": each.verdict.value} for each in reports]


def _system(report: Report, style: Style, numbers: Iterator[int]) -> dict[str, Any]:
    """Return the data of one system."""
    checked = style.checked(report)
    picture = picture_of(report, *checked) if checked else _from_ids(report)
    used = usage(report, picture)
    # Owners and topics are pointed at by anchors, since names may hold anything.
    anchors: dict[Key, str] = {owner: f"p{next(numbers)}" for owner in sorted(used.owners)}
    anchors |= {("topic", topic): f"t{next(numbers)}" for topic in sorted(used.topics)}
    findings = Findings(report, style, next(numbers) * (MOST_FINDINGS + 1))
    table = tables.matrix(report, used, anchors, findings.of_topic())
    shown = {each["anchor"] for each in (*table["rows"], *table["columns"])}
    graph = graph_of(report, picture, used)
    required = tables.requirements(picture)
    data = findings.data()
    return {
        "anchor": f"s{next(numbers)}",
        "name": wording.heading(report) or "system",
        "sources": some(report.sources, 12),
        "partial": report.partial,
        "unmatched": report.unmatched,
        "assumed": [*wording.assumed(report)],
        "not_checked": [spoken(each) for each in report.not_checked],
        **_head(report),
        "graph": drawn(graph, {key: f"#{name}" for key, name in anchors.items() if name in shown}),
        "has_graph": bool(graph.nodes),
        "has_matrix": bool(table["rows"]),
        "matrix": table,
        "findings": data,
        "finding_count": len(report.findings),
        "findings_left": f"{len(report.findings) - len(data):,}" if len(report.findings) > len(data) else "",
        "severities": [
            {"severity": severity.value, "count": number}
            for severity in Severity
            if (number := sum(each.severity is severity for each in findings.shown))
        ],
        "required": required,
        "states_needs": (stated := any(path.needs for path in picture.paths)),
        "shows_kinds": bool(required) and not stated,
        "paths_left": counted(picture.left_out, "pair") if picture.left_out else "",
        "runs": tables.runs(picture),
        "has_runs": bool(picture.runs),
        "verdict_word": WORDS[report.verdict],
    }


def _from_ids(report: Report) -> Picture:
    """Return the picture of a report without its system: each endpoint for itself, or for the participant that its id names."""
    ends = {
        name: PicturedEnd(name, name.partition(f"/{role}/")[0], False, role, group.topic, group.protocol)
        for group in report.groups
        for role, names in ((PUBLISHER, group.publishers), (SUBSCRIBER, group.subscribers))
        for name in names
    }
    return Picture(tuple(ends.values()))
