"""Reads configurations of RTI Routing Service: each route subscribes in one domain and publishes in another.

A topic route has one topic on each side; an auto topic route carries each topic that its filters let through. Routes through adapters
and processors are named as parts that are not read: what they carry is a program's to say.
"""

from __future__ import annotations

import glob
from pathlib import PurePath
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.importers.source_reading import listed, shown
from cqos_core.importers.xml_source import children, elements, local, text_of
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bridge, Endpoint, Part, Participant, Room, Route
from cqos_dds.implementations import IMPLEMENTATION
from cqos_dds.importers.entities import Chain
from cqos_dds.importers.leases import LEASE
from cqos_dds.importers.policy_forms import OF_ENTITIES, PARTICIPANT, PUBLISHER_QOS, READER, SUBSCRIBER_QOS, WRITER
from cqos_dds.importers.qos_libraries import part_of
from cqos_dds.importers.topic_filters import expressions, in_both, patterns
from cqos_dds.importers.unmodelled_elements import leave_losses_open
from cqos_dds.importers.xml_values import not_set

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Role
    from cqos_dds.importers.entities import Entities
    from cqos_dds.importers.xml_values import XmlReading

_SECTION: Final = "routing_service"
_NO: Final = frozenset(("false", "0", "no"))
_PARTICIPANTS: Final = {"participant": "", "participant_1": "1", "participant_2": "2"}
_CONNECTIONS: Final = frozenset(("connection", "connection_1", "connection_2"))
_SESSIONS: Final = ("session", "polling_session")
_TOPIC_ROUTES: Final = {"topic_route": ("input", "output"), "route": ("dds_input", "dds_output")}
_AUTO_ROUTES: Final = {"auto_topic_route": ("input", "output"), "auto_route": ("dds_input", "dds_output")}
_TOOLS: Final = frozenset(("annotation", "administration", "monitoring", "entity_monitoring", "jvm", "service_qos"))
_IN_SESSION: Final = frozenset(
    (
        "entity_monitoring",
        "wait_set",
        "thread_pool",
        "thread",
        "poll_period",
        "property",
        "publisher_qos",
        "subscriber_qos",
    )
)
_ANY: Final = "*"
_IN_ROUTE: Final = (
    *("input", "output", "dds_input", "dds_output"),
    *("entity_monitoring", "filter_propagation", "route_types", "property"),
    *("publish_with_original_info", "publish_with_original_timestamp", "propagate_dispose", "propagate_unregister"),
    *("transformation", "processor", "periodic_action", "enable_data_on_inputs"),
)
_TYPE_FILTERS: Final = {"allow_registered_type_name_filter": _ANY, "deny_registered_type_name_filter": ""}
"""Filters of automatic routes by type, each with the text that keeps nothing back."""
_IN_SIDE: Final = (
    *("topic_name", "registered_type_name", "creation_mode", "content_filter", "property"),
    *("propagate_dispose", "propagate_unregister", "allow_topic_name_filter", "deny_topic_name_filter"),
    *_TYPE_FILTERS,
)


class _Side(NamedTuple):
    """One side of a route: its element, and the session that it runs in."""

    role: Role
    element: Element
    session: Element


