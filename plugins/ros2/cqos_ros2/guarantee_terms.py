"""What the guarantees of ROS 2 rest on: room, and time that samples span."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cqos_core.packs import (
    OUTAGE,
    REPAIR_TIME,
    TAKEN_EVERY,
    WORDS,
    Condition,
    Operand,
    Policy,
    Term,
    ceil,
    define,
    in_,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_ros2.policies import (
    DEPTH,
    DEPTH_MARGIN,
    DURABILITY,
    HISTORY,
    LIFESPAN,
    LONGEST_CONGESTION,
    PARTICIPANT_LEASE,
    PERIOD,
    RELIABILITY,
    RMW,
    WAIT_BEFORE_CLOSE,
    ZENOH_TRANSPORT,
)

MAX_AGE: Final = WORDS["max_age"]
MAX_GAP: Final = requested(WORDS["max_gap"].need)

BETWEEN_BRIDGES: Final = define("between_bridges", publisher(RMW) == "zenoh_bridge")
OVER_ZENOH: Final = define("over_zenoh", (publisher(RMW) == "zenoh") | BETWEEN_BRIDGES)
FROM_MICRO_ROS: Final = define("from_micro_ros", publisher(RMW) == "micro_ros")
RELAY: Final = ("zenoh", "zenoh_bridge", "micro_ros")
STRAIGHT: Final = define("straight", ~in_(publisher(RMW), *RELAY) & ~in_(subscriber(RMW), *RELAY))
KEPT: Final = define("kept", (offered(DURABILITY) == "transient_local") & (requested(DURABILITY) == "transient_local"))
RELIABLE: Final = define("reliable", (offered(RELIABILITY) == "reliable") & (requested(RELIABILITY) == "reliable"))

# rmw_zenoh keeps `depth` samples for late subscriptions, and asks for `depth` of them, whatever the history is.
KEEPS_ALL: Final = define("keeps_all", (offered(HISTORY) == "keep_all") & ~OVER_ZENOH)
TAKES_ALL: Final = define("takes_all", (requested(HISTORY) == "keep_all") & (subscriber(RMW) != "zenoh"))
# A publisher on Zenoh that waits (congestion control BLOCK) does so until its transport closes.
WAITS: Final = define(
    "waits", (offered(RELIABILITY) == "reliable") & (BETWEEN_BRIDGES | (offered(HISTORY) == "keep_all"))
)
SENDING_AGAIN: Final = ("tcp", "tls", "quic", "ws", "unixsock_stream", "unixpipe", "vsock")
LINKS_SEND_AGAIN: Final = define(
    "links_send_again",
    define("publisher_link_sends_again", in_(publisher(ZENOH_TRANSPORT), *SENDING_AGAIN))
    & define("subscriber_link_sends_again", in_(subscriber(ZENOH_TRANSPORT), *SENDING_AGAIN)),
)
WAITS_LONG_ENOUGH: Final = define(
    "waits_long_enough", WAITS & LINKS_SEND_AGAIN & (publisher(LONGEST_CONGESTION) < publisher(WAIT_BEFORE_CLOSE))
)
# The subscription of rmw_zenoh asks the cache of the publisher for what it missed.
RECOVERED: Final = define("recovered", RELIABLE & KEPT & ~BETWEEN_BRIDGES)
# The silence is as long as the outage and what is left of a period before and after it.
SILENCE: Final = define("silence", OUTAGE + topic(PERIOD) + topic(PERIOD))
STILL_MATCHED: Final = define(
    "still_matched", (publisher(PARTICIPANT_LEASE) > SILENCE) & (subscriber(PARTICIPANT_LEASE) > SILENCE)
)
WRITTEN_ONCE: Final = define("written_once", topic(PERIOD) == "infinite")
NEVER_EXPIRES: Final = define("never_expires", (offered(LIFESPAN) == "infinite") | FROM_MICRO_ROS)
STATE_REPAIR: Final = "state the `period` of the topic and the option `repair_time`"
STATE_TAKEN: Final = "state at the subscription `taken_every`: how often the program takes samples"


def covers_repair(side: Callable[[Policy], Term]) -> Condition:
    """Say that the depth of one side covers what is sent until a lost sample has arrived, and in a subscription until it is taken.

    The sample that shows the loss has a place of its own, so a depth of 1 covers nothing. The round trip says too little
    about a repair: with 5 % loss on loopback and a period of 50 ms, Cyclone DDS left gaps of up to 355 ms.
    """
    repair: Operand = REPAIR_TIME + requested(TAKEN_EVERY) if side is requested else REPAIR_TIME
    enough = (side(DEPTH) > 1) & (side(DEPTH) >= ceil(repair, topic(PERIOD)) + DEPTH_MARGIN)
    return define(f"{side.__name__}_covers_repair", WRITTEN_ONCE | enough)


def lives(name: str, time: Operand) -> Condition:
    """Define that a sample does not expire within some time."""
    return define(name, NEVER_EXPIRES | (offered(LIFESPAN) >= time))


def spans(all_kept: Condition, depth: Operand, time: Operand) -> Condition:
    """Say that a history has room for what is published in some time, both ends of it included."""
    return all_kept | WRITTEN_ONCE | (depth * topic(PERIOD) > time)
