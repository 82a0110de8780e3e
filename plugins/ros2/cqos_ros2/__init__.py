"""The ROS 2 rule pack of C-QoS. Here are only the hooks; everything else is imported when a check needs it."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import ExporterInfo, ImporterInfo, RulePackInfo, hookimpl


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """Register ``ros2``."""
    summary = "ROS 2 topics, services and actions, Foxy to Rolling"
    register(RulePackInfo("ros2", summary, "cqos_ros2.pack:PACK", default_for=("bpmn",)))


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """Register the files that ROS 2 people have."""
    for detect, importers in (("detect_observed", _OBSERVED), ("detect_config", _CONFIGURED)):
        for name, summary, suffixes, module in importers:
            claim = f"cqos_ros2.importers.{detect}:claims_{name}"
            over = "ros2" if name in {"fastdds", "cyclonedds"} else ""
            reader = f"cqos_ros2.importers.{module}:read"
            declines, inserter = _DECLINED.get(name, ""), _INSERTERS.get(name, "")
            register(ImporterInfo(name, summary, suffixes, claim, reader, over, declines=declines, inserter=inserter))


@hookimpl
def register_exporters(register: Callable[[ExporterInfo], None]) -> None:
    """Register the forms that ROS 2 reads."""
    for name, summary, suffix, settings in _WRITTEN:
        register(ExporterInfo(name, summary, suffix, f"cqos_ros2.exporters.{name}:write", settings))


_DECLINED = {
    "rosbag2": "cqos_ros2.importers.declined:recording",
    "qos_overrides": "cqos_ros2.importers.declined:parameters",
}
_INSERTERS = {
    "qos_overrides": "cqos_ros2.importers.editing:insert_parameters",
    "rviz": "cqos_ros2.importers.editing:insert_in_rviz",
}
_WRITTEN = (
    ("qos_overrides", "`qos_overrides` parameters, to start nodes with", ".yaml", ()),
    ("rosbag2_overrides", "QoS overrides of ros2 bag play or record", ".yaml", ("side=player|recorder",)),
    ("nodl", "NoDL documents, the interface of each node", ".nodl.yaml", ()),
    ("fame", "a BPMN model in the form of FaMe modeler", ".bpmn", ()),
    ("rclpy", "Python code with a QoSProfile for each endpoint", ".py", ()),
    ("ros2_package", "a package with a node in Python for each participant", "", ()),
    ("rclcpp", "a C++ header with an rclcpp::QoS for each endpoint", ".hpp", ()),
)
_OBSERVED = (
    ("topic_info", "What `ros2 topic info --verbose` prints", (".txt",), "topic_info"),
    ("rosbag2", "rosbag2 recordings (metadata.yaml)", ("metadata.yaml",), "rosbag2"),
    ("rosbag2_overrides", "QoS overrides of ros2 bag play and record", (".yaml", ".yml"), "rosbag2_overrides"),
)
_YAML = (".yaml", ".yml")
_CONFIGURED = (
    ("qos_overrides", "`qos_overrides` among the parameters of nodes", _YAML, "qos_overrides"),
    ("rviz", "Configurations of RViz", (".rviz",), "rviz"),
    ("gz_bridge", "Topics for ros_gz_bridge", _YAML, "gz_bridge"),
    ("ros1_bridge", "Parameters of the parameter bridge of ros1_bridge", _YAML, "ros1_bridge"),
    ("domain_bridge", "Configurations of domain_bridge", _YAML, "domain_bridge"),
    ("zenoh_bridge", "Configurations of zenoh-bridge-ros2dds", (".json5", ".json", *_YAML), "zenoh_bridge"),
    ("nodl", "NoDL documents, the interface of one node each", (".nodl.yaml",), "nodl"),
    ("ros2_model", "Component models of RosTooling", (".ros2",), "ros2_model"),
    ("fastdds", "XML profiles of Fast DDS, laid over nodes of ROS 2", (".xml",), "fastdds_xml"),
    ("cyclonedds", "Configurations of Cyclone DDS, laid over nodes of ROS 2", (".xml",), "cyclonedds_xml"),
)
