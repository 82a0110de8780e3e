"""Workspaces of ROS 2: launch files, node files and parameter files as one system. Here are only the hooks.

`launch` reads launch files as text, `nodes` has what is known of nodes, and the modules beside them join both. `why` finds the cause
of a silent topic, and `ros` has the commands for tools of ROS.
"""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, ImporterInfo, ImporterOption, hookimpl


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """Register workspaces."""
    register(
        ImporterInfo(
            "workspace",
            "Workspaces of ROS 2: a folder with --launch FILE",
            (),
            "cqos_ros2_workspace:claims_workspace",
            "cqos_ros2_workspace.importer:read",
            options=_LAUNCH,
            folder_suggestions="cqos_ros2_workspace.folder_suggestions:find",
        )
    )


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``launch`` and ``why``."""
    package = "cqos_ros2_workspace"
    register(CommandInfo("launch", "Print what a ROS 2 launch file would start.", f"{package}.launch.command:launch"))
    register(CommandInfo("why", "Find the cause of a silent topic of ROS 2.", f"{package}.why.command:why"))


def claims_workspace(name: str, head: bytes) -> bool:
    """Claim nothing: a workspace is a folder, which `--launch` names."""
    del name, head
    return False


_LAUNCH = (
    ImporterOption(
        "--launch",
        "launch",
        "FILE",
        "Check what this launch file starts, a path or PACKAGE:FILE. Folders are read as ROS 2 workspaces. Several start together.",
    ),
    ImporterOption("--launch-arg", "launch_arg", "NAME:=VALUE", "The value of a launch argument. Can be repeated."),
)
