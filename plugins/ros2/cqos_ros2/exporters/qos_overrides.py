"""Writes `qos_overrides` parameters for starting nodes: the QoS that a system states, or only its fixes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.files.yaml_text import Block, Node, Raw, document
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, System
from cqos_core.packs.export import ExportContext, Exported
from cqos_ros2.exporters.values import QOS, NoValueError, Value, kind_of, ros_endpoints, stated
from cqos_ros2.importers.qos_overrides import BY_DEFAULT, OVERRIDES, PARAMETERS
from cqos_ros2.importers.rviz import NODE as RVIZ
from cqos_ros2.names import NOT_BY_PARAMETERS, is_legal
from cqos_ros2.policies import AVOID_CONVENTIONS, LIFESPAN

if TYPE_CHECKING:
    from cqos_core.files.export import ExportEndpoint

_ENTITIES: Final = {PUBLISHER: "publisher", SUBSCRIBER: "subscription"}
_TRANSFORMS: Final = frozenset(("/tf", "/tf_static"))  # tf2's listener lets them be overridden, in RViz as anywhere
_ID: Final = re.compile(r"\w+", re.ASCII)
_Slot: TypeAlias = tuple[str, str, str]
"""Node, topic and entity."""


def write(system: System, context: ExportContext) -> Exported:
    """Write the stated settings of each publisher and subscription, or only those that fix the system."""
    return _Overrides(system, context).write()


class _Overrides:
    """Writes the parameters of one system."""

    def __init__(self, system: System, context: ExportContext) -> None:
        self.system = system
        self.context = context
        self.notes: dict[str, None] = {}

    def write(self) -> Exported:
        """Put the file together."""
        # All endpoints: others have to be distinguished also from those that are not written.
        slots: dict[_Slot, dict[str, dict[str, Node]]] = {}
        for each in ros_endpoints(self.system, self.context, self.notes):
            slot = self._slot(each)
            if slot is not None:
                slots.setdefault(slot, {})[each.id] = self._policies(each)
        nodes: dict[str, dict[str, dict[str, Node]]] = {}
        count = 0
        for (node, topic, entity), by_id in slots.items():
            entities = self._entities(f"{entity} of `{topic}` in `{node}`", entity, by_id)
            if entities:
                nodes.setdefault(node, {}).setdefault(topic, {}).update(entities)
                count += sum(map(bool, by_id.values()))
        return Exported(document(_file(nodes), self._head()) if nodes else "", count, tuple(self.notes))

    def _slot(self, each: ExportEndpoint) -> _Slot | None:
        """Return where the parameters of an endpoint stand; None where it has none."""
        part = each.whole
        if part is None:
            wrong = f" is {kind_of(each)}, and only publishers and subscriptions have `qos_overrides`"
        else:
            address = part.pack.topic_matching.address(part.endpoint.participant, part.participant.texts)
            elsewhere = _elsewhere(address, part.key)
            if elsewhere is not None:
                wrong = f": {elsewhere}, not from parameters"
            elif part.key is None or not is_legal(part.key):
                wrong = f": topic `{part.shown}` has no legal name, so no parameter can name it"
            elif not is_legal(address):
                wrong = f": node `{address}` has no legal name, so no parameter can name it"
            else:
                return address, part.key, _ENTITIES[part.endpoint.role]
        if self.context.wants(each.id):
            self.notes[f"`{each.id}`{wrong}"] = None
        return None

    def _policies(self, each: ExportEndpoint) -> dict[str, Node]:
        """Return the policies to override."""
        part = each.parts[0]
        found: dict[str, Node] = {}
        for policy in QOS:
            if not self.context.wants(each.id, policy.name):
                continue
            try:
                value = stated(part, policy)
            except NoValueError as reason:
                self.notes[f"`{each.id}`: {policy.name} is left out: {reason}"] = None
                continue
            if value is None:
                continue
            if policy is LIFESPAN and part.endpoint.role == SUBSCRIBER:
                self.notes[f"`{each.id}`: subscriptions have no parameter `lifespan`"] = None
                continue
            if self.context.changed is not None and policy.name not in BY_DEFAULT:
                self.notes[
                    f"`{each.id}`: {policy.name} is left out: a program takes it from parameters only where it lists it in "
                    "its QosOverridingOptions, so change the program"
                ] = None
                continue
            found[policy.name] = _value(value)
        if found and self.context.changed is not None and each.endpoint.observed:
            self.notes[f"`{each.id}` was observed as it was: a new snapshot shows whether it was started with this"] = (
                None
            )
        return found

    def _entities(self, where: str, entity: str, by_id: dict[str, dict[str, Node]]) -> dict[str, Node]:
        """Return the parameters of all endpoints of one topic and role in one node, with ids if necessary."""
        different = [
            policies for number, policies in enumerate(by_id.values()) if policies not in [*by_id.values()][:number]
        ]
        if len(different) == 1:
            return {entity: Block(different[0])} if different[0] else {}
        found: dict[str, Node] = {}
        for name, policies in by_id.items():
            if not policies:
                continue
            if not _ID.fullmatch(name):
                self.notes[f"{where}: several differ, and `{name}` is no id that a parameter can name"] = None
                continue
            found[f"{entity}_{name}"] = Block(policies)
            self.notes[f"{where}: several differ; `{name}` has to be the id in its QosOverridingOptions"] = None
        return found

    def _head(self) -> list[str]:
        name = f" of {self.system.name}" if self.system.name else ""
        return [
            f"qos_overrides{name}: start the nodes with `--ros-args --params-file` and this file.",
            "An endpoint takes those policies that the program lists in its QosOverridingOptions:",
            "by default history, depth and reliability. Durations are in nanoseconds.",
        ]


def _elsewhere(address: str, topic: str | None) -> str | None:
    """Return where a node takes the QoS of a topic from, if it declares no parameters for that."""
    if address.rpartition("/")[2] == RVIZ and topic not in _TRANSFORMS:
        return "RViz takes its QoS from its configuration"
    return NOT_BY_PARAMETERS.get(address)


def _value(value: Value) -> Raw:
    if value.word is not None:
        return Raw(value.word)
    if value.policy is AVOID_CONVENTIONS:
        return Raw("true" if value.number else "false")
    return Raw(str(value.number))


def _file(nodes: dict[str, dict[str, dict[str, Node]]]) -> Block:
    found: dict[str, Node] = {}
    for node, topics in nodes.items():
        overrides = Block({topic: Block(entities) for topic, entities in topics.items()})
        found[node] = Block({PARAMETERS: Block({OVERRIDES: overrides})})
    return Block(found)
