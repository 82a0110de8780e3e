"""What two systems say differently about the same topics and endpoints: a design and a snapshot, a design and a bag.

Only what both know is compared. A default is known of a designed endpoint and not of an observed one; of a value that
depends on something, it is known which values it may have. What is missing from an observed system is only missing
where it was looked for: on a topic that it mentions, among the endpoints of a role that it has.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from cqos_core.exporters.contract import ExportContext, judged
from cqos_core.findings import fact
from cqos_core.pairing import bucket, group
from cqos_core.policy import ENDPOINT, Depends, is_plain
from cqos_core.settle import settle

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.checker import Context
    from cqos_core.exporters.contract import Judged
    from cqos_core.policy import Plain, Policy, Value
    from cqos_core.report import Fact
    from cqos_core.resolve import QosProfile, Resolved
    from cqos_core.system import Place, System

_TYPE: Final = "type"
_CLOSEST: Final = 64
"""So many endpoints of one topic and role that no participant matches are matched by how little they differ."""


class Side(StrEnum):
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

    only_in: Side
    endpoint: Named


@dataclass(frozen=True, slots=True)
class Different:
    """A policy, or the type, that the two systems give different values; each with where it comes from."""

    a: Named
    b: Named
    policy: str
    value_a: Fact
    value_b: Fact


@dataclass(frozen=True, slots=True)
class Diff:
    """What was found.

    Attributes:
        missing: endpoints that one of the systems lacks.
        different: values that differ.
        matched: how many endpoints are in both.
        by_topic: how many of them were matched by topic and role only: their participants have different names.
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


@dataclass(frozen=True, slots=True)
class _End:
    """An endpoint with the values it has after settling, and where it stands."""

    judged: Judged
    profiles: tuple[QosProfile, ...]
    named: Named
    slot: tuple[str, str, str]

    @property
    def first(self) -> Resolved:
        return self.judged.parts[0]


@dataclass(slots=True)
class _Known:
    """What one system says, by protocol, topic and kind.

    Attributes:
        observed: nobody designed any of it.
        topics, kinds: which of both it speaks of, with their protocols.
    """

    side: Side
    slots: dict[tuple[str, str, str], list[_End]] = field(default_factory=dict)
    observed: bool = False
    topics: set[tuple[str, str]] = field(default_factory=set)
    kinds: set[tuple[str, str]] = field(default_factory=set)
    external: set[tuple[str, str]] = field(default_factory=set)

    def looked_for(self, slot: tuple[str, str, str]) -> bool:
        """Whether an endpoint of this slot would be here if it existed."""
        protocol, topic, kind = slot
        return not self.observed or ((protocol, topic) in self.topics and (protocol, kind) in self.kinds)


def compare(a: System, b: System, context: Context, topics: Sequence[str] = (), ignored: Sequence[str] = ()) -> Diff:
    """Compare two systems.

    Args:
        a, b: the systems.
        context: the rule packs.
        topics: shell patterns of the topics to compare; empty: all.
        ignored: shell patterns of the topics not to compare.
    """
    known_a, known_b = (_known(system, side, context, topics, ignored) for side, system in ((Side.A, a), (Side.B, b)))
    found = _Comparison(known_a, known_b)
    for slot in sorted({*known_a.slots, *known_b.slots}):
        found.slot(slot, known_a.slots.get(slot, []), known_b.slots.get(slot, []))
    return found.result()


def _known(system: System, side: Side, context: Context, topics: Sequence[str], ignored: Sequence[str]) -> _Known:
    """Sort what a system says; what no pack judges is not compared."""
    endpoints = [each for each in judged(system, ExportContext(context.find_pack, context.default_protocol)).endpoints]
    settled = _settled(part for each in endpoints for part in each.parts)
    known = _Known(side, observed=bool(endpoints) and all(each.endpoint.observed for each in endpoints))
    for each in endpoints:
        if not each.parts or each.parts[0].key is None:
            continue
        end = _end(each, settled)
        if _wanted(end.named.topic, topics, ignored):
            known.slots.setdefault(end.slot, []).append(end)
            known.topics.add(end.slot[:2])
            known.kinds.add((end.slot[0], end.slot[2]))
            if end.first.external and not each.endpoint.external:
                known.external.add(end.slot[:2])
    return known


def _wanted(topic: str, topics: Sequence[str], ignored: Sequence[str]) -> bool:
    def named(patterns: Sequence[str]) -> bool:
        return any(fnmatchcase(topic, pattern) or fnmatchcase(topic.lstrip("/"), pattern) for pattern in patterns)

    return (not topics or named(topics)) and not named(ignored)


def _settled(endpoints: Iterable[Resolved]) -> dict[int, QosProfile]:
    """Profiles by the identity of the endpoint, values from peers filled in."""
    found = {}
    for members in bucket(endpoints).values():
        topic = group(members)
        settle(topic)
        for each in (*topic.publishers, *topic.subscribers):
            found.update({id(endpoint): each.profile for endpoint in each.endpoints})
    return found


def _end(each: Judged, settled: Mapping[int, QosProfile]) -> _End:
    first, stated = each.parts[0], each.endpoint
    owner = first.participant
    address = first.pack.meeting.address(stated.participant, owner.texts)
    kind = stated.role if stated.kind == "message" else stated.kind
    topic = first.shown if each.whole is not None else stated.topic or ""
    named = Named(each.id, address, kind, topic, first.pack.id, stated.place)
    profiles = tuple(settled.get(id(part), part.profile) for part in each.parts)
    return _End(each, profiles, named, (first.pack.id, first.key or "", kind))


