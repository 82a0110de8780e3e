"""Hashes of types: from message files, against those that ROS 2 printed, and in `cqos why`."""

from __future__ import annotations

import json

import pytest

from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.launch.workspace import find_packages
from cqos_ros2_workspace.why.definitions import Definitions
from tests.command_process import run_here

FLOATS = ["angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max"]
LASER = "# one scan\nstd_msgs/Header header # stamp\n" + "".join(f"float32 {each}\n" for each in FLOATS)
LASER += "float32[] ranges\nfloat32[] intensities\n"
IMU = """Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
""".replace("Header", "std_msgs/Header", 1)
IMAGE = "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n"
PRINTED = {
    ("std_msgs", "String", "string data\n"): "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    ("std_msgs", "Empty", "# nothing\n"): "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    ("sensor_msgs", "LaserScan", LASER): "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    ("sensor_msgs", "Image", IMAGE): "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    ("sensor_msgs", "Imu", IMU): "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
}
"""Message files in our own words, and the hashes that recordings and `ros2 topic info` of real systems show."""
BLOCK = """Node name: {node}
Node namespace: /
Topic type: bot_msgs/msg/Power
Topic type hash: RIHS01_{digest}
Endpoint type: {role}
GID: 01.0f.be.d7.11.22.33.44.00.00.00.00.00.00.{number}.03
QoS profile:
  Reliability: RELIABLE
  History (Depth): KEEP_LAST (10)
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite

"""


def package(folder, name, **messages):
    inside = folder / name / "msg"
    inside.mkdir(parents=True)
    (folder / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
    for last, text in messages.items():
        (inside / f"{last}.msg").write_text(text)


def hash_of(folder, name):
    return Definitions(find_packages(str(folder))).find(name)


@pytest.mark.parametrize(("message", "digest"), PRINTED.items(), ids=[each[1] for each in PRINTED])
def test_hashes_are_those_that_ros_prints(tmp_path, message, digest):
    name, last, text = message
    package(tmp_path, name, **{last: text})
    found = hash_of(tmp_path, f"{name}/msg/{last}")
    assert found.digest == digest
    assert found.path == f"{name}/msg/{last}.msg"


def test_constants_defaults_and_comments_are_no_part_of_a_definition(tmp_path):
    package(tmp_path, "a", T="uint8 ON=1\nstring<=5[<=3] names # some\nint32 level 7\nstring word 'a#b'\n")
    package(tmp_path, "b", T="string<=5[<=3] names\nint32 level\nstring word\n")
    one, other = (hash_of(tmp_path, f"{each}/msg/T").digest for each in "ab")
    assert one != other, "the name of the package is a part of it"
    (tmp_path / "b" / "msg" / "T.msg").write_text("uint8 ON=1\nstring<=5[<=3] names\nint32 level\nstring word 'c'\n")
    assert hash_of(tmp_path, "b/msg/T").digest == other
    (tmp_path / "b" / "msg" / "T.msg").write_text("string<=6[<=3] names\nint32 level\nstring word\n")
    assert hash_of(tmp_path, "b/msg/T").digest != other


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("far_msgs/Thing thing\n", "no message file of `far_msgs/msg/Thing`"),
        ("Missing thing\n", "no message file of `bot_msgs/msg/Missing`"),
        ("uint8 1st\n", "a line that is not understood: `uint8 1st`"),
    ],
)
def test_what_is_not_there_or_not_understood_is_unknown(tmp_path, text, cause):
    package(tmp_path, "bot_msgs", Power=text)
    found = hash_of(tmp_path, "bot_msgs/msg/Power")
    assert isinstance(found, Unknown)
    assert cause in found.cause


def test_a_message_that_contains_itself_ends(tmp_path):
    package(tmp_path, "bot_msgs", Power="Power inner\n")
    assert hash_of(tmp_path, "bot_msgs/msg/Power").digest


def asked(folder, *files):
    done = run_here(["why", *files, "/power", "--format", "json"], folder)
    assert done.out, done.err
    return next(each for each in json.loads(done.out)["causes"] if each["cause"] == "type")


def snapshot(folder, name, *ends):
    blocks = [
        BLOCK.format(node=node, digest=digest, role=role, number=10 + at)
        for at, (node, role, digest) in enumerate(ends)
    ]
    (folder / name).write_text("/power\nType: bot_msgs/msg/Power\n\n" + "".join(blocks))


def test_what_runs_with_another_definition_than_the_workspace_is_found(tmp_path):
    package(tmp_path / "src", "bot_msgs", Power="float32 volts\nfloat32 amperes\n")
    (tmp_path / "src" / "design.yaml").write_text(
        "cqos: 1\nprotocol: ros2\nparticipants:\n  display: {subscribes: {/power: {type: bot_msgs/msg/Power}}}\n"
    )
    snapshot(tmp_path, "ran.txt", ("battery", "PUBLISHER", "ab" * 32))
    found = asked(tmp_path, "ran.txt", "src")
    assert found["state"] == "found"
    assert (
        "`/battery` runs another definition of `bot_msgs/msg/Power` (abababab…) than bot_msgs/msg/Power.msg"
        in found["text"]
    )
    assert found["do"] == "build both sides with the same message files"
    digest = hash_of(tmp_path / "src", "bot_msgs/msg/Power").digest
    snapshot(tmp_path, "ran.txt", ("battery", "PUBLISHER", digest))
    found = asked(tmp_path, "ran.txt", "src")
    assert found["state"] == "excluded"
    assert "what runs has the definition in bot_msgs/msg/Power.msg" in found["text"]
    (tmp_path / "src" / "bot_msgs" / "msg" / "Power.msg").unlink()
    found = asked(tmp_path, "ran.txt", "src")
    assert found["state"] == "excluded"
    assert "shows only on the robot (the workspace has no message file of `bot_msgs/msg/Power`)" in found["text"]


def test_hashes_of_several_snapshots_are_compared(tmp_path):
    snapshot(tmp_path, "one.txt", ("battery", "PUBLISHER", "ab" * 32))
    snapshot(tmp_path, "other.txt", ("display", "SUBSCRIPTION", "cd" * 32))
    found = asked(tmp_path, "one.txt", "other.txt")
    assert found["state"] == "found"
    assert "`/battery` with abababab… and `/display` with cdcdcdcd…" in found["text"]
    snapshot(tmp_path, "other.txt", ("display", "SUBSCRIPTION", "ab" * 32))
    found = asked(tmp_path, "one.txt", "other.txt")
    assert found["state"] == "excluded"
    assert "from one definition (abababab…)" in found["text"]
