"""Outcomes of topics: pairs and hits of rules over groups of endpoints, without names. Outcomes of a shape are cached.

A rule reads only a few policies. So it is judged once per distinct combination of those (its *value groups*), not per pair of
endpoints. Its answer for a publisher is a set of subscribers, held as the bits of an integer. So even a
topic on which all endpoints differ costs little more than its distinct values. Most topics equal others, in the same system or in
an earlier one, and cost a look-up.
"""

from __future__ import annotations

from dataclasses import field
from functools import lru_cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language import relation
from cqos_core.language.bound_condition import NO_SIGNAL, RuleAnswer
from cqos_core.language.relation import positions, related
from cqos_core.matching.judge import (
    Violation,
    about_one,
    already_reported,
    ask,
    judge_endpoint,
    needs_misread,
    of_end,
    over_both,
    passed_over,
    read_in_worlds,
    undecided_meeting,
    undecided_of,
    verdict_by,
)
from cqos_core.matching.rule_hits import MOST_COMBINATIONS, EndpointHits, Hit, add_reached, violation_key
from cqos_core.matching.rule_value_groups import ValueGroup, ValueGroups, value_groups
from cqos_core.matching.signal_rules import signal_hits
from cqos_core.matching.topic_groups import GroupKey, TopicShape
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import QosProfile

_REMEMBERED: Final = 16_384
_REMEMBERED_GROUPS: Final = 64
_FEW_PAIRS: Final = 64


@dataclass(slots=True, eq=False)
class NonMatch:
    """A matching condition that keeps publishers from matching subscribers: by publisher group the subscriber groups, as bits.

    Attributes:
        tags: acceptances that name the publishers.
        subscribers: the value groups of all subscribers, as the condition reads them.
    """

    bound: BoundRule
    tags: frozenset[int]
    subscribers: ValueGroups
    missed: dict[int, int] = field(default_factory=dict)


class JudgedPairs(NamedTuple):
    """Publisher groups, and as bits the subscriber groups, whose pairs have equal results."""

    publishers: tuple[int, ...]
    subscribers: int
    verdict: Verdict
    codes: tuple[str, ...]


class TopicOutcome(NamedTuple):
    """The outcome of a shape.

    Attributes:
        met: per publisher group, the subscriber groups that it matches, as bits.
        kept_apart: the conditions that keep groups from matching.
        rows: all pairs.
        hits: the reports of rules.
    """

    met: tuple[int, ...]
    kept_apart: tuple[NonMatch, ...]
    rows: tuple[JudgedPairs, ...]
    hits: tuple[Hit[int], ...]

    @property
    def verdict(self) -> Verdict:
        """The verdict of two groups; unknown if they do not match."""
        return self.rows[0].verdict if self.rows else Verdict.UNKNOWN


def judge_shape(shape: TopicShape) -> TopicOutcome:
    """Judge a shape; the result is shared, so do not change it."""
    if len(shape.publishers) + len(shape.subscribers) > _REMEMBERED_GROUPS:
        return _judge(shape)
    return _remembered(shape)


class _GroupReport(NamedTuple):
    """The report of a rule over two value groups; ``combinations`` counts further ones that these stand for, else it is 0."""

    publishers: ValueGroup
    subscribers: ValueGroup
    violation: Violation
    combinations: int = 0


class _PublisherReport(NamedTuple):
    """The report of a rule over a value group of publishers: the subscriber groups that it certainly reports, as bits, and others."""

    publishers: ValueGroup
    certain: int
    others: list[tuple[ValueGroup, Violation]]


@dataclass(slots=True)
class _Pairs:
    """Pairs while they are judged; ``segments`` are per publisher group: verdict and codes to subscriber groups.

    ``sizes`` are the subscriber groups whose number of endpoints has 1, 2, 4, … in it, as bits.
    """

    met: list[int]
    kept_apart: list[NonMatch] = field(default_factory=list)
    segments: list[dict[tuple[Verdict, tuple[str, ...]], int]] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)

    def weight(self, mask: int) -> int:
        """Return the number of endpoints of the subscriber groups in ``mask``."""
        return sum((mask & same).bit_count() << power for power, same in enumerate(self.sizes))


