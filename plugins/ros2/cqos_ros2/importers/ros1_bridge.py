"""Reads the parameters of the parameter bridge of ros1_bridge: the ROS 2 side of topics and services that it bridges.

Every topic is bridged both ways. The publisher has what ``qos`` states over keep last 10, or without it the default profile
with the depth of the queue; the subscription always has the sensor data profile with that depth (ros1_bridge:
parameter_bridge, bridge). What the bridge cannot read it ignores, after a line on standard error.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.forms import described
from cqos_core.importers.reading import collector_paused, listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, ProfileRef
from cqos_ros2.dialects import RMW_CODES
from cqos_ros2.importers.configuration import Configuration, as_integer, stated

if TYPE_CHECKING:
    from cqos_core.importers.source import ReadContext, Source
    from cqos_core.importers.tree import Node
    from cqos_core.model.system import Setting, Settings, System

NODE: Final = "ros_bridge"
_TOPICS: Final = "topics"
# Who calls a service of ROS 2 for ROS 1, and who serves one of ROS 1 in ROS 2.
_SERVICES: Final = {
    "services_1_to_2": (PUBLISHER, "service_client"),
    "services_2_to_1": (SUBSCRIBER, "service_server"),
}
_QUEUE: Final = "100"
_DEPTH: Final = "10"
_WORDS: Final = {"reliability": ("reliable", "best_effort"), "durability": ("transient_local", "volatile")}
_HISTORIES: Final = ("keep_last", "keep_all")
_DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")
_LIVELINESS: Final = ("liveliness_system_default", "liveliness_automatic", "liveliness_manual_by_topic")
_KNOWN: Final = ("history", "depth", *_WORDS, *_DURATIONS, "liveliness")
_INT32: Final = 2**31


def read(source: Source, context: ReadContext) -> System:  # noqa: ARG001 - nothing is included
    """Read a parameter file as the endpoints of the node ``ros_bridge``.

    Raises:
        InputError: it is no YAML, or states topics and services otherwise than as lists of maps.
    """
    reader = _Reader(source)
    with collector_paused():
        root = reader.a_map(reader.document(), "parameters")
        for name in (_TOPICS, *_SERVICES):
            for entries in reader.maps(stated(root, name), name):
                reader.entry(name, entries)
    return reader.finish()


class _Reader(Configuration):
    """Reads the entries of one parameter file."""

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
            participant = self.participant(NODE, entries)
            self.endpoint(participant, role, name, where, {}, type_name=type_name, kind=endpoint_kind)

    def topic(self, name: str, where: Node, entries: MappingNode) -> None:
        """Add both directions of a topic."""
        participant = self.participant(NODE, entries)
        type_name = self.a_text(entries, "type")
        queue = self.queue(entries)
        qos = stated(entries, "qos")
        settings = {"depth": queue} if qos is None else self.qos(self.a_map(qos, "qos"))
        self.endpoint(participant, PUBLISHER, name, where, settings, type_name=type_name)
        presets = (ProfileRef("sensor_data", self.place(entries)),)
        self.endpoint(participant, SUBSCRIBER, name, where, {"depth": queue}, presets=presets, type_name=type_name)

    def queue(self, entries: MappingNode) -> Setting:
        """Return the depth of the queues; 0 is the default."""
        node = stated(entries, "queue_size")
        size = self.a_count(entries, "queue_size")
        return self.setting(entries, _QUEUE) if node is None or not size else self.setting(node)

    def ignored(self, what: str, instead: str, where: Node, advice: str | None = None) -> None:
        """Tell what the bridge ignores, and what it does instead."""
        self.note("ROS951", f"ros1_bridge ignores {what}: {instead}", where, advice)

    def qos(self, entries: MappingNode) -> Settings:
        """Read what the publisher offers."""
        settings: Settings = {"depth": self.setting(entries, _DEPTH)}
        for name, (key, _) in entries.entries.items():
            if name not in _KNOWN:
                self.ignored(f"the key {shown(name)}", "it does not know it", key, f"it knows {listed(_KNOWN, 'and')}")
        self.history(entries, settings)
        for policy, words in _WORDS.items():
            node = stated(entries, policy)
            if isinstance(node, ScalarNode) and node.text in words:
                settings[policy] = self.setting(node)
            elif node is not None:
                self.ignored(
                    f"`{policy}`", f"{described(node)} is none of its values", node, f"expected {listed(words)}"
                )
        for policy in _DURATIONS:
            node = stated(entries, policy)
            duration = None if node is None else self.duration(policy, node)
            if duration is not None:
                settings[policy] = duration
        self.liveliness(entries, settings)
        return settings

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

    def duration(self, policy: str, node: Node) -> Setting | None:
        """Read ``{secs, nsecs}``; the bridge needs both, not negative together."""
        entries = node if isinstance(node, MappingNode) else MappingNode(node.line, node.column)
        seconds, nanoseconds = (_int32(stated(entries, name)) for name in ("secs", "nsecs"))
        total = -1 if seconds is None or nanoseconds is None else seconds * 10**9 + nanoseconds
        if total < 0:
            self.ignored(f"`{policy}`", f"{described(node)} is no duration", node, "expected {secs: 1, nsecs: 0}")
            return None
        return self.setting(node, f"{total}ns")

    def liveliness(self, entries: MappingNode, settings: Settings) -> None:
        """Read liveliness, as a number of rmw or a word with its prefix."""
        node = stated(entries, "liveliness")
        if not isinstance(node, ScalarNode):
            if node is not None:
                self.ignored("`liveliness`", f"{described(node)} is none of its values", node)
            return
        number = as_integer(node)
        word = RMW_CODES["liveliness"].get(node.text) if number is not None else None
        if number is None and node.text in {*_LIVELINESS, *map(str.upper, _LIVELINESS)}:
            word = node.text.lower().removeprefix("liveliness_")
        if word is None:
            advice = f"expected {listed(_LIVELINESS)}"
            self.ignored("`liveliness`", f"{described(node)} is none of its values", node, advice)
        else:
            settings["liveliness"] = self.setting(node, word)


def _int32(node: Node | None) -> int | None:
    """Return the integer that a node is, as ROS 1 parameters have them."""
    number = None if node is None else as_integer(node)
    return number if number is not None and abs(number) < _INT32 else None
