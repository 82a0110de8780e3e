"""Reports statements of a model that C-QoS does not read, so that readers do not take them for checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.bpmn.document import IMPORT, MESSAGE_DEFINITION, MESSAGE_FLOW, SILENT, TASK_ROLES, split
from cqos_core.bpmn.names import POLICIES, key, number, shown
from cqos_core.bpmn.qos_namespace import extension_children, qos_attributes

if TYPE_CHECKING:
    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.endpoints import Endpoints
    from cqos_core.bpmn.reading import DiagramReading

_SWITCH = "to read message flows as topics, set the importer switch `bpmn.message_flows=true`"


def report_unread(reading: DiagramReading, endpoints: Endpoints, *, with_messages: bool) -> None:
    """Report QoS on what is no endpoint, imports, and message flows that are not switched on."""
    document = reading.document
    for element in document.all(IMPORT):
        location = shown(element.get("location") or element.get("namespace") or "another file")
        message = f"the model imports `{location}`, which is not opened"
        advice = "give both files together, then their signals meet"
        reading.note("CQ044", message, document.place(element), advice=advice)
    flows = document.all(MESSAGE_FLOW)
    if flows and not with_messages and not reading.system.endpoints:
        message = f"the model has {len(flows)} message flows but no signal events, so there is nothing to compare"
        reading.note("CQ045", message, document.place(flows[0]), advice=_SWITCH)
    for node in document.nodes:
        if not endpoints.has(node) and _states_qos(node):
            has_message = node.tag in TASK_ROLES or bool(document.event_definitions(node, MESSAGE_DEFINITION))
            advice = _SWITCH if has_message and not with_messages else "give the event a signal, or remove its QoS"
            _report_node(reading, node, advice)
        if not endpoints.has(node):
            reading.lost.settings(node, ours=True)
    for node in document.root.walk():
        if node.tag not in SILENT:
            continue
        reading.lost.settings(node, ours=True)
        if _states_qos(node):
            _report_node(reading, node, "put it on the event that throws or catches the signal, or remove it")
    for cause, (place, help_text) in reading.lost.causes.items():
        reading.note("CQ040", cause, place, advice=help_text, endpoint=place.element)


def _report_node(reading: DiagramReading, node: Element, advice: str) -> None:
    local = split(node.tag)[1]
    message = f"this `{local}` states QoS but neither throws nor catches a signal, so its QoS is not checked"
    reading.note("CQ040", message, reading.document.place(node), advice=advice)


def _states_qos(node: Element) -> bool:
    """Say whether any QoS but zeros, which modelers write unasked, is stated."""
    values = [value for name, value in qos_attributes(node).items() if key(name) in POLICIES]
    for child in extension_children(node):
        if child.prefix == "qos":
            values += [value for name, value in child.element.items() if key(name) in POLICIES]
    return any(number(value) != 0 for value in values)
