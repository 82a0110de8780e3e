"""One topic as a unit: who meets whom, which rules speak, who is left alone.

A rule looks at a few policies only, so it is judged once per distinct combination of those (its *classes*) rather than
per pair of endpoints, and what it says of a publisher is a set of subscribers, held as the bits of an integer. So even a
topic on which all endpoints differ costs little more than its distinct values.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from cqos_core.codes import CODES
from cqos_core.evaluate import NO_SIGNAL, Outcome
from cqos_core.findings import MOST_COMBINATIONS, Draft, Made, already_told, headline, make, sides_of, subject
from cqos_core.judge import Spoken, ask, in_order, judge_endpoint, judge_pair, judge_signal, passed_over
from cqos_core.pairing import group
from cqos_core.report import Finding, Group, Severity, Side, Verdict
from cqos_core.settle import settle
from cqos_core.system import PUBLISHER, SUBSCRIBER
from cqos_core.team import TeamCheck, team_findings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_core.pack import BoundRule
    from cqos_core.pairing import Members, Topic
    from cqos_core.resolve import QosProfile, Resolved
    from cqos_core.system import Acceptance


@dataclass(frozen=True, slots=True)
class TopicResult:
    """What the check of one topic says: groups of pairs, findings to be put together, and who was left alone."""

    groups: tuple[Group, ...] = ()
    made: tuple[Made, ...] = ()
    lonely: tuple[Resolved, ...] = ()


@dataclass(slots=True)
class _Class:
    """Groups of one side that a rule cannot tell apart; ``mask`` has their bits."""

    members: list[Members] = field(default_factory=list)
    mask: int = 0

    @property
    def profile(self) -> QosProfile:
        return self.members[0].profile


@dataclass(slots=True, eq=False)
class _Apart:
    """A meeting condition that keeps two classes apart: by publisher group the subscriber groups it does not meet."""

    bound: BoundRule
    tags: frozenset[int]
    hits: dict[int, int] = field(default_factory=dict)


@dataclass(slots=True)
class _Pairs:
    """The pairs of a topic, judged.

    Attributes:
        met: per publisher group, by index, the subscriber groups it meets.
        kept_apart: what keeps which groups from each other.
        segments: per publisher group: verdict and codes to subscriber groups.
    """

    met: list[int]
    kept_apart: list[_Apart] = field(default_factory=list)
    segments: list[dict[tuple[Verdict, tuple[str, ...]], int]] = field(default_factory=list)


Drafts = dict[tuple[Any, ...], Draft]


def check_topic(
    endpoints: Sequence[Resolved],
    acceptances: Sequence[Acceptance] = (),
    checks: Mapping[int, Sequence[TeamCheck]] | None = None,
) -> TopicResult:
    """Judge one topic of one protocol: a pure function of its endpoints, the acceptances and the team's rules."""
    topic = group(endpoints, acceptances)
    settle(topic)
    drafts: Drafts = {}
    pairs = _judge_pairs(topic, drafts) if topic.publishers and topic.subscribers else _no_pairs(topic)
    groups = _groups(topic, pairs)
    _endpoint_rules(topic, drafts)
    _signal_rules(topic, pairs, drafts)
    made = [make(draft) for draft in drafts.values()]
    made += _splits(topic, pairs)
    made += team_findings(topic, (checks or {}).get(id(topic.pack), ()))
    made += _within_participants(topic, groups)
    alone = not (topic.publishers and topic.subscribers)
    lonely = tuple(endpoint for endpoint in topic.endpoints if alone and not endpoint.is_copy)
    return TopicResult(tuple(groups), tuple(made), lonely)


def _no_pairs(topic: Topic) -> _Pairs:
    return _Pairs([0] * len(topic.publishers), segments=[{} for _ in topic.publishers])


