"""Values that an endpoint takes from its peers when it is created (``best_available``).

The outcome depends on the peers that have started by then. ``starts_after`` states that of some peers; for the others the settled
value is the same in every order, or depends on the assumption ``start order``.
"""

from __future__ import annotations

from itertools import chain, product
from math import prod
from operator import itemgetter
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.language.relation import positions
from cqos_core.language.values import (
    INFINITE,
    MAXIMUM_WORLDS,
    START_ORDER,
    Anything,
    Depends,
    FromPeers,
    Value,
    collect_variables,
    in_world,
    is_plain,
)
from cqos_core.matching.strongest_owner import settle_strongest
from cqos_core.matching.topic_groups import group
from cqos_core.matching.topic_outcomes import met
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

PUBLISHERS_FIRST: Final = "publishers first"
SUBSCRIBERS_FIRST: Final = "subscribers first"
_DEEPEST: Final = 50
"""The longest chain of values that follow from each other."""
_OTHER_ORDERS: Final = 8
"""The most further outcomes of an open order that are distinguished; beyond, the value is not known."""


def settled_profiles(endpoints: Sequence[Resolved]) -> dict[int, QosProfile]:
    """Return the values of the endpoints of one topic, those that follow from others too, by the identity of the endpoint."""
    topic = group(endpoints)
    settle(topic)
    settle_strongest(topic)
    groups = (*topic.publishers, *topic.subscribers)
    return {id(endpoint): members.profile for members in groups for endpoint in members.endpoints}


def settle(topic: MatchedTopic) -> None:
    """Replace values taken from peers in every group of ``topic``."""
    settling = _Settling(topic)
    # Endpoints that are stated to start before others come first, which keeps the recursion flat.
    ordered = sorted((*topic.publishers, *topic.subscribers), key=lambda each: len(each.starts_after))
    changes = [(each, {at: settling.value(each, at) for at in each.profile.from_peers}) for each in ordered]
    for members, values in changes:
        if values:
            members.settled = members.profile.with_values(values)


class _TakenValue(NamedTuple):
    """The way in which a group takes a value, and the values of peers that are stated to start before it."""

    taken: FromPeers
    known: tuple[Value, ...]


class _Settling:
    """The values of one topic while they are settled."""

    def __init__(self, topic: MatchedTopic) -> None:
        self._topic = topic
        self._known: dict[tuple[EndpointGroup, int], Value] = {}
        self._relations: dict[EndpointGroup, tuple[list[EndpointGroup], list[EndpointGroup]]] = {}
        self._possible: dict[int, frozenset[Value]] = {}
        self._matching = _matching(topic)
        self._unordered = not any(each.starts_after for each in (*topic.publishers, *topic.subscribers))
        self._alike: dict[tuple[object, ...], Value] = {}
        self._depth = 0

    def value(self, members: EndpointGroup, index: int) -> Value:
        """Return the value that a policy of a group has, once it is created."""
        value: Value = members.profile.values[index]
        if not isinstance(value, FromPeers):
            return value
        key = members, index
        if key not in self._known:
            if self._depth >= _DEEPEST:
                return Anything(f"it follows from the values of more than {_DEEPEST} others in turn")
            self._depth += 1
            self._known[key] = Anything("the order of start goes in a circle")
            # Where no order is stated, all that see the same peers take the same value from them.
            alike = (members.first.role, id(self._matching[members]), index, value) if self._unordered else key
            if alike not in self._alike:
                self._alike[alike] = self._settled(members, index, value)
            self._known[key] = self._alike[alike]
            self._depth -= 1
        return self._known[key]

    def _settled(self, members: EndpointGroup, index: int, taken: FromPeers) -> Value:
        publisher = members.first.role == PUBLISHER
        if taken.side == ("publishers" if publisher else "subscribers"):
            return Anything(f"the bridge takes it from the {taken.side} on its other side")
        policy = members.profile.pack.policies[index]
        before, opened = self._peers(members)
        known = [*dict.fromkeys(self.value(each, index) for each in before)]
        ways = dict.fromkeys(self._way(each, index) for each in opened)
        # A peer that takes its value from us and starts first has its value without us.
        others = [*dict.fromkeys(combine(policy, *way) if isinstance(way, _TakenValue) else way for way in ways)]
        last = combine(policy, taken, [*dict.fromkeys((*known, *others))])
        if taken.waits and (taken.peers == "any" or len({*known, *others}) == 1):
            return last
        first = combine(policy, taken, known)
        # Values that a peer may take from others that start before it.
        elsewhere = (
            combine(policy, way.taken, [*way.known, value])
            for way in ways
            if isinstance(way, _TakenValue)
            for value in self._on_topic(index)
        )
        between = {combine(policy, taken, [*known, each]) for each in chain(others, elsewhere)} - {first, last}
        if first == last and not between:
            return first
        ordered: tuple[tuple[str, Value], ...] = (
            (PUBLISHERS_FIRST, first if publisher else last),
            (SUBSCRIBERS_FIRST, last if publisher else first),
        )
        if any(isinstance(each, Depends) and each.on == START_ORDER for each in known):
            # The first of the others may differ between us and those whose value depends on it.
            ordered, between = (), {case for each in (*between, first, last) for case in _in_any_order(each)}
        if len(between) > _OTHER_ORDERS:
            return Anything("it depends on the order of start in too many ways")
        if not ordered and len(between) == 1:
            return between.pop()
        named = {f"another order that gives {policy.format(each)}": each for each in between}
        return Depends(START_ORDER, (*ordered, *sorted(named.items(), key=itemgetter(0))))

    def _way(self, peer: EndpointGroup, index: int) -> Value | _TakenValue:
        """The value of a peer, or the way in which it takes it."""
        taken: Value = peer.profile.values[index]
        if not isinstance(taken, FromPeers):
            return taken
        return _TakenValue(taken, tuple(dict.fromkeys(self.value(each, index) for each in self._peers(peer)[0])))

    def _peers(self, members: EndpointGroup) -> tuple[list[EndpointGroup], list[EndpointGroup]]:
        """The peers of a group that are stated to be there before it, and those whose order is open."""
        if members not in self._relations:
            before, opened = [], []
            for peer in self._matching[members]:
                if _before(peer, members, any):
                    before.append(peer)
                elif not _before(members, peer, all):
                    opened.append(peer)
            self._relations[members] = before, opened
        return self._relations[members]

    def _on_topic(self, index: int) -> frozenset[Value]:
        """The values that any endpoint of the topic may have, of those that are known."""
        if index not in self._possible:
            policy = self._topic.pack.policies[index]
            stated = {each.profile.values[index] for each in (*self._topic.publishers, *self._topic.subscribers)}
            taking = {value for value in stated if isinstance(value, FromPeers)}
            plain = {lone(policy, value) for value in stated if is_plain(lone(policy, value))}
            self._possible[index] = frozenset(
                {*plain, *(_reduce(policy, each, [value]) for each in taking for value in plain)}
            )
        return self._possible[index]


