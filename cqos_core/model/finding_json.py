"""A finding as plain data, as the JSON report has it: ``docs/json-report.md``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.model.finding import Edit, Fact, Finding, Remedy, Side
    from cqos_core.model.settings import Place

    Exact: TypeAlias = Callable[[Place], Place]

Json: TypeAlias = "dict[str, Any]"


def place_as_stated(place: Place) -> Place:
    """Leave a place as the report has it."""
    return place


def finding_json(finding: Finding, exact: Exact = place_as_stated) -> Json:
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
        "place": place_json(finding.place, exact),
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
        "place": place_json(side.place, exact),
        "templates": list(side.templates),
    }


def _fact(fact: Fact, exact: Exact) -> Json:
    return {
        "policy": fact.policy,
        "value": fact.value,
        "origin": fact.origin,
        "place": place_json(fact.place, exact),
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
    return {"place": place_json(edit.place, exact), "attribute": edit.attribute, "old": edit.old, "new": edit.new}


def place_json(place: Place | None, exact: Exact = place_as_stated) -> Json | None:
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


def finding_row(finding: Finding) -> Json:
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