def _judge_pairs(topic: Topic, drafts: Drafts) -> _Pairs:
    everybody = (1 << len(topic.subscribers)) - 1
    native = sum(1 << index for index, members in enumerate(topic.subscribers) if not members.carried)
    pairs = _Pairs([native if members.carried else everybody for members in topic.publishers])
    index_of = {members: index for index, members in enumerate(topic.publishers)}
    for bound in topic.pack.by_scope["meets"]:
        for publishers, subscribers, _ in _spoken_classes(topic, bound):
            apart = _Apart(bound, publishers.members[0].tags | subscribers.members[0].tags)
            for publisher in publishers.members:
                index = index_of[publisher]
                hit = pairs.met[index] & subscribers.mask
                if hit:
                    pairs.met[index] &= ~hit
                    apart.hits[index] = hit
            if apart.hits:
                pairs.kept_apart.append(apart)
    pairs.segments = [{(Verdict.COMPATIBLE, ()): met} if met else {} for met in pairs.met]
    needs = {word for members in topic.subscribers for word in members.profile.needs}
    fitting: list[int] | None = None
    for bound in in_order(topic.pack.by_scope.get("pair", ())):
        asked = pairs.met
        if bound.rule.guarantee:
            if bound.rule.guarantee not in needs:
                continue
            asked = fitting = fitting or _fitting(pairs)
        said: dict[tuple[int, bool], int] = {}
        for publishers, subscribers, spoken, combinations in _few(_spoken_classes(topic, bound)):
            _draft(topic, drafts, publishers, subscribers, spoken, asked, index_of, combinations)
            for publisher in publishers.members:
                key = (index_of[publisher], spoken.unknown)
                said[key] = said.get(key, 0) | subscribers.mask
        for (index, unknown), mask in said.items():
            _split_segments(pairs.segments[index], bound, mask & asked[index], unknown=unknown)
    return pairs


def _fitting(pairs: _Pairs) -> list[int]:
    """Per publisher group the subscriber groups that nothing refuses: a guarantee is one of pairs that fit."""
    found = []
    for segments in pairs.segments:
        mask = 0
        for (verdict, _), subscribers in segments.items():
            mask |= subscribers if verdict is not Verdict.INCOMPATIBLE else 0
        found.append(mask)
    return found


def _spoken_classes(topic: Topic, bound: BoundRule) -> Iterator[tuple[_Class, _Class, Spoken]]:
    """Judge one rule over every combination of its classes; yield those of which it speaks."""
    publishers = _classes(topic.publishers, bound, second=False)
    subscribers = _classes(topic.subscribers, bound, second=True)
    speaks = bound.rule.kind == "forbids"
    told = Spoken(bound, Outcome(speaks))
    judge = bound.bound.plain
    easy = bound.bound.infallible and all(
        bound.bound.is_plain(each.profile.values) for each in (*publishers, *subscribers)
    )
    for offering in publishers:
        a = offering.profile
        for requesting in subscribers:
            b = requesting.profile
            if passed_over(bound, a, b):
                continue
            if easy:
                if bool(judge(a.values, b.values, NO_SIGNAL)) is speaks:
                    yield offering, requesting, told
                continue
            spoken = ask(bound, a.values, b.values)
            if spoken is not None and not (bound.rule.kind == "meets" and spoken.outcome.result is not False):
                yield offering, requesting, spoken


def _few(
    spoken: Iterator[tuple[_Class, _Class, Spoken]],
) -> Iterator[tuple[_Class, _Class, Spoken, int]]:
    """Pass the first combinations on, each counted 0, and then per publisher class one that stands for the others."""
    together: dict[tuple[Any, ...], tuple[_Class, _Class, Spoken, int]] = {}
    for number, (publishers, subscribers, each) in enumerate(spoken):
        if number < MOST_COMBINATIONS:
            yield publishers, subscribers, each, 0
            continue
        key = (id(publishers), each.outcome.result, subscribers.members[0].tags)
        _, reached, first, count = together.get(key, (publishers, _Class(subscribers.members), each, 0))
        reached.mask |= subscribers.mask
        together[key] = (publishers, reached, first, count + 1)
    yield from together.values()


def _classes(groups: Sequence[Members], bound: BoundRule, *, second: bool) -> list[_Class]:
    """Sort one side's groups by the values that the rule reads of it, and by who excuses them."""
    size = bound.bound.vocabulary.size
    # An option may differ between participants, so a rule over one reads it on both sides.
    indices = {use.index for use in bound.bound.uses if use.second is second or use.term.scope == "option"}
    indices |= {index + size for index in indices & bound.bound.asked}
    found: dict[Any, _Class] = {}
    for position, members in enumerate(groups):
        values = members.profile.values
        key = (tuple(values[index] for index in indices), members.profile.unmatched, members.tags)
        each = found.setdefault(key, _Class())
        each.members.append(members)
        each.mask |= 1 << position
    return list(found.values())


