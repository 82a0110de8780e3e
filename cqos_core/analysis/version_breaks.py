"""Pairs that get worse while only some participants of a system are updated, and the order of update that avoids it."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from datetime import date
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from cqos_core.behaviour.components import components
from cqos_core.checking.acceptance import AcceptanceIndex
from cqos_core.checking.findings import FindingDraft
from cqos_core.checking.topic_check import check_topic
from cqos_core.matching.cross_protocol_topics import topics
from cqos_core.matching.pipeline import Pipeline
from cqos_core.matching.topic_groups import naming_endpoints
from cqos_core.model.core_findings import core_finding
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, TextEnum, Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.checking.topic_check import TopicResult
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved


class Updated(TextEnum):
    """The ends of a pair that are already updated."""

    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"
    BOTH = "both"


class _MixedPair(NamedTuple):
    """The ids of its endpoints."""

    publisher: str
    subscriber: str


@dataclass(frozen=True, slots=True)
class Break:
    """A pair that gets worse.

    Attributes:
        publishing, subscribing: the participants of its ends.
        worse: after which updates it is worse than before.
        before: its verdict in the old version; None where it is new.
        after: the worst verdict then; None where the ends match no longer.
        finding: the reason, accepted or not.
    """

    topic: str
    publisher: str
    subscriber: str
    publishing: str
    subscribing: str
    worse: tuple[Updated, ...]
    before: Verdict | None
    after: Verdict | None
    finding: Finding

    @property
    def counts(self) -> bool:
        """Whether it is certain, and not accepted."""
        return self.finding.accepted is None and self.after is not Verdict.UNKNOWN


@dataclass(frozen=True, slots=True)
class VersionBreaks:
    """Pairs that break while an update of a system is under way.

    Attributes:
        breaks: pairs that get worse, by topic.
        changed: participants with other values or endpoints than before, or that only one version has.
        order: steps of an update that breaks nothing. Each step has groups of participants; a group has to be updated at
            once. Other participants may be updated at any time.
        unavoidable: whether a pair is worse once both ends are updated, so that no order helps.
        pairs: how many pairs the old and the new version have together.
    """

    breaks: tuple[Break, ...]
    changed: tuple[str, ...]
    order: tuple[tuple[tuple[str, ...], ...], ...]
    unavoidable: bool
    pairs: int


def find_breaks(old: System, new: System, context: CheckContext) -> VersionBreaks:
    """Compare every pair of the old version with the same pair while one of its ends, or both, are updated.

    Exceptions (``accept``) are those of the new version. Bridges count hop by hop.
    """
    versions = _Version(old, context), _Version(new, context)
    today = date.today()  # noqa: DTZ011 - a calendar day, where the user is
    accepting = AcceptanceIndex(new.accept, context.find_rule, today)
    states = {
        None: _mixed(versions[0], versions[0], new, versions),
        Updated.PUBLISHER: _mixed(versions[1], versions[0], new, versions),
        Updated.SUBSCRIBER: _mixed(versions[0], versions[1], new, versions),
        Updated.BOTH: _mixed(versions[1], versions[1], new, versions),
    }
    breaks = [replace(each, finding=_accepted(each.finding, accepting)) for each in _breaks(states, *versions)]
    changed = sorted(_changed(*versions))
    return VersionBreaks(
        tuple(sorted(breaks, key=lambda each: (not each.counts, each.topic, each.publisher, each.subscriber))),
        tuple(changed),
        tuple(_order(breaks)),
        any(Updated.BOTH in each.worse for each in breaks if each.counts),
        len({*states[None].pairs, *states[Updated.BOTH].pairs}),
    )


class _Version:
    """One version: its endpoints with their values."""

    def __init__(self, system: System, context: CheckContext) -> None:
        pipeline = Pipeline(system, context)
        self.resolver = pipeline.resolver
        self.endpoints: dict[str, Resolved] = {each.id: each for each in pipeline.endpoints}
        self.participants = pipeline.system.participants

    @cached_property
    def topics(self) -> Mapping[tuple[str, str], frozenset[tuple[str, str, int]]]:
        """By topic the endpoints with their values, which decide its verdicts."""
        return {
            key: frozenset((each.id, each.endpoint.participant, id(each.profile)) for each in members)
            for key, members in topics(self.resolver).items()
        }


class _State:
    """The pairs of a mix of versions, on topics where the versions differ."""

    def __init__(self, results: Sequence[TopicResult]) -> None:
        self.results = results
        self.pairs: dict[_MixedPair, tuple[str, Verdict, TopicResult]] = {}
        for result in results:
            for group in result.groups:
                for publisher in group.publishers:
                    for subscriber in group.subscribers:
                        self.pairs[_MixedPair(publisher, subscriber)] = (group.topic, group.verdict, result)

    @cached_property
    def served(self) -> frozenset[str]:
        """The subscribers that match any publisher."""
        return frozenset(pair.subscriber for pair in self.pairs)


def _mixed(publishers: _Version, subscribers: _Version, new: System, versions: tuple[_Version, _Version]) -> _State:
    """Judge the publishers of one version with the subscribers of another; ``new`` has the accepted findings."""
    resolver = copy(subscribers.resolver)
    ends = [each for each in publishers.endpoints.values() if each.role == PUBLISHER]
    ends += [each for each in subscribers.endpoints.values() if each.role == SUBSCRIBER]
    resolver.result = replace(resolver.result, endpoints=ends)
    before, after = (version.topics for version in versions)
    excused = naming_endpoints(new.accept)
    found = topics(resolver).items()
    return _State([check_topic(members, excused) for key, members in found if before.get(key) != after.get(key)])


def _breaks(states: Mapping[Updated | None, _State], old: _Version, new: _Version) -> Iterator[Break]:
    before = states[None].pairs
    every = {pair: None for state in states.values() for pair in state.pairs}
    for pair in every:
        publishing = (new if pair.publisher in new.endpoints else old).endpoints[pair.publisher].endpoint.participant
        subscribing = (new if pair.subscriber in new.endpoints else old).endpoints[pair.subscriber].endpoint.participant
        if publishing == subscribing:  # they are updated at once
            continue
        was = before[pair][1] if pair in before else None
        worse: dict[Updated, Verdict | None] = {}
        for updated in Updated:
            now = states[updated].pairs.get(pair)
            if now is not None and now[1].rank > (was or Verdict.COMPATIBLE).rank:
                worse[updated] = now[1]
            elif (
                now is None
                and was not in {None, Verdict.INCOMPATIBLE}
                and _loses(pair, updated, states[updated], old, new)
            ):
                worse[updated] = None
        if not worse:
            continue
        state, after = max(worse.items(), key=lambda each: 3 if each[1] is None else each[1].rank)
        known = states[state].pairs.get(pair) or before[pair]
        if after is None:
            finding = _apart(states[state], pair) or _lost(pair, publishing, known[0], new, old)
        else:
            finding = _reason(known[2], pair, known[1], (*new.resolver.result.findings, *old.resolver.result.findings))
        yield Break(known[0], *pair, publishing, subscribing, tuple(worse), was, after, finding)


def _loses(pair: _MixedPair, updated: Updated, state: _State, old: _Version, new: _Version) -> bool:
    """Whether a subscriber that is there misses a publisher that it had: its participant is there, or no other is left."""
    there = old if updated is Updated.PUBLISHER else new
    if pair.subscriber not in there.endpoints:
        return False
    publishing = old.endpoints[pair.publisher].endpoint.participant
    return publishing in new.participants or pair.subscriber not in state.served


def _apart(state: _State, pair: _MixedPair) -> Finding | None:
    """Return the finding of the rule that keeps the ends of a pair from matching, if any."""
    made = (one.finding for result in state.results for one in result.made)
    return next((each for each in made if {*pair} <= {*each.endpoints}), None)


def _lost(pair: _MixedPair, publishing: str, topic: str, new: _Version, old: _Version) -> Finding:
    end = new.endpoints.get(pair.subscriber) or old.endpoints[pair.subscriber]
    gone = pair.publisher not in new.endpoints
    why = f"`{publishing}` publishes there no longer" if gone else "the new version keeps them apart"
    message = f"subscriber `{pair.subscriber}` no longer matches publisher `{pair.publisher}` on `{topic}`: {why}"
    return core_finding("CQ407", message, place=end.endpoint.place, role=SUBSCRIBER, members=pair[1:], topic=topic)


def _reason(result: TopicResult, pair: _MixedPair, verdict: Verdict, stated: Iterable[Finding]) -> Finding:
    """Return the finding with the reason of a pair's verdict: about both ends if there is one, else about either, else about a setting."""
    made = [one.finding for one in result.made if one.finding.verdict is verdict]
    of_both = (each for each in made if {*pair} <= {*each.endpoints})
    others = sorted((*made, *stated), key=lambda each: each.severity.rank)
    of_one = (each for each in others for side in each.sides if not {*pair}.isdisjoint(side.members))
    unknown = core_finding("CQ407", f"the verdict of the pair is {verdict}", members=pair, topic=result.topic.shown)
    return next(chain(of_both, of_one), unknown)


