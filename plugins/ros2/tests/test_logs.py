"""What ROS 2 nodes print when they discover an endpoint that does not fit, in every wording and behind every prefix."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.packs.log_mismatches import LogMismatch, read_mismatches
from cqos_ros2.logs import read_line
from cqos_ros2.policies import POLICIES

ASKS = "New subscription discovered on topic '/scan', requesting incompatible QoS. No messages will be sent to it. "
OFFERS = "New publisher discovered on topic '/scan', offering incompatible QoS. No messages will be {} it. "
LAST = "Last incompatible policy: "


def read(line):
    return list(read_line(line))


@pytest.mark.parametrize(
    ("message", "role", "topic", "named", "policies"),
    [
        (f"{ASKS}{LAST}RELIABILITY_QOS_POLICY", "publisher", "/scan", "RELIABILITY_QOS_POLICY", ("reliability",)),
        (f"{ASKS}{LAST}RELIABILITY", "publisher", "/scan", "RELIABILITY", ("reliability",)),
        (
            f"{OFFERS.format('sent to')}{LAST}DURABILITY_QOS_POLICY",
            "subscriber",
            "/scan",
            "DURABILITY_QOS_POLICY",
            ("durability",),
        ),
        (f"{OFFERS.format('received from')}{LAST}DEADLINE", "subscriber", "/scan", "DEADLINE", ("deadline",)),
        (
            f"{ASKS}{LAST}LIVELINESS_QOS_POLICY",
            "publisher",
            "/scan",
            "LIVELINESS_QOS_POLICY",
            ("liveliness", "liveliness_lease_duration"),
        ),
        (f"{ASKS}{LAST}INVALID_QOS_POLICY", "publisher", "/scan", "INVALID_QOS_POLICY", ()),
        (
            ASKS.replace("topic '/scan'", "this topic") + f"{LAST}RELIABILITY_QOS_POLICY",
            "publisher",
            None,
            "RELIABILITY_QOS_POLICY",
            ("reliability",),
        ),
        (ASKS.replace("/scan", "chatter") + f"{LAST}DEADLINE", "publisher", "chatter", "DEADLINE", ("deadline",)),
        (ASKS, "publisher", "/scan", None, ()),
        (ASKS[:-20], "publisher", "/scan", None, ()),
    ],
)
def test_every_wording(message, role, topic, named, policies):
    assert read(message) == [LogMismatch("ros2", role, topic, None, named, policies)]


@pytest.mark.parametrize(
    ("prefix", "node"),
    [
        ("", None),
        ("[WARN] [1673945160.455319911] [talker]: ", "/talker"),
        ("[talker-1] [WARN] [1673945160.455319911] [talker]: ", "/talker"),
        ("[WARN] [1673945160.455319911] [robot.arm.talker]: ", "/robot/arm/talker"),
        ("Jan 12 10:00:00 host ros2[123]: [talker-1] [WARN] [1.2] [talker]: ", "/talker"),
        ("2024-01-12T10:00:00+0100 host ros2[123]: [WARN] [1.2] [talker]: ", "/talker"),
        ("1673945160.455 [talker]: ", "/talker"),
        ("[1673945160.455] [WARN]: ", None),
        ("[talker-1] ", None),
        ("[talker]", "/talker"),
        ("INFO: [x] something ", None),
    ],
)
def test_every_prefix(prefix, node):
    (found,) = read(f"{prefix}{ASKS}{LAST}RELIABILITY")
    assert found.participant == node


def test_several_in_one_line():
    line = f"[WARN] [1] [a]: {ASKS}{LAST}RELIABILITY [WARN] [2] [b]: {ASKS}[WARN] [3] [c]: {ASKS}{LAST}DEADLINE"
    assert [(each.participant, each.named) for each in read(line)] == [
        ("/a", "RELIABILITY"),
        ("/b", None),
        ("/c", "DEADLINE"),
    ]


@pytest.mark.parametrize(
    "line",
    [
        "",
        "New subscription discovered",
        "requesting incompatible QoS",
        f"{LAST}RELIABILITY",
        "'" * 100_000,
        "[" * 60_000,
    ],
)
def test_other_lines(line):
    assert read(line) == []


@given(st.text())
def test_any_text(text):
    found = read(text + ASKS + text)
    assert len(found) >= 1


def test_policies_are_those_of_the_pack():
    known = {policy.name for policy in POLICIES}
    for name in ("DURABILITY", "DEADLINE", "LIVELINESS", "RELIABILITY", "HISTORY", "LIFESPAN", "DEPTH"):
        (found,) = read(f"{ASKS}{LAST}{name}_QOS_POLICY")
        assert found.policies
        assert known.issuperset(found.policies)


RECORDER = (
    "[WARN] [1.2] [rosbag2_recorder]: A new publisher for {} topic /scan was found offering RMW_QOS_POLICY_{}, but {} "
    "already subscribed requesting RMW_QOS_POLICY_{}. Messages from this new publisher will not be recorded."
)


@pytest.mark.parametrize(
    ("words", "policy"),
    [
        (("subscribed", "RELIABILITY_BEST_EFFORT", "rosbag", "RELIABILITY_RELIABLE"), "RELIABILITY"),
        (("susbcribed", "DURABILITY_VOLATILE", "rosbag2", "DURABILITY_TRANSIENT_LOCAL"), "DURABILITY"),
    ],
)
def test_the_recorder_names_a_publisher_that_it_does_not_record(words, policy):
    expected = LogMismatch("ros2", "subscriber", "/scan", "/rosbag2_recorder", policy, (policy.lower(),))
    assert read(RECORDER.format(*words)) == [expected]


def test_the_doctor_names_topics_with_errors():
    line = "UserWarning: ERROR: QoS compatibility error found on topic '[/scan]': Best effort publisher and reliable subscription;"
    assert read(line) == [LogMismatch("ros2", "publisher", "/scan", None, "RELIABILITY", ("reliability",))]


REPORT = b"""
   QOS COMPATIBILITY LIST
topic [type]            : /odom [nav_msgs/msg/Odometry]
publisher node          : base
subscriber node         : nav
compatibility status    : OK
topic [type]            : /scan [sensor_msgs/msg/LaserScan]
publisher node          : lidar
subscriber node         : slam
compatibility status    : ERROR: Best effort publisher and reliable subscription;ERROR: Subscription deadline is less than publisher deadline;
compatibility status    : No publisher/subscriber pairs found
"""


def test_the_report_of_the_doctor_is_a_list():
    found, _ = read_mismatches("doctor.txt", io.BytesIO(REPORT), [read_line])
    assert [(each.misfit.topic, each.misfit.policies, each.place.line) for each in found] == [
        ("/scan", ("reliability",), 10),
        ("/scan", ("deadline",), 10),
    ]


@pytest.mark.parametrize(
    ("reason", "policies"),
    [
        ("Volatile publisher and transient local subscription", ("durability",)),
        ("Subscription has a deadline, but publisher does not", ("deadline",)),
        (
            "Publisher's liveliness is automatic and subscription's is manual by topic",
            ("liveliness", "liveliness_lease_duration"),
        ),
        ("Subscription has a liveliness lease duration, but publisher does not", ("liveliness_lease_duration",)),
        ("Something that a later version says", ()),
    ],
)
def test_reasons_of_the_doctor(reason, policies):
    (found,) = read(f"QoS compatibility error found on topic '/t': {reason};")
    assert found.policies == policies
