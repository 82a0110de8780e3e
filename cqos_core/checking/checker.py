"""The check: judges every topic as a unit, then the whole system, and makes the report."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import chain, groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.checking.assumptions import assumptions, with_imported
from cqos_core.checking.findings import FindingDraft, Memo, merged, one_per_cause, participant_finding, without_memo
from cqos_core.checking.topic_check import TopicResult, check_topic
from cqos_core.matching.judge import ask, worst
from cqos_core.matching.pipeline import Pipeline
from cqos_core.matching.topic_groups import naming_endpoints
from cqos_core.model.core_findings import core_finding
from cqos_core.model.coverage import Coverage
from cqos_core.model.finding import Finding, Severity, Side, Verdict, plural
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.lazy_tuple import lazy_tuple
from cqos_core.model.report import Group, Report
from cqos_core.model.system import Part
from cqos_core.packs.unread import totals_of, unread_parts
from cqos_core.resolving.start_order import unknown_starts

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.checking.team import TeamCheck
    from cqos_core.language.name_index import NameIndex
    from cqos_core.matching.judge import Violation
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.system import System
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved, ResolvedSystem


def name_collision_findings(endpoints: Iterable[Resolved]) -> list[Finding]:
    """Report keys that endpoints arrive at from names a person takes for different ones."""
    shown: dict[tuple[str, str], dict[str, list[Resolved]]] = {}
    for endpoint in [each for each in endpoints if each.shown != each.key]:
        if endpoint.key is None:
            continue
        shown.setdefault((endpoint.pack.id, endpoint.key), {}).setdefault(endpoint.shown, []).append(endpoint)
    findings = []
    for (_, key), free in sorted(shown.items()):
        if len(free) > 1:
            names = sorted(free)
            listed = " and ".join(f"`{name}`" for name in names)
            ids = sorted(endpoint.id for alike in free.values() for endpoint in alike)
            message = f"{listed} {'both' if len(names) == 2 else 'all'} stand for topic `{key}`"  # noqa: PLR2004
            first = min(free[names[0]], key=lambda endpoint: endpoint.id).endpoint
            findings.append(
                core_finding("CQ405", message, place=first.place, role=first.role, members=ids, topic=names[0])
            )
    return findings


def _participant_rules_of(endpoint: Resolved) -> Iterator[tuple[BoundRule, tuple[Any, ...]]]:
    """Yield the rules over participants, brokers and options that hold for an endpoint, each with the values it reads."""
    for bound in endpoint.pack.participant_rules:
        if not (bound.rule.creation and endpoint.representative.observed):
            yield bound, tuple([endpoint.profile.values[use.index] for use in bound.bound.uses])


def _ask_participant_rule(bound: BoundRule, endpoint: Resolved) -> Violation | None:
    """Ask such a rule about an endpoint; None if it does not report."""
    values = endpoint.profile.values
    violation = ask(bound, values, values)
    return None if violation is None or (violation.unknown and violation.failed is None) else violation


def participant_findings(endpoints: Sequence[Resolved]) -> list[Finding]:
    """Judge rules over participants, brokers and options, once per distinct values they read."""
    # The surroundings and the frame of a profile have all that these rules read.
    alike = {(each.participant, each.like.frame, each.representative.observed): each for each in endpoints}
    distinct = {(owner.surroundings, *others): each for (owner, *others), each in alike.items()}
    if not any(
        _ask_participant_rule(bound, each) for each in distinct.values() for bound, _ in _participant_rules_of(each)
    ):
        return []
    found: dict[tuple[Any, ...], tuple[BoundRule, list[Resolved]]] = {}
    for endpoint in endpoints:
        for bound, read in _participant_rules_of(endpoint):
            found.setdefault((id(bound), read), (bound, []))[1].append(endpoint)
    said = ((bound, _ask_participant_rule(bound, alike[0]), alike) for bound, alike in found.values())
    return [participant_finding(bound, violation, alike) for bound, violation, alike in said if violation is not None]


def assemble(
    system: System,
    resolved: ResolvedSystem,
    results: Mapping[TopicKey, TopicResult],
    context: CheckContext,
    problems: Sequence[Finding] = (),
) -> Report:
    """Make the report of all topics and the whole system; its findings are made when they are read."""
    packs = {pack.id: pack for pack in dict.fromkeys(map(attrgetter("pack"), resolved.endpoints))}
    judged, endpoints = (*results.values(),), resolved.endpoints
    of_topics = lazy_tuple(
        lambda known: merged_by_key({key: each.made for key, each in known.items() if each.made}), {**results}
    )
    distinct = {id(result.outcomes): result.outcomes for result in judged}
    verdicts = {row.verdict for outcomes in distinct.values() for row in outcomes.rows}
    groups = lazy_tuple(_groups, judged)
    if problems and system.flows:
        from cqos_core.checking.behaviour_effects import with_behaviour

        excused, divided = with_behaviour([*of_topics], [*groups], problems, packs)
        of_topics = tuple(excused)
        verdicts, groups = {each.verdict for each in divided}, tuple(divided)
    lonely, unmatched = _without_partners(system, results, packs, resolved.endpoints)
    own = as_drafts(
        [
            *stated_findings(system, resolved, context, problems),
            *participant_findings(resolved.endpoints),
            *name_collision_findings(resolved.endpoints),
            *lonely,
            *(() if verdicts else nothing_compared(system, resolved.endpoints)),
        ]
    )
    templates = templates_of(system, endpoints)
    size = len(endpoints)
    findings = lazy_tuple(lambda: _in_report([*of_topics, *own], templates, size))
    if system.hypothetical or system.severities or system.accept:
        every = [*of_topics, *own]
        told = with_acceptances(_only_tried(every, packs) if system.hypothetical else every, system, context)
        findings = _in_report(told, templates, size)
    paired = chain.from_iterable(each.paired for each in judged)
    owners = (*map(attrgetter("participant"), endpoints), *resolved.participants.values())
    hypothetical = sum(each.pairs for each in groups) if system.hypothetical else 0
    if hypothetical:
        verdicts, groups = set(), ()
    return Report(
        verdict=worst(verdicts) if verdicts else Verdict.UNKNOWN,
        groups=groups,
        findings=findings,
        not_checked=tuple(dict.fromkeys(chain.from_iterable(packs[name].not_checked for name in sorted(packs)))),
        system=system.name,
        sources=tuple(system.sources),
        endpoints=size,
        topics=_topics(results),
        partial=system.partial,
        unmatched=unmatched,
        hypothetical=hypothetical,
        assumed=lazy_tuple(lambda: with_imported(assumptions(owners, endpoints, paired, findings, packs), system)),
        coverage=coverage_of(system, resolved, context),
    )


def coverage_of(system: System, resolved: ResolvedSystem, context: CheckContext) -> Coverage:
    """Return how much of its inputs a system was made from."""
    endpoints = resolved.endpoints
    unclear = lazy_tuple(lambda: sorted([each.id for each in endpoints if each.key is None or each.like.unread]))
    unread = (*unread_parts(system.notes, context.find_rule), *_packless(resolved))
    return Coverage(len(endpoints), unclear, unread, totals_of(system.notes))


def _packless(resolved: ResolvedSystem) -> Iterator[Part]:
    """Yield the endpoints that no pack judges."""
    for protocol, endpoints in sorted(resolved.packless.items()):
        cause = f"no installed pack judges protocol `{protocol}`" if protocol else "no protocol is stated"
        for endpoint in sorted(endpoints, key=attrgetter("id")):
            yield Part("endpoint", endpoint.id, cause, endpoint.place)


def with_acceptances(
    made: Sequence[FindingDraft], system: System, context: CheckContext, again: Memo = without_memo
) -> Sequence[FindingDraft]:
    """Return findings with the severities and acceptances that users state."""
    if system.severities or system.accept:
        from cqos_core.checking.acceptance import apply_acceptances

        made = apply_acceptances(made, system, context, again)
    return made


def as_drafts(findings: Iterable[Finding]) -> list[FindingDraft]:
    """Return findings as drafts with keys of their own, so that they are not merged."""
    return [FindingDraft(finding, ("own", object()), frozenset()) for finding in findings]


def _in_report(made: Sequence[FindingDraft], templates: Mapping[str, str], size: int) -> tuple[Finding, ...]:
    """Return the findings of a report, of a system with so many endpoints."""
    with gc_paused(size):
        return in_order(merge_drafts(made, templates))


def merge_drafts(
    made: Sequence[FindingDraft], templates: Mapping[str, str], again: Memo = without_memo
) -> list[Finding]:
    """Merge findings of one missing fact, and equal ones about instances; in no order."""
    found = [one.finding for one in one_per_cause(made, again)]
    if not templates:
        return found

    def named(of: Sequence[Finding]) -> Finding:
        return _with_instances(of[0], templates)

    return _once_each([again(named, (each,)) for each in found], again)


def in_order(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sort findings; places and members, which are lazy, are compared only for equal findings."""

    def first(one: Finding) -> tuple[Any, ...]:
        return one.severity.rank, one.code, one.topic or "", one.message

    alike = ([*same] for _, same in groupby(sorted(findings, key=first), first))
    return tuple(
        chain.from_iterable(
            sorted(same, key=lambda one: (str(one.place or ""), -len(one.endpoints))) if len(same) > 1 else same
            for same in alike
        )
    )


