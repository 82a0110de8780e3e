"""`cqos why` on keystores of SROS 2 and on the interfaces of a middleware."""

from __future__ import annotations

import json

import pytest

from tests.command_process import run_here

SYSTEM = """cqos: 1
protocol: ros2
participants:
  lidar: {publishes: {/scan: {type: sensor_msgs/msg/LaserScan}}}
  viewer: {subscribes: {/scan: {type: sensor_msgs/msg/LaserScan}}}
"""
GOVERNANCE = """<dds><domain_access_rules><domain_rule><topic_access_rules>
  <topic_rule><topic_expression>{topic}</topic_expression>
    <enable_read_access_control>{guarded}</enable_read_access_control>
    <enable_write_access_control>{guarded}</enable_write_access_control></topic_rule>
</topic_access_rules></domain_rule></domain_access_rules></dds>
"""
PERMISSIONS = """<dds><permissions><grant name="x">{rules}<default>{default}</default></grant></permissions></dds>
"""
RULE = "<{kind}_rule><{way}><topics><topic>{topic}</topic></topics></{way}></{kind}_rule>"
PUBLISH = RULE.format(kind="allow", way="publish", topic="rt/scan")
SUBSCRIBE = RULE.format(kind="allow", way="subscribe", topic="rt/s*")


def asked(folder, *arguments):
    (folder / "system.yaml").write_text(SYSTEM)
    done = run_here(["why", "system.yaml", "/scan", *arguments, "--format", "json"], folder)
    assert done.out, done.err
    return {each["cause"]: each for each in json.loads(done.out)["causes"]}


def keystore(folder, guarded="true", topic="*", **permissions):
    root = folder / "keystore" / "enclaves"
    root.mkdir(parents=True)
    (root / "governance.xml").write_text(GOVERNANCE.format(guarded=guarded, topic=topic))
    for name, (rules, default) in permissions.items():
        (root / name).mkdir()
        (root / name / "permissions.xml").write_text(PERMISSIONS.format(rules=rules, default=default))
    return ("--keystore", "keystore")


@pytest.mark.parametrize(
    ("made", "state", "text"),
    [
        ({"lidar": (PUBLISH, "DENY"), "viewer": (PUBLISH, "DENY")}, "found", "no enclave may subscribe to it: `/lidar`, `/viewer`"),
        ({"lidar": (PUBLISH, "DENY"), "viewer": (SUBSCRIBE, "DENY")}, "not known", "`/viewer` may not publish it and `/lidar` may not subscribe to it"),
        ({"all": (PUBLISH + SUBSCRIBE, "DENY")}, "excluded", "all enclaves may publish it and subscribe to it: `/all`"),
        ({"all": (PUBLISH.replace("allow", "deny"), "ALLOW")}, "found", "no enclave may publish it: `/all`"),
        ({"guarded": "false", "all": ("", "DENY")}, "excluded", "the governance protects neither side of this topic"),
        ({"guarded": "false", "topic": "rt/other", "all": ("", "DENY")}, "found", "no enclave may publish it: `/all`"),
        ({}, "not known", "the keystore has no permissions"),
    ],
)  # fmt: skip
def test_permissions_of_enclaves_decide(tmp_path, made, state, text):
    answer = asked(tmp_path, *keystore(tmp_path, **made))["security"]
    assert answer["state"] == state
    assert text in answer["text"]


def test_without_security_no_keystore_counts(tmp_path):
    found = keystore(tmp_path, all=("", "DENY"))
    answer = asked(tmp_path, *found, "--define", "ROS_SECURITY_ENABLE=false")["security"]
    assert answer["state"] == "excluded"


def test_a_keystore_that_is_no_xml_ends_with_its_place(tmp_path):
    keystore(tmp_path, all=("", "DENY"))
    (tmp_path / "keystore/enclaves/all/permissions.xml").write_text("<dds>")
    (tmp_path / "system.yaml").write_text(SYSTEM)
    done = run_here(["why", "system.yaml", "/scan", "--keystore", "keystore"], tmp_path)
    assert done.code == 2
    assert "permissions.xml:1" in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("name", "content", "state", "text"),
    [
        ("CYCLONEDDS_URI", '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General></Domain></CycloneDDS>', "found", "`lo` only"),
        ("CYCLONEDDS_URI", "<CycloneDDS><General><NetworkInterfaceAddress>eth0</NetworkInterfaceAddress></General></CycloneDDS>", "not known", "names `eth0`"),
        ("CYCLONEDDS_URI", "<CycloneDDS><General/></CycloneDDS>", "excluded", "names no interface"),
        ("FASTDDS_DEFAULT_PROFILES_FILE", "<profiles><transport_descriptor><interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList></transport_descriptor></profiles>", "found", "`127.0.0.1` only"),
    ],
)  # fmt: skip
def test_the_interfaces_of_a_middleware(tmp_path, name, content, state, text):
    (tmp_path / "own.xml").write_text(content)
    for value in ("own.xml", *([content] if name == "CYCLONEDDS_URI" else [])):
        answer = asked(tmp_path, "--define", f"{name}={value}")["network interfaces"]
        assert answer["state"] == state
        assert text in answer["text"]


