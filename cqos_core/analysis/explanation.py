"""Explains one publisher and one subscriber: every policy, the guarantees, and the path over bridges."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING

from cqos_core.behaviour.findings import UNMET, findings_of, flow_model_of
from cqos_core.behaviour.paths.delivery_paths import DUPLICATE_FREE, DeliveryPaths, repetition
from cqos_core.behaviour.timer_findings import mean_periods
from cqos_core.checking.assumptions import assumptions
from cqos_core.checking.checker import check_system, import_findings, participant_findings
from cqos_core.checking.findings import draft_finding, one_per_cause
from cqos_core.checking.topic_check import check_topic, refusing, settled, verdict_between
from cqos_core.checking.value_fixes import with_judged_fixes
from cqos_core.language.values import Anything
from cqos_core.matching.hops import Hop
from cqos_core.matching.judge import (
    already_reported,
    failed_match_conditions,
    judge_endpoint,
    judge_pair,
    of_end,
    undecided_meeting,
)
from cqos_core.matching.pair_guarantees import derived_values, faults_between, guarantees_of, over_hops
from cqos_core.matching.pair_outcomes import outcome_of
from cqos_core.matching.pipeline import Pipeline
from cqos_core.matching.rule_hits import Hit
from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
from cqos_core.matching.topic_outcomes import QUIET
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.lazy_tuple import lazy_tuple
from cqos_core.model.problems import CqosError
from cqos_core.model.report import Guarantee, GuaranteeCell, HopReport, PairReport, PolicyComparison
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.guarantee import LINK
from cqos_core.resolving.policy_comparison import compare_policies

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from cqos_core.behaviour.paths.delivery_paths import Pair
    from cqos_core.matching.pair_guarantees import PairGuarantee
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Assumption, Report
    from cqos_core.model.settings import Place
    from cqos_core.model.system import System
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_core.resolving.resolver import Resolver


def explain_pair(system: System, publisher: str, subscriber: str, where: CheckContext) -> PairReport:
    """Explain one pair of a system that is already read; see `explain`. All but the verdict is found out when it is read."""
    return explain_in_pipeline(Pipeline(system, where), publisher, subscriber)


def explain_ends(offering: Resolved, requesting: Resolved) -> PairReport:
    """Explain two endpoints that are a whole system and that resolving reported nothing about; see `explain_pair`."""
    return _Pair(offering, requesting).report()


def ends_alone(pipeline: Pipeline, publisher: str, subscriber: str) -> tuple[Resolved, Resolved] | None:
    """Return two endpoints where nothing but their own values decides about them, and nothing is reported of these."""
    pair = _found(pipeline, publisher, subscriber)
    resolver = pipeline.resolver
    clean = not (pipeline.hops or resolver.result.findings or resolver.completed)
    return (pair.offering, pair.requesting) if clean and pair.alone else None


def explain_in_pipeline(pipeline: Pipeline, publisher: str, subscriber: str) -> PairReport:
    """Explain one pair of a system on its way; see `explain_pair`."""
    report, drawn = _explained(pipeline, publisher, subscriber), flow_model_of(pipeline)
    if drawn is None:
        return report
    behaviour = with_judged_fixes(findings_of(drawn, pipeline.system), pipeline.topics)
    found = [each for each in behaviour if {publisher, subscriber} & {*each.endpoints}]
    excluded = any(each.code in UNMET and subscriber in each.endpoints for each in found)
    return replace(
        report,
        verdict=Verdict.INCOMPATIBLE if excluded else report.verdict,
        findings=(*report.findings, *found),
        derived=(*report.derived, *mean_periods(drawn, publisher, subscriber)),
    )


def _explained(pipeline: Pipeline, publisher: str, subscriber: str) -> PairReport:
    system, where = pipeline.stated, pipeline.where
    pair = _found(pipeline, publisher, subscriber)
    if not pipeline.hops:
        return pair.report()
    arrivals = DeliveryPaths(pipeline.hops, pipeline.topics)
    offering, requesting = pair.offering, pair.requesting
    strangers = offering.pack is requesting.pack and failed_match_conditions(offering.profile, requesting.profile)
    way = arrivals.ways(offering).get(requesting.id) if pair.everybody is None or strangers else None
    report = _path_report(way[0], pipeline.topics, lambda: check_system(system, where)) if way else pair.report()
    return _with_repetition(report, offering, requesting, arrivals)


def settled_pair(system: System, publisher: str, subscriber: str, where: CheckContext) -> tuple[MatchedTopic, Resolver]:
    """Return a topic with these two endpoints alone, their values settled among all others, and their resolver.

    Raises:
        CqosError: there is no such endpoint, or the two never meet on one topic.
    """
    pipeline = Pipeline(system, where)
    pair = _found(pipeline, publisher, subscriber)
    if pair.everybody is None:
        raise CqosError(f"`{publisher}` and `{subscriber}` do not meet on one topic")
    return pair.topic, pipeline.resolver


def _with_repetition(
    report: PairReport, offering: Resolved, requesting: Resolved, arrivals: DeliveryPaths
) -> PairReport:
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


def endpoints_of(system: System, where: CheckContext) -> Sequence[Resolved]:
    """Return all endpoints of a system, those of bridges too, with their values."""
    return Pipeline(system, where).endpoints


def _find(endpoints: Sequence[Resolved], name: str, role: str) -> Resolved:
    matching = [endpoint for endpoint in endpoints if endpoint.id == name]
    if not matching:
        known = [endpoint.id for endpoint in endpoints if endpoint.role == role]
        raise CqosError(f"there is no {role} `{name}`; {suggestion(name, known)}")
    if matching[0].role != role:
        raise CqosError(f"`{name}` is a {matching[0].role}, not a {role}")
    return matching[0]


def _only(groups: Sequence[EndpointGroup], endpoint_id: str) -> EndpointGroup:
    members, endpoint = next(
        (members, endpoint) for members in groups for endpoint in members.endpoints if endpoint.id == endpoint_id
    )
    return members.only([endpoint])


def _loudest_first(each: Finding) -> tuple[int, str, str]:
    return each.severity.rank, each.code, each.message


def _found(pipeline: Pipeline, publisher: str, subscriber: str) -> _Pair:
    """Return two endpoints of a system.

    Raises:
        CqosError: there is no such endpoint.
    """
    endpoints = pipeline.endpoints
    return _Pair(_find(endpoints, publisher, PUBLISHER), _find(endpoints, subscriber, SUBSCRIBER), pipeline)


class _Pair:
    """A publisher and a subscriber with the parts of their explanation, each computed when it is read.

    They are of a system on its way. Without one they are the whole system, and resolving reported nothing.
    """

    def __init__(self, offering: Resolved, requesting: Resolved, pipeline: Pipeline | None = None) -> None:
        self.offering, self.requesting = offering, requesting
        self._pipeline = pipeline
        self._endpoints = (offering, requesting) if pipeline is None else pipeline.endpoints
        self._reported = () if pipeline is None else pipeline.resolver.result.findings
        # Taken first, as values that are read replace parts.
        parts = [end.parts for end in (self.offering, self.requesting)]
        plain = self.alone and not (pipeline and pipeline.resolver.completed)
        self._parts = parts if plain else []
        self._outcome = outcome_of(self.offering, self.requesting) if plain else None
        self._quiet = self._outcome is QUIET

    @property
    def alone(self) -> bool:
        """Whether nothing but the values of the two decides."""
        ends = (self.offering, self.requesting)
        return (
            len(self._endpoints) == len(ends)
            and self.offering.key == self.requesting.key is not None
            and self.offering.pack is self.requesting.pack
            and not any(end.like.from_peers or end.endpoint.observed for end in ends)
        )

    @cached_property
    def everybody(self) -> list[Resolved] | None:
        """The endpoints of the topic that both are on, their own or the wire's; None where they never meet."""
        if self._pipeline is None:
            return [self.offering, self.requesting]
        topics = self._pipeline.topics
        own = (self.offering.pack.id, self.offering.key or "")
        if own == (self.requesting.pack.id, self.requesting.key):
            return topics.get(own)
        wanted = {self.offering.id, self.requesting.id}
        return next((each for each in topics.values() if wanted <= {end.id for end in each}), None)

    @cached_property
    def whole(self) -> MatchedTopic:
        """The topic of the two with all that is on it."""
        if self.everybody is None:
            raise CqosError(
                f"publisher `{self.offering.id}` is on {self.offering.pack.id} topic `{self.offering.shown}` and subscriber "
                f"`{self.requesting.id}` on {self.requesting.pack.id} topic `{self.requesting.shown}`: they never meet"
            )
        return settled(self.everybody)

    @cached_property
    def topic(self) -> MatchedTopic:
        """The topic with the two alone."""
        ends = [_only(self.whole.publishers, self.offering.id)], [_only(self.whole.subscribers, self.requesting.id)]
        return MatchedTopic(self.whole.key, self.whole.shown, self.whole.pack, *ends)

    def report(self) -> PairReport:
        """Report on the two."""
        alone = self.alone
        ends = (self.offering, self.requesting) if alone else (self.topic.publishers[0], self.topic.subscribers[0])
        a, b = (end.profile for end in ends)
        strangers = not self._quiet and bool(failed_match_conditions(a, b))
        known = self._outcome
        findings = lazy_tuple(self.findings)
        return PairReport(
            verdict_between(self.whole, self.offering, self.requesting) if known is None else known.verdict,
            findings,
            lazy_tuple(lambda: self.comparisons(ends)),
            () if strangers else lazy_tuple(lambda: _guarantees(guarantees_of(a, b), faults_between(a, b))),
            derived=() if strangers else lazy_tuple(lambda: derived_values(a, b)),
            assumed=lazy_tuple(lambda: self.assumed(findings)),
        )

    def assumed(self, findings: Iterable[Finding]) -> tuple[Assumption, ...]:
        """Return the assumptions for options that the system leaves open."""
        ends = [self.offering, self.requesting]
        packs = {each.pack.id: each.pack for each in self._endpoints}
        return assumptions([each.participant for each in ends], ends, [each.id for each in ends], findings, packs)

    def findings(self) -> list[Finding]:
        """Return the findings of both ends, of the pair, and of the topic if that refuses them."""
        if self._quiet and not self._reported:
            found = [f for f in participant_findings([self.offering, self.requesting]) if f.verdict is not None]
            return sorted(found, key=_loudest_first)
        topic, ends = self.topic, (self.topic.publishers[0], self.topic.subscribers[0])
        a, b = (members.profile for members in ends)
        concerned = {self.offering.id, self.requesting.id}
        found = [
            *(
                f
                for f in participant_findings([each.first for each in ends if not each.wired])
                if f.verdict is not None
            ),
            *(each.finding for each in refusing(self.whole, self.offering, self.requesting)),
            *(f for f in self._reported if not f.endpoints or set(f.endpoints) & concerned),
            *self._imported(ends),
        ]
        reasons = failed_match_conditions(a, b)
        # A guarantee is one of pairs that fit.
        unfit = any(finding.verdict is Verdict.INCOMPATIBLE for finding in found) or any(
            at_best is Verdict.INCOMPATIBLE
            for members in ends
            for at_best, _ in of_end(members.profile, members.first.role, members.observed, members.wired)
        )
        undecided = filter(None, (undecided_meeting(bound, a, b) for bound in topic.pack.by_scope["meets"]))
        hits = [
            Hit(violation, {ends[0]: None}, {ends[1]: None}, 1)
            for violation in (() if reasons else (*undecided, *judge_pair(a, b).violations))
            if not already_reported(violation, a, b) and not (unfit and violation.bound.rule.guarantee)
        ]
        for members in ends:
            for violation in judge_endpoint(members.profile, members.first.role, members.observed):
                if not violation.unknown or violation.failed is not None:
                    hits.append(Hit(violation))
                    hits[-1].side(members.first.role)[members] = None
        found += (one.finding for one in one_per_cause([draft_finding(topic, hit) for hit in hits]))
        if reasons:
            result = check_topic([replace(end.first, external=False) for end in ends])
            found += [one.finding for one in result.made if one.finding.code in {bound.rule.code for bound in reasons}]
        return sorted(found, key=_loudest_first)

    def _imported(self, ends: Iterable[EndpointGroup]) -> list[Finding]:
        """Return what importers report that leaves anything of the two open: where a value stands, and what has no place of theirs."""
        if self._pipeline is None:
            return []
        own = {self.offering.id, self.requesting.id}
        codes = {code for end in ends for code in (*end.profile.unread, *end.profile.refused)}
        every = import_findings(self._pipeline.system, self._pipeline.where) if codes else ()
        found = [each for each in every if each.code in codes and (not each.endpoints or own & {*each.endpoints})]
        places = {place for end in (self.offering, self.requesting) for place in _places_not_known(end)}
        near = [each for each in found if each.endpoints or (each.code, each.place) in places]
        told = {each.code for each in near}
        return [*near, *(each for each in found if each.code not in told)]

    def comparisons(self, ends: Sequence[Resolved | EndpointGroup]) -> Iterable[PolicyComparison]:
        """Return one line per endpoint policy and stated fact, with the verdict of the pair rules that compare it."""
        sides = [(end.first if isinstance(end, EndpointGroup) else end, end.profile) for end in ends]
        violations = () if self._quiet else judge_pair(*[profile for _, profile in sides]).violations
        doubtful = {each.bound.rule.code: each.unknown or each.bound.rule.doubt for each in violations}
        return compare_policies(sides, self._parts, doubtful)


