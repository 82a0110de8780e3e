"""A directory with a design, parameters, a recording and an RViz configuration, checked together on the command line."""

import json

import pytest
from click.testing import CliRunner

from cqos_core.cli.app import cli
from cqos_core.plugins import load_plugins

DESIGN = """\
cqos: 1
system: robot
protocol: ros2
participants:
  lidar_driver:
    publishes:
      /scan: {type: sensor_msgs/msg/LaserScan}
  planner:
    subscribes:
      /scan: {type: sensor_msgs/msg/LaserScan, deadline: 100ms}
      /imu: {type: sensor_msgs/msg/Imu, reliability: reliable}
"""
PARAMETERS = """\
/**/lidar_driver:
  ros__parameters:
    frame_id: laser
    qos_overrides:
      /scan:
        publisher:
          reliability: best_effort
          deadline: 200000000
"""
RVIZ = """\
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/LaserScan
      Enabled: true
      Name: Laser
      Topic:
        Depth: 5
        Durability Policy: Transient Local
        Reliability Policy: Reliable
        Value: /scan
"""
BAG = """\
rosbag2_bagfile_information:
  version: 9
  topics_with_message_count:
  - topic_metadata:
      name: /imu
      type: sensor_msgs/msg/Imu
      serialization_format: cdr
      offered_qos_profiles:
      - history: keep_last
        depth: 5
        reliability: best_effort
        durability: volatile
        deadline: {sec: 9223372036, nsec: 854775807}
        lifespan: {sec: 9223372036, nsec: 854775807}
        liveliness: automatic
        liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
        avoid_ros_namespace_conventions: false
    message_count: 1
"""
PROFILES = """\
<profiles>
    <data_reader profile_name="/imu">
        <qos>
            <liveliness><kind>MANUAL_BY_TOPIC</kind></liveliness>
        </qos>
    </data_reader>
</profiles>
"""
FILES = {
    "design.yaml": DESIGN,
    "config/lidar.yaml": PARAMETERS,
    "config/view.rviz": RVIZ,
    "config/dds.xml": PROFILES,
    "bag/metadata.yaml": BAG,
    "package.xml": "<package><name>robot</name></package>",
}


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return tmp_path


def run(folder, *arguments):
    return CliRunner().invoke(cli, ["check", str(folder), "--together", *arguments])


def stated(folder, report):
    """Rule and topic of each error, with the file, line and column that each value of the first policy comes from."""
    found = {}
    for finding in report["findings"]:
        if finding["severity"] != "error":
            continue
        places = []
        for side in finding["sides"]:
            fact = side["facts"][0]
            place = fact["place"]
            where = place["source"].removeprefix(f"{folder}/")
            places.append(f"{fact['value']} {fact['origin']} {where}:{place['line']}:{place['column']}")
        found[finding["code"], finding["topic"]] = sorted(places)
    return found


def test_findings_name_the_file_and_line_that_each_value_came_from(folder):
    assert "rosbag2" in load_plugins().importers
    result = run(folder, "--format", "json", "--option", "ros2.rmw=fastdds")
    assert result.exit_code == 1
    assert stated(folder, json.loads(result.stdout)) == {
        ("ROS101", "/scan"): [
            "best_effort qos_overrides config/lidar.yaml:7:24",
            "reliable preset default design.yaml:10:7",
        ],
        ("ROS102", "/scan"): [
            "transient_local explicit config/view.rviz:8:28",
            "volatile preset default design.yaml:7:7",
        ],
        ("ROS103", "/scan"): [
            "100ms explicit design.yaml:10:58",
            "200ms qos_overrides config/lidar.yaml:8:21",
        ],
        ("ROS101", "/imu"): [
            "best_effort explicit bag/metadata.yaml:11:22",
            "reliable explicit design.yaml:11:54",
        ],
        ("ROS104", "/imu"): [
            "automatic explicit bag/metadata.yaml:15:21",
            "manual_by_topic Fast DDS profile `/imu` config/dds.xml:4:25",
        ],
    }
    assert "1 file" in result.stderr  # package.xml is passed over


def test_people_see_the_lines_of_every_file(folder):
    result = run(folder, "--option", "ros2.rmw=fastdds", "--format", "full")
    for shown in (
        "          reliability: best_effort",
        "        Durability Policy: Transient Local",
        "        reliability: best_effort",
        "            <liveliness><kind>MANUAL_BY_TOPIC</kind></liveliness>",
        "offered here, qos_overrides",
    ):
        assert shown in result.stdout


def test_each_by_itself_says_that_an_overlay_covers_nothing(folder):
    result = CliRunner().invoke(cli, ["check", str(folder / "config" / "lidar.yaml")])
    assert "CQ214" in result.stdout
