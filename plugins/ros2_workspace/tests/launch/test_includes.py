"""Includes, the two other languages of launch files, and workspaces on disk."""

from __future__ import annotations

import textwrap

from cqos_ros2_workspace.launch.launch_result import ParameterFile, ParameterValues
from cqos_ros2_workspace.launch.values import shown
from cqos_ros2_workspace.launch.workspace import find_packages, root_of

NODE = '<launch><node pkg="p" exec="e" name="$(var name n)" namespace="$(var ns \'\')"/></launch>'


def names(found):
    return [f"{shown(each.namespace)}/{shown(each.name)}" for each in found.instances]


def xml(body):
    return f"<launch>{body}</launch>"


def test_arguments_go_down_through_includes_of_other_packages(launched):
    inner = xml(
        '<arg name="ns" default="none"/><group><push-ros-namespace namespace="$(var ns)"/>'
        '<node pkg="p" exec="e" name="n"/></group>'
    )
    found = launched(
        {
            "a/launch/a.launch.xml": xml(
                '<include file="$(find-pkg-share b)/launch/b.launch.xml"><arg name="ns" value="robot"/></include>'
            ),
            "b/launch/b.launch.xml": inner,
        }
    )
    assert names(found) == ["/robot/n"]
    assert [place.line for place in found.instances[0].via] == [1]


def test_an_include_sees_and_changes_the_configurations_of_its_includer(launched):
    # Trap T29; includes are no scopes.
    found = launched(
        {
            "a/a.launch.xml": xml(
                '<let name="ns" value="x"/><include file="$(dirname)/b.launch.xml"/><node pkg="p" exec="e" name="$(var set_inside)"/>'
            ),
            "a/b.launch.xml": xml('<node pkg="p" exec="e" name="$(var ns)"/><let name="set_inside" value="y"/>'),
        }
    )
    assert names(found) == ["/x", "/y"]


def test_both_files_of_an_undecided_include_are_read(launched):
    found = launched(
        {
            "a/a.launch.xml": xml(
                '<arg name="sim"/><include file="$(dirname)/b.launch.xml" if="$(var sim)"/>'
                '<include file="$(dirname)/c.launch.xml" unless="$(var sim)"/>'
            ),
            "a/b.launch.xml": xml('<node pkg="p" exec="b"/>'),
            "a/c.launch.xml": xml('<node pkg="p" exec="c"/>'),
        }
    )
    assert [(each.executable, str(each.guards[0])) for each in found.instances] == [
        ("b", "sim is true"),
        ("c", "sim is not true"),
    ]


def test_the_tags_of_xml(launched):
    found = launched(
        {
            "a/a.launch.xml": xml(
                textwrap.dedent("""
                <set_env name="RMW_IMPLEMENTATION" value="rmw_zenoh_cpp"/>
                <group>
                  <push_ros_namespace namespace="robot"/>
                  <set_remap from="/tf" to="tf"/>
                  <node pkg="p" exec="e" name="n" args="--flag --ros-args -p rate:=3">
                    <param name="limits"><param name="speed" value="1.5"/></param>
                    <param name="label" value="5" type="str"/>
                    <param from="$(find-pkg-share a)/p.yaml" allow_substs="true"/>
                    <remap from="scan" to="$(var laser front)/scan"/>
                  </node>
                </group>
                <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
                  <composable_node pkg="p" plugin="p::A" name="a"/>
                </node_container>
                <load_composable_node target="/box">
                  <composable_node pkg="p" plugin="p::B" name="b"/>
                </load_composable_node>
                <unknown_tag/>
                """)
            )
        }
    )
    node, container, first, second = found.instances
    assert (node.namespace, node.remaps) == ("/robot", [("/tf", "tf"), ("scan", "front/scan")])
    assert [each.values for each in node.parameters if isinstance(each, ParameterValues)] == [
        {"rate": 3},  # arguments stand first on the command line
        {"limits.speed": 1.5},
        {"label": "5"},
    ]
    assert [each.substitutions for each in node.parameters if isinstance(each, ParameterFile)] == [True]
    assert (container.kind, first.container, second.container) == ("container", "box", "/box")
    assert found.variables == {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}
    assert [each.cause for each in found.remarks] == ["there is no tag `unknown_tag` that C-QoS knows"]


def test_the_same_in_yaml(launched):
    found = launched(
        {
            "a/a.launch.yaml": textwrap.dedent("""
            launch:
            - arg: {name: ns, default: robot}
            - group:
              - push-ros-namespace: {namespace: $(var ns)}
              - node:
                  pkg: p
                  exec: e
                  name: n
                  param:
                  - {name: rate, value: 5}
                  - {from: $(find-pkg-share a)/p.yaml}
                  remap:
                  - {from: scan, to: front/scan}
            - include:
                file: $(dirname)/b.launch.xml
                arg:
                - {name: name, value: included}
            """),
            "a/b.launch.xml": NODE,
        }
    )
    first, _ = found.instances
    assert names(found) == ["/robot/n", "/robot/included"]
    assert first.remaps == [("scan", "front/scan")]
    assert first.parameters[0].values == {"rate": 5}
    assert first.place.line == 6


def test_a_package_that_is_not_there_is_named(launched):
    found = launched({"a/a.launch.xml": xml('<include file="$(find-pkg-share gazebo_ros)/launch/g.launch.py"/>')})
    assert [(each.package, each.about) for each in found.remarks] == [("gazebo_ros", "include")]


def test_an_installed_path_that_is_flattened_is_found_by_its_name(launched):
    found = launched(
        {"a/a.launch.xml": xml('<include file="$(find-pkg-share b)/b.launch.xml"/>'), "b/launch/b.launch.xml": NODE}
    )
    assert names(found) == ["/n"]


def test_packages_are_found_as_colcon_finds_them(workspace):
    root = workspace(
        {
            "a/package.xml": "<package><name>first</name></package>",
            "copy/package.xml": "<package><name>first</name></package>",
            "broken/package.xml": "<package><name>",
            "build/x/package.xml": "<package><name>built</name></package>",
            "ignored/COLCON_IGNORE": "",
            "ignored/x/package.xml": "<package><name>ignored</name></package>",
            "a/inner/package.xml": "<package><name>inner</name></package>",
        }
    )
    (root / "ignored" / "package.xml").unlink(missing_ok=True)
    (root / "build" / "package.xml").unlink(missing_ok=True)
    (root / "loop").symlink_to(root)
    found = find_packages(str(root))
    assert list(found.packages) == ["first"]
    assert [name for name, _ in found.repeated] == ["first"]
    assert len(found.unreadable) == 1
    assert root_of(str(root / "a" / "x.launch.py")) == str(root)


def test_a_python_module_of_a_package_is_read(launched):
    helper = "from launch_ros.actions import Node\ndef make(name):\n    return Node(package='p', executable='e', name=name)\n"
    body = "from {}.helper import make\nfrom launch import LaunchDescription\ndef generate_launch_description():\n    return LaunchDescription([make('made')])\n"
    assert names(launched({"a/a.launch.py": body.format("tools"), "tools/tools/helper.py": helper})) == ["/made"]


def test_a_module_beside_the_file_is_read(launched):
    # Trap T25: drivers add the folder to the path of Python.
    helper = "from launch_ros.actions import Node\ndef make(name):\n    return Node(package='p', executable='e', name=name)\n"
    body = "import sys\nsys.path.append('x')\nimport helper\nfrom launch import LaunchDescription\ndef generate_launch_description():\n    return LaunchDescription([helper.make('made')])\n"
    assert names(launched({"a/a.launch.py": body, "a/helper.py": helper})) == ["/made"]
