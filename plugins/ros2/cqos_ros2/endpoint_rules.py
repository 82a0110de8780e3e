"""The rules of ROS 2 about one endpoint by itself (ROS3xx)."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    ceil,
    define,
    forbids,
    in_,
    offered,
    publisher,
    requested,
    stated,
    stated_here,
    subscriber,
    topic,
)
from cqos_ros2.policies import (
    DEADLINE,
    DEPTH,
    DEPTH_MARGIN,
    DISTRO,
    DURABILITY,
    HISTORY,
    INTERFACE,
    INTRA_PROCESS,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    PERIOD,
    RAW_SETTINGS,
    RELIABILITY,
    RESEND_ROUND_TRIPS,
    RMW,
    ROUND_TRIP,
)

CONCEPT: Final = "ROS 2 concepts, Quality of Service settings"

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
        (HISTORY == "keep_all") & stated(DEPTH) & ~stated(DEPTH, "0") & ~(DURABLE & (RMW == "zenoh")),
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
        DURABLE & (HISTORY == "keep_all") & (RMW != "zenoh"),  # which keeps, and asks for, `depth` samples
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
    forbids(
        (RMW == "zenoh")
        & ((stated(DEADLINE) & ~stated(DEADLINE, "infinite")) | (stated(LEASE) & ~stated(LEASE, "infinite"))),
        code="ROS326",
        name="no-events-on-zenoh",
        says="{endpoint} states a deadline or a lease: on rmw_zenoh its callback keeps the node from starting, or is never called",
        because="rmw_zenoh watches neither deadlines nor liveliness. Before 0.1.9 (Humble), 0.2.10 (Jazzy), 0.6.7 (Kilted) and 0.10.3 "
        "(Rolling) rclcpp and rclpy throw when a node sets a callback for such an event; since then they take it and never call it",
        clause="rmw_zenoh 161 and 934",
        severity="note",
        help="watch for silence with a timer of the node",
    ),
)
