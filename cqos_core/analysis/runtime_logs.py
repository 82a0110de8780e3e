"""Explains messages of running programs about incompatible endpoints by the pairs, rules and fixes of a system."""

from __future__ import annotations

from itertools import product
from operator import itemgetter
from typing import TYPE_CHECKING

from cqos_core.analysis.explanation import endpoints_of
from cqos_core.checking.checker import check_system
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Verdict
from cqos_core.model.grouping import grouped
from cqos_core.model.report import Pair
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.model.system import System
    from cqos_core.packs.log_mismatches import LogMismatch, Occurrence
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.resolved_endpoint import Resolved


@dataclass(frozen=True, slots=True)
class LogExplanation:
    """The explanation of one message of programs.

    Attributes:
        rules: of the pack, over the policy that is named.
        pairs: of the system, that are meant and not known to fit, each with its verdict.
        findings: of the system, why these pairs do not fit: all their policies, not only the one that is named.
        remark: why nothing, or not everything, could be found in the system; empty if there is nothing to remark.
    """

    occurrence: Occurrence
    rules: tuple[Rule, ...]
    pairs: tuple[Pair, ...] = ()
    findings: tuple[Finding, ...] = ()
    remark: str = ""


def rules_over(misfit: LogMismatch, pack: RulePack | None) -> tuple[Rule, ...]:
    """Return the rules that a pair breaks if the policy that is named is at fault."""
    if pack is None:
        return ()
    policies = pack.vocabulary.policies
    return tuple(
        bound.rule
        for bound in pack.by_scope.get("pair", ())
        if bound.rule.kind == "requires"
        and not bound.rule.guarantee
        and {policies[use.index].name for use in bound.bound.uses} & {*misfit.policies}
    )


def explain_alone(occurrences: Iterable[Occurrence], context: CheckContext) -> list[LogExplanation]:
    """Explain messages of programs without a system."""
    return [
        LogExplanation(each, rules_over(each.misfit, context.find_pack(each.misfit.protocol))) for each in occurrences
    ]


def explain_mismatches(
    occurrences: Iterable[Occurrence], system: System, context: CheckContext
) -> list[LogExplanation]:
    """Explain messages of programs by the pairs of a system."""
    known = _KnownEnds(endpoints_of(system, context), check_system(system, context))
    return [_explained(each, known, context) for each in occurrences]


class _KnownEnds:
    """A checked system, indexed by the names that programs print.

    Attributes:
        endpoints: by protocol and topic (None: all), as programs print it in full or name it themselves.
        groups: those that are not compatible, by publisher.
        findings: those about pairs, by endpoint.
    """

    def __init__(self, endpoints: Sequence[Resolved], report: Report) -> None:
        self.endpoints = grouped(((each.pack.id, name), each) for each in endpoints for name in _topic_names(each))
        self.groups = grouped(
            (publisher, (number, group))
            for number, group in enumerate(report.groups)
            if group.verdict is not Verdict.COMPATIBLE
            for publisher in group.publishers
        )
        self.findings = grouped(
            (member, (number, finding))
            for number, finding in enumerate(report.findings)
            if finding.verdict is not None
            for member in dict.fromkeys(finding.endpoints)
        )


def _topic_names(endpoint: Resolved) -> Iterable[str | None]:
    """Yield the names that programs may print for the topic of an endpoint: in full, as stated, or its last parts."""
    key = endpoint.key or ""
    ends = (key[at + 1 :] for at, letter in enumerate(key) if letter == "/" and key[at + 1 : at + 2] != "/")
    return dict.fromkeys([None, endpoint.key, endpoint.shown, endpoint.endpoint.topic, *ends])


def _explained(occurrence: Occurrence, known: _KnownEnds, context: CheckContext) -> LogExplanation:
    misfit = occurrence.misfit
    rules = rules_over(misfit, context.find_pack(misfit.protocol))
    on_topic = known.endpoints.get((misfit.protocol, misfit.topic))
    if not on_topic:
        return LogExplanation(occurrence, rules, remark="the system has no such topic")
    own = [each for each in on_topic if each.role == misfit.role]
    mine = [each for each in own if misfit.participant in {None, _address(each)}]
    remark = ""
    if own and not mine and misfit.topic is not None:
        remark = f"the system has no {misfit.role} of `{misfit.participant}` there; this is about its others"
        mine = own
    keys = {each.key for each in mine}
    others = [each for each in on_topic if each.role != misfit.role and each.key in keys]
    missing = misfit.role if not mine else "" if others else (SUBSCRIBER if misfit.role == PUBLISHER else PUBLISHER)
    if missing:
        owner = f" of `{misfit.participant}`" if own and not mine else ""
        return LogExplanation(occurrence, rules, remark=f"the system has no {missing}{owner} there")
    publishers, subscribers = (mine, others) if misfit.role == PUBLISHER else (others, mine)
    pairs = _pairs({each.id for each in publishers}, {each.id for each in subscribers}, known)
    findings = _findings(pairs, known)
    if misfit.topic is None and rules:
        # Of all topics of the participant, it is one where the named policy does not fit.
        findings = tuple(each for each in findings if each.code in {rule.code for rule in rules})
        pairs = tuple(
            pair for pair in pairs if any({pair.publisher, pair.subscriber} <= {*each.endpoints} for each in findings)
        )
    if not pairs:
        remark = "by the system they fit, so what runs differs from it: `cqos diff` compares it with a snapshot"
    elif rules and not {rule.code for rule in rules} & {each.code for each in findings}:
        remark = remark or "by the system other policies do not fit than the one that is named"
    return LogExplanation(occurrence, rules, pairs, findings, remark)


def _address(endpoint: Resolved) -> str:
    return endpoint.pack.topic_matching.address(endpoint.endpoint.participant, endpoint.participant.texts)


def _pairs(publishers: set[str], subscribers: set[str], known: _KnownEnds) -> tuple[Pair, ...]:
    groups = {number: group for name in publishers for number, group in known.groups.get(name, ())}
    found = [
        Pair(group.topic, publisher, subscriber, group.verdict)
        for _, group in sorted(groups.items(), key=itemgetter(0))
        for publisher, subscriber in product(
            [name for name in group.publishers if name in publishers],
            [name for name in group.subscribers if name in subscribers],
        )
    ]
    # Where some certainly do not fit, these are meant.
    certain = [pair for pair in found if pair.verdict is Verdict.INCOMPATIBLE]
    return tuple(certain or found)


def _findings(pairs: Sequence[Pair], known: _KnownEnds) -> tuple[Finding, ...]:
    """Return the findings about any of the pairs that are not compatible, in the order of the report."""
    offering, requesting = (
        {number: finding for name in names for number, finding in known.findings.get(name, ())}
        for names in ({pair.publisher for pair in pairs}, {pair.subscriber for pair in pairs})
    )
    return tuple(offering[number] for number in sorted(offering.keys() & requesting.keys()))
