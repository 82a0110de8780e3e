"""A topic as rules see it: groups of endpoints on both sides, without names. What they say of a shape is remembered.

A rule looks at a few policies only, so it is judged once per distinct combination of those (its *classes*) rather than
per pair of endpoints, and what it says of a publisher is a set of subscribers, held as the bits of an integer. So even a
topic on which all endpoints differ costs little more than its distinct values. Most topics of most systems are like
others, in the same system or in the one that came before, and cost a look-up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.evaluate import NO_SIGNAL, Outcome, Signal
from cqos_core.judge import Spoken, already_told, ask, judge_endpoint, of_end, passed_over, verdict_by
from cqos_core.report import Verdict
from cqos_core.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.evaluate import Values
    from cqos_core.pack import BoundRule, RulePack
    from cqos_core.resolved import QosProfile

MOST_COMBINATIONS: Final = 25
"""Distinct combinations of values that one rule reports on one topic; the rest is put together in one finding."""
_REMEMBERED: Final = 16_384
_REMEMBERED_GROUPS: Final = 64
_ENDS: Final = frozenset({"offered", "requested", "publisher", "subscriber"})


class Alike(NamedTuple):
    """A group of endpoints in the eyes of rules; the fields are those of `pairing.Members`, ``size`` is their number.

    ``wired``: they are copies from another protocol, whose own rules say what keeps them from existing.
    """

    profile: QosProfile
    observed: bool
    tags: frozenset[int]
    carried: bool
    size: int
    wired: bool = False


class Shape(NamedTuple):
    """A topic in the eyes of rules."""

    pack: RulePack
    publishers: tuple[Alike, ...]
    subscribers: tuple[Alike, ...]

    def side(self, role: str) -> tuple[Alike, ...]:
        """The groups of one role."""
        return self.publishers if role == PUBLISHER else self.subscribers


@dataclass(slots=True)
class Outline:
    """A finding before it has names: one rule, equal values on each side; groups are told by their positions.

    Attributes:
        publishers, subscribers: the groups concerned, in order, as keys.
        pairs: how many pairs it speaks of.
        tags: acceptances that name all its endpoints.
        more: how many combinations of values are put together here, where there are too many to list; else 0.
        example: one of them: a group per role.
    """

    spoken: Spoken
    publishers: dict[int, None] = field(default_factory=dict)
    subscribers: dict[int, None] = field(default_factory=dict)
    pairs: int = 0
    tags: frozenset[int] = frozenset()
    more: int = 0
    example: dict[str, int] = field(default_factory=dict)

    def side(self, role: str) -> dict[int, None]:
        """The groups of one role."""
        return self.publishers if role == PUBLISHER else self.subscribers


@dataclass(slots=True, eq=False)
class Apart:
    """A meeting condition that keeps two classes apart: by publisher group the subscriber groups it does not meet."""

    bound: BoundRule
    tags: frozenset[int]
    hits: dict[int, int] = field(default_factory=dict)


class Row(NamedTuple):
    """Publisher groups, and as bits the subscriber groups, whose pairs were judged alike."""

    publishers: tuple[int, ...]
    subscribers: int
    verdict: Verdict
    codes: tuple[str, ...]


class Judged(NamedTuple):
    """What rules say of a shape.

    Attributes:
        met: per publisher group, the subscriber groups it meets, as bits.
        kept_apart: what keeps which groups from each other.
        rows: all pairs.
        outlines: of what is to be said.
    """

    met: tuple[int, ...]
    kept_apart: tuple[Apart, ...]
    rows: tuple[Row, ...]
    outlines: tuple[Outline, ...]


def judge_shape(shape: Shape) -> Judged:
    """Judge a shape; nobody may change the result, which others share."""
    if len(shape.publishers) + len(shape.subscribers) > _REMEMBERED_GROUPS:
        return _judge(shape)
    return _remembered(shape)


def positions(mask: int) -> Iterator[int]:
    """The positions of the bits that are set."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


@dataclass(slots=True)
class _Class:
    """Groups of one side that a rule cannot tell apart; ``mask`` has their bits."""

    first: Alike
    members: list[int] = field(default_factory=list)
    mask: int = 0

    @property
    def profile(self) -> QosProfile:
        return self.first.profile


@dataclass(slots=True)
class _Pairs:
    """Pairs while they are judged; ``segments`` are per publisher group: verdict and codes to subscriber groups."""

    met: list[int]
    kept_apart: list[Apart] = field(default_factory=list)
    segments: list[dict[tuple[Verdict, tuple[str, ...]], int]] = field(default_factory=list)


