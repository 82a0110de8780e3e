"""The ROS 2 rule pack of C-QoS. Here are only the hooks; everything else is imported when a check needs it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.plugins import ImporterInfo, RulePackInfo, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """Register ``ros2``."""
    summary = "ROS 2 topics, services and actions, Foxy to Rolling"
    register(RulePackInfo("ros2", summary, "cqos_ros2.pack:PACK", default_for=("bpmn",)))


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """Register the files that ROS 2 people have."""
    for name, summary, suffixes, module in _OBSERVED:
        claim = f"cqos_ros2.importers.detect_observed:claims_{name}"
        register(ImporterInfo(name, summary, suffixes, claim, f"cqos_ros2.importers.{module}:read"))


_OBSERVED = (
    ("topic_info", "What `ros2 topic info --verbose` prints", (".txt",), "topic_info"),
    ("rosbag2", "rosbag2 recordings (metadata.yaml)", ("metadata.yaml",), "rosbag2"),
    ("rosbag2_overrides", "QoS overrides of ros2 bag play and record", (".yaml", ".yml"), "rosbag2_overrides"),
)
