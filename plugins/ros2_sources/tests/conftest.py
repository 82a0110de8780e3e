"""Packages that tests write, and what is learned of them."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import pytest

from cqos_ros2_sources.node_files.node_file_maker import Learned, learn
from cqos_ros2_workspace.launch.workspace import find_packages

if TYPE_CHECKING:
    from collections.abc import Mapping

CMAKE = "project(bot)\nadd_executable(driver src/driver.cpp)\n"
MAIN = "int main(int argc, char ** argv) { rclcpp::init(argc, argv); rclcpp::spin(std::make_shared<Driver>()); }\n"
SETUP = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"


def need_parser() -> None:
    """Skip a test where the parser of C++ is not installed; in CI it must be."""
    if os.environ.get("CI") != "true":
        pytest.importorskip("tree_sitter_cpp")


def write_package(root: Any, files: Mapping[str, str | bytes]) -> None:
    """Write the files of a package `bot`."""
    for name, content in {"package.xml": "<package><name>bot</name></package>", **files}.items():
        path = root / "bot" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)


@pytest.fixture
def learned(tmp_path):
    """Return the function that writes a package and returns what is learned of it."""

    def of(files: Mapping[str, str | bytes], *calls: str) -> Learned:
        write_package(tmp_path, files)
        return learn("bot", find_packages(str(tmp_path)), calls)

    return of


@pytest.fixture
def parser() -> None:
    """Skip a test where the parser of C++ is not installed."""
    need_parser()


@pytest.fixture
def cpp(learned):
    """Return the function that learns the node of a class `Driver`: the body of its constructor, its members, and what stands before."""
    need_parser()

    def of(body: str, members: str = "", before: str = "") -> dict[str, Any]:
        source = f'{before}\nclass Driver : public rclcpp::Node {{\npublic:\n  Driver() : Node("driver") {{\n{body}\n  }}\n{members}\n}};\n{MAIN}'
        found: dict[str, Any] = learned({"CMakeLists.txt": CMAKE, "src/driver.cpp": source}).document["nodes"]["driver"]
        return found

    return of


@pytest.fixture
def python(learned):
    """Return the function that learns the node of a class `Driver` in Python: the body of its constructor, its methods, and what stands before."""

    def of(body: str, methods: str = "", before: str = "") -> dict[str, Any]:
        inner = "\n".join(f"        {line}" for line in body.splitlines())
        source = (
            "import rclpy\nfrom rclpy.node import Node\nfrom rclpy.qos import QoSProfile, ReliabilityPolicy, DurabilityPolicy, qos_profile_sensor_data\n"
            f"from std_msgs.msg import String\n{before}\nclass Driver(Node):\n    def __init__(self):\n        super().__init__('driver')\n{inner}\n{methods}\n"
            "def main(args=None):\n    rclpy.init(args=args)\n    rclpy.spin(Driver())\n"
        )
        found: dict[str, Any] = learned({"setup.py": SETUP, "bot/driver.py": source}).document["nodes"]["driver"]
        return found

    return of


@pytest.fixture(autouse=True)
def _no_memory(tmp_path_factory, monkeypatch):
    """Keep what is learned in a folder of the test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("kept")))