_Hits = dict[tuple[Any, ...], Hit[int]]


def _judge(shape: TopicShape) -> TopicOutcome:
    if len(shape.publishers) == len(shape.subscribers) == 1 and _is_quiet(shape):
        return QUIET
    hits: _Hits = {}
    both = shape.publishers and shape.subscribers
    reporting = _may_report(shape) if both else 0
    pairs = (
        _met(shape, reporting) if both else _Pairs([0] * len(shape.publishers), segments=[{} for _ in shape.publishers])
    )
    if both:
        _end_segments(shape, pairs)
        _undecided_meetings(shape, reporting, pairs, hits)
    _signal_rules(shape, pairs, hits)
    if both:
        _pair_rules(shape, reporting, pairs, hits)
    said = (*hits.values(), *_endpoint_rules(shape))
    return TopicOutcome(tuple(pairs.met), tuple(pairs.kept_apart), _rows(pairs, shape.pack), said)


def _is_quiet(shape: TopicShape) -> bool:
    """Return whether no rule reports on one group on each side."""
    (offering,), (requesting,) = shape.publishers, shape.subscribers
    publisher, subscriber = offering.profile, requesting.profile
    return (
        not over_both(shape.pack).that_report(publisher, subscriber)
        and not subscriber.needs
        and _end_is_quiet(offering, PUBLISHER)
        and _end_is_quiet(requesting, SUBSCRIBER)
    )


def _end_is_quiet(group: GroupKey, role: str) -> bool:
    profile = group.profile
    unusual = group.copied or group.wired or profile.unread or profile.refused
    return not unusual and not about_one(profile.pack, role, group.observed).that_report(profile, profile)


QUIET: Final = TopicOutcome((1,), (), (JudgedPairs((0,), 1, Verdict.COMPATIBLE, ()),), ())
"""One group on each side, compatible, without a finding."""


def met(pack: RulePack, publishers: Iterable[QosProfile], subscribers: Iterable[QosProfile]) -> list[int]:
    """Return per publisher the subscribers of one topic that it matches, as bits."""
    sides = (tuple(GroupKey(each, False, frozenset(), False, 1) for each in side) for side in (publishers, subscribers))
    shape = TopicShape(pack, *sides)
    return _met(shape, _may_report(shape)).met


_remembered = lru_cache(maxsize=_REMEMBERED)(_judge)


# Pairs


def _may_report(shape: TopicShape) -> int:
    """Return as bits the rules over both ends that may report: of many combinations all, as each rule sorts them by what it reads."""
    rules = over_both(shape.pack)
    if len(shape.publishers) * len(shape.subscribers) > _FEW_PAIRS:
        return (1 << len(rules.rules)) - 1
    found = 0
    for first in shape.publishers:
        for second in shape.subscribers:
            found |= rules.that_report(first.profile, second.profile)
    return found


def _of_part(shape: TopicShape, reporting: int, part: str) -> Iterator[BoundRule]:
    """Yield those of the rules that may report that are of a part: matching conditions, or rules of pairs."""
    rules = over_both(shape.pack)
    return (rules.rules[position] for position in positions(reporting & rules.bits[part]))


def _met(shape: TopicShape, reporting: int) -> _Pairs:
    """Return the groups that match, and the conditions that keep the others from matching."""
    everybody = (1 << len(shape.subscribers)) - 1
    native = sum(1 << index for index, group in enumerate(shape.subscribers) if not group.copied)
    pairs = _Pairs(
        [native if group.copied else everybody for group in shape.publishers], sizes=_sizes(shape.subscribers)
    )
    for bound in _of_part(shape, reporting, "meets"):
        subscribers = value_groups(shape.subscribers, bound.bound.sides[1])
        for publishers, missed, _ in _spoken(shape, bound, subscribers):
            apart = NonMatch(bound, publishers.first.tags, subscribers)
            for publisher in publishers.members:
                kept = pairs.met[publisher] & missed
                if kept:
                    pairs.met[publisher] &= ~kept
                    apart.missed[publisher] = kept
            if apart.missed:
                pairs.kept_apart.append(apart)
    pairs.segments = [{(Verdict.COMPATIBLE, ()): met} if met else {} for met in pairs.met]
    return pairs


