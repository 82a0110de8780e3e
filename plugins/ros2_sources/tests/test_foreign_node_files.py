"""`cqos learn FILE`, from outside: node files from NoDL, and drafts from what ran."""

from __future__ import annotations

import pytest
import yaml

from cqos_core.cli.app import run as command

NODL = """nodl_version: 2
publishers:
  - {name: said, type: std_msgs/msg/String, qos: {history: KEEP_LAST, depth: 3, reliability: BEST_EFFORT, deadline_ns: 5000000}}
"""
DESIGN = """autoware_system_design_format: 0.3.0
name: Loader.node
package: {name: maps, provider: demo}
launch: {plugin: "maps::Loader"}
publishers:
  - {name: vector, message_type: maps/msg/Vector, qos: {reliability: reliable}}
"""
RAN = """cqos: 1
observed: true
protocol: ros2
participants:
  /robot/driver:
    publishes:
      /robot/scan: {type: sensor_msgs/msg/LaserScan, reliability: best_effort, durability: volatile}
      /robot/driver/debug: {type: std_msgs/msg/String, reliability: reliable, durability: transient_local}
      /tf: {type: tf2_msgs/msg/TFMessage, reliability: reliable, durability: volatile}
      /rosout: {type: rcl_interfaces/msg/Log, reliability: reliable, durability: transient_local}
    serves:
      /robot/driver/reset: {type: std_srvs/srv/Empty}
      /robot/driver/get_parameters: {type: rcl_interfaces/srv/GetParameters}
  /robot/filter:
    subscribes:
      /robot/scan: {type: sensor_msgs/msg/LaserScan, reliability: reliable, durability: volatile}
"""
TOPIC_INFO = """/scan
Type: sensor_msgs/msg/LaserScan

Publisher count: 1

Node name: driver
Node namespace: /
Topic type: sensor_msgs/msg/LaserScan
Endpoint type: PUBLISHER
GID: 01.0f.be.d7.11.22.33.44.00.00.00.00.00.00.13.03
QoS profile:
  Reliability: BEST_EFFORT
  History (Depth): UNKNOWN
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite

Subscription count: 0
"""
LAUNCH = """<launch>
<node pkg="bot" exec="driver_node" name="driver"><remap from="scan" to="front/scan"/></node>
<node pkg="bot" exec="filter_node" name="filter"/>
</launch>
"""


