"""The check of one topic as a unit: its pairs, its findings, its unmatched endpoints."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cached_property, reduce
from operator import or_
from typing import TYPE_CHECKING, Any, NamedTuple

from cqos_core.checking.findings import FindingDraft, draft_finding, headline, shown_groups, sides_of, subject
from cqos_core.language.bound_condition import RuleAnswer
from cqos_core.language.relation import positions
from cqos_core.matching.judge import Violation, judge_pair
from cqos_core.matching.pair_outcomes import outcome_of
from cqos_core.matching.rule_hits import MOST_COMBINATIONS, Hit, add_reached, with_topic_groups
from cqos_core.matching.strongest_owner import settle_strongest
from cqos_core.matching.topic_groups import bridges_of, group
from cqos_core.matching.topic_outcomes import QUIET, judge_shape
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, Severity, Side, Verdict
from cqos_core.model.report import Group
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_core.checking.team import TeamCheck
    from cqos_core.language.name_index import NameIndex
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.matching.topic_outcomes import JudgedPairs, NonMatch, TopicOutcome
    from cqos_core.resolving.resolved_endpoint import Resolved


@dataclass(eq=False)
class TopicResult:
    """The result of checking one topic: the outcome that topics of its shape share, and its endpoints.

    Groups and findings are made of these when they are read.
    """

    endpoints: Sequence[Resolved]
    outcomes: TopicOutcome
    acceptances: NameIndex[int] | None = None
    checks: NameIndex[TeamCheck] | None = None
    is_pair: bool = False
    """Whether the endpoints are one publisher and one subscriber, in this order."""

    @cached_property
    def topic(self) -> MatchedTopic:
        """The endpoints, grouped."""
        return settled(self.endpoints, self.acceptances)

    @property
    def paired(self) -> Iterator[str]:
        """The ids of the endpoints in pairs."""
        if self.outcomes is QUIET:
            yield from [each.id for each in self.endpoints]
        else:
            for each in self.groups:
                yield from (*each.publishers, *each.subscribers)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """All pairs, those that were judged alike together."""
        if self.is_pair:
            shown, ends = min(each.shown for each in self.endpoints), (self.endpoints[:1], self.endpoints[1:])
            return tuple([_group(shown, *ends, row) for row in self.outcomes.rows])
        return tuple([_group(self.topic.shown, *_members(self.topic, row), row) for row in self.outcomes.rows])

    @cached_property
    def made(self) -> tuple[FindingDraft, ...]:
        """Findings, to be put together with those of other topics."""
        return (
            *[draft_finding(self.topic, with_topic_groups(self.topic, hit)) for hit in self.outcomes.hits],
            *(_splits(self.topic, self.outcomes) if self.outcomes.kept_apart else ()),
            *(_of_team(self.topic, self.checks) if self.checks is not None else ()),
            *_within_participants(self),
        )

    @cached_property
    def lonely(self) -> tuple[Resolved, ...]:
        """The endpoints that have no other side."""
        alone = () if self.topic.publishers and self.topic.subscribers else self.topic.endpoints
        return tuple([each for each in alone if not each.is_copy])


def check_topic(
    endpoints: Sequence[Resolved],
    acceptances: NameIndex[int] | None = None,
    checks: Mapping[int, NameIndex[TeamCheck]] | None = None,
) -> TopicResult:
    """Judge one topic of one protocol: a pure function of its endpoints, the acceptances and the team's rules."""
    team = checks.get(id(endpoints[0].pack)) if checks else None
    outcomes = outcome_of(*endpoints) if len(endpoints) == 2 else None  # noqa: PLR2004 - a pair
    if outcomes is None or (acceptances and outcomes is not QUIET):
        topic = settled(endpoints, acceptances)
        found = TopicResult((*endpoints,), judge_shape(topic.shape), acceptances, team)
        found.topic = topic
        return found
    one, other = endpoints
    ends = (one, other) if one.representative.role == PUBLISHER else (other, one)
    found = TopicResult(ends, outcomes, acceptances, team, is_pair=True)
    found.lonely = ()
    if outcomes is QUIET and team is None and one.representative.participant != other.representative.participant:
        found.made = ()
    return found


def settled(endpoints: Sequence[Resolved], acceptances: NameIndex[int] | None = None) -> MatchedTopic:
    """Group the endpoints of one topic, and replace values that follow from other endpoints; see `group`."""
    topic = group(endpoints, acceptances)
    if any(endpoint.like.from_peers for endpoint in endpoints):
        from cqos_core.matching.peer_values import settle

        settle(topic)
    settle_strongest(topic)
    return topic


def verdict_between(topic: MatchedTopic, publisher: Resolved, subscriber: Resolved) -> Verdict:
    """Return the verdict of one pair of a settled topic."""
    first, second = _positions(topic, publisher, subscriber)
    rows = judge_shape(topic.shape).rows
    found = (row.verdict for row in rows if first in row.publishers and row.subscribers >> second & 1)
    return next(found, Verdict.UNKNOWN)