def _accepted(finding: Finding, accepting: AcceptanceIndex) -> Finding:
    return accepting.marked(FindingDraft(finding, (), frozenset()))[0].finding


def _changed(old: _Version, new: _Version) -> Iterator[str]:
    """Yield the participants that are not the same in both versions."""
    values = [
        {(each.endpoint.participant, each.id, each.key, id(each.profile)) for each in version.endpoints.values()}
        for version in (old, new)
    ]
    yield from {participant for participant, *_ in values[0] ^ values[1]}


def _order(breaks: Iterable[Break]) -> list[tuple[tuple[str, ...], ...]]:
    """Return in which order to update the participants of certain breaks that an order avoids."""
    first: dict[str, set[str]] = {}
    for each in breaks:
        if not each.counts or Updated.BOTH in each.worse:
            continue
        for updated in each.worse:
            ends = (each.publishing, each.subscribing)
            later, sooner = ends if updated is Updated.PUBLISHER else ends[::-1]
            first.setdefault(later, set()).add(sooner)
            first.setdefault(sooner, set())
    names = sorted(first)
    numbers = {name: number for number, name in enumerate(names)}
    before = [sorted(numbers[name] for name in first[end]) for end in names]
    steps: list[list[tuple[str, ...]]] = []
    step_of: dict[int, int] = {}
    for group in components(range(len(names)), before.__getitem__):
        step = 1 + max((step_of[other] for each in group for other in before[each] if other in step_of), default=-1)
        step_of |= dict.fromkeys(group, step)
        steps += [[]] if step == len(steps) else []
        steps[step].append(tuple(sorted(names[each] for each in group)))
    return [tuple(sorted(step)) for step in steps]
