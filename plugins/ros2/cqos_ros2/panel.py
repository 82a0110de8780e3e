"""How people see the settings of ROS 2: headings, names, and what each value means."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Panel

_MIDDLEWARE: Final = "The default of the middleware, which differs between middlewares."
_PEERS: Final = "What fits most endpoints that are there when this one starts."

PANEL: Final = Panel(
    groups={
        "Delivery": ("reliability", "durability", "history", "depth"),
        "Timing": ("deadline", "lifespan"),
        "Liveliness": ("liveliness", "liveliness_lease_duration"),
        "Program": (
            "intra_process",
            "avoid_ros_namespace_conventions",
            *("partition", "ownership", "latency_budget"),
            "client_library_settings",
            "taken_every",
        ),
        "Topic": ("type", "period", "latched", "accumulated", "keyed", "size", "sole_publisher"),
        "Node": ("namespace", "participant_lease", "wait_before_close", "recorded_form"),
        "Deployment": (
            *("rmw", "distro", "domain", "network", "outage", "comparison"),
            *("bridge", "bridge_cache", "round_trip_time", "repair_time", "rediscovery_time"),
            *("resend_round_trips", "reliable_depth_margin", "zenoh_transport", "longest_congestion"),
        ),
    },
    advanced=(
        *(
            "intra_process",
            "avoid_ros_namespace_conventions",
            "client_library_settings",
            "recorded_form",
            "taken_every",
        ),
        *("partition", "ownership", "latency_budget"),
        *(
            "accumulated",
            "keyed",
            "size",
            "sole_publisher",
            "participant_lease",
            "comparison",
            "bridge",
            "bridge_cache",
        ),
        *("round_trip_time", "repair_time", "rediscovery_time"),
        *("resend_round_trips", "reliable_depth_margin", "relayed"),
        *("zenoh_transport", "longest_congestion", "wait_before_close"),
    ),
    labels={
        "liveliness_lease_duration": "Lease duration",
        "avoid_ros_namespace_conventions": "Plain DDS topic name",
        "client_library_settings": "As handed to rclcpp or rclpy",
        "intra_process": "Intra-process communication",
        "rmw": "Middleware",
        "distro": "Distribution",
        "type": "Message type",
    },
    values={
        "reliability": {
            "best_effort": "A lost sample is not sent again.",
            "reliable": "Lost samples are sent again until they arrive.",
            "system_default": _MIDDLEWARE,
            "best_available": "A publisher is reliable. A subscription is so if all its publishers are.",
        },
        "durability": {
            "volatile": "A late subscription gets no sample from before.",
            "transient_local": "The publisher keeps samples for late subscriptions.",
            "system_default": _MIDDLEWARE,
            "best_available": "A publisher is transient local. A subscription is so if all its publishers are.",
        },
        "history": {
            "keep_last": "The last samples are kept, as many as the depth says.",
            "keep_all": "All samples are kept, up to the limits of the middleware.",
            "system_default": _MIDDLEWARE,
        },
        "depth": {"system_default": _MIDDLEWARE},
        "deadline": {"system_default": _MIDDLEWARE, "best_available": _PEERS},
        "lifespan": {"system_default": _MIDDLEWARE},
        "liveliness": {
            "automatic": "The middleware says that the publisher is alive.",
            "manual_by_node": "Former value of ROS 2: one assertion counts for all publishers of a node.",
            "manual_by_topic": "The program says so for each publisher.",
            "system_default": _MIDDLEWARE,
            "best_available": _PEERS,
        },
        "liveliness_lease_duration": {"system_default": _MIDDLEWARE, "best_available": _PEERS},
        "ownership": {
            "shared": "A subscription hears all publishers.",
            "exclusive": "A subscription hears only the strongest publisher.",
        },
        "recorded_form": {
            "codes": "A text with the integer codes of rmw: rosbag2 up to Iron.",
            "words": "A text with words, which only Jazzy and newer read.",
            "list": "A list: rosbag2 from Jazzy on.",
        },
        "comparison": {
            "semantic": "Values are judged by what they mean.",
            "rmw": "The answer is exactly that of `rmw_qos_profile_check_compatible`.",
        },
        "latched": {"true": "A late subscription needs the last sample.", "false": "It needs none from before."},
    },
    value_labels={
        "rmw": {
            "cyclonedds": "Cyclone DDS",
            "fastdds": "Fast DDS",
            "connext": "RTI Connext",
            "zenoh": "Zenoh",
            "micro_ros": "micro-ROS",
            "zenoh_bridge": "Bridge of Zenoh",
        },
    },
    # A subscription may state it, and no middleware reads it there.
    roles={"lifespan": ("publisher",)},
)
