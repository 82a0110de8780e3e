"""Drivers whose parameters decide about their topics, and what comes through an agent that is no node."""

from __future__ import annotations

import pytest

CAMERA = """
<launch><node pkg="realsense2_camera" exec="realsense2_camera_node" name="camera" namespace="front">
{}
</node></launch>
"""
PX4 = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_ros.actions import Node

def generate_launch_description():
    agent = ExecuteProcess(cmd={command})
    return LaunchDescription([agent, Node(package="bot", executable="ear", name="ear")])
"""
EAR = """cqos_nodes: 1
package: bot
nodes: {{ear: {{name: ear, subscribes: {{/fmu/out/vehicle_odometry: {{type: px4_msgs/msg/VehicleOdometry, qos: {qos}}}}}}}}}
"""


def camera(joined, **parameters):
    text = "".join(f'<param name="{name}" value="{value}"/>' for name, value in parameters.items())
    return joined({"bot/launch/bot.launch.xml": CAMERA.format(text)}, "jazzy")


def shown(system):
    return {
        each.topic.removeprefix("/front/camera/"): each.profiles[0].name if each.profiles else ""
        for each in system.endpoints
        if each.kind == "message"
    }


@pytest.mark.parametrize(
    ("parameters", "there", "missing"),
    [
        ({}, {"depth/image_rect_raw": "system_default", "color/image_raw": "system_default", "depth/camera_info": "default"}, {"depth/color/points"}),
        ({"depth_qos": "SENSOR_DATA"}, {"depth/image_rect_raw": "sensor_data", "infra1/image_rect_raw": "system_default"}, set()),
        ({"enable_infra1": "false", "enable_depth": "False"}, {"infra2/image_rect_raw": "system_default"}, {"infra1/image_rect_raw", "depth/image_rect_raw", "infra1/metadata"}),
        ({"pointcloud.enable": "true", "pointcloud.pointcloud_qos": "SENSOR_DATA"}, {"depth/color/points": "sensor_data"}, set()),
        ({"enable_accel": "true", "enable_gyro": "true", "unite_imu_method": "2"}, {"imu": "sensor_data", "gyro/sample": "sensor_data"}, set()),
        ({"enable_accel": "true", "enable_gyro": "true"}, {"accel/sample": "sensor_data"}, {"imu"}),
        ({"enable_accel": "true"}, {"accel/imu_info": "default"}, {"imu", "gyro/sample"}),
        ({"align_depth.enable": "true"}, {"aligned_depth_to_color/image_raw": "system_default"}, set()),
        ({"device_type": "d405"}, {"color/camera_info": "default"}, {"color/image_raw"}),
    ],
)  # fmt: skip
def test_parameters_of_a_camera_decide_its_streams(joined, findings, parameters, there, missing):
    system = camera(joined, **parameters)
    found = shown(system)
    assert {name: found.get(name) for name in there} == there
    assert not missing & set(found)
    assert findings(system) == []


def test_a_word_that_the_driver_does_not_know_leaves_the_policies_open(joined, findings):
    system = camera(joined, depth_qos="SENSOR")
    image = next(each for each in system.endpoints if each.topic.endswith("depth/image_rect_raw"))
    assert all(each.unknown for each in image.settings.values())
    assert findings(system) == []  # nothing in the launch depends on it
    assert any("another word in its parameter" in each.message for each in system.notes)


@pytest.mark.parametrize(
    ("command", "qos", "codes"),
    [
        ('["MicroXRCEAgent", "udp4", "-p", "8888"]', "{depth: 10}", ["ROS101"]),
        ('["/usr/local/bin/MicroXRCEAgent udp4 -p 8888"]', "{depth: 10}", ["ROS101"]),
        ('["micro-xrce-dds-agent", "udp4"]', "sensor_data", []),
        ('["xterm", "-e", "MicroXRCEAgent"]', "{depth: 10}", []),
    ],
)
def test_topics_of_px4_come_with_its_agent(joined, findings, command, qos, codes):
    system = joined({"bot/bot.node.yaml": EAR.format(qos=qos), "bot/launch/bot.launch.py": PX4.format(command=command)})
    found = findings(system)
    assert [code for code, *_ in found if code != "ROS312"] == codes
    # The policies of PX4 are its code's: what a rule says about them is accepted.
    assert [each.rule for each in system.accept] == ["ROS312"] * ("xterm" not in command)
