"""Findings about bridges: routes without effect, loops, weaker guarantees behind a bridge, duplicates."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.paths.delivery_paths import DUPLICATE_FREE, DeliveryPaths, repetition
from cqos_core.matching.hops import FollowingHops, Hop, PeerIndex, Topics
from cqos_core.matching.pair_guarantees import PairGuarantee, guarantees_of
from cqos_core.matching.route_circles import closed_circles
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Finding, Severity, Side, plural
from cqos_core.model.grouping import grouped
from cqos_core.model.spelling import KnownNames
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, System

if TYPE_CHECKING:
    from cqos_core.matching.pipeline import Pipeline


def bridge_findings(pipeline: Pipeline) -> list[Finding]:
    """Return all findings about bridges: routes without effect, loops, and what is carried on with less than arrives."""
    system, hops, by_topic = pipeline.system, pipeline.hops, pipeline.topics
    meeting = PeerIndex(by_topic)
    return [
        *_without_effect(system, hops),
        *_loops(pipeline, meeting),
        *_weaker(hops, meeting),
        *_into_one(hops, meeting),
        *_repeated(hops, by_topic),
    ]


def _without_effect(system: System, hops: Sequence[Hop]) -> Iterator[Finding]:
    known = KnownNames(system.participants)
    used = {(hop.bridge.id, hop.source.endpoint.participant, hop.source.endpoint.place) for hop in hops}
    for bridge in system.bridges.values():
        for number, route in enumerate(bridge.routes, 1):
            unknown = [end for end in (route.source, route.target) if end.participant not in system.participants]
            for end in unknown:
                name = end.participant
                message = f"bridge `{bridge.id}` has a side in participant `{name}`, which the system does not have"
                yield core_finding("CQ501", message, place=end.place or route.place, help=suggestion(name, known))
            source = route.source
            # If the other side is external, a pattern may match nothing.
            expected = "*" in (source.topic or "") and not source.external and not unknown
            if expected and (bridge.id, source.participant, source.place) not in used:
                message = f"bridge `{bridge.id}` carries nothing by route {number}: no topic matches `{source.topic}`"
                yield core_finding("CQ502", message, place=route.place)


def _loops(pipeline: Pipeline, meeting: PeerIndex) -> list[Finding]:
    """Report circles: of routes with patterns, whatever is published; then of topics that no such circle has.

    A bridge does not take back what it published itself, so a circle needs two.
    """
    findings: list[Finding] = []
    known: set[frozenset[str]] = set()
    for found, hops in closed_circles(pipeline.stated, pipeline.where, _MOST_LOOPS + 1):
        bridges = frozenset(bridge.id for bridge, _ in found.routes)
        if bridges not in known:
            known.add(bridges)
            names = f"{found.names}"
            findings.append(_loop(hops, len(findings), names if names != found.example else "", members=False))
    for circle in _circles(FollowingHops(pipeline.hops, meeting)):
        start = min(circle, key=pipeline.hops.index)
        at = circle.index(start)
        if frozenset(hop.bridge.id for hop in circle) not in known:
            findings.append(_loop([*circle[at:], *circle[:at]], len(findings)))
    return findings[: _MOST_LOOPS + 1]


def _loop(circle: Sequence[Hop], number: int, pattern: str = "", *, members: bool = True) -> Finding:
    """Report a circle from its first hop; of a pattern the circle shows one name."""
    start = circle[0]
    named = circle[:_MOST_LISTED]
    path = "".join(f"`{hop.source.shown}` → {hop.bridge.id} → " for hop in named)
    if len(named) < len(circle):
        path += f"… {len(circle) - len(named)} more hops … → "
    what = f"`{pattern}`, such as `{start.source.shown}`," if pattern else f"`{start.source.shown}`"
    message = f"what is published on {what} comes back over bridges: {path}`{start.source.shown}`"
    if number == _MOST_LOOPS:
        message = f"there are more loops than the {_MOST_LOOPS} that are listed, for instance: {message}"
    ends = [end.id for hop in circle for end in (hop.source, hop.target)] if members else []
    return core_finding("CQ503", message, place=start.bridge.place, members=sorted(ends))


_MOST_LOOPS: Final = 25
_MOST_LISTED: Final = 25


def _circles(after: FollowingHops) -> Iterator[list[Hop]]:
    """Yield a shortest loop for each hop that leads back to an earlier one; at most one more than are listed."""
    found = 0
    covered: set[Hop] = set()
    done: set[Hop] = set()
    for first in after.hops:
        if first in done:
            continue
        done.add(first)
        way = {first: after(first)}  # hops in order, each with those that are still to be followed
        while way:
            last = next(reversed(way))
            hop = next(way[last], None)
            if hop is None:
                del way[last]
            elif hop in way:
                if last not in covered:
                    circle = _circle(last, after)
                    covered.update(circle)
                    yield circle
                    found += 1
                    if found > _MOST_LOOPS:
                        return
            elif hop not in done:
                done.add(hop)
                way[hop] = after(hop)


def _circle(start: Hop, after: FollowingHops) -> list[Hop]:
    """Return the shortest loop through a hop."""
    before: dict[Hop, Hop] = {}
    waiting = deque([start])
    while start not in before:
        hop = waiting.popleft()
        for each in after(hop):
            if each not in before:
                before[each] = hop
                waiting.append(each)
    way = [start]
    while (previous := before[way[-1]]) is not start:
        way.append(previous)
    return [start, *way[:0:-1]]


def _weaker(hops: Sequence[Hop], meeting: PeerIndex) -> Iterator[Finding]:
    """Yield notes on bridges that lose a guarantee which no subscriber behind them requires; required ones are errors elsewhere."""
    for hop in hops:
        arriving = [guarantees_of(publisher.profile, own.profile) for publisher, own in meeting.distinct(hop.source)]
        behind = [*meeting.distinct(hop.target)]
        leaving = [guarantees_of(own.profile, subscriber.profile) for own, subscriber in behind]
        if not arriving or not leaving:
            continue
        needed = {word for _, subscriber in behind for word in subscriber.profile.needs}
        lost = [
            name
            for name in ("latest", "loss_free", "late_join")
            if name not in needed
            and all(_is_given(given, name) for given in arriving)
            and all(each.nothing for given in leaving for each in given if each.word.name == name)
            and all(any(each.word.name == name for each in given) for given in leaving)
        ]
        if lost:
            message = (
                f"bridge `{hop.bridge.id}` carries `{hop.source.shown}` on as `{hop.target.shown}` with less: "
                f"{', '.join(lost)} {'is' if len(lost) == 1 else 'are'} lost behind it"
            )
            side = Side(PUBLISHER, (hop.target.id,), place=hop.target.endpoint.place)
            finding = core_finding("CQ504", message, topic=hop.target.shown)
            yield replace(finding, sides=(side, Side(SUBSCRIBER, (hop.source.id,))))


def _into_one(hops: Sequence[Hop], meeting: PeerIndex) -> Iterator[Finding]:
    """Yield warnings about several topics that end in one with fewer samples for late joiners than topics."""
    together = grouped(((hop.bridge.id, hop.target.pack.id, hop.target.key or ""), hop) for hop in hops)
    for same in together.values():
        sources = {
            publisher.key
            for hop in same
            for own, group in meeting.groups(hop.source)
            for publisher in (group if own.is_copy or next(iter(group)).is_copy else [next(iter(group))])
        }
        stored = [
            each.value
            for hop in same
            for own, subscriber in meeting.distinct(hop.target)
            for each in guarantees_of(own.profile, subscriber.profile)
            if each.word.name == "late_join" and each.value
        ]
        if stored and min(stored) < len(sources):
            first = same[0]
            message = (
                f"bridge `{first.bridge.id}` carries {len(sources)} topics into `{first.target.shown}`, and a late "
                f"subscriber gets {plural(min(stored), 'sample')} in all"
            )
            place = first.target.endpoint.place
            members = sorted(hop.target.id for hop in same)
            yield core_finding("CQ505", message, place=place, role=PUBLISHER, members=members, topic=first.target.shown)


def _repeated(hops: Sequence[Hop], by_topic: Topics) -> Iterator[Finding]:
    """Yield findings about subscribers that require `duplicate_free` and get samples over several paths."""
    everybody = {each.id: each for beside in by_topic.values() for each in beside if not each.is_copy}
    needing = {name for name, each in everybody.items() if DUPLICATE_FREE in each.profile.needs and not each.bridge}
    if not (hops and needing):
        return
    arrivals = DeliveryPaths(hops, by_topic)
    found = grouped(
        ((name, sure), (publisher, ways))
        for publisher, end in sorted(everybody.items())
        if end.role == PUBLISHER and not end.bridge
        for name, (sure, ways) in arrivals.repeats(end).items()
        if name in needing
    )
    for (name, sure), ((publisher, ways), *more) in sorted(found.items()):
        subscriber = everybody[name]
        message = repetition(publisher, "it", ways, sure=sure)
        if more:
            message += f"; so does what {len(more)} more publish{'' if len(more) > 1 else 'es'}"
        need = next((each.place for word, each in subscriber.endpoint.needs.items() if word == DUPLICATE_FREE), None)
        yield core_finding(
            "CQ507",
            f"subscriber `{name}` needs {DUPLICATE_FREE}, but {message}",
            place=need or subscriber.endpoint.place,
            role=SUBSCRIBER,
            members=[name],
            topic=subscriber.shown,
            severity=Severity.ERROR if sure else Severity.WARNING,
        )


def _is_given(given: Iterable[PairGuarantee], name: str) -> bool:
    return any(each.word.name == name and each.value is not None and not each.nothing for each in given)
