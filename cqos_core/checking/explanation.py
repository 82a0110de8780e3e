"""Explaining one publisher and one subscriber: every policy, what the subscriber gets, and the way over bridges."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.checking.checker import check_system, participant_findings
from cqos_core.checking.findings import Draft, fact, make, one_per_cause
from cqos_core.checking.topic import check_topic, verdict_between
from cqos_core.matching.assumptions import assumptions
from cqos_core.matching.bridging import linked
from cqos_core.matching.delivery_paths import DUPLICATE_FREE, Arrivals, repetition
from cqos_core.matching.derived_guarantees import derive, faults_between, give, over
from cqos_core.matching.hops import Hop
from cqos_core.matching.judge import already_told, judge_endpoint, judge_pair, of_end, undecided_meeting
from cqos_core.matching.pairing import EndpointGroup, MatchedTopic, apart, group
from cqos_core.matching.peer_values import settle
from cqos_core.matching.routes import expanded
from cqos_core.model.problems import CqosError
from cqos_core.model.remarks import core_finding, suggestion
from cqos_core.model.report import (
    Group,
    Guarantee,
    GuaranteeCell,
    HopReport,
    PairReport,
    PolicyComparison,
    Severity,
    Verdict,
    later,
)
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.guarantee import LINK
from cqos_core.resolving.resolve import Resolver, resolve

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from cqos_core.checking.checker import Context
    from cqos_core.matching.delivery_paths import Pair
    from cqos_core.matching.derived_guarantees import DerivedGuarantees
    from cqos_core.model.report import Finding, Report
    from cqos_core.model.system import System
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.resolved import Resolved


def explain_pair(system: System, publisher: str, subscriber: str, where: Context) -> PairReport:
    """Explain one pair of a system that is already read; see `explain`."""
    whole, links = expanded(system, where.find_pack, where.default_protocol, where.most_endpoints)
    resolver = Resolver(whole, where.find_pack, where.default_protocol)
    resolved = resolver.run()
    by_topic, hops = linked(links, resolver)
    offering = _find(resolved.endpoints, publisher, PUBLISHER)
    requesting = _find(resolved.endpoints, subscriber, SUBSCRIBER)
    everybody = _meeting_place(by_topic, offering, requesting)
    strangers = offering.pack is requesting.pack and apart(offering.profile, requesting.profile)
    arrivals = Arrivals(hops, by_topic)
    if (everybody is None or strangers) and (found := arrivals.ways(offering).get(requesting.id)):
        report = _path_report(found[0], by_topic, check_system(system, where))
        return _with_repetition(report, offering, requesting, arrivals)
    if everybody is None:
        raise CqosError(
            f"publisher `{offering.id}` is on {offering.pack.id} topic `{offering.shown}` and subscriber `{requesting.id}` on "
            f"{requesting.pack.id} topic `{requesting.shown}`: they never meet"
        )
    whole_topic = _settled(everybody)
    pair = _pair_of(whole_topic, offering, requesting)
    verdict, refusing = verdict_between(whole_topic, offering, requesting)
    ends = [endpoint for endpoint in (offering, requesting) if endpoint.carried is None]
    refused = [each for each in participant_findings(ends) if each.verdict is not None]
    report = _pair_report(
        pair,
        verdict,
        [
            *refused,
            *(each.finding for each in refusing),
            *(f for f in resolved.findings if not f.endpoints or set(f.endpoints) & {offering.id, requesting.id}),
        ],
    )
    group_of_pair = Group(offering.shown, (offering.id,), (requesting.id,), verdict, whole_topic.pack.id)
    packs = {each.pack.id: each.pack for each in resolved.endpoints}
    assumed = assumptions([offering, requesting], [group_of_pair], report.findings, packs)
    report = replace(report, assumed=assumed) if assumed else report
    return _with_repetition(report, offering, requesting, arrivals) if hops else report


def settled_pair(system: System, publisher: str, subscriber: str, where: Context) -> tuple[MatchedTopic, Resolver]:
    """Return a topic with these two endpoints alone, their values settled among all others, and what resolved them.

    Raises:
        CqosError: there is no such endpoint, or the two never meet on one topic.
    """
    whole, links = expanded(system, where.find_pack, where.default_protocol)
    resolver = Resolver(whole, where.find_pack, where.default_protocol)
    endpoints = resolver.run().endpoints
    by_topic, _ = linked(links, resolver)
    offering, requesting = _find(endpoints, publisher, PUBLISHER), _find(endpoints, subscriber, SUBSCRIBER)
    everybody = _meeting_place(by_topic, offering, requesting)
    if everybody is None:
        raise CqosError(f"`{publisher}` and `{subscriber}` do not meet on one topic")
    return _pair_of(_settled(everybody), offering, requesting), resolver


def _settled(everybody: Sequence[Resolved]) -> MatchedTopic:
    topic = group(everybody)
    settle(topic)
    return topic


def _pair_of(topic: MatchedTopic, offering: Resolved, requesting: Resolved) -> MatchedTopic:
    """Return a topic with two of its endpoints alone."""
    ends = [_only(topic.publishers, offering.id)], [_only(topic.subscribers, requesting.id)]
    return MatchedTopic(topic.key, topic.shown, topic.pack, *ends)


def _with_repetition(report: PairReport, offering: Resolved, requesting: Resolved, arrivals: Arrivals) -> PairReport:
    """Tell of a pair, or a way, that its samples arrive over another way too."""
    found = arrivals.repeats(offering).get(requesting.id)
    if found is None:
        return report
    sure, ways = found
    needed = DUPLICATE_FREE in requesting.profile.needs
    finding = core_finding(
        "CQ507",
        repetition(offering.id, f"`{requesting.id}`", ways, sure=sure),
        place=requesting.endpoint.place,
        role=SUBSCRIBER,
        members=[requesting.id],
        topic=requesting.shown,
        severity=Severity.NOTE if not needed else Severity.ERROR if sure else Severity.WARNING,
    )
    guarantees = [
        replace(
            each,
            value="no" if sure or each.value == "no" else "unknown",
            survives=(),
            lost=(*each.lost, (finding.code, finding.message)),
            cells=tuple(
                GuaranteeCell(
                    cell.fault,
                    "no" if sure or cell.value == "no" else "unknown",
                    (*cell.lost, (finding.code, finding.message)),
                )
                for cell in each.cells
            ),
        )
        if each.word == DUPLICATE_FREE
        else each
        for each in report.guarantees
    ]
    others = (each for each in report.findings if each.code != finding.code)
    return replace(report, findings=(*others, finding), guarantees=tuple(guarantees))


def endpoints_of(system: System, where: Context) -> list[Resolved]:
    """Return all endpoints of a system, those of bridges too, with their values."""
    whole, _ = expanded(system, where.find_pack, where.default_protocol, where.most_endpoints)
    return resolve(whole, where.find_pack, where.default_protocol).endpoints


def _find(endpoints: Sequence[Resolved], name: str, role: str) -> Resolved:
    matching = [endpoint for endpoint in endpoints if endpoint.id == name]
    if not matching:
        known = [endpoint.id for endpoint in endpoints if endpoint.role == role]
        raise CqosError(f"there is no {role} `{name}`; {suggestion(name, known)}")
    if matching[0].role != role:
        raise CqosError(f"`{name}` is a {matching[0].role}, not a {role}")
    return matching[0]


def _meeting_place(
    by_topic: Mapping[tuple[str, str], list[Resolved]], offering: Resolved, requesting: Resolved
) -> list[Resolved] | None:
    """The endpoints of the topic that both are on, their own or the wire's; None where they never meet."""
    wanted = {offering.id, requesting.id}
    own = (offering.pack.id, offering.key or "")
    if own == (requesting.pack.id, requesting.key):
        return by_topic.get(own)
    return next((found for found in by_topic.values() if wanted <= {endpoint.id for endpoint in found}), None)