class _Comparison:
    """Compares slot by slot."""

    def __init__(self, a: _Known, b: _Known) -> None:
        self.a, self.b = a, b
        self.missing: list[Missing] = []
        self.different: list[Different] = []
        self.matched = 0
        self.by_topic = 0
        self.unknown: dict[tuple[Side, str], set[str]] = {}

    def slot(self, slot: tuple[str, str, str], a: list[_End], b: list[_End]) -> None:
        """Match the endpoints of one topic and role: by participant, then by how little they differ."""
        left_a, left_b = [], []
        of_b = _by_participant(b)
        for name, ends in _by_participant(a).items():
            others = of_b.pop(name, [])
            pairs, rest_a, rest_b = _closest(ends, others)
            self.pairs(pairs)
            left_a += rest_a
            left_b += rest_b
        left_b += [end for ends in of_b.values() for end in ends]
        pairs, rest_a, rest_b = _closest(left_a, left_b)
        self.by_topic += len(pairs)
        self.pairs(pairs)
        self.rest(slot, rest_a, self.a, self.b)
        self.rest(slot, rest_b, self.b, self.a)

    def pairs(self, pairs: Iterable[tuple[_End, _End]]) -> None:
        """Compare the values of endpoints that are in both systems."""
        for a, b in pairs:
            self.matched += 1
            self.different += _differences(a, b)

    def rest(self, slot: tuple[str, str, str], ends: Iterable[_End], here: _Known, there: _Known) -> None:
        """Report endpoints that are only here, where they would be there if they existed."""
        for end in ends:
            why = _why_not(slot, here, there)
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


def _why_not(slot: tuple[str, str, str], here: _Known, there: _Known) -> str | None:
    """Why it says nothing that an endpoint is only here; None where it does."""
    protocol, topic, kind = slot
    other = there.side.upper()
    if there.observed and (protocol, topic) not in there.topics:
        return f"{other} was observed and does not mention their topics"
    if there.observed and (protocol, kind) not in there.kinds:
        return f"{other} was observed and reports no {kind}s at all"
    if here.observed and not there.observed and (protocol, topic) in here.external | there.external:
        return f"their topics are external, so others than those in {other} may be there"
    return None


def _by_participant(ends: Iterable[_End]) -> dict[str, list[_End]]:
    found: dict[str, list[_End]] = {}
    for end in sorted(ends, key=lambda end: (end.named.participant, end.named.id)):
        found.setdefault(end.named.participant, []).append(end)
    return found


def _closest(a: Sequence[_End], b: Sequence[_End]) -> tuple[list[tuple[_End, _End]], list[_End], list[_End]]:
    """Match endpoints so that those that differ least come together; return the pairs and what is left of both."""
    if min(len(a), len(b)) <= 1 and max(len(a), len(b)) <= 1:
        return list(zip(a, b, strict=False)), list(a[len(b) :]), list(b[len(a) :])
    pairs = []
    left_a, left_b = list(a), list(b)
    if len(a) <= _CLOSEST and len(b) <= _CLOSEST:
        distances = sorted(
            (len(list(_differences(x, y))), x.named.id != y.named.id, i, j)
            for i, x in enumerate(a)
            for j, y in enumerate(b)
        )
        taken_a: set[int] = set()
        taken_b: set[int] = set()
        for *_, i, j in distances:
            if i not in taken_a and j not in taken_b:
                taken_a.add(i)
                taken_b.add(j)
                pairs.append((a[i], b[j]))
        left_a = [end for index, end in enumerate(a) if index not in taken_a]
        left_b = [end for index, end in enumerate(b) if index not in taken_b]
        return pairs, left_a, left_b
    count = min(len(a), len(b))
    return list(zip(a, b, strict=False)), left_a[count:], left_b[count:]


# Values


def _differences(a: _End, b: _End) -> Iterator[Different]:
    """Yield each policy of which both systems know a value, and not the same one; of several parts alike, once."""
    seen: set[tuple[str, str, str]] = set()
    for part_a, part_b, profile_a, profile_b in zip(
        a.judged.parts, b.judged.parts, a.profiles, b.profiles, strict=False
    ):
        for index, policy in enumerate(part_a.pack.policies):
            if policy.level != ENDPOINT or part_a.role not in policy.roles:
                continue
            other = part_b.pack.find(ENDPOINT, policy.name)
            if other is None:
                continue
            told_a, told_b = _told(part_a, profile_a, index), _told(part_b, profile_b, other)
            if not _disagree(policy, told_a.values, told_b.values):
                continue
            key = (policy.name, told_a.fact.value, told_b.fact.value)
            if key not in seen:
                seen.add(key)
                yield Different(a.named, b.named, policy.name, told_a.fact, told_b.fact)


@dataclass(frozen=True, slots=True)
class _Told:
    """The values that a policy may have, as text; None where it may be any; and how to show them."""

    values: frozenset[str] | None
    fact: Fact


def _told(part: Resolved, profile: QosProfile, index: int) -> _Told:
    policy = part.pack.policies[index]
    if policy.name == _TYPE and not is_plain(profile.values[index]):
        # The type may be stated of the topic only.
        declared = part.pack.find("topic", _TYPE)
        if declared is not None and part.pack.policies[declared].name == _TYPE:
            index = declared
    return _Told(_possible(part.pack.policies[index], profile.values[index]), fact(part, profile, index))


def _possible(policy: Policy, value: Value) -> frozenset[str] | None:
    if isinstance(value, Depends):
        cases = [_possible(policy, case) for _, case in value.cases]
        return None if None in cases else frozenset(text for case in cases for text in case or ())
    if not is_plain(value):
        return None
    plain: Plain = value  # type: ignore[assignment]
    return frozenset([policy.domain.format(plain)])


def _disagree(policy: Policy, a: frozenset[str] | None, b: frozenset[str] | None) -> bool:
    del policy
    return a is not None and b is not None and a.isdisjoint(b)
