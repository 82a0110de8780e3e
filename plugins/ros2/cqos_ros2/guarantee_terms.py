"""What the guarantees of ROS 2 rest on: room, and time that samples span."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    OUTAGE,
    WORDS,
    Condition,
    Operand,
    define,
    in_,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_ros2.policies import (
    DURABILITY,
    HISTORY,
    PARTICIPANT_LEASE,
    PERIOD,
    RMW,
)

MAX_AGE: Final = WORDS["max_age"]
MAX_GAP: Final = requested(WORDS["max_gap"].need)

BETWEEN_BRIDGES: Final = define("between_bridges", publisher(RMW) == "zenoh_bridge")
OVER_ZENOH: Final = define("over_zenoh", (publisher(RMW) == "zenoh") | BETWEEN_BRIDGES)
FROM_MICRO_ROS: Final = define("from_micro_ros", publisher(RMW) == "micro_ros")
RELAY: Final = ("zenoh", "zenoh_bridge", "micro_ros")
STRAIGHT: Final = define("straight", ~in_(publisher(RMW), *RELAY) & ~in_(subscriber(RMW), *RELAY))
KEPT: Final = define("kept", (offered(DURABILITY) == "transient_local") & (requested(DURABILITY) == "transient_local"))
# Zenoh keeps `depth` samples for late subscriptions whatever the history is.
KEEPS_ALL: Final = define("keeps_all", (offered(HISTORY) == "keep_all") & ~OVER_ZENOH)
# The silence is as long as the outage and what is left of a period before and after it.
SILENCE: Final = define("silence", OUTAGE + topic(PERIOD) + topic(PERIOD))
STILL_MATCHED: Final = define(
    "still_matched", (publisher(PARTICIPANT_LEASE) > SILENCE) & (subscriber(PARTICIPANT_LEASE) > SILENCE)
)


def spans(all_kept: Condition, depth: Operand, time: Operand) -> Condition:
    """Say that a history has room for what is published in some time."""
    return all_kept | (depth * topic(PERIOD) >= time)