def refusing(topic: MatchedTopic, publisher: Resolved, subscriber: Resolved) -> list[FindingDraft]:
    """Return the findings of rules over a whole settled topic that refuse one pair of it."""
    first, second = _positions(topic, publisher, subscriber)
    return [
        draft_finding(topic, with_topic_groups(topic, hit))
        for hit in judge_shape(topic.shape).hits
        if hit.violation.bound.scope == "signal"
        and hit.violation.refuses
        and (first in hit.publishers or second in hit.subscribers)
    ]


def _positions(topic: MatchedTopic, publisher: Resolved, subscriber: Resolved) -> tuple[int, int]:
    """Return the positions of the groups of two endpoints."""
    return (
        next(at for at, members in enumerate(topic.publishers) if publisher.id in members.ids),
        next(at for at, members in enumerate(topic.subscribers) if subscriber.id in members.ids),
    )


def _members(topic: MatchedTopic, row: JudgedPairs) -> tuple[list[Resolved], list[Resolved]]:
    """Return the publishers and the subscribers of some pairs."""
    return (
        [endpoint for position in row.publishers for endpoint in topic.publishers[position].endpoints],
        [endpoint for position in positions(row.subscribers) for endpoint in topic.subscribers[position].endpoints],
    )


def _group(shown: str, offering: Sequence[Resolved], requesting: Sequence[Resolved], row: JudgedPairs) -> Group:
    if len(offering) == len(requesting) == 1:
        internal = int(offering[0].representative.participant == requesting[0].representative.participant)
    else:
        owners = Counter(endpoint.representative.participant for endpoint in offering)
        internal = sum([owners[endpoint.representative.participant] for endpoint in requesting])
    return Group(
        topic=shown,
        publishers=tuple(sorted([endpoint.id for endpoint in offering])),
        subscribers=tuple(sorted([endpoint.id for endpoint in requesting])),
        verdict=row.verdict,
        protocol=offering[0].pack.id,
        internal=internal,
        codes=row.codes,
    )


def _splits(topic: MatchedTopic, judged: TopicOutcome) -> list[FindingDraft]:
    """Report the rules that keep endpoints apart: for each unmatched endpoint, and once a topic without one."""
    met_by_any = 0
    for met in judged.met:
        met_by_any |= met
    alone = _alone(topic.subscribers, lambda index: met_by_any >> index & 1)
    over_bridges = _over_bridges(topic, judged.met)
    ends = _ends_of_bridges(topic.subscribers)
    loud: _Splits = {}
    quiet: _Splits = {}
    own_bridge = [_of_one_bridge(publisher, ends) for publisher in topic.publishers]
    left_alone = [_alone([each], judged.met.__getitem__, at) for at, each in enumerate(topic.publishers)]
    for each in judged.kept_apart:
        reported: dict[int, int] = {}
        for index, missed in each.missed.items():
            kept = missed if each.bound.rule.always else missed & ~over_bridges[index]
            if not kept:
                continue
            left = left_alone[index]
            worth = kept if each.bound.rule.always or left.reported else kept & alone.reported
            # The ends of one bridge are apart on purpose, even if no other endpoint is on one side.
            own = worth & own_bridge[index]
            if worth & ~own:
                reported[index] = worth & ~own
            # Endpoints with partners elsewhere need no report.
            rest = 0 if left.all else kept & ~worth & ~alone.all
            if own | rest:
                add_reached(quiet.setdefault((each.bound.rule.code,), _hit(each)), {index: own | rest})
        if reported:
            _report(loud, each, reported)
    return [
        *(_split_finding(topic, with_topic_groups(topic, split), quiet=False) for split in loud.values()),
        *(_split_finding(topic, with_topic_groups(topic, split), quiet=True) for split in quiet.values()),
    ]


_Splits = dict[tuple[Any, ...], Hit[int]]


def _report(splits: _Splits, apart: NonMatch, reported: Mapping[int, int]) -> None:
    """Note each combination of values that is kept apart; beyond a limit the rest together."""
    code, classes = apart.bound.rule.code, apart.subscribers
    whole = reduce(or_, reported.values())
    room = MOST_COMBINATIONS - sum(key[0] == code for key in splits)
    for one in classes.within(whole)[:room] if room > 0 else ():
        split = splits[code, id(apart), id(one)] = _hit(apart, apart.tags | one.first.tags)
        for publisher, mask in reported.items():
            if mask & one.mask:
                add_reached(split, {publisher: mask & one.mask})
        whole &= ~one.mask
    for tags, same in classes.by_tags(whole):
        key = (code, "further", apart.tags | tags)
        reached = {publisher: groups for publisher, mask in reported.items() if (groups := mask & same)}
        further = splits.setdefault(key, _hit(apart, apart.tags | tags))
        first = classes.within(same)[0]
        for publisher, groups in sorted(reached.items(), key=lambda each: not each[1] & first.mask):
            add_reached(further, {publisher: groups}, first.members)
            further.more += classes.count(groups)


def _hit(apart: NonMatch, tags: frozenset[int] = frozenset()) -> Hit[int]:
    return Hit(Violation(apart.bound, RuleAnswer(result=False)), tags=tags)


