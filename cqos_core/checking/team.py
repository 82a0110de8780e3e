"""The team's own rules (``checks:``): conditions like those of a pack, bound to every pack in use."""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from cqos_core.checking.findings import FindingDraft, draft_finding
from cqos_core.language.expression import Condition, Literal, Term, Test, definitions
from cqos_core.language.name_index import NameIndex
from cqos_core.language.parser import parse
from cqos_core.language.vocabulary import role_of, scope_of
from cqos_core.matching.judge import ask_end
from cqos_core.matching.rule_hits import EndpointHits
from cqos_core.model.core_findings import core_finding
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, Severity
from cqos_core.model.problems import CqosError
from cqos_core.model.suggestions import suggestion
from cqos_core.packs.bound_rule import BoundRule
from cqos_core.packs.rule import requires
from cqos_core.resolving.participants import packs_in_use

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from cqos_core.matching.rule_hits import Hit
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.model.system import Bound, System, TeamRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved


@dataclass(frozen=True, slots=True)
class TeamCheck:
    """A team rule bound to one pack."""

    rule: TeamRule
    bound: BoundRule


def bind_checks(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None
) -> tuple[Mapping[int, NameIndex[TeamCheck]], list[Finding]]:
    """Bind ``checks:`` to the packs in use; a check that fits none of them is a finding.

    Returns:
        By id of the pack its checks, filed under where they apply (`_filed`), and the findings.
    """
    teams: dict[int, list[TeamCheck]] = {}
    findings = []
    packs = packs_in_use(system, find_pack, default_protocol) if system.checks else []
    for team_rule in system.checks:
        errors = []
        for pack in packs:
            try:
                condition = _team_condition(team_rule, pack)
                rule = requires(
                    condition,
                    code="CQ605",
                    name="team-rule",
                    because=team_rule.because.rstrip(".") or "the team requires it",
                    severity=team_rule.severity,
                )
                bound = BoundRule(rule, pack.vocabulary, scope_of(condition), role_of(condition))
                _ = bound.bound
                _refuse_wider(bound)
            except CqosError as error:
                errors.append(str(error))
                continue
            teams.setdefault(id(pack), []).append(TeamCheck(team_rule, bound))
        if errors and len(errors) == len(packs):
            message = f"check `{team_rule.name}` cannot be applied: {errors[0]}"
            findings.append(core_finding("CQ604", message, place=team_rule.place))
    return {pack: NameIndex((_filed(each.rule), each) for each in checks) for pack, checks in teams.items()}, findings


def words_asked(teams: Mapping[int, NameIndex[TeamCheck]]) -> dict[int, frozenset[int]]:
    """By id of a pack, the policies whose spelling the team's rules ask for."""
    return {
        pack: frozenset(index for check in checks for index in check.bound.bound.asked)
        for pack, checks in teams.items()
    }


_FILED: Final = ("topic", "id", "participant")


def _filed(rule: TeamRule) -> str:
    """Return the pattern that a check is filed under: its most selective one."""
    where = dict(rule.where)
    return next((f"{key} {where[key]}" for key in _FILED if key in where), "any")


def _names(topic: MatchedTopic) -> Iterator[str]:
    """Yield the names under which checks of a topic's endpoints may be filed."""
    yield "any"
    for endpoint in topic.endpoints:
        offered = _offered(endpoint, topic)
        yield from (f"{key} {text}" for key in _FILED for text in offered[key])


_ONE_ENDPOINT: Final = "write bare policy names, or only `offered` or only `requested` values"
_RELATIONS: Final = {"exactly": "==", "at_least": ">=", "at_most": "<=", "not": "!="}


def _team_condition(team_rule: TeamRule, pack: RulePack) -> Condition:
    parts = [parse(team_rule.sentence, pack.definitions)] if team_rule.sentence else []
    parts += [_bound_condition(required, pack) for required in team_rule.require]
    if not parts:
        raise CqosError("it requires nothing")
    condition = parts[0]
    for part in parts[1:]:
        condition = condition & part
    return condition


