"""Python launch files: what the syntax tree says would start."""

from __future__ import annotations

import pytest

from cqos_ros2_workspace.launch.launch_result import ParameterFile, ParameterValues
from cqos_ros2_workspace.launch.values import shown, unknown_parts


def only(found):
    assert not found.remarks
    (instance,) = found.instances
    return instance


def names(found):
    return [f"{shown(each.namespace)}/{shown(each.name)}" for each in found.instances]


def values(instance):
    return {
        name: value
        for each in instance.parameters
        if isinstance(each, ParameterValues)
        for name, value in each.values.items()
    }


def guards(instance):
    return [str(guard) for guard in instance.guards]


def test_a_node_with_everything(python_launch):
    node = only(
        python_launch("""
        name = LaunchConfiguration('name', default='amcl')
        return LaunchDescription([Node(
            package='nav2_amcl', executable='amcl', name=name, namespace='/robot1', output='screen',
            remappings=[('/tf', 'tf'), ('scan', ['front', '/scan'])],
            parameters=[{'use_sim_time': True, 'laser': {'range': 2.5}}, os.path.join('/x', 'y')][:1],
            arguments=['--verbose', '--ros-args', '-r', 'a:=b', '-p', 'rate:=5', '--log-level', 'info'],
        )])
        """)
    )
    assert (node.package, node.executable, node.name, node.namespace) == ("nav2_amcl", "amcl", "amcl", "/robot1")
    assert node.remaps == [("a", "b"), ("/tf", "tf"), ("scan", "front/scan")]
    assert values(node) == {"use_sim_time": True, "laser.range": 2.5, "rate": 5}
    assert node.arguments == ["--verbose", "--log-level", "info"]
    assert node.place.line == 20


def test_ros_args_state_name_and_namespace(python_launch):
    body = "return LaunchDescription([Node(package='a', executable='b', arguments=['--ros-args', '-r', '__node:=n', '-r', '__ns:=/s'])])"
    node = only(python_launch(body))
    assert (node.name, node.namespace) == ("n", "/s")


def test_arguments_have_their_default_or_what_is_given(python_launch):
    body = """
        return LaunchDescription([
            DeclareLaunchArgument('ns', default_value='a'),
            DeclareLaunchArgument('full', default_value=[LaunchConfiguration('ns'), '/b']),
            Node(package='p', executable='e', name='n', namespace=LaunchConfiguration('full')),
        ])
        """
    assert names(python_launch(body)) == ["/a/b/n"]
    assert names(python_launch(body, ns="c")) == ["/c/b/n"]


def test_an_argument_without_a_value_is_unknown_with_its_place(python_launch):
    found = python_launch("""
        return LaunchDescription([
            DeclareLaunchArgument('ns'),
            Node(package='p', executable='e', name='n', namespace=['robot_', LaunchConfiguration('ns')]),
        ])
        """)
    (node,) = found.instances
    (part,) = unknown_parts(node.namespace)
    assert shown(node.namespace) == "/robot_?"
    assert part.cause == "the launch argument `ns` has no value: it is not given and has no default"
    assert part.place.line == 20


BRANCHES = """
        sim = LaunchConfiguration('sim')
        return LaunchDescription([
            DeclareLaunchArgument('sim'),
            Node(package='p', executable='driver', condition=UnlessCondition(sim)),
            Node(package='p', executable='simulator', condition=IfCondition(sim)),
            Node(package='p', executable='other', condition=IfCondition(PythonExpression(['not ', sim]))),
            Node(package='p', executable='third', condition=IfCondition(PythonExpression(["'", sim, "' == 'True'"]))),
        ])
        """


def test_an_undecided_argument_is_one_assumption(python_launch):
    found = python_launch(BRANCHES)
    assert [guards(each) for each in found.instances] == [
        ["sim is not true"],
        ["sim is true"],
        ["sim is not true"],
        ["sim is true"],
    ]


@pytest.mark.parametrize(
    ("value", "started"), [("True", ["simulator", "third"]), ("0", ["driver", "other"]), ("1", ["simulator"])]
)
def test_a_given_argument_decides(python_launch, value, started):
    assert [each.executable for each in python_launch(BRANCHES, sim=value).instances] == started