def _draft(
    topic: Topic,
    drafts: Drafts,
    publishers: _Class,
    subscribers: _Class,
    spoken: Spoken,
    met: Sequence[int],
    index_of: Mapping[Members, int],
    combinations: int,
) -> None:
    """Note what a rule says of two classes, or of ``combinations`` further ones that are put together."""
    if spoken.unknown and already_told(spoken, publishers.profile, subscribers.profile):
        return
    hits = {members: met[index_of[members]] & subscribers.mask for members in publishers.members}
    meeting = [members for members, hit in hits.items() if hit]
    if not meeting:
        return
    code, tags = spoken.bound.rule.code, publishers.members[0].tags | subscribers.members[0].tags
    key = (code, spoken.outcome.result, tags) if combinations else (code, id(publishers), id(subscribers), tags)
    draft = drafts.setdefault(key, Draft(topic, spoken, tags=tags))
    draft.more += combinations
    if combinations and not draft.example:
        draft.example = _example(topic, subscribers, hits)
    draft.publishers.update(dict.fromkeys(meeting))
    reached = 0
    for members in meeting:
        reached |= hits[members]
        draft.pairs += len(members.endpoints) * _weight(topic, hits[members])
    draft.subscribers.update(dict.fromkeys(_at(topic.subscribers, reached)))


def _example(topic: Topic, subscribers: _Class, hits: Mapping[Members, int]) -> tuple[Members, Members]:
    """One publisher and one subscriber that meet, of the class that was judged if any of it does."""
    judged = {topic.subscribers.index(members) for members in subscribers.members}
    publisher, hit = next((publisher, hit) for publisher, hit in hits.items() if hit)
    index = next((each for each in judged if hit >> each & 1), (hit & -hit).bit_length() - 1)
    subscriber = topic.subscribers[index]
    return publisher.only([publisher.first]), subscriber.only([subscriber.first])


def _at(groups: Sequence[Members], mask: int) -> Iterator[Members]:
    """The groups whose bits are set."""
    while mask:
        low = mask & -mask
        yield groups[low.bit_length() - 1]
        mask ^= low


def _weight(topic: Topic, mask: int) -> int:
    """How many endpoints the subscriber groups of ``mask`` have."""
    if mask == (1 << len(topic.subscribers)) - 1:
        return topic.subscriber_count
    return sum(len(members.endpoints) for members in _at(topic.subscribers, mask))


def _split_segments(
    segments: dict[tuple[Verdict, tuple[str, ...]], int], bound: BoundRule, mask: int, *, unknown: bool
) -> None:
    """Apply what a rule says of some subscribers to the segments of one publisher group."""
    rule = bound.rule
    for (verdict, codes), present in list(segments.items()):
        hit = present & mask
        if not hit:
            continue
        worse = verdict
        if rule.kind == "requires":
            said = Verdict.UNKNOWN if unknown or rule.doubt else Verdict.INCOMPATIBLE
            worse = max(verdict, said, key=lambda each: each.rank)
        left = present & ~hit
        if left:
            segments[verdict, codes] = left
        else:
            del segments[verdict, codes]
        key = (worse, (*codes, rule.code))
        segments[key] = segments.get(key, 0) | hit


def _groups(topic: Topic, pairs: _Pairs) -> list[Group]:
    """Put publishers together whose pairs were judged alike."""
    rows: dict[tuple[Verdict, tuple[str, ...], int], list[Members]] = {}
    for publisher, segments in zip(topic.publishers, pairs.segments, strict=True):
        for (verdict, codes), mask in segments.items():
            rows.setdefault((verdict, codes, mask), []).append(publisher)
    return [
        _group(topic, publishers, list(_at(topic.subscribers, mask)), verdict, codes)
        for (verdict, codes, mask), publishers in rows.items()
    ]


def _group(
    topic: Topic,
    publishers: Sequence[Members],
    subscribers: Sequence[Members],
    verdict: Verdict,
    codes: tuple[str, ...],
) -> Group:
    offering = [endpoint for members in publishers for endpoint in members.endpoints]
    requesting = [endpoint for members in subscribers for endpoint in members.endpoints]
    owners: dict[str, int] = {}
    for endpoint in offering:
        owners[endpoint.endpoint.participant] = owners.get(endpoint.endpoint.participant, 0) + 1
    internal = sum(owners.get(endpoint.endpoint.participant, 0) for endpoint in requesting)
    return Group(
        topic=topic.shown,
        publishers=tuple(sorted(endpoint.id for endpoint in offering)),
        subscribers=tuple(sorted(endpoint.id for endpoint in requesting)),
        verdict=verdict,
        protocol=topic.pack.id,
        internal=internal,
        codes=codes,
    )


