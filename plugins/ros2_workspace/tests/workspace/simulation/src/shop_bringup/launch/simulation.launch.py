"""Start a simulated shop robot: simulator bridge, robot model, localization, navigation and RViz."""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    bringup = get_package_share_directory("shop_bringup")
    use_rviz = LaunchConfiguration("use_rviz")
    robot = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(
            PathJoinSubstitution([FindPackageShare("shop_robot"), "launch", "robot.launch.py"])
        ),
        launch_arguments={"use_sim_time": "true"}.items(),
    )
    navigation = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(os.path.join(bringup, "launch", "bringup.launch.py")),
        launch_arguments={
            "params_file": LaunchConfiguration("params_file"),
            "use_composition": LaunchConfiguration("use_composition"),
        }.items(),
    )
    rviz = Node(
        condition=IfCondition(use_rviz),
        package="rviz2",
        executable="rviz2",
        arguments=["-d", os.path.join(bringup, "rviz", "shop.rviz")],
        parameters=[{"use_sim_time": True}],
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("use_rviz", default_value="true"),
            DeclareLaunchArgument("use_composition", default_value="True"),
            DeclareLaunchArgument("params_file", default_value=os.path.join(bringup, "config", "navigation.yaml")),
            robot,
            navigation,
            rviz,
        ]
    )
