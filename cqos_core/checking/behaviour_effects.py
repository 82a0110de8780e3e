"""Effects of findings about behaviour: other findings of the same cause are removed, and excluded requirements are not met."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.behaviour.findings import UNMET
from cqos_core.language.policy import ENDPOINT, TOPIC
from cqos_core.model.finding import Verdict

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.checking.findings import FindingDraft
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Group
    from cqos_core.packs.pack import RulePack

_GAPS = frozenset({"BP101", "BP103"})
"""Codes of findings whose cause rules over a stated period report too."""


def with_behaviour(
    made: list[FindingDraft], groups: list[Group], behaviour: Iterable[Finding], packs: Mapping[str, RulePack]
) -> tuple[list[FindingDraft], list[Group]]:
    """Return findings without those whose cause behaviour reports already, and groups with the requirements that it excludes."""
    excluded = [each for each in behaviour if each.code in UNMET]
    exceeded = [each for each in behaviour if each.code in _GAPS]
    if excluded:
        groups = [each for group in groups for each in _divided(group, excluded)]
    if exceeded:
        known = {(code, each.topic, end) for each in exceeded for code in _of_gaps(packs) for end in each.endpoints}
        made = [
            one
            for one in made
            if not one.finding.endpoints
            or not {(one.finding.code, one.finding.topic, end) for end in one.finding.endpoints} <= known
        ]
    return made, groups


def _divided(group: Group, excluded: Sequence[Finding]) -> list[Group]:
    """Return a group without the subscribers whose requirement is not met, and a group of these."""
    codes = {end: each.code for each in excluded if each.topic == group.topic for end in each.endpoints}
    failing = tuple(each for each in group.subscribers if each in codes)
    if not failing or group.verdict is Verdict.INCOMPATIBLE:
        return [group]
    others = tuple(each for each in group.subscribers if each not in codes)
    found = tuple(sorted({*group.codes, *(codes[each] for each in failing)}))
    unmet = replace(group, subscribers=failing, verdict=Verdict.INCOMPATIBLE, codes=found, internal=0)
    return [unmet, *([replace(group, subscribers=others)] if others else ())]


def _of_gaps(packs: Mapping[str, RulePack]) -> set[str]:
    """Return the codes of the rules that compare the offered gap with the stated period."""
    found = set()
    for pack in packs.values():
        indices, timing = pack.vocabulary.indices, pack.timing
        asked = {indices.get((ENDPOINT, timing.gap)), indices.get((TOPIC, timing.period))}
        for bound in pack.bound_rules:
            if asked == {use.index for use in bound.bound.uses}:
                found.add(bound.rule.code)
    return found
