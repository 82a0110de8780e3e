"""A simulated robot with navigation: no warning as it is, and what faults in it are found, each at its place."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parent / "simulation" / "src"
LAUNCH = "shop_bringup:simulation.launch.py"
BRINGUP = "shop_bringup/launch/bringup.launch.py"
ROBOT = "shop_robot/launch/robot.launch.py"
NAVIGATION = "shop_bringup/config/navigation.yaml"
BRIDGE = "shop_robot/config/bridge.yaml"
BRIDGE_QOS = "shop_robot/config/bridge_qos.yaml"
RVIZ = "shop_bringup/rviz/shop.rviz"


class Fault(NamedTuple):
    """A fault: a text of a file and what stands in its place, the code that reports it, and a text in the line that it names."""

    file: str
    old: str
    new: str
    code: str
    at: str = ""
    of: str = ""


FAULTS = {
    "a remap of a name that the node does not have": Fault(
        BRINGUP,
        '("cmd_vel", "cmd_vel_nav")]),\n    ("nav2_smoother"',
        '("cmd_vl", "cmd_vel_nav")]),\n    ("nav2_smoother"',
        "ROS972",
        "ComposableNode(",
    ),
    "a remap to a name with a typing error": Fault(
        BRINGUP,
        '        [("cmd_vel", "cmd_vel_nav")],',
        '        [("cmd_vel", "cmd_vel_nvav")],',
        "CQ403",
        "ComposableNode(",
    ),
    "a remap of a topic into a namespace": Fault(
        ROBOT, 'name="bridge",', 'name="bridge", remappings=[("scan", "front/scan")],', "CQ403", "Node("
    ),
    "a parameter with a typing error in a topic": Fault(
        NAVIGATION, "scan_topic: scan", "scan_topic: scn", "ROS973", "scan_topic"
    ),
    "a parameter with a slash and a namespace too many": Fault(
        NAVIGATION,
        '          topic: /scan\n          data_type: "LaserScan"\n      inflation_layer:\n        plugin: "nav2_costmap_2d::InflationLayer"\nglobal',
        '          topic: /robot/scan\n          data_type: "LaserScan"\n      inflation_layer:\n        plugin: "nav2_costmap_2d::InflationLayer"\nglobal',
        "ROS973",
        "/robot/scan",
    ),
    "a parameter of the map": Fault(NAVIGATION, "map_topic: map", "map_topic: maps", "ROS973", "map_topic"),
    "a parameter of odometry": Fault(
        NAVIGATION, "odom_topic: odom\n    robot_base", "odom_topic: odmo\n    robot_base", "ROS973", "odmo"
    ),
    "a parameter of the commands": Fault(
        NAVIGATION, '"cmd_vel_smoothed"', '"cmd_vel_smothed"', "CQ403", "cmd_vel_smothed"
    ),
    "a parameter of the costmap": Fault(
        NAVIGATION,
        "costmap_topic: global_costmap/costmap_raw",
        "costmap_topic: global_costmap/costmap_rwa",
        "ROS973|CQ403",
        "costmap_rwa",
    ),
    "a volatile subscription to the map": Fault(
        NAVIGATION,
        "map_subscribe_transient_local: true",
        "map_subscribe_transient_local: false",
        "ROS202",
        "map_subscribe",
        "/map",
    ),
    "a reliable display of a best-effort scan": Fault(
        RVIZ,
        "Reliability Policy: Best Effort",
        "Reliability Policy: Reliable",
        "ROS101",
        "Best Effort|Value: scan",
        "/scan",
    ),
    "an override of a relative name": Fault(BRIDGE_QOS, "/scan:", "scan:", "ROS974", "reliability"),
    "an override of the other side": Fault(BRIDGE_QOS, "publisher:", "subscription:", "ROS974", "reliability"),
    "an override of a topic before its remap": Fault(BRIDGE_QOS, "/scan:", "/lidar/scan:", "ROS974", "reliability"),
    "an override that the node does not allow": Fault(
        NAVIGATION, "      /tf:\n", "      /amcl_pose:\n", "ROS974", "depth: 50"
    ),
    "a bridge in a namespace": Fault(ROBOT, 'name="bridge",', 'name="bridge", namespace="sim",', "CQ403", "Node("),
    "a node that is not started": Fault(
        BRINGUP,
        '    ("nav2_planner", "planner_server", "nav2_planner::PlannerServer", []),\n',
        "",
        "ROS975",
        "return Node(",
    ),
    "a map server that is not started": Fault(
        BRINGUP,
        '    ("nav2_map_server", "map_server", "nav2_map_server::MapServer", []),\n',
        "",
        "ROS975",
        "return Node(",
    ),
    "a node that no manager activates": Fault(
        BRINGUP, '["map_server", "amcl"]', '["map_server"]', "ROS976", "ComposableNode("
    ),
    "two nodes of one name": Fault(ROBOT, 'name="bridge"', 'name="robot_state_publisher"', "ROS970", "Node("),
    "a section with a typing error": Fault(NAVIGATION, "amcl:\n", "amlc:\n", "ROS971", "amlc:"),
    "a sensor of a costmap with another type": Fault(
        NAVIGATION,
        'publish_voxel_map: true\n        scan:\n          topic: /scan\n          data_type: "LaserScan"',
        'publish_voxel_map: true\n        scan:\n          topic: /scan\n          data_type: "PointCloud2"',
        "ROS403",
        "topic: /scan",
        "/scan",
    ),
    "an override with a value that there is not": Fault(BRIDGE_QOS, "best_effort", "bestefort", "CQ203", "bestefort"),
    "an override of a policy that there is not": Fault(
        BRIDGE_QOS, "reliability:", "reliabilty:", "ROS974", "reliabilty"
    ),
    "a map server that publishes another name": Fault(
        NAVIGATION, "yaml_filename", "topic_name: mapp\n    yaml_filename", "CQ403", "mapp", "/mapp"
    ),
    "a name in the wrong case": Fault(NAVIGATION, "scan_topic: scan", "scan_topic: Scan", "ROS973", "scan_topic: Scan"),
    "a short name in the wrong case": Fault(NAVIGATION, "map_topic: map", "map_topic: Map", "ROS973", "map_topic: Map"),
    "another type": Fault(
        BRIDGE,
        "ros_topic_name: cmd_vel, gz_topic_name: cmd_vel, ros_type_name: geometry_msgs/msg/Twist,",
        "ros_topic_name: cmd_vel, gz_topic_name: cmd_vel, ros_type_name: geometry_msgs/msg/TwistStamped,",
        "ROS4",
        "cmd_vel",
        "/cmd_vel",
    ),
}


@pytest.mark.parametrize("composed", ["True", "False"])
@pytest.mark.parametrize("distro", ["humble", "jazzy", ""])
def test_a_correct_launch_has_no_warning(started, findings, distro, composed):
    system = started(ROOT, LAUNCH, distro, use_composition=composed)
    assert findings(system) == []
    assert len(system.endpoints) > 90


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_found_at_its_place(tmp_path, started, findings, name):
    fault = FAULTS[name]
    root = tmp_path / "src"
    shutil.copytree(ROOT, root)
    path = root / fault.file
    text = path.read_text(encoding="utf-8")
    assert text.count(fault.old) == 1 or fault.file == RVIZ
    path.write_text(text.replace(fault.old, fault.new, 1), encoding="utf-8")
    found = findings(started(root, LAUNCH, "jazzy"))
    mine = [each for each in found if any(each[0].startswith(code) for code in fault.code.split("|"))]
    assert mine, found
    lines = {path.name: path.read_text(encoding="utf-8").splitlines() for path in root.rglob("*.*") if path.is_file()}
    said = [lines[file][line - 1] for _, places, _ in mine for file, line in places if file in lines and line]
    assert not fault.at or any(word in line for line in said for word in fault.at.split("|")), mine
    assert not fault.of or any(fault.of in text for *_, text in mine), mine
