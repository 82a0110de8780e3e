"""Endpoints: what an event or a task states, for each topic and each participant that runs its process."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.bpmn.document import EVENT_ROLES, identity
from cqos_core.bpmn.event_kinds import EventKind
from cqos_core.bpmn.foreign_attributes import laid_under
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.names import fold, shown
from cqos_core.bpmn.qos import message_type, read_qos
from cqos_core.bpmn.qos_namespace import acceptances, extension_children, flag, qos_children, required, word
from cqos_core.bpmn.reading import Unique
from cqos_core.model.dataclass import dataclass
from cqos_core.model.endpoint_rows import add_rows, as_object
from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_core.model.system import Endpoint, ProfileRef, Room

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from typing import Protocol

    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.extensions import Child
    from cqos_core.bpmn.foreign_attributes import Unknown
    from cqos_core.bpmn.parser_target import Shape
    from cqos_core.bpmn.participants import Pools
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.endpoint_rows import Row
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Participant, Role

    class Topics(Protocol):
        """Tells the topics of events by their references to signals."""

        @property
        def lost(self) -> Mapping[str, Mapping[str, Unknown]]:
            """QoS that stands on signals, where nothing reads it: by their names, by policy."""

        def topic(self, reference: str) -> EventTopic:
            """Return where events meet others by a signal."""


@dataclass(frozen=True, slots=True)
class EventTopic:
    """Where an element meets others.

    Attributes:
        topic: the topic's name, None if it is missing or unknown.
        is_guess: the name is the event's own.
        type: the data type as the signal or message states it.
        external: the other side is a black box.
        lost: QoS that stands on the signal, where nothing reads it.
    """

    topic: str | None
    is_guess: bool = False
    type: str | None = None
    external: bool = False
    lost: tuple[Unknown, ...] = ()


class Endpoints:
    """Adds endpoints to the system and knows which elements have become some."""

    def __init__(self, reading: DiagramReading, participants: Pools) -> None:
        """Begin with no endpoints."""
        self._reading = reading
        self._participants = participants
        self._unique = Unique()
        self._elements: dict[str, Element | Row] = {}
        self._made: set[str] = set()  # ids that are none of an element
        self._used: set[Element] = set()
        self._ids: dict[Element, tuple[str, ...]] = {}
        self._ids_of_rows: dict[int, tuple[str, ...]] = {}
        self._endpoints: dict[Shape, Endpoint] = {}
        self._kinds: dict[tuple[Shape, str, str | None], EventKind] = {}

    def has(self, element: Element) -> bool:
        """Say whether endpoints were made of ``element``, or knowingly not made."""
        return element in self._used

    def of(self, element: Element) -> tuple[str, ...]:
        """Return the ids of the endpoints that were made of ``element``."""
        return self._ids.get(element, ())

    def of_run(self, first: Element) -> Iterator[tuple[str, str, tuple[str, ...]]]:
        """Yield id, tag and ids of the endpoints of each event of a run."""
        for kind, name, _, number, *_ in self._reading.document.parts.runs[first]:
            # Only with messages the first one may have been added again; then it is the only one.
            yield name, kind.tag, self._ids.get(first) or self._ids_of_rows.get(number, (name,))

    def add(self, element: Element, role: Role, meetings: Sequence[EventTopic]) -> None:
        """Add an endpoint of ``element`` for each meeting and each participant that runs its process."""
        self._used.add(element)
        meetings = list({meeting.topic: meeting for meeting in meetings}.values())  # one signal twice is one endpoint
        if not meetings:
            return
        process = self._reading.document.process_of(element)
        if process is None:
            message = "this stands outside of every process, so no participant throws or catches it"
            self._reading.note("CQ046", message, self._reading.document.place(element))
            return
        if name := identity(element):
            self._report_duplicate(name, element, self._reading.document.place(element))
        extensions = extension_children(element)
        children = qos_children(self._reading, element, EVENT.elements, extensions)
        stated = _read(self._reading, element, role, extensions)
        runners = self._participants.of_process[process]
        self._reading.count_copies(len(meetings) * (len(runners) - 1), element)
        first = len(self._reading.system.endpoints)
        for meeting in meetings:
            for number, participant in enumerate(runners):
                self._add(stated, meeting, participant, is_first=number == 0)
        ids = self._ids[element] = tuple(endpoint.id for endpoint in self._reading.system.endpoints[first:])
        self._reading.system.accept += [
            replace(found, endpoint=name) for found in acceptances(self._reading, children) for name in ids
        ]

    def add_run(self, first: Element, topics: Topics) -> None:
        """Add endpoints of the events of a run; from now on its rows have kinds and topics."""
        self._used.add(first)
        document = self._reading.document
        process, parts = document.process_of(first), document.parts
        runners = [] if process is None else self._participants.of_process[process]
        rows = parts.runs[first]
        self._reading.count_copies(len(rows) * (len(runners) - 1), first)
        kinds = {shape: self._kind(shape, runners[0], None) for shape in {row[0] for row in rows}}
        for at, (shape, name, signal, *rest) in enumerate(rows):
            topic, kind = parts.signals.get(signal), kinds[shape]
            if topic is None:
                stated = topics.topic(signal)
                topic, kind = stated.topic, self._kind(shape, runners[0], stated.type)
            rows[at] = (kind, name, topic, *rest)
        are_alone = (
            len(runners) == 1 and not runners[0].lost and topics.lost.keys().isdisjoint([row[2] for row in rows])
        )
        if are_alone and self._unique.take([row[1] for row in rows]):
            add_rows(self._reading.system, rows)
            if len(rows) == 1:
                self._elements[rows[0][1]] = first
            return
        for row in rows:
            self._add_row(row, first if len(rows) == 1 else row, runners, topics.lost.get(row[2], {}).values())

    def _add_row(
        self, row: Row, element: Element | Row, runners: Sequence[Participant], lost: Collection[Unknown]
    ) -> None:
        """Add an endpoint of an event that is a row for each participant; what is ``foreign_attributes`` is not its own."""
        name = row[1]
        self._report_duplicate(name, element, self._reading.document.parts.places.place(row))
        stated, ids = as_object(row), []
        for participant in runners:
            is_first = participant is runners[0]
            ids.append(self._new_id(name if is_first else f"{name}@{participant.id}", name))
            settings = laid_under(stated.settings, (*participant.lost, *lost))
            endpoint = replace(stated, id=ids[-1], participant=participant.id, settings=settings)
            self._reading.system.endpoints.append(endpoint)
        self._ids_of_rows[row[3]] = tuple(ids)

    def _kind(self, shape: Shape, participant: Participant, stated_type: str | None) -> EventKind:
        """Return the kind of events of a participant; ``stated_type`` is that of their signals."""
        key = shape, participant.id, stated_type
        found = self._kinds.get(key)
        if found is None:
            tag, endpoint = shape.example.tag, self._endpoints.get(shape)
            if endpoint is None:
                endpoint = self._endpoints[shape] = _read(self._reading, shape.example, EVENT_ROLES[tag], [])
            endpoint = replace(endpoint, participant=participant.id, type=endpoint.type or stated_type)
            found = EventKind(endpoint, shape.settings, tag, self._reading.document.parts.places)
            self._kinds[key] = found
        return found

    def _new_id(self, wanted: str, own: str) -> str:
        """Return an id like the one that is wanted; ``own`` is that of the element."""
        found = self._unique(wanted)
        if found != own:
            self._made.add(found)
        return found

    def _add(self, stated: Endpoint, meeting: EventTopic, participant: Participant, *, is_first: bool) -> None:
        wanted = stated.id or f"{participant.id}/{stated.role}/{meeting.topic or '-'}"
        endpoint = replace(
            stated,
            id=self._new_id(wanted if is_first or not stated.id else f"{wanted}@{participant.id}", stated.id),
            topic=meeting.topic,
            topic_is_guess=meeting.is_guess,
            participant=participant.id,
            settings=laid_under(stated.settings, (*participant.lost, *meeting.lost)),
            needs=dict(stated.needs),
            type=stated.type or meeting.type,
            external=stated.external or meeting.external,
        )
        self._reading.system.endpoints.append(endpoint)

    def _report_duplicate(self, name: str, element: Element | Row, place: Place) -> None:
        is_new = name not in self._elements
        known = self._elements.setdefault(name, element)
        # Of most events that are rows only the id is known, which was not made here.
        if known is not element or (is_new and self._unique.is_taken(name) and name not in self._made):
            message = f"the id `{shown(name)}` is used twice; this endpoint's id gets a number"
            self._reading.note("CQ031", message, replace(place, path="@id"))


def _read(reading: DiagramReading, element: Element, role: Role, extensions: list[Child]) -> Endpoint:
    """Return what ``element`` states as an endpoint that has no topic and no participant yet."""
    place = reading.document.place(element)
    lost = [*reading.lost.children(extensions, EVENT.elements), *reading.lost.settings(element)]
    profile = word(element, "profile")
    profile_place = reading.document.place(element, "@qos:profile")
    return Endpoint(
        id=identity(element) or "",
        role=role,
        topic=None,
        participant="",
        settings=laid_under(read_qos(reading, element, extensions), lost),
        profiles=(ProfileRef(profile, profile_place),) if profile else (),
        needs=_needs(reading, extensions),
        type=message_type(element, extensions),
        dialect="bpmn",
        external=bool(flag(reading, element, "external")),
        protocol=word(element, "protocol"),
        label=fold(element.get("name")) or None,
        place=place,
        room=Room(place) if place.element is not None else None,
    )


def _needs(reading: DiagramReading, extensions: list[Child]) -> Settings:
    """Return what the application requires; what is half written requires something that is not known."""
    needs = {}
    for child in extensions:
        if child.is_word("need"):
            values = required(reading, child, "name", "value")
            name, value = values or ((child.element.get("name") or "").strip() or EVERY_OTHER, "")
            place = child.place(reading.document, "value")
            needs[name] = Setting(value, place, unknown="" if value else "a `qos:need` is incomplete", reported="CQ042")
    return needs
