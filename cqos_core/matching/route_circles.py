"""Finds circles that routes of bridges close by themselves: a name that all routes of a circle carry, and that comes back as it was.

A route carries the names between two texts, with expressions over the whole name. Which names go over several routes follows
from these alone, so that no publisher is needed.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.matching.bridge_values import linked
from cqos_core.matching.hops import FollowingHops, PeerIndex
from cqos_core.matching.routes import expanded
from cqos_core.matching.topic_groups import equal_in_pairs, key_at
from cqos_core.model.common_texts import Allowed, common_text
from cqos_core.model.system import MESSAGE, SUBSCRIBER
from cqos_core.resolving.resolver import Resolver

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.language.values import Value
    from cqos_core.matching.hops import Hop
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.system import Bridge, Endpoint, Route, System

_ASKING: Final = "/c_qos_circle"
_MOST_JOURNEYS: Final = 500
"""Beside four for each route; more come about only where routes change names again and again."""
_MOST_TIMES: Final = 2
"""How often a way may go over one route; names may have changed meanwhile."""
_Wire = tuple[str, tuple["Value | None", ...]]


class Names(NamedTuple):
    """All names that begin and end with two texts; without the second one, a single name."""

    before: str
    after: str | None

    def part(self, name: str) -> str | None:
        """Return what stands between the two texts in a name; None if the name is none of these."""
        if self.after is None:
            return "" if name == self.before else None
        least = len(self.before) + len(self.after)
        fits = len(name) >= least and name.startswith(self.before) and name.endswith(self.after)
        return name[len(self.before) : len(name) - len(self.after)] if fits else None

    def with_part(self, part: str) -> str:
        """Return the name with a text in the middle."""
        return self.before if self.after is None else f"{self.before}{part}{self.after}"

    def narrowed(self, before: str, after: str) -> Names:
        """Return the names whose middle begins and ends with two texts."""
        return self if self.after is None else Names(f"{self.before}{before}", f"{after}{self.after}")

    def __str__(self) -> str:
        return self.before if self.after is None else f"{self.before}*{self.after}"


class Circle(NamedTuple):
    """A way that leads back: its routes in order, the names that the first one carries round it, and one of them."""

    routes: tuple[tuple[Bridge, Route], ...]
    names: Names
    example: str


class _Step(NamedTuple):
    """A route on the wires that its sides are on."""

    bridge: Bridge
    route: Route
    source: Names
    target: Names
    takes_from: _Wire
    puts_on: _Wire


class _Journey(NamedTuple):
    """Names on their way: what they were at first, what they are, and what their common part has to be."""

    first: Names
    now: Names
    conditions: frozenset[Allowed] = frozenset()

    def over(self, step: _Step) -> Iterator[_Journey]:
        """Yield what a route makes of them: of all that it carries, and of single names in which two ends share characters."""
        source, now = step.source, self.now
        if now.after is None or source.after is None:
            names = [now.before if now.after is None else source.before]
        elif _one_begins(now.before, source.before) and _one_begins(now.after[::-1], source.after[::-1]):
            yield self._narrowed(step, source.after, now.after)
            before = max(now.before, source.before, key=len)
            after = max(now.after, source.after, key=len)
            names = [before + after[at:] for at in range(1, len(after) + 1) if before.endswith(after[:at])]
        else:
            return
        yield from filter(None, (self._as_one(name, step) for name in names))

    def _as_one(self, name: str, step: _Step) -> _Journey | None:
        """Return what a route makes of one name; None if it is not among these, or not carried."""
        first, conditions = self.first, self.conditions
        now, carried = self.now.part(name), step.source.part(name)
        if now is None or carried is None or not Allowed("", "", step.route.only, step.route.but)(name):
            return None
        if self.now.after is not None:
            if not all(allows(now) for allows in conditions):
                return None
            first, conditions = Names(first.with_part(now), None), frozenset()
        return _Journey(first, Names(step.target.with_part(carried), None), conditions)

    def _narrowed(self, step: _Step, source_after: str, now_after: str) -> _Journey:
        """Return what a route makes of those that begin and end as it needs."""
        source, route = step.source, step.route
        own = source.before[len(self.now.before) :], source_after[: max(len(source_after) - len(now_after), 0)]
        theirs = self.now.before[len(source.before) :], now_after[: max(len(now_after) - len(source_after), 0)]
        now = self.now.narrowed(*own)
        conditions = frozenset(
            each._replace(before=each.before + own[0], after=own[1] + each.after) for each in self.conditions
        )
        if route.only or route.but:
            conditions |= {Allowed(now.before, now.after or "", route.only, route.but)}
        return _Journey(self.first.narrowed(*own), step.target.narrowed(*theirs), conditions)

    def back(self) -> str | None:
        """Return a name that is what it was at first; None if none is."""
        first, now, conditions = self
        if now.after is None:
            part = first.part(now.before)
            return now.before if part is not None and all(allows(part) for allows in conditions) else None
        if first != now:
            return None
        part = common_text(conditions)
        return None if part is None else first.with_part(part)


def closed_circles(system: System, where: CheckContext, most: int) -> list[tuple[Circle, list[Hop]]]:
    """Return circles with the hops of one name over them, at most so many; each has a route with a pattern.

    A circle is shortest for some route on it, and each route that is on any is on one of these. Whether it is closed is asked of the
    hops, since more than names may keep it open, such as access control.
    """
    circles = [*islice(_circles(system, where), most)]
    if not circles:
        return []
    named = [(*circle.routes[0], circle.example) for circle in circles]
    whole, links = expanded(
        replace(system, endpoints=[]), where.find_pack, where.default_protocol, where.most_endpoints, named
    )
    resolver = Resolver(whole, where.find_pack, where.default_protocol, known=where.known_packs)
    resolver.run()
    by_topic, hops = linked(links, resolver)
    following = FollowingHops(hops, PeerIndex(by_topic))
    return [(circle, way) for circle in circles if (way := _hops_of(circle, hops, following))]


def _hops_of(circle: Circle, hops: Sequence[Hop], following: FollowingHops) -> list[Hop]:
    """Return the hops of a circle by which its example comes back; none: it does not."""
    bridges = [bridge.id for bridge, _ in circle.routes]
    for start in hops:
        if start.bridge.id != bridges[0] or start.source.endpoint.topic != circle.example:
            continue
        ways = {start: [start]}
        for bridge in bridges[1:]:
            ways = {
                after: [*way, after]
                for hop, way in ways.items()
                for after in following(hop)
                if after.bridge.id == bridge
            }
        for hop, way in ways.items():
            if start in following(hop):
                return way
    return []


def _circles(system: System, where: CheckContext) -> Iterator[Circle]:
    """Yield the circles that names, and what a match needs to be equal, leave open."""
    if len(system.bridges) < 2:  # noqa: PLR2004 - a bridge does not take back what it published itself
        return
    steps = _steps(system, where)
    if not any(step.source.after is not None for step in steps):
        return
    steps = _Following(steps).on_circles()
    following = _Following(steps)
    covered: set[int] = set()
    for step in steps:
        if id(step) in covered:
            continue
        way = _way_back(step, following)
        if way is None:
            continue
        passed, names, example = way
        covered.update(map(id, passed))
        if any(each.source.after is not None for each in passed):
            yield Circle(tuple((each.bridge, each.route) for each in passed), names, example)


def _steps(system: System, where: CheckContext) -> list[_Step]:
    """Return the routes of messages that stay within one protocol, each with the wires of its sides."""
    routes = [
        (bridge, route)
        for bridge in system.bridges.values()
        for route in bridge.routes
        if route.source.kind == MESSAGE
        and {route.source.participant, route.target.participant} <= system.participants.keys()
    ]
    wires = _wires(system, [each for _, route in routes for each in (route.source, route.target)], where)
    return [
        _Step(
            bridge,
            route,
            _names(route.source.topic or ""),
            _names(route.target.topic or route.source.topic or ""),
            one,
            other,
        )
        for bridge, route in routes
        if (one := wires.get(route.source.participant)) and (other := wires.get(route.target.participant))
    ]


def _names(topic: str) -> Names:
    before, star, after = topic.partition("*")
    return Names(before, after if star else None)


def _wires(system: System, sides: Sequence[Endpoint], where: CheckContext) -> Mapping[str, _Wire]:
    """Return by participant what has to be equal for a match, such as the broker."""
    asking = {
        side.participant: replace(
            side, id=f"{_ASKING}/{side.participant}", role=SUBSCRIBER, topic=_ASKING, profiles=(), settings={}
        )
        for side in sides
    }
    asked = replace(system, endpoints=[*asking.values()])
    resolved = Resolver(asked, where.find_pack, where.default_protocol, known=where.known_packs).run().endpoints
    return {
        each.endpoint.participant: (
            each.pack.id,
            tuple(key_at(each, index) for index in equal_in_pairs(each.pack)),
        )
        for each in resolved
        if each.key is not None
    }


class _Following:
    """Which routes may follow a route; those that begin alike share the answer."""

    def __init__(self, steps: Sequence[_Step]) -> None:
        self.steps = steps
        self._sources: dict[_Wire, dict[Names, list[_Step]]] = {}
        for step in steps:
            self._sources.setdefault(step.takes_from, {}).setdefault(step.source, []).append(step)
        self._shared: dict[tuple[_Wire, Names], list[list[_Step]]] = {}

    def groups(self, step: _Step) -> list[list[_Step]]:
        """Return the routes that take names that a route publishes, also its own bridge's; those of a group take the same."""
        question = (step.puts_on, step.target)
        found = self._shared.get(question)
        if found is None:
            found = self._shared[question] = [
                group
                for wire, beside in self._sources.items()
                if _may_be_one(wire, step.puts_on)
                for names, group in beside.items()
                if _overlap(names, step.target)
            ]
        return found

    def __call__(self, step: _Step) -> Iterator[_Step]:
        return (each for group in self.groups(step) for each in group if each.bridge is not step.bridge)

    def on_circles(self) -> list[_Step]:
        """Leave out, again and again, each route that none of another bridge follows."""
        group_of = {id(step): group for beside in self._sources.values() for group in beside.values() for step in group}
        bridges = {id(group): Counter(step.bridge.id for step in group) for group in group_of.values()}
        before: dict[int, list[_Step]] = {}
        for step in self.steps:
            for group in self.groups(step):
                before.setdefault(id(group), []).append(step)
        left = {id(step): step for step in self.steps}
        waiting = [*self.steps]
        while waiting:
            step = waiting.pop()
            if id(step) not in left or any(bridges[id(group)].keys() - {step.bridge.id} for group in self.groups(step)):
                continue
            del left[id(step)]
            own = id(group_of[id(step)])
            bridges[own][step.bridge.id] -= 1
            if not bridges[own][step.bridge.id]:
                del bridges[own][step.bridge.id]
                if len(bridges[own]) <= 1:  # else each of these still has one behind it
                    waiting += before.get(own, ())
        return [*left.values()]


