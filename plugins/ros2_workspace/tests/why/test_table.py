"""The table of `cqos why`: each cause is found, excluded and not known in some run, from each kind of input."""

from __future__ import annotations

import json
from itertools import product
from typing import Final

import pytest

from cqos_ros2_workspace.why.causes import CAUSES
from tests.command_process import run_here

ENDS = "  camera: {{publishes: {{image: {{{0}}}}}, {1}}}\n  viewer: {{subscribes: {{image: {{{2}}}}}, {3}}}\n"
BOTH = "cqos: 1\nprotocol: ros2\nparticipants:\n" + ENDS
FITS = BOTH.format("type: a/msg/A", "options: {domain: 3}", "type: a/msg/A", "options: {domain: 3}")
SPLIT = BOTH.format(
    "type: a/msg/A, reliability: best_effort", "options: {domain: 1}", "type: a/msg/B", "options: {domain: 2}"
)
OPEN = BOTH.format("reliability: unknown", "external: false", "", "external: false")
ALONE = "cqos: 1\nprotocol: ros2\nparticipants: {viewer: {subscribes: {image: {type: a/msg/A}}}}\n"
PROFILES = "<profiles>{}</profiles>".format(
    "".join(
        f'<{tag} profile_name="{tag}" is_default_profile="true"><qos><partition><names><name>{{{tag}}}</name></names>'
        f"</partition></qos></{tag}>"
        for tag in ("data_writer", "data_reader")
    )
)
LEFT, RIGHT = (PROFILES.format(data_writer="left", data_reader=name) for name in ("left", "right"))
SERVER = '<node pkg="nav2_map_server" exec="map_server" name="map_server"/>'
MANAGER = (
    '<node pkg="nav2_lifecycle_manager" exec="lifecycle_manager" name="m"><param name="node_names" value="{}"/>'
    '<param name="autostart" value="{}"/></node>'
)
UNREAD = '<node pkg="no" exec="no"/>'
REPUBLISHED = '<node pkg="robot_state_publisher" exec="robot_state_publisher" name="rsp" if="$(var show)"><param name="robot_description" value="x"/></node>'
SHOW = '<node pkg="tf2_ros" exec="static_transform_publisher" name="mount" if="$(var show)"/>'
GOVERNANCE = (
    "<dds><domain_access_rules><domain_rule><topic_access_rules><topic_rule><topic_expression>*</topic_expression>"
    "<enable_read_access_control>{0}</enable_read_access_control><enable_write_access_control>{0}"
    "</enable_write_access_control></topic_rule></topic_access_rules></domain_rule></domain_access_rules></dds>"
)
REFUSED = '<dds><permissions><grant name="x"><default>DENY</default></grant></permissions></dds>'
INFO = """Type: a/msg/A

Publisher count: 1

Node name: camera
Node namespace: /
Topic type: a/msg/A
Endpoint type: PUBLISHER
GID: 01
QoS profile:
  Reliability: BEST_EFFORT
  History (Depth): KEEP_LAST (1)
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite

Subscription count: 0
"""
BAG = """rosbag2_bagfile_information:
  version: 5
  topics_with_message_count:
    - topic_metadata:
        name: /image
        type: a/msg/A
        serialization_format: cdr
        offered_qos_profiles: "- history: 1\\n  depth: 1\\n  reliability: 2\\n  durability: 2\\n  deadline:\\n    sec: 9223372036\\n    nsec: 854775807\\n  lifespan:\\n    sec: 9223372036\\n    nsec: 854775807\\n  liveliness: 1\\n  liveliness_lease_duration:\\n    sec: 9223372036\\n    nsec: 854775807\\n  avoid_ros_namespace_conventions: false"
      message_count: 1
"""
LOG = (
    "[WARN] [1673945160.455] [viewer]: New publisher discovered on topic '/image', offering incompatible QoS. "
    "No messages will be received from it. Last incompatible policy: RELIABILITY\n"
)


def launch(*nodes: str, argument: str = "show") -> dict[str, str]:
    """The files of a workspace with one launch file."""
    text = f'<launch><arg name="{argument}" default="false"/>{"".join(nodes)}</launch>'
    return {"src/bot/package.xml": "<package><name>bot</name></package>", "src/bot/launch/a.launch.xml": text}


def variables(**values: str) -> list[str]:
    """Arguments that state variables of the environment."""
    return [word for name, value in values.items() for word in ("--define", f"{name}={value}")]


