"""What a broken link costs in DDS."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    OUTAGE,
    REPAIR_TIME,
    TAKEN_EVERY,
    WORDS,
    ceil,
    define,
    gives,
    offered,
    requested,
    topic,
)
from cqos_dds.guarantee_terms import (
    CYCLONE_ADDS,
    CYCLONE_HOLDS,
    KEPT,
    MAX_GAP,
    SILENCE,
    STATE_PERIOD,
    STATE_REPAIR,
    STATE_TAKEN,
    STILL_MATCHED,
    STORE_KEEPS_ALL,
    UNTIL_TAKEN,
    lasts,
    lives,
    spans,
)
from cqos_dds.implementations import CYCLONE_DDS, FAST_DDS, publisher_is, subscriber_is
from cqos_dds.kept_policies import (
    DEPTH,
    HISTORY,
    LIFESPAN,
)
from cqos_dds.policies import (
    PERIOD,
    SIZE,
)
from cqos_dds.requested_policies import (
    MAX_BLOCKING_TIME,
)

# What a broken link costs: shorter than the participant leases, both ends stay matched and lost samples are sent again;
# longer, the match ends, and begins anew as for a late reader. All of it was seen by running Cyclone DDS and Fast DDS; a
# reader of Fast DDS remembers how far it had got.
WRITTEN_AGAIN: Final = define("written_again", topic(PERIOD) < "infinite")
# What is newest was written within a period; while both stay matched, in the outage at the earliest.
NEWEST_LIVES: Final = lives("newest_lives", topic(PERIOD) + UNTIL_TAKEN)
REPAIRED_SILENCE: Final = define("repaired_silence", SILENCE + REPAIR_TIME)
# Seen by running both with a lifespan of 100 ms and a program that takes every 500 ms.
EXPIRED: Final = (
    gives(
        "max_age",
        ~subscriber_is(*FAST_DDS) | WORDS["max_age"].enough(offered(LIFESPAN) + requested(TAKEN_EVERY)),
        code="DDS551",
        name="age-while-not-taken",
        because="a reader of Fast DDS keeps what its program has not taken beyond the lifespan of the writer",
        clause="DDS 1.4, 2.2.3.16; Fast DDS, seen by running it",
        help="state at the reader `taken_every`: how often the program takes samples",
    ),
    gives(
        "latest",
        lives("lives_until_taken", UNTIL_TAKEN),
        code="DDS549",
        name="latest-expired",
        because="the newest sample is dropped too once it is older than the lifespan of its writer",
        clause="DDS 1.4, 2.2.3.16",
        help=f"state the option `repair_time`; {STATE_TAKEN}",
    ),
    gives(
        "latest",
        NEWEST_LIVES,
        survives="subscriber_restart",
        code="DDS550",
        name="latest-expired-in-restart",
        because="the newest sample that is kept may be older than the lifespan of its writer",
        clause="DDS 1.4, 2.2.3.16",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
)
OVER_AN_OUTAGE: Final = (
    gives(
        "latest",
        KEPT | WRITTEN_AGAIN,
        survives="link_outage",
        code="DDS540",
        name="latest-lost-in-outage",
        because="what is written while the link is down for longer than a participant lease reaches only a durable reader",
        clause="DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4",
        help=f"{STATE_PERIOD} if its writer writes again and again; else let both ends be durable",
    ),
    gives(
        "latest",
        NEWEST_LIVES | (STILL_MATCHED & lives("lives_through_outage", OUTAGE + UNTIL_TAKEN)),
        survives="link_outage",
        code="DDS554",
        name="latest-expired-in-outage",
        because="the newest sample may be older than the lifespan of its writer once the link is back",
        clause="DDS 1.4, 2.2.3.16",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "loss_free",
        STILL_MATCHED | KEPT,
        survives="link_outage",
        code="DDS541",
        name="loss-in-outage",
        because="after an outage longer than a participant lease a reader that is not durable gets only what is written then",
        clause="DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4",
        fixes=("durability",),
        help=f"{STATE_PERIOD}; let both ends be durable, or set `participant_lease` of both participants to more than the outage",
    ),
    gives(
        "loss_free",
        (STILL_MATCHED & spans(offered, REPAIRED_SILENCE, "silence")) | (~STILL_MATCHED & STORE_KEEPS_ALL),
        survives="link_outage",
        code="DDS542",
        name="outage-longer-than-writer-keeps",
        because="the writer keeps less than is written until what was lost in the outage has arrived",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_REPAIR,
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all")
        | (
            STILL_MATCHED
            & lasts("requested_depth_spans_silence", requested(DEPTH), REPAIRED_SILENCE + requested(TAKEN_EVERY))
        ),
        survives="link_outage",
        code="DDS543",
        name="outage-longer-than-reader-keeps",
        because="what was written while the link was down arrives at once, and a keep_last reader replaces the oldest of it",
        clause="DDS 1.4, 2.2.3.18",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "loss_free",
        ~publisher_is(*CYCLONE_DDS)
        | (offered(MAX_BLOCKING_TIME) == "infinite")
        | define("below_watermark", (topic(SIZE) + CYCLONE_ADDS) * ceil(SILENCE, topic(PERIOD)) <= CYCLONE_HOLDS),
        survives="link_outage",
        doubt=True,
        code="DDS544",
        name="outage-over-watermark",
        because="a writer of Cyclone DDS with more unacknowledged bytes than its high-water mark, 1 to 500 kB, waits for "
        "max_blocking_time and then does not write",
        clause="Cyclone DDS, Internal/Watermarks: WhcLow, WhcHighInit, WhcHigh, WhcAdaptive",
        help="state the `size` and the `period` of the topic",
    ),
    gives(
        "duplicate_free",
        STILL_MATCHED | ~KEPT | subscriber_is(*FAST_DDS),
        survives="link_outage",
        code="DDS545",
        name="replayed-after-outage",
        because="a durable reader that is matched again gets again what it got before",
        clause="DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4",
        help="let the application tell by the content what it has had before",
    ),
    gives(
        "ordered",
        STILL_MATCHED | ~KEPT | subscriber_is(*FAST_DDS),
        survives="link_outage",
        code="DDS546",
        name="disorder-after-outage",
        because="what a durable reader gets again when it is matched again comes after newer samples",
        clause="DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4",
    ),
    gives(
        "max_gap",
        OUTAGE + topic(PERIOD) <= MAX_GAP,
        survives="link_outage",
        code="DDS547",
        name="gap-in-outage",
        because="nothing arrives while the link is down",
        clause="DDS 1.4, 2.2.3.7",
        help=STATE_PERIOD,
    ),
    gives(
        "max_gap",
        None,
        survives="link_outage",
        doubt=True,
        code="DDS548",
        name="gap-after-outage",
        because="no policy says how soon samples arrive again once the link is back",
        clause="DDS 1.4, 2.2.3.7",
    ),
)
