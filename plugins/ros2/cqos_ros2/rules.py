"""The rules of ROS 2, one condition each.

`requires` reports when its condition is false, `forbids` only when it is certainly true. If a `matched_if` condition is false, two
endpoints of one topic do not match. A bare policy is that of the endpoint itself,
`offered` is the publisher's, `requested` the subscription's.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Final

from cqos_core.packs import (
    Condition,
    Policy,
    Term,
    all_equal,
    count,
    define,
    forbids,
    in_,
    matched_if,
    matches,
    offered,
    overlaps,
    publisher,
    requested,
    requires,
    stated,
    subscriber,
    topic,
    total,
)
from cqos_ros2.endpoint_rules import CONCEPT, ENDPOINTS
from cqos_ros2.guarantee_terms import RECOVERED, RELIABLE
from cqos_ros2.names import HIDDEN, ILLEGAL, REPEATED_UNDERSCORE
from cqos_ros2.policies import (
    ACCUMULATED,
    AVOID_CONVENTIONS,
    BRIDGE,
    BRIDGE_CACHE,
    DEADLINE,
    DEPTH,
    DISTRO,
    DOMAIN,
    DURABILITY,
    HISTORY,
    INTERFACE,
    KEYED,
    LATCHED,
    LATENCY_BUDGET,
    LEASE,
    LIVELINESS,
    NETWORK,
    OWNERSHIP,
    PARTITION,
    RECORDED_FORM,
    RELIABILITY,
    RMW,
    SIZE,
    SOLE_PUBLISHER,
    TOPIC_NAME,
    TOPIC_TYPE,
    TYPE,
)

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

BOTH_ON_ZENOH: Final = define("both_on_zenoh", (publisher(RMW) == "zenoh") & (subscriber(RMW) == "zenoh"))
REPLAY_UNREAD: Final = define(
    "replay_unread", (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) == "volatile")
)
BOTH_DURABLE: Final = define(
    "both_durable", (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) >= "transient_local")
)


def replays(side: Callable[[Policy], Term]) -> Condition:
    """Define that one side takes part in replays to late subscriptions, with a depth."""
    return define(f"{side.__name__}_replays", (side(HISTORY) == "keep_last") & (side(DURABILITY) >= "transient_local"))


SHALLOWER: Final = define("shallower", requested(DEPTH) < offered(DEPTH))
BATCH: Final = 65_535
"""Bytes that rmw_zenoh sends at once (`transport/link/tx/batch_size`); a larger sample is sent in several parts."""

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
        says="on latched topic `{topic}`, {publisher} with durability {offered durability}, {subscriber} with {requested durability}: a late subscriber gets nothing",
        because="the topic is written once and read later, so a volatile subscription that starts late gets nothing",
        clause=f"{COMPATIBILITY}; REP 2003",
        fixes=("requested durability",),
    ),
    forbids(
        BOTH_DURABLE
        & (
            (BOTH_ON_ZENOH & SHALLOWER)  # whatever their history is
            | (~BOTH_ON_ZENOH & (requested(HISTORY) == "keep_last") & ((offered(HISTORY) == "keep_all") | SHALLOWER))
        ),
        code="ROS203",
        name="history-cut-short",
        says="{publisher} with history {offered history} and depth {offered depth}, {subscriber} with depth {requested depth}: only the newest of what is kept arrives",
        because="the subscription has no room for all that the publisher keeps for it: only the newest remain",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("depth",),
    ),
    forbids(
        BOTH_ON_ZENOH & RELIABLE & ~RECOVERED & (offered(HISTORY) == "keep_last") & (topic(SIZE) > BATCH),
        code="ROS210",
        name="large-samples-dropped-by-zenoh",
        says="{publisher} is reliable with history keep_last, and samples of {size} bytes take several parts: where a link does not take "
        "them in time, Zenoh drops the sample",
        because="rmw_zenoh lets only publishers with keep_all wait for a link. For others it drops a sample once a part of it has waited too "
        "long, and the publisher gets no report",
        clause="rmw_zenoh, rmw_publisher_data.cpp; rmw_zenoh 543, 547 and 696",
        severity="note",
        fixes=("offered history",),
        help="let the publisher keep all, or make both ends transient_local, which ask again for what they missed",
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
        says="latched topic `{topic}` is volatile on both sides, {publisher} and {subscriber}: a late subscriber gets nothing",
        because="the topic is written once and read later, and no endpoint keeps the samples",
        clause=f"{COMPATIBILITY}; REP 2003",
        help="both sides of a latched topic are transient_local; those of tf2_ros are on /tf_static",
    ),
    requires(
        (publisher(RECORDED_FORM) != "words") | (publisher(DISTRO) >= "jazzy"),
        code="ROS209",
        name="recorded-words-distro",
        says="{publisher} is played from a recording with words in the text of its profiles, which its distribution does not read",
        because="rosbag2 reads words there from Jazzy on; before, it stops with `bad conversion`",
        clause="rosbag2_transport and rosbag2_storage, qos.cpp",
        severity="error",
        fixes=("distro",),
        help="state the option `distro`; or play it with Jazzy or newer, or let `ros2 bag reindex` write the description anew",
    ),
    forbids(
        (publisher(RECORDED_FORM) == "list") & (publisher(DISTRO) <= "iron"),
        code="ROS208",
        name="recorded-list-distro",
        says="{publisher} is played from a recording with a list of profiles, which its distribution does not read",
        because="rosbag2 reads version 9 of the description from Jazzy on; before, it stops with `bad conversion`",
        clause="rosbag2_storage, yaml.hpp; rosbag2 2013",
        severity="error",
        fixes=("distro",),
        help="play it with Jazzy or newer, or let `ros2 bag reindex` of the older distribution write the description anew",
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
    forbids(
        topic(SOLE_PUBLISHER) & ~topic(KEYED) & (count(offered(RELIABILITY) >= "best_effort") > 1),
        code="ROS207",
        name="more-publishers-than-stated",
        severity="error",
        says="topic `{topic}` states `sole_publisher`, and has several publishers",
        because="guarantees rest on the fact that no other publisher sends an instance, and a topic without keys is one instance",
        clause="C-QoS, guarantees",
        help="leave out `sole_publisher`",
    ),
)

# ROS4xx: names, and who meets whom -------------------------------------------------------------------------

BOTH_BRIDGES: Final = define(
    "both_zenoh_bridges", (publisher(RMW) == "zenoh_bridge") & (subscriber(RMW) == "zenoh_bridge")
)

NAMES: Final = (
    matched_if(
        publisher(DOMAIN) == subscriber(DOMAIN),
        code="ROS401",
        name="domain-split",
        because="nodes of different ROS domains never meet",
        clause="ROS 2 concepts, The ROS_DOMAIN_ID",
    ),
    matched_if(
        BOTH_ON_ZENOH
        | BOTH_BRIDGES
        | ~(in_(publisher(RMW), "zenoh", "zenoh_bridge") | in_(subscriber(RMW), "zenoh", "zenoh_bridge")),
        code="ROS402",
        name="transport-split",
        because="Zenoh and DDS do not speak with each other, nor do nodes on Zenoh and bridges to it, which name their "
        "keys differently; micro-ROS meets DDS through its agent",
        clause="rmw_zenoh, docs/design.md; zenoh-plugin-ros2dds, ros2_utils.rs",
    ),
    matched_if(
        offered(TYPE) == requested(TYPE),
        code="ROS403",
        name="type-mismatch",
        because="endpoints of one topic with different message types never exchange a sample",
        clause="DDS 1.4, 2.2.2.3",
        severity="error",
        always=True,
    ),
    matched_if(
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
    matched_if(
        publisher(NETWORK) == subscriber(NETWORK),
        code="ROS409",
        name="network-split",
        because="discovery does not leave the network, or the machine, that it is confined to",
        clause="ROS 2, Improved Dynamic Discovery",
    ),
    matched_if(
        publisher(BRIDGE) != subscriber(BRIDGE),
        code="ROS410",
        name="own-bridge",
        because="a bridge does not take back what it publishes itself",
        clause="zenoh-plugin-ros2dds, qos_helpers.rs; domain_bridge and ros_gz_bridge, ignore_local_publications; ros1_bridge, factory",
        severity="note",  # it is so on purpose; an end without a partner has a finding of its own
    ),
    matched_if(
        overlaps(offered(PARTITION), requested(PARTITION)) | (offered(PARTITION) == requested(PARTITION)),
        code="ROS411",
        name="partition-split",
        because="files of the middleware put the two into different partitions",
        clause="DDS 1.4, 2.2.3.13",
    ),
    matched_if(
        offered(OWNERSHIP) == requested(OWNERSHIP),
        code="ROS412",
        name="ownership-split",
        because="files of the middleware give the two different ownership, and exclusive is no stronger form of shared",
        clause="DDS 1.4, 2.2.3.9",
    ),
    requires(
        (offered(LATENCY_BUDGET) <= requested(LATENCY_BUDGET))
        | ((publisher(RMW) == "fastdds") & (subscriber(RMW) == "fastdds")),
        code="ROS413",
        name="latency-budget-split",
        says="{publisher} may put samples off for longer than {subscriber} accepts",
        because="a file of the middleware sets the latency budget, and all but Fast DDS compare it",
        clause="DDS 1.4, 2.2.3.8; Fast DDS, request/offer check",
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