def test_a_condition_that_is_neither_true_nor_false_is_reported(python_launch):
    found = python_launch(BRANCHES, sim="maybe")
    assert "neither true nor false" in found.remarks[0].cause
    assert [bool(each.guards) for each in found.instances][:2] == [True, True]


def test_exclusive_branches_exclude_each_other(python_launch):
    # In one branch, what only starts in the other never starts.
    found = python_launch("""
        sim = LaunchConfiguration('sim')
        return LaunchDescription([
            DeclareLaunchArgument('sim'),
            GroupAction(condition=IfCondition(sim), actions=[
                Node(package='p', executable='a', condition=UnlessCondition(sim)),
                Node(package='p', executable='b', condition=IfCondition(sim)),
            ]),
        ])
        """)
    assert [(each.executable, guards(each)) for each in found.instances] == [("b", ["sim is true"])]


def test_python_if_on_what_is_not_known_keeps_both_branches(python_launch):
    found = python_launch("""
        ld = LaunchDescription()
        model = os.environ['MODEL']
        topic = 'a' if model == 'waffle' else 'b'
        if model == 'waffle':
            ld.add_action(Node(package='p', executable='camera'))
        else:
            rate = 5
        ld.add_action(Node(package='p', executable='e', remappings=[('x', topic)]))
        return ld
        """)
    camera, other = found.instances
    assert guards(camera) == ["environment MODEL is waffle"]
    assert other.guards == ()
    assert shown(other.remaps[0][1]) == "(a if environment MODEL is waffle; b if environment MODEL is not waffle)"


def test_the_environment_is_what_the_caller_defines(launched):
    from_body = "import os\nfrom launch_ros.actions import Node\nfrom launch import LaunchDescription\n"
    body = "def generate_launch_description():\n    return LaunchDescription([Node(package=os.environ['M'], executable='e')])\n"
    assert only(launched({"b/x.launch.py": from_body + body}, {"M": "waffle"})).package == "waffle"


def test_a_default_of_the_environment_is_named(python_launch):
    found = python_launch("""
        return LaunchDescription([Node(package='p', executable=os.environ.get('KIND', 'basic'))])
        """)
    assert found.instances[0].executable == "basic"
    assert found.assumed == {"KIND": "basic"}


def test_a_variable_that_is_assigned_twice_has_its_last_value(python_launch):
    # Trap T26 of robots that were read: the order of assignments matters.
    node = only(
        python_launch("""
        name = 'first'
        name = name + '_second'
        return LaunchDescription([Node(package='p', executable='e', name=name)])
        """)
    )
    assert node.name == "first_second"


def test_helpers_keywords_comprehensions_and_sums(python_launch):
    # Trap T25.
    found = python_launch("""
        def make(name, **kwargs):
            return Node(package='p', executable='e', name=name, **kwargs)

        common = {'namespace': 'robot'}
        ld = LaunchDescription([make(f'n{i}', **common) for i in range(2)] + [make('last', **common)])
        for name in ('x', 'y'):
            if name == 'y':
                continue
            ld.add_action(make(name=name))
        return ld
        """)
    assert names(found) == ["/robot/n0", "/robot/n1", "/robot/last", "/x"]


def test_all_names_of_a_module_are_imported(launched):
    found = launched(
        {
            "a/a.launch.py": "from launch import *\nfrom launch.actions import *\nfrom launch_ros.actions import *\nfrom helpers import *\n"
            "def generate_launch_description():\n    return LaunchDescription([Node(package='p', executable='e', name=NAME), make()])\n",
            "a/helpers.py": "from launch_ros.actions import Node\nNAME = 'n'\ndef make():\n    return Node(package='p', executable='e', name='made')\n",
        }
    )
    assert names(found) == ["/n", "/made"]