def _way_back(start: _Step, following: _Following) -> tuple[tuple[_Step, ...], Names, str] | None:
    """Return a shortest way from a route back to itself, with the names that go round it and one of them."""
    most = _MOST_JOURNEYS + 4 * len(following.steps)
    waiting: list[tuple[tuple[_Step, ...], _Journey]] = [
        ((start,), begin) for begin in _Journey(start.source, start.source).over(start)
    ]
    seen = {(id(start), begin) for _, begin in waiting}
    for way, journey in waiting:
        for each in following(way[-1]):
            if each is start:
                for arrived in journey.over(start._replace(target=start.source)):
                    if (example := arrived.back()) is not None:
                        return way, arrived.first, example
            if way.count(each) == _MOST_TIMES:
                continue
            for further in journey.over(each):
                if (id(each), further) not in seen:
                    if len(seen) >= most:
                        return None
                    seen.add((id(each), further))
                    waiting.append(((*way, each), further))
    return None


def _may_be_one(one: _Wire, other: _Wire) -> bool:
    """Whether two wires are the same, as far as is known."""
    return one[0] == other[0] and all(a is None or b is None or a == b for a, b in zip(one[1], other[1], strict=True))


def _overlap(one: Names, other: Names) -> bool:
    """Whether some name may be among both."""
    if one.after is None or other.after is None:
        exact, wider = (one, other) if one.after is None else (other, one)
        return wider.part(exact.before) is not None
    return _one_begins(one.before, other.before) and _one_begins(one.after[::-1], other.after[::-1])


def _one_begins(one: str, other: str) -> bool:
    """Whether one text is the beginning of the other."""
    return one.startswith(other) or other.startswith(one)
