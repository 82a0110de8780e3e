"""Message flows read as topics, for those who switch it on.

By the BPMN standard a message flow runs between two points. Reading its message as a topic, on which every sender meets
every receiver, is a convention.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.bpmn.document import (
    BPMN,
    ITEM_DEFINITION,
    MESSAGE,
    MESSAGE_DEFINITION,
    MESSAGE_FLOW,
    PARTICIPANT,
    ROLES,
    TASK_ROLES,
    identity,
)
from cqos_core.bpmn.endpoints import EventTopic
from cqos_core.bpmn.names import fold, is_computed, shown
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.endpoints import Endpoints
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.system import Role

_ENDS: tuple[tuple[Role, str], ...] = ((PUBLISHER, "sourceRef"), (SUBSCRIBER, "targetRef"))


def read_messages(reading: DiagramReading, endpoints: Endpoints) -> None:
    """Add a publisher for what sends and a subscriber for what receives a message."""
    meetings: dict[tuple[Element, Role], dict[str | None, EventTopic]] = {}
    for node, role, meeting in (*_of_flows(reading), *_of_nodes(reading)):
        known = meetings.setdefault((node, role), {})
        # A flow says more than the node alone: a black box on its other side.
        known.setdefault(meeting.topic, meeting)
    for (node, role), found in meetings.items():
        endpoints.add(node, role, list(found.values()))


def _of_flows(reading: DiagramReading) -> Iterator[tuple[Element, Role, EventTopic]]:
    flows = reading.document.all(MESSAGE_FLOW)
    nodes = _nodes(reading, flows)
    for flow in flows:
        ends = {role: reading.document.look_up(nodes, flow.get(attribute) or "", flow) for role, attribute in _ENDS}
        for role, attribute in _ENDS:
            if ends[role] is None:
                message = f"`{attribute}` names `{shown(flow.get(attribute) or '')}`, which is not in this file"
                reading.note("CQ032", message, reading.document.place(flow))
        meeting = _meeting_of_flow(reading, flow, [end for end in ends.values() if end is not None])
        for role, end in ends.items():
            if end is not None and end.tag != PARTICIPANT:
                yield end, role, meeting


def _nodes(reading: DiagramReading, flows: list[Element]) -> dict[str, Element]:
    """Return everything that a flow may begin or end at, by id."""
    wanted = _ends_of(flows)
    nodes: dict[str, Element] = {}
    for element in reading.document.root.walk() if wanted else ():
        name = identity(element) if element.tag.startswith(BPMN) else None
        if name in wanted:
            nodes.setdefault(name, element)
    return nodes


def _ends_of(flows: list[Element]) -> set[str]:
    """Return the ids that flows name, with and without what may be a prefix."""
    references = {(flow.get(attribute) or "").strip() for flow in flows for _, attribute in _ENDS}
    return references | {reference.rpartition(":")[2] for reference in references}


def _meeting_of_flow(reading: DiagramReading, flow: Element, ends: list[Element]) -> EventTopic:
    """Return the flow's topic: its message, the message of one of its ends, its own name, its id."""
    external = any(end.tag == PARTICIPANT for end in ends) or len(ends) < len(_ENDS)
    messages = (_message(reading, element) for element in (flow, *ends))
    message = next((found for found in messages if found is not None), None)
    name = fold(message.get("name")) if message is not None else ""
    name = name or fold(flow.get("name")) or identity(flow) or ""
    return EventTopic(_fixed(reading, flow, name), type=_type(reading, message), external=external)


def _of_nodes(reading: DiagramReading) -> Iterator[tuple[Element, Role, EventTopic]]:
    """Yield what sends and receives a message that it names itself, with or without a flow."""
    connected = _ends_of(reading.document.all(MESSAGE_FLOW))
    for node in reading.document.nodes:
        is_message_event = bool(reading.document.event_definitions(node, MESSAGE_DEFINITION))
        if identity(node) in connected or not (is_message_event or node.tag in TASK_ROLES):
            continue
        message = _message(reading, node)
        name = fold(message.get("name")) if message is not None else ""
        if name:
            yield (
                node,
                ROLES[node.tag],
                EventTopic(_fixed(reading, node, name), type=_type(reading, message)),
            )
        else:
            text = "no message flow and no message with a name leads here, so there is no topic and nothing is paired"
            reading.note("CQ049", text, reading.document.place(node), endpoint=identity(node))


def _message(reading: DiagramReading, element: Element) -> Element | None:
    """Return the message that a flow or task refers to itself, and an event by its definition."""
    holders = (element, *reading.document.event_definitions(element, MESSAGE_DEFINITION))
    found = (reading.document.find(MESSAGE, holder.get("messageRef") or "", holder) for holder in holders)
    return next((message for message in found if message is not None), None)


def _fixed(reading: DiagramReading, element: Element, name: str) -> str | None:
    """Return ``name`` unless only the engine can compute it."""
    if name and is_computed(name):
        message = f"the topic `{shown(name)}` is known at run time only, so nothing is paired on it"
        reading.note("CQ036", message, reading.document.place(element))
        return None
    return name or None


def _type(reading: DiagramReading, message: Element | None) -> str | None:
    if message is None:
        return None
    definition = reading.document.find(ITEM_DEFINITION, message.get("itemRef") or "", message)
    return None if definition is None else (definition.get("structureRef") or "").strip() or None
