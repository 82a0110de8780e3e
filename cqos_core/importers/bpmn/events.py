"""Signal events: what throws a signal publishes, what catches one subscribes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.importers.bpmn.document import (
    DEFINITION_REFERENCE,
    EVENT_ROLES,
    SIGNAL_DEFINITION,
    identity,
    look_up,
    nth,
)
from cqos_core.importers.bpmn.names import shown
from cqos_core.importers.bpmn.words import extension_children, qos_attributes

if TYPE_CHECKING:
    from cqos_core.importers.bpmn.endpoints import Endpoints
    from cqos_core.importers.bpmn.reading import Reading
    from cqos_core.importers.bpmn.signals import Signals
    from cqos_core.importers.xml_source import Element


def read_events(reading: Reading, endpoints: Endpoints, signals: Signals) -> None:
    """Add an endpoint for every signal definition of every event, wherever the event is nested."""
    document = reading.document
    for event in document.nodes:
        role = EVENT_ROLES.get(str(event.tag))
        if role is None:
            continue
        _report_dangling(reading, event)
        definitions = document.event_definitions(event, SIGNAL_DEFINITION)
        if not definitions:
            continue
        for definition in definitions:
            _report_misplaced(reading, event, definition)
        meetings = [signals.meeting(event, definition) for definition in definitions]
        endpoints.add(event, role, [meeting for meeting in meetings if meeting is not None])


def _report_dangling(reading: Reading, event: Element) -> None:
    for reference in event.iterchildren(DEFINITION_REFERENCE):
        name = reference.text or ""
        if look_up(reading.document.definitions, name) is None:
            message = f"`eventDefinitionRef` names `{shown(name)}`, which is no event definition in this file"
            place = reading.document.place(reference, f"bpmn:eventDefinitionRef[{nth(reference)}]", event)
            reading.note("CQ032", message, place, endpoint=identity(event))


def _report_misplaced(reading: Reading, event: Element, definition: Element) -> None:
    words = [*qos_attributes(definition), *(c.word for c in extension_children(definition) if c.prefix == "qos")]
    stated = ", ".join(f"`qos:{shown(name)}`" for name in words)
    if stated:
        message = f"{stated} on the signal definition is not read; QoS belongs on the event around it"
        reading.note("CQ040", message, reading.document.place(definition, owner=event), endpoint=identity(event))
