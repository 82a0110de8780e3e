"""What the guarantees of DDS rest on: room, limits, time that samples span."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cqos_core.packs import (
    OUTAGE,
    REDISCOVERY_TIME,
    REPAIR_TIME,
    TAKEN_EVERY,
    WORDS,
    Condition,
    Operand,
    Policy,
    Term,
    ceil,
    define,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_dds.advice_rules import BOTH_DURABLE, KEPT_BY_SERVICE
from cqos_dds.implementations import CYCLONE_DDS, FAST_DDS, publisher_is
from cqos_dds.kept_policies import (
    DEPTH,
    HISTORY,
    LIFESPAN,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    SERVICE_DEPTH,
    SERVICE_HISTORY,
    SERVICE_MAX_PER_INSTANCE,
    SERVICE_MAX_SAMPLES,
)
from cqos_dds.policies import (
    DEPTH_MARGIN,
    PARTICIPANT_LEASE,
    PERIOD,
    SERVICE_RUNS,
    TIME_BASED_FILTER,
)
from cqos_dds.requested_policies import (
    DURABILITY,
    RELIABILITY,
)
from cqos_dds.rules import SERVICE_KEEPS_LAST, SERVICE_LIMIT

LATE_JOIN: Final = requested(WORDS["late_join"].need)
OFFLINE: Final = requested(WORDS["offline"].need)
MAX_GAP: Final = requested(WORDS["max_gap"].need)

RELIABLE: Final = define("reliable", (offered(RELIABILITY) == "reliable") & (requested(RELIABILITY) == "reliable"))
# Without a service, Fast DDS and OpenDDS keep in the writer's process what they would hand to it.
IN_WRITER: Final = define("in_writer", (offered(DURABILITY) == "transient_local") | publisher_is(*FAST_DDS, "opendds"))
KEPT: Final = define("kept", BOTH_DURABLE & (IN_WRITER | SERVICE_RUNS))
OUTLIVES: Final = define(
    "outlives", (offered(DURABILITY) >= "transient") & (requested(DURABILITY) >= "transient") & SERVICE_RUNS
)
# The silence is as long as the outage and what is left of a period before and after it.
SILENCE: Final = define("silence", OUTAGE + topic(PERIOD) + topic(PERIOD))
STILL_MATCHED: Final = define(
    "still_matched", (publisher(PARTICIPANT_LEASE) > SILENCE) & (subscriber(PARTICIPANT_LEASE) > SILENCE)
)
WRITTEN_ONCE: Final = define("written_once", topic(PERIOD) == "infinite")
NEVER_EXPIRES: Final = define("never_expires", offered(LIFESPAN) == "infinite")
# A filter lets the first sample through that comes after its separation, unless it holds none back at all. What counts is
# when samples were written, so what arrives at once after a loss passes as well; seen by running Cyclone DDS.
PASSES: Final = define("passes", requested(TIME_BASED_FILTER) <= topic(PERIOD))
# A reader that was away gets what was kept for it only when both match again.
ABSENCE: Final = define("absence", OFFLINE + REDISCOVERY_TIME)
ABSENCE_UNTIL_TAKEN: Final = define("absence_until_taken", ABSENCE + requested(TAKEN_EVERY))
# Until a sample that was lost, or kept, has arrived and the program takes it.
UNTIL_TAKEN: Final = define("until_taken", REPAIR_TIME + requested(TAKEN_EVERY))


def covers_repair(side: Callable[[Policy], Term]) -> Condition:
    """Say that the depth of one side covers what is written until a lost sample has arrived, and in a reader until it is taken.

    The sample that shows the loss has a place of its own, so a depth of 1 covers nothing. The round trip says too little
    about a repair: with 5 % loss on loopback and a period of 50 ms, Cyclone DDS left gaps of up to 355 ms.
    """
    repair: Operand = UNTIL_TAKEN if side is requested else REPAIR_TIME
    enough = (side(DEPTH) > 1) & (side(DEPTH) >= ceil(repair, topic(PERIOD)) + DEPTH_MARGIN)
    return define(f"{side.__name__}_covers_repair", WRITTEN_ONCE | enough)


def lives(name: str, time: Operand) -> Condition:
    """Define that a sample does not expire within some time."""
    return define(name, NEVER_EXPIRES | (offered(LIFESPAN) >= time))


def instance_limit(side: Callable[[Policy], Term]) -> Operand:
    """Define how many samples of an instance one side may hold."""
    return define(f"{side.__name__}_most", side(MAX_PER_INSTANCE))


def has_room(side: Callable[[Policy], Term], samples: Operand) -> Condition:
    """Say that the history of one side has room for some samples of an instance, within its limits."""
    called = side.__name__
    last = define(f"{called}_last_suffice", (side(HISTORY) == "keep_last") & (side(DEPTH) >= samples))
    every = define(f"{called}_all_suffice", (side(HISTORY) == "keep_all") & (side(MAX_PER_INSTANCE) >= samples))
    return define(f"{called}_history_has_room", (last | every) & (side(MAX_SAMPLES) >= samples))


def spans(side: Callable[[Policy], Term], time: Operand, spanned: str) -> Condition:
    """Say that the history of one side has room for what is written of an instance in some time, within its limits."""
    called = side.__name__
    last = (side(HISTORY) == "keep_last") & lasts(f"{called}_depth_spans_{spanned}", side(DEPTH), time)
    every = (side(HISTORY) == "keep_all") & lasts(f"{called}_instance_spans_{spanned}", instance_limit(side), time)
    limit = lasts(f"{called}_limit_spans_{spanned}", side(MAX_SAMPLES), time)
    return define(f"{called}_history_spans_{spanned}", (last | every) & limit)


def lasts(name: str, samples: Operand, time: Operand) -> Condition:
    """Define that so many samples are what is written of an instance in some time, both ends of it included."""
    return define(name, (samples == "unlimited") | WRITTEN_ONCE | (samples * topic(PERIOD) > time))


# Limits of the durability service do not bind what Cyclone DDS keeps; seen by running it.
SERVICE_KEEPS_ALL: Final = define("service_keeps_all", offered(SERVICE_HISTORY) == "keep_all")
UNBOUND: Final = define("unbound", publisher_is(*CYCLONE_DDS))
SERVICE_HAS_ROOM: Final = define(
    "service_has_room",
    (
        define("service_last_suffice", SERVICE_KEEPS_LAST & (offered(SERVICE_DEPTH) >= LATE_JOIN))
        | (
            SERVICE_KEEPS_ALL
            & define("service_all_suffice", (offered(SERVICE_MAX_PER_INSTANCE) >= LATE_JOIN) | UNBOUND)
        )
    )
    & ((offered(SERVICE_MAX_SAMPLES) >= LATE_JOIN) | UNBOUND),
)
STORE_HAS_ROOM: Final = define(
    "store_has_room", (KEPT_BY_SERVICE & SERVICE_HAS_ROOM) | (~KEPT_BY_SERVICE & has_room(offered, LATE_JOIN))
)
SERVICE_SPANS: Final = define(
    "service_spans",
    (
        (SERVICE_KEEPS_LAST & lasts("service_depth_spans_absence", offered(SERVICE_DEPTH), ABSENCE))
        | (SERVICE_KEEPS_ALL & (lasts("service_instance_spans_absence", SERVICE_LIMIT, ABSENCE) | UNBOUND))
    )
    & (lasts("service_limit_spans_absence", offered(SERVICE_MAX_SAMPLES), ABSENCE) | UNBOUND),
)
STORE_SPANS: Final = define(
    "store_spans", (KEPT_BY_SERVICE & SERVICE_SPANS) | (~KEPT_BY_SERVICE & spans(offered, ABSENCE, "absence"))
)
STORE_KEEPS_ALL: Final = define(
    "store_keeps_all",
    (KEPT_BY_SERVICE & SERVICE_KEEPS_ALL) | (~KEPT_BY_SERVICE & (offered(HISTORY) == "keep_all")),
)
# Bytes that no reader has acknowledged, up to which a writer of Cyclone DDS never waits: the mark begins at 30 kB, grows to 500 kB, and
# each time that samples are sent again falls, to 1 kB at the lowest. Seen by running it: the first write timed out at 42 kB.
CYCLONE_HOLDS: Final = 1024
CYCLONE_ADDS: Final = 4
"""The header of each sample, in bytes."""
STORE: Final = ("history.depth", "history", "durability_service.history_depth", "durability_service.history_kind")
RUN_SERVICE: Final = "set the option `durability_service_runs` where a service keeps what is transient or persistent"
DURABLE: Final = f"let both ends be durable and reliable; {RUN_SERVICE}"
STATE_PERIOD: Final = "state the `period` of the topic"
STATE_REPAIR: Final = "state the `period` of the topic and the option `repair_time`"
STATE_REDISCOVERY: Final = "state the `period` of the topic and the option `rediscovery_time`"
STATE_TAKEN: Final = "state at the reader `taken_every`: how often the program takes samples"