def _endpoint_rules(topic: Topic, drafts: Drafts) -> None:
    for role, groups in ((PUBLISHER, topic.publishers), (SUBSCRIBER, topic.subscribers)):
        told: dict[str, int] = {}
        for members in groups:
            if members.carried:
                continue
            for spoken in judge_endpoint(members.profile, role, members.observed):
                if spoken.unknown and spoken.failed is None:
                    continue
                code = spoken.bound.rule.code
                values = tuple(members.profile.values[use.index] for use in spoken.bound.bound.uses)
                key: tuple[Any, ...] = (code, role, values, members.tags)
                further = key not in drafts and told.get(code, 0) >= MOST_COMBINATIONS
                if further:
                    key = (code, role, members.tags)
                elif key not in drafts:
                    told[code] = told.get(code, 0) + 1
                draft = drafts.setdefault(key, Draft(topic, spoken, tags=members.tags))
                draft.more += further
                if further and not draft.example:
                    draft.example = (members.only([members.first]),)
                (draft.publishers if role == PUBLISHER else draft.subscribers)[members] = None


def _parts(topic: Topic, pairs: _Pairs) -> list[tuple[list[Members], list[Members]]]:
    """Split a topic into parts that do not meet each other (domains, partitions), each a signal of its own."""
    if not topic.publishers:
        return [([], topic.subscribers)]
    parts: list[tuple[list[Members], int]] = []
    for publisher, met in zip(topic.publishers, pairs.met, strict=True):
        together, reached = [publisher], met
        for part in [part for part in parts if part[1] & met]:
            parts.remove(part)
            together, reached = [*part[0], *together], reached | part[1]
        parts.append((together, reached))
    return [(publishers, list(_at(topic.subscribers, mask))) for publishers, mask in parts]


def _signal_rules(topic: Topic, pairs: _Pairs, drafts: Drafts) -> None:
    rules = topic.pack.by_scope.get("signal", ())
    if not rules:
        return
    for publishers, subscribers in _parts(topic, pairs):
        for spoken, targets in judge_signal(rules, publishers, subscribers):
            within = {use.second for use in spoken.bound.bound.aggregate_uses}
            draft = Draft(topic, spoken)
            if targets:
                draft.tags = targets[0].tags
                side = draft.publishers if targets[0].first.role == PUBLISHER else draft.subscribers
                side.update(dict.fromkeys(targets))
            if within != {True} and not draft.publishers:
                draft.publishers = dict.fromkeys(publishers)
            if within != {False} and not draft.subscribers:
                draft.subscribers = dict.fromkeys(subscribers)
            drafts["signal", len(drafts)] = draft


def _splits(topic: Topic, pairs: _Pairs) -> list[Made]:
    """Report what keeps endpoints apart: each that is left alone by it, and once a topic where nobody is."""
    met_by_any = 0
    for met in pairs.met:
        met_by_any |= met
    alone = _alone(topic.subscribers, lambda index: met_by_any >> index & 1)
    loud: Drafts = {}
    quiet: Drafts = {}
    for each in pairs.kept_apart:
        for index, hit in each.hits.items():
            publisher = topic.publishers[index]
            left = _alone([publisher], lambda _, index=index: pairs.met[index])  # type: ignore[misc]
            told = hit if each.bound.rule.always or left.told else hit & alone.told
            if told:
                _kept_apart(topic, loud, each, publisher, told)
            # Of those whose partners are elsewhere anyway there is nothing to say.
            if not left.all:
                rest = hit & ~told & ~alone.all
                if rest:
                    _kept_apart(topic, quiet, each, publisher, rest, quiet=True)
    return [
        *(_split_finding(topic, draft, quiet=False) for draft in loud.values()),
        *(_split_finding(topic, draft, quiet=True) for draft in quiet.values()),
    ]


class _Alone(NamedTuple):
    """Groups without any partner, as bits: all of them, and those of which it is worth telling."""

    all: int
    told: int


def _alone(groups: Sequence[Members], met: Callable[[int], int]) -> _Alone:
    left = [(index, members) for index, members in enumerate(groups) if not members.carried and not met(index)]
    return _Alone(sum(1 << index for index, _ in left), sum(1 << index for index, each in left if not _external(each)))