SYSTEM: Final = ["system.yaml"]
WORKSPACE: Final = ["src", "--launch", "bot:a.launch.xml", "--option", "ros2.distro=humble"]
CYCLONE: Final = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='{}'/></Interfaces></General></Domain></CycloneDDS>"
FAST: Final = ["--option", "ros2.rmw=fastdds", *variables(RMW_IMPLEMENTATION="rmw_fastrtps_cpp")]
NEAR, FAR = "127.0.0.1:11811", "10.0.0.2:11811"
RUNS: Final = [
    # topic, files, arguments, and by state the causes that the run shows
    (
        "/image",
        {"system.yaml": FITS, "p.xml": LEFT},
        [*SYSTEM, "p.xml", *variables(
            ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET", ROS_LOCALHOST_ONLY="0", ROS_STATIC_PEERS="10.0.0.2",
            ROS_DISCOVERY_SERVER="", ROS_SECURITY_ENABLE="false", CYCLONEDDS_URI="", FASTDDS_DEFAULT_PROFILES_FILE="",
            FASTRTPS_DEFAULT_PROFILES_FILE="",
        )],
        {"excluded": [
            "name", "remap", "type", "quality of service", "domain", "partition", "discovery range", "static peers",
            "localhost only", "discovery server", "network interfaces", "security",
        ], "not known": ["lifecycle", "launch condition"]},
    ),
    (
        "/image",
        {"system.yaml": SPLIT, "p.xml": RIGHT, "k/enclaves/governance.xml": GOVERNANCE.format("true"), "k/enclaves/a/permissions.xml": REFUSED},
        [*SYSTEM, "--keystore", "k", *variables(
            ROS_AUTOMATIC_DISCOVERY_RANGE="OFF", ROS_LOCALHOST_ONLY="1", ROS_STATIC_PEERS="127.0.0.1",
            ROS_DISCOVERY_SERVER=NEAR, CYCLONEDDS_URI=CYCLONE.format("lo"),
        )],
        {"found": [
            "type", "domain", "discovery range", "static peers", "localhost only", "discovery server",
            "network interfaces", "security",
        ]},
    ),
    (
        "/image",
        {"system.yaml": OPEN},
        SYSTEM,
        {"not known": [
            "type", "quality of service", "domain", "partition", "discovery range", "static peers", "localhost only",
            "discovery server", "network interfaces", "security", "launch condition", "lifecycle",
        ]},
    ),
    (
        "/image",
        {"system.yaml": FITS, "p.xml": RIGHT},
        [*SYSTEM, "p.xml", *FAST, *variables(ROS_DISCOVERY_SERVER=FAR)],
        {"found": ["partition"], "not known": ["discovery server"]},
    ),
    ("/image", {"system.yaml": FITS}, [*SYSTEM, *variables(RMW_IMPLEMENTATION="rmw_cyclonedds_cpp")], {"excluded": ["discovery server"]}),
    # A snapshot, a recording and a log.
    ("/image", {"image.txt": INFO, "system.yaml": ALONE}, ["image.txt", *SYSTEM], {"found": ["quality of service"], "excluded": ["name", "remap", "type"]}),
    ("/image", {"metadata.yaml": BAG, "system.yaml": ALONE}, ["metadata.yaml", *SYSTEM], {"found": ["quality of service"], "excluded": ["name"]}),
    ("/image", {"metadata.yaml": BAG}, ["metadata.yaml"], {"found": ["name"], "not known": ["remap", "type"]}),
    ("/image", {"system.yaml": FITS, "run.log": LOG}, [*SYSTEM, "--log", "run.log"], {"found": ["quality of service"]}),
    # Workspaces.
    ("/map", launch(SERVER, MANAGER.format("[other]", "true")), WORKSPACE, {"found": ["name", "lifecycle"], "excluded": ["remap", "launch condition"]}),
    ("/map", launch(SERVER, MANAGER.format("[map_server]", "true")), WORKSPACE, {"excluded": ["lifecycle"]}),
    ("/map", launch(SERVER, MANAGER.format("[map_server]", "false")), WORKSPACE, {"found": ["name", "lifecycle"]}),
    ("/map", launch(SERVER, MANAGER.format("[map_server]", "$(env X)")), WORKSPACE, {"not known": ["lifecycle"]}),
    ("/map", launch(SERVER), WORKSPACE, {"found": ["name", "lifecycle"]}),
    ("/map", launch(SERVER, MANAGER.replace('<param name="node_names" value="{}"/>', "").format("true")), WORKSPACE, {"found": ["name", "lifecycle"]}),
    ("/map", launch(SERVER, '<node pkg="other" exec="other"/>'), WORKSPACE, {"not known": ["lifecycle"]}),
    ("/map", launch(SERVER, "<lifecycle_transition/>"), WORKSPACE, {"not known": ["lifecycle"]}),
    ("/tf_static", launch(SHOW), WORKSPACE, {"found": ["launch condition"], "not known": ["name"]}),
    # A switch that adds only a subscriber is no cause, and what is not read comes before one that adds a publisher.
    ("/joint_states", launch(UNREAD, REPUBLISHED), WORKSPACE, {"not known": ["name"], "excluded": ["launch condition"]}),
    ("/joint_states", launch(REPUBLISHED), WORKSPACE, {"found": ["name"], "excluded": ["launch condition"]}),
    ("/tf_static", launch(UNREAD, SHOW), WORKSPACE, {"not known": ["name", "launch condition"]}),
    ("/bot/map", launch(SERVER), WORKSPACE, {"found": ["name"]}),
    ("/bot/map", launch(UNREAD, SERVER), WORKSPACE, {"not known": ["name"]}),
    # A process that is no node may publish.
    ("/camera", launch('<executable cmd="ros2 bag play camera"/>'), WORKSPACE, {"not known": ["name"]}),
    ("/camera", launch(UNREAD), WORKSPACE, {"not known": ["name", "remap"]}),
    (
        "/cloud",
        launch('<node pkg="nav2_map_server" exec="map_server" name="map_server"><remap from="cloud" to="points"/></node>'),
        WORKSPACE,
        {"found": ["remap"]},
    ),
]  # fmt: skip


def test_each_cause_has_a_run_in_each_state():
    shown = {(cause, state) for _, _, _, states in RUNS for state, causes in states.items() for cause in causes}
    assert shown == set(product((each.name for each in CAUSES), ("found", "excluded", "not known")))


@pytest.mark.parametrize(("topic", "files", "arguments", "states"), RUNS, ids=range(len(RUNS)))
def test_a_run(tmp_path, topic, files, arguments, states):
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    done = run_here(["why", *arguments, topic, "--format", "json"], tmp_path)
    assert done.out, done.err
    answers = {each["cause"]: each for each in json.loads(done.out)["causes"]}
    for state, causes in states.items():
        assert {cause: answers[cause]["state"] for cause in causes} == dict.fromkeys(causes, state), answers
    for each in answers.values():
        assert each["state"] == "excluded" or each["do"] or each["cause"] in {"type", "name", "quality of service"}, (
            each
        )
