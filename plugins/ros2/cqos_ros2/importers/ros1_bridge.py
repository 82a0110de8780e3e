"""Reads the parameters of the parameter bridge of ros1_bridge: the ROS 2 side of topics and services that it bridges.

Every topic is bridged both ways. The publisher has what ``qos`` states over keep last 10, or without it the default profile
with the depth of the queue; the subscription always has the sensor data profile with that depth (ros1_bridge:
parameter_bridge, bridge). What the bridge cannot read it ignores, after a line on standard error.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import described, listed, shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, stated
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, ProfileRef
from cqos_core.packs.document_importer import Field, word_field
from cqos_ros2.dialects import RMW_CODES
from cqos_ros2.importers.configuration import Configuration, as_integer

if TYPE_CHECKING:
    from cqos_core.model.settings import Setting, Settings

NODE: Final = "ros_bridge"
_TOPICS: Final = "topics"
# Roles of the bridge: it calls a service of ROS 2 for ROS 1, and serves one of ROS 1 in ROS 2.
_SERVICES: Final = {
    "services_1_to_2": (PUBLISHER, "service_client"),
    "services_2_to_1": (SUBSCRIBER, "service_server"),
}
_QUEUE: Final = "100"
_DEPTH: Final = "10"
_HISTORIES: Final = ("keep_last", "keep_all")
_DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")
_LIVELINESS: Final = ("liveliness_system_default", "liveliness_automatic", "liveliness_manual_by_topic")
_INT32: Final = 2**31


class _Reader(Configuration):
    """Reads a parameter file as the endpoints of the node ``ros_bridge``."""

    def run(self) -> None:
        """Read every entry."""
        root = self.a_map(self.document(), "parameters")
        for name in (_TOPICS, *_SERVICES):
            for entries in self.maps(stated(root, name), name):
                self.entry(name, entries)

    def entry(self, kind: str, entries: MappingNode) -> None:
        """Add what one entry bridges."""
        key = "topic" if kind == _TOPICS else "service"
        name = self.a_text(entries, key)
        where = stated(entries, key)
        if where is None or not name:
            self.problem("CQ010", f"an entry of {shown(kind)} needs `{key}`", entries)
        elif kind == _TOPICS:
            self.topic(name, where, entries)
        else:
            role, endpoint_kind = _SERVICES[kind]
            # What ROS 1 serves has a type of ROS 1, which other packages of ROS 2 may stand for.
            type_name = self.a_text(entries, "type") if endpoint_kind == "service_client" else ""
            participant = self.bridge_node(NODE, entries)
            self.system.endpoints.append(
                self.endpoint(participant, role, name, where, {}, type_name=type_name, kind=endpoint_kind)
            )

    def topic(self, name: str, where: Node, entries: MappingNode) -> None:
        """Add both directions of a topic."""
        participant = self.bridge_node(NODE, entries)
        type_name = self.a_text(entries, "type")
        queue = self.queue(entries)
        qos = stated(entries, "qos")
        settings = {"depth": queue} if qos is None else self.qos(self.a_map(qos, "qos"))
        presets = (ProfileRef("sensor_data", self.place(entries)),)
        self.system.endpoints += (
            self.endpoint(participant, PUBLISHER, name, where, settings, type_name=type_name),
            self.endpoint(
                participant, SUBSCRIBER, name, where, {"depth": queue}, profiles=presets, type_name=type_name
            ),
        )

    def queue(self, entries: MappingNode) -> Setting:
        """Return the depth of the queues; 0 is the default."""
        node = stated(entries, "queue_size")
        size = self.a_count(entries, "queue_size")
        return self.setting(entries, _QUEUE) if node is None or not size else self.setting(node)

    def ignored(self, what: str, instead: str, where: Node, advice: str | None = None) -> None:
        """Report what the bridge ignores, and what it does instead."""
        self.note("ROS951", f"ros1_bridge ignores {what}: {instead}", where, advice)

    def qos(self, entries: MappingNode) -> Settings:
        """Read what the publisher offers."""
        settings: Settings = {"depth": self.setting(entries, _DEPTH)}
        for name, (key, _) in entries.entries.items():
            if name not in _KNOWN:
                self.ignored(f"the key {shown(name)}", "it does not know it", key, f"it knows {listed(_KNOWN, 'and')}")
        self.history(entries, settings)
        return settings | self.policies(entries, _FIELDS, self.none_of)

    def none_of(self, key: str, node: Node, field: Field) -> None:
        """Report a value that the bridge does not know."""
        cause = "no duration" if key in _DURATIONS else "none of its values"
        self.ignored(f"`{key}`", f"{described(node)} is {cause}", node, field.expected)

    def history(self, entries: MappingNode, settings: Settings) -> None:
        """Read history and depth, which has a meaning beside ``keep_last`` only."""
        node, depth = stated(entries, "history"), stated(entries, "depth")
        word = self.a_text(entries, "history")
        size = self.a_count(entries, "depth")
        if node is not None and word not in _HISTORIES:
            self.ignored(
                "`history`", f"{described(node)} is none of its values", node, f"expected {listed(_HISTORIES)}"
            )
        elif node is not None and word == "keep_last" and depth is None:
            self.ignored("`history`", f"keep_last needs a depth, so it keeps {_DEPTH}", node, "state `depth` too")
        elif node is not None:
            settings["history"] = self.setting(node)
            settings.pop("depth")
            if depth is not None and size is not None and word == "keep_last":
                settings["depth"] = self.setting(depth)
        if depth is not None and word != "keep_last":
            instead = f"it is read beside `history: keep_last` only, so {_DEPTH} samples are kept"
            self.ignored("`depth`", instead if word != "keep_all" else "all samples are kept", depth)


def _duration(node: Node) -> str | None:
    """Read ``{secs, nsecs}``. The bridge needs both, and their sum is not negative."""
    entries = node if isinstance(node, MappingNode) else MappingNode(node.line, node.column)
    seconds, nanoseconds = (_int32(stated(entries, name)) for name in ("secs", "nsecs"))
    total = -1 if seconds is None or nanoseconds is None else seconds * 10**9 + nanoseconds
    return None if total < 0 else f"{total}ns"


def _liveliness(node: Node) -> str | None:
    """Read liveliness, as a number of rmw or a word with its prefix."""
    text = node.text if isinstance(node, ScalarNode) else ""
    if as_integer(node) is not None:
        return RMW_CODES["liveliness"].get(text)
    known = text in {*_LIVELINESS, *map(str.upper, _LIVELINESS)}
    return text.lower().removeprefix("liveliness_") if known else None


def _int32(node: Node | None) -> int | None:
    """Return the integer that a node is, as ROS 1 parameters have them."""
    number = None if node is None else as_integer(node)
    return number if number is not None and abs(number) < _INT32 else None


_FIELDS: Final = {
    "reliability": word_field("reliability", "reliable", "best_effort"),
    "durability": word_field("durability", "transient_local", "volatile"),
    **{policy: Field(policy, _duration, "expected {secs: 1, nsecs: 0}") for policy in _DURATIONS},
    "liveliness": Field("liveliness", _liveliness, f"expected {listed(_LIVELINESS)}"),
}
_KNOWN: Final = ("history", "depth", *_FIELDS)
read = _Reader.load
