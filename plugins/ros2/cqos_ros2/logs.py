"""Reads what ROS 2 prints about incompatible endpoints (Foxy to Rolling).

Nodes (rclcpp and rclpy), when they discover one:

    [WARN] [1673945160.455] [robot.talker]: New subscription discovered on topic '/chatter', requesting incompatible
    QoS. No messages will be sent to it. Last incompatible policy: RELIABILITY_QOS_POLICY

The topic is named since Galactic. Only the last policy is named; several may be incompatible. The name of the node stands
before the message, unless the output is formatted otherwise.

`ros2 bag record` (rosbag2_transport, recorder.cpp), about publishers that start after it has subscribed:

    [WARN] [1673945160.455] [rosbag2_recorder]: A new publisher for subscribed topic /scan was found offering
    RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT, but rosbag already subscribed requesting RMW_QOS_POLICY_RELIABILITY_RELIABLE.

`ros2 doctor` (ros2doctor, api/qos_compatibility.py), in one line, and with ``--report`` as a list:

    UserWarning: ERROR: QoS compatibility error found on topic '/scan': Best effort publisher and reliable subscription;

    topic [type]            : /scan [sensor_msgs/msg/LaserScan]
    publisher node          : lidar
    subscriber node         : slam
    compatibility status    : ERROR: Best effort publisher and reliable subscription;
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Role
from cqos_core.packs.log_mismatches import SAME, ListTopic, LogMismatch

_PROTOCOL: Final = "ros2"
_MESSAGE: Final = regular_expression(
    r"New (?P<discovered>subscription|publisher) discovered on (?:topic '(?P<topic>[^']{1,1024})'|this topic), "
    r"(?:requesting|offering) incompatible QoS\."
    r"(?:(?:(?!New (?:subscription|publisher) discovered).){0,200}?Last incompatible policy: (?P<policy>\w{1,64}))?"
)
_LOGGER: Final = regular_expression(r"\[(?P<name>[A-Za-z_][\w./]{0,255})\](?::)?\s*$")
_LEVELS: Final = frozenset({"DEBUG", "INFO", "WARN", "ERROR", "FATAL", "WARNING"})
_POLICIES: Final = {
    "DURABILITY": ("durability",),
    "DEADLINE": ("deadline",),
    # DDS has one policy for both.
    "LIVELINESS": ("liveliness", "liveliness_lease_duration"),
    "LIVELINESS_LEASE_DURATION": ("liveliness_lease_duration",),
    "RELIABILITY": ("reliability",),
    "HISTORY": ("history",),
    "LIFESPAN": ("lifespan",),
    "DEPTH": ("depth",),
}
_SUFFIX: Final = "_QOS_POLICY"
# The publisher discovers the subscription, and writes the line.
_OWN_ROLES: Final[dict[str, Role]] = {"subscription": PUBLISHER, "publisher": SUBSCRIBER}


_RECORDER: Final = regular_expression(
    r"A new publisher for su[bs]{2}cribed topic (?P<topic>\S{1,1024}) was found offering RMW_QOS_POLICY_"
    r"(?P<policy>RELIABILITY|DURABILITY)_\w{1,64}, but rosbag2? already subscribed requesting"
)
_DOCTOR: Final = regular_expression(
    r"QoS compatibility error found on topic '\[?(?P<topic>[^']{1,1024}?)\]?': (?P<reason>.{1,500})"
)
_ROW: Final = regular_expression(r"\s{0,40}(?P<key>topic \[type\]|compatibility status)\s{1,40}: (?P<value>.{1,1500})")
# Words of the reasons that rmw_dds_common gives (qos.cpp), the narrower ones first.
_REASONS: Final = (
    ("liveliness lease", "LIVELINESS_LEASE_DURATION"),
    ("liveliness", "LIVELINESS"),
    ("deadline", "DEADLINE"),
    ("transient local", "DURABILITY"),
    ("best effort", "RELIABILITY"),
)


def read_line(line: str) -> Iterator[LogMismatch | ListTopic]:
    """Yield what one line reports about incompatible endpoints, or which topic the next lines are about."""
    yield from _of_nodes(line)
    for found in _RECORDER.finditer(line):
        node = _node(line[: found.start()])
        policy = found["policy"]
        yield LogMismatch(_PROTOCOL, SUBSCRIBER, found["topic"], node, policy, _POLICIES[policy])
    for found in _DOCTOR.finditer(line):
        yield from (
            LogMismatch(_PROTOCOL, PUBLISHER, found["topic"], None, *each) for each in _reasons(found["reason"])
        )
    row = _ROW.match(line)
    if row is None:
        return
    value = row["value"].strip()
    if row["key"] == "topic [type]":
        yield ListTopic(topic=value.partition(" [")[0])
    elif value.startswith("ERROR"):
        yield from (LogMismatch(_PROTOCOL, PUBLISHER, SAME, None, *each) for each in _reasons(value))


def _reasons(text: str) -> Iterator[tuple[str | None, tuple[str, ...]]]:
    """Yield the policy that each part of a reason names."""
    for part in filter(str.strip, text.removeprefix("ERROR:").split(";")):
        policy = next((name for words, name in _REASONS if words in part.lower()), None)
        yield policy, _POLICIES.get(policy or "", ())


def _of_nodes(line: str) -> Iterator[LogMismatch]:
    start = 0
    for found in _MESSAGE.finditer(line):
        policy = found["policy"]
        yield LogMismatch(
            protocol=_PROTOCOL,
            role=_OWN_ROLES[found["discovered"]],
            topic=found["topic"],
            participant=_node(line[start : found.start()]),
            named=policy,
            policies=_POLICIES.get((policy or "").removesuffix(_SUFFIX), ()),
        )
        start = found.end()


def _node(before: str) -> str | None:
    """Return the full name of the node whose logger stands right before a message: ``[ns.talker]: ``."""
    found = _LOGGER.search(before[-300:])
    if found is None or found["name"] in _LEVELS:
        return None
    return "/" + found["name"].strip("./").replace(".", "/")
