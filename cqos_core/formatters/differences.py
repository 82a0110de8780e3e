"""Differences of two systems, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.formatters import phrases
from cqos_core.formatters.json_report import versioned
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.excerpt import exact
from cqos_core.model.finding import plural
from cqos_core.model.finding_json import place_json
from cqos_core.model.system_diff import ComparedSide

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.model.finding import Fact
    from cqos_core.model.settings import Place
    from cqos_core.model.system_diff import Diff, Different, Named


# Text


def diff_as_text(found: Diff, a: str, b: str, sources: Mapping[str, bytes], columns: int, *, color: bool) -> str:
    """Return the differences of two systems as text, topic by topic."""
    colors = paint(color=color)
    at = _exact(found, sources)
    lines: list[str] = []
    for topic in sorted(
        {*(each.a.topic for each in found.different), *(each.endpoint.topic for each in found.missing)}
    ):
        lines.append(colors(clean(topic), "title"))
        lines += _values([each for each in found.different if each.a.topic == topic], at)
        for missing in found.missing:
            if missing.endpoint.topic == topic:
                where = _where(missing.endpoint.place, at)
                lines.append(f"  {_named(missing.endpoint)} is only in {missing.only_in.upper()}{where}")
        lines.append("")
    lines += wrap(f"A is {clean(a)}, B is {clean(b)}: {_summary(found)}", columns)
    for text in found.not_compared:
        lines += wrap(f"not compared: {clean(text)}", columns)
    return "\n".join(lines) + "\n"


def _values(differences: Iterable[Different], at: Mapping[Place, Place]) -> list[str]:
    lines: list[str] = []
    ends = None
    for each in differences:
        if ends != (each.a.id, each.b.id):
            ends = (each.a.id, each.b.id)
            other = "" if each.a.id == each.b.id else f", in B `{clean(each.b.id)}`"
            lines.append(f"  {_named(each.a)}{other}")
        values = " and ".join(
            f"{clean(phrases.value(fact))} in {side}{_where(fact.place, at)}"
            for side, fact in (("A", each.value_a), ("B", each.value_b))
        )
        lines.append(f"    {each.policy} is {values}")
    return lines


def _named(end: Named) -> str:
    return f"{end.kind.replace('_', ' ')} `{clean(end.id)}`"


def _where(place: Place | None, at: Mapping[Place, Place]) -> str:
    return "" if place is None else f" ({clean(phrases.position(at.get(place, place)))})"


def _summary(found: Diff) -> str:
    count = plural(len(found.different) + len(found.missing), "difference")
    matched = f"{plural(found.matched, 'endpoint')} in both"
    if found.by_topic:
        matched += f", {found.by_topic} of them known by topic only, because their participants have different names"
    return f"{count if found else 'no difference'}; {matched}"


def _exact(found: Diff, sources: Mapping[str, bytes]) -> Mapping[Place, Place]:
    """Return the exact places of the values and endpoints that are shown."""
    facts = (fact.place for each in found.different for fact in (each.value_a, each.value_b))
    places = {place for place in (*facts, *(each.endpoint.place for each in found.missing)) if place is not None}
    return exact(places, sources)


# JSON


def diff_as_json(found: Diff, a: str, b: str, sources: Mapping[str, bytes]) -> str:
    """Return the differences of two systems as JSON."""
    at = _exact(found, sources)

    def place(place: Place | None) -> dict[str, Any] | None:
        return place_json(place, lambda place: at.get(place, place))

    def end(end: Named) -> dict[str, Any]:
        return {"id": end.id, "participant": end.participant, "place": place(end.place)}

    def value(fact: Fact) -> dict[str, Any]:
        return {"value": fact.value, "origin": fact.origin, "value_place": place(fact.place)}

    return versioned(
        {
            "a": a,
            "b": b,
            "different": [
                {
                    "policy": each.policy,
                    **_about(each.a),
                    ComparedSide.A.value: {**end(each.a), **value(each.value_a)},
                    ComparedSide.B.value: {**end(each.b), **value(each.value_b)},
                }
                for each in found.different
            ],
            "missing": [
                {"only_in": each.only_in.value, **_about(each.endpoint), "endpoint": end(each.endpoint)}
                for each in found.missing
            ],
            "matched": found.matched,
            "matched_by_topic": found.by_topic,
            "not_compared": list(found.not_compared),
        }
    )


def _about(end: Named) -> dict[str, Any]:
    return {"topic": end.topic, "protocol": end.protocol, "kind": end.kind}
