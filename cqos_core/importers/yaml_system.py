"""Reads C-QoS system files: YAML or JSON documents in the system form, with their includes, become one `System`."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.importers import yaml_form as form
from cqos_core.importers.format_detection import may_have_exceptions
from cqos_core.importers.source_reading import shown
from cqos_core.importers.team_rules import acceptance, team_rule
from cqos_core.importers.unread_parts import unread_note
from cqos_core.importers.variables import Multiplier, TooManyError, variables
from cqos_core.importers.yaml_chains import chains_and_links
from cqos_core.importers.yaml_documents import Loader
from cqos_core.importers.yaml_endpoints import DIRECTIONS, PUBLISHES, SUBSCRIBES, Direction, Maker, profiles, texts_of
from cqos_core.model.endpoint_rows import add_rows, as_object
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.problems import InputError, Problem, collect
from cqos_core.model.settings import Place
from cqos_core.model.system import (
    MESSAGE,
    PUBLISHER,
    SUBSCRIBER,
    Bridge,
    Broker,
    Endpoint,
    Participant,
    Profile,
    ProfileRef,
    Room,
    Route,
    System,
    Topic,
    endpoint_id,
    numbered,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from typing import TypeVar

    from cqos_core.importers.document_form import Entry, Member
    from cqos_core.model.endpoint_rows import Row, SettingsPattern
    from cqos_core.model.settings import Setting
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Role

    T = TypeVar("T")

_ONE_COPY: Final[tuple[dict[str, str], ...]] = ({},)
_FEW: Final = 1_000
"""So few endpoints are not worth keeping as rows."""


_GROUPS: Final = ((form.PUBLISHERS, PUBLISHES), (form.SUBSCRIBERS, SUBSCRIBES))


class _AsWritten(NamedTuple):
    """An endpoint as it stands in the file, before it is multiplied.

    Attributes:
        endpoint: with the id it would have if no other had it; perhaps still a row.
        template: its id in the file, unique within its participant.
        given: whether a person chose the id.
    """

    endpoint: Endpoint | Row
    template: str
    given: bool


def read(source: Source, context: ReadContext) -> System:
    """Read ``source`` and everything it includes into one system; `InputError` has all problems of all files."""
    loader = Loader(context)
    with gc_paused():
        loader.load(source)
        builder = _Builder(loader)
        builder.build()
    order = {name: index for index, name in enumerate(loader.sources)}
    if loader.problems:
        from cqos_core.importers.advice_notation import in_notation

        raise InputError(sorted(map(in_notation, loader.problems), key=lambda problem: _position(problem.place, order)))
    if any(map(may_have_exceptions, builder.system.sources.values())):
        from cqos_core.importers.inline_exceptions import take_inline_exceptions

        take_inline_exceptions(builder.system)
    if builder.system.notes and source.name.lower().endswith(".json"):
        from cqos_core.importers.advice_notation import in_notation

        builder.system.notes = [*map(in_notation, builder.system.notes)]
    builder.system.notes.sort(key=lambda note: _position(note.place, order))
    return builder.system


def _position(place: Place | None, order: Mapping[str, int]) -> tuple[int, int, int]:
    if place is None:
        return len(order), 0, 0
    return order.get(place.source, len(order)), place.line or 0, place.column or 0


class _Builder:
    """Puts documents together into one system and multiplies instances."""

    def __init__(self, loader: Loader) -> None:
        self.documents = loader.documents
        self.foreign = loader.foreign
        self.problems = loader.problems
        self.system = System(notes=loader.notes, sources=loader.sources)
        self.places: dict[tuple[str, str], Place] = {}
        self.endpoints: list[Endpoint | Row] = []
        self.ids: dict[str, tuple[Any, ...]] = {}
        self.numbers: dict[str, int] = {}
        self.patterns: dict[tuple[str, ...], SettingsPattern] = {}
        self.multiplied: Place | None = None
        self.made = Multiplier(self.instances(), active=bool(loader.templates))
        for node, reading in loader.templates:
            self.made.check(node, reading, loader.variables)

    def instances(self) -> dict[str, tuple[str, ...]]:
        """Return the variables of all documents."""
        found = {}
        for document in self.documents:
            for name, member in (document.get(form.INSTANCES) or {}).items():
                if self.claim("variable", name, member.place):
                    found[name] = member.value
        return found

    def build(self) -> None:
        """Fill the system."""
        if self.documents:
            self.system.protocol = self.documents[0].get(form.DEFAULT_PROTOCOL)
            self.system.partial = all(document.get(form.PART) is True for document in self.documents)
        for document in self.documents:
            try:
                self.heading(document)
                self.named(document)
                self.participants(document)
                self.team(document)
                self.system.notes += map(unread_note, document.get(form.UNREAD) or ())
            except TooManyError as error:
                advice = "list fewer instances, or mention fewer variables together"
                self.problem("CQ016", f"`instances` would make {error}", self.multiplied, advice)
        add_rows(self.system, self.endpoints)
        for foreign in self.foreign:
            self.take(foreign)
        if len(self.system.endpoints) < _FEW:
            self.system.endpoints = [*self.system.endpoints]

    def problem(self, code: str, message: str, place: Place | None, advice: str | None = None) -> None:
        """Collect a problem."""
        collect(self.problems, Problem(code, message, place, advice))

    def once(self, code: str, message: str, place: Place | None, advice: str) -> None:
        """Collect a problem that every copy of something has, once."""
        if not self.problems or self.problems[-1].place is not place:
            self.problem(code, message, place, advice)

    def claim(self, kind: str, name: str, place: Place) -> bool:
        """Take a name; where it is taken, tell both places and return False."""
        first = self.places.get((kind, name))
        if first is None:
            self.places[kind, name] = place
            return True
        self.problem("CQ012", f"{kind} {shown(name)} is stated twice, first at {first}", place, "keep one of them")
        return False

    def copies(
        self, kind: str, name: str, place: Place, part: object, bound: frozenset[str] = frozenset()
    ) -> Iterable[dict[str, str]]:
        """Return a binding for each copy of a named thing; every variable in ``part`` must be bound or in its name."""
        if not self.made.active:
            return _ONE_COPY
        own = self.made.mentioned(name) - bound
        missing = self.made.mentioned(part) - own - bound
        if missing:
            message = f"{variables(missing)} would make several copies of {kind} {shown(name)} under one name"
            self.once("CQ015", message, place, "write the variable in the name too")
            return ()
        self.multiplied = place
        return self.made.bindings(own)

    # What a system has one of

    def heading(self, entry: Entry) -> None:
        """Take name, options and severities; an including file comes before what it includes."""
        self.system.name = self.system.name or entry.get(form.SYSTEM) or ""
        for pack, options in (entry.get(form.OPTIONS) or {}).items():
            kept = self.system.options.setdefault(pack, {})
            for name, setting in options.value.items():
                if self.agrees(f"option `{pack}.{name}`", kept.get(name), setting):
                    kept.setdefault(name, setting)
        for rule, severity in (entry.get(form.SEVERITIES) or {}).items():
            if self.claim("severity of", rule, severity.place):
                self.system.severities[rule] = severity.value

    def agrees(self, what: str, first: Setting | None, second: Setting) -> bool:
        """Whether a setting is stated once, or twice with the same value; otherwise tell both places."""
        if first is None or first.text == second.text:
            return True
        message = f"{what} is {shown(second.text)} here and {shown(first.text)} at {first.place}"
        self.problem("CQ012", message, second.place, "keep one of them")
        return False

    def team(self, entry: Entry) -> None:
        """Take checks and accepted findings."""
        for stated in entry.get(form.CHECKS) or ():
            rule = team_rule(stated)
            for binding in self.copies("check", rule.name, stated.place, rule):
                copy = self.made.fill(rule, binding)
                if self.claim("check", copy.name, stated.place):
                    self.system.checks.append(copy)
        for stated in entry.get(form.ACCEPT) or ():
            accepted = acceptance(stated)
            self.multiplied = stated.place
            for binding in self.made.bindings(self.made.mentioned(accepted)):
                self.system.accept.append(self.made.fill(accepted, binding))

    # What has a name

    def named(self, entry: Entry) -> None:
        """Take profiles, topics, brokers, bridges, chains and links."""
        for name, profile in (entry.get(form.PROFILES) or {}).items():
            stated = Profile(name, profile.value.settings, profiles(profile.value), profile.place)
            self.add("profile", name, stated, self.system.profiles)
        for name, topic in (entry.get(form.TOPICS) or {}).items():
            external = topic.value.get(form.EXTERNAL) or False
            about = Topic(name, topic.value.settings, external, topic.value.get(form.PROTOCOL), topic.place)
            self.add("topic", name, about, self.system.topics)
        for name, broker in (entry.get(form.BROKERS) or {}).items():
            made, room = broker.value, Room(broker.place)
            found = Broker(name, self.protocol(made, entry), made.settings, profiles(made), broker.place, room=room)
            self.add("broker", name, found, self.system.brokers)
        for name, bridge in (entry.get(form.BRIDGES) or {}).items():
            routes, carries = map(_route, bridge.value.get(form.ROUTES) or ()), bridge.value.get(form.CARRIES) or ()
            self.add("bridge", name, Bridge(name, (*routes,), (*carries,), bridge.place), self.system.bridges)
        for kind, plan in chains_and_links(entry):
            self.add(kind, plan.name, plan, getattr(self.system, f"{kind}s"))

    def add(
        self,
        kind: str,
        name: str,
        stated: T,
        among: dict[str, T],
        binding: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        """Put every copy of ``stated`` among its like; ``binding`` is that of what it belongs to."""
        place: Place = stated.place  # type: ignore[attr-defined]
        for more in self.copies(kind, name, place, stated, frozenset(binding)):
            combined = {**binding, **more}
            copied = self.made.text(name, combined)
            if self.claim(kind, copied, place):
                among[copied] = self.made.fill(stated, combined)

    def protocol(self, entry: Entry, document: Entry) -> str | None:
        """Return the protocol of a participant or broker, None where it is the system's."""
        protocol = entry.get(form.PROTOCOL) or document.get(form.DEFAULT_PROTOCOL)
        return None if protocol == self.system.protocol else protocol

    # What included files of other formats state

    def take(self, foreign: System) -> None:
        """Take what another importer read; of options, what system files state comes before it."""
        system = self.system
        for pack, options in foreign.options.items():
            kept = system.options.setdefault(pack, {})
            for name, setting in options.items():
                kept.setdefault(name, setting)
        for participant in foreign.participants.values():
            own = participant.protocol or foreign.protocol
            participant.protocol = None if own == system.protocol else own
        for kind in ("profile", "topic", "broker", "bridge", "chain", "link", "participant"):
            among = getattr(system, f"{kind}s")
            for name, stated in getattr(foreign, f"{kind}s").items():
                if kind == "broker" and name in among:
                    if is_only_named(stated):
                        continue  # an address of a bridge or a client, which another file describes
                    if is_only_named(among[name]):
                        del self.places[kind, name]
                if self.claim(kind, name, stated.place or Place("")):
                    among[name] = stated
        system.endpoints += foreign.endpoints
        system.overlays += foreign.overlays
        system.checks += foreign.checks
        system.accept += foreign.accept
        for rule, severity in foreign.severities.items():
            system.severities.setdefault(rule, severity)

    # Participants and endpoints

    def participants(self, document: Entry) -> None:
        """Take participants with their endpoints."""
        for name, member in (document.get(form.PARTICIPANTS) or {}).items():
            participant = self.participant(name, member, document)
            groups, endpoints = self.stated(name, member.value, observed=document.get(form.ALL_OBSERVED) or False)
            for binding in self.copies("participant", name, member.place, participant):
                copy = self.made.fill(participant, binding)
                if not self.claim("participant", copy.id, member.place):
                    continue
                copy.template = name if binding else None
                self.system.participants[copy.id] = copy
                for profile in groups:
                    self.add("group", profile.name, profile, self.system.profiles, binding)
                for stated in endpoints:
                    self.copy_endpoint(stated, binding)

    def participant(self, name: str, member: Member[Entry], document: Entry) -> Participant:
        """Read what is stated of the participant itself; connection and options count as settings."""
        entry = member.value
        settings = dict(entry.settings)
        for key in (form.CLIENT, form.PARTICIPANT_OPTIONS):
            for setting_name, setting in (entry.get(key) or {}).items():
                if self.agrees(f"`{setting_name}` of participant {shown(name)}", settings.get(setting_name), setting):
                    settings[setting_name] = setting
        return Participant(
            id=name,
            protocol=self.protocol(entry, document),
            settings=settings,
            remap={old: new.value for old, new in (entry.get(form.REMAP) or {}).items()},
            external=entry.get(form.EXTERNAL) or False,
            starts_after=texts_of(entry, form.STARTS_AFTER),
            label=entry.get(form.LABEL),
            place=member.place,
            room=Room(member.place),
            groups={key.name: group.place for key, _ in _GROUPS for group in list((entry.get(key) or {}).values())[:1]},
        )

    def stated(self, name: str, entry: Entry, *, observed: bool) -> tuple[list[Profile], list[_AsWritten]]:
        """Read the endpoints of a participant, and the profiles that its groups are."""
        groups: list[Profile] = []
        found: list[_AsWritten] = []
        numbers: dict[str, int] = {}
        for direction in DIRECTIONS:
            found += self.below(name, entry, direction, (), numbers, observed=observed)
        for key, direction in _GROUPS:
            for group, member in (entry.get(key) or {}).items():
                shared = profiles(member.value)
                if member.value.settings:
                    profile = Profile(f"{name}/{key.name}/{group}", member.value.settings, shared, member.place)
                    groups.append(profile)
                    shared = (ProfileRef(profile.name, member.place),)
                found += self.below(name, member.value, direction, shared, numbers, observed=observed)
        return groups, found

    def below(
        self,
        participant: str,
        entry: Entry,
        direction: Direction,
        shared: tuple[ProfileRef, ...],
        numbers: dict[str, int],
        *,
        observed: bool,
    ) -> Iterator[_AsWritten]:
        """Yield the endpoints below one key; ``shared`` are the profiles of the group they are in."""
        members = entry.get(direction.key)
        if not members:
            return
        word = direction.word
        maker = Maker(participant, direction, shared, self.patterns, observed=observed)
        for topic, member in members.items():
            name = endpoint_id(participant, word, topic)
            for stated in member.value:
                place = stated.place if len(member.value) > 1 else member.place
                given = stated.get(form.ID) if stated.values else None
                endpoint = maker.endpoint(stated, given or name, topic, place)
                yield _AsWritten(endpoint, given or numbered(name, numbers), given is not None)

    def copy_endpoint(self, stated: _AsWritten, binding: Mapping[str, str]) -> None:
        """Add the copies of one endpoint within one copy of its participant."""
        row = stated.endpoint
        if not self.made.active and isinstance(row, tuple) and row[1] not in self.ids:
            self.ids[row[1]] = (row[0].place(row), True) if stated.given else row
            self.endpoints.append(row)
            return
        endpoint = as_object(row)
        for copy in self.endpoint_copies(endpoint, stated, binding) if self.made.active else (endpoint,):
            copy.id = self.unique(copy, given=stated.given)
            self.endpoints.append(copy)

    def endpoint_copies(self, template: Endpoint, stated: _AsWritten, binding: Mapping[str, str]) -> Iterator[Endpoint]:
        """Yield the copies of one endpoint; their ids may be those of others still."""
        mentioned = self.made.mentioned(template) | set(binding)
        if stated.given and mentioned - self.made.mentioned(template.id):
            message = f"{variables(mentioned)} would make several endpoints with the id {shown(template.id)}"
            self.once("CQ015", message, template.place, "write the variable in the id too")
            return
        self.multiplied = template.place
        for more in self.made.bindings(mentioned - set(binding)):
            copy = self.made.fill(template, {**binding, **more})
            copy.template = stated.template if mentioned else None
            yield copy

    def unique(self, endpoint: Endpoint, *, given: bool) -> str:
        """Take the endpoint's id; one that was made up gives way to others like it by ``#2``, ``#3``."""
        place = endpoint.place or Place("")
        name = endpoint.id
        while name in self.ids:
            first, first_given = self.taken(name)
            if given or first_given:
                message = f"endpoint id {shown(name)} is taken, first at {first}"
                advice = "give every endpoint an id of its own" if given else "give this endpoint an `id:` of its own"
                self.problem("CQ013", message, place, advice)
                break
            name = numbered(endpoint.id, self.numbers)  # the first of them is taken, or we were not here
        self.ids.setdefault(name, (place, given))
        return name

    def taken(self, name: str) -> tuple[Place, bool]:
        """Return where the endpoint with an id stands, and whether a person chose the id."""
        alike, *more = found = self.ids[name]
        return (alike, more[0]) if isinstance(alike, Place) else (alike.make("place", found), False)


def is_only_named(broker: Broker) -> bool:
    """Whether nothing is stated of a broker but that it is there."""
    return not (broker.settings or broker.profiles or broker.addresses)


def _route(route: Entry) -> Route:
    source, target = route.require(form.FROM), route.require(form.TO)
    only, but, kind = route.get(form.ONLY) or [], route.get(form.BUT) or [], route.get(form.KIND)
    receives, sends = (f"{kind}_server", f"{kind}_client") if kind else (MESSAGE, MESSAGE)
    ends = _side(source, SUBSCRIBER, receives), _side(target, PUBLISHER, sends)
    return Route(*ends, route.place, tuple(only), tuple(but))


def _side(stated: Entry, role: Role, kind: str) -> Endpoint:
    return Endpoint(
        id=stated.get(form.ID) or "",
        role=role,
        topic=stated.get(form.TOPIC_NAME),
        participant=stated.require(form.PARTICIPANT_ID),
        settings=stated.settings,
        profiles=profiles(stated),
        type=stated.get(form.TYPE),
        kind=kind,
        external=stated.get(form.EXTERNAL) or False,
        label=stated.get(form.LABEL),
        place=stated.place,
    )
