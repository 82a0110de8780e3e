"""Hops over bridges, and the peers of endpoints on either side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.matching.judge import failed_match_conditions
from cqos_core.matching.topic_groups import key_at, most_diverse
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from cqos_core.language.values import Value
    from cqos_core.model.system import Bridge
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

Topics = dict[tuple[str, str], list["Resolved"]]
_LIVELINESS: Final = "liveliness"


@dataclass(frozen=True, slots=True, eq=False)
class Hop:
    """A link between resolved endpoints."""

    bridge: Bridge
    source: Resolved
    target: Resolved

    @property
    def carries_liveliness(self) -> bool:
        """Whether it stops publishing when its source is gone."""
        return _LIVELINESS in self.bridge.carries


class PeerIndex:
    """Finds the peers of endpoints on all wires and keys; an endpoint may have copies on several.

    Equal endpoints are asked about once: a bridge often stands beside hundreds that nothing tells apart.
    """

    def __init__(self, by_topic: Topics) -> None:
        """Find every copy of every endpoint."""
        self._copies: dict[str, list[tuple[Resolved, _Beside]]] = {}
        for endpoints in by_topic.values():
            beside = _Beside(endpoints)
            for endpoint in endpoints:
                self._copies.setdefault(endpoint.id, []).append((endpoint, beside))

    def copies(self, endpoint: Resolved) -> list[Resolved]:
        """Return an endpoint with its copies."""
        return [copy for copy, _ in self._copies.get(endpoint.id, ())]

    def beside(self, copy: Resolved) -> list[Resolved]:
        """Return all endpoints on the topic that an endpoint, or this copy of it, is on."""
        return next(beside.endpoints for each, beside in self._copies[copy.id] if each is copy)

    def groups(self, endpoint: Resolved) -> Iterator[tuple[Resolved, Collection[Resolved]]]:
        """Yield an endpoint, or a copy of it, with others that it matches; all others of a group have equal values."""
        for copy, beside in self._copies.get(endpoint.id, ()):
            for group in beside.matching(copy):
                yield copy, group

    def distinct(self, endpoint: Resolved) -> Iterator[tuple[Resolved, Resolved]]:
        """Yield publisher and subscriber of one pair for each group of equal ones that an endpoint matches."""
        for copy, group in self.groups(endpoint):
            yield _in_order(copy, next(iter(group)))

    def pairs(self, endpoint: Resolved) -> Iterator[tuple[Resolved, Resolved]]:
        """Yield publisher and subscriber of every pair that an endpoint is in."""
        for copy, group in self.groups(endpoint):
            for other in group:
                yield _in_order(copy, other)

    def match_key(self, endpoint: Resolved) -> tuple[object, ...]:
        """Return a key that is equal for endpoints of one role with the same peers."""
        return tuple((id(beside), copy.profile, copy.is_copy) for copy, beside in self._copies.get(endpoint.id, ()))

    def replace(self, copy: Resolved, profile: QosProfile) -> None:
        """Give an endpoint, or this copy of it, other values."""
        beside = next(beside for each, beside in self._copies[copy.id] if each is copy)
        beside.remove(copy)
        copy.profile = profile
        beside.add(copy)


class FollowingHops:
    """Which hops follow a hop; those that match the same subscriptions share the answer."""

    def __init__(self, hops: Sequence[Hop], meeting: PeerIndex) -> None:
        """Take the hops in the order in which circles are looked for."""
        self.hops = hops
        self._meeting = meeting
        self._by_source = {hop.source.id: hop for hop in hops}
        self._shared: dict[tuple[object, ...], list[Hop]] = {}

    def __call__(self, hop: Hop) -> Iterator[Hop]:
        """Yield the hops over other bridges that take what a hop publishes."""
        alike = self._meeting.match_key(hop.target)
        found = self._shared.get(alike)
        if found is None:
            matched = (self._by_source.get(each.id) for _, each in self._meeting.pairs(hop.target))
            found = self._shared[alike] = [each for each in matched if each is not None]
        return (each for each in found if each.bridge is not hop.bridge)


def _in_order(copy: Resolved, other: Resolved) -> tuple[Resolved, Resolved]:
    return (copy, other) if copy.role == PUBLISHER else (other, copy)


class _Beside:
    """The endpoints of one topic, sorted by the policy that must be equal to match, and by their values."""

    def __init__(self, endpoints: list[Resolved]) -> None:
        self.endpoints = endpoints
        self._groups: dict[str, dict[Value | None, dict[tuple[QosProfile, bool], dict[int, Resolved]]]] | None = None
        self._index: int | None = None

    def matching(self, copy: Resolved) -> Iterator[Collection[Resolved]]:
        groups = self._sorted()[SUBSCRIBER if copy.role == PUBLISHER else PUBLISHER]
        known = self._key(copy)
        # An unknown value may equal any.
        keys = list(groups) if known is None else [key for key in (known, None) if key in groups]
        for key in keys:
            for (profile, is_copy), group in groups[key].items():
                if not group or (copy.is_copy and is_copy):
                    continue
                publisher, subscriber = (copy.profile, profile) if copy.role == PUBLISHER else (profile, copy.profile)
                if not failed_match_conditions(publisher, subscriber):
                    yield group.values()

    def remove(self, copy: Resolved) -> None:
        if self._groups is not None:
            del self._groups[copy.role][self._key(copy)][copy.profile, copy.is_copy][id(copy)]

    def add(self, copy: Resolved) -> None:
        if self._groups is not None:
            same = self._groups[copy.role].setdefault(self._key(copy), {})
            same.setdefault((copy.profile, copy.is_copy), {})[id(copy)] = copy

    def _sorted(self) -> dict[str, dict[Value | None, dict[tuple[QosProfile, bool], dict[int, Resolved]]]]:
        if self._groups is None:
            self._index = most_diverse(self.endpoints[0].pack, self.endpoints)
            self._groups = {PUBLISHER: {}, SUBSCRIBER: {}}
            for each in self.endpoints:
                self.add(each)
        return self._groups

    def _key(self, copy: Resolved) -> Value | None:
        return key_at(copy, self._index)
