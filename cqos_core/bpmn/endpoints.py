"""Endpoints: what an event or a task states, for each topic and each participant that runs its process."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.bpmn.document import identity
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.lost import laid_under
from cqos_core.bpmn.names import fold, shown
from cqos_core.bpmn.plain import NotPlainError
from cqos_core.bpmn.qos import message_type, read_qos
from cqos_core.bpmn.reading import Unique
from cqos_core.bpmn.words import acceptances, extension_children, flag, qos_children, word
from cqos_core.model.dataclass import dataclass
from cqos_core.model.rows import add_rows, as_object
from cqos_core.model.system import EVERY_OTHER, Endpoint, ProfileRef, Room, Setting

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.bpmn.lost import Unknown
    from cqos_core.bpmn.participants import Pools
    from cqos_core.bpmn.plain_endpoints import Kind
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.bpmn.words import Child
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.rows import Row
    from cqos_core.model.system import Participant, Role, Settings


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
        self._elements: dict[str, Element] = {}
        self._used: set[Element] = set()
        self._ids: dict[Element, tuple[str, ...]] = {}
        self._copies: dict[str, list[str]] = {}
        self._kinds: dict[tuple[Kind, str], Kind] = {}

    def has(self, element: Element) -> bool:
        """Say whether endpoints were made of ``element``, or knowingly not made."""
        return element in self._used

    def of(self, element: Element) -> tuple[str, ...]:
        """Return the ids of the endpoints that were made of ``element``."""
        return self._ids.get(element, ())

    def of_run(self, mark: Element) -> Iterator[tuple[str, str, tuple[str, ...]]]:
        """Yield id, tag and ids of the endpoints of each plain event in the place of a ``mark``."""
        for kind, name, *_ in self._reading.document.runs.get(mark, ()):
            yield name, kind.tag, (name, *self._copies.get(name, ()))

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
        self._report_duplicate(element)
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

    def add_run(self, mark: Element, events: list[Row]) -> None:
        """Add endpoints of plain events in the place of a ``mark``, whose topics are still ids of signals.

        Raises:
            NotPlainError: they and the rest of the document have ids in common, or what their participant states is lost.
        """
        self._used.add(mark)
        process = self._reading.document.process_of(mark)
        plain = self._reading.document.plain
        if process is None or plain is None:
            raise NotPlainError
        runners = self._participants.of_process[process]
        if any(runner.lost for runner in runners):
            raise NotPlainError
        self._reading.count_copies(len(events) * (len(runners) - 1), mark)
        first, *others = (runner.id for runner in runners)
        signals, kind_of = plain.signals, {kind: self._kind(kind, first) for kind in {event[0] for event in events}}
        events[:] = [(kind_of[each[0]], each[1], signals[each[2]], *each[3:]) for each in events]
        if not others:
            if not self._unique.take([name for _, name, *_ in events]):
                raise NotPlainError
            add_rows(self._reading.system, events)
            return
        add = self._reading.system.endpoints.append
        for event in map(as_object, events):
            if self._unique(event.id) != event.id:
                raise NotPlainError
            add(event)
            for other in others:
                copy = self._unique(f"{event.id}@{other}")
                self._copies.setdefault(event.id, []).append(copy)
                add(replace(event, id=copy, participant=other))

    def _kind(self, kind: Kind, participant: str) -> Kind:
        """Return the kind of events of a participant."""
        found = self._kinds.get((kind, participant))
        if found is None:
            found = self._kinds[kind, participant] = kind.of(participant)
        return found

    def _add(self, stated: Endpoint, meeting: EventTopic, participant: Participant, *, is_first: bool) -> None:
        wanted = stated.id or f"{participant.id}/{stated.role}/{meeting.topic or '-'}"
        endpoint = replace(
            stated,
            id=self._unique(wanted if is_first or not stated.id else f"{wanted}@{participant.id}"),
            topic=meeting.topic,
            topic_is_guess=meeting.is_guess,
            participant=participant.id,
            settings=laid_under(stated.settings, (*participant.lost, *meeting.lost)),
            needs=dict(stated.needs),
            type=stated.type or meeting.type,
            external=stated.external or meeting.external,
        )
        self._reading.system.endpoints.append(endpoint)

    def _report_duplicate(self, element: Element) -> None:
        name = identity(element)
        if self._reading.document.plain is not None and name is not None and self._unique.is_taken(name):
            raise NotPlainError
        if name is not None and self._elements.setdefault(name, element) is not element:
            message = f"the id `{shown(name)}` is used twice; this endpoint's id gets a number"
            self._reading.note("CQ031", message, self._reading.document.place(element, "@id"))


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
            values = child.required(reading, "name", "value")
            name, value = values or ((child.element.get("name") or "").strip() or EVERY_OTHER, "")
            place = child.place(reading, "value")
            needs[name] = Setting(value, place, unknown="" if value else "a `qos:need` is incomplete", reported="CQ042")
    return needs
