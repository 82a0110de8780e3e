"""Shipped facts of one version beside the sources of another: which of them counts, and what the report says of it."""

from __future__ import annotations

import pytest

from cqos_core import Place
from cqos_ros2_workspace.nodes.version_fit import fit

LAUNCH = """
from launch import LaunchDescription
from launch_ros.actions import Node

def generate_launch_description():
    return LaunchDescription([Node(package="joy", executable="joy_node", name="pad")])
"""
# A package of the name of one whose facts come with C-QoS (3.3.0), with another name for its one publisher.
SOURCE = """
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joy.hpp>
class Joy : public rclcpp::Node {
 public:
  Joy() : Node("joy_node") { pub_ = create_publisher<sensor_msgs::msg::Joy>("%s", rclcpp::SensorDataQoS()); }
  rclcpp::Publisher<sensor_msgs::msg::Joy>::SharedPtr pub_;
};
int main(int argc, char ** argv) { rclcpp::init(argc, argv); rclcpp::spin(std::make_shared<Joy>()); }
"""
CMAKE = "add_executable(joy_node src/joy.cpp)\ninstall(TARGETS joy_node DESTINATION lib/joy)\n"
FEEDBACK = ("subscriber", "/joy/set_feedback", "")


def files(version, topic="joy"):
    manifest = f"<package><name>joy</name>{f'<version>{version}</version>' if version else ''}</package>"
    return {
        "bot/launch/bot.launch.py": LAUNCH,
        "joy/package.xml": manifest,
        "joy/CMakeLists.txt": CMAKE,
        "joy/src/joy.cpp": SOURCE % topic,
    }


def ends(system):
    return {
        (each.role, each.topic, each.profiles[0].name if each.profiles else ""): each.external
        for each in system.endpoints
    }


@pytest.mark.parametrize("distro", ["humble", "jazzy", "kilted", ""])
@pytest.mark.parametrize("version", ["4.0.0", "3.4.0", "2.3.0", ""])
@pytest.mark.parametrize("topic", ["joy", "sticks"])
def test_sources_of_another_version_win_where_they_speak(joined, version, distro, topic):
    system = joined(files(version, topic), distro)
    found = ends(system)
    # What the sources name stands as they name it, and no older name stands beside it.
    assert set(found) == {("publisher", f"/{topic}", "sensor_data"), FEEDBACK}
    # What only the older version has may be called otherwise: a missing partner is no finding.
    assert found[FEEDBACK]
    said = [each.message for each in system.notes if "facts of other versions stand" in each.message]
    assert len(said) == 1
    assert f"`joy` 3.3.0 (the workspace has {version or 'no version'})" in said[0]


@pytest.mark.parametrize("distro", ["humble", "jazzy", "kilted", ""])
def test_facts_of_the_same_version_are_those_that_a_person_confirmed(joined, distro):
    system = joined(files("3.3.9", "sticks"), distro)
    assert set(ends(system)) == {("publisher", "/joy", ""), FEEDBACK}
    assert not [each.message for each in system.notes if "other versions" in each.message]


def test_facts_of_another_version_stand_where_no_source_is_read(joined):
    bare = files("4.0.0")
    del bare["joy/src/joy.cpp"]
    found = ends(joined(bare))
    assert set(found) == {("publisher", "/joy", ""), FEEDBACK}
    assert all(found.values())


def test_a_name_that_the_sources_leave_open_is_no_near_miss(joined, findings):
    open_name = files("4.0.0")
    open_name["joy/src/joy.cpp"] = SOURCE.replace('"%s"', "std::string(argv_[1])")
    node = 'nodes: {ear: {name: ear, subscribes: {/robot/joy: {type: sensor_msgs/msg/Joy, at: "a:1"}}}}'
    open_name["ears/package.xml"] = "<package><name>ears</name></package>"
    open_name["ears/ears.node.yaml"] = f"cqos_nodes: 1\npackage: ears\n{node}\n"
    launch = LAUNCH.replace("])", ', Node(package="ears", executable="ear", name="ear")])')
    assert findings(joined({**open_name, "bot/launch/bot.launch.py": launch})) == []


@pytest.mark.parametrize(
    ("there", "distro", "expected", "same"),
    [
        ("1.1.7", "", "humble", True),
        ("1.3.1", "humble", "jazzy", True),
        ("1.5.0", "", "jazzy", False),
        ("1.0.0", "", "humble", False),
        ("2.0.0", "", "jazzy", False),
        ("", "", "jazzy", False),
        ("", "humble", "humble", False),
        ("dev", "", "jazzy", False),
        ("1", "", "humble", False),
    ],
)
def test_the_nearest_version_is_taken(there, distro, expected, same):
    found = fit({"humble": "1.1.20", "jazzy": "1.3.13"}, there, Place("package.xml"), distro)
    assert (found.distro, found.same) == (expected, same)
