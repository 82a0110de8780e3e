"""Routes of bridges as endpoints: one that receives and one that sends for every topic that is carried.

A pattern carries the topics that are published before it. Another bridge before it publishes topics too, so patterns are
followed again until nothing new is carried. Bridges that make names
longer and take them back would never come to an end: such a name is not followed, and the circle is reported. How many
endpoints bridges may make is bounded.
"""

from __future__ import annotations

from dataclasses import field, replace
from itertools import chain
from typing import TYPE_CHECKING, Final

from cqos_core.matching.judge import failed_match_conditions
from cqos_core.matching.topic_groups import key_at, most_diverse
from cqos_core.model.codes import CODES
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.re2_patterns import any_name_matcher
from cqos_core.model.system import MESSAGE, PUBLISHER, SUBSCRIBER, ImportNote, endpoint_id
from cqos_core.resolving.resolver import Resolver

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cqos_core.language.values import Value
    from cqos_core.model.system import Bridge, Endpoint, Role, Route, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved

_WITHIN: Final = "/c_qos_within"
"""The topic of endpoints by which the sides of bridges are compared with others."""
_MOST_NAMED: Final = 10


@dataclass(frozen=True, slots=True)
class Link:
    """One topic carried over a bridge, by the ids of the endpoints it arrives at and is published by."""

    bridge: Bridge
    source: str
    target: str


def expanded(
    system: System,
    find_pack: Callable[[str], RulePack | None],
    default: str | None,
    most: int,
    named: Sequence[tuple[Bridge, Route, str]] = (),
) -> tuple[System, list[Link]]:
    """Return a system with the endpoints of its bridges, and their links; without bridges the system itself.

    Args:
        system: as it was read.
        find_pack: rule packs by id.
        default: protocol of participants that state none.
        most: endpoints that there may be afterwards; bridges of a larger system may add none.
        named: names that routes carry, whoever is there.

    Raises:
        PatternError: a route names topics by an expression that cannot be read.
        InputError: bridges add more endpoints than are allowed.
    """
    if not system.bridges:
        return system, []
    growing = _GrowingSystem(replace(system, endpoints=list(system.endpoints)), most)
    patterns: list[tuple[Bridge, Route]] = []
    for bridge in system.bridges.values():
        for route in bridge.routes:
            if not {route.source.participant, route.target.participant} <= system.participants.keys():
                continue
            if "*" in (route.source.topic or ""):
                patterns.append((bridge, route))
            else:
                topic = route.source.topic or ""
                growing.add(bridge, route, topic, route.target.topic or topic)
    for bridge, route, name in named:
        growing.add(bridge, route, name, _through(route, name))
    if not patterns:
        return growing.whole, growing.links
    patterns.sort(key=lambda each: each[0].id)
    around = _EndpointIndex(growing, patterns, find_pack, default)
    news = around.look()
    for (bridge, route), (other, back) in around.growing_pairs(patterns):
        growing.turn_back(bridge, route, other, back)
    for _ in range(len(patterns) + 1):
        carried = [(bridge, route, *names) for bridge, route in news for names in around.carried(bridge, route)]
        if not any([growing.add(*each) for each in carried]):  # noqa: C419 - each of them is added
            break
        growing.turned_back |= growing.turning
        news = around.look()
    left_out = [said for each in patterns for said in around.left_out(*each)]
    return replace(growing.whole, notes=[*system.notes, *left_out, *growing.notes]), growing.links


@dataclass(frozen=True, slots=True, eq=False)
class _NameOrigin:
    """The origin of a name: a route, the names on both sides, and the origin of the first name."""

    bridge: Bridge
    route: Route
    topic: str
    other: str
    previous: _NameOrigin | None

    def before(self) -> Iterator[_NameOrigin]:
        """Yield the earlier origins, the last first."""
        way = self.previous
        while way is not None:
            yield way
            way = way.previous


def _longer_names(circle: Sequence[_NameOrigin]) -> ImportNote:
    path = " → ".join(
        [f"`{circle[0].topic}`", *(f"{each.bridge.id} → `{each.other}`" for each in circle[:_MOST_NAMED])]
    )
    first = circle[0].bridge.id
    message = f"bridge `{first}` gets back under a longer name what it carries, so that names grow without end: {path}"
    return ImportNote("CQ508", "warning", message, circle[0].route.place, CODES["CQ508"].help)


