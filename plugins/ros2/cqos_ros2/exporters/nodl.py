"""Writes NoDL documents, version 2: one for each node, with the QoS of each topic (ros-tooling/nodl 0.3.1, nodl_schema)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.yaml_text import Block, Raw, document, scalar
from cqos_core.packs import INFINITE
from cqos_core.packs.export import Exported
from cqos_ros2.exporters.values import DURATIONS, NoValueError, effective, ros_endpoints
from cqos_ros2.importers.nodl import FIELDS, SECTIONS, VERSION
from cqos_ros2.policies import DEADLINE, DEPTH, DURABILITY, HISTORY, LEASE, LIFESPAN, LIVELINESS, RELIABILITY
from cqos_ros2.types import full_type_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.files.export import ExportEndpoint
    from cqos_core.files.yaml_text import Node
    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved

_KEYS: Final = {field.policy: key for key, field in FIELDS.items()}
_SECTION: Final = {place: name for name, place in SECTIONS.items()}
_FAMILIES: Final = {"message": "msg", "service_server": "srv", "service_client": "srv"}


def write(system: System, context: ExportContext) -> Exported:
    """Write a document for each node; name what the form cannot express."""
    notes: dict[str, None] = {}
    nodes: dict[str, dict[str, list[Node]]] = {}
    count = 0
    for each in ros_endpoints(system, context, notes):
        if not context.wants(each.id):
            continue
        entry = _entry(each, notes)
        if entry is not None:
            endpoint = each.endpoint
            section = _SECTION[endpoint.kind, endpoint.role]
            nodes.setdefault(endpoint.participant or "", {}).setdefault(section, []).append(entry)
            count += 1
    if len(nodes) > 1:
        notes["a NoDL document describes one node: put each of these into a file of its own"] = None
    return Exported("---\n".join(_documents(nodes)), count, tuple(notes))


def _documents(nodes: dict[str, dict[str, list[Node]]]) -> Iterator[str]:
    for name, sections in nodes.items():
        ordered: dict[str, Node] = {section: sections[section] for section in SECTIONS if section in sections}
        yield document(Block({"nodl_version": Raw(str(VERSION)), **ordered}), [f"{name}.nodl.yaml"])


def _entry(each: ExportEndpoint, notes: dict[str, None]) -> Node | None:
    """Return an entry; None, and a note, for an endpoint that the form cannot state."""
    endpoint = each.endpoint
    if not endpoint.topic or not endpoint.type:
        notes[f"`{each.id}` is left out: NoDL needs its {'type' if endpoint.topic else 'name'}"] = None
        return None
    family = _FAMILIES.get(endpoint.kind, "action")
    found: dict[str, Node] = {
        "name": scalar(endpoint.topic),
        "type": scalar(full_type_name(endpoint.type, family)),
    }
    if each.whole is not None:
        profile = _profile(each.whole, notes)
        if profile is None:
            return None
        found["qos"] = profile
    elif endpoint.settings:
        notes[f"`{each.id}`: its QoS is left out"] = None
    return found


def _profile(part: Resolved, notes: dict[str, None]) -> dict[str, Node] | None:
    found: dict[str, Node] = {}
    for policy in (HISTORY, DEPTH, RELIABILITY, DURABILITY, DEADLINE, LIFESPAN, LIVELINESS, LEASE):
        try:
            value = effective(part, policy)
        except NoValueError as reason:
            if policy in {HISTORY, RELIABILITY}:
                notes[f"`{part.id}` is left out: its {policy.name} cannot be stated: {reason}"] = None
                return None
            notes[f"`{part.id}`: {policy.name} is left out: {reason}"] = None
            continue
        if policy.name in DURATIONS:
            if 0 < value.number < INFINITE - 1:
                found[_KEYS[policy.name]] = Raw(str(value.number))
        elif policy is DEPTH:
            if value.number and found.get("history") == Raw("KEEP_LAST"):
                found[_KEYS[policy.name]] = Raw(str(value.number))
        elif value.word is not None:
            found[_KEYS[policy.name]] = Raw(value.word.upper())
    if found["history"] == Raw("KEEP_LAST") and "depth" not in found:
        found["history"] = Raw("SYSTEM_DEFAULT")  # a depth of 0 stands for that of the middleware
    return found
