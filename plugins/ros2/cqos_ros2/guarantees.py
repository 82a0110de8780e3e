"""What a subscription really gets in ROS 2, one sentence for each condition; see `cqos_core.guarantee` for the words.

A guarantee holds where all its sentences do. They are asked only where a subscription says by ``needs:`` that its
application counts on the guarantee.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.expression import as_sentence, ceil, offered, requested, topic
from cqos_core.guarantee import RELAYED, WORDS, gives
from cqos_ros2.policies import (
    DEADLINE,
    DEPTH,
    DEPTH_MARGIN,
    DURABILITY,
    HISTORY,
    LEASE,
    LIFESPAN,
    PERIOD,
    RELIABILITY,
    RESEND_ROUND_TRIPS,
    ROUND_TRIP,
)

if TYPE_CHECKING:
    from cqos_core.expression import Operand, Sentence

LATE_JOIN: Final = requested(WORDS["late_join"].need)
OFFLINE: Final = requested(WORDS["offline"].need)
MAX_GAP: Final = requested(WORDS["max_gap"].need)

RELIABLE: Final = (offered(RELIABILITY) == "reliable") & (requested(RELIABILITY) == "reliable")
KEPT: Final = (offered(DURABILITY) == "transient_local") & (requested(DURABILITY) == "transient_local")
RESENT_IN: Final = ceil(RESEND_ROUND_TRIPS * ROUND_TRIP, topic(PERIOD)) + DEPTH_MARGIN


def has_room(history: Operand, depth: Operand, samples: Operand) -> Sentence:
    """Say that a history has room for some samples."""
    return (history == "keep_all") | (depth >= samples)


def spans(history: Operand, depth: Operand, time: Operand) -> Sentence:
    """Say that a history has room for what is published in some time."""
    return (history == "keep_all") | (depth * topic(PERIOD) >= time)


GUARANTEES: Final = (
    gives(
        "latest",
        RELIABLE,
        code="ROS501",
        name="latest-over-best-effort",
        because="a lost sample is sent again between reliable endpoints only, and the newest may be the one that is lost",
        clause="DDS 1.4, 2.2.3.14",
    ),
    gives(
        "latest",
        KEPT,
        survives="subscriber_restart",
        code="ROS502",
        name="latest-not-kept",
        because="what was sent before a subscription starts reaches it only if both ends are transient_local",
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "latest",
        offered(DURABILITY) > "transient_local",
        survives="publisher_restart",
        code="ROS503",
        name="latest-kept-in-publisher",
        because="ROS 2 keeps samples in the publisher's process, and they are gone with it",
        clause="DDS 1.4, 2.2.3.4",
        help="publish the value again when the node starts",
    ),
    gives(
        "loss_free",
        RELIABLE,
        code="ROS504",
        name="loss-over-best-effort",
        because="a lost sample is sent again between reliable endpoints only",
        clause="DDS 1.4, 2.2.3.14",
    ),
    gives(
        "loss_free",
        has_room(offered(HISTORY), offered(DEPTH), RESENT_IN),
        code="ROS505",
        name="loss-by-shallow-publisher",
        because="a sample that is lost on the way can be sent again only while the publisher still has it",
        clause="DDS 1.4, 2.2.3.18",
        fixes=("depth", "history"),
    ),
    gives(
        "loss_free",
        has_room(requested(HISTORY), requested(DEPTH), RESENT_IN),
        code="ROS506",
        name="loss-by-shallow-subscription",
        because="samples that wait for one that is sent again push out older ones that nobody has taken yet",
        clause="DDS 1.4, 2.2.3.18",
        fixes=("depth", "history"),
    ),
    gives(
        "loss_free",
        offered(LIFESPAN) == "infinite",
        code="ROS507",
        name="loss-by-lifespan",
        because="a sample that is older than the lifespan of its publisher is dropped",
        clause="DDS 1.4, 2.2.3.16",
    ),
    gives(
        "loss_free",
        KEPT & (requested(HISTORY) == "keep_all") & (offered(HISTORY) == "keep_all"),
        survives="subscriber_restart",
        code="ROS508",
        name="loss-while-subscription-restarts",
        because="what is sent meanwhile arrives later only if the publisher keeps all of it for subscriptions to come",
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "loss_free",
        offered(DURABILITY) > "transient_local",
        survives="publisher_restart",
        code="ROS509",
        name="loss-with-publisher",
        because="what the publisher has not yet sent again is gone with its process",
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "duplicate_free",
        offered(RELIABILITY) >= "best_effort",
        code="ROS510",
        name="duplicates",
        because="a subscription takes every sample of a publisher once, by its number",
        clause="DDSI-RTPS 2.5, 8.4",
    ),
    gives(
        "ordered",
        offered(RELIABILITY) >= "best_effort",
        code="ROS511",
        name="disorder",
        because="a subscription takes the samples of one publisher by their numbers",
        clause="DDSI-RTPS 2.5, 8.4",
    ),
    gives(
        "late_join",
        KEPT & RELIABLE,
        code="ROS512",
        name="late-join-not-kept",
        because="samples from before are replayed only between endpoints that are both transient_local and reliable",
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "late_join",
        has_room(offered(HISTORY), offered(DEPTH), LATE_JOIN),
        code="ROS513",
        name="late-join-of-shallow-publisher",
        because="the publisher keeps its history and no more for subscriptions that come late",
        clause="DDS 1.4, 2.2.3.18",
        fixes=("depth", "history"),
    ),
    gives(
        "late_join",
        has_room(requested(HISTORY), requested(DEPTH), LATE_JOIN),
        code="ROS514",
        name="late-join-of-shallow-subscription",
        because="of what is replayed the subscription keeps no more than its history",
        clause="DDS 1.4, 2.2.3.18",
        fixes=("depth", "history"),
    ),
    gives(
        "late_join",
        offered(DURABILITY) > "transient_local",
        survives="publisher_restart",
        code="ROS515",
        name="late-join-kept-in-publisher",
        because="ROS 2 keeps samples in the publisher's process, and they are gone with it",
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "offline",
        KEPT & RELIABLE,
        code="ROS516",
        name="offline-not-kept",
        because="what is sent while a subscription is away reaches it later only if both ends are transient_local and reliable",
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "offline",
        spans(offered(HISTORY), offered(DEPTH), OFFLINE) & spans(requested(HISTORY), requested(DEPTH), OFFLINE),
        code="ROS517",
        name="offline-longer-than-history",
        because="no more than the history of both ends is kept of what is sent meanwhile",
        clause="DDS 1.4, 2.2.3.18",
        fixes=("depth", "history"),
    ),
    gives(
        "offline",
        offered(LIFESPAN) >= OFFLINE,
        code="ROS518",
        name="offline-longer-than-lifespan",
        because="what is older than the lifespan of its publisher is not kept",
        clause="DDS 1.4, 2.2.3.16",
    ),
    gives(
        "max_age",
        offered(LIFESPAN),
        code="ROS519",
        name="age-not-bounded",
        because="only the publisher's lifespan keeps old samples from arriving",
        clause="DDS 1.4, 2.2.3.16",
    ),
    gives(
        "max_gap",
        (offered(DEADLINE) <= MAX_GAP) | (RELIABLE & (topic(PERIOD) <= MAX_GAP)),
        code="ROS520",
        name="gap-not-bounded",
        because="neither the publisher's deadline nor the period of the topic promises a sample in time",
        clause="DDS 1.4, 2.2.3.7",
    ),
    gives(
        "liveness",
        offered(LEASE),
        code="ROS521",
        name="loss-of-publisher-unnoticed",
        because="a publisher counts as alive until its lease has run out",
        clause="DDS 1.4, 2.2.3.11",
    ),
    gives(
        "liveness",
        ~as_sentence(offered(RELAYED)),
        code="ROS522",
        name="liveness-behind-bridge",
        because="a bridge stays alive when those whose samples it carries die",
        clause="C-QoS, guarantees over bridges",
        help="state under `carries:` of the bridge that it carries liveliness on, where it does",
    ),
)