def _refuse_wider(bound: BoundRule) -> None:
    """Refuse a condition about more than one endpoint, which would be judged of each by itself and always hold."""
    if bound.scope != "endpoint":
        raise CqosError(f"`{bound.rule.condition}` speaks of a {bound.scope}, a check of one endpoint: {_ONE_ENDPOINT}")


def _bound_condition(required: Bound, pack: RulePack) -> Condition:
    index = pack.find("endpoint", required.policy)
    if index is None:
        known = [policy.name for policy in pack.policies if policy.level == "endpoint"]
        raise CqosError(f"{pack.title} has no policy `{required.policy}`; {suggestion(required.policy, known)}")
    term = Term("own", pack.policies[index].name)
    if required.relation == "one_of":
        return Test("in_", term, *(Literal(value) for value in required.values))
    value: str | int = required.values[0]
    domain = pack.policies[index].domain
    if domain.kind in {"count", "flag"}:
        value = domain.parse(str(value))  # type: ignore[assignment]
    return Test(_RELATIONS[required.relation], term, Literal(value))


def team_findings(topic: MatchedTopic, checks: NameIndex[TeamCheck]) -> list[FindingDraft]:
    """Judge the endpoints of one topic by the team's rules that apply to them."""
    applying = checks.matching(*dict.fromkeys(_names(topic)))
    return [_made(topic, check, draft) for check in applying for draft in _drafts(topic, check)]


def _drafts(topic: MatchedTopic, check: TeamCheck) -> Iterable[Hit[EndpointGroup]]:
    """Judge one check: a draft per role and values, those beyond a few put together."""
    drafts: EndpointHits[EndpointGroup] = EndpointHits()
    for members in (*topic.publishers, *topic.subscribers):
        role = members.first.role
        if members.copied or check.bound.role not in {None, role}:
            continue
        chosen = [each for each in members.endpoints if _applies(check.rule, each, topic)]
        violation = ask_end(check.bound, members.profile, role) if chosen else None
        if violation is not None:
            drafts.note(violation, role, members.only(chosen), members.profile, members.tags)
    return drafts.values()


def _made(topic: MatchedTopic, check: TeamCheck, draft: Hit[EndpointGroup]) -> FindingDraft:
    one = draft_finding(topic, draft)
    condition = check.bound.rule.condition
    used = "".join(f"; {name} is {node.text()}" for name, node in definitions(condition).items())
    note = f"required by check `{check.rule.name}`: {condition}{used}"
    finding = replace(
        one.finding,
        message=f"{check.rule.name}: {one.finding.message}",
        notes=(note, *one.finding.notes),
        verdict=None,
        severity=Severity(check.rule.severity),
        source="checks",
    )
    own = one.merge_key[0] == "own"
    return replace(one, finding=finding, merge_key=one.merge_key if own else ("team", check.rule.name, *one.merge_key))


def _applies(rule: TeamRule, endpoint: Resolved, topic: MatchedTopic) -> bool:
    offered = _offered(endpoint, topic)
    return all(any(fnmatchcase(text, pattern) for text in offered.get(key, ())) for key, pattern in rule.where)


def _offered(endpoint: Resolved, topic: MatchedTopic) -> dict[str, tuple[str, ...]]:
    """Return the texts that the patterns of ``where`` are compared with."""
    stated = endpoint.endpoint
    return {
        "role": (stated.role,),
        "topic": topic_spellings(stated.topic, topic.shown, topic.key),
        "participant": (stated.participant, endpoint.participant.participant.label or ""),
        "protocol": (topic.pack.id,),
        "type": (stated.type or "",),
        "id": (endpoint.id,),
    }


def topic_spellings(*names: str | None) -> tuple[str, ...]:
    """All ways a person may write a topic in a pattern: as written, as resolved, and without the leading slash."""
    found = dict.fromkeys(name for name in names if name)
    return tuple(dict.fromkeys((*found, *(name.lstrip("/") for name in found))))