_Outlines = dict[tuple[Any, ...], Outline]


def _judge(shape: Shape) -> Judged:
    outlines: _Outlines = {}
    both = shape.publishers and shape.subscribers
    pairs = _met(shape) if both else _Pairs([0] * len(shape.publishers), segments=[{} for _ in shape.publishers])
    if both:
        _end_segments(shape, pairs)
    _signal_rules(shape, pairs, outlines)
    if both:
        _pair_rules(shape, pairs, outlines)
    _endpoint_rules(shape, outlines)
    return Judged(tuple(pairs.met), tuple(pairs.kept_apart), _rows(pairs), tuple(outlines.values()))


_remembered = lru_cache(maxsize=_REMEMBERED)(_judge)


# Pairs


def _met(shape: Shape) -> _Pairs:
    """Find which groups form pairs, and what keeps the others apart."""
    everybody = (1 << len(shape.subscribers)) - 1
    native = sum(1 << index for index, alike in enumerate(shape.subscribers) if not alike.carried)
    pairs = _Pairs([native if alike.carried else everybody for alike in shape.publishers])
    for bound in shape.pack.by_scope["meets"]:
        for publishers, subscribers, _ in _spoken_classes(shape, bound):
            apart = Apart(bound, publishers.first.tags | subscribers.first.tags)
            for publisher in publishers.members:
                hit = pairs.met[publisher] & subscribers.mask
                if hit:
                    pairs.met[publisher] &= ~hit
                    apart.hits[publisher] = hit
            if apart.hits:
                pairs.kept_apart.append(apart)
    pairs.segments = [{(Verdict.COMPATIBLE, ()): met} if met else {} for met in pairs.met]
    return pairs


def _pair_rules(shape: Shape, pairs: _Pairs, outlines: _Outlines) -> None:
    needs = {word for alike in shape.subscribers for word in alike.profile.needs}
    fitting: list[int] | None = None
    for bound in shape.pack.by_scope.get("pair", ()):
        asked = pairs.met
        if bound.rule.guarantee:
            if bound.rule.guarantee not in needs:
                continue
            asked = fitting = fitting or _fitting(pairs)
        said: dict[tuple[int, bool], int] = {}
        for publishers, subscribers, spoken, combinations in _few(_spoken_classes(shape, bound)):
            _outline(shape, outlines, publishers, subscribers, spoken, asked, combinations)
            for publisher in publishers.members:
                key = (publisher, spoken.unknown)
                said[key] = said.get(key, 0) | subscribers.mask
        for (publisher, unknown), mask in said.items():
            verdict = verdict_by(bound.rule, unknown=unknown)
            _split_segments(pairs.segments[publisher], mask & asked[publisher], verdict, (bound.rule.code,))


def _end_segments(shape: Shape, pairs: _Pairs) -> None:
    """Apply what holds of all pairs of an endpoint: no pair is compatible where one end of it is not understood or refused."""
    said: dict[tuple[Verdict, tuple[str, ...]], int] = {}
    for position, alike in enumerate(shape.subscribers):
        for end in of_end(alike.profile, SUBSCRIBER, alike.observed, alike.wired):
            said[end] = said.get(end, 0) | 1 << position
    for position, alike in enumerate(shape.publishers):
        segments = pairs.segments[position]
        for verdict, codes in of_end(alike.profile, PUBLISHER, alike.observed, alike.wired):
            _split_segments(segments, pairs.met[position], verdict, codes)
        for (verdict, codes), mask in said.items():
            _split_segments(segments, mask & pairs.met[position], verdict, codes)


def _fitting(pairs: _Pairs) -> list[int]:
    """Per publisher group the subscriber groups that nothing refuses: a guarantee is one of pairs that fit."""
    found = []
    for segments in pairs.segments:
        mask = 0
        for (verdict, _), subscribers in segments.items():
            mask |= subscribers if verdict is not Verdict.INCOMPATIBLE else 0
        found.append(mask)
    return found


def _spoken_classes(shape: Shape, bound: BoundRule) -> Iterator[tuple[_Class, _Class, Spoken]]:
    """Judge one rule over every combination of its classes; yield those of which it speaks."""
    first, second = bound.bound.sides
    publishers = _classes(shape.publishers, first)
    subscribers = _classes(shape.subscribers, second)
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
        key = (id(publishers), each.outcome.result, subscribers.first.tags)
        _, reached, said, count = together.get(
            key, (publishers, _Class(subscribers.first, subscribers.members), each, 0)
        )
        reached.mask |= subscribers.mask
        together[key] = (publishers, reached, said, count + 1)
    yield from together.values()


