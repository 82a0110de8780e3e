from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription(
        [
            Node(package="arm_driver", executable="driver", name="driver"),
            Node(package="moveit_ros_move_group", executable="move_group", output="screen"),
            Node(package="robot_state_publisher", executable="robot_state_publisher"),
        ]
    )
