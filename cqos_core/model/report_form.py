"""A report as plain data: the JSON report, version 1, documented in ``docs/json-report.md``."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeAlias

from cqos_core.model.report import Severity, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.model.coverage import Coverage
    from cqos_core.model.report import Assumption, Edit, Fact, Finding, Group, PairReport, Remedy, Report, Side
    from cqos_core.model.system import Place

    Exact: TypeAlias = Callable[[Place], Place]

VERSION = 1
"""Of the format; a number that a reader does not know means that it must not go on."""

Json = dict[str, Any]


def as_it_is(place: Place) -> Place:
    """Leave a place as the report has it."""
    return place


def document(report: Report, tool_version: str = "", exact: Exact = as_it_is) -> Json:
    """Return all of a report; ``exact`` fills in what places leave open."""
    return {
        **summary(report, tool_version),
        "groups": [group(each) for each in report.groups],
        "findings": [finding(each, exact) for each in report.findings],
        "not_checked": list(report.not_checked),
    }


def summary(report: Report, tool_version: str) -> Json:
    """Return what is stated once for a report: verdict, counts and sources."""
    return {
        "version": VERSION,
        "tool": {"name": "cqos", "version": tool_version},
        "system": report.system,
        "verdict": report.verdict.value,
        "partial": report.partial,
        "counts": _counts(report),
        "sources": list(report.sources),
        "assumed": assumed(report.assumed),
        "coverage": coverage(report.coverage),
    }


def coverage(covered: Coverage) -> Json:
    """Return how much of the inputs was read."""
    return {
        "percent": covered.percent,
        "endpoints": covered.endpoints,
        "unclear": list(covered.unclear),
        "unread": [asdict(each) for each in covered.unread],
        "totals": dict(covered.totals),
    }


def assumed(assumptions: Iterable[Assumption]) -> list[Json]:
    """Return options that are not stated, with the values that are assumed for them."""
    return [{"option": each.option, "values": list(each.values)} for each in assumptions]


def pair(pair: PairReport, exact: Exact = as_it_is) -> Json:
    """Return all of an explained pair."""
    policies, guarantees, hops = (
        [asdict(each, dict_factory=_fields) for each in parts] for parts in (pair.policies, pair.guarantees, pair.hops)
    )
    return {
        "verdict": pair.verdict.value,
        "policies": policies,
        "derived": dict(pair.derived),
        "assumed": assumed(pair.assumed),
        "guarantees": guarantees,
        "hops": hops,
        "findings": [finding(each, exact) for each in pair.findings],
    }


def _fields(stated: list[tuple[str, Any]]) -> Json:
    """Return the fields of a value as JSON has them: reasons as objects, and no policy in a fact, which stands beside it."""
    found = {name: list(value) if isinstance(value, tuple) else value for name, value in stated}
    if "lost" in found:
        found["lost"] = [{"code": code, "because": because} for code, because in found["lost"]]
    if "origin" in found:
        del found["policy"]
    return found


def _counts(report: Report) -> Json:
    pairs: Counter[Verdict] = Counter()
    for group in report.groups:
        pairs[group.verdict] += group.pairs
    return {
        "topics": report.topics,
        "endpoints": report.endpoints,
        "pairs": report.pair_count,
        **{verdict.value: pairs[verdict] for verdict in Verdict},
        **{f"{severity.value}s": report.count(severity) for severity in Severity},
        "accepted": sum(finding.accepted is not None for finding in report.findings),
        "unmatched": report.unmatched,
        "hypothetical": report.hypothetical,
    }


def group(group: Group) -> Json:
    """Return a group of pairs."""
    return {
        "topic": group.topic,
        "protocol": group.protocol,
        "verdict": group.verdict.value,
        "pairs": group.pairs,
        "internal": group.internal,
        "codes": list(group.codes),
        "publishers": list(group.publishers),
        "subscribers": list(group.subscribers),
    }


def finding(finding: Finding, exact: Exact) -> Json:
    """Return a finding; ``exact`` fills in what its places leave open."""
    return {
        "code": finding.code,
        "name": finding.name,
        "source": finding.source,
        "severity": finding.severity.value,
        "verdict": None if finding.verdict is None else finding.verdict.value,
        "message": finding.message,
        "topic": finding.topic,
        "more_topics": list(finding.more_topics),
        "more_codes": list(finding.more_codes),
        "pairs": finding.pairs,
        "place": place_form(finding.place, exact),
        "sides": [_side(side, exact) for side in finding.sides],
        "remedies": [_remedy(remedy, exact) for remedy in finding.remedies],
        "help": finding.help,
        "notes": list(finding.notes),
        "worlds": {world: verdict.value for world, verdict in sorted(finding.worlds.items())},
        "because": finding.because,
        "clause": finding.clause,
        "accepted": finding.accepted,
    }


def _side(side: Side, exact: Exact) -> Json:
    return {
        "role": side.role,
        "label": side.label,
        "members": list(side.members),
        "facts": [_fact(fact, exact) for fact in side.facts],
        "place": place_form(side.place, exact),
        "templates": list(side.templates),
    }


def _fact(fact: Fact, exact: Exact) -> Json:
    return {
        "policy": fact.policy,
        "value": fact.value,
        "origin": fact.origin,
        "place": place_form(fact.place, exact),
    }


def _remedy(remedy: Remedy, exact: Exact) -> Json:
    return {
        "text": remedy.text,
        "role": remedy.role,
        "members": list(remedy.members),
        "policy": remedy.policy,
        "value": remedy.value,
        "kind": remedy.kind,
        "mends": remedy.mends,
        "breaks": remedy.breaks,
        "weakens": remedy.weakens,
        "edits": [_edit(edit, exact) for edit in remedy.edits],
        **({"costs": list(remedy.costs)} if remedy.costs else {}),
    }


def _edit(edit: Edit, exact: Exact) -> Json:
    return {"place": place_form(edit.place, exact), "attribute": edit.attribute, "old": edit.old, "new": edit.new}


def place_form(place: Place | None, exact: Exact = as_it_is) -> Json | None:
    """Return a place; ``exact`` fills in what it leaves open."""
    if place is None:
        return None
    where = exact(place)
    return {
        "source": where.source,
        "line": where.line,
        "column": where.column,
        "element": where.element,
        "path": where.path,
    }


def row(finding: Finding) -> Json:
    """Return a finding as one flat row; of several sides, the first members are named."""
    ends, place = {side.role: side.name for side in reversed(finding.sides)}, finding.place
    return {
        **{key: str(getattr(finding, key)) for key in ("severity", "code", "name", "message")},
        **{key: getattr(finding, key) for key in ("topic", "pairs", "accepted")},
        "verdict": None if finding.verdict is None else finding.verdict.value,
        **{role: ends.get(role) for role in ("publisher", "subscriber")},
        **{key: None if place is None else getattr(place, key) for key in ("source", "line", "column")},
        "fix": finding.remedies[0].text if finding.remedies else None,
    }