class RoutingServices:
    """Reads the routing services of one file into bridges of the system."""

    def __init__(self, reading: XmlReading, entities: Entities) -> None:
        self.reading = reading
        self.entities = entities

    def make(self) -> None:
        """Make the bridge of the service; of several in one file an option of its command line takes one."""
        running = _running(self.entities)
        if len(running) > 1:
            names = listed([shown(each.get("name") or "") for each in running], "and")
            message = f"the file has the routing services {names}, and which of them runs is not known"
            cause = "which service of the file runs is not known"
            unread = [Part("bridge", each.get("name") or "", cause, self.reading.place(each)) for each in running]
            self.reading.note("DDS908", message, running[0], unread=unread)
            return
        for service in running:
            self.service(service)

    def service(self, service: Element) -> None:
        """Make the bridge of one service."""
        name = self.id(_name(service))
        routes: list[Route] = []
        for child in elements(service):
            if local(child) == "domain_route":
                if _enabled(child):
                    routes += self.domain_route(child, name)
            elif local(child) not in _TOOLS:
                self.not_read(child, "C-QoS does not know what it does")
        self.reading.system.bridges[name] = Bridge(name, tuple(routes), place=self.reading.place(service))

    def id(self, name: str) -> str:
        """Return the id of a service, which tells it from those of the same name in files beside this one."""
        others = [
            each.reading.source.name
            for each in self.entities.beside(name)
            if [_name(service) for service in _running(each)] == [name]
        ]
        own = self.reading.source.name
        stem = PurePath(own).stem
        return f"{name} ({own if stem in {PurePath(each).stem for each in others} else stem})" if others else name

    def domain_route(self, route: Element, service: str) -> Iterator[Route]:
        """Yield the routes between the domains of a domain route."""
        within = f"{service}/{name}" if (name := (route.get("name") or "").strip()) else service
        owners: dict[str, str] = {}
        for child in elements(route):
            tag = local(child)
            if tag in _PARTICIPANTS:
                owner = (child.get("name") or "").strip() or _PARTICIPANTS[tag]
                owners[owner] = owners[_PARTICIPANTS[tag] or owner] = self.participant(child, f"{within}/{owner}")
            elif tag in _SESSIONS:
                if _enabled(child):
                    yield from self.session(child, owners)
            elif tag in _CONNECTIONS:
                self.not_read(child, "an adapter decides what it carries")
            elif tag not in _TOOLS:
                self.not_read(child, "C-QoS does not know what it does")

    def participant(self, element: Element, name: str) -> str:
        """Add a participant of the service; return its id."""
        name = self.reading.numbered(name)
        place = self.reading.place(element)
        numbers = children(element, "domain_id")
        number = text_of(numbers[0]) if numbers else "0"
        settings = {
            "domain": Setting(number, place, unknown=not_set(number)),
            IMPLEMENTATION.name: Setting("connext", place),
        }
        owner = Participant(name, settings=settings, place=place)
        self.reading.system.participants[name] = owner
        if (lease := self.entities.lease(Chain([(name, element)]))) is not None:
            owner.settings[LEASE] = lease
        for qos in [each for each in elements(element) if part_of(each) == PARTICIPANT]:
            self.entities.profiles.other(qos, PARTICIPANT, glob.escape(name))
        return name

    def session(self, session: Element, owners: dict[str, str]) -> Iterator[Route]:
        """Yield the routes of a session."""
        for child in elements(session):
            tag = local(child)
            if tag in _TOPIC_ROUTES or tag in _AUTO_ROUTES:
                if _enabled(child):
                    yield from self.route(child, session, owners)
            elif tag not in _IN_SESSION and part_of(child) not in {PUBLISHER_QOS, SUBSCRIBER_QOS}:
                self.not_read(child, "C-QoS does not know what it does")

    def route(self, route: Element, session: Element, owners: dict[str, str]) -> Iterator[Route]:
        """Yield the ways of one route, from each of its inputs to each of its outputs."""
        automatic = local(route) in _AUTO_ROUTES
        tags = (_AUTO_ROUTES if automatic else _TOPIC_ROUTES)[local(route)]
        inputs = [_Side(SUBSCRIBER, each, session) for each in children(route, tags[0])]
        outputs = [_Side(PUBLISHER, each, session) for each in children(route, tags[1])]
        self.name_unread(route, (*inputs, *outputs))
        adapted = [each for tag in ("input", "output") if tag not in tags for each in children(route, tag)]
        for each in adapted:
            self.not_read(each, "an adapter decides what it carries")
        if children(route, "processor"):
            for side in () if automatic else (*inputs, *outputs):
                if (owner := self.owner(side, inputs, owners)) is not None:
                    self.reading.system.endpoints.append(self.endpoint(side, owner, automatic=False))
            return
        for source in () if adapted else inputs:
            for target in outputs:
                start, end = self.owner(source, inputs, owners), self.owner(target, inputs, owners)
                if start is not None and end is not None:
                    yield from self.way(route, (source, start), (target, end), automatic=automatic)

    def way(
        self, route: Element, source: tuple[_Side, str], target: tuple[_Side, str], *, automatic: bool
    ) -> Iterator[Route]:
        """Yield the way from an input to an output of a route, each with its participant."""
        filters = _filters(source[0].element, target[0].element) if automatic else ((), ())
        if filters is None:
            self.not_read(route, "the filters of both sides have too many parts to tell what they let through together")
            return
        start, end = (self.endpoint(*each, automatic=automatic) for each in (source, target))
        yield Route(start, end, self.reading.place(route), *filters)

    def name_unread(self, route: Element, sides: Sequence[_Side]) -> None:
        """Name what a route has that is not read."""
        for each in children(route, "processor"):
            self.not_read(each, "a program decides what it carries", endpoints=0)
        self.name_unknown(route, _IN_ROUTE)
        for side in sides:
            self.name_unknown(side.element, _IN_SIDE)
            for each in children(side.element, *_TYPE_FILTERS):
                if text_of(each) != _TYPE_FILTERS[local(each)]:
                    self.not_read(each, "types are not compared with it", endpoints=0)

    def name_unknown(self, element: Element, known: Sequence[str]) -> None:
        """Name what stands in an element of a route and is not known."""
        for child in elements(element):
            if local(child) not in known and part_of(child) not in {READER, WRITER}:
                self.not_read(child, "C-QoS does not know what it does", endpoints=0)

    def owner(self, side: _Side, inputs: list[_Side], owners: dict[str, str]) -> str | None:
        """Return the participant of a side; an output that names none has the one that no input has."""
        named = (side.element.get("participant") or "").strip()
        if not named and side.role == PUBLISHER:
            taken = {owners.get((each.element.get("participant") or "").strip()) for each in inputs}
            left = list(dict.fromkeys(each for each in owners.values() if each not in taken))
            if len(left) == 1:
                return left[0]
        if named not in owners:
            message = (
                f"`{local(side.element)}` is of participant {shown(named)}, which the domain route does not define"
            )
            self.reading.note("DDS905", message, side.element)
            return None
        return owners[named]

    def endpoint(self, side: _Side, owner: str, *, automatic: bool) -> Endpoint:
        """Return the endpoint of one side of a route."""
        part, group = (READER, SUBSCRIBER_QOS) if side.role == SUBSCRIBER else (WRITER, PUBLISHER_QOS)
        element, place = side.element, self.reading.place(side.element)
        settings: Settings = {}
        refs = [
            *self.entities.qos(Chain([(f"{owner}/session", side.session)]), group, settings),
            *self.entities.qos(Chain([(f"{owner}/{side.role}", element)]), part, settings),
        ]
        if children(element, "content_filter"):
            leave_losses_open(settings, place)
        topic = _ANY if automatic else _text(element, "topic_name") or (element.get("name") or "").strip()
        if not topic:
            self.reading.problem("CQ010", f"`{local(element)}` needs a `topic_name`", element)
        return Endpoint(
            id=self.reading.numbered(f"{owner}/{side.role}/{topic}"),
            role=side.role,
            topic="" if automatic and side.role == PUBLISHER else topic,
            participant=owner,
            settings=settings,
            profiles=tuple(refs),
            type=None if automatic else _text(element, "registered_type_name") or None,
            external=bool(not_set(topic)),
            place=place,
            room=Room(place, OF_ENTITIES[part], restated=True),
        )

    def not_read(self, element: Element, cause: str, *, endpoints: int = 1) -> None:
        """Name an element as a part that is not read, with so many endpoints at least."""
        path = f"{_SECTION}/{local(element)}"
        self.reading.pass_over(element, path)
        self.reading.parts.append(Part("route", path, cause, self.reading.place(element), endpoints))


def _running(file: Entities) -> list[Element]:
    """Return the services of a file that are not switched off."""
    return [each for each in file.services if _enabled(each)]


def _name(service: Element) -> str:
    return (service.get("name") or "").strip() or _SECTION


def _enabled(element: Element) -> bool:
    return (element.get("enabled") or "").strip().lower() not in _NO


def _text(element: Element, tag: str) -> str:
    found = children(element, tag)
    return text_of(found[0]) if found else ""


def _filters(source: Element, target: Element) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """Return regular expressions of the topics that an automatic route carries, and of those that it does not; None: not known."""
    everything = patterns(_ANY)
    first, second = (patterns(_text(side, "allow_topic_name_filter")) or everything for side in (source, target))
    both = in_both(first, second)
    if both is None:
        return None
    denied = [each for side in (source, target) for each in patterns(_text(side, "deny_topic_name_filter"))]
    only = () if everything[0] in both else expressions(both) or ("",)
    return only, expressions(denied)
