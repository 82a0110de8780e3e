"""Severities and accepted exceptions, by which users change the findings of a check."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from cqos_core.checking.findings import FindingDraft, Memo, without_memo
from cqos_core.checking.team import topic_spellings
from cqos_core.language.name_index import NameIndex
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Finding, Severity

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext, RuleFinder
    from cqos_core.model.system import Acceptance, System


def _spellings(finding: Finding, find_rule: RuleFinder) -> tuple[str, ...]:
    """Return the spellings of a finding's rule: code, name and aliases."""
    rule = find_rule(finding.code)
    aliases = rule.aliases if rule is not None else ()
    return (finding.code.lower(), finding.name, *(alias.lower() for alias in aliases))


def _with_severities(
    made: Sequence[FindingDraft], severities: Mapping[str, str], find_rule: RuleFinder
) -> list[FindingDraft]:
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


class AcceptanceIndex:
    """Marks accepted findings, and reports entries that are unused, expired, or name no rule."""

    def __init__(self, acceptances: Sequence[Acceptance], find_rule: RuleFinder, today: date) -> None:
        """File the entries that are valid on a day."""
        self._acceptances = acceptances
        self._find_rule = find_rule
        self._valid = {
            index
            for index, each in enumerate(acceptances)
            if each.until is None or date.fromisoformat(each.until) >= today
        }
        self._filed = NameIndex(
            (f"{each.rule.lower()} {_about(each)}", index)
            for index, each in enumerate(acceptances)
            if index in self._valid
        )

    def marked(self, one: FindingDraft) -> tuple[FindingDraft, Sequence[int]]:
        """Return a finding as it is accepted or not, and the positions of the entries that excuse it."""
        near = self._filed.matching(*_names(one.finding, self._find_rule)) if self._acceptances else ()
        excuses = [index for index in near if _excuses(index, self._acceptances[index], one, self._find_rule)]
        if excuses:
            one = replace(one, finding=replace(one.finding, accepted=self._acceptances[excuses[0]].because))
        return one, excuses

    def unused_entries(self, used: Collection[int]) -> list[Finding]:
        """Return findings about the entries that excuse nothing; ``used`` are the positions of those that do.

        Several entries with one place are one.
        """
        found = []
        done = {self._entry(index) for index in used}
        for index, each in enumerate(self._acceptances):
            entry = self._entry(index)
            if entry in done:
                continue
            done.add(entry)
            if self._find_rule(each.rule) is None:
                message = f"an exception names rule `{each.rule}`, which no installed pack has"
                found.append(core_finding("CQ603", message, place=each.place))
            elif index not in self._valid:
                message = f"the acceptance of {each.rule} ({each.because}) expired on {each.until}"
                found.append(core_finding("CQ602", message, place=each.place))
            else:
                message = f"the acceptance of {each.rule} ({each.because}) matches no finding"
                found.append(core_finding("CQ601", message, place=each.place))
        return found

    def _entry(self, index: int) -> tuple[object, str]:
        each = self._acceptances[index]
        return (index if each.place is None else each.place), each.rule


def apply_acceptances(
    made: Sequence[FindingDraft], system: System, context: CheckContext, again: Memo = without_memo
) -> list[FindingDraft]:
    """Apply severities and acceptances; report acceptances that are unused, expired, or name no rule."""
    today = date.today()  # noqa: DTZ011 - a calendar day, where the user is
    accepting = AcceptanceIndex(system.accept, context.find_rule, today)

    def said(of: Sequence[FindingDraft]) -> list[tuple[FindingDraft, Sequence[int]]]:
        return [accepting.marked(each) for each in _with_severities(of, system.severities, context.find_rule)]

    marked = [each for one in made for each in again(said, (one,))]
    used = {index for _, excuses in marked for index in excuses}
    unused = [FindingDraft(finding, (), frozenset()) for finding in accepting.unused_entries(used)]
    return [*(one for one, _ in marked), *_with_severities(unused, system.severities, context.find_rule)]


def _about(acceptance: Acceptance) -> str:
    """Return the pattern under which an acceptance is filed, beside its rule; every finding that it excuses matches it."""
    if acceptance.topic is not None:
        return f"topic {acceptance.topic.lstrip('/')}"
    return f"endpoint {acceptance.endpoint}" if acceptance.endpoint is not None else "any"


def _names(finding: Finding, find_rule: RuleFinder) -> Iterator[str]:
    """Yield the patterns under which an acceptance of a finding may be filed."""
    for rule in _spellings(finding, find_rule):
        yield f"{rule} any"
        if finding.topic is not None:
            spellings = topic_spellings(finding.topic)
            yield from (f"{rule} topic {name}" for name in (*spellings, *(name.lstrip("/") for name in spellings)))
        yield from (f"{rule} endpoint {member}" for side in finding.sides for member in side.members)


def _excuses(index: int, acceptance: Acceptance, one: FindingDraft, find_rule: RuleFinder) -> bool:
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
