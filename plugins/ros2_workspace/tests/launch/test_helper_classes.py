"""Classes of launch files: followed where they pass arguments on, else not known, and then no finding depends on them."""

from __future__ import annotations

import pytest

from cqos_ros2_workspace.launch.findings import findings
from cqos_ros2_workspace.launch.workspace import find_packages

HEAD = """
from elsewhere import Flag as OtherFlag  # This is a module that is not there.
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

class Plain(DeclareLaunchArgument):
    '''An argument.'''

class Flag(DeclareLaunchArgument):
    def __init__(self, name, default=False, **more):
        '''A flag.'''
        text = str(default)
        super().__init__(name, default_value=text, choices=["True", "False"], **more)

class Off(Flag):
    pass

class Driver(Node):
    def __init__(self, name):
        super().__init__(package="drivers", executable="driver", name=name)

class Later(DeclareLaunchArgument):
    def __init__(self, name):
        super().__init__(name, default_value="False")
        self.seen = True

class Doing(DeclareLaunchArgument):
    def execute(self, context):
        context.launch_configurations["x"] = "True"
"""


def launch(body):
    listed = ", ".join(f"{each}" for each in body)
    return f"{HEAD}\ndef generate_launch_description():\n    return LaunchDescription([{listed}])\n"


def twice(name):
    one = f'Node(package="p", executable="e", name="n", condition=IfCondition(LaunchConfiguration("{name}")))'
    return [one, one]


@pytest.mark.parametrize(
    ("declared", "started"),
    [
        ('Plain("x", default_value="False")', 0),
        ('Plain("x", default_value="True")', 2),
        ('Flag("x")', 0),
        ('Flag("x", True)', 2),
        ('Flag(name="x", default=True, description="d")', 2),
        ('Off("x")', 0),
        ('Off("x", default=True)', 2),
    ],
)
def test_a_class_that_passes_arguments_on_is_followed(launched, declared, started):
    found = launched({"bot/launch/bot.launch.py": launch([declared, *twice("x")])})
    assert [bool(each.guards) for each in found.instances] == [False] * started
    assert not found.remarks


@pytest.mark.parametrize("declared", ['OtherFlag("x")', 'Later("x")', 'Doing("x")'])
def test_a_class_that_is_not_followed_may_decide_an_argument(launched, declared):
    found = launched({"bot/launch/bot.launch.py": launch([declared, *twice("x")])})
    assert len(found.instances) == 2
    assert all(each.guards for each in found.instances)
    assert found.remarks
    assert findings(found, find_packages(found.root)) == []


def test_nodes_that_run_for_sure_are_still_compared(launched):
    found = launched({"bot/launch/bot.launch.py": launch(['OtherFlag("x")', 'Driver("one")', 'Driver("one")'])})
    assert [(each.package, each.name) for each in found.instances] == [("drivers", "one")] * 2
    assert [each.name for each in findings(found, find_packages(found.root))] == ["two-nodes-of-one-name"]
