"""The ROS 2 rule pack of C-QoS. Here are only the hooks; everything else is imported when a check needs it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.plugins import RulePackInfo, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """Register ``ros2``."""
    summary = "ROS 2 topics, services and actions, Foxy to Rolling"
    register(RulePackInfo("ros2", summary, "cqos_ros2.pack:PACK", default_for=("bpmn",)))