def _undecided_meetings(shape: TopicShape, reporting: int, pairs: _Pairs, hits: _Hits) -> None:
    """Leave unknown the pairs that a matching condition keeps apart under some assumptions only."""
    assuming = 0
    for side, groups in enumerate((shape.publishers, shape.subscribers)):
        for group in groups:
            assuming |= read_in_worlds(shape.pack, group.profile.frame, side)
    for bound in _of_part(shape, reporting & assuming, "meets"):
        first, second = bound.bound.sides
        offering, requesting = value_groups(shape.publishers, first), value_groups(shape.subscribers, second)
        for publishers in offering.each:
            for subscribers in requesting.each:
                violation = undecided_meeting(bound, publishers.profile, subscribers.profile)
                if violation is not None:
                    _note(shape, pairs, hits, _GroupReport(publishers, subscribers, violation, 0), pairs.met)
                    for at in publishers.members:
                        mask = subscribers.mask & pairs.met[at]
                        _split_segments(pairs.segments[at], mask, Verdict.UNKNOWN, (bound.rule.code,))


def _sizes(groups: Sequence[GroupKey]) -> list[int]:
    """The groups whose size has 1, 2, 4, … in it, as bits."""
    found = [0] * max((group.size.bit_length() for group in groups), default=0)
    for position, group in enumerate(groups):
        for power in positions(group.size):
            found[power] |= 1 << position
    return found


def _pair_rules(shape: TopicShape, reporting: int, pairs: _Pairs, hits: _Hits) -> None:
    needs = {word for group in shape.subscribers for word in group.profile.needs}
    fitting: list[int] | None = None
    guarantees = (each for each in shape.pack.by_scope.get("pair", ()) if each.rule.guarantee in needs)
    for bound in (*_of_part(shape, reporting, "pair"), *guarantees):
        asked = pairs.met
        if bound.rule.guarantee:
            asked = fitting = fitting or _fitting(pairs)
        said: dict[tuple[int, bool], int] = {}
        columns = value_groups(shape.subscribers, bound.bound.sides[1])
        for each in _few(bound, _spoken(shape, bound, columns), columns):
            _note(shape, pairs, hits, each, asked)
            for publisher in each.publishers.members:
                key = (publisher, each.violation.unknown)
                said[key] = said.get(key, 0) | each.subscribers.mask
        for (publisher, unknown), mask in said.items():
            verdict = verdict_by(bound.rule, unknown=unknown)
            _split_segments(pairs.segments[publisher], mask & asked[publisher], verdict, (bound.rule.code,))


def _end_segments(shape: TopicShape, pairs: _Pairs) -> None:
    """Apply the best verdict of each endpoint: no pair is compatible if one end is not understood or refused."""
    said: dict[tuple[Verdict, tuple[str, ...]], int] = {}
    for position, group in enumerate(shape.subscribers):
        for end in of_end(group.profile, SUBSCRIBER, group.observed, group.wired):
            said[end] = said.get(end, 0) | 1 << position
    for position, group in enumerate(shape.publishers):
        segments = pairs.segments[position]
        for verdict, codes in of_end(group.profile, PUBLISHER, group.observed, group.wired):
            _split_segments(segments, pairs.met[position], verdict, codes)
        for (verdict, codes), mask in said.items():
            _split_segments(segments, mask & pairs.met[position], verdict, codes)


