"""Reads what ROS 2 nodes print when they discover an endpoint that does not fit (rclcpp and rclpy, Foxy to Rolling).

    [WARN] [1673945160.455] [robot.talker]: New subscription discovered on topic '/chatter', requesting incompatible
    QoS. No messages will be sent to it. Last incompatible policy: RELIABILITY_QOS_POLICY

The topic is named since Galactic. Only the last policy is named, of which several may be wrong. Who wrote a line stands
before it, unless the output is formatted otherwise.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.logs import Misfit
from cqos_core.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.system import Role

_PROTOCOL: Final = "ros2"
_MESSAGE: Final = re.compile(
    r"New (?P<discovered>subscription|publisher) discovered on (?:topic '(?P<topic>[^']{1,1024})'|this topic), "
    r"(?:requesting|offering) incompatible QoS\."
    r"(?:(?:(?!New (?:subscription|publisher) discovered).){0,200}?Last incompatible policy: (?P<policy>\w{1,64}))?"
)
_LOGGER: Final = re.compile(r"\[(?P<name>[A-Za-z_][\w./]{0,255})\](?::)?\s*$")
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


def read_line(line: str) -> Iterator[Misfit]:
    """Yield what one line says of endpoints that do not fit."""
    start = 0
    for found in _MESSAGE.finditer(line):
        policy = found["policy"]
        yield Misfit(
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