def _classes(groups: Iterable[Alike], indices: Sequence[int]) -> list[_Class]:
    """Sort one side's groups by the values that a rule reads of it, and by who excuses them."""
    found: dict[Any, _Class] = {}
    for position, alike in enumerate(groups):
        values = alike.profile.values
        key = (tuple([values[index] for index in indices]), alike.profile.unmatched, alike.tags)
        each = found.get(key)
        if each is None:
            each = found[key] = _Class(alike)
        each.members.append(position)
        each.mask |= 1 << position
    return list(found.values())


def _outline(
    shape: Shape,
    outlines: _Outlines,
    publishers: _Class,
    subscribers: _Class,
    spoken: Spoken,
    met: Sequence[int],
    combinations: int,
) -> None:
    """Note what a rule says of two classes, or of ``combinations`` further ones that are put together."""
    if spoken.unknown and already_told(spoken, publishers.profile, subscribers.profile):
        return
    hits = {publisher: hit for publisher in publishers.members if (hit := met[publisher] & subscribers.mask)}
    if not hits:
        return
    code, tags = spoken.bound.rule.code, publishers.first.tags | subscribers.first.tags
    key = (code, spoken.outcome.result, tags) if combinations else (code, id(publishers), id(subscribers), tags)
    outline = outlines.setdefault(key, Outline(spoken, tags=tags))
    outline.more += combinations
    if combinations and not outline.example:
        outline.example = _example(subscribers, hits)
    outline.publishers.update(dict.fromkeys(hits))
    reached = 0
    for publisher, hit in hits.items():
        reached |= hit
        outline.pairs += shape.publishers[publisher].size * _weight(shape.subscribers, hit)
    outline.subscribers.update(dict.fromkeys(positions(reached)))


def _example(subscribers: _Class, hits: Mapping[int, int]) -> dict[str, int]:
    """One publisher and one subscriber that meet, of the class that was judged if any of it does."""
    publisher, hit = next(iter(hits.items()))
    subscriber = next((each for each in subscribers.members if hit >> each & 1), (hit & -hit).bit_length() - 1)
    return {PUBLISHER: publisher, SUBSCRIBER: subscriber}


def _weight(groups: Sequence[Alike], mask: int) -> int:
    """How many endpoints the groups of ``mask`` have."""
    if mask == (1 << len(groups)) - 1:
        return sum(alike.size for alike in groups)
    return sum(groups[position].size for position in positions(mask))


def _split_segments(
    segments: dict[tuple[Verdict, tuple[str, ...]], int], mask: int, verdict: Verdict, codes: tuple[str, ...]
) -> None:
    """Apply what is known of some subscribers to the segments of one publisher group."""
    for (before, known), present in list(segments.items()):
        hit = present & mask
        if not hit:
            continue
        left = present & ~hit
        if left:
            segments[before, known] = left
        else:
            del segments[before, known]
        worse = max(before, verdict, key=lambda each: each.rank)
        key = (worse, (*known, *(code for code in codes if code not in known)))
        segments[key] = segments.get(key, 0) | hit


def _rows(pairs: _Pairs) -> tuple[Row, ...]:
    """Put publishers together whose pairs were judged alike."""
    rows: dict[tuple[Verdict, tuple[str, ...], int], list[int]] = {}
    for publisher, segments in enumerate(pairs.segments):
        for (verdict, codes), mask in segments.items():
            rows.setdefault((verdict, codes, mask), []).append(publisher)
    return tuple(Row(tuple(publishers), mask, verdict, codes) for (verdict, codes, mask), publishers in rows.items())


# Endpoints


def _endpoint_rules(shape: Shape, outlines: _Outlines) -> None:
    for role in (PUBLISHER, SUBSCRIBER):
        told: dict[str, int] = {}
        for position, alike in enumerate(shape.side(role)):
            if alike.carried:
                continue
            for spoken in judge_endpoint(alike.profile, role, alike.observed):
                if spoken.unknown and spoken.failed is None:
                    continue
                code = spoken.bound.rule.code
                values = tuple(alike.profile.values[use.index] for use in spoken.bound.bound.uses)
                key: tuple[Any, ...] = (code, role, values, alike.tags)
                further = key not in outlines and told.get(code, 0) >= MOST_COMBINATIONS
                if further:
                    key = (code, role, alike.tags)
                elif key not in outlines:
                    told[code] = told.get(code, 0) + 1
                outline = outlines.setdefault(key, Outline(spoken, tags=alike.tags))
                outline.more += further
                if further and not outline.example:
                    outline.example = {role: position}
                outline.side(role)[position] = None


