"""The policies of ROS 2: what an endpoint may set, what is known about a topic, and what is assumed of a deployment.

Values stand in order of strength, weakest first. A value in quotes is written as a person writes it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cqos_core.packs import (
    REDISCOVERY_TIME,
    REPAIR_TIME,
    TAKEN_EVERY,
    Anything,
    Choice,
    Count,
    Derived,
    Duration,
    Flag,
    FromPeers,
    PerRole,
    Policy,
    Text,
    by_option,
)
from cqos_ros2.types import PartitionNames, TypeName

_S: Final = 1_000_000_000

# What introspection prints where it could not read a value.
REPORTED_UNKNOWN: Final = Anything("it is given as `unknown`")


def choice(policy: str, *values: str, **synonyms: str) -> Choice:
    """List the values of a policy, weakest first, read also as ``RMW_QOS_POLICY_…``, ``…_QOS`` and in camel case."""
    return Choice(
        *values,
        affixes=(f"rmw_qos_policy_{policy}_", f"{policy}_", f"_{policy}_qos"),
        synonyms={
            **{value.replace("_", ""): value for value in (*values, "system_default", "best_available")},
            **synonyms,
        },
    )


def duration(words: Mapping[int, str] | None = None) -> Duration:
    """Read a duration as ROS 2 does, with the other spellings of infinite that old recordings have."""
    fast_dds, connext = 2147483647 * _S + 4294967295, 2147483647 * _S + 2147483647
    return Duration(infinities=(fast_dds, connext), words=words)


# RMW_QOS_DEADLINE_BEST_AVAILABLE and that of the lease: {sec: 9223372036, nsec: 854775806} (rmw/types.h).
MARKED: Final = {2**63 - 2: "best_available"}


# A bridge that copies a policy (domain_bridge) waits for the publishers that it relays. It requests the strongest value that
# all of them offer, and offers the same on its other side.
FROM_PUBLISHERS: Final = "from_publishers"
# The same with the subscriptions that it serves, or with the endpoint that is there first (the bridges of Zenoh): it then copies one
# of them, and that remains.
FROM_SUBSCRIBERS: Final = "from_subscribers"
FROM_FIRST: Final = "from_first"


def relayed(alone: str, peers: str) -> FromPeers:
    """What `FROM_PUBLISHERS` means; ``alone`` is what it would be without any publisher."""
    return FromPeers(alone, peers, waits=True, side="publishers")


def copied(alone: str) -> dict[str, FromPeers]:
    """What the words of bridges mean that copy one endpoint; ``alone`` is what it would be without any."""
    return {
        FROM_SUBSCRIBERS: FromPeers(alone, "any", waits=True, side="subscribers"),
        FROM_FIRST: FromPeers(alone, "any", waits=True, side="first"),
    }


# How middlewares that are no DDS treat a policy; DDS enforces everything. Bridges of Zenoh hand on reliability, durability
# and history, and refuse nothing (zenoh-plugin-ros2dds, liveliness_mgt.rs).
# Zenoh: "any publisher can match any subscription"; reliability and durability work, the rest is not
# implemented (rmw_zenoh, docs/design.md, "Quality of Service"). It leaves `best_available` as it is, and asks of an endpoint only
# whether it is reliable, and whether it is transient_local (qos.cpp; rmw_zenoh 649). micro-ROS: XRCE carries durability,
# reliability, history and depth only.
NEVER_STOPS_A_MATCH: Final = {"rmw": {"zenoh": "unmatched", "zenoh_bridge": "unmatched"}}
NOT_IN_ZENOH: Final = {"rmw": {"zenoh": "no", "zenoh_bridge": "no"}}
ONLY_IN_DDS: Final = {"rmw": {**NOT_IN_ZENOH["rmw"], "micro_ros": "no"}}


# What an endpoint sets ------------------------------------------------------------------------------------

HISTORY: Final = Policy(
    "history",
    choice("history", "keep_last", "keep_all"),
    "keep_last",
    "How many samples are kept: the last `depth` ones, or all that resources allow.",
    "DDS 1.4, 2.2.3.18",
    aliases=("history_policy",),
    words={"system_default": "keep_last", **copied("keep_last"), "unknown": REPORTED_UNKNOWN},
    stronger="higher",
)
DEPTH: Final = Policy(
    "depth",
    Count(0, 2**31 - 1),
    "10",
    "How many samples keep_last keeps; 0 leaves it to the middleware.",
    "DDS 1.4, 2.2.3.18",
    aliases=("history_depth", "queue_size"),
    words={"system_default": by_option("rmw", zenoh="42", otherwise="1"), **copied("10"), "unknown": REPORTED_UNKNOWN},
    zero="system_default",
    stronger="higher",
    raised=True,
)
RELIABILITY: Final = Policy(
    "reliability",
    choice("reliability", "best_effort", "reliable"),
    "reliable",
    "Whether lost samples are sent again.",
    "DDS 1.4, 2.2.3.14",
    aliases=("reliability_policy",),
    words={
        "system_default": by_option(
            "rmw",
            cyclonedds="reliable",
            fastdds=PerRole(publisher="reliable", subscriber="best_effort"),
            connext=PerRole(publisher="reliable", subscriber="best_effort"),
            zenoh="reliable",
            micro_ros="reliable",
        ),
        "best_available": by_option(
            "rmw",
            otherwise=PerRole(publisher="reliable", subscriber=FromPeers(alone="reliable", peers="strongest_if_all")),
            zenoh="best_effort",
        ),
        FROM_PUBLISHERS: relayed("reliable", "strongest_if_all"),
        **copied("reliable"),
        "unknown": REPORTED_UNKNOWN,
    },
    enforced=NEVER_STOPS_A_MATCH,
    stronger="higher",
)
DURABILITY: Final = Policy(
    "durability",
    choice("durability", "volatile", "transient_local"),
    "volatile",
    "Whether a subscription that comes late gets the samples that its publisher still keeps.",
    "DDS 1.4, 2.2.3.4",
    aliases=("durability_policy",),
    words={
        "system_default": by_option(
            "rmw",
            cyclonedds="volatile",
            fastdds=PerRole(publisher="transient_local", subscriber="volatile"),
            connext="volatile",
            zenoh="volatile",  # transient_local until early 2025
            micro_ros="transient_local",
        ),
        "best_available": by_option(
            "rmw",
            otherwise=PerRole(
                publisher="transient_local",
                subscriber=FromPeers(alone="transient_local", peers="strongest_if_all"),
            ),
            zenoh="volatile",
        ),
        FROM_PUBLISHERS: relayed("transient_local", "strongest_if_all"),
        **copied("volatile"),
        "unknown": REPORTED_UNKNOWN,
    },
    enforced=NEVER_STOPS_A_MATCH,
    stronger="higher",
)
UNSPECIFIED: Final = {"unspecified": "infinite", "default": "infinite", "system_default": "infinite"}
PERIOD_OF_PEERS: Final = PerRole(
    publisher=FromPeers(alone="infinite", peers="smallest_stated"),
    subscriber=FromPeers(alone="infinite", peers="largest_stated"),
)
DEADLINE: Final = Policy(
    "deadline",
    duration(MARKED),
    "infinite",
    "The longest time between two samples that a publisher promises or a subscription puts up with.",
    "DDS 1.4, 2.2.3.7",
    aliases=("deadline_duration",),
    words={
        **UNSPECIFIED,
        "best_available": PERIOD_OF_PEERS,
        FROM_PUBLISHERS: relayed("infinite", "largest"),
        **copied("infinite"),
    },
    zero="unspecified",
    enforced=ONLY_IN_DDS,
    promise=True,
    stronger="lower",
)
LIFESPAN: Final = Policy(
    "lifespan",
    duration(),
    "infinite",
    "How old a sample may be when it is delivered; older ones are dropped.",
    "DDS 1.4, 2.2.3.16",
    aliases=("lifespan_duration",),
    words={**UNSPECIFIED, FROM_PUBLISHERS: PerRole(publisher=relayed("infinite", "largest"), subscriber="infinite")},
    zero="unspecified",
    enforced=NOT_IN_ZENOH,
)
MANUAL_BY_NODE: Final = {"manual_by_participant": "manual_by_node", "manualbynode": "manual_by_node"}
LIVELINESS: Final = Policy(
    "liveliness",
    choice("liveliness", "automatic", "manual_by_node", "manual_by_topic", **MANUAL_BY_NODE),
    "automatic",
    "Who says that a publisher is alive: the middleware, the node, or the program for each topic.",
    "DDS 1.4, 2.2.3.11",
    aliases=("liveliness_policy",),
    words={
        "system_default": "automatic",  # in every middleware
        "best_available": PerRole(
            publisher=FromPeers(alone="automatic", peers="strongest_if_any"),
            subscriber=FromPeers(alone="manual_by_topic", peers="strongest_if_all"),
        ),
        **copied("automatic"),
        "unknown": REPORTED_UNKNOWN,
    },
    enforced=ONLY_IN_DDS,
    promise=True,
    stronger="higher",
)
LEASE: Final = Policy(
    "liveliness_lease_duration",
    duration(MARKED),
    "infinite",
    "The time without a liveliness assertion after which a publisher counts as lost.",
    "DDS 1.4, 2.2.3.11",
    aliases=("lease_duration", "leaseDuration", "lease", "liveliness_lease", "livelinessLeaseDuration"),
    words={**UNSPECIFIED, "best_available": PERIOD_OF_PEERS, **copied("infinite")},
    zero="unspecified",
    enforced=ONLY_IN_DDS,
    stronger="lower",
)
AVOID_CONVENTIONS: Final = Policy(
    "avoid_ros_namespace_conventions",
    Flag(),
    "false",
    "Whether the topic goes on the wire without ROS's own prefix, so that plain DDS programs meet it.",
    "design.ros2.org, topic and service names",
    enforced=NOT_IN_ZENOH,
)
TYPE: Final = Policy(
    "type",
    TypeName(),
    None,
    "The message type, such as sensor_msgs/msg/LaserScan.",
    "DDS 1.4, 2.2.2.3",
    aliases=("message_type", "msg_type"),
)
PARTITION: Final = Policy(
    "partition",
    PartitionNames(),
    "[]",
    "The partitions that a file of the middleware puts the endpoint into; ROS 2 itself sets none.",
    "rmw_fastrtps, participant.cpp; DDS 1.4, 2.2.3.13",
    enforced=NOT_IN_ZENOH,
    unseen=True,
)
OWNERSHIP: Final = Policy(
    "ownership",
    Choice("shared", "exclusive", ordered=False),
    "shared",
    "Whether only the strongest publisher is heard; ROS 2 itself leaves it shared, a file of the middleware may not.",
    "rmw_fastrtps, publisher.cpp; DDS 1.4, 2.2.3.9",
    enforced=NOT_IN_ZENOH,
    unseen=True,
)
LATENCY_BUDGET: Final = Policy(
    "latency_budget",
    Duration(),
    "0s",
    "How long the delivery of a sample may be put off; ROS 2 itself leaves it at zero, a file of the middleware may not.",
    "rmw_fastrtps, publisher.cpp; DDS 1.4, 2.2.3.8",
    enforced=ONLY_IN_DDS,
    stronger="lower",
    unseen=True,
)
RAW_SETTINGS: Final = Policy(
    "client_library_settings",
    Flag(),
    "false",
    "The settings stand here exactly as a program hands them to rclpy or rclcpp, so what is missing is missing there.",
    aliases=("raw",),
)
INTRA_PROCESS: Final = Policy(
    "intra_process",
    Flag(),
    "false",
    "Whether the endpoint uses the intra-process communication of rclcpp.",
    aliases=("use_intra_process_comms", "use_intra_process_comm"),
)
INTERFACE: Final = Policy(
    "interface",
    Choice("topic", "service", "action", ordered=False),
    "topic",
    "What the endpoint is a part of; derived where a service or an action is taken apart into its topics.",
    derived=Derived(),
)

RECORDED_FORM: Final = Policy(
    "recorded_form",
    Choice("codes", "words", "list", ordered=False),
    "codes",
    "How the recording that a player plays describes publishers: in a text with codes or with words, or in a list.",
    "rosbag2_storage, yaml.hpp and qos.cpp",
    level="participant",
)

# What is known about a topic ------------------------------------------------------------------------------

TOPIC_NAME: Final = Policy("name", Text(), None, "The full name; judged where names are resolved.", level="topic")
TOPIC_TYPE: Final = Policy("type", TypeName(), None, "The message type the topic is declared with.", level="topic")
PERIOD: Final = Policy(
    "period",
    Duration(),
    None,
    "The time between two samples.",
    level="topic",
    aliases=("publish_period",),
)
LATCHED: Final = Policy(
    "latched",
    Flag(),
    "false",
    "A late subscription needs the last sample, as on /map: the topic is written once and read later.",
    level="topic",
)
ACCUMULATED: Final = Policy(
    "accumulated",
    Flag(),
    "false",
    "A late subscription needs what every publisher sent last, as on /tf_static, not only the newest of all.",
    level="topic",
)
KEYED: Final = Policy("keyed", Flag(), "false", "Whether the message type has key fields.", level="topic")
SIZE: Final = Policy("size", Count(unit="bytes"), None, "The size of one sample.", level="topic")
SOLE_PUBLISHER: Final = Policy(
    "sole_publisher",
    Flag(),
    "false",
    "Whether no two publishers write the same instance, also none of another design.",
    level="topic",
)

# What is assumed of the deployment ------------------------------------------------------------------------

RMW: Final = Policy(
    "rmw",
    Choice(
        "cyclonedds",
        "fastdds",
        "connext",
        "zenoh",
        "micro_ros",
        "zenoh_bridge",
        ordered=False,
        synonyms={
            "cyclone": "cyclonedds",
            "cyclone_dds": "cyclonedds",
            "rmw_cyclonedds_cpp": "cyclonedds",
            "fast_dds": "fastdds",
            "fastrtps": "fastdds",
            "rmw_fastrtps_cpp": "fastdds",
            "rmw_fastrtps_dynamic_cpp": "fastdds",
            "connextdds": "connext",
            "connext_dds": "connext",
            "rmw_connextdds": "connext",
            "rmw_connext_cpp": "connext",
            "rmw_zenoh": "zenoh",
            "rmw_zenoh_cpp": "zenoh",
            "micro_xrcedds": "micro_ros",
            "microros": "micro_ros",
            "rmw_microxrcedds": "micro_ros",
            "rmw_microxrcedds_c": "micro_ros",
        },
    ),
    None,
    "The middleware under ROS 2; `zenoh_bridge` is what bridges between DDS and Zenoh speak with each other.",
    level="option",
    aliases=("RMW_IMPLEMENTATION", "middleware"),
    assume=("cyclonedds", "fastdds", "connext"),
)
DISTRO: Final = Policy(
    "distro",
    Choice("foxy", "galactic", "humble", "iron", "jazzy", "kilted", "lyrical", "rolling"),
    None,
    "The ROS 2 distribution; while it is not set, nothing is concluded from it.",
    level="option",
    aliases=("ROS_DISTRO", "distribution"),
    fallback="rolling",
)
COMPARISON: Final = Policy(
    "comparison",
    Choice("semantic", "rmw", ordered=False),
    "semantic",
    "`semantic` judges what values mean; `rmw` answers exactly what `rmw_qos_profile_check_compatible` answers.",
    level="option",
)
DOMAIN: Final = Policy(
    "domain",
    Count(0, 232),
    "0",
    "The ROS domain; nodes of different domains never meet.",
    level="option",
    aliases=("domain_id", "ROS_DOMAIN_ID"),
)
NETWORK: Final = Policy(
    "network",
    Text(),
    None,
    "The network, or the one machine, that discovery does not leave; nodes of different ones never meet.",
    level="option",
)
BRIDGE: Final = Policy(
    "bridge",
    Text(),
    None,
    "The bridge whose side this is: what a bridge publishes it does not take back.",
    level="option",
)
BRIDGE_CACHE: Final = Policy(
    "bridge_cache",
    Count(),
    "1",
    "How many times its depth a bridge keeps of what it takes in, for late subscriptions behind it.",
    level="option",
)
NAMESPACE: Final = Policy(
    "namespace",
    Text(),
    "/",
    "The namespace of the node; it stands before every relative name.",
    level="option",
    aliases=("ns", "__ns"),
)
ROUND_TRIP: Final = Policy(
    "round_trip_time",
    Duration(),
    None,
    "How long a packet takes to a peer and back.",
    level="option",
    aliases=("rtt",),
)
RESEND_ROUND_TRIPS: Final = Policy(
    "resend_round_trips",
    Count(),
    "2",
    "How many round trips a lost sample needs until it is sent again.",
    level="option",
)
DEPTH_MARGIN: Final = Policy(
    "reliable_depth_margin",
    Count(),
    "1",
    "How many samples a reliable publisher keeps beyond those that may have to be sent again.",
    level="option",
)

PARTICIPANT_LEASE: Final = Policy(
    "participant_lease",
    Duration(),
    "of_middleware",
    "How long a node's participant counts as alive after its last message; then its endpoints are no longer matched.",
    "DDSI-RTPS 2.5, 8.5.3.2; Cyclone DDS, Discovery/LeaseDuration; Fast DDS, Discovery, lease duration; RTI knowledge base, "
    "liveliness of a DomainParticipant",
    level="participant",
    words={
        "of_middleware": by_option(
            "rmw",
            Anything("the participant lease of the middleware is not known"),
            cyclonedds="10s",
            fastdds="20s",
            connext="100s",
        )
    },
)

# Zenoh itself sends nothing again: a link does, or not.
ZENOH_TRANSPORT: Final = Policy(
    "zenoh_transport",
    Choice("tcp", "tls", "quic", "ws", "unixsock_stream", "unixpipe", "vsock", "serial", "udp", ordered=False),
    None,
    "The protocol below Zenoh, as the endpoints in its configuration name it.",
    "Zenoh, DEFAULT_CONFIG.json5, connect/endpoints and listen/endpoints",
    level="option",
)
LONGEST_CONGESTION: Final = Policy(
    "longest_congestion",
    Duration(),
    None,
    "For how long at most a congested link takes no further sample.",
    level="option",
)
WAIT_BEFORE_CLOSE: Final = Policy(
    "wait_before_close",
    Duration(),
    "of_middleware",
    "How long a Zenoh publisher that waits does so before its transport closes; all that is sent until it is open again is lost.",
    "Zenoh, DEFAULT_CONFIG.json5, congestion_control/block; rmw_zenoh, DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5",
    level="participant",
    words={
        "of_middleware": by_option(
            "rmw",
            Anything("only publishers on Zenoh wait"),
            zenoh="60s",
            zenoh_bridge="5s",
        )
    },
)

POLICIES: Final = (
    HISTORY,
    DEPTH,
    RELIABILITY,
    DURABILITY,
    DEADLINE,
    LIFESPAN,
    LIVELINESS,
    LEASE,
    AVOID_CONVENTIONS,
    PARTITION,
    OWNERSHIP,
    LATENCY_BUDGET,
    TYPE,
    RAW_SETTINGS,
    INTRA_PROCESS,
    INTERFACE,
    RECORDED_FORM,
    TAKEN_EVERY,
    TOPIC_NAME,
    TOPIC_TYPE,
    PERIOD,
    LATCHED,
    ACCUMULATED,
    KEYED,
    SIZE,
    SOLE_PUBLISHER,
    RMW,
    DISTRO,
    COMPARISON,
    DOMAIN,
    NETWORK,
    BRIDGE,
    BRIDGE_CACHE,
    NAMESPACE,
    ROUND_TRIP,
    REPAIR_TIME,
    REDISCOVERY_TIME,
    RESEND_ROUND_TRIPS,
    DEPTH_MARGIN,
    PARTICIPANT_LEASE,
    ZENOH_TRANSPORT,
    LONGEST_CONGESTION,
    WAIT_BEFORE_CLOSE,
)