def _fitting(pairs: _Pairs) -> list[int]:
    """Return per publisher group the subscriber groups that nothing refuses: only compatible pairs have guarantees."""
    found = []
    for segments in pairs.segments:
        mask = 0
        for (verdict, _), subscribers in segments.items():
            mask |= subscribers if verdict is not Verdict.INCOMPATIBLE else 0
        found.append(mask)
    return found


def _spoken(shape: TopicShape, bound: BoundRule, columns: ValueGroups) -> Iterator[_PublisherReport]:
    """Judge one rule over every combination of its value groups; yield its reports."""
    publishers = value_groups(shape.publishers, bound.bound.sides[0]).each
    if not bound.rule.guarantee:  # which depends on what the subscriber needs
        publishers = [each for each in publishers if not passed_over(bound, each.profile, each.profile)]
    subscribers = [each for each in columns.each if not passed_over(bound, each.profile, each.profile)]
    speaks = bound.rule.kind == "forbids"
    found = None
    if len(publishers) * len(subscribers) > relation.FEW_COMBINATIONS:
        found = related(
            bound.bound,
            [each.profile.values for each in publishers],
            [(each.profile.values, each.mask) for each in subscribers],
        )
    easy = bound.bound.infallible and all(
        bound.bound.is_plain(each.profile.values) for each in (*publishers, *subscribers)
    )
    for row, offering in enumerate(publishers):
        a, certain, asked = offering.profile.values, 0, subscribers
        if found is not None:
            certain = found.true[row] if speaks else found.false[row]
            asked = columns.within((found.doubtful if bound.rule.kind == "meets" else found.open)[row])
        others = []
        for requesting in asked:
            b = requesting.profile.values
            if easy:
                certain |= requesting.mask if bool(bound.bound.plain(a, b, NO_SIGNAL)) is speaks else 0
                continue
            violation = ask(bound, a, b)
            if violation is None:
                continue
            if violation.outcome.result is speaks:
                certain |= requesting.mask
            elif bound.rule.kind != "meets":
                others.append((requesting, violation))
        if certain or others:
            yield _PublisherReport(offering, certain, others)


def _few(bound: BoundRule, rows: Iterable[_PublisherReport], columns: ValueGroups) -> Iterator[_GroupReport]:
    """Yield the first combinations, then one per publisher group that stands for the others."""
    certain = Violation(bound, RuleAnswer(bound.rule.kind == "forbids"))
    later = []
    left = MOST_COMBINATIONS
    for publishers, mask, others in rows:
        if left:
            said = {id(each): violation for each, violation in others}
            for each in columns.within(reduce(or_, (each.mask for each, _ in others), mask))[:left]:
                yield _GroupReport(publishers, each, said.get(id(each), certain))
                left -= 1
                mask &= ~each.mask  # noqa: PLW2901 - what is left of it
                said.pop(id(each), None)
            others = [(each, violation) for each, violation in others if id(each) in said]  # noqa: PLW2901 - likewise
        together = []
        for _, same in columns.by_tags(mask):
            first = columns.first(same)
            together.append(
                _GroupReport(publishers, ValueGroup(first.first, first.members, same), certain, columns.count(same))
            )
        undecided: dict[frozenset[int], list[tuple[ValueGroup, Violation]]] = {}
        for each, violation in others:
            undecided.setdefault(each.first.tags, []).append((each, violation))
        for (first, violation), *more in undecided.values():
            same = reduce(or_, (each.mask for each, _ in more), first.mask)
            together.append(
                _GroupReport(publishers, ValueGroup(first.first, first.members, same), violation, len(more) + 1)
            )
        later += sorted(together, key=lambda each: each.subscribers.members[0])
    yield from later