# Signals


def _signal_rules(shape: Shape, pairs: _Pairs, outlines: _Outlines) -> None:
    rules = shape.pack.by_scope.get("signal", ())
    for publishers, subscribers in _parts(shape, pairs) if rules else ():
        for bound in rules:
            for spoken, role, targets in _signal_rule(shape, bound, publishers, subscribers):
                outline = Outline(spoken)
                if targets:
                    outline.tags = shape.side(role)[targets[0]].tags
                    outline.side(role).update(dict.fromkeys(targets))
                within = {use.second for use in bound.bound.aggregate_uses}
                if within != {True} and not outline.publishers:
                    outline.publishers = dict.fromkeys(publishers)
                if within != {False} and not outline.subscribers:
                    outline.subscribers = dict.fromkeys(subscribers)
                outlines["signal", len(outlines)] = outline
                if spoken.refuses:
                    _refuse(pairs, outline)


def _refuse(pairs: _Pairs, outline: Outline) -> None:
    """Make incompatible the pairs of endpoints that a rule over their topic refuses."""
    code = (outline.spoken.bound.rule.code,)
    subscribers = sum(1 << position for position in outline.subscribers)
    for position, segments in enumerate(pairs.segments):
        mask = pairs.met[position] if position in outline.publishers else subscribers
        _split_segments(segments, mask, Verdict.INCOMPATIBLE, code)


def _parts(shape: Shape, pairs: _Pairs) -> list[tuple[list[int], list[int]]]:
    """Split a topic into parts that do not meet each other (domains, partitions), each a signal of its own."""
    if not shape.publishers:
        return [([], list(range(len(shape.subscribers))))]
    parts: list[tuple[list[int], int]] = []
    for publisher, met in enumerate(pairs.met):
        together, reached = [publisher], met
        for part in [part for part in parts if part[1] & met]:
            parts.remove(part)
            together, reached = [*part[0], *together], reached | part[1]
        parts.append((together, reached))
    return [(publishers, list(positions(mask))) for publishers, mask in parts]


def _signal_rule(
    shape: Shape, bound: BoundRule, publishers: Sequence[int], subscribers: Sequence[int]
) -> Iterator[tuple[Spoken, str, list[int]]]:
    """Judge a rule over a whole signal; one about single endpoints of it comes with the groups it speaks of."""
    read = bound.bound.aggregated
    signal = Signal(_distinct(shape.publishers, publishers, read), _distinct(shape.subscribers, subscribers, read))
    role = PUBLISHER if bound.role == PUBLISHER else SUBSCRIBER
    single = any(use.term.scope in _ENDS for use in bound.bound.uses)
    if single:
        speaking, groups = (publishers if role == PUBLISHER else subscribers), shape.side(role)
        for alike in _sorted(groups, speaking, bound.bound.own):
            values = groups[alike[0]].profile.values
            spoken = ask(bound, values, values, signal)
            if spoken is not None and not (spoken.unknown and spoken.failed is None):
                yield spoken, role, alike
    else:
        any_role = PUBLISHER if publishers else SUBSCRIBER
        values = shape.side(any_role)[(*publishers, *subscribers)[0]].profile.values
        spoken = ask(bound, values, values, signal)
        if spoken is not None and not (spoken.unknown and spoken.failed is None):
            yield spoken, role, []


def _sorted(groups: Sequence[Alike], chosen: Iterable[int], indices: Sequence[int]) -> list[list[int]]:
    """Sort some groups by what stands at ``indices``, and by who excuses them."""
    found: dict[Any, list[int]] = {}
    for position in chosen:
        values = groups[position].profile.values
        found.setdefault((tuple([values[index] for index in indices]), groups[position].tags), []).append(position)
    return list(found.values())


def _distinct(groups: Sequence[Alike], chosen: Iterable[int], indices: Sequence[int]) -> tuple[tuple[Values, int], ...]:
    """One value tuple per combination of values at ``indices``, with how many endpoints have it."""
    return tuple(
        (groups[alike[0]].profile.values, sum(groups[position].size for position in alike))
        for alike in _sorted(groups, chosen, indices)
    )
