"""Endpoints by topic, and groups of equal ones on each topic."""

from __future__ import annotations

from dataclasses import field, replace
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from cqos_core.language.expression import Term
from cqos_core.language.name_index import NameIndex
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import is_plain
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from cqos_core.language.values import Value
    from cqos_core.model.system import Acceptance
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

TopicKey: TypeAlias = tuple[str, str]
"""Protocol and resolved topic."""


class GroupKey(NamedTuple):
    """A group of endpoints without names, as rules see it; the fields are those of `EndpointGroup`, ``size`` is the number of endpoints.

    ``wired``: they are copies from another protocol, whose own rules say what keeps them from existing.
    """

    profile: QosProfile
    observed: bool
    tags: frozenset[int]
    copied: bool
    size: int
    wired: bool = False


class TopicShape(NamedTuple):
    """A topic in the eyes of rules."""

    pack: RulePack
    publishers: tuple[GroupKey, ...]
    subscribers: tuple[GroupKey, ...]

    def side(self, role: str) -> tuple[GroupKey, ...]:
        """The groups of one role."""
        return self.publishers if role == PUBLISHER else self.subscribers


@dataclass(slots=True, eq=False)
class EndpointGroup:
    """Endpoints of one role and topic that are equal: same values, equally observed, equally accepted.

    Attributes:
        settled: their values where `settle` replaced some; else those of each of them hold.
        tags: indices of the acceptances that name these endpoints.
        copied: they are copies, from another protocol or another key, that match endpoints of this topic only; other
            findings about them belong to their origin.
        wired: they are copies from another protocol.
        starts_after: names that are up before them, for values that come from peers.
    """

    observed: bool
    tags: frozenset[int]
    starts_after: frozenset[str]
    copied: bool = False
    wired: bool = False
    endpoints: list[Resolved] = field(default_factory=list)
    settled: QosProfile | None = None

    @property
    def profile(self) -> QosProfile:
        """Their values."""
        return self.settled or self.endpoints[0].profile

    def value(self, index: int) -> Value:
        """Return one of their values."""
        return self.endpoints[0].value(index) if self.settled is None else self.settled.values[index]

    @property
    def key(self) -> GroupKey:
        """The group in the eyes of rules."""
        return GroupKey(self.profile, self.observed, self.tags, self.copied, len(self.endpoints), self.wired)

    def only(self, endpoints: list[Resolved]) -> EndpointGroup:
        """Return a group of some of these endpoints."""
        return replace(self, endpoints=endpoints)

    @property
    def ids(self) -> set[str]:
        """The ids of the endpoints."""
        return {endpoint.id for endpoint in self.endpoints}

    @property
    def first(self) -> Resolved:
        """The endpoint that stands for all in messages."""
        return self.endpoints[0]


@dataclass(slots=True, eq=False)
class MatchedTopic:
    """A signal: one topic of one protocol with its groups of publishers and subscribers."""

    key: str
    shown: str
    pack: RulePack
    publishers: list[EndpointGroup] = field(default_factory=list)
    subscribers: list[EndpointGroup] = field(default_factory=list)

    @property
    def endpoints(self) -> Iterable[Resolved]:
        """All endpoints, publishers first."""
        for members in (*self.publishers, *self.subscribers):
            yield from members.endpoints

    @property
    def shape(self) -> TopicShape:
        """The topic without names, as rules see it; values from peers have to be settled."""
        sides = (tuple([each.key for each in groups]) for groups in (self.publishers, self.subscribers))
        return TopicShape(self.pack, *sides)


def member_ids(groups: Iterable[EndpointGroup]) -> tuple[str, ...]:
    """Return the ids of all endpoints of ``groups``, sorted."""
    return tuple(sorted(endpoint.id for members in groups for endpoint in members.endpoints))


def naming_endpoints(acceptances: Sequence[Acceptance]) -> NameIndex[int]:
    """Return the indices of the acceptances that name endpoints, by the ids that they name."""
    return NameIndex((each.endpoint, index) for index, each in enumerate(acceptances) if each.endpoint is not None)