def test_an_opaque_function_is_walked_with_the_values_of_arguments(python_launch):
    # Trap T28.
    found = python_launch("""
        def setup(context, *args, **kwargs):
            robots = LaunchConfiguration('robots').perform(context)
            mode = context.launch_configurations['mode']
            if mode == 'none':
                return []
            return [Node(package='p', executable='e', namespace=f'{each}') for each in robots.split(',')]

        return LaunchDescription([
            DeclareLaunchArgument('robots', default_value='a,b'),
            DeclareLaunchArgument('mode', default_value='all'),
            OpaqueFunction(function=setup),
        ])
        """)
    assert names(found) == ["/a/not set", "/b/not set"]


def test_an_opaque_function_on_an_argument_without_value_keeps_both_branches(python_launch):
    found = python_launch("""
        def setup(context):
            if LaunchConfiguration('mode').perform(context) == 'none':
                return []
            return [Node(package='p', executable='e')]

        return LaunchDescription([DeclareLaunchArgument('mode'), OpaqueFunction(function=setup)])
        """)
    assert [guards(each) for each in found.instances] == [["mode is not none"]]


@pytest.mark.parametrize(
    ("test", "expected"),
    [
        ("a == 'x'", ["a is not x"]),
        ("a == 'x' or b == 'y'", ["a is not x", "b is not y"]),
        ("a == 'x' and b == 'y'", ["a == 'x' and b == 'y' (bot.launch.py:22) is not true"]),
        ("not a == 'x'", ["a is x"]),
    ],
)
def test_what_follows_an_undecided_return_is_reached_where_no_branch_left(python_launch, test, expected):
    found = python_launch(f"""
        def setup(context):
            a = LaunchConfiguration('a').perform(context)
            b = LaunchConfiguration('b').perform(context)
            if {test}:
                return []
            return [Node(package='p', executable='e')]

        arguments = [DeclareLaunchArgument('a'), DeclareLaunchArgument('b')]
        return LaunchDescription([*arguments, OpaqueFunction(function=setup)])
        """)
    assert [guards(each) for each in found.instances] == [expected]


def test_scopes_namespaces_and_what_leaks(python_launch):
    found = python_launch("""
        return LaunchDescription([
            GroupAction([
                PushRosNamespace('a'),
                SetParameter('use_sim_time', 'true'),
                SetRemap('/tf', 'tf'),
                GroupAction([PushRosNamespace('b'), Node(package='p', executable='e', name='inner', namespace='c')]),
                Node(package='p', executable='e', name='absolute', namespace='/top'),
                Node(package='p', executable='e', name='outer', remappings=[('x', 'y')], parameters=[{'rate': 1}]),
            ]),
            GroupAction([PushRosNamespace('leaks')], scoped=False),
            Node(package='p', executable='e', name='after'),
        ])
        """)
    assert names(found) == ["/a/b/c/inner", "/top/absolute", "/a/outer", "/leaks/after"]
    inner, _, outer, after = found.instances
    assert outer.remaps == [("/tf", "tf"), ("x", "y")]
    assert values(outer) == {"use_sim_time": "true", "rate": 1}
    assert (after.remaps, after.parameters, inner.remaps) == ([], [], [("/tf", "tf")])


def test_components_and_their_container(python_launch):
    found = python_launch("""
        container = LaunchConfiguration('container')
        return LaunchDescription([
            DeclareLaunchArgument('container', default_value='box'),
            ComposableNodeContainer(
                name=container, namespace='', package='rclcpp_components', executable='component_container',
                composable_node_descriptions=[
                    ComposableNode(package='p', plugin='p::A', name='a', remappings=[('in', 'out')]),
                ]),
            LoadComposableNodes(target_container=container, composable_node_descriptions=[
                ComposableNode(package='p', plugin='p::B', name='b', parameters=[{'x': [1, 2]}]),
            ]),
            LifecycleNode(package='p', executable='e', name='life', namespace=''),
        ])
        """)
    assert [each.kind for each in found.instances] == ["container", "component", "component", "lifecycle_node"]
    assert [each.container for each in found.instances] == [None, "box", "box", None]
    assert [each.executable for each in found.instances[1:3]] == ["p::A", "p::B"]
    assert values(found.instances[2]) == {"x": [1, 2]}


