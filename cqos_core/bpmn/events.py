"""Signal events: what throws a signal publishes, what catches one subscribes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.bpmn.document import (
    DEFINITION_REFERENCE,
    EVENT_ROLES,
    SIGNAL_DEFINITION,
    identity,
    nth,
)
from cqos_core.bpmn.names import number, shown
from cqos_core.bpmn.qos import read_qos
from cqos_core.bpmn.qos_namespace import extension_children, word
from cqos_core.model.settings import EVERY_OTHER, Setting

if TYPE_CHECKING:
    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.endpoints import Endpoints
    from cqos_core.bpmn.foreign_attributes import Unknown
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.bpmn.signals import Signals


def read_events(reading: DiagramReading, endpoints: Endpoints, signals: Signals) -> None:
    """Add an endpoint for every signal definition of every event, wherever the event is nested."""
    document = reading.document
    for event in document.nodes:
        if event in document.parts.runs:
            endpoints.add_run(event, signals)
            continue
        role = EVENT_ROLES.get(event.tag)
        if role is None:
            continue
        _report_dangling(reading, event)
        definitions = document.event_definitions(event, SIGNAL_DEFINITION)
        if not definitions:
            continue
        meetings = [
            replace(meeting, lost=(*meeting.lost, *lost)) if (lost := _lost(reading, event, definition)) else meeting
            for definition in definitions
            if (meeting := signals.meeting(event, definition)) is not None
        ]
        endpoints.add(event, role, meetings)


def _report_dangling(reading: DiagramReading, event: Element) -> None:
    for reference in event.having(DEFINITION_REFERENCE):
        name = reference.text
        if reading.document.look_up(reading.document.definitions, name, reference) is None:
            message = f"`eventDefinitionRef` names `{shown(name)}`, which is no event definition in this file"
            place = reading.document.place(reference, f"bpmn:eventDefinitionRef[{nth(reference, event)}]", event)
            reading.note("CQ032", message, place, endpoint=identity(event))


def _lost(reading: DiagramReading, event: Element, definition: Element) -> list[Unknown]:
    """Return the QoS on a signal definition, which is not read there."""
    stated = read_qos(reading, definition, extension_children(definition))
    if profile := word(definition, "profile"):
        stated[EVERY_OTHER] = Setting(profile)
    place = reading.document.place(definition, owner=event)
    stated = {name: Setting(setting.text, place) for name, setting in stated.items() if number(setting.text) != 0}
    cause = "QoS on a signal definition is not read; it belongs on the event around it"
    return [*reading.lost.settings(definition, event), *reading.lost.misplaced(stated, cause)]
