"""Reads lists of topics for ros_gz_bridge (and ros_ign_bridge before it): the ROS 2 side of each bridged topic.

From Gazebo to ROS the bridge publishes, from ROS to Gazebo it subscribes. Without ``qos_profile`` it takes the default
profile with the depth of its queues (ros_gz_bridge: bridge_config).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import did_you_mean, listed, shown
from cqos_core.importers.tree import MappingNode, Node, stated
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, ProfileRef, Role
from cqos_ros2.importers.configuration import Configuration

if TYPE_CHECKING:
    from cqos_core.model.settings import Settings

NODE: Final = "ros_gz_bridge"
_BOTH: Final[tuple[Role, ...]] = (PUBLISHER, SUBSCRIBER)
_DIRECTIONS: Final[dict[str, tuple[Role, ...]]] = {
    "BIDIRECTIONAL": _BOTH,
    "GZ_TO_ROS": (PUBLISHER,),
    "ROS_TO_GZ": (SUBSCRIBER,),
    "IGN_TO_ROS": (PUBLISHER,),
    "ROS_TO_IGN": (SUBSCRIBER,),
}
_PRESETS: Final = {
    "CLOCK": "clock",
    "SENSOR_DATA": "sensor_data",
    "PARAMETERS": "parameters",
    "SERVICES": "services_default",
    "PARAMETER_EVENTS": "parameter_events",
    "ROSOUT": "rosout",
    "SYSTEM_DEFAULT": "system_defaults_cpp",
    "BEST_AVAILABLE": "best_available",
}
_QUEUES: Final[dict[Role, str]] = {PUBLISHER: "publisher_queue", SUBSCRIBER: "subscriber_queue"}
_GZ_TOPICS: Final = ("gz_topic_name", "ign_topic_name")
_GZ_TYPES: Final = ("gz_type_name", "ign_type_name")


class _Reader(Configuration):
    """Reads a list as the endpoints of the node ``ros_gz_bridge``."""

    def run(self) -> None:
        """Read every entry."""
        for entries in self.maps(self.document(), "configuration"):
            self.entry(entries)

    def entry(self, entries: MappingNode) -> None:
        """Add what one entry bridges; report one that the bridge leaves out."""
        if stated(entries, "service_name") is not None:
            self.service(entries)
            return
        topic = self.name(entries)
        direction = self.a_text(entries, "direction") or "BIDIRECTIONAL"
        roles = _DIRECTIONS.get(direction)
        presets = self.presets(entries)
        if topic is None or presets is None:
            return
        if roles is None:
            known = tuple(_DIRECTIONS)[:3]
            message = f"there is no direction {shown(direction)}{did_you_mean(direction, known)}"
            self.out(message, stated(entries, "direction") or entries, f"there are {listed(known, 'and')}")
            return
        type_name = self.a_text(entries, "ros_type_name")
        if not type_name and not any(stated(entries, name) for name in _GZ_TYPES):
            self.out("it says no type of message", entries, "state `ros_type_name` and `gz_type_name`")
            return
        name = self.a_text(entries, topic)
        where = stated(entries, topic) or entries
        if self.is_filled_in(name, where):
            return
        for role in roles:
            settings = self.queue(entries, role, with_preset=bool(presets))
            participant = self.bridge_node(NODE, entries)
            self.system.endpoints.append(
                self.endpoint(participant, role, name, where, settings, profiles=presets, type_name=type_name)
            )

    def out(self, message: str, where: Node, advice: str) -> None:
        """Report why the bridge leaves an entry out."""
        self.note("ROS950", f"ros_gz_bridge leaves this entry out: {message}", where, advice)

    def name(self, entries: MappingNode) -> str | None:
        """Return the key that names the topic in ROS; None where the entry cannot be used."""
        both, ros = stated(entries, "topic_name"), stated(entries, "ros_topic_name")
        gazebo = next((name for name in _GZ_TOPICS if stated(entries, name)), None)
        if both is not None and (ros is not None or gazebo is not None):
            self.out("`topic_name` stands for both sides, and another name beside it", both, "state one or the other")
            return None
        name = "topic_name" if both else "ros_topic_name" if ros else gazebo
        if name is None:
            self.out("it names no topic", entries, "state `ros_topic_name`")
        return name

    def presets(self, entries: MappingNode) -> tuple[ProfileRef, ...] | None:
        """Return the preset of an entry, if it has one; None for an unknown name."""
        node = stated(entries, "qos_profile")
        name = self.a_text(entries, "qos_profile")
        if node is None or not name:
            return ()
        if name not in _PRESETS:
            message = f"there is no `qos_profile` {shown(name)}{did_you_mean(name, _PRESETS)}"
            self.out(message, node, f"there are {listed(_PRESETS, 'and')}")
            return None
        return (ProfileRef(_PRESETS[name], self.place(node)),)

    def queue(self, entries: MappingNode, role: Role, *, with_preset: bool) -> Settings:
        """Read the depth of one side; a negative one is none, and so is 0 beside a profile."""
        node = stated(entries, _QUEUES[role])
        size = self.a_count(entries, _QUEUES[role])
        if node is None or size is None or size < 0 or (with_preset and size == 0):
            return {}
        settings = {"depth": self.setting(node)}
        if with_preset:
            settings["history"] = self.setting(node, "keep_last")
        return settings

    def service(self, entries: MappingNode) -> None:
        """Add a service that Gazebo answers, which the bridge serves in ROS."""
        name = self.a_text(entries, "service_name")
        where = stated(entries, "service_name") or entries
        if self.is_filled_in(name, where):
            return
        participant = self.bridge_node(NODE, entries)
        type_name = self.a_text(entries, "ros_type_name")
        self.system.endpoints.append(
            self.endpoint(participant, SUBSCRIBER, name, where, {}, type_name=type_name, kind="service_server")
        )


read = _Reader.load
