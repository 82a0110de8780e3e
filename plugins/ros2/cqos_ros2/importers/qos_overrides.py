"""Reads ``qos_overrides`` among the parameters of ROS 2 nodes, as overlays over what the nodes state themselves.

A parameter is ``qos_overrides.<full topic>.<publisher|subscription>[_<id>].<policy>``, its parts nested as maps or joined
with dots. The importer reports parameters without effect, with the reason (rclcpp: qos_parameters.hpp, parameter_map.cpp).
"""

from __future__ import annotations

import glob
from collections.abc import Iterator
from typing import Final, NamedTuple

from cqos_core.importers.source_reading import described, did_you_mean, listed, shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, is_null
from cqos_core.model.settings import Place, Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Overlay, Role, Room
from cqos_core.packs.document_importer import Field, word_field
from cqos_ros2.importers.configuration import Configuration, as_count, as_flag
from cqos_ros2.names import NOT_BY_PARAMETERS

PARAMETERS: Final = "ros__parameters"
OVERRIDES: Final = "qos_overrides"
_FORM: Final = "qos_overrides.<full topic>.<publisher|subscription>[_<id>].<policy>"
_ROLES: Final[dict[str, Role]] = {"publisher": PUBLISHER, "subscription": SUBSCRIBER}
_DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")


def _flag(node: Node) -> str | None:
    value = as_flag(node)
    return None if value is None else str(value).lower()


_FIELDS: Final = {
    field.policy: field
    for field in (
        word_field("history", "keep_last", "keep_all", "system_default"),
        word_field("reliability", "reliable", "best_effort", "system_default", "best_available"),
        word_field("durability", "volatile", "transient_local", "system_default", "best_available"),
        word_field("liveliness", "automatic", "manual_by_topic", "system_default", "best_available", "manual_by_node"),
        Field("depth", as_count, "expected a whole number"),
        *(Field(name, as_count, "expected whole nanoseconds") for name in _DURATIONS),
        Field("avoid_ros_namespace_conventions", _flag, "expected true or false"),
    )
}
BY_DEFAULT: Final = frozenset(("history", "depth", "reliability"))
"""What a program takes from parameters where it lists nothing (rclcpp, QosOverridingOptions::with_default_policies)."""
_EVENTS: Final = "/parameter_events"


class _Parameter(NamedTuple):
    """A parameter below ``qos_overrides``: its name from there on, the key nearest to the value, and the value."""

    name: str
    key: ScalarNode
    value: Node


class _Entity(NamedTuple):
    """Whose policies are overridden: patterns of nodes, and the parts of a parameter's name."""

    node: str
    topic: str
    role: Role
    id: str | None


