"""Writes a BPMN document in the form of FaMe modeler: QoS as `qos:policy` in integers, the topic as the event's name."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.names import POLICY_NAMES, fold
from cqos_core.files.bpmn_qos_writer import DIALECT, diagram_of, restate
from cqos_core.files.export import endpoints_of_pack
from cqos_core.model.system import PUBLISHER
from cqos_core.packs import ENDPOINT
from cqos_core.packs.export import Exported
from cqos_core.resolving.dialect_spelling import dialect_text
from cqos_ros2.exporters.values import PROTOCOL, NoValueError, effective
from cqos_ros2.names import is_legal

if TYPE_CHECKING:
    from cqos_core.bpmn.rewriting import Diagram, Tag
    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved

_A_CODE: Final = "0"  # words in its manner are integers; FaMe also writes it for a number that is not set


def write(system: System, context: ExportContext) -> Exported:
    """Return the document with all eight policies of each event as FaMe reads them, defaults included."""
    others: dict[str, None] = {}
    endpoints = list(endpoints_of_pack(PROTOCOL, system, context, others))
    found, notes = diagram_of(system, endpoints)
    if found is None:
        return Exported("", 0, (*others, *notes))
    diagram, elements = found
    names: dict[str, str] = {}
    silent: list[str] = []
    count = 0
    for element, group in elements.items():
        tag, part = diagram.find(element), group[0].whole
        if tag is None or part is None or not (topic := _topic(part)):
            notes[f"`{element}` has no id or no legal topic of its own, so it stays as it is"] = None
            continue
        if len(group) > 1:
            notes[f"`{element}` is {len(group)} endpoints, and FaMe reads the first"] = None
        names[fold(part.endpoint.topic)] = topic
        _write_event(diagram, tag, part, topic, notes)
        count += 1
        if part.role == PUBLISHER and not _has(diagram, _extensions(diagram, tag), "payload"):
            silent.append(f"`{element}`")
    for tag in diagram.root.children:
        topic = names.get(fold(tag.attributes["name"].text)) if "name" in tag.attributes else None
        if topic is not None and diagram.is_a(tag, "bpmn", "signal"):
            diagram.state(tag, {"name": topic})
    if silent:
        notes[f"FaMe reads an event without `ros:payload` as a catch: add the payload of {', '.join(silent)} there"] = (
            None
        )
    return Exported(diagram.changed(), count, (*others, *notes))


def _extensions(diagram: Diagram, tag: Tag) -> Tag | None:
    return next(iter(diagram.children(tag, "bpmn", "extensionElements")), None)


def _has(diagram: Diagram, extension: Tag | None, name: str) -> bool:
    return extension is not None and bool(diagram.children(extension, "ros", name))


def _topic(part: Resolved) -> str | None:
    """Return the name before which FaMe puts a slash; None where ROS 2 has no such name."""
    return part.key[1:] if part.key and part.key.startswith("/") and is_legal(part.key) else None


def _write_event(diagram: Diagram, tag: Tag, part: Resolved, topic: str, notes: dict[str, None]) -> None:
    pack = part.pack
    dialect = pack.dialects[DIALECT]
    indices = [pack.find(ENDPOINT, name, dialect) for name in POLICY_NAMES]
    restate(diagram, tag, pack, dialect, {index: None for index in indices if index is not None})
    diagram.state(tag, {"name": topic})
    codes = {}
    for name, index in zip(POLICY_NAMES, indices, strict=True):
        code = _code(part, index, notes)
        if code is not None:
            codes[name] = code
    written = "".join(f' {name}="{code}"' for name, code in codes.items())
    text = f"<{diagram.prefix('qos')}:policy{written}/>"
    extension = _extensions(diagram, tag)
    if part.endpoint.type and not _has(diagram, extension, "message"):
        text += f'<{diagram.prefix("ros")}:message type="{escape(part.endpoint.type)}"/>'
    _extend(diagram, tag, extension, text)


def _code(part: Resolved, index: int | None, notes: dict[str, None]) -> str | None:
    """Return the integer of a policy's value; None, and a note, where the form has none."""
    pack = part.pack
    policy = pack.policies[index or 0]
    try:
        value = effective(part, policy)
    except NoValueError as reason:
        notes[f"`{part.id}`: {policy.name} is left out: {reason}"] = None
        return None
    if value.word is None:
        text = dialect_text(policy, value.number, pack.dialects[DIALECT], _A_CODE)
        return text if text is not None and text.replace(".", "").isdigit() else _A_CODE
    codes = pack.dialects[DIALECT].codes.get(policy.name, {})
    code = next((code for code, word in codes.items() if word == value.word), None)
    if code is None:
        notes[f"`{part.id}`: {policy.name} is left out: FaMe has no code for {value.word}"] = None
    return code


def _extend(diagram: Diagram, tag: Tag, extension: Tag | None, text: str) -> None:
    """Put a text among the extensions of an element; where it has none yet, behind its documentation."""
    if extension is not None:
        diagram.add(extension, text)
        return
    prefix = tag.name.rpartition(":")[0]
    name = f"{prefix}:extensionElements" if prefix else "extensionElements"
    documents = diagram.children(tag, "bpmn", "documentation")
    diagram.add(tag, f"<{name}>{text}</{name}>", documents[-1] if documents else None)