def _without_partners(
    system: System,
    results: Mapping[TopicKey, TopicResult],
    packs: Mapping[str, RulePack],
    endpoints: Iterable[Resolved],
) -> tuple[list[Finding], int]:
    if not any(result.lonely for result in results.values()):
        return [], 0
    from cqos_core.checking.unmatched_endpoints import unmatched_endpoints

    return unmatched_endpoints(system, results, packs, endpoints)


def _groups(results: Iterable[TopicResult]) -> list[Group]:
    """Return the pairs of all topics, in order."""
    found = chain.from_iterable(result.groups for result in results)
    return sorted(found, key=lambda each: (each.topic, each.publishers, each.subscribers))


def _only_tried(made: Sequence[FindingDraft], packs: Mapping[str, RulePack]) -> list[FindingDraft]:
    """Turn errors of hypothetical pairs into warnings, but not those of single ends: nothing states that these pairs match."""
    rules = (
        bound for pack in packs.values() for bound in (*pack.by_scope.get("endpoint", ()), *pack.participant_rules)
    )
    own = {bound.rule.code for bound in rules}
    return [
        replace(one, finding=replace(one.finding, severity=Severity.WARNING))
        if one.finding.code not in own and one.finding.verdict and one.finding.severity is Severity.ERROR
        else one
        for one in made
    ]


