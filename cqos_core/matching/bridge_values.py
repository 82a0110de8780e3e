"""Bridges: each route is an endpoint that subscribes and one that publishes, and requirements propagate over it.

So each side of a bridge is judged by its own protocol like any endpoint. If a path violates a requirement of its last
subscriber, the finding names the hop that does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.language.policy import ENDPOINT, NEED
from cqos_core.language.values import START_ORDER, Anything, Depends, FromPeers, is_plain
from cqos_core.matching.cross_protocol_topics import topics
from cqos_core.matching.hops import Hop, PeerIndex
from cqos_core.matching.pair_guarantees import guarantees_of
from cqos_core.matching.peer_values import PUBLISHERS_FIRST, SUBSCRIBERS_FIRST, combine, lone
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.guarantee import RELAYED, RESTARTS_IN, SURVIVES, WORDS, faults_of
from cqos_core.resolving.layers import Layer, Stated

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain, Value
    from cqos_core.matching.hops import Topics
    from cqos_core.matching.routes import Link
    from cqos_core.model.system import Bridge, Role
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_core.resolving.resolver import Resolver

# Hops


def linked(links: Sequence[Link], resolver: Resolver) -> tuple[Topics, list[Hop]]:
    """Sort the resolved endpoints of an expanded system by topic, and hand needs on to where they have to be met.

    Returns:
        All endpoints by protocol and topic, and the hops over bridges.
    """
    by_id = {each.stated_id: each for each in resolver.result.endpoints} if links else {}
    hops = [
        Hop(link.bridge, by_id[link.source], by_id[link.target])
        for link in links
        if link.source in by_id and link.target in by_id
    ]
    for hop in hops:
        hop.source.bridge = hop.target.bridge = (hop.bridge.id, hop.source.id)
    by_topic = topics(resolver)
    if hops:
        peers = PeerIndex(by_topic)
        _copy_values(hops, peers)
        _mark_relayed(hops, peers)
        _hand_on(hops, peers)
    return by_topic, hops


# Values


def _copy_values(hops: Iterable[Hop], peers: PeerIndex) -> None:
    """Set the values that ends of bridges copy from either side; `settle` sets values that peers alone decide."""
    copying = _Copying(hops, peers)
    changes = [
        (copy, {index: value for index in copy.profile.from_peers if (value := copying.value(copy, index)) is not None})
        for hop in hops
        for end in (hop.source, hop.target)
        for copy in peers.copies(end)
    ]
    for copy, values in changes:
        if values:
            peers.replace(copy, copy.profile.with_values(values))


class _Copying:
    """Finds the values that ends of bridges copy, across ends that copy themselves."""

    def __init__(self, hops: Iterable[Hop], peers: PeerIndex) -> None:
        self.peers = peers
        self.met: dict[tuple[str, Role], list[Resolved]] = {}
        self.put_together: dict[tuple[QosProfile, int, tuple[QosProfile, ...], bool], Value] = {}
        self.beyond = {hop.target.id: hop.source for hop in hops} | {hop.source.id: hop.target for hop in hops}

    def value(self, end: Resolved, index: int) -> Value | None:
        """Return a value that is copied over the bridge; None for one that peers alone decide, or a participant in no file."""
        taken: Value = end.profile.values[index]
        if not isinstance(taken, FromPeers) or taken.side in {"peers", _MET[end.role]}:
            return None
        publishers, subscribers = (self.reached(end, index, role) for role in (PUBLISHER, SUBSCRIBER))
        if taken.side != "first":
            others = publishers if taken.side == "publishers" else subscribers
            return self.combined(end, index, taken, others) if others else None
        if not (publishers and subscribers):
            return self.combined(end, index, taken, publishers or subscribers)
        offered, requested = (self.combined(end, index, taken, each) for each in (publishers, subscribers))
        if offered == requested:
            return offered
        first, last = (self.reached(end, index, role, through_all=True) for role in (PUBLISHER, SUBSCRIBER))
        if _all_after(last, first):
            return offered
        if _all_after(first, last):
            return requested
        return Depends(START_ORDER, ((PUBLISHERS_FIRST, offered), (SUBSCRIBERS_FIRST, requested)))

    def reached(self, end: Resolved, index: int, role: Role, *, through_all: bool = False) -> list[Resolved]:
        """Return the endpoints of a role that are copied: the peers of an end, on its side or beyond the bridge.

        With ``through_all``, values cross ends without copied values too.
        """
        found: dict[str, Resolved] = {}
        passed: set[str] = set()
        waiting = [(end, index)]
        while waiting:
            asking, at = waiting.pop()
            near = asking if asking.role != role else self.beyond.get(asking.id)
            if near is None or asking.id in passed:
                continue
            passed.add(asking.id)
            for whose in self.near(near, role):
                own = _counterpart(asking.pack, at, whose.pack)
                if own is None:
                    continue
                value: Value = whose.profile.values[own]
                copies = through_all or (isinstance(value, FromPeers) and value.side != "peers")
                if copies and whose.id in self.beyond:
                    waiting.append((whose, own))
                else:
                    found[whose.id] = whose
        return list(found.values())

    def near(self, end: Resolved, role: Role) -> list[Resolved]:
        """Return the peers of an end with a role, each as it is in its own protocol."""
        found = self.met.get((end.id, role))
        if found is None:
            others = (pair[role == SUBSCRIBER] for pair in self.peers.pairs(end))
            found = [each.wire_origin.endpoint if each.wire_origin is not None else each for each in others]
            self.met[end.id, role] = found
        return found

    def combined(self, end: Resolved, index: int, taken: FromPeers, others: Sequence[Resolved]) -> Value:
        """Combine the values of some endpoints, in the terms of the one that copies; once for equal ones."""
        # Which of them a bridge finds is not known unless all are there before it.
        all_there = taken.peers == "any" or any(_all_after([each], others) for each in (end, self.beyond[end.id]))
        question = (end.profile, index, tuple(each.profile for each in others), all_there)
        found = self.put_together.get(question)
        if found is None:
            policy = end.pack.policies[index]
            values = []
            for each in others:
                own = _counterpart(end.pack, index, each.pack)
                if own is not None:
                    values.append(_in_terms_of(policy, each.pack.policies[own], each.profile.values[own]))
            if all_there or len(set(values)) <= 1:
                found = combine(policy, taken, values)
            else:
                found = Anything(f"the bridge takes it from the {taken.side} that it finds, which differ")
            self.put_together[question] = found
        return found


def _counterpart(pack: RulePack, index: int, other: RulePack) -> int | None:
    """The policy of a pack in the vocabulary of another: on its wire what it is there, else the one of the same name."""
    if other is pack:
        return index
    name = pack.policies[index].name
    if pack.wire is not None and pack.wire.protocol == other.id:
        name = next((wire for own, wire in pack.wire.translations() if own == name), name)
    return other.find(ENDPOINT, name)


def _in_terms_of(policy: Policy, own: Policy, value: Value) -> Value:
    """Write the value of one policy as that of another."""
    value = lone(own, value)
    if own is policy or not is_plain(value):
        return value
    try:
        return policy.domain.parse(own.format(value))
    except InvalidValueError:
        return Anything(f"{own.name} {own.format(value)} is no value of {policy.name}")


def _all_after(late: Sequence[Resolved], early: Sequence[Resolved]) -> bool:
    """Whether all of some endpoints are stated to start after all of others."""
    return bool(late and early) and all(each.is_after(other) for each in late for other in early)


_MET: Final[dict[str, str]] = {PUBLISHER: "subscribers", SUBSCRIBER: "publishers"}


# Needs


def _mark_relayed(hops: Iterable[Hop], peers: PeerIndex) -> None:
    """Say of the ends of bridges when they start again, and whether publishers tell of the loss of those before them."""
    for hop in hops:
        for end in (hop.source, hop.target):
            for copy in peers.copies(end):
                indices = copy.pack.vocabulary.indices
                if (NEED, RESTARTS_IN.name) not in indices:
                    continue
                values: dict[int, Plain] = {indices[NEED, RESTARTS_IN.name]: faults_of("intermediary_restart")}
                if end is hop.target and not hop.carries_liveliness:
                    values[indices[NEED, RELAYED.name]] = 1
                peers.replace(copy, copy.profile.with_values(values))


def _hand_on(hops: Sequence[Hop], peers: PeerIndex) -> None:
    """Propagate needs to the subscriptions before bridges; a need of one subscription concerns the bridges before it."""
    by_target = {hop.target.id: number for number, hop in enumerate(hops)}
    waiting = set(range(len(hops)))
    for _ in hops:
        changed = [hop for hop in map(hops.__getitem__, sorted(waiting)) if _handed_on(hop, peers)]
        alike = {peers.match_key(hop.source): hop.source for hop in changed}
        before = (publisher.id for source in alike.values() for publisher, _ in peers.pairs(source))
        waiting = {by_target[name] for name in before if name in by_target}


def _handed_on(hop: Hop, peers: PeerIndex) -> bool:
    """Add the needs behind a bridge to those of its subscription; return whether that changed anything."""
    wanted: dict[str, tuple[Plain, Resolved]] = {}
    faults: set[str] = set()
    for publisher, subscriber in peers.distinct(hop.target):
        faults |= {*_faults(subscriber)}
        for word, value in _needed_before(hop, publisher, subscriber):
            if word not in wanted or _more(word, value, wanted[word][0]):
                wanted[word] = (value, subscriber)
    changes = [_add_needs(copy, hop.bridge, wanted, faults, peers) for copy in peers.copies(hop.source)]
    return any(changes)


def _add_needs(
    copy: Resolved,
    bridge: Bridge,
    wanted: Mapping[str, tuple[Plain, Resolved]],
    faults: Iterable[str],
    peers: PeerIndex,
) -> bool:
    values: dict[int, Plain] = {}
    added: dict[int, Stated] = {}
    owners = set()
    for word, (value, subscriber) in wanted.items():
        index, _ = copy.pack.needs.get(word, (None, 0))
        if index is None or not _more(word, value, copy.profile.values[index]):
            continue
        values[index] = value
        owners.add(subscriber.id)
        text = copy.pack.policies[index].domain.format(value)
        place = next((each.place for name, each in subscriber.endpoint.needs.items() if name == word), None)
        added[index] = Stated(text, Setting(text, place or subscriber.endpoint.place), word)
    fault = copy.pack.vocabulary.indices.get((NEED, SURVIVES.name))
    if fault is None or not wanted:
        return False
    survives = tuple(sorted({*faults, *_faults(copy)}))
    if not values and survives == _faults(copy):
        return False
    values[fault] = survives
    peers.replace(copy, copy.profile.with_values(values))
    origin = f"needed by {', '.join(sorted(owners))} behind bridge {bridge.id}"
    if added:
        copy.layers = (Layer(origin, added), *copy.layers)
    return True


def _more(word: str, value: Plain, than: object) -> bool:
    about = WORDS[word]
    if not isinstance(value, int) or not isinstance(than, int):
        return False
    return value > than if about.kind == "holds" else about.stronger(value, than)


def _needed_before(hop: Hop, publisher: Resolved, subscriber: Resolved) -> Iterator[tuple[str, Plain]]:
    """Yield the guarantees that a bridge needs so that a subscriber behind it gets its own."""
    pack = subscriber.pack
    given = None
    for name in sorted(subscriber.profile.needs):
        word = WORDS[name]
        value = subscriber.profile.values[pack.needs[name][0]]
        if word.joined(faulty=bool(_faults(subscriber))) == "every hop":
            yield name, value
        elif name == "late_join":
            yield "latest", 1
        elif word.over == "sum" or (word.over == "not over a bridge" and hop.carries_liveliness):
            given = given or {each.word.name: each for each in guarantees_of(publisher.profile, subscriber.profile)}
            spent = given[name].value if name in given else None
            # If the last hop leaves nothing of it, it is lost there; if that is unknown, all of it is needed.
            if isinstance(value, int) and (spent is None or spent < value):
                yield name, value - (spent or 0)


def _faults(subscriber: Resolved) -> tuple[str, ...]:
    """Return the faults that a subscriber's needs must survive."""
    index = subscriber.pack.vocabulary.indices.get((NEED, SURVIVES.name))
    faults = subscriber.profile.values[index] if index is not None else ()
    return faults if isinstance(faults, tuple) else ()