def _in_any_order(value: Value) -> Iterator[Value]:
    """Yield the values for each order of start."""
    if isinstance(value, Depends) and value.on == START_ORDER:
        for _, case in value.cases:
            yield from _in_any_order(case)
    else:
        yield value


def _before(early: EndpointGroup, late: EndpointGroup, which: Callable[[Iterable[bool]], bool]) -> bool:
    """Whether ``any`` or ``all`` of a group are stated to be up before another one."""
    return bool(late.starts_after) and which(late.first.is_after(endpoint) for endpoint in early.endpoints)


def _matching(topic: MatchedTopic) -> dict[EndpointGroup, list[EndpointGroup]]:
    """By group the groups of the other side that it matches; equal lists are one."""
    there = met(topic.pack, (each.profile for each in topic.publishers), (each.profile for each in topic.subscribers))
    alike: dict[int, int] = {}
    for at, mask in enumerate(there):
        alike[mask] = alike.get(mask, 0) | 1 << at
    back = [0] * len(topic.subscribers)
    for mask, publishers in alike.items():
        for at in positions(mask):
            back[at] |= publishers
    found: dict[EndpointGroup, list[EndpointGroup]] = {}
    for own, others, masks in (
        (topic.publishers, topic.subscribers, there),
        (topic.subscribers, topic.publishers, back),
    ):
        lists = {mask: [others[at] for at in positions(mask)] for mask in {*masks}}
        found.update((each, lists[mask]) for each, mask in zip(own, masks, strict=True))
    return found


def lone(policy: Policy, value: Value) -> Value:
    """Return a value as it is without peers."""
    return policy.domain.parse(value.alone) if isinstance(value, FromPeers) else value


def combine(policy: Policy, taken: FromPeers, seen: Sequence[Value]) -> Value:
    """Return the combination of the peers' values, under each assumption that they depend on."""
    variables: dict[str, tuple[str, ...]] = {}
    for value in seen:
        collect_variables(value, variables)
    if prod(map(len, variables.values())) > MAXIMUM_WORLDS:
        return Anything("its peers depend on too many assumptions")
    by_world = {
        chosen: _reduce(policy, taken, [in_world(v, dict(zip(variables, chosen, strict=True))) for v in seen])
        for chosen in product(*variables.values())
    }
    if len({*by_world.values()}) == 1:
        return next(iter(by_world.values()))
    if len(variables) == 1:
        return Depends(next(iter(variables)), tuple((case, value) for (case,), value in by_world.items()))
    return Anything("its peers depend on " + " and ".join(sorted(variables)))


def _reduce(policy: Policy, taken: FromPeers, seen: Sequence[Value]) -> Value:
    """Put plain peer values together in the way the policy declares."""
    alone = policy.domain.parse(taken.alone)
    if taken.peers == "constant" or not seen:
        return alone
    if not all(isinstance(value, int) for value in seen):
        return Anything("its peers are not known")
    values = [value for value in seen if isinstance(value, int)]
    if taken.peers == "any":
        return values[0] if len(set(values)) == 1 else Anything("it is that of whichever is found first")
    strongest, weakest = policy.domain.highest, policy.domain.lowest
    match taken.peers:
        case "strongest_if_all":
            return strongest if all(value == strongest for value in values) else weakest
        case "strongest_if_any":
            return strongest if any(value == strongest for value in values) else weakest
        case "largest":
            return max(values)
        case "largest_stated":
            return max((value for value in values if value < INFINITE), default=INFINITE)
        case "smallest_stated":
            return min((value for value in values if value < INFINITE), default=INFINITE)
    return Anything(f"it is taken from peers in a way that is not known ({taken.peers})")
