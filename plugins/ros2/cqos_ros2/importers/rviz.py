"""Reads configurations of RViz 2: its displays subscribe, its tools publish, and it always listens to transforms.

What a display leaves open is what RViz itself takes: keep last 5, reliable, volatile (rviz_common: qos_profile_property,
ros_topic_display). Displays that are not enabled subscribe to nothing. RViz writes keys twice and empty keys, and reads
the last of them (rviz_common: yaml_config_reader).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import described, listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, is_null, stated
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, ProfileRef, Room
from cqos_ros2.importers.configuration import Configuration, as_integer
from cqos_ros2.importers.editing import RVIZ

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Role

NODE: Final = "rviz2"
MANAGER: Final = "Visualization Manager"
_OURS: Final = "rviz_default_plugins/"
_ROS1: Final = "rviz/"
# As RViz spells them, and no other way; the first is its default.
_POLICIES: Final = {
    "History Policy": ("history", ("Keep Last", "Keep All", "System Default")),
    "Reliability Policy": ("reliability", ("Reliable", "Best Effort", "System Default")),
    "Durability Policy": ("durability", ("Volatile", "Transient Local", "System Default")),
}
# All keys of a topic of RViz 2 (rviz_common: ros_topic_property, qos_profile_property).
_KEYS: Final = (*_POLICIES, "Depth", "Value", "Filter size")
# What the displays and tools that come with RViz subscribe to and publish; a display has one type for all its topics.
_TYPES: Final = {
    "Accel": "geometry_msgs/msg/AccelStamped",
    "Camera": "sensor_msgs/msg/Image",
    "Effort": "sensor_msgs/msg/JointState",
    "FluidPressure": "sensor_msgs/msg/FluidPressure",
    "GridCells": "nav_msgs/msg/GridCells",
    "Illuminance": "sensor_msgs/msg/Illuminance",
    "Image": "sensor_msgs/msg/Image",
    "LaserScan": "sensor_msgs/msg/LaserScan",
    "Map": "nav_msgs/msg/OccupancyGrid",
    "Marker": "visualization_msgs/msg/Marker",
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Odometry": "nav_msgs/msg/Odometry",
    "Path": "nav_msgs/msg/Path",
    "PointCloud": "sensor_msgs/msg/PointCloud",
    "PointCloud2": "sensor_msgs/msg/PointCloud2",
    "PointStamped": "geometry_msgs/msg/PointStamped",
    "Polygon": "geometry_msgs/msg/PolygonStamped",
    "Pose": "geometry_msgs/msg/PoseStamped",
    "PoseArray": "geometry_msgs/msg/PoseArray",
    "PoseWithCovariance": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "Range": "sensor_msgs/msg/Range",
    "RelativeHumidity": "sensor_msgs/msg/RelativeHumidity",
    "RobotModel": "std_msgs/msg/String",
    "Temperature": "sensor_msgs/msg/Temperature",
    "TwistStamped": "geometry_msgs/msg/TwistStamped",
    "Wrench": "geometry_msgs/msg/WrenchStamped",
    "PublishPoint": "geometry_msgs/msg/PointStamped",
    "SetGoal": "geometry_msgs/msg/PoseStamped",
    "SetInitialPose": "geometry_msgs/msg/PoseWithCovarianceStamped",
}
# What the program of a display sets itself (robot_model_display.cpp, Foxy to Rolling). It holds while the keys have their defaults:
# RViz takes the QoS of a file only where a key changes its property (Property::setValue, QosProfileProperty).
_OWN: Final = {"RobotModel": {"durability": "transient_local", "depth": "1"}}
_DEFAULTS: Final = {"history": "Keep Last", "reliability": "Reliable", "durability": "Volatile", "depth": "5"}
# Last parts of topics on which a transport sends images and clouds in a type of its own.
_TRANSPORTS: Final = frozenset(
    ("compressed", "compressedDepth", "theora", "ffmpeg", "zstd", "zlib", "draco", "cloudini")
)
_MAP_UPDATES: Final = "map_msgs/msg/OccupancyGridUpdate"
_TRANSFORMS: Final = (("/tf", "tf_dynamic"), ("/tf_static", "tf_static_listener"))


class _Reader(Configuration):
    """Reads a configuration as the endpoints of the node ``rviz2``."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.disabled: list[ScalarNode] = []

    def run(self) -> None:
        """Read displays and tools."""
        entries = self.a_map(self.document(repeated="last"), "configuration")
        manager = stated(entries, MANAGER)
        if manager is None:
            self.problem("CQ010", f"a configuration of RViz needs `{MANAGER}`", entries)
            return
        manager = self.a_map(manager, MANAGER)
        for node in self.maps(stated(manager, "Displays"), "Displays"):
            self.display(node, enabled=True)
        for node in self.maps(stated(manager, "Tools"), "Tools"):
            self.topics(node, PUBLISHER)
        if self.disabled:
            what = "display that is" if len(self.disabled) == 1 else "displays that are"
            message = f"{len(self.disabled)} {what} not enabled: {listed(self.names(), 'and')}"
            self.note("ROS940", message, self.disabled[0], "set `Enabled: true` to have them checked")
        if all(said.code != "ROS941" for said in self.notes):
            self.transforms(manager)

    def names(self) -> list[str]:
        """The names of displays that are not enabled, a few of them."""
        names = [shown(node.text) for node in self.disabled]
        most = 5
        return names if len(names) <= most else [*names[:most], f"{len(names) - most} more"]

    def display(self, node: MappingNode, *, enabled: bool) -> None:
        """Read a display; a group has displays of its own, which are as enabled as it is."""
        enabled = self.a_flag(node, "Enabled", otherwise=True) and enabled
        for inner in self.maps(stated(node, "Displays"), "Displays"):
            self.display(inner, enabled=enabled)
        if enabled:
            self.topics(node, SUBSCRIBER)
        elif any(self.topic(value) for _, value in _topics(node)):
            self.disabled.append(_named(node))

    # Topics

    def topics(self, node: MappingNode, role: Role) -> None:
        """Read the topics of an enabled display, or of a tool."""
        plugin = self.a_text(node, "Class")
        if plugin.startswith(_ROS1):
            message = f"{shown(plugin)} is a class of ROS 1, which RViz 2 does not have"
            self.note("ROS941", message, node, f"for instance `{_OURS}{plugin.removeprefix(_ROS1)}`")
            return
        for key, value in _topics(node):
            name = self.topic(value)
            if name is None or (key.text == "Description Topic" and self.a_text(node, "Description Source") == "File"):
                continue
            if self.is_filled_in(name.text, name):
                continue
            if isinstance(value, ScalarNode) and not plugin.startswith(_OURS):
                self.note("ROS944", f"what {shown(plugin)} requests on {shown(name.text)} is not in this file", name)
            else:
                self.add(node, key, value, name, role)

    def topic(self, value: Node) -> ScalarNode | None:
        """Return the node that names a topic; None where none is named."""
        name = stated(value, "Value") if isinstance(value, MappingNode) else value
        return name if isinstance(name, ScalarNode) and name.text and not is_null(name) else None

    def add(self, node: MappingNode, key: ScalarNode, value: Node, name: ScalarNode, role: Role) -> None:
        """Add the endpoint of one topic."""
        settings = self.qos(value) if isinstance(value, MappingNode) else {}
        if isinstance(value, ScalarNode) and self.a_flag(node, "Unreliable", otherwise=False):
            settings["reliability"] = Setting("best_effort", self.place(value), derived=True)
        settings.setdefault("depth", Setting(_DEFAULTS["depth"], self.place(value), derived=True))
        plugin = self.a_text(node, "Class").removeprefix(_OURS)
        own = plugin in _OWN and all(_DEFAULTS.get(policy) == each.text for policy, each in settings.items())
        if own:  # a change of any key would put the values of all keys in their place, so none can be edited alone
            texts = {policy: each.text for policy, each in settings.items()} | _OWN[plugin]
            settings = {policy: Setting(text, self.place(value), derived=True) for policy, text in texts.items()}
        # A display of maps always has this topic, but few map servers send updates.
        updates = key.text == "Update Topic"
        type_name = _MAP_UPDATES if updates else _TYPES.get(plugin, "")
        if name.text.rpartition("/")[2] in _TRANSPORTS:
            type_name = ""
        made = self.endpoint(
            self.participant(NODE, node),
            role,
            name.text,
            name,
            settings,
            type_name=type_name,
            label=self.a_text(node, "Name") or plugin or None,
            external=updates,
        )
        if isinstance(value, MappingNode) and not own:
            made.room = Room(self.place(key), tuple(RVIZ), restated=True)
        self.system.endpoints.append(made)

    def qos(self, entries: MappingNode) -> Settings:
        """Read the policies of a topic."""
        settings: Settings = {}
        for name, (policy, words) in _POLICIES.items():
            node = stated(entries, name)
            if isinstance(node, ScalarNode) and node.text in words:
                settings[policy] = self.setting(node)
            elif node is not None:
                message = f"{described(node)} is no {name.lower()} that RViz knows, so it takes {words[0]}"
                self.note("ROS942", message, node, f"it knows {listed(words, 'and')}")
        depth = stated(entries, "Depth")
        if depth is not None:
            if as_integer(depth) is None:
                self.note("ROS942", f"the depth is no whole number, so RViz takes {_DEFAULTS['depth']}", depth)
            else:
                settings["depth"] = self.setting(depth)
        self.misspelt(entries, _KEYS, cause="RViz reads no key", effect="it takes its default")
        return settings

    def transforms(self, manager: MappingNode) -> None:
        """Add what RViz listens to whatever it shows."""
        participant = self.participant(NODE, manager)
        self.system.endpoints += [
            self.endpoint(
                participant,
                SUBSCRIBER,
                topic,
                manager,
                {},
                profiles=(ProfileRef(preset, self.place(manager)),),
                type_name="tf2_msgs/msg/TFMessage",
                label="transform listener",
                external=True,
            )
            for topic, preset in _TRANSFORMS
        ]


def _topics(node: MappingNode) -> Iterator[tuple[ScalarNode, Node]]:
    """Yield what may name topics: ``Topic``, ``Description Topic``, ``Update Topic`` and the like."""
    for name, (key, value) in node.entries.items():
        if name == "Topic" or name.endswith(" Topic"):
            yield key, value


def _named(node: MappingNode) -> ScalarNode:
    """What a display is called: its name or class, else its first key that may name a topic."""
    names = [stated(node, "Name"), stated(node, "Class"), *(key for key, _ in _topics(node))]
    return next(name for name in names if isinstance(name, ScalarNode) and name.text)


read = _Reader.load
