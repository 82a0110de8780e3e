"""Differences between two systems, such as a design and a snapshot, or a design and a bag.

Only values that are known on both sides are compared. A default is known of a designed endpoint, not of an observed one; a value that
depends on an option has a known set of possible values. An endpoint is missing from an observed system only if the system mentions
its topic and has endpoints of its kind.
"""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from cqos_core.files.export import export_input
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import Depends, is_plain, normalise
from cqos_core.matching.peer_values import settled_profiles
from cqos_core.matching.topic_groups import endpoints_by_topic
from cqos_core.model.grouping import grouped
from cqos_core.model.system_diff import ComparedSide, Diff, Different, Missing, Named
from cqos_core.packs.export import ExportContext
from cqos_core.resolving.finding_facts import fact

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.files.export import ExportEndpoint
    from cqos_core.language.values import Plain, Value
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.system import System
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

_TYPE: Final = "type"
_CLOSEST: Final = 64
"""So many endpoints of one topic and kind are matched by how little they differ; of more it would take too long."""


_Slot: TypeAlias = tuple[str, str, str]
"""Protocol, topic in the form endpoints meet on, and kind."""


class _End(NamedTuple):
    """An endpoint with the values it has after settling."""

    judged: ExportEndpoint
    profiles: tuple[QosProfile, ...]
    named: Named
    slot: _Slot


_Pairs: TypeAlias = list[tuple[_End, _End]]


class _KnownValues(NamedTuple):
    """The endpoints and topics of one system.

    Attributes:
        slots: its endpoints.
        observed: nothing of it was designed.
        topics: that it mentions, with their protocols.
        kinds: of endpoints that it has, with their protocols.
        external: names of topics on which others than its own endpoints may be.
    """

    side: ComparedSide
    slots: Mapping[_Slot, list[_End]]
    observed: bool
    topics: set[tuple[str, str]]
    kinds: set[tuple[str, str]]
    external: set[str]


def compare(
    a: System, b: System, context: CheckContext, topics: Sequence[str] = (), ignored: Sequence[str] = ()
) -> Diff:
    """Compare two systems, ``a`` and ``b``.

    ``topics`` are shell patterns of the topics to compare, all if empty, and ``ignored`` of those not to compare.
    """
    known_a, known_b = (
        _known(system, side, context, topics, ignored) for side, system in ((ComparedSide.A, a), (ComparedSide.B, b))
    )
    designed = not (known_a.observed or known_b.observed)
    matched: _Pairs = []
    by_topic: _Pairs = []
    missing: list[Missing] = []
    unknown: dict[tuple[ComparedSide, str], set[str]] = {}
    for slot in sorted({*known_a.slots, *known_b.slots}):
        pairs, others, rest_a, rest_b = _compared(known_a.slots.get(slot, []), known_b.slots.get(slot, []), designed)
        matched += pairs + others
        by_topic += others
        for rest, here, there in ((rest_a, known_a, known_b), (rest_b, known_b, known_a)):
            for end in rest:
                why = _why_not(end, here, there)
                if why is None:
                    missing.append(Missing(here.side, end.named))
                else:
                    unknown.setdefault((here.side, why), set()).add(end.named.id)
    different = [each for pair in matched for each in _differences(*pair)]
    return Diff(
        tuple(sorted(missing, key=lambda each: (each.endpoint.topic, each.endpoint.kind, each.endpoint.id))),
        tuple(sorted(different, key=lambda each: (each.a.topic, each.a.kind, each.a.id))),
        len(matched),
        len(by_topic),
        tuple(
            f"{len(ids)} endpoint{'s' if len(ids) > 1 else ''} of {side.upper()}: {why}"
            for (side, why), ids in sorted(unknown.items())
        ),
    )


