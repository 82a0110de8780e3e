"""The rules of ROS 2, one condition each.

`requires` reports when its condition is false, `forbids` only when it is certainly true. If a `meets` condition is false, two
endpoints of one topic do not match. A bare policy is that of the endpoint itself,
`offered` is the publisher's, `requested` the subscription's.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Final

from cqos_core.packs import (
    all_equal,
    ceil,
    define,
    forbids,
    in_,
    matches,
    meets,
    offered,
    publisher,
    requested,
    requires,
    stated,
    stated_here,
    subscriber,
    topic,
    total,
)
from cqos_ros2.names import HIDDEN, ILLEGAL, REPEATED_UNDERSCORE
from cqos_ros2.policies import (
    ACCUMULATED,
    AVOID_CONVENTIONS,
    BRIDGE,
    BRIDGE_CACHE,
    DEADLINE,
    DEPTH,
    DEPTH_MARGIN,
    DISTRO,
    DOMAIN,
    DURABILITY,
    HISTORY,
    INTERFACE,
    INTRA_PROCESS,
    LATCHED,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    NETWORK,
    PERIOD,
    RAW_SETTINGS,
    RELIABILITY,
    RESEND_ROUND_TRIPS,
    RMW,
    ROUND_TRIP,
    TOPIC_NAME,
    TOPIC_TYPE,
    TYPE,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.packs import Condition, Policy, Term

CONCEPT: Final = "ROS 2 concepts, Quality of Service settings"
COMPATIBILITY: Final = f"{CONCEPT}, compatibilities"

# ROS1xx: what a subscription requests must be offered ------------------------------------------------------

REQUEST_OFFER: Final = (
    requires(
        offered(RELIABILITY) >= requested(RELIABILITY),
        code="ROS101",
        name="reliability-weaker-than-requested",
        because="a best_effort publisher never sends a lost sample again, so a reliable subscription refuses it",
        clause=f"{COMPATIBILITY}; DDS 1.4, 2.2.3.14",
    ),
    requires(
        offered(DURABILITY) >= requested(DURABILITY),
        code="ROS102",
        name="durability-weaker-than-requested",
        because="a volatile publisher keeps nothing for a subscription that comes late and wants what it missed",
        clause=f"{COMPATIBILITY}; DDS 1.4, 2.2.3.4",
    ),
    requires(
        offered(DEADLINE) <= requested(DEADLINE),
        code="ROS103",
        name="deadline-longer-than-requested",
        because="the offered deadline is longer than the requested one",
        clause=f"{COMPATIBILITY}; DDS 1.4, 2.2.3.7",
    ),
    requires(
        offered(LIVELINESS) >= requested(LIVELINESS),
        code="ROS104",
        name="liveliness-weaker-than-requested",
        because="the offered liveliness kind is weaker than the requested one (automatic < manual_by_node < manual_by_topic)",
        clause=f"{COMPATIBILITY}; DDS 1.4, 2.2.3.11",
    ),
    requires(
        offered(LEASE) <= requested(LEASE),
        code="ROS105",
        name="lease-longer-than-requested",
        because="the offered liveliness lease is longer than the requested one",
        clause=f"{COMPATIBILITY}; DDS 1.4, 2.2.3.11",
    ),
)

# ROS2xx: pairs and signals that connect, but not as one may think ------------------------------------------

REPLAY_UNREAD: Final = define(
    "replay_unread", (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) == "volatile")
)
BOTH_DURABLE: Final = define(
    "both_durable", (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) >= "transient_local")
)


def replays(side: Callable[[Policy], Term]) -> Condition:
    """Define that one side takes part in replays to late subscriptions, with a depth."""
    return define(f"{side.__name__}_replays", (side(HISTORY) == "keep_last") & (side(DURABILITY) >= "transient_local"))


PAIRS: Final = (
    forbids(
        REPLAY_UNREAD & ~topic(LATCHED),
        code="ROS201",
        name="history-not-requested",
        says="{publisher} with durability {offered durability}, {subscriber} with {requested durability}: what is kept for late subscriptions is not requested",
        because="the publisher keeps samples for late subscriptions, but this one does not ask for them",
        clause=COMPATIBILITY,
        severity="note",
    ),
    forbids(
        REPLAY_UNREAD & topic(LATCHED),
        code="ROS202",
        name="latched-topic-read-volatile",
        says="on latched topic `{topic}`, {publisher} with durability {offered durability}, {subscriber} with {requested durability}: who starts late gets nothing",
        because="the topic is written once and read later, so a volatile subscription that starts late gets nothing",
        clause=f"{COMPATIBILITY}; REP 2003",
        fixes=("requested durability",),
    ),
    forbids(
        BOTH_DURABLE
        & (requested(HISTORY) == "keep_last")
        & ((offered(HISTORY) == "keep_all") | (requested(DEPTH) < offered(DEPTH))),
        code="ROS203",
        name="history-cut-short",
        says="{publisher} with history {offered history} and depth {offered depth}, {subscriber} with depth {requested depth}: only the newest of what is kept arrives",
        because="the subscription has no room for all that the publisher keeps for it: only the newest remain",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("depth",),
    ),
    forbids(
        (requested(DEPTH) * subscriber(BRIDGE_CACHE) < total(offered(DEPTH), replays(offered)))
        & replays(requested)
        & (subscriber(RMW) != "zenoh_bridge")  # which hands on what comes and keeps nothing
        & topic(ACCUMULATED),
        code="ROS204",
        name="depth-below-latched-publishers",
        says="{subscriber} with depth {requested depth} has no room for what all publishers of `{topic}` replay to it",
        because="when it starts late, all publishers replay at once, and what exceeds its depth is lost",
        clause="tf2_ros, QoS of the static listener",
        help="request a depth with room for what all of them keep; the listener of tf2_ros has 100, a Zenoh bridge its "
        "`transient_local_cache_multiplier`",
    ),
    forbids(
        (offered(DURABILITY) == "volatile")
        & (requested(DURABILITY) == "volatile")
        & topic(LATCHED)
        & (stated(topic(LATCHED)) | topic(ACCUMULATED)),  # a map may also be published again and again
        code="ROS206",
        name="latched-topic-volatile",
        says="latched topic `{topic}` is volatile on both sides, {publisher} and {subscriber}: who starts late gets nothing",
        because="the topic is written once and read later, and no endpoint keeps the samples",
        clause=f"{COMPATIBILITY}; REP 2003",
        help="both sides of a latched topic are transient_local; those of tf2_ros are on /tf_static",
    ),
    forbids(
        ~(
            all_equal(offered(RELIABILITY))
            & all_equal(offered(DURABILITY))
            & all_equal(offered(DEADLINE))
            & define("liveliness_alike", all_equal(offered(LIVELINESS)) & all_equal(offered(LEASE)))
        ),
        code="ROS205",
        name="publishers-differ",
        says="the publishers of `{topic}` offer different QoS",
        because="a subscription may then get the samples of some publishers of the topic and not of others",
        clause="rosbag2, playback QoS",
        severity="note",
        help="offer the same on every publisher of the topic",
    ),
)

# ROS3xx: one endpoint by itself ----------------------------------------------------------------------------

DURABLE: Final = DURABILITY >= "transient_local"
MANUAL: Final = LIVELINESS >= "manual_by_node"
RESENDING: Final = define("resending", RESEND_ROUND_TRIPS * ROUND_TRIP)

ENDPOINTS: Final = (
    forbids(
        RAW_SETTINGS & stated(HISTORY) & (HISTORY == "keep_last") & ~stated(DEPTH),
        code="ROS301",
        name="keep-last-depth-missing",
        says="{endpoint} states history keep_last without a depth",
        because="rclpy refuses a keep_last profile without a depth",
        clause="rclpy, QoSProfile",
        severity="error",
        creation=True,
        fixes=("depth",),
        help="state the depth",
    ),
    forbids(
        RAW_SETTINGS & ~stated(HISTORY) & ~stated(DEPTH),
        code="ROS302",
        name="history-and-depth-missing",
        says="{endpoint} states neither history nor depth",
        because="rclpy refuses a profile with neither history nor depth",
        clause="rclpy, QoSProfile",
        severity="error",
        creation=True,
        fixes=("depth",),
        help="state the depth, which implies keep_last, or the history",
    ),
    forbids(
        (HISTORY == "keep_last") & stated(DEPTH, "0"),
        code="ROS303",
        name="keep-last-depth-zero",
        says="{endpoint} states history keep_last with depth 0",
        because="a depth of 0 means the middleware's own default, which is 1 almost everywhere",
        clause="rmw, RMW_QOS_POLICY_DEPTH_SYSTEM_DEFAULT",
        fixes=("depth",),
        help="state the depth that is meant",
    ),
    forbids(
        (HISTORY == "keep_all") & stated(DEPTH) & ~stated(DEPTH, "0"),
        code="ROS304",
        name="keep-all-depth",
        says="{endpoint} states a depth beside history keep_all",
        because="keep_all ignores the depth",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
    ),
    forbids(
        RAW_SETTINGS
        & (
            stated(HISTORY, "unknown")
            | stated(RELIABILITY, "unknown")
            | stated(DURABILITY, "unknown")
            | stated(LIVELINESS, "unknown")
        ),
        code="ROS305",
        name="unknown-value",
        says="{endpoint} cannot be created with the value `unknown`",
        because="`unknown` is what introspection reports for a value it cannot read; nothing can be created with it",
        clause="rmw, RMW_QOS_POLICY_…_UNKNOWN",
        severity="error",
        creation=True,
        fixes=("history", "reliability", "durability", "liveliness"),
        help="state the value that is meant",
    ),
    forbids(
        (DISTRO <= "humble")
        & (
            stated(RELIABILITY, "best_available")
            | stated(DURABILITY, "best_available")
            | define(
                "best_available_times",
                stated(DEADLINE, "best_available")
                | stated(LIVELINESS, "best_available")
                | stated(LEASE, "best_available"),
            )
        ),
        code="ROS306",
        name="best-available-distro",
        says="{endpoint} states best_available, which {distro} does not have",
        because="best_available exists from Iron on",
        clause="rmw, RMW_QOS_POLICY_…_BEST_AVAILABLE",
        severity="error",
        creation=True,
        fixes=("distro",),
        help="state the values that are meant, or target Iron or newer",
    ),
    forbids(
        LIVELINESS == "manual_by_node",
        code="ROS307",
        name="manual-by-node",
        because="manual_by_node is deprecated",
        clause="rmw, RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_NODE",
    ),
    forbids(
        MANUAL & (LEASE == "infinite"),
        code="ROS308",
        name="manual-no-lease",
        because="without a lease duration liveliness can never be lost, so asserting it has no effect",
        clause=f"{CONCEPT}, liveliness",
        severity="note",
        help="state the lease duration within which the program asserts its liveliness",
    ),
    forbids(
        MANUAL & (DEADLINE < "infinite") & (LEASE < DEADLINE),
        code="ROS309",
        name="lease-under-deadline",
        because="a publisher that keeps its deadline counts as dead before the next message is due, unless its program asserts it in between",
        clause=f"{CONCEPT}, liveliness",
        fixes=("liveliness_lease_duration", "liveliness"),
    ),
    forbids(
        (offered(DEADLINE) < "infinite") & (offered(LIFESPAN) < offered(DEADLINE)),
        code="ROS310",
        name="lifespan-under-deadline",
        because="samples expire before the next one is due",
        clause=f"{CONCEPT}, lifespan",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        stated_here(requested(LIFESPAN)) & (requested(LIFESPAN) < "infinite") & (subscriber(RMW) != "micro_ros"),
        code="ROS311",
        name="lifespan-on-subscription",
        says="{endpoint} states lifespan {lifespan}, but lifespan acts at the publisher",
        because="a publisher's lifespan is the one that counts; overrides do not even exist for subscriptions",
        clause=f"{CONCEPT}, lifespan",
        severity="note",
    ),
    forbids(
        DURABLE & (RELIABILITY == "best_effort") & ~in_(RMW, "zenoh", "zenoh_bridge"),
        code="ROS312",
        name="durable-best-effort",
        says="{endpoint} with durability {durability} and reliability {reliability}: stored samples are never replayed",
        because="stored samples are replayed over the reliable protocol only, so best_effort never gets them",
        clause="DDSI-RTPS 2.5, 8.4",
    ),
    forbids(
        DURABLE & (HISTORY == "keep_all"),
        code="ROS313",
        name="durable-keep-all",
        because="what is kept for late subscriptions grows without bound unless resource limits are set",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history",),
    ),
    forbids(
        (offered(DURABILITY) >= "transient_local") & stated(offered(LIFESPAN)) & (offered(LIFESPAN) < "infinite"),
        code="ROS314",
        name="durable-finite-lifespan",
        because="a subscription that comes later than the lifespan gets none of the stored samples",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        MANUAL & (RELIABILITY == "best_effort"),
        code="ROS315",
        name="manual-best-effort",
        because="asserting liveliness over best_effort may get lost, and a healthy publisher then counts as dead",
        clause="DDSI-RTPS 2.5, 8.4.13",
    ),
    forbids(
        (DEADLINE < "infinite") & (RELIABILITY == "best_effort"),
        code="ROS316",
        name="deadline-best-effort",
        because="every lost sample looks like a missed deadline",
        clause=f"{CONCEPT}, deadline",
        severity="note",
    ),
    forbids(
        (requested(DEADLINE) < "infinite") & (requested(DURABILITY) >= "transient_local"),
        code="ROS317",
        name="deadline-durable",
        because="replayed samples restart the deadline, as if the publisher had just sent them",
        clause="DDS 1.4, 2.2.3.7",
        severity="note",
    ),
    forbids(
        offered(DEADLINE) < topic(PERIOD),
        code="ROS318",
        name="deadline-under-period",
        because="the publisher promises samples more often than it sends any",
        clause=f"{CONCEPT}, deadline",
    ),
    forbids(
        (offered(HISTORY) == "keep_last")
        & (offered(LIFESPAN) < "infinite")
        & (offered(LIFESPAN) > offered(DEPTH) * topic(PERIOD)),
        code="ROS319",
        name="lifespan-over-history",
        says="{endpoint} with lifespan {lifespan}, depth {depth} and period {period}: the history drops samples before they expire",
        because="the history drops samples before their lifespan is over",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("depth", "lifespan"),
    ),
    forbids(
        (offered(DEPTH) < ceil(RESENDING, topic(PERIOD)) + DEPTH_MARGIN)
        & (offered(HISTORY) == "keep_last")
        & (offered(RELIABILITY) == "reliable"),
        code="ROS320",
        name="reliable-shallow",
        says="{endpoint} with depth {depth}, period {period} and round trip {round_trip_time}: lost samples are overwritten before they are sent again",
        because="a lost sample is overwritten by newer ones before it can be sent again",
        clause="DDS 1.4, 2.2.3.14",
        fixes=("depth", "history"),
    ),
    forbids(
        # A reader learns of a loss by heartbeats too, so the period of the samples does not matter.
        (offered(RELIABILITY) == "reliable") & (offered(LIFESPAN) < RESENDING),
        code="ROS321",
        name="reliable-short-lifespan",
        says="{endpoint} with lifespan {lifespan} and round trip {round_trip_time}: lost samples expire before they are sent again",
        because="a lost sample has expired before it can be sent again; what arrives at once is not concerned",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        (INTERFACE == "service") & DURABLE,
        code="ROS322",
        name="service-durable",
        says="{endpoint} is part of a service and has durability {durability}",
        because="a server that is started again gets the requests of before",
        clause=f"{CONCEPT}, QoS profiles",
    ),
    forbids(
        INTRA_PROCESS & ((HISTORY == "keep_all") | stated(DEPTH, "0")),
        code="ROS323",
        name="intra-process-history",
        says="{endpoint} uses intra-process communication with a history it does not support",
        because="rclcpp throws: intra-process communication needs keep_last and a depth of at least 1",
        clause="rclcpp, create_publisher and create_subscription",
        severity="error",
        creation=True,
        fixes=("history", "depth"),
    ),
    forbids(
        INTRA_PROCESS & DURABLE & (DISTRO <= "iron"),
        code="ROS324",
        name="intra-process-durable",
        says="{endpoint} uses intra-process communication with durability {durability} on {distro}",
        because="rclcpp throws: intra-process communication is volatile only before Jazzy",
        clause="rclcpp, create_publisher and create_subscription",
        severity="error",
        creation=True,
        fixes=("durability",),
    ),
    forbids(
        stated(offered(LIFESPAN)) & (offered(LIFESPAN) < "infinite") & (publisher(RMW) == "micro_ros"),
        code="ROS325",
        name="lifespan-over-xrce",
        says="{endpoint} states lifespan {lifespan}, which {rmw} does not carry",
        because="XRCE does not carry the lifespan to the agent, so samples never expire",
        clause="rmw_microxrcedds",
    ),
)

# ROS4xx: names, and who meets whom -------------------------------------------------------------------------

BOTH_ON_ZENOH: Final = define("both_on_zenoh", (publisher(RMW) == "zenoh") & (subscriber(RMW) == "zenoh"))
BOTH_BRIDGES: Final = define(
    "both_zenoh_bridges", (publisher(RMW) == "zenoh_bridge") & (subscriber(RMW) == "zenoh_bridge")
)

NAMES: Final = (
    meets(
        publisher(DOMAIN) == subscriber(DOMAIN),
        code="ROS401",
        name="domain-split",
        because="nodes of different ROS domains never meet",
        clause="ROS 2 concepts, The ROS_DOMAIN_ID",
    ),
    meets(
        BOTH_ON_ZENOH
        | BOTH_BRIDGES
        | ~(in_(publisher(RMW), "zenoh", "zenoh_bridge") | in_(subscriber(RMW), "zenoh", "zenoh_bridge")),
        code="ROS402",
        name="transport-split",
        because="Zenoh and DDS do not speak with each other, nor do nodes on Zenoh and bridges to it, which name their "
        "keys differently; micro-ROS meets DDS through its agent",
        clause="rmw_zenoh, docs/design.md; zenoh-plugin-ros2dds, ros2_utils.rs",
    ),
    meets(
        offered(TYPE) == requested(TYPE),
        code="ROS403",
        name="type-mismatch",
        because="endpoints of one topic with different message types never exchange a sample",
        clause="DDS 1.4, 2.2.2.3",
        severity="error",
        always=True,
    ),
    meets(
        offered(AVOID_CONVENTIONS) == requested(AVOID_CONVENTIONS),
        code="ROS404",
        name="namespace-conventions-differ",
        because="avoid_ros_namespace_conventions changes the name on the wire, so both sides must agree on it",
        clause="design.ros2.org, topic and service names",
    ),
    forbids(
        reduce(or_, (matches(topic(TOPIC_NAME), pattern) for pattern in ILLEGAL)),
        code="ROS405",
        name="illegal-topic-name",
        because="ROS 2 refuses the name: it has letters, digits, `_` and `/` only, and no part starts with a digit",
        clause="rmw, rmw_validate_full_topic_name",
        severity="error",
    ),
    meets(
        publisher(NETWORK) == subscriber(NETWORK),
        code="ROS409",
        name="network-split",
        because="discovery does not leave the network, or the machine, that it is confined to",
        clause="ROS 2, Improved Dynamic Discovery",
    ),
    meets(
        publisher(BRIDGE) != subscriber(BRIDGE),
        code="ROS410",
        name="own-bridge",
        because="a bridge does not take back what it publishes itself",
        clause="zenoh-plugin-ros2dds, qos_helpers.rs; domain_bridge, ignore_local_publications",
    ),
    forbids(
        (INTERFACE == "topic") & (TYPE != topic(TOPIC_TYPE)),
        code="ROS406",
        name="type-differs-from-topic",
        says="{endpoint} has another message type than topic `{topic}` is declared with",
        because="the topic is declared with another message type",
        clause="C-QoS, topics of a system file",
        fixes=("type",),
    ),
    forbids(
        matches(topic(TOPIC_NAME), HIDDEN),
        code="ROS407",
        name="hidden-topic-name",
        because="a name with a part that starts with `_` is hidden from `ros2 topic list` and its like",
        clause="design.ros2.org, topic and service names",
        severity="note",
    ),
    forbids(
        matches(topic(TOPIC_NAME), REPEATED_UNDERSCORE),
        code="ROS408",
        name="repeated-underscore-in-name",
        because="the naming rules of ROS 2 keep `__` for themselves, although nothing refuses it yet",
        clause="design.ros2.org, topic and service names",
        severity="note",
    ),
)

RULES: Final = (*REQUEST_OFFER, *PAIRS, *ENDPOINTS, *NAMES)
