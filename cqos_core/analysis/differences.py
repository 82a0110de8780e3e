"""What two systems say differently about the same topics and endpoints: a design and a snapshot, a design and a bag.

Only what both know is compared. A default is known of a designed endpoint and not of an observed one; of a value that
depends on something, it is known which values it may have. What is missing from an observed system is only missing
where it was looked for: on a topic that it mentions, among the endpoints of a kind that it has.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.checking.findings import fact
from cqos_core.exporters.contract import ExportContext, judged
from cqos_core.language.policy import ENDPOINT, Depends, is_plain, normalise
from cqos_core.matching.pairing import bucket, group
from cqos_core.matching.peer_values import settle
from cqos_core.model.report import TextEnum

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.checking.checker import Context
    from cqos_core.exporters.contract import Judged
    from cqos_core.language.policy import Plain, Value
    from cqos_core.model.report import Fact
    from cqos_core.model.system import Place, System
    from cqos_core.resolving.resolved import QosProfile, Resolved

_TYPE: Final = "type"
_CLOSEST: Final = 64
"""So many endpoints of one topic and kind are matched by how little they differ; of more it would take too long."""


class ComparedSide(TextEnum):
    """Which of the two systems."""

    A = "a"
    B = "b"


@dataclass(frozen=True, slots=True)
class Named:
    """An endpoint of one of the systems.

    Attributes:
        participant: as files of its protocol name it: a node's full name.
        kind: ``publisher``, ``subscriber``, ``service_server`` …
    """

    id: str
    participant: str
    kind: str
    topic: str
    protocol: str
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Missing:
    """An endpoint that only one of the systems has, ``only_in``."""

    only_in: ComparedSide
    endpoint: Named


@dataclass(frozen=True, slots=True)
class Different:
    """A policy, or the type, to which the two systems give different values; each with where it comes from."""

    a: Named
    b: Named
    policy: str
    value_a: Fact
    value_b: Fact


@dataclass(frozen=True, slots=True)
class Diff:
    """What was found; true if there is any difference.

    Attributes:
        missing: endpoints that one of the systems lacks.
        different: values that differ.
        matched: how many endpoints are in both.
        by_topic: how many of them were matched by topic and kind only, because their participants have different names.
        not_compared: what one of the systems does not know, and so was left out, one sentence each.
    """

    missing: tuple[Missing, ...] = ()
    different: tuple[Different, ...] = ()
    matched: int = 0
    by_topic: int = 0
    not_compared: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Whether there is any difference."""
        return bool(self.missing or self.different)


_Slot: TypeAlias = tuple[str, str, str]
"""Protocol, topic in the form endpoints meet on, and kind."""


@dataclass(frozen=True, slots=True)
class _End:
    """An endpoint with the values it has after settling."""

    judged: Judged
    profiles: tuple[QosProfile, ...]
    named: Named
    slot: _Slot


_Pairs: TypeAlias = list[tuple[_End, _End]]


@dataclass(slots=True)
class _KnownValues:
    """What one system says.

    Attributes:
        slots: its endpoints.
        observed: nobody designed any of it.
        topics: of which it speaks, with their protocols.
        kinds: of endpoints that it has, with their protocols.
        external: names of topics on which others than its own endpoints may be.
    """

    side: ComparedSide
    slots: dict[_Slot, list[_End]] = field(default_factory=dict)
    observed: bool = False
    topics: set[tuple[str, str]] = field(default_factory=set)
    kinds: set[tuple[str, str]] = field(default_factory=set)
    external: set[str] = field(default_factory=set)


def compare(a: System, b: System, context: Context, topics: Sequence[str] = (), ignored: Sequence[str] = ()) -> Diff:
    """Compare two systems, ``a`` and ``b``.

    ``topics`` are shell patterns of the topics to compare, all if there are none, and ``ignored`` of those not to compare.
    """
    known_a, known_b = (
        _known(system, side, context, topics, ignored) for side, system in ((ComparedSide.A, a), (ComparedSide.B, b))
    )
    found = _Comparison(known_a, known_b)
    for slot in sorted({*known_a.slots, *known_b.slots}):
        found.slot(known_a.slots.get(slot, []), known_b.slots.get(slot, []))
    return found.result()


