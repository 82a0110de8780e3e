"""What a subscription really gets in ROS 2, one sentence for each condition; see `cqos_core.packs.guarantee` for the words.

A guarantee holds where all its sentences do. They are asked only where a subscription says by ``needs:`` that its
application requires the guarantee.

Over Zenoh it is not reliability that a sample arrives by (over TCP the link sends it again), but that it is not dropped where a link
is congested: a reliable publisher with keep_all waits there until its transport closes, and one that is transient_local sends again
from its cache.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    REDISCOVERY_TIME,
    RELAYED,
    REPAIR_TIME,
    TAKEN_EVERY,
    WORDS,
    Condition,
    Operand,
    Unaffected,
    as_condition,
    define,
    gives,
    offered,
    publisher,
    requested,
    topic,
)
from cqos_ros2.guarantee_terms import (
    BETWEEN_BRIDGES,
    FROM_MICRO_ROS,
    KEEPS_ALL,
    KEPT,
    LINKS_SEND_AGAIN,
    MAX_AGE,
    MAX_GAP,
    OVER_ZENOH,
    RECOVERED,
    RELIABLE,
    STATE_REPAIR,
    STATE_TAKEN,
    STRAIGHT,
    TAKES_ALL,
    WAITS,
    WAITS_LONG_ENOUGH,
    covers_repair,
    lives,
    spans,
)
from cqos_ros2.other_publishers import OTHER_PUBLISHERS
from cqos_ros2.outage_guarantees import EXPIRED, OVER_AN_OUTAGE
from cqos_ros2.policies import (
    DEADLINE,
    DEPTH,
    HISTORY,
    KEYED,
    LEASE,
    LIFESPAN,
    LONGEST_CONGESTION,
    PARTICIPANT_LEASE,
    PERIOD,
)

LATE_JOIN: Final = requested(WORDS["late_join"].need)
OFFLINE: Final = requested(WORDS["offline"].need)
# A subscription that was away gets what was kept for it only when both match again.
ABSENCE: Final = define("absence", OFFLINE + REDISCOVERY_TIME)
ABSENCE_UNTIL_TAKEN: Final = define("absence_until_taken", ABSENCE + requested(TAKEN_EVERY))

DELIVERED: Final = define("delivered", (RELIABLE & ~BETWEEN_BRIDGES) | (OVER_ZENOH & LINKS_SEND_AGAIN))
NEVER_DROPPED: Final = define("never_dropped", ~OVER_ZENOH | RECOVERED | WAITS_LONG_ENOUGH)
# A lost sample can be sent again only while the publisher still has it.
PUBLISHER_REPAIRS: Final = define("publisher_repairs", (offered(HISTORY) == "keep_all") | covers_repair(offered))

RMW_ZENOH: Final = "rmw_zenoh, docs/design.md and rmw_publisher_data.cpp"
DROPPED: Final = (
    "where a link is congested Zenoh drops samples. Reliable publishers with keep_all and reliable routes of bridges wait, but only "
    "until their transport closes; reliable transient_local ends of rmw_zenoh ask again for what they missed"
)
STATE_CONGESTION: Final = (
    "for a publisher that waits, state the options `zenoh_transport` and `longest_congestion`, for how long at most a link takes no "
    "sample; where that is longer than `wait_before_close`, set that for the participant and in the configuration of Zenoh"
)
IN_PUBLISHER: Final = "ROS 2 keeps samples in the publisher's process, and they are gone with it"
THROUGH_RELAY: Final = "what goes through the micro-ROS agent or a Zenoh router just then may be lost with it"


def has_room(all_kept: Condition, depth: Operand, samples: Operand) -> Condition:
    """Say that a history has room for some samples."""
    return all_kept | (depth >= samples)


LATEST: Final = (
    gives(
        "latest",
        DELIVERED,
        code="ROS501",
        name="latest-over-best-effort",
        because="a lost sample is sent again between reliable endpoints only, and the newest may be the one that is lost",
        clause="DDS 1.4, 2.2.3.14",
        help="let both ends be reliable",
    ),
    gives(
        "latest",
        KEPT,
        survives="subscriber_restart",
        code="ROS502",
        name="latest-not-kept",
        because="what was sent before a subscription starts reaches it only if both ends are transient_local",
        clause="DDS 1.4, 2.2.3.4",
        help="let both ends be transient_local",
    ),
    gives(
        "latest",
        topic(PERIOD) < "infinite",
        survives="publisher_restart",
        code="ROS503",
        name="latest-kept-in-publisher",
        because="ROS 2 keeps samples in the publisher's process, so only one that is sent anew replaces what is gone with it",
        clause="DDS 1.4, 2.2.3.4",
        help="state the `period` of the topic if its publisher sends again and again; else let it send when it starts",
    ),
)

LOSS_FREE: Final = (
    gives(
        "loss_free",
        DELIVERED,
        code="ROS504",
        name="loss-over-best-effort",
        because="a lost sample is sent again between reliable endpoints only",
        clause="DDS 1.4, 2.2.3.14",
        help="let both ends be reliable",
    ),
    gives(
        "loss_free",
        PUBLISHER_REPAIRS,
        code="ROS505",
        name="loss-by-shallow-publisher",
        because="a sample that is lost on the way can be sent again only while the publisher still has it",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_REPAIR,
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all") | covers_repair(requested),
        code="ROS506",
        name="loss-by-shallow-subscription",
        because="a keep_last subscription replaces the oldest samples that the program has not taken",
        clause="DDS 1.4, 2.2.3.18",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "loss_free",
        (offered(LIFESPAN) == "infinite") | FROM_MICRO_ROS,
        code="ROS507",
        name="loss-by-lifespan",
        because="a sample that is older than the lifespan of its publisher is dropped",
        clause="DDS 1.4, 2.2.3.16",
    ),
    gives(
        "loss_free",
        KEPT,
        survives="subscriber_restart",
        code="ROS508",
        name="loss-while-subscription-restarts",
        because="what is sent meanwhile arrives later only if both ends are transient_local",
        clause="DDS 1.4, 2.2.3.4",
        help="let both ends be transient_local",
    ),
    gives(
        "loss_free",
        None,
        survives="publisher_restart",
        code="ROS509",
        name="loss-with-publisher",
        because="what the publisher has not yet sent again is gone with its process",
        clause="DDS 1.4, 2.2.3.4",
    ),
)

ARRIVAL: Final = (
    gives(
        "duplicate_free",
        ~KEPT,
        survives="subscriber_restart",
        code="ROS510",
        name="replayed-twice",
        because="a transient_local subscription that starts again gets again what it got before",
        clause="DDS 1.4, 2.2.3.4",
        help="let the application tell by the content what it has had before",
    ),
    gives(
        "ordered",
        ~as_condition(topic(KEYED)) | OVER_ZENOH,
        code="ROS511",
        name="disorder-between-instances",
        because="DDS keeps the order within an instance, and ROS 2 cannot ask for that of several",
        clause="DDS 1.4, 2.2.3.6",
        help="send what must stay in order with the same key",
    ),
)

LATE: Final = (
    gives(
        "late_join",
        KEPT & DELIVERED,
        code="ROS512",
        name="late-join-not-kept",
        because="samples from before are replayed only between endpoints that are both transient_local and reliable",
        clause="DDS 1.4, 2.2.3.4",
        help="let both ends be transient_local and reliable",
    ),
    gives(
        "late_join",
        has_room(KEEPS_ALL, offered(DEPTH), LATE_JOIN),
        code="ROS513",
        name="late-join-of-shallow-publisher",
        because="the publisher keeps its history and no more for subscriptions that come late",
        clause="DDS 1.4, 2.2.3.18",
    ),
    gives(
        "late_join",
        has_room(TAKES_ALL, requested(DEPTH), LATE_JOIN),
        code="ROS514",
        name="late-join-of-shallow-subscription",
        because="of what is replayed the subscription keeps no more than its history",
        clause="DDS 1.4, 2.2.3.18",
    ),
    gives(
        "late_join",
        None,
        survives="publisher_restart",
        code="ROS515",
        name="late-join-kept-in-publisher",
        because=IN_PUBLISHER,
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "offline",
        KEPT & DELIVERED,
        code="ROS516",
        name="offline-not-kept",
        because="what is sent while a subscription is away reaches it later only if both ends are transient_local and reliable",
        clause="DDS 1.4, 2.2.3.4",
        help="let both ends be transient_local and reliable",
    ),
    gives(
        "offline",
        define("publisher_spans_absence", spans(KEEPS_ALL, offered(DEPTH), ABSENCE))
        & define("subscription_spans_absence", spans(TAKES_ALL, requested(DEPTH), ABSENCE_UNTIL_TAKEN)),
        code="ROS517",
        name="offline-longer-than-history",
        because="no more than the history of both ends is kept of what is sent until both match again",
        clause="DDS 1.4, 2.2.3.18",
        help=f"state the `period` of the topic and the option `rediscovery_time`; {STATE_TAKEN}",
    ),
    gives(
        "offline",
        lives("lives_through_absence", ABSENCE_UNTIL_TAKEN),
        code="ROS518",
        name="offline-longer-than-lifespan",
        because="what is older than the lifespan of its publisher when the program takes it is not there any more",
        clause="DDS 1.4, 2.2.3.16",
        help=f"state the option `rediscovery_time`; {STATE_TAKEN}",
    ),
)

TIME: Final = (
    gives(
        "max_age",
        MAX_AGE.enough(offered(LIFESPAN)) & ~FROM_MICRO_ROS,
        code="ROS519",
        name="age-not-bounded",
        because="only the publisher's lifespan keeps old samples from arriving, where the middleware has it",
        clause="DDS 1.4, 2.2.3.16",
        help="the clocks of both ends must agree, because the age is counted from when the sample was sent",
    ),
    gives(
        "max_gap",
        DELIVERED
        & (
            (offered(DEADLINE) + REPAIR_TIME <= MAX_GAP)
            | define("period_within_gap", topic(PERIOD) + REPAIR_TIME <= MAX_GAP)
        ),
        code="ROS520",
        name="gap-not-bounded",
        because="neither the publisher's deadline nor the period of the topic, with the time until a lost sample has arrived, "
        "promises a sample in time",
        clause="DDS 1.4, 2.2.3.7; DDSI-RTPS 2.5, 8.4.15",
        help=STATE_REPAIR,
    ),
    gives(
        "max_gap",
        PUBLISHER_REPAIRS | OVER_ZENOH,
        code="ROS570",
        name="gap-by-shallow-publisher",
        because="a lost sample that its publisher has overwritten never arrives, and any number of samples may be lost in a row",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_REPAIR,
    ),
    gives(
        "max_gap",
        lives("lives_until_repaired", REPAIR_TIME),
        doubt=True,
        code="ROS571",
        name="gap-by-lifespan",
        because="a lost sample may expire before it has arrived",
        clause="DDS 1.4, 2.2.3.16",
        help="state the option `repair_time`",
    ),
    gives(
        "liveness",
        WORDS["liveness"].enough(offered(LEASE))
        | define("node_lease_suffices", ~OVER_ZENOH & WORDS["liveness"].enough(publisher(PARTICIPANT_LEASE))),
        code="ROS521",
        name="loss-of-publisher-unnoticed",
        because="a publisher counts as alive until its lease, or that of its node's participant, has run out",
        clause="DDS 1.4, 2.2.3.11; DDSI-RTPS 2.5, 8.5.3.2",
        fixes=("liveliness_lease_duration",),
        help="with liveliness automatic only a dead process is noticed, with manual_by_topic a program that hangs as well",
    ),
    gives(
        "liveness",
        ~as_condition(offered(RELAYED)),
        code="ROS522",
        name="liveness-behind-bridge",
        because="a bridge stays alive when those whose samples it carries die",
        clause="C-QoS, guarantees over bridges",
        help="state under `carries:` of the bridge that it carries liveliness on, where it does",
    ),
)

# What was found later, and so has later codes ---------------------------------------------------------------

LATER: Final = (
    gives(
        "latest",
        NEVER_DROPPED | (WAITS & LINKS_SEND_AGAIN & KEPT),  # replayed when the transport opens again
        doubt=True,
        code="ROS523",
        name="latest-dropped-by-zenoh",
        because=DROPPED,
        clause=RMW_ZENOH,
        help=STATE_CONGESTION,
    ),
    gives(
        "loss_free",
        ~OVER_ZENOH
        | WAITS_LONG_ENOUGH
        # What is asked for again is in a cache of `depth` samples, whatever the history is.
        | (RECOVERED & ((offered(HISTORY) == "keep_last") | covers_repair(offered))),
        doubt=True,
        code="ROS524",
        name="loss-by-zenoh",
        because=DROPPED,
        clause=RMW_ZENOH,
        help=STATE_CONGESTION,
    ),
    gives(
        "loss_free",
        KEEPS_ALL & (requested(HISTORY) == "keep_all"),
        survives="subscriber_restart",
        doubt=True,
        code="ROS525",
        name="loss-by-long-restart",
        because="more may be sent while a subscription restarts than both histories keep",
        clause="DDS 1.4, 2.2.3.18",
        help="where it is known how long a restart takes, need `offline` for that time",
    ),
    gives(
        "late_join",
        lives("kept_lives", LATE_JOIN * topic(PERIOD) + REPAIR_TIME + requested(TAKEN_EVERY)),
        code="ROS526",
        name="late-join-expired",
        because="of what is kept only so much is left when the program takes it as was sent within the lifespan of the publisher",
        clause="DDS 1.4, 2.2.3.16",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "offline",
        None,
        survives="publisher_restart",
        code="ROS527",
        name="offline-kept-in-publisher",
        because=IN_PUBLISHER,
        clause="DDS 1.4, 2.2.3.4",
    ),
    gives(
        "max_gap",
        None,
        survives="publisher_restart",
        code="ROS528",
        name="gap-while-publisher-restarts",
        because="nothing arrives while the publisher is away, and no policy says for how long that is",
        clause="DDS 1.4, 2.2.3.7",
        help="let a second publisher of the topic fill the gap, or need the rest without `survives`",
    ),
    gives(
        "max_gap",
        ~OVER_ZENOH | RECOVERED | (WAITS_LONG_ENOUGH & (publisher(LONGEST_CONGESTION) + topic(PERIOD) <= MAX_GAP)),
        doubt=True,
        code="ROS529",
        name="gap-by-zenoh",
        because=DROPPED,
        clause=RMW_ZENOH,
        help=f"state the `period` of the topic; {STATE_CONGESTION}",
    ),
    *(
        gives(
            word,
            STRAIGHT,
            survives="intermediary_restart",
            doubt=True,
            code=code,
            name=f"{word.replace('_', '-')}-through-relay",
            because=THROUGH_RELAY,
            clause="rmw_zenoh, docs/design.md; rmw_microxrcedds",
        )
        for code, word in (
            ("ROS530", "latest"),
            ("ROS531", "loss_free"),
            ("ROS532", "late_join"),
            ("ROS533", "offline"),
            ("ROS534", "max_gap"),
            ("ROS535", "duplicate_free"),
            ("ROS536", "ordered"),
            ("ROS537", "max_age"),
            ("ROS538", "liveness"),
        )
    ),
)

GUARANTEES: Final = (
    *(*LATEST, *LOSS_FREE, *ARRIVAL, *LATE, *TIME, *LATER),
    *(*OTHER_PUBLISHERS, *EXPIRED, *OVER_AN_OUTAGE),
)

RESTARTS: Final = ("subscriber_restart", "publisher_restart")
UNAFFECTED: Final = (
    Unaffected(
        "duplicate_free", ("publisher_restart",), "no publisher replays what another one sent", "DDS 1.4, 2.2.3.4"
    ),
    Unaffected("ordered", RESTARTS, "order is kept per publisher, and a restart makes a new one", "DDS 1.4, 2.2.3.6"),
    *(
        Unaffected(word, ("subscriber_restart",), "a restarted subscription is a late one again", "DDS 1.4, 2.2.3.4")
        for word in ("late_join", "offline")
    ),
    Unaffected("max_age", RESTARTS, "the lifespan travels with each sample", "DDS 1.4, 2.2.3.16"),
    Unaffected("liveness", ("publisher_restart",), "it is the loss that is noticed", "DDS 1.4, 2.2.3.11"),
)
