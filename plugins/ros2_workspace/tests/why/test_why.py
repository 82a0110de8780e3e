"""`cqos why`: each cause is found, excluded or not known, from any input, and the end says what to do."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.command_process import run, run_here

ROOT = Path(__file__).parents[4]
SIMULATION = ROOT / "plugins/ros2_workspace/tests/workspace/simulation/src"
SYSTEM = """cqos: 1
protocol: ros2
participants:
  camera: {{publishes: {{{published}}}, {camera}}}
  viewer: {{subscribes: {{{subscribed}}}, {viewer}}}
"""


def asked(folder, topic, *arguments):
    done = run_here(["why", *arguments, topic, "--format", "json"], folder)
    assert "Traceback" not in done.err
    assert done.out, done.err
    return done.code, {each["cause"]: each for each in json.loads(done.out)["causes"]}


@pytest.mark.parametrize(
    ("parts", "cause", "do"),
    [
        ({"published": "image: {type: a/msg/A}", "subscribed": "images: {type: a/msg/A}"}, "name", "/image"),
        ({"published": "image: {type: a/msg/A}", "subscribed": "front/image: {type: a/msg/A}"}, "name", "/image"),
        ({"published": "image: {type: a/msg/A}", "subscribed": "image: {type: a/msg/B}"}, "type", "one type"),
        (
            {"published": "image: {reliability: best_effort}", "subscribed": "image: {reliability: reliable}"},
            "quality of service",
            "reliab",
        ),
        ({"camera": "options: {domain: 1}", "viewer": "options: {domain: 2}"}, "domain", "ROS_DOMAIN_ID"),
    ],
)
def test_a_cause_that_the_design_shows_is_found(tmp_path, parts, cause, do):
    defaults = {
        "published": "image: {type: a/msg/A}",
        "subscribed": "image: {type: a/msg/A}",
        "camera": "external: false",
        "viewer": "external: false",
    }
    (tmp_path / "system.yaml").write_text(SYSTEM.format(**{**defaults, **parts}))
    topic = "/front/image" if "front" in str(parts) else "/images" if "images" in str(parts) else "/image"
    code, causes = asked(tmp_path, topic, "system.yaml")
    assert (code, causes[cause]["state"]) == (1, "found"), causes
    assert do in causes[cause]["do"]
    assert [name for name, each in causes.items() if each["state"] == "found"] == [cause]


def test_what_the_files_decide_is_excluded_and_the_rest_is_not_known(tmp_path):
    defaults = {
        "published": "image: {type: a/msg/A}",
        "subscribed": "image: {type: a/msg/A}",
        "camera": "external: false",
        "viewer": "external: false",
    }
    (tmp_path / "system.yaml").write_text(SYSTEM.format(**defaults))
    code, causes = asked(tmp_path, "image", "system.yaml")
    states = {name: each["state"] for name, each in causes.items()}
    assert code == 0
    assert [name for name, state in states.items() if state == "excluded"] == [
        "name",
        "remap",
        "type",
        "quality of service",
    ]
    assert states["domain"] == states["lifecycle"] == states["network interfaces"] == "not known"
    assert all(each["do"] for each in causes.values() if each["state"] == "not known")


@pytest.mark.parametrize(
    ("variable", "cause", "state"),
    [
        ("ROS_LOCALHOST_ONLY=1", "localhost only", "found"),
        ("ROS_LOCALHOST_ONLY=0", "localhost only", "excluded"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE=OFF", "discovery range", "found"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET", "discovery range", "excluded"),
        ("ROS_DISCOVERY_SERVER=10.0.0.1:11811", "discovery server", "not known"),
    ],
)
def test_variables_that_are_stated(tmp_path, variable, cause, state):
    defaults = {
        "published": "image: {}",
        "subscribed": "image: {}",
        "camera": "external: false",
        "viewer": "external: false",
    }
    (tmp_path / "system.yaml").write_text(SYSTEM.format(**defaults))
    assert asked(tmp_path, "/image", "system.yaml", "--define", variable)[1][cause]["state"] == state


def test_a_workspace():
    code, causes = asked(
        ROOT, "/scan", str(SIMULATION), "--launch", "shop_bringup:simulation.launch.py", "--option", "ros2.distro=jazzy"
    )
    assert code == 0
    assert [name for name, each in causes.items() if each["state"] == "excluded"] == [
        "name", "remap", "launch condition", "type", "quality of service", "lifecycle",
    ]  # fmt: skip


def test_a_snapshot_and_a_log(tmp_path):
    log = "[WARN] [1673945160.455] [viewer]: New publisher discovered on topic '/image', offering incompatible QoS. No messages will be received from it. Last incompatible policy: RELIABILITY\n"
    (tmp_path / "run.log").write_text(log)
    defaults = {
        "published": "image: {}",
        "subscribed": "image: {}",
        "camera": "external: false",
        "viewer": "external: false",
    }
    (tmp_path / "system.yaml").write_text(SYSTEM.format(**defaults))
    code, causes = asked(tmp_path, "/image", "system.yaml", "--log", "run.log")
    assert (code, causes["quality of service"]["state"]) == (1, "found")
    piped = run(["why", "system.yaml", "/image", "--log", "-"], tmp_path, stdin=log.encode())
    assert piped == run_here(["why", "system.yaml", "/image", "--log", "run.log"], tmp_path)
    assert "help: write the path of the log" in run_here(["why", "-", "/image", "--log", "-"], tmp_path).err
    snapshot = asked(
        ROOT, "/battery_state", "examples/robot_directory/robot.yaml", "examples/robot_directory/drivers.txt"
    )
    assert snapshot[1]["quality of service"]["state"] == "found"


HASHES = """Topic: /image

