"""Exact columns for the places in a report, found in the sources when they are read."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.lazy_tuple import lazy_tuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.model.finding import Finding, Remedy, Side
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place


def with_exact_columns(report: Report, sources: Mapping[str, bytes]) -> Report:
    """Return ``report`` with exact columns in its places, found by rescanning the sources.

    A source is scanned when the sides or the remedies of any finding are first read: once for all sides, once for all remedies.
    """
    from cqos_core.model.excerpt import exact, is_xml

    # Only places in XML lack columns; fixes in other formats stay lazy.
    xml = any(map(is_xml, sources.values()))
    findings = report.findings

    @cache
    def of_sides() -> Mapping[Place, Place]:
        return exact({place for finding in findings for place in _places(finding)}, sources)

    @cache
    def of_edits() -> Mapping[Place, Place]:
        return exact({edit.place for each in findings for remedy in each.remedies for edit in remedy.edits}, sources)

    def sides(finding: Finding) -> Iterator[Side]:
        known = of_sides()
        for side in finding.sides:
            facts = (replace(each, place=known[each.place]) if each.place else each for each in side.facts)
            yield replace(side, place=known[side.place] if side.place else None, facts=tuple(facts))

    def remedies(finding: Finding) -> Iterator[Remedy]:
        known = of_edits()
        for remedy in finding.remedies:
            yield replace(remedy, edits=tuple(replace(each, place=known[each.place]) for each in remedy.edits))

    def pinned() -> list[Finding]:
        with gc_paused(report.endpoints):
            return [
                replace(each, sides=lazy_tuple(sides, each), remedies=lazy_tuple(remedies, each))
                if xml
                else replace(each, sides=lazy_tuple(sides, each))
                for each in findings
            ]

    return replace(report, findings=lazy_tuple(pinned))


def _places(finding: Finding) -> Iterator[Place]:
    for side in finding.sides:
        for place in (side.place, *(each.place for each in side.facts)):
            if place is not None:
                yield place
