"""What ROS 2 endpoints are on the wire of DDS, so that nodes meet plain DDS programs.

Sources: design.ros2.org, topic and service name mapping; rmw_cyclonedds, rmw_fastrtps (`make_fqtopic`); rosidl_typesupport
(type name mangling).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cqos_core.packs import Wire


def topic(key: str, values: Mapping[str, str]) -> str | None:
    """``/scan`` is ``rt/scan`` on the wire; services and actions have their prefix already."""
    if values.get("rmw") in {"zenoh", "zenoh_bridge"}:
        return None
    if not key.startswith("/") or values.get("avoid_ros_namespace_conventions") == "true":
        return key
    return f"rt{key}"


def type_name(name: str) -> str:
    """``sensor_msgs/msg/LaserScan`` is ``sensor_msgs::msg::dds_::LaserScan_`` on the wire."""
    package, *kind, message = name.split("/")
    return "::".join([package, *(kind or ["msg"]), "dds_", f"{message}_"]) if "/" in name else name


WIRE: Final = Wire(
    protocol="dds",
    topic=topic,
    policies={
        "reliability": "reliability",
        "durability": "durability",
        "deadline": "deadline",
        "liveliness": "liveliness",
        "liveliness_lease_duration": "liveliness.lease_duration",
        "lifespan": "lifespan",
        # What rmw_cyclonedds keeps for late readers; by Cyclone DDS alone that would be one sample.
        "history": ("history", "durability_service.history_kind"),
        "depth": ("history.depth", "durability_service.history_depth"),
        "taken_every": "taken_every",
        # What no node sets, but a file of the middleware.
        "partition": "partition",
        "ownership": "ownership",
        "latency_budget": "latency_budget",
    },
    options={"domain": "domain", "rmw": "implementation", "participant_lease": "participant_lease"},
    facts={
        "sole_publisher": "sole_writer",
        **{
            name: name
            for name in (
                *("period", "latched", "keyed", "size"),
                *("outage", "round_trip_time", "repair_time", "rediscovery_time"),
                *("resend_round_trips", "reliable_depth_margin"),
            )
        },
    },
    words={"manual_by_node": "manual_by_participant", "micro_ros": "fastdds"},
    # What rmw_cyclonedds and rmw_fastrtps write and read; of their types they announce the names only.
    # rmw_fastrtps announces liveliness within two thirds of the lease, whatever that is; 0s stands for it.
    fixed={"data_representation": "[xcdr1]", "type_information": "false", "liveliness.announcement_period": "0s"},
    type=type_name,
)
