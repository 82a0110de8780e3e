"""Reads domains, participants and applications of DDS-XML: who writes and reads which topic, with which QoS."""

from __future__ import annotations

import glob
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from cqos_core.importers.source_reading import did_you_mean, shown
from cqos_core.importers.xml_source import children, elements, local, text_of
from cqos_core.model.settings import Cases, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Profile, ProfileRef, Room, Scope, Topic
from cqos_dds.importers.leases import CONNEXT, LEASE, lease_in
from cqos_dds.importers.policy_forms import OF_ENTITIES, PARTICIPANT, PUBLISHER_QOS, READER, SUBSCRIBER_QOS, WRITER
from cqos_dds.importers.qos_libraries import SEPARATOR, part_of
from cqos_dds.importers.xml_values import flag, not_set
from cqos_dds.policies import OF_COMPILER
from cqos_dds.requested_policies import TYPE_EXTENSIBILITY

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Role
    from cqos_dds.importers.qos_libraries import QosLibraries
    from cqos_dds.importers.xml_values import XmlReading

_MOST_BASES: Final = 64
_NOT_STATED: Final = Cases(
    "what a type is whose definition states no extensibility", (("final", "final"), ("appendable", "appendable"))
)
"""No compiler makes such a type mutable."""
PARTICIPANT_LIBRARIES: Final = ("domain_participant_library", "participant_library")
_REGISTER: Final = ("register_type", "registered_type")


class _Side(NamedTuple):
    """What is written, or what is read: groups, endpoints in them, and the elements of their QoS."""

    group: str
    endpoint: str
    role: Role
    group_qos: str
    endpoint_qos: str


_SIDES: Final = (
    _Side("publisher", "data_writer", PUBLISHER, PUBLISHER_QOS, WRITER),
    _Side("subscriber", "data_reader", SUBSCRIBER, SUBSCRIBER_QOS, READER),
)


@dataclass(slots=True)
class Chain:
    """An element with those it is based on, what counts least first; each with the name it has in messages.

    Attributes:
        short: the name that the element states.
    """

    links: list[tuple[str, Element]] = field(default_factory=list)
    short: str = ""

    @property
    def own(self) -> Element:
        """The element itself."""
        return self.links[-1][1]

    @property
    def name(self) -> str:
        """Its own name."""
        return self.links[-1][0]

    def attribute(self, name: str) -> str:
        """The nearest value of an attribute."""
        found = (each.get(name, "").strip() for _, each in reversed(self.links))
        return next(filter(None, found), "")

    def named(self, *tags: str) -> dict[str, Chain]:
        """Return the elements below with these tags, by name; one of the same name extends that of a base."""
        found: dict[str, Chain] = {}
        for above, element in self.links:
            for number, child in enumerate(children(element, *tags), 1):
                name = (child.get("name") or "").strip() or f"{local(child)}{number}"
                found.setdefault(name, Chain(short=name)).links.append((f"{above}/{name}", child))
        return found