def _places_not_known(end: Resolved) -> Iterator[tuple[str, Place | None]]:
    """Yield where values stand that are not known, each with the code of the finding that says why."""
    for index, value in end.profile.frame.open.items():
        if isinstance(value, Anything) and value.code:
            yield value.code, end.origin(index)[1]


def _guarantees(given: Iterable[PairGuarantee], faults: Collection[str]) -> tuple[Guarantee, ...]:
    befalling = frozenset((LINK, *faults))
    return tuple([_guarantee(each, befalling) for each in given])


@lru_cache(maxsize=10_000)
def _guarantee(given: PairGuarantee, faults: frozenset[str]) -> Guarantee:
    cells = [
        GuaranteeCell(fault, given.word.text(cell.value), _reasons(cell.lost), cell.proven, cell.derived)
        for fault, cell in given.cells.items()
        if fault in faults
    ]
    return Guarantee(given.word.name, given.text, given.survives, _reasons(given.lost), tuple(cells))


def _reasons(lost: Iterable[Rule]) -> tuple[tuple[str, str], ...]:
    return tuple([(rule.code, rule.because) for rule in lost])


def _path_report(
    way: Sequence[Pair | Hop], by_topic: Mapping[tuple[str, str], list[Resolved]], check: Callable[[], Report]
) -> PairReport:
    """Report on two endpoints that are connected over bridges: each pair on the path, and the guarantees at its end."""
    report = cache(check)
    bridges = [each for each in way if isinstance(each, Hop)]
    pairs = [each for each in way if not isinstance(each, Hop)]
    hops, given = [], []
    befall: set[str] = set()
    for index, (publisher, subscriber) in enumerate(pairs):
        topic = settled(next(each for each in by_topic.values() if any(e is publisher for e in each)))
        ends = _only(topic.publishers, publisher.id), _only(topic.subscribers, subscriber.id)
        given.append(guarantees_of(ends[0].profile, ends[1].profile))
        faults = faults_between(ends[0].profile, ends[1].profile)
        befall.update(faults)
        hops.append(
            HopReport(
                publisher.id,
                subscriber.id,
                publisher.shown,
                publisher.pack.id,
                verdict_between(topic, publisher, subscriber),
                _guarantees(given[-1], faults),
                bridges[index].bridge.id if index < len(bridges) else None,
            )
        )
    members = {end.id for pair in pairs for end in pair}
    codes = {code for pair in pairs for end in pair for code in (*end.profile.unread, *end.profile.refused)}
    return PairReport(
        verdict=max((hop.verdict for hop in hops), key=lambda verdict: verdict.rank),
        findings=lazy_tuple(
            lambda: [
                each
                for each in report().findings
                if (set(each.endpoints) <= members if each.endpoints else each.code in codes)
            ]
        ),
        guarantees=_guarantees(over_hops(given, carried=all(hop.carries_liveliness for hop in bridges)), befall),
        hops=tuple(hops),
        assumed=lazy_tuple(lambda: report().assumed),
    )