def _only(groups: Sequence[EndpointGroup], endpoint_id: str) -> EndpointGroup:
    members, endpoint = next(
        (members, endpoint) for members in groups for endpoint in members.endpoints if endpoint.id == endpoint_id
    )
    return members.only([endpoint])


def _pair_report(topic: MatchedTopic, verdict: Verdict, further: Sequence[Finding]) -> PairReport:
    publisher, subscriber = topic.publishers[0], topic.subscribers[0]
    reasons = apart(publisher.profile, subscriber.profile)
    judgement = judge_pair(publisher.profile, subscriber.profile)
    sides_of_pair = ((publisher, PUBLISHER), (subscriber, SUBSCRIBER))
    # A guarantee is one of pairs that fit.
    refused = any(finding.verdict is Verdict.INCOMPATIBLE for finding in further) or any(
        at_best is Verdict.INCOMPATIBLE
        for members, role in sides_of_pair
        for at_best, _ in of_end(members.profile, role, members.observed, members.wired)
    )
    meetings = (
        undecided_meeting(bound, publisher.profile, subscriber.profile) for bound in topic.pack.by_scope["meets"]
    )
    undecided = [each for each in meetings if each is not None]
    drafts = [
        Draft(topic, spoken, {publisher: None}, {subscriber: None}, 1)
        for spoken in (() if reasons else (*undecided, *judgement.spoken))
        if not already_told(spoken, publisher.profile, subscriber.profile)
        and not (refused and spoken.bound.rule.guarantee)
    ]
    for members, role in sides_of_pair:
        for spoken in judge_endpoint(members.profile, role, members.observed):
            if not spoken.unknown or spoken.failed is not None:
                sides = ({members: None}, {}) if role == PUBLISHER else ({}, {members: None})
                drafts.append(Draft(topic, spoken, *sides))
    kept = [f for f in further if f.code not in {"CQ401", "CQ402"}]
    found = [*kept, *(one.finding for one in one_per_cause([make(draft) for draft in drafts]))]
    if reasons:
        result = check_topic([replace(end.first, external=False) for end in (publisher, subscriber)])
        found += [one.finding for one in result.made if one.finding.code in {bound.rule.code for bound in reasons}]
    return PairReport(
        verdict=Verdict.UNKNOWN if reasons else verdict,
        findings=tuple(sorted(found, key=lambda each: (each.severity.rank, each.code, each.message))),
        policies=later(lambda: _comparisons(topic, publisher, subscriber)),
        guarantees=()
        if reasons
        else later(
            lambda: _told(
                give(publisher.profile, subscriber.profile), faults_between(publisher.profile, subscriber.profile)
            )
        ),
        derived=() if reasons else derive(publisher.profile, subscriber.profile),
    )