def _kept_apart(
    topic: Topic, drafts: Drafts, apart: _Apart, publisher: Members, mask: int, *, quiet: bool = False
) -> None:
    """Note that a publisher never meets the subscribers of ``mask``."""
    code = apart.bound.rule.code
    key: tuple[Any, ...] = (code,) if quiet else (code, id(apart))
    further = not quiet and key not in drafts and sum(other[0] == code for other in drafts) >= MOST_COMBINATIONS
    if further:
        key = (code, "further", apart.tags)
    draft = drafts.get(key)
    if draft is None:
        tags = frozenset[int]() if quiet else apart.tags
        draft = drafts[key] = Draft(topic, Spoken(apart.bound, Outcome(result=False)), tags=tags)
    subscribers = list(_at(topic.subscribers, mask))
    if further:
        draft.more += 1
        draft.example = draft.example or (
            publisher.only([publisher.first]),
            subscribers[0].only([subscribers[0].first]),
        )
    draft.publishers[publisher] = None
    draft.subscribers.update(dict.fromkeys(subscribers))


def _external(members: Members) -> bool:
    return all(endpoint.external for endpoint in members.endpoints)


def _split_finding(topic: Topic, draft: Draft, *, quiet: bool) -> Made:
    made = make(draft)
    rule = draft.spoken.bound.rule
    publishers, subscribers = (
        ([draft.example[0]], [draft.example[1]]) if draft.more else (draft.publishers, draft.subscribers)
    )
    sides = sides_of(draft.spoken, publishers, subscribers)
    subjects = " and ".join(subject(side) for side in reversed(sides))
    behind = judge_pair(next(iter(publishers)).profile, next(iter(subscribers)).profile)
    latent = tuple(
        f"behind it: {headline(each, sides_of(each, publishers, subscribers), topic.shown)} ({each.bound.rule.code})"
        for each in behind.spoken
        if each.bound.rule.kind == "requires" and not each.unknown
    )
    values = "; ".join(
        f"{side.role} has {', '.join(f'{fact.policy} {fact.value}' for fact in side.facts)}"
        for side in reversed(sides)
        if side.facts and not quiet
    )
    message = f"{subjects} on topic `{topic.shown}` never meet{f' ({values})' if values else ''}: {rule.because}"
    if draft.more:
        message = f"{draft.more} further combinations of values keep endpoints apart, for instance: {message}"
    if quiet:
        message = f"some endpoints on topic `{topic.shown}` never meet: {rule.because}"
    finding = replace(
        made.finding,
        message=message,
        severity=Severity.NOTE if quiet else Severity(rule.severity),
        verdict=None,
        sides=tuple(replace(side, facts=()) for side in made.finding.sides) if quiet else made.finding.sides,
        remedies=(),
        notes=latent,
        pairs=0,
    )
    return replace(made, finding=finding, merge_key=("own", object()))


def _within_participants(topic: Topic, groups: Sequence[Group]) -> list[Made]:
    if not any(group.internal for group in groups):
        return []
    publishing = {e.endpoint.participant: e for members in topic.publishers for e in members.endpoints}
    inside = [
        (publishing[endpoint.endpoint.participant], endpoint)
        for members in topic.subscribers
        for endpoint in members.endpoints
        if endpoint.endpoint.participant in publishing
    ]
    owners = sorted({subscriber.participant.participant.id for _, subscriber in inside})
    more = f" and {len(owners) - 1} more" if len(owners) > 1 else ""
    finding = Finding(
        code="CQ406",
        name=CODES["CQ406"].name,
        severity=Severity.NOTE,
        message=(
            f"participant `{owners[0]}` subscribes to `{topic.shown}`, which it publishes itself"
            if not more
            else f"participants `{owners[0]}`{more} subscribe to `{topic.shown}`, which they publish themselves"
        ),
        topic=topic.shown,
        sides=(
            Side(SUBSCRIBER, tuple(sorted(s.id for _, s in inside)), place=inside[0][1].endpoint.place),
            Side(PUBLISHER, tuple(sorted({p.id for p, _ in inside})), place=inside[0][0].endpoint.place),
        ),
        because=CODES["CQ406"].reason,
    )
    return [Made(finding, ("own", object()), frozenset())]