def nothing_compared(system: System, endpoints: Sequence[Resolved]) -> list[Finding]:
    """Report that no endpoint has a partner; where all partners are elsewhere, that is expected."""
    count, external = len(endpoints), sum(1 for each in endpoints if each.external)
    ends = f"no publisher meets a subscriber among {plural(count, 'endpoint')}" if count else "no endpoint is judged"
    message = f"{ends}, so nothing was compared"
    expected = system.partial or system.hypothetical or (count and external == count)
    advice = place = None
    if not system.endpoints:
        first = min(system.participants.values(), key=lambda each: each.id, default=None)
        advice = "state who publishes and who subscribes: nothing does"
        if first is not None:
            place = first.place
            advice = f"write below `{first.id}` what it does: `publishes: {{TOPIC: }}` or `subscribes: {{TOPIC: }}`"
    return [core_finding("CQ404", message, place=place, severity=Severity.NOTE if expected else None, help=advice)]


def merged_by_key(made: Mapping[TopicKey, Sequence[FindingDraft]], again: Memo = without_memo) -> list[FindingDraft]:
    """Collect the findings of topics; combine those that several topics share, which most are not."""
    found: list[FindingDraft] = []
    by_key: dict[tuple[Any, ...], list[FindingDraft]] = {}
    for key in sorted(made):
        for one in made[key]:
            if one.merge_key[0] == "own":
                found.append(one)
            else:
                by_key.setdefault(one.merge_key, []).append(one)
    return found + [same[0] if len(same) == 1 else again(_as_one, same) for same in by_key.values()]