def group(endpoints: Sequence[Resolved], acceptances: NameIndex[int] | None = None) -> MatchedTopic:
    """Group the endpoints of one topic; the result depends on nothing but their content.

    Args:
        endpoints: of one topic of one protocol.
        acceptances: those that name endpoints (`naming_endpoints`); endpoints that differ in them are groups of their own.
    """
    ordered = sorted(endpoints, key=attrgetter("id"))
    own = [endpoint for endpoint in ordered if not endpoint.visiting]
    topic = MatchedTopic(own[0].key or "", min([endpoint.shown for endpoint in own]), own[0].pack)
    found: dict[tuple[object, ...], EndpointGroup] = {}
    # Values that come from peers follow from the order of start, so an endpoint that others start after is a group of its own.
    named = frozenset[str]()
    if any(endpoint.like.from_peers for endpoint in ordered):
        named = named.union(*(endpoint.starts_after for endpoint in ordered))
    # One of each role is a group of its own whatever its values are, which need not be made for that.
    single = len({endpoint.representative.role for endpoint in ordered}) == len(ordered)
    for endpoint in ordered:
        stated = endpoint.representative
        tags = frozenset(acceptances.matching(endpoint.id)) if acceptances else frozenset()
        starts = endpoint.starts_after
        here = named & endpoint.names if named else named
        copied, wired = endpoint.is_copy, endpoint.wire_origin is not None
        key = (stated.role, single or endpoint.profile, stated.observed, tags, starts, here, copied, wired)
        members = found.get(key)
        if members is None:
            members = found[key] = EndpointGroup(stated.observed, tags, starts, copied, wired)
            (topic.publishers if stated.role == PUBLISHER else topic.subscribers).append(members)
        members.endpoints.append(endpoint)
    return topic


def bridges_of(endpoints: Iterable[Resolved]) -> set[str | None]:
    """Return the ids of the bridges that endpoints are ends of, None among them where some are of none."""
    return {each.bridge and each.bridge[0] for each in endpoints}


def endpoints_by_topic(endpoints: Iterable[Resolved]) -> dict[tuple[str, str], list[Resolved]]:
    """Sort endpoints by protocol and topic; those without a topic are left out."""
    found: dict[tuple[str, str], list[Resolved]] = {}
    for endpoint in endpoints:
        if endpoint.key is not None:
            found.setdefault((endpoint.pack.id, endpoint.key), []).append(endpoint)
    return found


def add_visiting_copies(found: Mapping[tuple[str, str], list[Resolved]]) -> None:
    """Put copies of subscribers on the topics of publishers that they match under another key, as a filter matches names."""
    keys: dict[str, tuple[dict[str, None], dict[str, None]]] = {}
    packs: dict[str, RulePack] = {}
    for (protocol, key), endpoints in found.items():
        if endpoints[0].pack.topic_matching.match is not None:
            packs[protocol] = endpoints[0].pack
            offering, requesting = keys.setdefault(protocol, ({}, {}))
            for endpoint in endpoints:
                (offering if endpoint.role == PUBLISHER else requesting)[key] = None
    for protocol, pack in packs.items():
        match = pack.topic_matching.match
        copies: dict[str, list[Resolved]] = {}
        beside: dict[str, list[Resolved]] = {}
        for key, other in match(*keys[protocol]) if match is not None else ():
            if other not in copies:
                subscribers = (each for each in found[protocol, other] if each.role == SUBSCRIBER)
                copies[other] = [replace(each, visiting=True) for each in subscribers]
            beside.setdefault(key, []).extend(copies[other])
        for key, visitors in beside.items():
            found[protocol, key].extend(visitors)
            if pack.topic_matching.overlapping:
                _tell_overlapping(found[protocol, key], pack)


def _tell_overlapping(endpoints: list[Resolved], pack: RulePack) -> None:
    """Set the flag of subscribers whose participant has another one on the topic, with another key."""
    index = pack.vocabulary.indices[ENDPOINT, pack.topic_matching.overlapping]
    own_keys: dict[str, set[str | None]] = {}
    for endpoint in endpoints:
        if endpoint.role == SUBSCRIBER:
            own_keys.setdefault(endpoint.endpoint.participant, set()).add(endpoint.key)
    for position, endpoint in enumerate(endpoints):
        if endpoint.role == SUBSCRIBER and len(own_keys[endpoint.endpoint.participant]) > 1:
            endpoints[position] = replace(endpoint, profile=endpoint.profile.with_values({index: 1}))


def most_diverse(pack: RulePack, endpoints: Collection[Resolved]) -> int | None:
    """Return the index of the policy that must be equal to match, and that has the most values among these endpoints."""
    indices = equal_in_pairs(pack)
    return max(indices, key=lambda index: len({each.profile.values[index] for each in endpoints}), default=None)


def key_at(endpoint: Resolved, index: int | None) -> Value | None:
    """Return the known value of such a policy; None may equal any value."""
    if index is None:
        return None
    value: Value = endpoint.profile.values[index]
    return value if is_plain(value) else None


def equal_in_pairs(pack: RulePack) -> list[int]:
    """Return the policies that a matching condition requires to be equal on both sides, and nothing else, by index."""
    found = []
    for bound in pack.by_scope["meets"]:
        condition, uses = bound.bound.condition, bound.bound.uses
        if condition.name == "==" and len(uses) == 2:  # noqa: PLR2004 - sides
            one, other = uses
            both_terms = all(isinstance(each, Term) for each in condition.args)
            if both_terms and one.index == other.index and one.second != other.second:
                found.append(one.index)
    return found