def test_a_configuration_that_is_not_there_is_not_known(tmp_path):
    answer = asked(tmp_path, "--define", "CYCLONEDDS_URI=file:///nowhere.xml")["network interfaces"]
    assert (answer["state"], answer["text"]) == ("not known", "CYCLONEDDS_URI is not read")


LAUNCH = """<launch>
  <arg name="static" default="false"/>
  <arg name="view" default="true"/>
  <arg name="mode" default="real"/>
  <arg name="port"/>
  <node pkg="tf2_ros" exec="static_transform_publisher" name="mount" if="$(var static)"/>
  <node pkg="robot_state_publisher" exec="robot_state_publisher" unless="$(var view)"/>
  <node pkg="nav2_map_server" exec="map_server" if="$(eval '&quot;$(var mode)&quot; == &quot;sim&quot;')"/>
  <node pkg="joy" exec="joy_node" if="$(var port)"/>
  <node pkg="teleop_twist_joy" exec="teleop_node" if="$(eval '&quot;$(var static)$(var mode)&quot; == &quot;truesim&quot;')"/>
</launch>
"""


@pytest.mark.parametrize(
    ("topic", "arguments", "state", "text"),
    [
        ("/joint_states", (), "not known", "whether nodes start depends on `port`"),
        ("/tf_static", (), "found", "with `static:=true` the launch starts `/mount`, which publishes it"),
        ("/map", (), "found", "with `mode:=sim` the launch starts `/map_server`, which publishes it"),
        ("/joy", (), "found", "with `port:=true` the launch starts `/joy_node`, which publishes it"),
        ("/scan", ("port:=false",), "not known", "no argument alone starts `teleop_twist_joy teleop_node`"),
    ],
)  # fmt: skip
def test_a_launch_condition_that_is_off(tmp_path, topic, arguments, state, text):
    package = tmp_path / "src" / "bot"
    (package / "launch").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>bot</name></package>")
    (package / "launch" / "a.launch.xml").write_text(LAUNCH)
    given = [word for each in arguments for word in ("--launch-arg", each)]
    done = run_here(["why", "src", topic, "--launch", "bot:a.launch.xml", *given, "--option", "ros2.distro=humble", "--format", "json"], tmp_path)  # fmt: skip
    answers = {each["cause"]: each for each in json.loads(done.out)["causes"]}
    assert (answers["launch condition"]["state"], answers["launch condition"]["text"]) == (state, text)


def test_a_name_is_not_missing_while_an_argument_is_open(tmp_path):
    package = tmp_path / "src" / "bot"
    (package / "launch").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>bot</name></package>")
    (package / "launch" / "a.launch.xml").write_text(
        '<launch><arg name="x"/><node pkg="nav2_map_server" exec="map_server" if="$(var x)"/></launch>'
    )
    done = run_here(["why", "src", "/map", "--launch", "bot:a.launch.xml", "--option", "ros2.distro=humble", "--format", "json"], tmp_path)  # fmt: skip
    answers = {each["cause"]: each["state"] for each in json.loads(done.out)["causes"]}
    assert (answers["name"], answers["launch condition"]) == ("not known", "found")


def test_variables_of_a_node_and_files_that_the_launch_names(tmp_path):
    package = tmp_path / "src" / "bot"
    (package / "launch").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>bot</name></package>")
    (package / "own.xml").write_text('<CycloneDDS><NetworkInterface name="lo"/></CycloneDDS>')
    own = '<env name="ROS_AUTOMATIC_DISCOVERY_RANGE" value="OFF"/>'
    (package / "launch" / "a.launch.xml").write_text(
        '<launch><set_env name="CYCLONEDDS_URI" value="file://$(find-pkg-share bot)/own.xml"/>'
        f'<node pkg="joy" exec="joy_node">{own}</node></launch>'
    )
    done = run_here(["why", "src", "/joy", "--launch", "bot:a.launch.xml", "--option", "ros2.distro=humble", "--format", "json"], tmp_path)  # fmt: skip
    answers = {each["cause"]: each["state"] for each in json.loads(done.out)["causes"]}
    assert (answers["discovery range"], answers["network interfaces"]) == ("found", "found")
