"""Start localization and navigation, in one container or as nodes of their own."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import LoadComposableNodes, Node, PushRosNamespace
from launch_ros.descriptions import ComposableNode, ParameterFile
from nav2_common.launch import RewrittenYaml

TRANSFORMS = [("/tf", "tf"), ("/tf_static", "tf_static")]
LOCALIZATION = [
    ("nav2_map_server", "map_server", "nav2_map_server::MapServer", []),
    ("nav2_amcl", "amcl", "nav2_amcl::AmclNode", []),
]
NAVIGATION = [
    ("nav2_controller", "controller_server", "nav2_controller::ControllerServer", [("cmd_vel", "cmd_vel_nav")]),
    ("nav2_smoother", "smoother_server", "nav2_smoother::SmootherServer", []),
    ("nav2_planner", "planner_server", "nav2_planner::PlannerServer", []),
    ("nav2_behaviors", "behavior_server", "behavior_server::BehaviorServer", [("cmd_vel", "cmd_vel_nav")]),
    ("nav2_bt_navigator", "bt_navigator", "nav2_bt_navigator::BtNavigator", []),
    ("nav2_waypoint_follower", "waypoint_follower", "nav2_waypoint_follower::WaypointFollower", []),
    (
        "nav2_velocity_smoother",
        "velocity_smoother",
        "nav2_velocity_smoother::VelocitySmoother",
        [("cmd_vel", "cmd_vel_nav")],
    ),
    ("nav2_collision_monitor", "collision_monitor", "nav2_collision_monitor::CollisionMonitor", []),
]


def manager(name, nodes, params):
    return Node(
        package="nav2_lifecycle_manager",
        executable="lifecycle_manager",
        name=name,
        parameters=[params, {"autostart": True}, {"node_names": nodes}],
    )


def generate_launch_description():
    params = ParameterFile(
        RewrittenYaml(
            source_file=LaunchConfiguration("params_file"),
            root_key=LaunchConfiguration("namespace"),
            param_rewrites={"use_sim_time": "true"},
            convert_types=True,
        ),
        allow_substs=True,
    )
    composed = IfCondition(LaunchConfiguration("use_composition"))
    apart = IfCondition(PythonExpression(["not ", LaunchConfiguration("use_composition")]))
    actions = [PushRosNamespace(LaunchConfiguration("namespace"))]
    actions.append(
        Node(
            condition=composed,
            package="rclcpp_components",
            executable="component_container_isolated",
            name="nav2_container",
            parameters=[params, {"autostart": True}],
            remappings=TRANSFORMS,
        )
    )
    for package, name, plugin, remaps in LOCALIZATION + NAVIGATION:
        actions.append(
            Node(
                condition=apart,
                package=package,
                executable=name,
                parameters=[params],
                remappings=TRANSFORMS + remaps,
            )
        )
    actions.append(
        LoadComposableNodes(
            condition=composed,
            target_container="nav2_container",
            composable_node_descriptions=[
                ComposableNode(
                    package=package,
                    plugin=plugin,
                    name=name,
                    parameters=[params],
                    remappings=TRANSFORMS + remaps,
                )
                for package, name, plugin, remaps in LOCALIZATION + NAVIGATION
            ],
        )
    )
    actions.append(manager("lifecycle_manager_localization", ["map_server", "amcl"], params))
    actions.append(
        manager(
            "lifecycle_manager_navigation",
            [
                "controller_server",
                "smoother_server",
                "planner_server",
                "behavior_server",
                "bt_navigator",
                "waypoint_follower",
                "velocity_smoother",
                "collision_monitor",
            ],
            params,
        )
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value=""),
            DeclareLaunchArgument("params_file"),
            DeclareLaunchArgument("use_composition", default_value="True"),
            GroupAction(actions),
        ]
    )