def _ends_of_bridges(subscribers: Sequence[EndpointGroup]) -> dict[frozenset[str | None], int]:
    """The groups of subscribers by the bridges whose ends their endpoints are, as bits."""
    found: dict[frozenset[str | None], int] = {}
    for index, members in enumerate(subscribers):
        bridges = frozenset(bridges_of(members.endpoints))
        found[bridges] = found.get(bridges, 0) | 1 << index
    return found


def _of_one_bridge(publisher: EndpointGroup, ends: Mapping[frozenset[str | None], int]) -> int:
    """The groups whose endpoints are all ends of the bridge that all of ``publisher`` are ends of, as bits."""
    bridges = bridges_of(publisher.endpoints)
    return 0 if len(bridges) > 1 or None in bridges else ends.get(frozenset(bridges), 0)


class _Alone(NamedTuple):
    """Groups without any partner, as bits: all of them, and those to report."""

    all: int
    reported: int


def _alone(groups: Sequence[EndpointGroup], met: Callable[[int], int], first: int = 0) -> _Alone:
    """The groups that match none; ``met`` is asked by their positions, from ``first`` on."""
    left = [(at, each) for at, each in enumerate(groups) if not each.copied and not met(first + at)]
    return _Alone(
        sum(1 << index for index, _ in left),
        sum(1 << index for index, each in left if not all(end.external for end in each.endpoints)),
    )


def _split_finding(topic: MatchedTopic, hit: Hit[EndpointGroup], *, quiet: bool) -> FindingDraft:
    made = draft_finding(topic, hit)
    rule = hit.violation.bound.rule
    publishers, subscribers = shown_groups(hit)
    sides = sides_of(hit.violation, publishers, subscribers, for_words=True)
    subjects = " and ".join(subject(side) for side in reversed(sides))
    behind = judge_pair(publishers[0].profile, subscribers[0].profile)
    latent = tuple(
        f"behind it: {headline(each, sides_of(each, publishers, subscribers, for_words=True), topic.shown)} ({each.bound.rule.code})"
        for each in behind.violations
        if each.bound.rule.kind == "requires" and not each.unknown
    )
    values = "; ".join(
        f"{side.role} has {', '.join(f'{fact.policy} {fact.value}' for fact in side.facts)}"
        for side in reversed(sides)
        if side.facts and not quiet
    )
    message = f"{subjects} on topic `{topic.shown}` never meet{f' ({values})' if values else ''}: {rule.because}"
    if hit.more:
        message = f"{hit.more} further combinations of values keep endpoints apart, for instance: {message}"
    if quiet:
        message = f"some endpoints on topic `{topic.shown}` never meet: {rule.because}"
    finding = replace(
        made.finding,
        message=message,
        severity=Severity.NOTE if quiet else Severity(hit.violation.bound.severity),
        verdict=None,
        sides=tuple(replace(side, facts=()) for side in made.finding.sides) if quiet else made.finding.sides,
        remedies=(),
        notes=latent,
        pairs=0,
    )
    return replace(made, finding=finding, merge_key=("own", object()))


def _of_team(topic: MatchedTopic, checks: NameIndex[TeamCheck]) -> list[FindingDraft]:
    from cqos_core.checking.team import team_findings

    return team_findings(topic, checks)


def _over_bridges(topic: MatchedTopic, met: Sequence[int]) -> list[int]:
    if not any(endpoint.bridge for endpoint in topic.endpoints):
        return [0] * len(met)
    from cqos_core.behaviour.paths.bridge_reachability import connected_over_bridges

    return connected_over_bridges(topic, met)


def _within_participants(result: TopicResult) -> list[FindingDraft]:
    topic = result.topic
    publishing = {e.endpoint.participant: e for members in topic.publishers for e in members.endpoints}
    owners = {e.endpoint.participant for members in topic.subscribers for e in members.endpoints}
    if owners.isdisjoint(publishing) or not any(group.internal for group in result.groups):
        return []
    inside = [
        (publishing[endpoint.endpoint.participant], endpoint)
        for members in topic.subscribers
        for endpoint in members.endpoints
        if endpoint.endpoint.participant in publishing
    ]
    names = sorted({subscriber.participant.participant.id for _, subscriber in inside})
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    from cqos_core.model.codes import CODES

    finding = Finding(
        code="CQ406",
        name=CODES["CQ406"].name,
        severity=Severity.NOTE,
        message=(
            f"participant `{names[0]}` subscribes to `{topic.shown}`, which it publishes itself"
            if not more
            else f"participants `{names[0]}`{more} subscribe to `{topic.shown}`, which they publish themselves"
        ),
        topic=topic.shown,
        sides=(
            Side(SUBSCRIBER, tuple(sorted(s.id for _, s in inside)), place=inside[0][1].endpoint.place),
            Side(PUBLISHER, tuple(sorted({p.id for p, _ in inside})), place=inside[0][0].endpoint.place),
        ),
        because=CODES["CQ406"].reason,
    )
    return [FindingDraft(finding, ("own", object()), frozenset())]