def _note(shape: TopicShape, pairs: _Pairs, hits: _Hits, said: _GroupReport, asked: Sequence[int]) -> None:
    """Note the report of a rule about two value groups, or further merged ones, if they are pairs of ``asked``."""
    publishers, subscribers, violation, combinations = said
    if violation.unknown and (
        already_reported(violation, publishers.profile, subscribers.profile)
        or needs_misread(violation, subscribers.profile)
    ):
        return
    reached = {publisher: mask for publisher in publishers.members if (mask := asked[publisher] & subscribers.mask)}
    if not reached:
        return
    code, tags = violation_key(violation), publishers.first.tags | subscribers.first.tags
    key = (code, violation.outcome.result, tags) if combinations else (code, id(publishers), id(subscribers), tags)
    hit = hits.setdefault(key, Hit(violation, tags=tags))
    hit.more += combinations
    hit.pairs += sum(shape.publishers[publisher].size * pairs.weight(mask) for publisher, mask in reached.items())
    add_reached(hit, reached, subscribers.members)


def _split_segments(
    segments: dict[tuple[Verdict, tuple[str, ...]], int], mask: int, verdict: Verdict, codes: tuple[str, ...]
) -> None:
    """Apply a verdict for some subscribers to the segments of one publisher group."""
    for (before, known), present in list(segments.items()):
        touched = present & mask
        if not touched:
            continue
        left = present & ~touched
        if left:
            segments[before, known] = left
        else:
            del segments[before, known]
        worse = max(before, verdict, key=lambda each: each.rank)
        key = (worse, (*known, *(code for code in codes if code not in known)))
        segments[key] = segments.get(key, 0) | touched


def _rows(pairs: _Pairs, pack: RulePack) -> tuple[JudgedPairs, ...]:
    """Put publishers together whose pairs have equal results."""
    rows: dict[tuple[Verdict, tuple[str, ...], int], list[int]] = {}
    for publisher, segments in enumerate(pairs.segments):
        masks: dict[tuple[Verdict, tuple[str, ...]], int] = {}
        for (verdict, said), mask in segments.items():
            key = verdict, _in_order(said, pack)
            masks[key] = masks.get(key, 0) | mask
        for (verdict, codes), mask in masks.items():
            rows.setdefault((verdict, codes, mask), []).append(publisher)
    return tuple(
        JudgedPairs(tuple(publishers), mask, verdict, codes) for (verdict, codes, mask), publishers in rows.items()
    )


def _in_order(codes: tuple[str, ...], pack: RulePack) -> tuple[str, ...]:
    """Sort codes: those of no rule, then those of rules as the pack has them. What else is on a topic changes nothing."""
    places = _places(pack)
    return codes if len(codes) < 2 else tuple(sorted(codes, key=lambda code: (places.get(code, -1), code)))  # noqa: PLR2004 - one


@lru_cache
def _places(pack: RulePack) -> dict[str, int]:
    return {rule.code: place for place, rule in enumerate(pack.rules)}


# Endpoints


def _endpoint_rules(shape: TopicShape) -> Iterator[Hit[int]]:
    found = EndpointHits[int]()
    for role in (PUBLISHER, SUBSCRIBER):
        for position, group in enumerate(shape.side(role)):
            if group.copied:
                continue
            undecided = () if group.wired else undecided_of(group.profile, role, group.observed)
            for violation in judge_endpoint(group.profile, role, group.observed):
                if not violation.unknown or violation.failed is not None or violation in undecided:
                    found.note(violation, role, position, group.profile, group.tags)
    yield from found.values()


# Signals


def _signal_rules(shape: TopicShape, pairs: _Pairs, hits: _Hits) -> None:
    for hit in signal_hits(shape, pairs.met) if shape.pack.by_scope.get("signal") else ():
        hits["signal", len(hits)] = hit
        if hit.violation.refuses:
            _refuse(pairs, hit)


def _refuse(pairs: _Pairs, hit: Hit[int]) -> None:
    """Make pairs incompatible whose endpoints a rule over their topic refuses."""
    code = (hit.violation.bound.rule.code,)
    subscribers = sum(1 << position for position in hit.subscribers)
    for position, segments in enumerate(pairs.segments):
        mask = pairs.met[position] if position in hit.publishers else subscribers
        _split_segments(segments, mask, Verdict.INCOMPATIBLE, code)
