"""What a broken link costs in ROS 2."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    OUTAGE,
    REPAIR_TIME,
    TAKEN_EVERY,
    define,
    gives,
    offered,
    requested,
    subscriber,
    topic,
)
from cqos_ros2.guarantee_terms import (
    KEEPS_ALL,
    KEPT,
    MAX_AGE,
    MAX_GAP,
    SILENCE,
    STATE_REPAIR,
    STATE_TAKEN,
    STILL_MATCHED,
    STRAIGHT,
    WRITTEN_ONCE,
    lives,
    spans,
)
from cqos_ros2.policies import (
    DEPTH,
    HISTORY,
    LIFESPAN,
    PERIOD,
    RMW,
)

# What a broken link costs: shorter than the participant leases, both ends stay matched and lost samples are sent again;
# longer, the match ends, and begins anew as for a late subscription.
ENDS_MATCH: Final = "DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4"
SENT_AGAIN: Final = define("sent_again", topic(PERIOD) < "infinite")
# Until a sample that was lost, or kept, has arrived and the program takes it.
UNTIL_TAKEN: Final = define("until_taken", REPAIR_TIME + requested(TAKEN_EVERY))
# What is newest was sent within a period; while both stay matched, in the outage at the earliest.
NEWEST_LIVES: Final = lives("newest_lives", topic(PERIOD) + UNTIL_TAKEN)
REPAIRED_SILENCE: Final = define("repaired_silence", SILENCE + REPAIR_TIME)
EXPIRED: Final = (
    gives(
        "max_age",
        (subscriber(RMW) != "fastdds") | MAX_AGE.enough(offered(LIFESPAN) + requested(TAKEN_EVERY)),
        code="ROS556",
        name="age-while-not-taken",
        because="a subscription of Fast DDS keeps what its program has not taken beyond the lifespan of the publisher",
        clause="DDS 1.4, 2.2.3.16; Fast DDS, seen by running it",
        help="state at the subscription `taken_every`: how often the program takes samples",
    ),
    gives(
        "latest",
        lives("lives_until_taken", UNTIL_TAKEN),
        code="ROS554",
        name="latest-expired",
        because="the newest sample is dropped too once it is older than the lifespan of its publisher",
        clause="DDS 1.4, 2.2.3.16",
        help=f"state the option `repair_time`; {STATE_TAKEN}",
    ),
    gives(
        "latest",
        NEWEST_LIVES,
        survives="subscriber_restart",
        code="ROS555",
        name="latest-expired-in-restart",
        because="the newest sample that is kept may be older than the lifespan of its publisher",
        clause="DDS 1.4, 2.2.3.16",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
)
OVER_AN_OUTAGE: Final = (
    gives(
        "latest",
        KEPT | SENT_AGAIN,
        survives="link_outage",
        code="ROS539",
        name="latest-lost-in-outage",
        because="what is sent while the link is down for longer than a participant lease reaches only a transient_local subscription",
        clause=ENDS_MATCH,
        help="state the `period` of the topic if its publisher sends again and again; else let both ends be transient_local",
    ),
    gives(
        "latest",
        NEWEST_LIVES | (STILL_MATCHED & lives("lives_through_outage", OUTAGE + UNTIL_TAKEN)),
        survives="link_outage",
        code="ROS577",
        name="latest-expired-in-outage",
        because="the newest sample may be older than the lifespan of its publisher once the link is back",
        clause="DDS 1.4, 2.2.3.16",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "loss_free",
        STILL_MATCHED | KEPT,
        survives="link_outage",
        code="ROS540",
        name="loss-in-outage",
        because="after an outage longer than a participant lease a volatile subscription gets only what is sent then",
        clause=ENDS_MATCH,
        help="state the `period` of the topic; let both ends be transient_local, or set `participant_lease` of both nodes to "
        "more than the outage",
    ),
    gives(
        "loss_free",
        (
            STILL_MATCHED
            & define("spans_silence", spans(offered(HISTORY) == "keep_all", offered(DEPTH), REPAIRED_SILENCE))
        )
        | (~STILL_MATCHED & KEEPS_ALL),
        survives="link_outage",
        code="ROS541",
        name="outage-longer-than-publisher-keeps",
        because="the publisher keeps less than is sent until what was lost in the outage has arrived",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_REPAIR,
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all")
        | (
            STILL_MATCHED
            & define(
                "requested_depth_spans_silence",
                WRITTEN_ONCE | (requested(DEPTH) * topic(PERIOD) > REPAIRED_SILENCE + requested(TAKEN_EVERY)),
            )
        ),
        survives="link_outage",
        code="ROS542",
        name="outage-longer-than-subscription-keeps",
        because="what was sent while the link was down arrives at once, and a keep_last subscription replaces the oldest of it",
        clause="DDS 1.4, 2.2.3.18",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "duplicate_free",
        STILL_MATCHED | ~KEPT | (subscriber(RMW) == "fastdds"),
        survives="link_outage",
        code="ROS543",
        name="replayed-after-outage",
        because="a transient_local subscription that is matched again gets again what it got before",
        clause=ENDS_MATCH,
        help="let the application tell by the content what it has had before",
    ),
    gives(
        "ordered",
        STILL_MATCHED | ~KEPT | (subscriber(RMW) == "fastdds"),
        survives="link_outage",
        code="ROS544",
        name="disorder-after-outage",
        because="what a transient_local subscription gets again when it is matched again comes after newer samples",
        clause=ENDS_MATCH,
    ),
    gives(
        "max_gap",
        OUTAGE + topic(PERIOD) <= MAX_GAP,
        survives="link_outage",
        code="ROS545",
        name="gap-in-outage",
        because="nothing arrives while the link is down",
        clause="DDS 1.4, 2.2.3.7",
        help="state the `period` of the topic",
    ),
    gives(
        "max_gap",
        None,
        survives="link_outage",
        doubt=True,
        code="ROS546",
        name="gap-after-outage",
        because="no policy says how soon samples arrive again once the link is back",
        clause="DDS 1.4, 2.2.3.7",
    ),
    *(
        gives(
            word,
            STRAIGHT,
            survives="link_outage",
            doubt=True,
            code=code,
            name=f"{word.replace('_', '-')}-over-outage-of-relay",
            because="how the micro-ROS agent and Zenoh routers take up a link that was down is not known",
            clause="rmw_zenoh, docs/design.md; rmw_microxrcedds",
        )
        for code, word in (
            ("ROS547", "latest"),
            ("ROS548", "loss_free"),
            ("ROS549", "duplicate_free"),
            ("ROS550", "ordered"),
            ("ROS551", "late_join"),
            ("ROS552", "max_age"),
            ("ROS553", "liveness"),
        )
    ),
)
