"""The predefined profiles of ROS 2, in the order of rmw/qos_profiles.h.

They are the same in every distribution from Foxy on; only `best_available` came later. `unspecified` durations and
`system_default` values are what the middleware makes of them.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Preset


def preset(
    history: str,
    depth: int,
    reliability: str,
    durability: str,
    deadline: str = "unspecified",
    lifespan: str = "unspecified",
    liveliness: str = "system_default",
    lease: str = "unspecified",
    *,
    doc: str,
    aliases: tuple[str, ...] = (),
    needs: tuple[str, str] | None = None,
) -> Preset:
    """Write one row of the table of profiles."""
    settings = {
        "history": history,
        "depth": str(depth),
        "reliability": reliability,
        "durability": durability,
        "deadline": deadline,
        "lifespan": lifespan,
        "liveliness": liveliness,
        "liveliness_lease_duration": lease,
        "avoid_ros_namespace_conventions": "false",
    }
    return Preset(settings, doc, needs, aliases)


def spellings(name: str, *more: str) -> tuple[str, ...]:
    """Return the names a profile has in C and in rclpy, beside ``more``."""
    return (f"rmw_qos_profile_{name}", f"qos_profile_{name}", *more)


# fmt: off
PRESETS: Final = {
    "default": preset(
        "keep_last", 10, "reliable", "volatile",
        doc="What a publisher or subscription gets by default.",
        aliases=spellings("default", "default_qos"),
    ),
    "sensor_data": preset(
        "keep_last", 5, "best_effort", "volatile",
        doc="Readings that are better lost than late.",
        aliases=spellings("sensor_data", "SensorDataQoS", "sensor_data_qos", "sensor_qos"),
    ),
    "services_default": preset(
        "keep_last", 10, "reliable", "volatile",
        doc="Requests and responses of services.",
        aliases=spellings("services_default", "ServicesQoS", "services_qos"),
    ),
    "parameters": preset(
        "keep_last", 1000, "reliable", "volatile",
        doc="The parameter services of a node.",
        aliases=spellings("parameters", "ParametersQoS", "parameter_qos", "parameters_qos"),
    ),
    "parameter_events": preset(
        "keep_last", 1000, "reliable", "volatile",
        doc="The topic /parameter_events.",
        aliases=spellings("parameter_events", "ParameterEventsQoS", "parameter_events_qos"),
    ),
    "rosout": preset(
        "keep_last", 1000, "reliable", "transient_local", lifespan="10s",
        doc="The topic /rosout.",
        aliases=spellings("rosout_default", "rcl_qos_profile_rosout_default", "RosoutQoS", "rosout_default"),
    ),
    "clock": preset(
        "keep_last", 1, "best_effort", "volatile",
        doc="The topic /clock, in C++.",
        aliases=("ClockQoS", "clock_qos"),
    ),
    "action_status_default": preset(
        "keep_last", 1, "reliable", "transient_local",
        doc="The status topic of actions.",
        aliases=spellings("action_status_default", "rcl_action_qos_profile_status_default"),
    ),
    "system_default": preset(
        "system_default", 0, "system_default", "system_default",
        doc="Whatever the middleware does by itself.",
        aliases=spellings("system_default", "system_default_qos"),
    ),
    "system_defaults_cpp": preset(
        "keep_last", 0, "system_default", "system_default",
        doc="`rclcpp::SystemDefaultsQoS`, which unlike the C profile states keep_last.",
        aliases=("SystemDefaultsQoS",),
    ),
    "best_available": preset(
        "keep_last", 10, "best_available", "best_available", deadline="best_available",
        liveliness="best_available", lease="best_available",
        doc="The best that the other side allows when the endpoint is created.",
        aliases=spellings("best_available", "BestAvailableQoS", "best_available_qos"),
        needs=("distro", "iron"),
    ),
    "unknown": preset(
        "unknown", 0, "unknown", "unknown", liveliness="unknown",
        doc="What introspection starts from; nothing can be created with it.",
        aliases=spellings("unknown"),
    ),
    "tf_dynamic": preset(
        "keep_last", 100, "reliable", "volatile",
        doc="The topic /tf, both sides (tf2_ros).",
        aliases=("DynamicBroadcasterQoS", "DynamicListenerQoS"),
    ),
    "tf_static_broadcaster": preset(
        "keep_last", 1, "reliable", "transient_local",
        doc="The topic /tf_static, publishing side (tf2_ros).",
        aliases=("StaticBroadcasterQoS",),
    ),
    "tf_static_listener": preset(
        "keep_last", 100, "reliable", "transient_local",
        doc="The topic /tf_static, subscribing side (tf2_ros).",
        aliases=("StaticListenerQoS",),
    ),
}
# fmt: on