OTHERS = (
    ("old.nodl.yaml", "nodl_version: 1\n"),
    ("design.yaml", "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: {}}}}\n"),
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (
        ("ear.nodl.yaml", NODL),
        ("Loader.node.yaml", DESIGN),
        ("ran.yaml", RAN),
        ("i.txt", TOPIC_INFO),
        ("source.py", "# nodl_version of the nodes: 2\n"),
        *OTHERS,
    ):
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture
def run(capsys):
    def of(*arguments):
        code = command([*map(str, arguments)])
        out, err = capsys.readouterr()
        return code, out + err

    return of


def node(path):
    (found,) = yaml.safe_load(path.read_text())["nodes"].values()
    return found


def test_nodl_becomes_a_node_file(folder, run):
    assert run("learn", "ear.nodl.yaml", "--package", "ears") == (0, "ear.node.yaml: 1 endpoint\n")
    text = (folder / "ear.node.yaml").read_text()
    assert yaml.safe_load(text)["package"] == "ears"
    assert node(folder / "ear.node.yaml")["publishes"]["said"][0] == {
        "type": "std_msgs/msg/String",
        "qos": {"history": "keep_last", "depth": 3, "reliability": "best_effort", "deadline": "5000000ns"},
        "at": "ear.nodl.yaml:3",
    }


def test_nodl_in_a_package_needs_no_name_of_it(folder, run):
    inside = folder / "ears" / "nodl" / "ear.nodl.yaml"
    inside.parent.mkdir(parents=True)
    inside.write_text(NODL)
    (folder / "ears" / "package.xml").write_text("<package><name>ears</name></package>")
    assert run("learn", inside, "--output", "out") == (0, "out/ear.node.yaml: 1 endpoint\n")
    assert "package: ears\n" in (folder / "out" / "ear.node.yaml").read_text()


def test_a_design_of_autoware_becomes_one_too(folder, run):
    assert run("learn", "Loader.node.yaml") == (0, "maps_Loader.node.yaml: 1 endpoint\n")
    assert "~/output/vector" in node(folder / "maps_Loader.node.yaml")["publishes"]


def test_what_ran_becomes_a_draft_with_the_names_that_the_code_may_have(folder, run):
    code, said = run("learn", "ran.yaml", "--package", "bot", "--node", "driver=driver_node")
    assert (code, said) == (0, "driver_node.node.yaml: 4 endpoints, to be confirmed\n")
    found = node(folder / "driver_node.node.yaml")
    assert found["name"] == "driver"
    assert [*found["publishes"]] == ["scan", "~/debug", "/tf"], "what every node has is left out"
    assert [*found["serves"]] == ["~/reset"]
    (entry,) = found["publishes"]["scan"]
    assert entry["qos"]["reliability"] == "best_effort"
    assert entry["qos"]["unread"]["depth"] == "discovery does not report it"
    assert entry["at"] == "ran.yaml:7"
    entries = [each for key in ("publishes", "serves") for several in found[key].values() for each in several]
    assert len(entries) == 4
    assert all(each["perhaps"] for each in entries)


def test_the_output_of_ros2_topic_info_will_do(folder, run):
    assert run("learn", "i.txt", "--package", "bot", "--node", "driver")[0] == 0
    (entry,) = node(folder / "driver.node.yaml")["publishes"]["scan"]
    assert entry["qos"]["deadline"] == "infinite"
    assert {*entry["qos"]["unread"]} == {"history", "depth"}


def test_a_draft_decides_nothing_until_it_is_confirmed(folder, run):
    """In this launch the driver is remapped: what was seen in the other run would be a false error."""
    package = folder / "src" / "bot"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>bot</name></package>")
    (package / "bot.launch.xml").write_text(LAUNCH)
    nodes = ("--node", "driver=driver_node", "--node", "/robot/filter=filter_node")
    assert run("learn", "ran.yaml", "--package", "bot", *nodes, "--output", package)[0] == 0
    check = ("check", "src", "--launch", "bot:bot.launch.xml", "--option", "ros2.distro=jazzy")
    code, said = run(*check)
    assert code == 0
    assert "error" not in said
    assert "incompatible" not in said
    assert "unknown" in said
    for name in ("driver_node", "filter_node"):
        file = package / f"{name}.node.yaml"
        found = yaml.safe_load(file.read_text())
        for part in ("publishes", "subscribes"):
            for entries in next(iter(found["nodes"].values())).get(part, {}).values():
                del entries[0]["perhaps"]
        file.write_text(yaml.safe_dump(found))
    (package / "bot.launch.xml").write_text(LAUNCH.replace('to="front/scan"', 'to="scan"'))
    code, said = run(*check)
    assert code == 1
    assert "ROS101" in said


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (["ran.yaml"], "state --package NAME and --node NODE=EXECUTABLE; its nodes: /robot/driver and"),
        (["ran.yaml", "--package", "b", "--node", "/robot/drivr"], "did you mean `/robot/driver`"),
        (["design.yaml", "--package", "b", "--node", "x"], "no node of ROS 2 that was observed"),
        (["missing.yaml", "--package", "b"], "there is no folder `missing.yaml`"),
        (["missing.yaml", "--package", "b", "--node", "x"], "--node is for a file of what ran"),
        (
            ["ran.yaml", "--package", "b", "--node", "driver=a", "--node", "filter=a"],
            "two nodes would be written to `a.node.yaml`",
        ),
        (["old.nodl.yaml", "--package", "b"], "is neither NoDL of version 2 nor a node design"),
        (["source.py"], "for sources, name the folder of their package"),
        (["ear.nodl.yaml"], "is in no package"),
        (["ear.nodl.yaml", "--diff"], "--diff is for sources, and `ear.nodl.yaml` is another file"),
        (["ear.nodl.yaml", "--node", "x"], "`ear.nodl.yaml` states its nodes itself"),
        (["ear.nodl.yaml", "--package", "a", "--package", "b"], "write --package once"),
    ],
)
def test_a_message_names_what_is_missing_or_wrong(folder, run, arguments, wanted):
    before = {*folder.iterdir()}
    code, said = run("learn", *arguments)
    assert code == 2
    assert wanted in " ".join(said.split())
    assert {*folder.iterdir()} == before


def test_a_file_that_is_there_stays(folder, run):
    (folder / "filter.node.yaml").write_text("mine\n")
    nodes = ("--node", "driver", "--node", "filter")
    code, said = run("learn", "ran.yaml", "--package", "bot", *nodes)
    assert code == 2
    assert "`filter.node.yaml` is there already" in said
    assert (folder / "filter.node.yaml").read_text() == "mine\n"
    assert not (folder / "driver.node.yaml").exists(), "all or none"
