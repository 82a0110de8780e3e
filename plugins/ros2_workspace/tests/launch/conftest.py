"""Workspaces of tests: files by their paths, and the launch of one of them."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import pytest

from cqos_ros2_workspace.launch.launch_evaluation import launch
from cqos_ros2_workspace.launch.workspace import find_packages

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from cqos_ros2_workspace.launch.launch_result import Launched

PYTHON = """
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import (DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription, OpaqueFunction,
                            RegisterEventHandler, SetEnvironmentVariable, SetLaunchConfiguration, TimerAction)
from launch.conditions import IfCondition, UnlessCondition
from launch.event_handlers import OnProcessExit
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (Command, EnvironmentVariable, EqualsSubstitution, IfElseSubstitution, LaunchConfiguration,
                                  NotSubstitution, PathJoinSubstitution, PythonExpression, ThisLaunchFileDir)
from launch_ros.actions import (ComposableNodeContainer, LifecycleNode, LoadComposableNodes, Node, PushRosNamespace,
                                SetParameter, SetRemap)
from launch_ros.descriptions import ComposableNode, ParameterFile
from nav2_common.launch import RewrittenYaml
import os


def generate_launch_description():
"""


def manifest(name: str) -> str:
    return f'<?xml version="1.0"?><package format="3"><name>{name}</name><version>1.0.0</version></package>'


def python(body: str) -> str:
    """Return a launch file whose function has the body."""
    return PYTHON + textwrap.indent(textwrap.dedent(body).strip("\n"), "    ")


def write(root: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write the files of a workspace; each folder on top is a package, unless it has a package file of its own."""
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        package = root / name.partition("/")[0]
        if "/" in name and not (package / "package.xml").exists():
            (package / "package.xml").write_text(manifest(package.name))
    return root


@pytest.fixture
def workspace(tmp_path):
    """Write a workspace and return its folder."""
    return lambda files: write(tmp_path / "src", files)


@pytest.fixture
def launched(tmp_path):
    """Read the launch of the first file of a workspace."""

    def read(files: Mapping[str, str | bytes], variables: Mapping[str, str] | None = None, **given: str) -> Launched:
        root = write(tmp_path / "src", files)
        return launch(find_packages(str(root)), str(root / next(iter(files))), given, variables)

    return read


@pytest.fixture
def python_launch(launched):
    """Read the launch of one Python file whose function has a body."""
    return lambda body, **given: launched({"bot/launch/bot.launch.py": python(body)}, **given)