def _told(given: Iterable[DerivedGuarantees], faults: Collection[str]) -> tuple[Guarantee, ...]:
    return tuple(
        Guarantee(
            each.word.name,
            each.text,
            each.survives,
            _reasons(each.lost),
            tuple(
                GuaranteeCell(fault, each.word.text(cell.value), _reasons(cell.lost), cell.proven, cell.derived)
                for fault, cell in each.cells.items()
                if fault == LINK or fault in faults
            ),
        )
        for each in given
    )


def _reasons(lost: Iterable[Rule]) -> tuple[tuple[str, str], ...]:
    return tuple((rule.code, rule.because) for rule in lost)


def _path_report(
    way: Sequence[Pair | Hop], by_topic: Mapping[tuple[str, str], list[Resolved]], report: Report
) -> PairReport:
    """Report on two endpoints that meet over bridges: each pair on the way, and what is left in the end."""
    bridges = [each for each in way if isinstance(each, Hop)]
    pairs = [each for each in way if not isinstance(each, Hop)]
    hops, given = [], []
    befall: set[str] = set()
    for index, (publisher, subscriber) in enumerate(pairs):
        beside = next(each for each in by_topic.values() if any(e is publisher for e in each))
        topic = _settled(beside)
        ends = _only(topic.publishers, publisher.id), _only(topic.subscribers, subscriber.id)
        given.append(give(ends[0].profile, ends[1].profile))
        faults = faults_between(ends[0].profile, ends[1].profile)
        befall.update(faults)
        hops.append(
            HopReport(
                publisher.id,
                subscriber.id,
                publisher.shown,
                publisher.pack.id,
                verdict_between(topic, publisher, subscriber)[0],
                _told(given[-1], faults),
                bridges[index].bridge.id if index < len(bridges) else None,
            )
        )
    members = {end.id for pair in pairs for end in pair}
    return PairReport(
        verdict=max((hop.verdict for hop in hops), key=lambda verdict: verdict.rank),
        findings=tuple(each for each in report.findings if each.endpoints and set(each.endpoints) <= members),
        guarantees=_told(over(given, carried=all(hop.carries_liveliness for hop in bridges)), befall),
        hops=tuple(hops),
        assumed=report.assumed,
    )


def _comparisons(
    topic: MatchedTopic, publisher: EndpointGroup, subscriber: EndpointGroup
) -> Iterable[PolicyComparison]:
    """One line per endpoint policy, with the verdict of the pair rules that compare it."""
    spoken = {each.bound.rule.code: each for each in judge_pair(publisher.profile, subscriber.profile).spoken}
    rules = [
        bound
        for bound in topic.pack.by_scope.get("pair", ())
        if bound.rule.kind == "requires" and not bound.rule.guarantee
    ]
    for index, policy in enumerate(topic.pack.policies):
        if policy.level != "endpoint" or policy.default is None:
            continue
        over = [bound for bound in rules if any(use.index == index for use in bound.bound.uses)]
        said = [spoken[bound.rule.code] for bound in over if bound.rule.code in spoken]
        verdict = None
        if over:
            verdict = Verdict.COMPATIBLE
            if said:
                doubtful = all(each.unknown or each.bound.rule.doubt for each in said)
                verdict = Verdict.UNKNOWN if doubtful else Verdict.INCOMPATIBLE
        yield PolicyComparison(
            policy.name,
            fact(publisher.first, publisher.profile, index),
            fact(subscriber.first, subscriber.profile, index),
            verdict,
            tuple(bound.rule.code for bound in over),
        )