def _known(
    system: System, side: ComparedSide, context: CheckContext, topics: Sequence[str], ignored: Sequence[str]
) -> _KnownValues:
    """Sort the endpoints and topics of a system; endpoints without a pack are not compared."""
    plain = _without_variants(system, context)
    endpoints = export_input(plain, ExportContext(context.find_pack, context.default_protocol)).endpoints
    profiles: dict[int, QosProfile] = {}
    for members in endpoints_by_topic(part for each in endpoints for part in each.parts).values():
        profiles |= settled_profiles(members)
    external = {_bare(name) for name, topic in system.topics.items() if topic.external}
    slots: dict[_Slot, list[_End]] = {}
    for each in endpoints:
        if not each.parts or each.parts[0].key is None:
            continue
        end = _end(each, profiles)
        if _wanted(end.named.topic, topics, ignored):
            slots.setdefault(end.slot, []).append(end)
            if each.parts[0].external and not each.endpoint.external:
                external |= {_bare(end.slot[1]), _bare(end.named.topic)}
    observed = bool(endpoints) and all(each.endpoint.observed for each in endpoints)
    mentioned = {(protocol, topic) for protocol, topic, _ in slots}
    kinds = {(protocol, kind) for protocol, _, kind in slots}
    return _KnownValues(side, slots, observed, mentioned, kinds, external)


def _without_variants(system: System, context: CheckContext) -> System:
    """Return the system without options that choose a variant of a pack: values are compared by their meaning."""
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


def _end(each: ExportEndpoint, known: Mapping[int, QosProfile]) -> _End:
    first, stated = each.parts[0], each.endpoint
    address = first.pack.topic_matching.address(stated.participant, first.participant.texts)
    kind = stated.role if stated.kind == "message" else stated.kind
    topic = first.shown if each.whole is not None else stated.topic or ""
    named = Named(each.id, address, kind, topic, first.pack.id, stated.place)
    profiles = tuple(known.get(id(part), part.profile) for part in each.parts)
    return _End(each, profiles, named, (first.pack.id, first.key or "", kind))


def _compared(
    a: Sequence[_End],
    b: Sequence[_End],
    designed: bool,  # noqa: FBT001
) -> tuple[_Pairs, _Pairs, list[_End], list[_End]]:
    """Match the endpoints of one topic and kind within their participants, then those that are left over."""
    of_a, of_b = _by_participant(a), _by_participant(b)
    within = [_matched(of_a.get(each, []), of_b.get(each, []), by_id=designed) for each in {**of_a, **of_b}]
    left_a, left_b = [end for _, rest, _ in within for end in rest], [end for _, _, rest in within for end in rest]
    others, rest_a, rest_b = _matched(left_a, left_b, by_id=designed)
    return [pair for found, _, _ in within for pair in found], others, rest_a, rest_b


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
    ordered = sorted(ends, key=lambda end: (end.named.participant, end.named.id))
    return grouped((end.named.participant, end) for end in ordered)


def _matched(a: Sequence[_End], b: Sequence[_End], *, by_id: bool) -> tuple[_Pairs, list[_End], list[_End]]:
    """Match endpoints, those with one id or the fewest differences first; return the pairs and the rest of both sides."""
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
    """Yield each policy with known and different values in both systems; once for equal parts."""
    seen: set[tuple[str, str, str]] = set()
    parts = zip(a.judged.parts, b.judged.parts, a.profiles, b.profiles, strict=False)
    for part_a, part_b, profile_a, profile_b in parts:
        for index, policy in enumerate(part_a.pack.policies):
            if policy.level != ENDPOINT or part_a.role not in policy.roles:
                continue
            index_a, index_b = _stated(part_a, profile_a, index), _stated(part_b, profile_b, index)
            values_a, values_b = _possible(profile_a.values[index_a]), _possible(profile_b.values[index_b])
            if values_a is None or values_b is None or not values_a.isdisjoint(values_b):
                continue
            one, other = fact(part_a, profile_a, index_a), fact(part_b, profile_b, index_b)
            key = (policy.name, one.value, other.value)
            if key not in seen:
                seen.add(key)
                yield Different(a.named, b.named, policy.name, one, other)


def _stated(part: Resolved, profile: QosProfile, index: int) -> int:
    """Return where the value of a policy stands; the type may be stated of the topic only."""
    if part.pack.policies[index].name != _TYPE or is_plain(profile.values[index]):
        return index
    declared = part.pack.find("topic", _TYPE)
    return index if declared is None else declared


def _possible(value: Value) -> frozenset[Plain] | None:
    """Return the values that one may turn out to be; None where it may be any."""
    if isinstance(value, Depends):
        cases = [_possible(case) for _, case in value.cases]
        return None if None in cases else frozenset(plain for case in cases for plain in case or ())
    return frozenset([value]) if is_plain(value) else None  # type: ignore[list-item]
