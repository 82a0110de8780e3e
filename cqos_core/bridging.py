"""Bridges: each route is an endpoint that subscribes and one that publishes, and what is needed behind it is needed before.

So either side of a bridge is judged by its own protocol like any endpoint, and where a path loses what its last subscriber
needs, the hop that loses it is the one that is reported.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from cqos_core.given import give
from cqos_core.guarantee import RELAYED, SURVIVES, WORDS
from cqos_core.pairing import apart
from cqos_core.policy import NEED
from cqos_core.report import Side
from cqos_core.resolve import Layer, Stated, core_finding, suggestion
from cqos_core.system import PUBLISHER, SUBSCRIBER, Setting
from cqos_core.wire import topics

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.policy import Plain
    from cqos_core.report import Finding
    from cqos_core.resolve import Resolved, Resolver
    from cqos_core.system import Bridge, Endpoint, Route

Topics = dict[tuple[str, str], list["Resolved"]]
_LIVELINESS: Final = "liveliness"


@dataclass(frozen=True, slots=True, eq=False)
class Hop:
    """One topic carried over a bridge: the endpoint it arrives at, and the one that publishes it on."""

    bridge: Bridge
    source: Resolved
    target: Resolved

    @property
    def carries_liveliness(self) -> bool:
        """Whether it stops publishing when its source is gone."""
        return _LIVELINESS in self.bridge.carries


def spanned(resolver: Resolver) -> tuple[Topics, list[Hop]]:
    """Add the endpoints of bridges to those resolved, and hand needs on to where they have to be met.

    Returns:
        All endpoints by protocol and topic, and the hops over bridges.
    """
    hops = list(_hops(resolver))
    by_topic = topics(resolver)
    if hops:
        _mark_relayed(hops)
        _hand_on(hops, by_topic)
    return by_topic, hops


# Endpoints


def _hops(resolver: Resolver) -> Iterator[Hop]:
    for bridge in resolver.system.bridges.values():
        for number, route in enumerate(bridge.routes, 1):
            unknown = [
                end.participant
                for end in (route.source, route.target)
                if end.participant not in resolver.system.participants
            ]
            for name in unknown:
                message = f"bridge `{bridge.id}` is to have a side in participant `{name}`, which there is not"
                known = resolver.system.participants
                resolver.result.findings.append(
                    core_finding("CQ501", message, place=route.place, help=suggestion(name, known))
                )
            if unknown:
                continue
            carried = [*_carried(route, resolver)]
            if not carried:
                message = (
                    f"bridge `{bridge.id}` carries nothing by route {number}: no topic matches `{route.source.topic}`"
                )
                resolver.result.findings.append(core_finding("CQ502", message, place=route.place))
            for source_topic, target_topic in carried:
                source = resolver.add(_end(bridge, route.source, source_topic))
                target = resolver.add(_end(bridge, route.target, target_topic))
                if source is not None and target is not None:
                    yield Hop(bridge, source, target)


def _end(bridge: Bridge, side: Endpoint, topic: str) -> Endpoint:
    return replace(
        side,
        id=side.id or f"{bridge.id}/{side.role}/{topic}",
        topic=topic,
        template=f"{bridge.id}/{side.role}/{side.topic}" if side.topic != topic else None,
    )


def _carried(route: Route, resolver: Resolver) -> Iterator[tuple[str, str]]:
    """Yield the topics that a route carries, each with the name it has on the other side."""
    pattern = route.source.topic or ""
    other = route.target.topic or pattern
    if "*" not in pattern:
        yield pattern, other
        return
    matching = re.compile("(.*)".join(re.escape(part) for part in pattern.split("*", 1)))
    protocol = resolver.pack_of(route.source)
    names = {
        endpoint.key or ""
        for endpoint in resolver.result.endpoints
        if endpoint.role == PUBLISHER and endpoint.pack is protocol
    }
    for name in sorted(names):
        if found := matching.fullmatch(name):
            yield name, other.replace("*", found[1], 1)


# Needs


def _mark_relayed(hops: Iterable[Hop]) -> None:
    for hop in hops:
        index = hop.target.pack.vocabulary.indices.get((NEED, RELAYED.name))
        if index is not None and not hop.carries_liveliness:
            hop.target.profile = hop.target.profile.with_values({index: 1})


def _hand_on(hops: Sequence[Hop], by_topic: Topics) -> None:
    """Hand what is needed behind each bridge on to the subscription before it, along chains of any length."""
    for _ in hops:
        changed = [hop for hop in hops if _handed_on(hop, partners(hop.target, by_topic))]
        if not changed:
            return


def partners(endpoint: Resolved, by_topic: Topics) -> list[Resolved]:
    """Return those of the other role that an endpoint meets."""
    beside = by_topic.get((endpoint.pack.id, endpoint.key or ""), ())
    others = [each for each in beside if each.role != endpoint.role and each.carried is None]
    if endpoint.role == PUBLISHER:
        return [each for each in others if not apart(endpoint.profile, each.profile)]
    return [each for each in others if not apart(each.profile, endpoint.profile)]


def _handed_on(hop: Hop, behind: Iterable[Resolved]) -> bool:
    """Add what is needed behind a bridge to the needs of its subscription; return whether that changed anything."""
    source = hop.source
    needs = source.pack.needs
    added: dict[int, Stated] = {}
    values: dict[int, Plain] = {}
    owners = []
    for subscriber in behind:
        for word, value in _needed_before(hop, subscriber):
            index, _ = needs.get(word, (None, 0))
            if index is None or not _more(word, value, values.get(index, source.profile.values[index])):
                continue
            values[index] = value
            owners.append(subscriber.id)
            text = source.pack.policies[index].domain.format(value)
            place = next((each.place for name, each in subscriber.endpoint.needs.items() if name == word), None)
            added[index] = Stated(text, Setting(text, place or subscriber.endpoint.place), word)
    if not values:
        return False
    fault = source.pack.vocabulary.indices.get((NEED, SURVIVES.name))
    if fault is not None:
        survives = {name for each in behind for name in _faults_before(each)}
        survives |= {*source.profile.values[fault]}
        values[fault] = tuple(sorted(survives))
    source.profile = source.profile.with_values(values)
    origin = f"needed by {', '.join(sorted({*owners}))} behind bridge {hop.bridge.id}"
    source.layers = (Layer(origin, added), *source.layers)
    return True


def _more(word: str, value: Plain, than: object) -> bool:
    about = WORDS[word]
    if not isinstance(value, int) or not isinstance(than, int):
        return False
    return value > than if about.kind == "holds" else about.stronger(value, than)


def _needed_before(hop: Hop, subscriber: Resolved) -> Iterator[tuple[str, Plain]]:
    """Yield what has to be given to a bridge for a subscriber behind it to get what it needs."""
    pack = subscriber.pack
    given = None
    for name in sorted(subscriber.profile.needs):
        word = WORDS[name]
        value = subscriber.profile.values[pack.needs[name][0]]
        if word.over == "every hop":
            yield name, value
        elif name == "late_join":
            yield "latest", 1
        elif word.over == "sum" or (word.over == "not over a bridge" and hop.carries_liveliness):
            given = given or {each.word.name: each for each in give(hop.target.profile, subscriber.profile)}
            spent = given[name].value if name in given else None
            # Where the last hop leaves nothing of it, that is where it is lost.
            if isinstance(value, int) and spent is not None and spent < value:
                yield name, value - spent


def _faults_before(subscriber: Resolved) -> Iterator[str]:
    """Yield the faults that the hop before a bridge must survive: a bridge that restarts is a subscriber there."""
    index = subscriber.pack.vocabulary.indices.get((NEED, SURVIVES.name))
    faults = subscriber.profile.values[index] if index is not None else ()
    for fault in faults if isinstance(faults, tuple) else ():
        if fault == "publisher_restart":
            yield fault
        elif fault == "intermediary_restart":
            yield from (fault, "subscriber_restart")


# What bridges do to a system


def bridge_findings(hops: Sequence[Hop], by_topic: Topics) -> list[Finding]:
    """Report loops over bridges, and what is carried on with less than arrives."""
    return [*_loops(hops, by_topic), *_weaker(hops, by_topic)]


def _loops(hops: Sequence[Hop], by_topic: Topics) -> list[Finding]:
    """Report each circle once; a bridge does not take back what it published itself, so one needs two bridges."""
    by_source = {hop.source.id: hop for hop in hops}
    after = {
        hop: [
            next_
            for each in partners(hop.target, by_topic)
            if (next_ := by_source.get(each.id)) is not None and next_.bridge is not hop.bridge
        ]
        for hop in hops
    }
    findings = []
    told: set[frozenset[Hop]] = set()
    for start in hops:
        circle = _circle(start, after)
        if circle and frozenset(circle) not in told:
            told.add(frozenset(circle))
            path = "".join(f"`{hop.source.shown}` → {hop.bridge.id} → " for hop in circle)
            message = (
                f"what is published on `{start.source.shown}` comes back over bridges: {path}`{start.source.shown}`"
            )
            members = [end.id for hop in circle for end in (hop.source, hop.target)]
            findings.append(core_finding("CQ503", message, place=start.bridge.place, members=sorted(members)))
    return findings


def _circle(start: Hop, after: Mapping[Hop, Sequence[Hop]]) -> list[Hop]:
    """The shortest way from a hop back to itself."""
    ways = [[start]]
    seen = {start}
    while ways:
        longer = []
        for way in ways:
            for hop in after[way[-1]]:
                if hop is start:
                    return way
                if hop not in seen:
                    seen.add(hop)
                    longer.append([*way, hop])
        ways = longer
    return []


def _weaker(hops: Sequence[Hop], by_topic: Topics) -> list[Finding]:
    """Note where a bridge gets more than those behind it do; what they say they need is an error of its own."""
    findings = []
    for hop in hops:
        before, behind = partners(hop.source, by_topic), partners(hop.target, by_topic)
        if not before or not behind:
            continue
        arriving = [give(each.profile, hop.source.profile) for each in before]
        leaving = [give(hop.target.profile, each.profile) for each in behind]
        lost = [
            name
            for name in ("latest", "loss_free", "late_join")
            if all(_certain(given, name) for given in arriving)
            and not any(name in each.profile.needs for each in behind)
            and all(any(g.word.name == name and g.nothing for g in given) for given in leaving)
        ]
        if lost:
            message = (
                f"bridge `{hop.bridge.id}` carries `{hop.source.shown}` on as `{hop.target.shown}` with less: "
                f"{', '.join(lost)} {'is' if len(lost) == 1 else 'are'} lost behind it"
            )
            finding = core_finding("CQ504", message, topic=hop.target.shown)
            side = Side(PUBLISHER, (hop.target.id,), place=hop.target.endpoint.place)
            findings.append(replace(finding, sides=(side, Side(SUBSCRIBER, (hop.source.id,)))))
    return findings


def _certain(given: Iterable[object], name: str) -> bool:
    return any(g.word.name == name and g.value is not None and not g.nothing for g in given)  # type: ignore[attr-defined]


def paths(publisher: Resolved, subscriber: Resolved, hops: Sequence[Hop], by_topic: Topics) -> list[list[Hop]]:
    """Return the ways from a publisher to a subscriber over bridges, each without circles, shortest first."""
    by_source = {hop.source.id: hop for hop in hops}
    found = []
    ways: list[list[Hop]] = [[]]
    while ways:
        longer = []
        for way in ways:
            end = way[-1].target if way else publisher
            for each in partners(end, by_topic):
                if each.id == subscriber.id and way:
                    found.append(way)
                hop = by_source.get(each.id)
                if hop is not None and hop not in way:
                    longer.append([*way, hop])
        ways = longer
    return found