@dataclass(slots=True)
class _GrowingSystem:
    """A system to which endpoints of bridges are added.

    Attributes:
        most: endpoints that there may be.
        own: the bridge of each endpoint that was added, or stated and is a side.
        carried: what is carried: the participants of both sides, the kind, and the name before the bridge.
        came: by the id of such an endpoint, how its name came about.
        turning: routes by which names come back longer than they were; what `turned_back` had in the round before.
        notes: findings about them.
    """

    whole: System
    most: int
    links: list[Link] = field(default_factory=list)
    own: dict[str, str] = field(default_factory=dict)
    carried: set[tuple[str, str, str, str]] = field(default_factory=set)
    came: dict[str, _NameOrigin] = field(default_factory=dict)
    turning: set[int] = field(default_factory=set)
    turned_back: set[int] = field(default_factory=set)
    notes: list[ImportNote] = field(default_factory=list)
    taken: set[str] = field(init=False)
    stated: dict[tuple[str, Role, str, str | None], Endpoint] = field(init=False)
    done: set[tuple[int, str, str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.taken = {endpoint.id for endpoint in self.whole.endpoints}
        sides = {side.participant for each in self.whole.bridges.values() for of in each.routes for side in _sides(of)}
        self.stated = {
            (each.participant, each.role, each.kind, each.topic): each
            for each in reversed(self.whole.endpoints)
            if each.participant in sides
        }

    def add(self, bridge: Bridge, route: Route, topic: str, other: str, origin: str = "") -> bool:
        """Add the endpoints of one topic, which came about by an endpoint of the id ``origin``; return whether they are new.

        Raises:
            InputError: there are too many already.
        """
        question = (id(route), topic, other)
        if question in self.done:
            return False
        self.done.add(question)
        way = _NameOrigin(bridge, route, topic, other, self.came.get(origin))
        if self._turns_back(way):
            return False
        if len(self.whole.endpoints) + 2 > self.most:
            raise self._too_many(bridge, route)
        _, (behind, *_) = _ends(route)
        ends = [
            self._end(bridge, side, name, unasked=side is behind)
            for side, name in ((route.source, topic), (route.target, other))
        ]
        self.came.update(dict.fromkeys(ends, way))
        self.carried.add((*_between(route), topic))
        if route.source.kind == MESSAGE:  # a call goes both ways, so that nothing is needed before it or behind it
            self.links.append(Link(bridge, *ends))
        return True

    def _turns_back(self, way: _NameOrigin) -> bool:
        """Whether a name comes back longer to a route that made it; the circle is noted once.

        Routes on such circles carry on nothing that others of them made: else n of them would make n! names.
        """
        before = [*way.before()]
        circle = next((at for at, each in enumerate(before) if each.route is way.route), None)
        if circle is not None and len(way.other) > len(before[circle].other):
            if id(way.route) not in self.turning:
                self.turning.update(id(each.route) for each in before[: circle + 1])
                self.notes.append(_longer_names([*before[: circle + 1][::-1], way]))
            return True
        return id(way.route) in self.turned_back and any(id(each.route) in self.turned_back for each in before)

    def turn_back(self, bridge: Bridge, route: Route, other: Bridge, back: Route) -> None:
        """Note two routes that make any name longer and longer."""
        if not self.turned_back & {id(route), id(back)}:
            self.notes.append(
                _longer_names(
                    [
                        _NameOrigin(each, of, "*", of.target.topic or "", None)
                        for each, of in ((bridge, route), (other, back), (bridge, route))
                    ]
                )
            )
        self.turned_back |= {id(route), id(back)}

    def _too_many(self, bridge: Bridge, route: Route) -> InputError:
        message = (
            f"bridges carry more topics than the limit of {self.most} endpoints in a system allows; "
            f"it is reached at a route of bridge `{bridge.id}`, with {len(self.own)} endpoints of bridges"
        )
        return InputError([Problem("CQ029", message, route.place, CODES["CQ029"].help)])

    def _end(self, bridge: Bridge, side: Endpoint, topic: str, *, unasked: bool) -> str:
        patterned = "*" in (side.topic or "")
        stated = self.stated.get((side.participant, side.role, side.kind, topic)) if _states_nothing(side) else None
        if stated is not None:
            if not patterned and not side.external and stated.id not in self.own:
                self.own[stated.id] = bridge.id
                return stated.id
            # A pattern and each further route has an end of its own, with what the participant states.
            side = replace(stated, id="", topic=side.topic, external=side.external, place=side.place)
        does = side.role if side.kind == MESSAGE else side.kind
        wanted = f"{side.id}/{topic}" if side.id and patterned else side.id or endpoint_id(bridge.id, does, topic)
        identifier, number = wanted, 2
        while identifier in self.taken:
            identifier, number = f"{wanted}#{number}", number + 1
        self.taken.add(identifier)
        self.own[identifier] = bridge.id
        template = endpoint_id(bridge.id, does, side.topic or "") if patterned else None
        # A pattern brings all topics, so one without a subscriber behind the bridge is no finding.
        external = side.external or (patterned and unasked)
        self.whole.endpoints.append(replace(side, id=identifier, topic=topic, template=template, external=external))
        return identifier


def _sides(route: Route) -> tuple[Endpoint, Endpoint]:
    return route.source, route.target


def _between(route: Route) -> tuple[str, str, str]:
    """Return what two routes have in common that carry the same names: the participants of their sides, and the kind."""
    return route.source.participant, route.target.participant, route.source.kind


def _states_nothing(side: Endpoint) -> bool:
    """Return whether a side of a route states nothing but who it is, so that an endpoint of its participant may be meant."""
    return not (side.id or side.settings or side.profiles or side.overlay or side.needs or side.type)


_Filed = dict["Value | None", list["Resolved"]]


class _EndpointIndex:
    """The endpoints at one moment, and those that the sides of bridges can match.

    Endpoints and sides are filed by a value that must be equal to match, such as the domain, so that a side is compared only
    with endpoints that it may match.
    """

    def __init__(
        self,
        growing: _GrowingSystem,
        patterns: Sequence[tuple[Bridge, Route]],
        find_pack: Callable[[str], RulePack | None],
        default: str | None,
    ) -> None:
        """Put an endpoint of either role where the sides of bridges are; `look` has to be called before all else."""
        self.growing = growing
        self.patterns = patterns
        self.find_pack = find_pack
        self.default = default
        self.asking = {
            (bridge.id, side.participant, role): replace(
                side, id=f"{_WITHIN}/{number}/{role}", role=role, topic=_WITHIN, kind=MESSAGE, profiles=(), settings={}
            )
            for number, (bridge, side) in enumerate(
                (bridge, side) for bridge, route in patterns for side in (route.source, route.target)
            )
            for role in (PUBLISHER, SUBSCRIBER)
        }
        self.resolver: Resolver | None = None
        self.within: dict[tuple[str, str, Role], Resolved] = {}
        self.stated: dict[str, Endpoint] = {}
        self.there: dict[tuple[RulePack, Role, str], _Filed] = {}
        self.shown: dict[str | None, str] = {}
        self.seen = 0
        self.known: dict[tuple[int, Role], _SideView] = {}
        self.index: dict[RulePack, int | None] = {}
        self.sides: dict[tuple[RulePack, Value | None], list[int]] = {}

    def look(self) -> list[tuple[Bridge, Route]]:
        """Resolve endpoints that were added since the last look; services and actions also as one topic, for their names.

        Returns:
            The routes that may carry something new.
        """
        before = self.resolver
        if self.resolver is None or self.resolver.completed:  # what follows from a whole system may follow anew
            self.seen = 0
            self.stated.clear()
            self.there.clear()
            self.known.clear()
            system = replace(self.growing.whole, endpoints=[*self._new(), *self.asking.values()])
            self.resolver = Resolver(system, self.find_pack, self.default)
            resolved = self.resolver.run().endpoints
            by_id = {each.stated_id: each for each in resolved}
            self.within = {key: by_id[each.id] for key, each in self.asking.items() if each.id in by_id}
            self._file_sides()
        else:
            known = len(self.resolver.result.endpoints)
            for endpoint in self._new():
                self.resolver.stated(endpoint)
            resolved = self.resolver.result.endpoints[known:]
        come: set[tuple[RulePack, Value | None]] = set()
        for each in resolved:
            of = self.stated.get(each.stated_id.removeprefix(f"{_WITHIN}/"))
            # Of a service or an action only the one that stands for the whole.
            if of is not None and (of.kind == MESSAGE or each.stated_id != of.id):
                key = self._key(each)
                self.there.setdefault((each.pack, each.endpoint.role, of.kind), {}).setdefault(key, []).append(each)
                self.shown[each.key] = each.shown
                come.add((each.pack, key))
        if self.resolver is not before or any(key is None for _, key in come):
            return [*self.patterns]
        numbers = {number for pack, key in come for each in {key, None} for number in self.sides.get((pack, each), ())}
        return [self.patterns[number] for number in sorted(numbers)]

    def _file_sides(self) -> None:
        """File the routes by the values that decide what either side of them may match."""
        packs: dict[RulePack, list[Resolved]] = {}
        for each in self.within.values():
            packs.setdefault(each.pack, []).append(each)
        self.index = {pack: most_diverse(pack, there) for pack, there in packs.items()}
        self.sides.clear()
        for number, (bridge, route) in enumerate(self.patterns):
            for side in (route.source, route.target):
                asking = self.within.get((bridge.id, side.participant, PUBLISHER))
                if asking is not None:
                    self.sides.setdefault((asking.pack, self._key(asking)), []).append(number)

    def _key(self, endpoint: Resolved) -> Value | None:
        return key_at(endpoint, self.index.get(endpoint.pack))

    def _new(self) -> list[Endpoint]:
        new = self.growing.whole.endpoints[self.seen :]
        self.seen += len(new)
        self.stated.update((endpoint.id, endpoint) for endpoint in new)
        named = [
            replace(each, id=f"{_WITHIN}/{each.id}", kind=MESSAGE, type=None) for each in new if each.kind != MESSAGE
        ]
        return [*new, *named]

    def growing_pairs(
        self, patterns: Sequence[tuple[Bridge, Route]]
    ) -> Iterator[tuple[tuple[Bridge, Route], tuple[Bridge, Route]]]:
        """Yield pairs of routes that carry each other's publications under longer and longer names."""
        whole = [each for each in patterns if each[1].source.kind == MESSAGE and not (each[1].only or each[1].but)]
        if max((_longer(route) for _, route in whole), default=0) <= 0:
            return
        for number, (bridge, route) in enumerate(whole):
            for other, back in whole[:number]:
                if other is bridge or _longer(route) + _longer(back) <= 0:
                    continue
                there = _through(back, _through(route, route.source.topic or ""))
                if _through(route, there) and self._reaches(bridge, route, other, back):
                    yield (other, back), (bridge, route)
                    break

    def _reaches(self, bridge: Bridge, route: Route, other: Bridge, back: Route) -> bool:
        """Return whether each of two routes publishes on the wire that the other listens on."""
        ends = [
            (
                self.within.get((one.id, of.target.participant, PUBLISHER)),
                self.within.get((two.id, to.source.participant, SUBSCRIBER)),
            )
            for (one, of), (two, to) in (((bridge, route), (other, back)), ((other, back), (bridge, route)))
        ]
        return all(a is not None and b is not None and a.pack is b.pack and _meet(a, b) for a, b in ends)

    def carried(self, bridge: Bridge, route: Route) -> Iterator[tuple[str, str, str]]:
        """Yield the topics that a route with a pattern carries, each with the name it has on the other side, and an endpoint.

        That is what is published before it, or served behind it. If that may be a participant in no file, it is also
        what is subscribed behind it, or called before it, without a publisher or server there.
        """
        pattern = route.source.topic or ""
        other = route.target.topic or pattern
        there, here = _ends(route)
        rests = self.rests(bridge, *there, route.source.kind)
        if there[0].external and not self.has_other_participant(bridge, there[0].participant):
            wanted = self.rests(bridge, *here, route.target.kind)
            own = self.rests(bridge, here[0], there[1], here[2], route.source.kind)
            rests = {rest: name for rest, name in wanted.items() if rest not in own} | rests
        lets_through = _gate(route)
        for rest in sorted(rests):
            name = pattern.replace("*", rest, 1)
            if lets_through(name):
                yield name, other.replace("*", rest, 1), rests[rest]

    def left_out(self, bridge: Bridge, route: Route) -> Iterator[ImportNote]:
        """Say which topics, services or actions the expressions of a route keep from being carried, also by another route."""
        if not (route.only or route.but):
            return
        there, _ = _ends(route)
        pattern = route.source.topic or ""
        lets_through = _gate(route)
        names = [
            self.shown[there[2].replace("*", rest, 1)]
            for rest in sorted(self.rests(bridge, *there, route.source.kind))
            if not lets_through(name := pattern.replace("*", rest, 1))
            and (*_between(route), name) not in self.growing.carried
        ]
        if names:
            what = "topic" if route.source.kind == MESSAGE else route.source.kind.partition("_")[0]
            listed = ", ".join(f"`{name}`" for name in names[:_MOST_NAMED])
            more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
            message = f"bridge `{bridge.id}` leaves out {what}{'s' if len(names) > 1 else ''} {listed}{more}"
            yield ImportNote("CQ506", "note", message, route.place)

    def rests(self, bridge: Bridge, side: Endpoint, role: Role, pattern: str, kind: str) -> dict[str, str]:
        """Return the texts that match the `*` of a pattern, in the names on which a side of a bridge can match an endpoint of a role.

        Each with the id of the endpoint that has the name. The bridge itself does not count: what it publishes it does not
        take back.
        """
        asking = self.within.get((bridge.id, side.participant, SUBSCRIBER if role == PUBLISHER else PUBLISHER))
        if asking is None or (role == SUBSCRIBER and asking.pack.topic_matching.match is not None):
            return {}  # a filter is no name
        before, _, after = pattern.partition("*")
        known = self.known.setdefault((id(side), role), _SideView())
        found: dict[str, str] = {}
        for each in known.new(self._near(asking, role, kind)):
            name = each.key or ""
            if len(name) < len(before) + len(after) or not (name.startswith(before) and name.endswith(after)):
                continue
            rest = name[len(before) : len(name) - len(after)]
            identifier = each.stated_id.removeprefix(f"{_WITHIN}/")
            if rest in known.rests or self.growing.own.get(identifier) == bridge.id or not _meet(each, asking):
                continue
            found[rest] = min(found.get(rest, identifier), identifier)
        known.rests.update(found)
        return known.rests

    def _near(self, asking: Resolved, role: Role, kind: str) -> _Filed:
        """Return the endpoints of a role that a side may match, as they are filed."""
        filed = self.there.get((asking.pack, role, kind), {})
        key = self._key(asking)
        return filed if key is None else {each: filed[each] for each in (key, None) if each in filed}

    def has_other_participant(self, bridge: Bridge, participant: str) -> bool:
        """Whether another participant is on the wire of one of the bridge's participants."""
        asking = self.within.get((bridge.id, participant, SUBSCRIBER))
        if asking is None:
            return False
        others = (each for (of, _, role), each in self.within.items() if of != bridge.id and role == PUBLISHER)
        published = (
            each
            for pack, role, kind in self.there
            if pack is asking.pack and role == PUBLISHER
            for there in self._near(asking, PUBLISHER, kind).values()
            for each in there
            if self.growing.own.get(each.stated_id.removeprefix(f"{_WITHIN}/")) != bridge.id
        )
        return any(each.pack is asking.pack and _meet(each, asking) for each in chain(others, published))


@dataclass(slots=True)
class _SideView:
    """The names that a side matches, and the number of endpoints that it has looked at, as filed."""

    rests: dict[str, str] = field(default_factory=dict)
    seen: dict[Value | None, int] = field(default_factory=dict)

    def new(self, filed: _Filed) -> Iterator[Resolved]:
        """Yield the endpoints that it has not looked at."""
        for key, there in filed.items():
            yield from there[self.seen.get(key, 0) :]
            self.seen[key] = len(there)


def _ends(route: Route) -> tuple[tuple[Endpoint, Role, str], tuple[Endpoint, Role, str]]:
    """Return the side whose endpoints a route carries, with role and names, and the side where others wait for them."""
    before = (route.source, PUBLISHER, route.source.topic or "")
    behind = (route.target, SUBSCRIBER, route.target.topic or route.source.topic or "")
    return (before, behind) if route.source.kind == MESSAGE else (behind, before)


def _longer(route: Route) -> int:
    """By how many characters a route makes names longer."""
    source = route.source.topic or ""
    return len(route.target.topic or source) - len(source)


def _through(route: Route, name: str) -> str:
    """Return the name that a route with a pattern makes of a name, which may contain a `*`; empty if it is not carried."""
    source = route.source.topic or ""
    before, _, after = source.partition("*")
    if not name or len(name) < len(before) + len(after) or not (name.startswith(before) and name.endswith(after)):
        return ""
    return (route.target.topic or source).replace("*", name[len(before) : len(name) - len(after)], 1)


def _meet(one: Resolved, other: Resolved) -> bool:
    """Whether two endpoints are on one wire."""
    publisher, subscriber = (one, other) if one.role == PUBLISHER else (other, one)
    return not failed_match_conditions(publisher.profile, subscriber.profile)


def _gate(route: Route) -> Callable[[str], bool]:
    """Return a function that tells whether a route carries a name."""
    only, but = any_name_matcher(route.only), any_name_matcher(route.but)
    return lambda name: (not route.only or only(name)) and not but(name)
