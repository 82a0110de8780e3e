"""What nodes create, read from their sources in C++ and Python: from files to node files. Nothing is executed or imported.

Here are only the hooks.
"""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, FunctionInfo, hookimpl


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``learn``."""
    register(
        CommandInfo("learn", "Write node files from sources in C++ and Python.", "cqos_ros2_sources.command:learn")
    )


@hookimpl
def register_functions(register: Callable[[FunctionInfo], None]) -> None:
    """Register what reads packages of a workspace that have no node file."""
    register(
        FunctionInfo("ros2-sources", "what the sources of ROS 2 packages say", "cqos_ros2_sources.reader:SourceReader")
    )
