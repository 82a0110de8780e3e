"""What a broken link costs in ROS 2."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    OUTAGE,
    TAKEN_EVERY,
    define,
    gives,
    offered,
    requested,
    subscriber,
    topic,
)
from cqos_ros2.guarantee_terms import (
    FROM_MICRO_ROS,
    KEEPS_ALL,
    KEPT,
    MAX_AGE,
    MAX_GAP,
    SILENCE,
    STILL_MATCHED,
    STRAIGHT,
    spans,
)
from cqos_ros2.policies import (
    DEPTH,
    HISTORY,
    LIFESPAN,
    PERIOD,
    RESEND_ROUND_TRIPS,
    RMW,
    ROUND_TRIP,
)

# What a broken link costs: shorter than the participant leases, both ends stay matched and lost samples are sent again;
# longer, the match ends, and begins anew as for a late subscription.
ENDS_MATCH: Final = "DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4"
SENT_AGAIN: Final = define("sent_again", topic(PERIOD) < "infinite")
NEVER_EXPIRES: Final = define("never_expires", (offered(LIFESPAN) == "infinite") | FROM_MICRO_ROS)
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
        NEVER_EXPIRES | (offered(LIFESPAN) >= RESEND_ROUND_TRIPS * ROUND_TRIP + requested(TAKEN_EVERY)),
        code="ROS554",
        name="latest-expired",
        because="the newest sample is dropped too once it is older than the lifespan of its publisher",
        clause="DDS 1.4, 2.2.3.16",
        help="state at the subscription `taken_every`, how often the program takes samples, and the option `round_trip_time`",
    ),
    gives(
        "latest",
        NEVER_EXPIRES | SENT_AGAIN,
        survives="subscriber_restart",
        code="ROS555",
        name="latest-expired-in-restart",
        because="what is kept is dropped once it is older than the lifespan of its publisher",
        clause="DDS 1.4, 2.2.3.16",
        help="state the `period` of the topic",
    ),
)
OVER_AN_OUTAGE: Final = (
    gives(
        "latest",
        (KEPT & NEVER_EXPIRES) | SENT_AGAIN,
        survives="link_outage",
        code="ROS539",
        name="latest-lost-in-outage",
        because="what is sent while the link is down for longer than a participant lease reaches only a transient_local subscription",
        clause=ENDS_MATCH,
        help="state the `period` of the topic if its publisher sends again and again; else let both ends be transient_local",
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
        (STILL_MATCHED & define("spans_silence", spans(offered(HISTORY) == "keep_all", offered(DEPTH), SILENCE)))
        | (~STILL_MATCHED & KEEPS_ALL),
        survives="link_outage",
        code="ROS541",
        name="outage-longer-than-publisher-keeps",
        because="the publisher keeps less than is sent while the link is down",
        clause="DDS 1.4, 2.2.3.18",
        help="state the `period` of the topic",
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all") | (STILL_MATCHED & (requested(DEPTH) * topic(PERIOD) >= SILENCE)),
        survives="link_outage",
        code="ROS542",
        name="outage-longer-than-subscription-keeps",
        because="what was sent while the link was down arrives at once, and a keep_last subscription replaces the oldest of it",
        clause="DDS 1.4, 2.2.3.18",
        help="state the `period` of the topic",
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
