"""Finds a pair by two names: ids of endpoints, or names of participants with only one pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.problems import CqosError
from cqos_core.model.spelling import nearest
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved

_PAIRS: Final = 5
"""Pairs that a message lists if names fit several."""


def pair_named(ids: Sequence[str], endpoints: Sequence[Resolved]) -> tuple[Resolved, Resolved] | list[CqosError]:
    """Return the publisher and the subscriber of two names, in either order; or the reasons why there is no such pair."""
    by_id = {endpoint.id: endpoint for endpoint in endpoints}
    roles = [by_id[name].role if name in by_id else None for name in ids]
    if {*roles} == {PUBLISHER, SUBSCRIBER}:
        publisher, subscriber = sorted((by_id[name] for name in ids), key=lambda each: each.role)
        return publisher, subscriber
    sides = [_of_name(name, by_id, endpoints) for name in ids]
    if None in roles and all(sides):
        return _only_pair(ids, sides[0], sides[1])
    if None not in roles:
        return [CqosError(f"both are {roles[0]}s", "a pair is a publisher and a subscriber")]
    unknown = [name for name, side in zip(ids, sides, strict=True) if not side]
    known = sorted(by_id)
    meant = {name: nearest(name, known) for name in unknown}
    return [
        CqosError(f"there is no endpoint `{name}`", f"did you mean `{meant[name]}`?" if meant[name] else "")
        for name in unknown
    ]


def _of_name(name: str, by_id: Mapping[str, Resolved], endpoints: Sequence[Resolved]) -> list[Resolved]:
    """The endpoints that ``name`` may mean: the one of that id, or those of the participant of that name."""
    if name in by_id:
        return [by_id[name]]
    whole = [each for each in endpoints if each.endpoint.participant == name]
    return whole or [each for each in endpoints if each.endpoint.participant.rpartition("/")[2] == name]


def _only_pair(
    ids: Sequence[str], one: Sequence[Resolved], other: Sequence[Resolved]
) -> tuple[Resolved, Resolved] | list[CqosError]:
    """Return the only pair among endpoints of two participants; or the reason why there is none or several."""
    both = (*one, *other)
    packs = {each.pack.id: each.pack for each in both}.values()
    topics = {keys for pack in packs for keys in _matches(pack, both)}
    pairs = [
        (publisher, subscriber)
        for side, opposite in ((one, other), (other, one))
        for publisher in side
        for subscriber in opposite
        if (publisher.role, subscriber.role) == (PUBLISHER, SUBSCRIBER)
        and publisher.pack is subscriber.pack
        and (publisher.key == subscriber.key or (publisher.key, subscriber.key) in topics)
    ]
    if len(pairs) == 1:
        return pairs[0]
    if not pairs:
        return [CqosError(f"no publisher matches a subscriber between `{ids[0]}` and `{ids[1]}`")]
    listed = "; ".join(f"{publisher.id} {subscriber.id}" for publisher, subscriber in pairs[:_PAIRS])
    more = f"; and {len(pairs) - _PAIRS} more" if len(pairs) > _PAIRS else ""
    message = f"{len(pairs)} pairs are between `{ids[0]}` and `{ids[1]}`"
    return [CqosError(message, f"name one of them: {listed}{more}")]


def _matches(pack: RulePack, endpoints: Sequence[Resolved]) -> Iterable[tuple[str, str]]:
    """Pairs of different keys that match, in protocols whose subscribers have filters."""
    if pack.topic_matching.match is None:
        return ()
    keys = {
        role: {each.key for each in endpoints if each.pack is pack and each.role == role and each.key is not None}
        for role in (PUBLISHER, SUBSCRIBER)
    }
    return pack.topic_matching.match(sorted(keys[PUBLISHER]), keys[SUBSCRIBER])
