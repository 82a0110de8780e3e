"""A check that stays open: endpoints replace others, and only their topics are judged again."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from cqos_core.checking.checker import (
    as_drafts,
    assemble,
    merge_drafts,
    merged_by_key,
    name_collision_findings,
    nothing_compared,
    participant_findings,
    spans_topics,
    stated_findings,
    templates_of,
    with_acceptances,
)
from cqos_core.checking.topic_check import check_topic
from cqos_core.checking.unmatched_endpoints import read_of_topic, unmatched_endpoints
from cqos_core.matching.cross_protocol_topics import meet_by_name
from cqos_core.model.changes import Counts
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.checking.checker import JudgedTopics
    from cqos_core.checking.findings import FindingDraft
    from cqos_core.checking.topic_check import TopicResult
    from cqos_core.matching.hops import Topics
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.finding import Verdict
    from cqos_core.model.report import Group, Report
    from cqos_core.model.system import Endpoint, System
    from cqos_core.resolving.resolved_endpoint import Resolved


_F = TypeVar("_F")
_T = TypeVar("_T")


class Step(NamedTuple):
    """The effect of an edit: removed and added groups, and the number of judged topics."""

    gone: list[Group]
    came: list[Group]
    judged: int


def may_stay_open(pipeline: Pipeline) -> bool:
    """Whether each endpoint is resolved by itself and meets others on its own topic, and no finding rests on several topics."""
    resolver = pipeline.resolver
    return not (resolver.is_joint or spans_topics(pipeline.stated)) and meet_by_name(resolver.result.packs)


class OpenCheck:
    """The check of a system that `may_stay_open`.

    Attributes:
        findings: all, in no order.
        counts: how much there is of everything.
    """

    def __init__(self, pipeline: Pipeline, judged: JudgedTopics, topics: Topics, system: Callable[[], System]) -> None:
        """Begin with judged topics; edits change ``topics`` and their results, and ``system`` returns the system at that time."""
        self._rules, self._context, self._system = pipeline.stated, pipeline.where, system
        self._resolver, self._topics, self._judged = pipeline.resolver, topics, judged
        result = self._resolver.result
        endpoints, result.endpoints = result.endpoints, []
        self._parts = grouped((each.stated_id, each) for each in endpoints)
        self._size = len(endpoints)
        self._made = {key: made for key, each in sorted(judged.results.items()) if (made := _made(each))}
        self._stated = as_drafts(stated_findings(self._rules, result, self._context, judged.problems))
        self._of_participants = as_drafts(participant_findings(endpoints))
        self._alone, self._unmatched = self._without_partners()
        self._templates, self._again = templates_of(self._rules, endpoints), _Again()
        self._pairs = _pairs(self.groups)
        self._put_together()

    @property
    def groups(self) -> list[Group]:
        """All groups, in no order."""
        return [group for result in self._judged.results.values() for group in result.groups]

    @property
    def endpoints(self) -> list[Resolved]:
        """All endpoints, in the order of the system."""
        return [*chain.from_iterable(self._parts.get(each.id, ()) for each in self._system().endpoints)]

    def parts(self, name: str) -> Sequence[Resolved]:
        """Return the resolved endpoints of a stated one, by its id."""
        return self._parts.get(name, ())

    def report(self) -> Report:
        """Return the report on all."""
        resolved = replace(self._resolver.result, endpoints=self.endpoints)
        return assemble(self._system(), resolved, self._judged.results, self._context, self._judged.problems)

    def put(self, edited: Mapping[str, Sequence[Endpoint]]) -> Step | None:
        """Put endpoints in place of those that had their ids; return None where that changes more than their topics.

        After None, this is good for nothing more.
        """
        gone: list[Resolved] = []
        came: list[Resolved] = []
        for name, stated in edited.items():
            before = self._parts.pop(name, [])
            now = self._resolver.again(stated, before)
            if name in self._resolver.reaching or any(each.representative.protocol for each in (*before, *now)):
                return None
            if now:
                self._parts[name] = now
            gone += before
            came += now
        return None if self._resolver.is_joint else self._follow(gone, came)

    def _follow(self, gone: Sequence[Resolved], came: Sequence[Resolved]) -> Step:
        """Judge the topics that endpoints leave or join, and redo findings that depend on these endpoints."""
        touched = {(each.pack.id, each.key): None for each in (*gone, *came) if each.key is not None}
        for each in gone:
            if each.key is not None:
                self._topics[each.pack.id, each.key].remove(each)
        for each in came:
            if each.key is not None:
                self._topics.setdefault((each.pack.id, each.key), []).append(each)
        before = {key: self._judged.results.get(key) for key in touched}
        now = {key: self._judge_again(key) for key in touched}
        self._size += len(came) - len(gone)
        if any(each.participant_rules for each in self._resolver.result.packs.values()):
            self._of_participants = as_drafts(participant_findings(self.endpoints))
        if any(read_of_topic(before[key]) != read_of_topic(now[key]) for key in touched):
            self._alone, self._unmatched = self._without_partners()
        if _templates(gone) != _templates(came):
            self._templates, self._again = templates_of(self._rules, self.endpoints), _Again()
        old, new = ([group for each in side.values() if each for group in each.groups] for side in (before, now))
        self._pairs = self._pairs - _pairs(old) + _pairs(new)
        self._put_together()
        return Step(old, new, len(touched))

    def _judge_again(self, key: TopicKey) -> TopicResult | None:
        """Judge a topic, or forget it where it has no endpoints; return the result."""
        for known in (self._judged.results, self._made):
            known.pop(key, None)
        endpoints = self._topics[key]
        if not endpoints:
            del self._topics[key]
            return None
        found = self._judged.results[key] = check_topic(endpoints, self._judged.excused, self._judged.teams)
        if made := _made(found):
            self._made[key] = made
        return found

    def _without_partners(self) -> tuple[list[FindingDraft], int]:
        found, count = unmatched_endpoints(
            self._system(), self._judged.results, self._resolver.result.packs, self.endpoints
        )
        return as_drafts(found), count

    def _put_together(self) -> None:
        made = [*merged_by_key(self._made, self._again), *self._stated, *self._of_participants, *self._alone]
        if not self._pairs:
            made += as_drafts(nothing_compared(self._system(), self.endpoints))
        said = with_acceptances(made, self._rules, self._context, self._again)
        self.findings = merge_drafts(said, self._templates, self._again)
        self._again.forget_others()
        severities = Counter([each.severity for each in self.findings if each.accepted is None])
        self.counts = Counts(self._size, len(self._judged.results), self._unmatched, self._pairs, severities)


class _Again:
    """Returns the result of the round before for the same findings, so that an edit changes only findings that it concerns."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], Any] = {}
        self._asked: dict[tuple[object, ...], Any] = {}

    def __call__(self, make: Callable[[Sequence[_F]], _T], of: Sequence[_F]) -> _T:
        key = (make.__qualname__, *map(id, of))
        # The input is kept with the result, so that its id is not reused.
        made, _ = self._asked[key] = self._asked.get(key) or self._known.get(key) or (make(of), of)
        return made

    def forget_others(self) -> None:
        """Drop results that this round did not use, and begin another round."""
        self._known, self._asked = self._asked, {}


def _made(result: TopicResult) -> list[FindingDraft]:
    own = [each for each in result.endpoints if not each.is_copy]
    return [*result.made, *as_drafts(name_collision_findings(own))]


def _pairs(groups: Iterable[Group]) -> Counter[Verdict]:
    found: Counter[Verdict] = Counter()
    for group in groups:
        found[group.verdict] += group.pairs
    return found


def _templates(endpoints: Iterable[Resolved]) -> set[tuple[str, str | None]]:
    return {(each.id, each.representative.template) for each in endpoints if each.representative.template is not None}