def _known(
    system: System, side: ComparedSide, context: Context, topics: Sequence[str], ignored: Sequence[str]
) -> _KnownValues:
    """Sort what a system says; what no pack judges is not compared."""
    plain = _without_variants(system, context)
    endpoints = judged(plain, ExportContext(context.find_pack, context.default_protocol)).endpoints
    settled = _settled(part for each in endpoints for part in each.parts)
    known = _KnownValues(side, observed=bool(endpoints) and all(each.endpoint.observed for each in endpoints))
    known.external = {_bare(name) for name, topic in system.topics.items() if topic.external}
    for each in endpoints:
        if not each.parts or each.parts[0].key is None:
            continue
        end = _end(each, settled)
        if not _wanted(end.named.topic, topics, ignored):
            continue
        protocol, topic, kind = end.slot
        known.slots.setdefault(end.slot, []).append(end)
        known.topics.add((protocol, topic))
        known.kinds.add((protocol, kind))
        if each.parts[0].external and not each.endpoint.external:
            known.external |= {_bare(topic), _bare(end.named.topic)}
    return known


def _without_variants(system: System, context: Context) -> System:
    """Return the system without options that choose another way to judge: values are compared by what they mean."""
    options = {}
    for pack_id, settings in system.options.items():
        pack = context.find_pack(pack_id)
        choosing = {option for option, _ in pack.variants} if pack is not None else set()
        options[pack_id] = {name: each for name, each in settings.items() if normalise(name) not in choosing}
    return replace(system, options=options)


def _wanted(topic: str, topics: Sequence[str], ignored: Sequence[str]) -> bool:
    def named(patterns: Sequence[str]) -> bool:
        return any(fnmatchcase(topic, pattern) or fnmatchcase(_bare(topic), pattern) for pattern in patterns)

    return (not topics or named(topics)) and not named(ignored)


def _bare(topic: str) -> str:
    return topic.lstrip("/")


def _settled(endpoints: Iterable[Resolved]) -> dict[int, QosProfile]:
    """Profiles by the identity of the endpoint, with values from peers filled in."""
    found = {}
    for members in bucket(endpoints).values():
        topic = group(members)
        settle(topic)
        for each in (*topic.publishers, *topic.subscribers):
            found.update({id(endpoint): each.profile for endpoint in each.endpoints})
    return found


def _end(each: Judged, settled: Mapping[int, QosProfile]) -> _End:
    first, stated = each.parts[0], each.endpoint
    address = first.pack.meeting.address(stated.participant, first.participant.texts)
    kind = stated.role if stated.kind == "message" else stated.kind
    topic = first.shown if each.whole is not None else stated.topic or ""
    named = Named(each.id, address, kind, topic, first.pack.id, stated.place)
    profiles = tuple(settled.get(id(part), part.profile) for part in each.parts)
    return _End(each, profiles, named, (first.pack.id, first.key or "", kind))


class _Comparison:
    """Compares slot by slot."""

    def __init__(self, a: _KnownValues, b: _KnownValues) -> None:
        self.a, self.b = a, b
        self.designed = not (a.observed or b.observed)
        self.missing: list[Missing] = []
        self.different: list[Different] = []
        self.matched = 0
        self.by_topic = 0
        self.unknown: dict[tuple[ComparedSide, str], set[str]] = {}

    def slot(self, a: Iterable[_End], b: Iterable[_End]) -> None:
        """Match the endpoints of one topic and kind within their participants, then those that are left over."""
        left_a: list[_End] = []
        left_b: list[_End] = []
        of_b = _by_participant(b)
        for participant, ends in _by_participant(a).items():
            pairs, rest_a, rest_b = _matched(ends, of_b.pop(participant, []), by_id=self.designed)
            self.pairs(pairs)
            left_a += rest_a
            left_b += rest_b
        left_b += [end for ends in of_b.values() for end in ends]
        pairs, rest_a, rest_b = _matched(left_a, left_b, by_id=self.designed)
        self.by_topic += len(pairs)
        self.pairs(pairs)
        self.rest(rest_a, self.a, self.b)
        self.rest(rest_b, self.b, self.a)

    def pairs(self, pairs: _Pairs) -> None:
        """Compare the values of endpoints that are in both systems."""
        self.matched += len(pairs)
        for a, b in pairs:
            self.different += _differences(a, b)

    def rest(self, ends: Iterable[_End], here: _KnownValues, there: _KnownValues) -> None:
        """Report endpoints that are only here, where they would be there if they existed."""
        for end in ends:
            why = _why_not(end, here, there)
            if why is None:
                self.missing.append(Missing(here.side, end.named))
            else:
                self.unknown.setdefault((here.side, why), set()).add(end.named.id)

    def result(self) -> Diff:
        """Return all of it in a stable order."""
        said = (
            f"{len(ids)} endpoint{'s' if len(ids) > 1 else ''} of {side.upper()}: {why}"
            for (side, why), ids in sorted(self.unknown.items())
        )
        return Diff(
            tuple(sorted(self.missing, key=lambda each: (each.endpoint.topic, each.endpoint.kind, each.endpoint.id))),
            tuple(sorted(self.different, key=lambda each: (each.a.topic, each.a.kind, each.a.id))),
            self.matched,
            self.by_topic,
            tuple(said),
        )


