"""What control flow says about the settings of a system: findings about behaviour, and requirements that it excludes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.checking.drawn import Drawn, draws
from cqos_core.checking.rounds import round_findings
from cqos_core.checking.sequences import OPTION, READINGS, sequence_findings
from cqos_core.checking.timers import timer_findings
from cqos_core.checking.unreachable import unreachable_findings
from cqos_core.language.policy import TOPIC
from cqos_core.model.remarks import core_finding
from cqos_core.model.report import Verdict

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.checking.findings import Made
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.model.report import Finding, Group
    from cqos_core.model.system import System
    from cqos_core.packs.pack import RulePack

UNMET = frozenset({"BP109", "BP114"})
"""Codes of requirements that are certainly not met: the pairs of the subscriber are then incompatible."""
_GAPS = frozenset({"BP101", "BP103"})
"""Codes of what rules over a stated period also report."""


def behaviour_findings(pipeline: Pipeline) -> list[Finding]:
    """Report what the control flow of a system says for certain; nothing where it draws none."""
    if not draws(pipeline.system):
        return []
    drawn, reading = Drawn(pipeline), reading_of(pipeline.system)
    return [
        *_unknown_reading(pipeline.system),
        *unreachable_findings(drawn),
        *timer_findings(drawn),
        *sequence_findings(drawn, reading),
        *round_findings(drawn, reading),
    ]


def with_behaviour(
    made: list[Made], groups: list[Group], behaviour: Iterable[Finding], packs: Mapping[str, RulePack]
) -> tuple[list[Made], list[Group]]:
    """Return findings without those of rules whose cause behaviour reports already, and groups with what it excludes."""
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
    """Return a group without the subscribers whose requirement is not met, and one of these."""
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
        asked = {indices.get(("endpoint", timing.gap)), indices.get((TOPIC, timing.period))}
        for bound in pack.bound_rules:
            if asked == {use.index for use in bound.bound.uses}:
                found.add(bound.rule.code)
    return found


def _unknown_reading(system: System) -> list[Finding]:
    stated = system.options.get("bpmn", {}).get(OPTION)
    if stated is None or stated.text in READINGS:
        return []
    message = f"option `bpmn.{OPTION}` is `{stated.text[:60]}`, which is not known, so each of its values is assumed"
    return [core_finding("CQ208", message, place=stated.place, help=f"allowed: {', '.join(READINGS)}")]


def reading_of(system: System) -> str | None:
    """Return what the option ``bpmn.catch`` says, None where it says nothing that is known."""
    stated = system.options.get("bpmn", {}).get(OPTION)
    return stated.text if stated is not None and stated.text in READINGS else None