def test_parameter_files_and_what_rewrites_them(python_launch):
    node = only(
        python_launch("""
        share = get_package_share_directory('bot')
        rewritten = ParameterFile(RewrittenYaml(
            source_file=PathJoinSubstitution([share, 'params.yaml']), root_key='robot',
            param_rewrites={'use_sim_time': 'true'}, convert_types=True), allow_substs=True)
        return LaunchDescription([Node(package='p', executable='e', parameters=[rewritten, os.path.join(share, 'b.yaml')])])
        """)
    )
    first, second = node.parameters
    assert isinstance(first, ParameterFile)
    assert (first.path, first.substitutions) == ("$(find-pkg-share bot)/params.yaml", True)
    assert (first.path.root_key, first.path.rewrites) == ("robot", {"use_sim_time": "true"})
    assert second == ParameterFile("$(find-pkg-share bot)/b.yaml", False, node.place)


def test_later_actions_say_what_they_wait_for(python_launch):
    found = python_launch("""
        first = Node(package='p', executable='first')
        return LaunchDescription([
            first,
            TimerAction(period=3.0, actions=[Node(package='p', executable='second')]),
            RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[Node(package='p', executable='third')])),
            SetEnvironmentVariable('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp'),
            ExecuteProcess(cmd=['ros2', 'bag', 'play', 'x']),
        ])
        """)
    assert [each.after for each in found.instances] == ["", "a timer", "event OnProcessExit", ""]
    assert found.variables == {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}
    assert found.instances[3].arguments == ["ros2", "bag", "play", "x"]


def test_what_is_not_understood_is_unknown_with_its_cause(python_launch):
    found = python_launch("""
        import xacro
        text = xacro.process_file('a.xacro').toxml()
        ld = LaunchDescription([Node(package='p', executable='e', parameters=[{'robot_description': text}])])
        while True:
            ld.add_action(Node(package='p', executable='loop'))
        return ld
        """)
    (part,) = unknown_parts(values(found.instances[0]))
    assert part.cause == "`xacro.process_file` of `xacro` is not known"
    assert found.remarks[0].cause.startswith("`while True")


def test_a_substitution_in_an_f_string_is_no_text(python_launch):
    node = only(
        python_launch(
            "return LaunchDescription([Node(package='p', executable='e', name=f\"{LaunchConfiguration('x')}\")])"
        )
    )
    assert next(unknown_parts(node.name)).cause == "a text is made of an object that is none"


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ("\"'a' + 'b'\"", "ab"),
        ('"1 + 2 * 3"', "7"),
        ("\"'x' if 2 > 1 else 'y'\"", "x"),
        ("\"'ndt' in list(set('ndt_gnss'.split('_')).intersection(['ndt']))\"", "True"),
        ("\"__import__('os').getcwd()\"", "?"),
        ("\"open('/etc/passwd').read()\"", "?"),
        ('"9**9**9"', "?"),
        ("\"'a' * 10**9\"", "?"),
        ("\"'{:>1000000000}'.format('a')\"", "?"),
        ('"not python ("', "?"),
    ],
)
def test_expressions_are_walked_and_never_executed(python_launch, expression, text):
    body = f"return LaunchDescription([Node(package='p', executable='e', name=PythonExpression([{expression}]))])"
    assert shown(only(python_launch(body)).name) == text


def test_substitutions(python_launch):
    found = python_launch("""
        held = EqualsSubstitution(LaunchConfiguration('mode'), 'slam')
        return LaunchDescription([
            DeclareLaunchArgument('mode', default_value='slam'),
            Node(package='p', executable='e', name=IfElseSubstitution(held, 'yes', 'no'),
                 condition=IfCondition(NotSubstitution(EqualsSubstitution('1', '2.0')))),
            Node(package='p', executable=Command(['xacro ', 'x']), name=EnvironmentVariable('WHO', default_value='me')),
        ])
        """)
    first, second = found.instances
    assert (first.name, second.name) == ("yes", "me")
    assert next(unknown_parts(second.executable)).cause == "the output of the command `xacro x` is not known"
