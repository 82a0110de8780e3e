"""What is surely wrong with a launch: names that stand twice, sections of parameter files that miss a node."""

from __future__ import annotations

import pytest

from cqos_ros2_workspace.launch.findings import findings
from cqos_ros2_workspace.launch.workspace import find_packages


def found(launched, files):
    launch = launched(files)
    return [
        (each.name, each.place.line, each.other.line if each.other else None)
        for each in findings(launch, find_packages(launch.root))
    ]


def xml(body):
    return f'<launch><arg name="sim"/>\n{body}\n</launch>'


def node(name, more="", inner=""):
    return f'<node pkg="p" exec="e" name="{name}" {more}>{inner}</node>\n'


PARAMS = '<param from="$(find-pkg-share a)/config/p.yaml"/>'


@pytest.mark.parametrize(
    ("nodes", "expected"),
    [
        ([node("n"), node("n")], [("two-nodes-of-one-name", 3, 2)]),
        ([node("n"), node("m")], []),
        ([node("n"), node("n", 'namespace="x"')], []),
        # The branches of one argument exclude each other, and of two arguments it is not known.
        ([node("n", 'if="$(var sim)"'), node("n", 'unless="$(var sim)"')], []),
        ([node("n", 'if="$(var sim)"'), node("n", 'if="$(var other)"')], []),
        ([node("n", 'if="$(var sim)"'), node("n")], [("two-nodes-of-one-name", 3, 2)]),
        # A node without a name has one in its code, which is not known here.
        ([node("n"), '<node pkg="p" exec="e"/>\n', '<node pkg="p" exec="e"/>\n'], []),
        ([node("$(var unknown)"), node("$(var unknown)")], []),
    ],
)
def test_two_nodes_of_one_name(launched, nodes, expected):
    assert found(launched, {"a/launch/a.launch.xml": xml("".join(nodes).rstrip())}) == expected


def test_a_node_that_an_event_starts_again_is_no_second_one(python_launch):
    launch = python_launch("""
        def make():
            return Node(package='p', executable='e', name='n')

        first = make()
        return LaunchDescription([first, RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[make()]))])
        """)
    assert findings(launch, find_packages(launch.root)) == []


@pytest.mark.parametrize(
    ("section", "more", "expected"),
    [
        ("amcl", "", False),
        ("/amcl", "", False),
        ("/**", "", False),
        ("/*", "", False),
        ("'*'", "", False),
        ("amlc", "", True),
        ("amcl_", "", True),
        # Another node may run inside a program; only what is nearly the name of this one is reported.
        ("local_costmap", "", False),
        ("amcl", 'namespace="robot"', True),
        ("/robot/amcl", 'namespace="robot"', False),
        ("/**/amcl", 'namespace="robot"', False),
        ("/*/amcl", 'namespace="robot"', False),
        ("/other/amcl", 'namespace="robot"', True),
        ("$(var section)", "", False),
    ],
)
def test_a_section_that_names_no_node(launched, section, more, expected):
    files = {
        "a/launch/a.launch.xml": xml(node("amcl", more, PARAMS).rstrip()),
        "a/config/p.yaml": f"unrelated:\n  ros__parameters: {{x: 1}}\n{section}:\n  ros__parameters: {{rate: 5}}\n",
    }
    assert found(launched, files) == ([("section-names-no-node", 3, 2)] if expected else [])


def test_nested_sections_are_namespaces(launched):
    files = {
        "a/launch/a.launch.xml": xml(node("amcl", 'namespace="robot"', PARAMS).rstrip()),
        "a/config/p.yaml": "robot:\n  amcl:\n    ros__parameters: {rate: 5}\n",
    }
    assert found(launched, files) == []


def test_a_section_for_another_node_of_the_launch_is_used(launched):
    files = {
        "a/launch/a.launch.xml": xml(node("amcl", "", PARAMS) + node("amcl2").rstrip()),
        "a/config/p.yaml": "amcl2:\n  ros__parameters: {rate: 5}\n",
    }
    assert found(launched, files) == []


@pytest.mark.parametrize(("root_key", "expected"), [("robot", []), ("", [("section-names-no-node", 1, 15)])])
def test_a_rewritten_file_is_put_below_its_root_key(launched, root_key, expected):
    launch = (
        "import os\nfrom ament_index_python.packages import get_package_share_directory\nfrom launch import LaunchDescription\n"
        "from launch_ros.actions import Node\nfrom nav2_common.launch import RewrittenYaml\n\n\n"
        "def generate_launch_description():\n    share = get_package_share_directory('a')\n    params = RewrittenYaml(\n"
        f"        source_file=os.path.join(share, 'config', 'p.yaml'), root_key={root_key!r},\n        param_rewrites={{}},\n"
        "    )\n    return LaunchDescription([\n        Node(package='p', executable='e', name='amcl', namespace='robot', parameters=[params]),\n    ])\n"
    )
    files = {"a/launch/a.launch.py": launch, "a/config/p.yaml": "amcl:\n  ros__parameters: {rate: 5}\n"}
    assert found(launched, files) == expected