class Entities:
    """Reads the participants of one file into endpoints of the system.

    Attributes:
        beside: returns what those of the files read together with this one define that hold a word.
        services: the routing services of the file.
    """

    def __init__(
        self, reading: XmlReading, profiles: QosLibraries, beside: Callable[[str], list[Entities]] = lambda _: []
    ) -> None:
        self.reading = reading
        self.profiles = profiles
        self.beside = beside
        self.domains: dict[str, Element] = {}
        self.participants: dict[str, Element] = {}
        self.applied: dict[str, Element] = {}
        self.keyed: dict[str, bool] = {}
        self.extensibility: dict[str, str] = {}
        self.elsewhere: set[str] = set()
        self.services: list[Element] = []

    # What the file defines

    def application_library(self, element: Element) -> None:
        """Remember the participants of applications."""
        library = self.reading.name(element)
        for application in children(element, "application"):
            name = f"{library}{SEPARATOR}{self.reading.name(application)}"
            for participant in children(application, "domain_participant"):
                self.applied[f"{name}{SEPARATOR}{self.reading.name(participant)}"] = participant
            for reference in children(application, "domain_participant_ref"):
                base = text_of(reference) or (reference.get("base_name") or reference.get("name") or "").strip()
                reference.set("base_name", base)
                self.applied[f"{name}{SEPARATOR}{base.rpartition(SEPARATOR)[2]}"] = reference

    def define(self, library: Element, tag: str, among: dict[str, Element]) -> None:
        """Remember the elements of one library by their full names."""
        prefix = self.reading.name(library)
        for element in elements(library):
            if local(element) != tag:
                self.reading.pass_over(element, f"{local(library)}/{local(element)}")
                continue
            name = f"{prefix}{SEPARATOR}{self.reading.name(element)}"
            first = among.setdefault(name, element)
            if first is not element:
                message = f"{tag} `{name}` is stated twice, first at {self.reading.place(first)}"
                self.reading.problem("CQ012", message, element, "keep one of them")

    def types(self, element: Element, scope: str = "") -> None:
        """Remember of each data type whether it has keys, and how it may grow; empty if the file does not state that."""
        for child in elements(element):
            name = f"{scope}{(child.get('name') or '').strip()}"
            if local(child) == "module":
                self.types(child, f"{name}{SEPARATOR}")
            elif local(child) == "type":
                self.types(child, scope)
            elif local(child) == "struct":
                base = (child.get("baseType") or "").strip()
                own = any(flag(member.get("key")) for member in children(child, "member"))
                bases = [each for each in (f"{scope}{base}", base) if each in self.extensibility] if base else []
                stated = (child.get("extensibility") or "").strip() or next(map(self.extensibility.get, bases), None)
                if stated or bases or not base:  # what a base in another file states is not known
                    self.extensibility[name] = stated or ""
                self.keyed[name] = own or self.keyed.get(base, False) or self.keyed.get(f"{scope}{base}", False)

    def defined(self, kind: Literal["domains", "participants"], name: str) -> Element | None:
        """Return the domain or participant of a full name, from this file or from the one beside it that defines it."""
        found: Element | None = getattr(self, kind).get(name)
        if found is None and (file := self.definer(kind, name)) is not None:
            found = getattr(file, kind)[name]
            self.reading.files[found.getroottree().getroot()] = file.reading.source.name
        return found

    def definer(self, kind: Literal["domains", "participants", "keyed", "extensibility"], name: str) -> Entities | None:
        """Return the file beside this one that defines ``name``; of several the one in the same folder, else None."""
        found = [each for each in self.beside(name.rpartition(SEPARATOR)[2]) if name in getattr(each, kind)]
        near = [each for each in found if _folder(each) == _folder(self)] or found
        return near[0] if len(near) == 1 else None

    def defines_profile(self, name: str) -> bool:
        """Return whether this file, or one beside it, has a profile or QoS of that name."""
        files = (self, *self.beside(name.rpartition(SEPARATOR)[2]))
        return any(name in names for each in files for names in (each.profiles.stated, each.profiles.others))

    @cached_property
    def bases(self) -> set[str]:
        """The full names of what participants of this file are based on."""
        return {self.base_of(element, name) for name, element in (*self.participants.items(), *self.applied.items())}

    # Participants

    def make(self) -> None:
        """Make the participants of applications, and those of libraries that no other is based on."""
        used = set(self.bases)
        libraries = {name.rpartition(SEPARATOR)[0] for name in self.participants}
        used.update(*(each.bases for library in libraries for each in self.beside(library)))
        for name, element in (*self.participants.items(), *self.applied.items()):
            if name not in used:
                self.participant(self.chain(name, element, "participants"))

    def base_of(self, element: Element, name: str) -> str:
        """Return the full name of the base of a participant or domain, or an empty text."""
        base = (element.get("base_name") or "").strip()
        if not base or SEPARATOR in base:
            return base
        return f"{name.rpartition(SEPARATOR)[0]}{SEPARATOR}{base}"

    def chain(self, name: str, element: Element, among: Literal["domains", "participants"]) -> Chain:
        """Follow the bases of a participant or domain."""
        links = [(name, element)]
        trail = [name]
        while base := self.base_of(element, name):
            found = self.defined(among, base)
            if found is None:
                self.nowhere(element, f"the base of `{name}`", base, getattr(self, among))
                break
            if base in trail:
                circle = " → ".join((*trail[trail.index(base) :], base))
                self.reading.note("DDS906", f"{shown(base)} is based on itself: {circle}", element)
                break
            if len(trail) >= _MOST_BASES:
                self.reading.problem(
                    "CQ002", f"`{trail[0]}` has more than {_MOST_BASES} bases, which is refused", element
                )
                break
            trail.append(base)
            links.append((base, found))
            name, element = base, found
        return Chain(links[::-1])

    def nowhere(self, element: Element, what: str, name: str, known: Mapping[str, object]) -> str:
        """Report a reference to nothing in the file; return the code of the note."""
        if cause := not_set(name):
            self.reading.note("DDS907", f"{what}, {shown(name)}, is not known: {cause}", element)
            return "DDS907"
        library, _, own = name.rpartition(SEPARATOR)
        if not any(each.startswith(f"{library}{SEPARATOR}" if library else "") for each in known):
            if self.elsewhere.isdisjoint({library or own, own}):
                stands = f"the library {shown(library)}" if library else "the library of it"
                several = len(
                    {
                        each.reading.source.name
                        for each in self.beside(own)
                        if name in each.domains or name in each.participants
                    }
                )
                cause = f"{several} files define it" if several else f"{stands} is in none of the files"
                self.reading.note("DDS907", f"{what}, {shown(name)}, is not known: {cause}", element)
            self.elsewhere |= {library or own, own}
            return "DDS907"
        message = f"{what}, {shown(name)}, is not defined in this file{did_you_mean(name, known)}"
        self.reading.note("DDS905", message, element)
        return "DDS905"

    def participant(self, chain: Chain) -> None:
        """Make one participant with its endpoints."""
        owner = Participant(chain.name, place=self.reading.place(chain.own))
        domain, lost = self.domain(chain)
        number, where = self.domain_id(chain, domain)
        if number:
            owner.settings["domain"] = Setting(number, self.reading.place(where), unknown=not_set(number))
        elif lost:
            cause = f"the domain of `{chain.name}` is not defined in this file"
            owner.settings["domain"] = Setting("", self.reading.place(where), unknown=cause, reported=lost)
        if (lease := self.lease(chain)) is not None:
            owner.settings[LEASE] = lease
        self.reading.system.participants[owner.id] = owner
        around = [link for each in (domain, chain) if each is not None for link in each.links]
        topics = Chain(around).named("topic")
        types = Chain(around).named(*_REGISTER)
        for side in _SIDES:
            for group in (chain, *chain.named(side.group).values()):
                for endpoint in group.named(side.endpoint).values():
                    self.endpoint(owner, side, group, endpoint, topics, types, known=not lost)
        for _, element in chain.links:
            self.unread(element, owner.id)

    def lease(self, chain: Chain) -> Setting | None:
        """Return the lease that the QoS of a participant states, itself or by its bases; None where none does."""
        for name, element in reversed(chain.links):
            for qos in [each for each in elements(element) if part_of(each) == PARTICIPANT]:
                own = lease_in(qos, CONNEXT, self.reading)
                bases = [] if own is not None else self.profiles.bases(qos, name.rpartition(SEPARATOR)[0])
                found = (own, *(self.profiles.lease_of(ref.name) for ref in reversed(bases)))
                if (lease := next((each for each in found if each is not None), None)) is not None:
                    return lease
        return None

    def domain(self, chain: Chain) -> tuple[Chain | None, str]:
        """Return the domain that a participant is in, else the code of the note that it is missing."""
        name = chain.attribute("domain_ref")
        if not name:
            return None, ""
        if name not in self.domains and SEPARATOR not in name:
            full = [each for each in self.domains if each.endswith(f"{SEPARATOR}{name}")]
            name = full[0] if len(full) == 1 else name
        element = self.defined("domains", name)
        if element is None:
            return None, self.nowhere(chain.own, f"the domain of `{chain.name}`", name, self.domains)
        return self.chain(name, element, "domains"), ""

    def domain_id(self, chain: Chain, domain: Chain | None) -> tuple[str, Element]:
        """Return the number of a participant's domain, and where it is stated."""
        for each in (chain, *([domain] if domain is not None else ())):
            for _, element in reversed(each.links):
                number = (element.get("domain_id") or "").strip()
                inner = children(element, "domain_id")
                if number or inner:
                    return number or text_of(inner[0]), inner[0] if not number else element
        return "", chain.own

    def unread(self, participant: Element, owner: str) -> None:
        """Remember the unread elements of a participant, whose id is ``owner``."""
        for child in elements(participant):
            if part_of(child) == PARTICIPANT:
                self.profiles.other(child, PARTICIPANT, glob.escape(owner))
            elif local(child) not in _READ_IN_PARTICIPANT:
                self.reading.pass_over(child, f"domain_participant/{local(child)}")
            for inner in elements(child) if local(child) in {"publisher", "subscriber"} else ():
                for last in elements(inner) if local(inner) in {"data_writer", "data_reader"} else ():
                    if part_of(last) not in {WRITER, READER}:
                        self.reading.pass_over(last, f"{local(inner)}/{local(last)}")

    # Endpoints

    def endpoint(
        self,
        owner: Participant,
        side: _Side,
        group: Chain,
        endpoint: Chain,
        topics: Mapping[str, Chain],
        types: Mapping[str, Chain],
        *,
        known: bool,
    ) -> None:
        """Make one data writer or data reader; ``known``: the domain with its topics is."""
        reference = endpoint.attribute("topic_ref")
        if not reference:
            self.reading.problem("CQ010", f"`{local(endpoint.own)}` needs a `topic_ref`", endpoint.own)
            return
        topic = topics.get(reference) or topics.get(reference.rpartition(SEPARATOR)[2])
        if topic is None and topics and known:
            self.nowhere(endpoint.own, f"the topic of `{endpoint.name}`", reference, topics)
        name = reference if topic is None else topic.attribute("topic_name") or topic.attribute("name") or reference
        refs: list[ProfileRef] = []
        settings: Settings = {}
        for part, chain in ((side.group_qos, group), (side.endpoint_qos, endpoint)):
            refs += self.qos(chain, part, settings)
        made = Endpoint(
            id=self.reading.numbered("/".join(filter(None, (owner.id, group.short, endpoint.short)))),
            role=side.role,
            topic=name,
            participant=owner.id,
            settings=settings | self.type_settings(topic, types, endpoint),
            profiles=tuple(refs),
            type=self.topic(name, topic, types),
            external=bool(not_set(name)) or (topic is None and not known),
            place=self.reading.place(endpoint.own),
            room=Room(self.reading.place(endpoint.own), OF_ENTITIES[side.endpoint_qos], restated=True),
        )
        self.reading.system.endpoints.append(made)

    def type_settings(self, topic: Chain | None, types: Mapping[str, Chain], endpoint: Chain) -> Settings:
        """Return what the definition of the data type of an endpoint says, where a file has it."""
        name = "" if topic is None else _type_names(topic, types)[1]
        file = self if name in self.extensibility else self.definer("extensibility", name) if name else None
        if file is None:
            return {}
        stated, place = file.extensibility[name], self.reading.place(endpoint.own)
        setting = (
            Setting(stated, place, derived=True)
            if stated
            else Setting(OF_COMPILER, place, unknown=_NOT_STATED, derived=True)
        )
        return {TYPE_EXTENSIBILITY.name: setting}

    def qos(self, chain: Chain, part: str, settings: Settings) -> Iterator[ProfileRef]:
        """Yield what an entity takes its QoS from; what stands at the entity itself goes to ``settings``."""
        stated = [(name, qos) for name, each in chain.links for qos in elements(each) if part_of(qos) == part]
        if not stated and self.profiles.default is not None:
            yield ProfileRef(self.profiles.default, self.reading.place(chain.own), Scope(part=part))
        for name, qos in stated:
            profile = self.profiles.part(f"{name}/{part}", qos, part, library="")
            for ref in profile.base:
                if ref.scope.part in {None, part}:
                    yield ProfileRef(ref.name, ref.place, Scope(part=part))
            if qos is stated[-1][1]:
                settings |= profile.settings
            elif profile.settings:
                self.profiles.add(Profile(profile.name, profile.settings, (), profile.place))
                yield ProfileRef(profile.name, profile.place, Scope(part=part))

    def topic(self, name: str, topic: Chain | None, types: Mapping[str, Chain]) -> str | None:
        """Remember a topic of the system; return the name of its data type."""
        if topic is None:
            return None
        registered, type_name = _type_names(topic, types)
        about = self.reading.system.topics.setdefault(name, Topic(name, place=self.reading.place(topic.own)))
        if type_name not in self.keyed and (file := self.definer("keyed", type_name)) is not None:
            self.keyed[type_name] = file.keyed[type_name]
        keyed = self.keyed.get(type_name)
        if keyed is not None:
            about.settings.setdefault("keyed", Setting("true" if keyed else "false", about.place))
        return registered or None


def _type_names(topic: Chain, types: Mapping[str, Chain]) -> tuple[str, str]:
    """Return the name under which the data type of a topic is registered, and that of its definition."""
    registered = topic.attribute("register_type_ref") or topic.attribute("type_name")
    chain = types.get(registered) or types.get(registered.rpartition(SEPARATOR)[2])
    return registered, chain.attribute("type_ref") if chain is not None else registered


def _folder(file: Entities) -> str:
    return file.reading.source.name.rpartition("/")[0]


_READ_IN_PARTICIPANT: Final = frozenset(
    ("publisher", "subscriber", "data_writer", "data_reader", "topic", "domain_id", *_REGISTER)
)
