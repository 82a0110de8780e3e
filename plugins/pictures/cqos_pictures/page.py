"""``--format html``: one self-contained file with findings, graph, topics and guarantees of each system."""

from __future__ import annotations

import hashlib
from base64 import b64encode
from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters import phrases
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_pictures import tables
from cqos_pictures.anchors import Anchors, scopes
from cqos_pictures.findings import Findings
from cqos_pictures.graph import graph_of, is_wrong, stages, usage
from cqos_pictures.page_text import counted, first_names, state, symbol, text_pieces
from cqos_pictures.picture import picture_of
from cqos_pictures.picture_parts import Picture, PicturedEnd
from cqos_pictures.svg_graph import svg_graph
from cqos_pictures.template import data_file, render_template
from cqos_pictures.topics import listed, owner_entries, topic_entries

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.report import Report
    from cqos_core.model.style import Style
    from cqos_pictures.graph import DrawnGraph, Key, Usage

_MOST_SYSTEMS: Final = 20
_MOST_UNREAD: Final = 100
_ALL: Final = 100  # per cent
_BAR: Final = 600


def render_html(report: Report, style: Style) -> str:
    """Return the page of a report; parts beyond the bounds are counted."""
    parts = sorted(report.parts or (report,), key=lambda each: -each.verdict.rank)
    scope = scopes(parts)
    systems = [_system(each, style, Anchors(scope[id(each)])) for each in parts[:_MOST_SYSTEMS]]
    name = phrases.heading(report) or (f"{len(parts)} systems" if report.parts else "report")
    sheet, script = data_file("style.css"), data_file("script.js")
    values = {
        "title": f"{name}: {report.verdict_words}",
        "name": name,
        **_head(report),
        "version": style.tool_version,
        "several": bool(report.parts),
        "systems": systems,
        "more_systems": _listed(parts[_MOST_SYSTEMS:]),
        "single": not report.parts,
        "wrong": any(map(_is_wrong, parts)),
        "style_hash": _hash(sheet),
        "script_hash": _hash(script),
    }
    # Both are ours, and hold no name of a system; everything else is escaped.
    page = render_template("page", values)
    return page.replace("/*style*/", sheet, 1).replace("/*script*/", script, 1)


def _hash(text: str) -> str:
    return b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _is_wrong(report: Report) -> bool:
    return report.verdict is not Verdict.COMPATIBLE or any(map(is_wrong, report.findings))


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
        "verdict_words": report.verdict_words,
        "symbol": symbol(report.verdict),
        "bars": bars,
        "pairs": [
            {"verdict": verdict.value, "count": f"{number:,}"} for verdict, number in reversed(pairs.items()) if number
        ],
        "tiles": list(_tiles(report)),
        "bar_text": ", ".join(f"{number:,} {verdict}" for verdict, number in pairs.items()) + " pairs",
    }


def _tiles(report: Report) -> Iterator[dict[str, str]]:
    counts = [(number, severity.value) for severity in Severity if (number := report.count(severity))]
    counts += [(report.topics, "topic"), (report.endpoints, "endpoint"), (report.pair_count, "pair")]
    for number, noun in counts:
        kind = noun if noun in {*Severity} else "plain"
        yield {"count": f"{number:,}", "noun": noun if number == 1 else f"{noun}s", "kind": kind}
    if accepted := sum(finding.accepted is not None for finding in report.findings):
        yield {"count": f"{accepted:,}", "noun": "accepted", "kind": "plain"}


def _listed(reports: list[Report]) -> list[dict[str, str]]:
    return [
        {
            "name": phrases.heading(each),
            "verdict": each.verdict.value,
            "verdict_words": each.verdict_words,
            "state": state(wrong=_is_wrong(each)),
        }
        for each in reports
    ]


def _system(report: Report, style: Style, anchors: Anchors) -> dict[str, Any]:
    """Return the data of one system."""
    checked = style.checked(report)
    picture = picture_of(report, *checked) if checked else _from_ids(report)
    used = usage(report, picture)
    graph = graph_of(report, picture, used)
    own = {key: anchors.give(*key) for key in listed(used, {node.key for node in graph.nodes})}
    findings = Findings(report, style, anchors)
    required = tables.requirements(picture, anchors)
    data = findings.data(own)
    links = findings.links(used)
    anchor = anchors.give("system", report.system)
    drawings = _stages(graph, used, own, anchor)
    topics = topic_entries(report, used, own, anchors, links)
    owners = owner_entries(used, own, links)
    return {
        "anchor": anchor,
        "name": phrases.heading(report) or "system",
        "state": state(wrong=_is_wrong(report)),
        "sources": first_names(report.sources, 12),
        "partial": report.partial,
        "unmatched": report.unmatched,
        "assumed": [*phrases.assumed(report)],
        "not_read": list(filter(None, [", ".join(phrases.not_read(report))])),
        "coverage": [text_pieces(each) for each in first_names([*phrases.coverage(report)], _MOST_UNREAD)]
        if report.coverage.percent < _ALL
        else [],
        "not_checked": [text_pieces(each) for each in report.not_checked],
        **_head(report),
        "graph": drawings,
        "has_graph": bool(graph.nodes),
        "topics": topics,
        "has_topics": bool(topics["entries"]),
        "owners": owners,
        "bridged": any(kind == "bridge" for kind, _ in used.owners),
        "has_owners": bool(owners["entries"]),
        "findings": data,
        "findings_many": len(data) > 1,
        "findings_left": f"{len(report.findings) - len(data):,}" if len(report.findings) > len(data) else "",
        "required": required,
        "states_needs": (stated := any(path.needs for path in picture.paths)),
        "shows_kinds": bool(required) and not stated,
        "paths_left": counted(picture.left_out, "pair") if picture.left_out else "",
        "runs": tables.runs(picture),
        "has_runs": bool(picture.runs),
    }


def _stages(graph: DrawnGraph, used: Usage, own: dict[Key, str], anchor: str) -> dict[str, Any]:
    """Return the drawings of the growing graph."""
    targets = {key: f"#{name}" for key, name in own.items()}
    found = [
        {
            **svg_graph(part, targets),
            "number": number,
            "stage": name,
            "step": name if name == "everything" or not number else f"+ {name}",
            "first": not number,
            "marker": f"{anchor}-{number}",
        }
        for number, (name, part) in enumerate(stages(graph, used))
    ]
    kinds = {node.kind for node in graph.nodes}
    return {
        "stages": found,
        "grows": len(found) > 1,
        "topic_nodes": "topic" in kinds,
        "bridge_nodes": "bridge" in kinds,
        "left_out": list(graph.left_out),
    }


def _from_ids(report: Report) -> Picture:
    """Return the picture of a report without its system; the owners come from the ids of endpoints."""
    ends = {
        name: PicturedEnd(name, name.partition(f"/{role}/")[0], False, role, group.topic, group.protocol)
        for group in report.groups
        for role, names in ((PUBLISHER, group.publishers), (SUBSCRIBER, group.subscribers))
        for name in names
    }
    return Picture(tuple(ends.values()))
