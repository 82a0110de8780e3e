"""Start the robot's model and the bridge to its simulator."""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    share = get_package_share_directory("shop_robot")
    use_sim_time = LaunchConfiguration("use_sim_time")
    model = Command(["xacro ", os.path.join(share, "urdf", "shop.urdf.xacro")])
    return LaunchDescription(
        [
            DeclareLaunchArgument("use_sim_time", default_value="false"),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                name="robot_state_publisher",
                parameters=[{"robot_description": model, "use_sim_time": use_sim_time}],
                remappings=[("/tf", "tf"), ("/tf_static", "tf_static")],
            ),
            Node(
                package="ros_gz_bridge",
                executable="parameter_bridge",
                name="bridge",
                parameters=[
                    {"config_file": os.path.join(share, "config", "bridge.yaml"), "use_sim_time": use_sim_time},
                    os.path.join(share, "config", "bridge_qos.yaml"),
                ],
            ),
            Node(
                package="tf2_ros",
                executable="static_transform_publisher",
                arguments=["--frame-id", "base_link", "--child-frame-id", "lidar"],
            ),
        ]
    )
