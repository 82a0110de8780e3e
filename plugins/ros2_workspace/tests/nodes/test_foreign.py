"""Node files of other tools in a workspace: designs of Autoware and NoDL are facts beside the node files of C-QoS."""

from __future__ import annotations

import pytest

from cqos_ros2_workspace.launch.launch_evaluation import launch
from cqos_ros2_workspace.launch.workspace import find_packages
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.foreign import read_design, read_nodl
from cqos_ros2_workspace.nodes.library import Library
from cqos_ros2_workspace.nodes.reading import endpoints
from cqos_ros2_workspace.system_join import join

LAUNCH = """<launch>
<node pkg="maps" exec="loader" name="loader"><remap from="~/output/vector" to="/map/vector"/></node>
<node pkg="ears" exec="ear" name="ear"/>
</launch>"""
DESIGN = """autoware_system_design_format: 0.3.0
name: Loader.node
package: {name: maps, provider: demo}
launch: {plugin: "maps::Loader", executable: loader}
subscribers:
  - name: trigger
    message_type: std_msgs/msg/Empty
  - {name: tf, message_type: tf2_msgs/msg/TFMessage, global: /tf}
publishers:
  - name: vector
    message_type: maps/msg/Vector
    qos: {reliability: reliable, durability: transient_local}
  - {name: old, message_type: maps/msg/Vector, remap_target: old_map, qos: {reliability: best_effort}}
servers:
  - {name: get, message_type: maps/srv/Get, remap_target: ~/get}
  - {name: reset, message_type: std_srvs/srv/Empty}
clients:
  - {name: move, message_type: maps/action/Move, remap_target: move}
"""
NODL = """nodl_version: 2
publishers:
  - {name: said, type: std_msgs/msg/String, qos: {history: KEEP_LAST, depth: 3, reliability: BEST_EFFORT, deadline_ns: 5000000}}
subscriptions:
  - name: /map/vector
    type: maps/msg/Vector
    qos: {reliability: RELIABLE, durability: TRANSIENT_LOCAL, lifespan_ns: 0}
service_servers:
  - {name: ask, type: std_srvs/srv/Trigger}
"""


def workspace(tmp_path):
    files = {
        "bot/package.xml": "<package><name>bot</name></package>",
        "bot/launch/bot.launch.xml": LAUNCH,
        "maps/package.xml": "<package><name>maps</name></package>",
        "ears/package.xml": "<package><name>ears</name></package>",
        "ears/interface/ear.nodl.yaml": NODL,
        "designs/package.xml": "<package><name>designs</name><exec_depend>autoware_system_designer</exec_depend></package>",
        "designs/node/Loader.node.yaml": DESIGN,
    }
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return find_packages(str(tmp_path))


def test_designs_and_nodl_are_facts_of_the_launch(tmp_path):
    there = workspace(tmp_path)
    launched = launch(there, str(tmp_path / "bot/launch/bot.launch.xml"), {}, {})
    found = join(launched, there, Library(there), "jazzy").system
    ends = {
        (each.role, each.topic): (
            each.type,
            {name: value.text for name, value in each.settings.items() if not value.unknown},
            (each.place.source.rpartition("/")[2], each.place.line),
        )
        for each in found.endpoints
    }
    assert ends == {
        ("subscriber", "/loader/input/trigger"): ("std_msgs/msg/Empty", {}, ("Loader.node.yaml", 6)),
        ("subscriber", "/tf"): ("tf2_msgs/msg/TFMessage", {}, ("Loader.node.yaml", 8)),
        ("publisher", "/map/vector"): (
            "maps/msg/Vector",
            {"reliability": "reliable", "durability": "transient_local"},
            ("bot.launch.xml", 2),
        ),
        ("publisher", "/old_map"): ("maps/msg/Vector", {"reliability": "best_effort"}, ("Loader.node.yaml", 13)),
        ("subscriber", "/loader/get"): ("maps/srv/Get", {}, ("Loader.node.yaml", 15)),
        ("publisher", "/move"): ("maps/action/Move", {}, ("Loader.node.yaml", 18)),
        ("publisher", "/said"): (
            "std_msgs/msg/String",
            {"history": "keep_last", "depth": "3", "reliability": "best_effort", "deadline": "5000000ns"},
            ("ear.nodl.yaml", 3),
        ),
        ("subscriber", "/map/vector"): (
            "maps/msg/Vector",
            {"reliability": "reliable", "durability": "transient_local", "lifespan": "infinite"},
            ("ear.nodl.yaml", 5),
        ),
        ("subscriber", "/ask"): ("std_srvs/srv/Trigger", {}, ("ear.nodl.yaml", 9)),
    }
    # What a design does not state is not known: its quality of service, and the name of a server.
    trigger = next(each for each in found.endpoints if each.topic == "/loader/input/trigger")
    assert [each.unknown for each in trigger.settings.values()] == ["the file states no quality of service"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[",
        "- 1",
        "autoware_system_design_format: 1",
        "package: {name: [x]}\nlaunch: {plugin: a}",
        "launch: {plugin: a}\npackage: 3",
    ],
)
def test_a_file_that_states_no_node_is_none(text):
    assert read_design("/x.node.yaml", text.encode()) is None
    assert read_nodl("/x.nodl.yaml", text.encode(), "p") is None


def test_a_policy_that_is_not_known_leaves_the_quality_open():
    text = DESIGN.replace("{reliability: best_effort}", "{relaibility: best_effort}")
    found = read_design("/x.node.yaml", text.encode())
    assert found is not None
    old = next(each for each in endpoints(found.nodes["loader"]) if each.name == "old_map")
    assert [each.get(form.UNKNOWN) for each in old.entry.get(form.QOS)] == [
        "the file states `relaibility`, which C-QoS does not know"
    ]
