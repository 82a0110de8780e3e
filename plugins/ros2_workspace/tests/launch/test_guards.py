"""What stands under a condition that is not decided is never shown as certain."""

from __future__ import annotations

import pytest

from cqos_ros2_workspace.launch.values import shown

SETUP = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

def setup(context):
    sim = LaunchConfiguration('sim').perform(context) == 'true'
    remaps, words, files = [('scan', 'a')], [], ['a.yaml']
    if sim:
        remaps, words, files = [('scan', 'b')], ['--ros-args', '-r', 'x:=y', '-r', '__node:=s', '-p', 'q:=1'], ['b.yaml']
    return [Node(package='p', executable='e', name='n', remappings=remaps, arguments=words, parameters=files)]

def generate_launch_description():
    return LaunchDescription([DeclareLaunchArgument('sim'), OpaqueFunction(function=setup)])
"""
XML = """
<launch>
  <arg name="sim"/>
  <group if="$(var sim)">
    <set_remap from="scan" to="z"/><set_parameter name="q" value="1"/><node pkg="p" exec="e" name="inside"/>
  </group>
  <set_remap from="odom" to="y" unless="$(var sim)"/>
  <set_parameter name="r" value="2" if="$(var sim)"/>
  <set_use_sim_time value="true"/>
  <node pkg="p" exec="e" name="outside"/>
</launch>
"""


@pytest.fixture
def nodes(launched):
    """Read the launch of one text; return its nodes by name."""
    return lambda name, text: {shown(each.name): each for each in launched({f"bot/launch/{name}": text}).instances}


def remaps(node):
    return [(shown(source), shown(target)) for source, target in node.remaps]


def stated(node):
    return [shown(getattr(each, "values", None) or each.path) for each in node.parameters]


def test_branches_of_python_keep_their_conditions(nodes):
    [(name, node)] = nodes("a.launch.py", SETUP).items()
    assert name == "(s if sim is true; n if sim is not true)"
    assert remaps(node) == [
        ("(x if sim is true)", "y"),
        ("(scan if sim is true)", "b"),
        ("(scan if sim is not true)", "a"),
    ]
    assert stated(node) == ["{q: (1 if sim is true)}", "(b.yaml if sim is true)", "(a.yaml if sim is not true)"]


def test_what_a_scope_sets_under_a_condition_keeps_it(nodes):
    found = nodes("a.launch.xml", XML)
    assert remaps(found["inside"]) == [("scan", "z")]
    assert stated(found["inside"]) == ["{q: 1}"]
    assert remaps(found["outside"]) == [("(odom if sim is not true)", "y")]
    assert stated(found["outside"]) == ["{r: (2 if sim is true)}", "{use_sim_time: true}"]
