"""Severities and accepted exceptions: what the people who run a check say about its findings."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from cqos_core.checking.team import topic_spellings
from cqos_core.language.name_index import NameIndex
from cqos_core.model.remarks import core_finding
from cqos_core.model.report import Finding, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.checking.findings import Made
    from cqos_core.matching.pipeline import RuleFinder
    from cqos_core.model.system import Acceptance


def _spellings(finding: Finding, find_rule: RuleFinder) -> tuple[str, ...]:
    """What a finding's rule is called: by its code, its name, former ones."""
    rule = find_rule(finding.code)
    aliases = rule.aliases if rule is not None else ()
    return (finding.code.lower(), finding.name, *(alias.lower() for alias in aliases))


def with_severities(made: Sequence[Made], severities: Mapping[str, str], find_rule: RuleFinder) -> list[Made]:
    """Give findings the severities asked for by code, name or alias; ``off`` takes them away."""
    if not severities:
        return list(made)
    wanted = {name.lower(): level for name, level in severities.items()}
    kept = []
    for one in made:
        level = next((wanted[name] for name in _spellings(one.finding, find_rule) if name in wanted), None)
        if level == "off":
            continue
        kept.append(one if level is None else replace(one, finding=replace(one.finding, severity=Severity(level))))
    return kept


def with_acceptances(
    made: Sequence[Made], acceptances: Sequence[Acceptance], find_rule: RuleFinder, today: date
) -> tuple[list[Made], list[Finding]]:
    """Mark accepted findings; report entries that are unused, expired, or name no rule."""
    used: set[int] = set()
    valid = {
        index for index, each in enumerate(acceptances) if each.until is None or date.fromisoformat(each.until) >= today
    }
    filed = NameIndex(
        (f"{each.rule.lower()} {_about(each)}", index) for index, each in enumerate(acceptances) if index in valid
    )
    marked = []
    for one in made:
        near = filed.matching(*_names(one.finding, find_rule))
        excuses = [index for index in near if _excuses(index, acceptances[index], one, find_rule)]
        used.update(excuses)
        if excuses:
            one = replace(one, finding=replace(one.finding, accepted=acceptances[excuses[0]].because))  # noqa: PLW2901
        marked.append(one)
    said = []
    for index, each in enumerate(acceptances):
        if find_rule(each.rule) is None:
            said.append(
                core_finding(
                    "CQ603",
                    f"`accept` names rule `{each.rule}`, which no installed pack has",
                    place=each.place,
                )
            )
        elif index not in valid:
            message = f"the acceptance of {each.rule} ({each.because}) expired on {each.until}"
            said.append(core_finding("CQ602", message, place=each.place))
        elif index not in used:
            message = f"the acceptance of {each.rule} ({each.because}) matches no finding"
            said.append(core_finding("CQ601", message, place=each.place))
    return marked, said


def _about(acceptance: Acceptance) -> str:
    """The pattern that an acceptance is filed under, beside its rule: one that every finding it excuses matches."""
    if acceptance.topic is not None:
        return f"topic {acceptance.topic.lstrip('/')}"
    return f"endpoint {acceptance.endpoint}" if acceptance.endpoint is not None else "any"


def _names(finding: Finding, find_rule: RuleFinder) -> Iterator[str]:
    """What an acceptance of a finding may be filed under."""
    for rule in _spellings(finding, find_rule):
        yield f"{rule} any"
        if finding.topic is not None:
            spellings = topic_spellings(finding.topic)
            yield from (f"{rule} topic {name}" for name in (*spellings, *(name.lstrip("/") for name in spellings)))
        yield from (f"{rule} endpoint {member}" for side in finding.sides for member in side.members)


def _excuses(index: int, acceptance: Acceptance, one: Made, find_rule: RuleFinder) -> bool:
    finding = one.finding
    if acceptance.rule.lower() not in _spellings(finding, find_rule):
        return False
    if acceptance.topic is not None:
        topics = [topic for topic in (finding.topic, *finding.more_topics) if topic is not None]
        matching = [
            any(
                fnmatchcase(name, acceptance.topic) or name == acceptance.topic.lstrip("/")
                for name in topic_spellings(topic)
            )
            for topic in topics
        ]
        if not matching or not all(matching):
            return False
    if acceptance.endpoint is None or index in one.tags:
        return True
    return any(
        side.members and all(fnmatchcase(member, acceptance.endpoint) for member in side.members)
        for side in finding.sides
    )