def _as_one(made: Sequence[FindingDraft]) -> FindingDraft:
    return replace(made[0], finding=merged([one.finding for one in made]))


def templates_of(system: System, endpoints: Iterable[Resolved]) -> dict[str, str]:
    """Return the templates of members, by id."""
    of: dict[str, str] = {each.id: each.template for each in system.participants.values() if each.template is not None}
    return of | {
        each.id: each.representative.template for each in endpoints if each.representative.template is not None
    }


_OF_TOPICS: Final = frozenset(("CQ401", "CQ402", "CQ403", "CQ406"))


def _once_each(findings: list[Finding], again: Memo) -> list[Finding]:
    """Merge equal findings of the core about the topics of instances."""
    alike: dict[object, list[Finding]] = {}
    for finding in findings:
        alike.setdefault(_alike_of_instances(finding) or id(finding), []).append(finding)
    return [same[0] if len(same) == 1 else again(merged, same) for same in alike.values()]


def _alike_of_instances(finding: Finding) -> tuple[Any, ...] | None:
    """Return the merge key of a finding about topics of instances; None for any other."""
    if finding.code not in _OF_TOPICS or not any(side.templates for side in finding.sides):
        return None
    sides = tuple((side.role, side.templates, side.place) for side in finding.sides)
    return (finding.code, finding.severity, finding.accepted, sides)


def _with_instances(finding: Finding, of: Mapping[str, str]) -> Finding:
    """Add the templates of members that are instances."""
    if not any(member in of for side in finding.sides for member in side.members):
        return finding
    sides = (
        replace(side, templates=tuple(sorted({of.get(member, member) for member in side.members})))
        if any(member in of for member in side.members)
        else side
        for side in finding.sides
    )
    return replace(finding, sides=tuple(sides))


def _topics(results: Mapping[TopicKey, TopicResult]) -> int:
    """Return the number of topics; a filter whose subscribers are all on other topics does not count."""
    if not any(result.lonely for result in results.values()):
        return len(results)
    met = {name for result in results.values() for group in result.groups for name in group.subscribers}
    return sum(
        1
        for result in results.values()
        if result.groups or not result.lonely or any(each.id not in met for each in result.lonely)
    )


def stated_findings(
    system: System, resolved: ResolvedSystem, context: CheckContext, problems: Sequence[Finding]
) -> list[Finding]:
    """Return findings that no topic decides: those of importers, of resolving, and about the whole system."""
    return [
        *import_findings(system, context),
        *resolved.findings,
        *problems,
        *unknown_starts(system),
        *(
            core_finding("CQ603", f"`severities` names rule `{name}`, which no installed pack has")
            for name in system.severities
            if context.find_rule(name) is None
        ),
    ]


def import_findings(system: System, context: CheckContext) -> list[Finding]:
    """Return what importers report."""
    return [
        Finding(
            code=note.code,
            name=info.name if (info := context.find_rule(note.code)) else "import-note",
            severity=Severity(note.severity),
            message=note.message,
            sides=(
                Side(
                    "endpoint" if note.endpoint else "system",
                    (note.endpoint,) if note.endpoint else (),
                    place=note.place,
                ),
            ),
            help=note.help,
        )
        for note in system.notes
    ]


def check_system(
    system: System, context: CheckContext, step: Callable[[int, int], None] = lambda _done, _all: None
) -> Report:
    """Check one system.

    Args:
        system: the system.
        context: the packs, and assumptions for settings that the system does not state.
        step: called before each topic with how many of how many are judged.
    """
    report = _checked(system, context, step)
    if not system.profiles:
        return report
    from cqos_core.checking.hypothetical_pairs import unused_profiles

    apart = unused_profiles(system, context.default_protocol)
    return report if apart is None else _with_unused(report, _checked(apart, context))