def _why_not(end: _End, here: _KnownValues, there: _KnownValues) -> str | None:
    """Why it says nothing that an endpoint is only here; None where it does."""
    protocol, topic, kind = end.slot
    other = there.side.upper()
    if there.observed and (protocol, topic) not in there.topics:
        return f"{other} was observed and does not mention their topics"
    if there.observed and (protocol, kind) not in there.kinds:
        return f"{other} was observed and reports no {kind}s at all"
    names = {_bare(topic), _bare(end.named.topic)}
    if here.observed and not there.observed and names & (here.external | there.external):
        return f"their topics are external, so others than those in {other} may be there"
    return None


def _by_participant(ends: Iterable[_End]) -> dict[str, list[_End]]:
    found: dict[str, list[_End]] = {}
    for end in sorted(ends, key=lambda end: (end.named.participant, end.named.id)):
        found.setdefault(end.named.participant, []).append(end)
    return found


def _matched(a: Sequence[_End], b: Sequence[_End], *, by_id: bool) -> tuple[_Pairs, list[_End], list[_End]]:
    """Match endpoints, first those that have one id or differ least; return the pairs and what is left of both."""
    shorter, longer = sorted((len(a), len(b)))
    if longer <= 1 or shorter == 0 or longer > _CLOSEST:
        return list(zip(a, b, strict=False)), list(a[shorter:]), list(b[shorter:])
    order = sorted(
        (by_id and x.named.id != y.named.id, len(list(_differences(x, y))), x.named.id != y.named.id, i, j)
        for i, x in enumerate(a)
        for j, y in enumerate(b)
    )
    left_a, left_b = dict(enumerate(a)), dict(enumerate(b))
    pairs = [(left_a.pop(i), left_b.pop(j)) for *_, i, j in order if i in left_a and j in left_b]
    return pairs, list(left_a.values()), list(left_b.values())


# Values


def _differences(a: _End, b: _End) -> Iterator[Different]:
    """Yield each policy of which both systems know a value, and not the same one; of several parts alike, once."""
    seen: set[tuple[str, str, str]] = set()
    parts = zip(a.judged.parts, b.judged.parts, a.profiles, b.profiles, strict=False)
    for part_a, part_b, profile_a, profile_b in parts:
        for index, policy in enumerate(part_a.pack.policies):
            if policy.level != ENDPOINT or part_a.role not in policy.roles:
                continue
            told_a, told_b = _told(part_a, profile_a, index), _told(part_b, profile_b, index)
            if told_a is None or told_b is None or not told_a.values.isdisjoint(told_b.values):
                continue
            one, other = told_a.fact(), told_b.fact()
            key = (policy.name, one.value, other.value)
            if key not in seen:
                seen.add(key)
                yield Different(a.named, b.named, policy.name, one, other)


@dataclass(frozen=True, slots=True)
class _Told:
    """What a system says of a policy of one endpoint: the values it may have, and how to show them."""

    values: frozenset[Plain]
    part: Resolved
    profile: QosProfile
    index: int

    def fact(self) -> Fact:
        """The value with its origin and place."""
        return fact(self.part, self.profile, self.index)


def _told(part: Resolved, profile: QosProfile, index: int) -> _Told | None:
    """Return the value of a policy; None where it may be any."""
    if part.pack.policies[index].name == _TYPE and not is_plain(profile.values[index]):
        # The type may be stated of the topic only.
        declared = part.pack.find("topic", _TYPE)
        index = index if declared is None else declared
    values = _possible(profile.values[index])
    return None if values is None else _Told(values, part, profile, index)


def _possible(value: Value) -> frozenset[Plain] | None:
    """Return the values that one may turn out to be; None where it may be any."""
    if isinstance(value, Depends):
        cases = [_possible(case) for _, case in value.cases]
        return None if None in cases else frozenset(plain for case in cases for plain in case or ())
    return frozenset([value]) if is_plain(value) else None  # type: ignore[list-item]