class _Reader(Configuration):
    """Finds the overrides of all nodes in a parameter file; other parameters are passed over."""

    def run(self) -> None:
        """Read all nodes."""
        self.nodes(self.a_map(self.document(repeated="merge"), "parameters"), "")
        # Where an endpoint has an id, what is meant for it alone is nearer than what is meant for all.
        self.system.overlays.sort(key=lambda overlay: overlay.entity is not None)

    def nodes(self, entries: MappingNode, above: str) -> None:
        """Read the nodes of a namespace; what is written later in the file wins."""
        for name, (key, value) in entries.entries.items():
            if name == PARAMETERS:
                self.parameters(self.a_map(value, name), above or "/**")
            elif name.partition(".")[0] == OVERRIDES:
                message = f"{shown(name)} stands outside of `{PARAMETERS}`"
                advice = f"write `NODE: {{{PARAMETERS}: {{{OVERRIDES}: …}}}}`, or `/**` for all nodes"
                self.note("ROS933", message, key, advice)
            elif isinstance(value, MappingNode):
                self.nodes(value, f"{above}/{name.strip('/')}")

    def parameters(self, entries: MappingNode, node: str) -> None:
        """Read the overrides of one node, or of those that a pattern covers."""
        found: dict[_Entity, Settings] = {}
        keys: dict[_Entity, ScalarNode] = {}
        for parameter in _overrides(entries):
            target = self.entity(parameter, node)
            if target is None:
                continue
            entity, policy = target
            setting = self.value(parameter, policy)
            if setting is not None:
                found.setdefault(entity, {})[policy] = setting
                keys.setdefault(entity, parameter.key)
        for entity, settings in found.items():
            self.opt_in(entity, settings)
            self.system.overlays.append(
                Overlay(
                    OVERRIDES,
                    settings,
                    entity.role,
                    glob.escape(entity.topic),
                    entity.node,
                    entity.id,
                    "ros2",
                    dialect="parameters",
                    place=self.place(keys[entity]),
                    room=Room(self.place(keys[entity]), tuple(sorted(BY_DEFAULT))),
                )
            )

    def entity(self, parameter: _Parameter, node: str) -> tuple[_Entity, str] | None:
        """Take a parameter's name apart; report why no node declares it."""
        topic, _, rest = parameter.name.partition(".")
        side, dot, policy = rest.rpartition(".")
        kind, _, identifier = side.partition("_")
        wrong, advice = None, f"the form is `{_FORM}`"
        if node in NOT_BY_PARAMETERS:
            wrong = f"the node `{node}` declares no such parameters"
            advice = NOT_BY_PARAMETERS[node]
        elif not dot or not topic:
            wrong = "it names no policy of a publisher or subscription"
            if topic and rest in _FIELDS:
                advice = f"write `{OVERRIDES}.{topic}.publisher.{rest}` or `{OVERRIDES}.{topic}.subscription.{rest}`"
        elif not topic.startswith("/"):
            wrong = f"{shown(topic)} is no full topic name"
            advice = f"write `/{topic}`, with its namespace if it has one"
        elif kind not in _ROLES:
            wrong = f"{shown(side)} is neither `publisher` nor `subscription`"
            advice = "subscribers are called `subscription` here" if kind.startswith("subscr") else advice
        elif policy not in _FIELDS:
            wrong = f"there is no policy {shown(policy)}{did_you_mean(policy, _FIELDS)}"
            advice = f"there are {listed(_FIELDS, 'and')}"
        elif policy == "lifespan" and kind == "subscription":
            wrong = "a subscription has no parameter `lifespan`"
            advice = "samples expire at the publisher: set it there"
        if wrong is not None:
            self.note("ROS930", f"`{OVERRIDES}.{parameter.name}` has no effect: {wrong}", parameter.key, advice)
            return None
        return _Entity(node, topic, _ROLES[kind], identifier or None), policy

    def value(self, parameter: _Parameter, policy: str) -> Setting | None:
        """Return a value as text with its unit; report one that the node refuses."""
        node, field = parameter.value, _FIELDS[policy]
        text = field.take(node)
        if text is None:
            message = f"`{OVERRIDES}.{parameter.name}` is {described(node)}, with which the node ends with an error"
            self.note("ROS931", message, node, field.expected)
            return None
        return self.setting(node, text)

    def opt_in(self, entity: _Entity, settings: Settings) -> None:
        """Report policies that no parameter overrides by default."""
        allowed = BY_DEFAULT | {"durability"} if entity.topic == _EVENTS else BY_DEFAULT
        further = [policy for policy in settings if policy not in allowed]
        if further:
            names = listed((f"`{policy}`" for policy in further), "and")
            message = (
                f"the override of {names} on `{entity.topic}` takes effect only if the node allows it; by default a node "
                "that allows overrides allows those of history, depth and reliability"
            )
            advice = "name the policies in the node's `QosOverridingOptions`"
            self.note("ROS932", message, settings[further[0]].place or Place(self.source.name), advice)


def _overrides(entries: MappingNode) -> Iterator[_Parameter]:
    """Yield the parameters below ``qos_overrides``, however their names are written."""
    for name, (key, value) in entries.entries.items():
        first, _, rest = name.partition(".")
        if first == OVERRIDES and (rest or not is_null(value)):
            yield from _leaves(rest, key, value)


def _leaves(name: str, key: ScalarNode, value: Node) -> Iterator[_Parameter]:
    if not isinstance(value, MappingNode):
        yield _Parameter(name, key, value)
        return
    for part, (inner, below) in value.entries.items():
        yield from _leaves(f"{name}.{part}" if name else part, inner, below)


read = _Reader.load