def _with_unused(report: Report, apart: Report) -> Report:
    """Add findings about profiles that no endpoint uses, and the number of pairs that were tried.

    Notes and unknown verdicts matter to the user of a profile, and are left out. A cause that the report has already is no second finding, and
    the topics on which profiles are tried have no names of their own to find fault with.
    """
    from cqos_core.model.codes import CODES

    known = {_cause(each) for each in report.findings}
    wrong = [
        each
        for each in apart.findings
        if (each.severity is Severity.ERROR or each.verdict is Verdict.INCOMPATIBLE)
        and _cause(each) not in known
        and (each.code in CODES or any(side.facts for side in each.sides))
    ]
    findings = in_order([*report.findings, *wrong]) if wrong else report.findings
    return replace(report, findings=findings, hypothetical=apart.hypothetical)


def _cause(finding: Finding) -> tuple[object, ...]:
    """Return the rule and the places of the values that it found fault with, or its message where it has none."""
    places = {fact.place for side in finding.sides for fact in side.facts if fact.place is not None}
    return (finding.code, frozenset(places) or finding.message)


def _checked(
    system: System, context: CheckContext, step: Callable[[int, int], None] = lambda _done, _all: None
) -> Report:
    """Check one system without the profiles that no endpoint uses."""
    with gc_paused(len(system.endpoints)):
        pipeline = Pipeline(system, context)
        judged = judge_topics(pipeline, step=step)
        return assemble(pipeline.system, pipeline.resolver.result, judged.results, context, judged.problems)


class JudgedTopics(NamedTuple):
    """The topics of a system, judged.

    Attributes:
        teams: the rules of the team, by id of the pack.
        problems: findings about these rules, and about bridges, chains, links and behaviour.
        excused: the acceptances that name endpoints.
    """

    results: dict[TopicKey, TopicResult]
    teams: Mapping[int, NameIndex[TeamCheck]]
    problems: list[Finding]
    excused: NameIndex[int]


def judge_topics(
    pipeline: Pipeline,
    judged: Callable[[TopicKey, Sequence[Resolved], Callable[[], TopicResult]], TopicResult] | None = None,
    step: Callable[[int, int], None] = lambda _done, _all: None,
) -> JudgedTopics:
    """Judge all topics; ``judged`` may know the result of one, or calls its last argument to judge it."""
    system = pipeline.system
    teams: Mapping[int, NameIndex[TeamCheck]] = {}
    problems: list[Finding] = []
    if system.checks:
        from cqos_core.checking.team import bind_checks, words_asked

        teams, problems = bind_checks(system, pipeline.where.find_pack, pipeline.where.default_protocol)
        pipeline.asked = words_asked(teams)
    excused = naming_endpoints(system.accept)
    results: dict[TopicKey, TopicResult] = {}
    topics = pipeline.topics
    for number, (key, endpoints) in enumerate(topics.items()):
        step(number, len(topics))
        if judged is None:
            results[key] = check_topic(endpoints, excused, teams)
        else:
            results[key] = judged(key, endpoints, partial(check_topic, endpoints, excused, teams))
    if spans_topics(system):
        problems += _over_topics(pipeline)
    return JudgedTopics(results, teams, problems, excused)


def spans_topics(system: System) -> bool:
    """Whether findings of a system rest on several topics: on bridges, chains, links, or control flow."""
    return bool(system.bridges or system.chains or system.links or system.flows)


def _over_topics(pipeline: Pipeline) -> Iterator[Finding]:
    """Yield findings that depend on several topics."""
    system = pipeline.system
    # Most systems have none of these, and their modules are a tenth of the time of a small check.
    if system.bridges:
        from cqos_core.behaviour.paths.bridge_findings import bridge_findings

        yield from bridge_findings(pipeline)
    if system.chains:
        from cqos_core.behaviour.paths.chain_findings import chain_findings

        yield from chain_findings(pipeline)
    if system.links:
        from cqos_core.behaviour.paths.budget_findings import budget_findings

        yield from budget_findings(pipeline)
    if system.flows:
        from cqos_core.behaviour.findings import behaviour_findings
        from cqos_core.checking.value_fixes import with_judged_fixes

        yield from with_judged_fixes(behaviour_findings(pipeline), pipeline.topics)
