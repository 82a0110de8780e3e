"""Values that an endpoint takes from its peers when it is created (``best_available``).

The outcome depends on who starts first: publishers that start first see no subscriptions, and the other way round.
So the settled value is what both orders give, or depends on the assumption ``start order``, unless ``starts_after`` says
which order holds.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Final

from cqos_core.evaluate import MAXIMUM_WORLDS, collect_variables, in_world
from cqos_core.pairing import apart
from cqos_core.policy import INFINITE, Anything, Depends, FromPeers, Value
from cqos_core.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.pairing import Members, Topic
    from cqos_core.policy import Policy
    from cqos_core.resolved import QosProfile

START_ORDER: Final = "start order"
PUBLISHERS_FIRST: Final = "publishers first"
SUBSCRIBERS_FIRST: Final = "subscribers first"


def settle(topic: Topic) -> None:
    """Replace values taken from peers in every group of ``topic``."""
    groups = (*topic.publishers, *topic.subscribers)
    if not any(members.profile.from_peers for members in groups):
        return
    original = {members: members.profile for members in groups}
    for members in groups:
        profile = original[members]
        if not profile.from_peers:
            continue
        publisher = members.first.role == PUBLISHER
        others = topic.subscribers if publisher else topic.publishers
        peers = [o for o in others if _meet(profile, original[o], publisher=publisher)]
        changes: dict[int, Value] = {}
        for index in profile.from_peers:
            policy = profile.pack.policies[index]
            taken: FromPeers = profile.values[index]
            if taken.side == ("publishers" if publisher else "subscribers"):
                changes[index] = Anything(f"the bridge takes it from the {taken.side} on its other side")
                continue
            alone = policy.domain.parse(taken.alone)
            # What a peer that takes its value from us has when it was there first: its own lone value.
            seen = [lone(policy, original[peer].values[index]) for peer in peers]
            beside = combine(policy, taken, seen)
            agreed = taken.waits and (taken.peers == "any" or len(set(seen)) == 1)
            changes[index] = beside if agreed else _by_order(alone, beside, members, peers, publisher=publisher)
        members.profile = profile.with_values(changes)


def _meet(profile: QosProfile, other: QosProfile, *, publisher: bool) -> bool:
    return not (apart(profile, other) if publisher else apart(other, profile))


def lone(policy: Policy, value: Value) -> Value:
    """Return a value as it is without peers."""
    return policy.domain.parse(value.alone) if isinstance(value, FromPeers) else value


def _by_order(alone: Value, beside: Value, members: Members, peers: Sequence[Members], *, publisher: bool) -> Value:
    if alone == beside:
        return alone
    ours_last = _after(members, peers)
    ours_first = bool(peers) and all(_after(peer, [members]) for peer in peers)
    if ours_last:
        return beside
    if ours_first:
        return alone
    first, second = (alone, beside) if publisher else (beside, alone)
    return Depends(START_ORDER, ((PUBLISHERS_FIRST, first), (SUBSCRIBERS_FIRST, second)))


def _after(members: Members, peers: Sequence[Members]) -> bool:
    """Whether all ``peers`` are stated to be up before ``members``."""
    if not peers or not members.starts_after:
        return False
    before = set(members.starts_after)
    return all(
        endpoint.id in before or endpoint.participant.participant.id in before
        for peer in peers
        for endpoint in peer.endpoints
    )


def combine(policy: Policy, taken: FromPeers, seen: Sequence[Value]) -> Value:
    """What the peers' values amount to, each assumption they depend on taken apart."""
    variables: dict[str, tuple[str, ...]] = {}
    for value in seen:
        collect_variables(value, variables)
    worlds = 1
    for cases in variables.values():
        worlds *= len(cases)
    if worlds > MAXIMUM_WORLDS:
        return Anything("its peers depend on too many assumptions")
    if not variables:
        return _reduce(policy, taken, seen)
    name, *others = sorted(variables)
    if others:
        results = {
            _reduce(policy, taken, [in_world(v, dict(zip(variables, chosen, strict=True))) for v in seen])
            for chosen in product(*variables.values())
        }
        return results.pop() if len(results) == 1 else Anything("its peers depend on " + " and ".join((name, *others)))
    by_case = tuple(
        (case, _reduce(policy, taken, [in_world(v, {name: case}) for v in seen])) for case in variables[name]
    )
    return by_case[0][1] if len({value for _, value in by_case}) == 1 else Depends(name, by_case)


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
