"""How ROS 2 names things on the wire, read backwards: `rt/chatter` is the topic `/chatter`.

Here are names only. No rule of ROS 2 is known to this pack, and its pack need not be installed.
Sources: design.ros2.org, topic and service name mapping; rosidl_typesupport (type name mangling).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

PROTOCOL: Final = "ros2"
_TYPE: Final = re.compile(r"(?P<package>\w+)::(?P<kind>msg|srv|action)::dds_::(?P<name>\w+)_")
_PART: Final[dict[str, tuple[str, str, Literal["request", "response"]]]] = {
    "rq": ("Request", "_Request", "request"),
    "rr": ("Reply", "_Response", "response"),
}

POLICIES: Final = {
    "reliability": "reliability",
    "durability": "durability",
    "deadline": "deadline",
    "liveliness": "liveliness",
    "liveliness.lease_duration": "liveliness_lease_duration",
    "lifespan": "lifespan",
    "history": "history",
    "history.depth": "depth",
}
"""Policies that ROS 2 has too, with their names there."""
ALWAYS: Final = {
    "data_representation": {"[xcdr1]"},
    "ownership": {"shared"},
    "latency_budget": {"0s"},
    "destination_order": {"by_reception_timestamp"},
    "presentation.access_scope": {"instance"},
    "presentation.coherent_access": {"false"},
    "presentation.ordered_access": {"false"},
    "partition": {"[]"},
    "time_based_filter": {"0s"},
    "durability": {"volatile", "transient_local"},
}
"""The values without which something that matters would be lost in the words of ROS 2."""
IMPLEMENTATIONS: Final = frozenset({"connext", "cyclonedds", "fastdds"})
"""The implementations that ROS 2 runs on."""


@dataclass(frozen=True, slots=True)
class RosName:
    """What a topic of the wire is in ROS 2.

    Attributes:
        part: a topic, or the request or response of a service.
        name, type: as ROS 2 writes them.
        plain: it is on the wire without the prefix of ROS 2 (``avoid_ros_namespace_conventions``).
    """

    part: Literal["topic", "request", "response"]
    name: str
    type: str
    plain: bool = False


def demangled(topic: str, type_name: str) -> RosName | None:
    """Return what a topic and type of the wire are in ROS 2, None where they are not named by its rules."""
    found = _TYPE.fullmatch(type_name)
    if found is None:
        return None
    prefix, slash, name = topic.partition("/")
    package, kind, message = found["package"], found["kind"], found["name"]
    if not slash or not name:
        return None
    if prefix in {"rt", ""}:
        return RosName("topic", f"/{name}", f"{package}/{kind}/{message}", plain=not prefix)
    if prefix in _PART:
        ending, type_ending, part = _PART[prefix]
        service = message.removesuffix(type_ending)
        if name.endswith(ending) and name != ending and service != message:
            return RosName(part, f"/{name.removesuffix(ending)}", f"{package}/{kind}/{service}")
    return None


def settings(stated: Mapping[str, str]) -> dict[str, str] | None:
    """Return settings of DDS in the words of ROS 2, None where something that matters would be lost."""
    if any(stated.get(name) not in {*values, None} for name, values in ALWAYS.items()):
        return None
    if "data_representation" not in stated:
        return None
    return {POLICIES[name]: text for name, text in stated.items() if name in POLICIES}