Type: a/msg/A

Publisher count: 1

Node name: camera
Node namespace: /
Topic type: a/msg/A
Topic type hash: RIHS01_{first}
Endpoint type: PUBLISHER
GID: 01
QoS profile:
{qos}
Subscription count: 1

Node name: viewer
Node namespace: /
Topic type: a/msg/A
Topic type hash: RIHS01_{second}
Endpoint type: SUBSCRIPTION
GID: 02
QoS profile:
{qos}
"""
QOS = "\n".join(
    [
        *(
            "  Reliability: RELIABLE",
            "  History (Depth): KEEP_LAST (1)",
            "  Durability: VOLATILE",
            "  Lifespan: Infinite",
        ),
        *("  Deadline: Infinite", "  Liveliness: AUTOMATIC", "  Liveliness lease duration: Infinite", ""),
    ]
)


@pytest.mark.parametrize(("second", "state"), [("ab" * 32, "excluded"), ("cd" * 32, "found"), ("00" * 32, "excluded")])
def test_different_definitions_of_a_type(tmp_path, second, state):
    (tmp_path / "image.txt").write_text(HASHES.format(first="ab" * 32, second=second, qos=QOS))
    _, causes = asked(tmp_path, "/image", "image.txt")
    assert causes["type"]["state"] == state, causes["type"]


PROFILES = (
    "<profiles>{}</profiles>",
    '<{0} profile_name="{0}" is_default_profile="true"><qos><partition><names><name>{1}</name></names></partition></qos></{0}>',
)


@pytest.mark.parametrize(
    ("names", "define", "state"),
    [
        (("left", "right"), [], "not known"),
        (
            ("left", "right"),
            ["--option", "ros2.rmw=fastdds", "--define", "RMW_IMPLEMENTATION=rmw_fastrtps_cpp"],
            "found",
        ),
        (("left", "left"), [], "excluded"),
    ],
)
def test_partitions_of_profiles(tmp_path, names, define, state):
    parts = {
        "published": "image: {}",
        "subscribed": "image: {}",
        "camera": "external: false",
        "viewer": "external: false",
    }
    (tmp_path / "system.yaml").write_text(SYSTEM.format(**parts))
    inner = "".join(PROFILES[1].format(*each) for each in zip(("data_writer", "data_reader"), names, strict=True))
    (tmp_path / "profiles.xml").write_text(PROFILES[0].format(inner))
    _, causes = asked(tmp_path, "/image", "system.yaml", "profiles.xml", *define)
    assert causes["partition"]["state"] == state, causes["partition"]


def test_a_topic_that_is_nowhere(tmp_path):
    defaults = {
        "published": "image: {}",
        "subscribed": "image: {}",
        "camera": "external: false",
        "viewer": "external: false",
    }
    (tmp_path / "system.yaml").write_text(SYSTEM.format(**defaults))
    done = run_here(["why", "system.yaml", "/zzzzzz"], tmp_path)
    assert done.code == 1
    assert "no publisher and no subscriber in what was read" in done.out


def test_a_remap_of_another_topic_is_no_cause():
    folder = ROOT / "examples/robot_workspace"
    code, causes = asked(folder, "/scan", "src", "--launch", "bot:sim.launch.xml", "--option", "ros2.distro=jazzy")
    assert (code, causes["name"]["state"]) == (1, "found")
    assert causes["remap"]["state"] == "excluded"
    code, causes = asked(
        folder, "/pose_of_user", "src", "--launch", "bot:sim.launch.xml", "--option", "ros2.distro=jazzy"
    )
    assert causes["remap"]["state"] == "found"
