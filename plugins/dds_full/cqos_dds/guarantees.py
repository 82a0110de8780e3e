"""What a reader really gets in DDS, one sentence for each condition; see `cqos_core.packs.guarantee` for the words.

A guarantee holds where all its sentences do. They are asked only where a reader says by ``needs:`` that its application
requires the guarantee. Depth, period, deadline and filter are per instance, and so are the guarantees that rest on them.
What other writers of the topic do is not seen in one pair: where that decides, the answer is in doubt.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.packs import (
    OUTAGE,
    RELAYED,
    TAKEN_EVERY,
    WORDS,
    Unaffected,
    as_condition,
    ceil,
    define,
    gives,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_dds.advice import BOTH_DURABLE, KEPT_BY_SERVICE
from cqos_dds.implementations import FAST_DDS, either_is, publisher_is, subscriber_is
from cqos_dds.policies import (
    ACCESS_SCOPE,
    AUTODISPOSE,
    AUTOPURGE_DISPOSED,
    AUTOPURGE_NOWRITER,
    DEADLINE,
    DEPTH,
    DEPTH_MARGIN,
    DESTINATION_ORDER,
    DURABILITY,
    HISTORY,
    KEYED,
    LEASE,
    LIFESPAN,
    MAX_BLOCKING_TIME,
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    ORDERED,
    OWNERSHIP,
    PARTICIPANT_LEASE,
    PERIOD,
    RELIABILITY,
    RESEND_ROUND_TRIPS,
    ROUND_TRIP,
    SERVICE_DEPTH,
    SERVICE_HISTORY,
    SERVICE_MAX_PER_INSTANCE,
    SERVICE_MAX_SAMPLES,
    SERVICE_RUNS,
    SIZE,
    TIME_BASED_FILTER,
)
from cqos_dds.rules import SERVICE_KEEPS_LAST, SERVICE_LIMIT

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.packs import Condition, Operand, Policy, Term

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
RESENT_IN: Final = define("resent_in", ceil(RESEND_ROUND_TRIPS * ROUND_TRIP, topic(PERIOD)) + DEPTH_MARGIN)
# What the program has not taken yet waits in the reader's history too, and a keep_last one replaces it.
WAITING: Final = define(
    "waiting", ceil(RESEND_ROUND_TRIPS * ROUND_TRIP + requested(TAKEN_EVERY), topic(PERIOD)) + DEPTH_MARGIN
)
# The silence is as long as the outage and what is left of a period before and after it.
SILENCE: Final = define("silence", OUTAGE + topic(PERIOD) + topic(PERIOD))
STILL_MATCHED: Final = define(
    "still_matched", (publisher(PARTICIPANT_LEASE) > SILENCE) & (subscriber(PARTICIPANT_LEASE) > SILENCE)
)
ONE_OF_EACH: Final = "which other writers write the instance is not seen in one pair"


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
    """Define that so many samples are what is written of an instance in some time."""
    return define(name, (samples == "unlimited") | (samples * topic(PERIOD) >= time))


def within_limits(side: Callable[[Policy], Term]) -> Condition:
    """Say that the limits of one side cannot be reached: none, or a history that replaces the samples of one instance."""
    none = (
        (side(MAX_SAMPLES) == "unlimited")
        & (side(MAX_INSTANCES) == "unlimited")
        & (instance_limit(side) == "unlimited")
    )
    called = side.__name__
    replaces = (side(HISTORY) == "keep_last") & ~as_condition(topic(KEYED))
    return define(f"{called}_never_full", define(f"{called}_unlimited", none) | replaces)


# Limits of the durability service do not bind what Cyclone DDS keeps; seen by running it.
SERVICE_KEEPS_ALL: Final = define("service_keeps_all", offered(SERVICE_HISTORY) == "keep_all")
UNBOUND: Final = define("unbound", publisher_is("cyclonedds"))
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
        (SERVICE_KEEPS_LAST & lasts("service_depth_spans_absence", offered(SERVICE_DEPTH), OFFLINE))
        | (SERVICE_KEEPS_ALL & (lasts("service_instance_spans_absence", SERVICE_LIMIT, OFFLINE) | UNBOUND))
    )
    & (lasts("service_limit_spans_absence", offered(SERVICE_MAX_SAMPLES), OFFLINE) | UNBOUND),
)
STORE_SPANS: Final = define(
    "store_spans", (KEPT_BY_SERVICE & SERVICE_SPANS) | (~KEPT_BY_SERVICE & spans(offered, OFFLINE, "absence"))
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
STATE_TIMES: Final = "state the `period` of the topic and the option `round_trip_time`"
STATE_PERIOD: Final = "state the `period` of the topic"

LATEST: Final = (
    gives(
        "latest",
        RELIABLE,
        code="DDS501",
        name="latest-over-best-effort",
        because="a lost sample is sent again between reliable endpoints only, and the newest may be the one that is lost",
        clause="DDS 1.4, 2.2.3.14",
        help="let both ends be reliable",
    ),
    gives(
        "latest",
        KEPT,
        survives="subscriber_restart",
        code="DDS502",
        name="latest-not-kept",
        because="what was written before a reader starts reaches it only if both ends are durable and an endpoint or service keeps it",
        clause="DDS 1.4, 2.2.3.4",
        help=DURABLE,
    ),
    gives(
        "latest",
        OUTLIVES | (topic(PERIOD) < "infinite"),
        survives="publisher_restart",
        code="DDS503",
        name="latest-kept-in-writer",
        because="what is kept in the writer's process is gone with it, so a durability service must have it, or it is written anew",
        clause="DDS 1.4, 2.2.3.4",
        help=f"{STATE_PERIOD} if its writer writes again and again; else {RUN_SERVICE}",
    ),
)

# By the standard a reliable reader with a filter gets the last sample in the end. Cyclone DDS drops it; seen by running it.
FILTERED_LAST: Final = gives(
    "latest",
    (requested(TIME_BASED_FILTER) <= topic(PERIOD)) | ~subscriber_is("cyclonedds"),
    code="DDS539",
    name="latest-lost-to-filter",
    because="Cyclone DDS drops for good what the reader's filter holds back, the newest sample as well",
    clause="DDS 1.4, 2.2.3.12; Cyclone DDS, seen by running it",
    help=STATE_PERIOD,
)

LOSS_FREE: Final = (
    gives(
        "loss_free",
        RELIABLE,
        code="DDS504",
        name="loss-over-best-effort",
        because="a lost sample is sent again between reliable endpoints only",
        clause="DDS 1.4, 2.2.3.14",
        help="let both ends be reliable",
    ),
    gives(
        "loss_free",
        (offered(HISTORY) == "keep_all") | (offered(DEPTH) >= RESENT_IN),
        code="DDS505",
        name="loss-by-shallow-writer",
        because="a sample that is lost on the way can be sent again only while the writer still has it",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_TIMES,
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all") | (requested(DEPTH) >= WAITING),
        code="DDS506",
        name="loss-by-shallow-reader",
        because="a keep_last reader replaces the oldest samples that the program has not taken",
        clause="DDS 1.4, 2.2.3.18",
        help=f"{STATE_TIMES}, and at the reader `taken_every`: how often the program takes samples",
    ),
    gives(
        "loss_free",
        offered(LIFESPAN) == "infinite",
        code="DDS507",
        name="loss-by-lifespan",
        because="a sample that is older than the lifespan of its writer is dropped",
        clause="DDS 1.4, 2.2.3.16",
    ),
    gives(
        "loss_free",
        requested(TIME_BASED_FILTER) <= topic(PERIOD),
        code="DDS508",
        name="loss-by-filter",
        because="the reader's filter drops samples of an instance that follow each other too closely",
        clause="DDS 1.4, 2.2.3.12",
        help=STATE_PERIOD,
    ),
    gives(
        "loss_free",
        within_limits(offered) | (offered(MAX_BLOCKING_TIME) == "infinite"),
        doubt=True,
        code="DDS509",
        name="loss-by-limits-of-writer",
        because="a writer at its limits waits for max_blocking_time and then does not write; whether it gets there depends on the readers",
        clause="DDS 1.4, 2.2.3.19",
        help="state `keyed: false` of a topic without instances",
    ),
    gives(
        "loss_free",
        within_limits(requested) | (offered(HISTORY) == "keep_all"),
        doubt=True,
        code="DDS510",
        name="loss-by-limits-of-reader",
        because="a reader at its limits takes no more until its program has taken some, while a keep_last writer goes on overwriting",
        clause="DDS 1.4, 2.2.3.19",
        help="state `keyed: false` of a topic without instances",
    ),
    gives(
        "loss_free",
        offered(OWNERSHIP) == "shared",
        doubt=True,
        code="DDS511",
        name="loss-by-ownership",
        because=f"a reader drops the samples of all exclusive writers but the owner, and {ONE_OF_EACH}",
        clause="DDS 1.4, 2.2.3.9",
        help="it is the owner's samples that arrive: need `latest` where that is what counts",
    ),
    gives(
        "loss_free",
        requested(DESTINATION_ORDER) == "by_reception_timestamp",
        doubt=True,
        code="DDS512",
        name="loss-by-source-order",
        because=f"a sample that comes after one that was written later is dropped, and {ONE_OF_EACH}",
        clause="DDS 1.4, 2.2.3.17",
    ),
    gives(
        "loss_free",
        define(
            "never_purged",
            (requested(AUTOPURGE_NOWRITER) == "infinite") & (requested(AUTOPURGE_DISPOSED) == "infinite"),
        ),
        doubt=True,
        code="DDS513",
        name="loss-by-autopurge",
        because="what the program has not taken is dropped some time after an instance is disposed or has no writer any more",
        clause="DDS 1.4, 2.2.3.22",
    ),
    gives(
        "loss_free",
        KEPT,
        survives="subscriber_restart",
        code="DDS514",
        name="loss-while-reader-restarts",
        because="what is written meanwhile arrives later only if both ends are durable and an endpoint or service keeps it",
        clause="DDS 1.4, 2.2.3.4",
        help=DURABLE,
    ),
    gives(
        "loss_free",
        STORE_KEEPS_ALL & (requested(HISTORY) == "keep_all"),
        survives="subscriber_restart",
        doubt=True,
        code="DDS515",
        name="loss-by-long-restart",
        because="more may be written while a reader restarts than is kept for it",
        clause="DDS 1.4, 2.2.3.18",
        help="where it is known how long a restart takes, need `offline` for that time",
    ),
    gives(
        "loss_free",
        None,
        survives="publisher_restart",
        code="DDS516",
        name="loss-with-writer",
        because="what a writer has not yet sent again is gone with its process; a durability service has readers that come late only",
        clause="DDS 1.4, 2.2.3.4",
    ),
)

ARRIVAL: Final = (
    gives(
        "duplicate_free",
        ~KEPT,
        survives="subscriber_restart",
        code="DDS517",
        name="replayed-twice",
        because="a durable reader that starts again gets again what it got before",
        clause="DDS 1.4, 2.2.3.4",
        help="let the application tell by the content what it has had before",
    ),
    gives(
        "ordered",
        ~as_condition(topic(KEYED))
        | (
            define(
                "ordered_access",
                as_condition(offered(ORDERED))
                & as_condition(requested(ORDERED))
                & define("of_topic", (offered(ACCESS_SCOPE) >= "topic") & (requested(ACCESS_SCOPE) >= "topic")),
            )
            & ~either_is(*FAST_DDS)
        ),
        code="DDS518",
        name="disorder-between-instances",
        because="order is kept within an instance; that of several takes ordered access of scope topic on both sides, which Fast DDS has not",
        clause="DDS 1.4, 2.2.3.6",
        help="state `keyed: false` of a topic without instances; else set both `presentation.ordered_access` and "
        "`presentation.access_scope` on both sides",
    ),
)

LATE: Final = (
    gives(
        "late_join",
        KEPT & RELIABLE,
        code="DDS519",
        name="late-join-not-kept",
        because="samples from before are replayed only between ends that are both durable and reliable, and if an endpoint or service keeps them",
        clause="DDS 1.4, 2.2.3.4",
        help=DURABLE,
    ),
    gives(
        "late_join",
        STORE_HAS_ROOM,
        code="DDS520",
        name="late-join-of-shallow-store",
        because="the writer's history, or that of the durability service, keeps no more for readers that come late",
        clause="DDS 1.4, 2.2.3.5 and 2.2.3.18",
        fixes=(
            *("history.depth", "history", "durability_service.history_depth", "durability_service.history_kind"),
            *("resource_limits.max_samples", "resource_limits.max_samples_per_instance"),
        ),
    ),
    gives(
        "late_join",
        has_room(requested, LATE_JOIN),
        code="DDS521",
        name="late-join-of-shallow-reader",
        because="of what is replayed the reader keeps no more than its history",
        clause="DDS 1.4, 2.2.3.18",
    ),
    gives(
        "late_join",
        offered(LIFESPAN) >= LATE_JOIN * topic(PERIOD),
        code="DDS522",
        name="late-join-expired",
        because="of what is kept only so much is left as was written within the lifespan",
        clause="DDS 1.4, 2.2.3.16",
        help=STATE_PERIOD,
    ),
    gives(
        "late_join",
        OUTLIVES,
        survives="publisher_restart",
        code="DDS523",
        name="late-join-kept-in-writer",
        because="what is kept in the writer's process is gone with it; only a durability service has it longer",
        clause="DDS 1.4, 2.2.3.4",
        help=RUN_SERVICE,
    ),
    gives(
        "late_join",
        ~as_condition(offered(AUTODISPOSE)),
        survives="publisher_restart",
        code="DDS524",
        name="late-join-disposed",
        because="a writer that ends disposes its instances, so the durability service drops what should outlive it",
        clause="DDS 1.4, 2.2.3.21",
    ),
    gives(
        "late_join",
        requested(AUTOPURGE_NOWRITER) == "infinite",
        survives="publisher_restart",
        doubt=True,
        code="DDS525",
        name="late-join-purged",
        because="what comes from a durability service while its writer is away is dropped if the program does not take it in time",
        clause="DDS 1.4, 2.2.3.22",
    ),
    gives(
        "late_join",
        offered(DURABILITY) != "transient",
        survives="intermediary_restart",
        doubt=True,
        code="DDS526",
        name="late-join-in-memory-of-service",
        because="a durability service keeps transient samples in memory, which only a second service bridges",
        clause="DDS 1.4, 2.2.3.4",
        help="offer persistent, which a service keeps on disk",
    ),
    gives(
        "offline",
        KEPT & RELIABLE,
        code="DDS527",
        name="offline-not-kept",
        because="what is written while a reader is away reaches it later only if both ends are durable and reliable, and an endpoint or service keeps it",
        clause="DDS 1.4, 2.2.3.4",
        help=DURABLE,
    ),
    gives(
        "offline",
        STORE_SPANS,
        code="DDS528",
        name="offline-longer-than-store",
        because="the writer's history, or that of the durability service, keeps less than is written meanwhile",
        clause="DDS 1.4, 2.2.3.5 and 2.2.3.18",
        fixes=STORE,
        help=STATE_PERIOD,
    ),
    gives(
        "offline",
        spans(requested, OFFLINE, "absence"),
        code="DDS529",
        name="offline-longer-than-history",
        because="of what was written meanwhile the reader keeps no more than its history",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_PERIOD,
    ),
    gives(
        "offline",
        offered(LIFESPAN) >= OFFLINE,
        code="DDS530",
        name="offline-longer-than-lifespan",
        because="what is older than the lifespan of its writer is not kept",
        clause="DDS 1.4, 2.2.3.16",
    ),
    gives(
        "offline",
        OUTLIVES & ~as_condition(offered(AUTODISPOSE)),
        survives="publisher_restart",
        code="DDS531",
        name="offline-kept-in-writer",
        because="only a durability service keeps what its writer wrote, and only if the writer does not dispose of it when it ends",
        clause="DDS 1.4, 2.2.3.4 and 2.2.3.21",
        help=RUN_SERVICE,
    ),
    gives(
        "offline",
        offered(DURABILITY) != "transient",
        survives="intermediary_restart",
        doubt=True,
        code="DDS532",
        name="offline-in-memory-of-service",
        because="a durability service keeps transient samples in memory, which only a second service bridges",
        clause="DDS 1.4, 2.2.3.4",
        help="offer persistent, which a service keeps on disk",
    ),
)

# A filter lets the first sample through that comes after its separation, unless it holds none back at all.
PASSES: Final = define("passes", requested(TIME_BASED_FILTER) <= topic(PERIOD))

TIME: Final = (
    gives(
        "max_age",
        offered(LIFESPAN),
        code="DDS533",
        name="age-not-bounded",
        because="only the writer's lifespan keeps old samples from arriving",
        clause="DDS 1.4, 2.2.3.16",
        help="the clocks of both ends must agree, because the age is counted from when the sample was written",
    ),
    gives(
        "max_gap",
        RELIABLE
        & (
            (offered(DEADLINE) + requested(TIME_BASED_FILTER) <= MAX_GAP)
            | define(
                "period_within_gap",
                (topic(PERIOD) + requested(TIME_BASED_FILTER) <= MAX_GAP) | (PASSES & (topic(PERIOD) <= MAX_GAP)),
            )
        ),
        code="DDS534",
        name="gap-not-bounded",
        because="neither the writer's deadline nor the period of the topic, with the reader's filter, promises a sample in time that also arrives",
        clause="DDS 1.4, 2.2.3.7 and 2.2.3.12",
        help=STATE_PERIOD,
    ),
    gives(
        "max_gap",
        (offered(OWNERSHIP) == "exclusive")
        & define(
            "failover_within_gap",
            define("lease_within_gap", (offered(LEASE) <= MAX_GAP) | (publisher(PARTICIPANT_LEASE) <= MAX_GAP))
            | (requested(DEADLINE) <= MAX_GAP),
        ),
        survives="publisher_restart",
        code="DDS535",
        name="gap-while-writer-restarts",
        because="nothing arrives while the writer is away, unless another exclusive writer takes over once its lease, that of its participant or the deadline is over",
        clause="DDS 1.4, 2.2.3.9.2",
        help="let a second exclusive writer stand by, with a lease or a deadline within that time",
    ),
    gives(
        "max_gap",
        offered(OWNERSHIP) == "shared",
        survives="publisher_restart",
        doubt=True,
        code="DDS536",
        name="gap-until-failover",
        because=f"another exclusive writer takes over if there is one, and {ONE_OF_EACH}",
        clause="DDS 1.4, 2.2.3.9.2",
        help="let a second exclusive writer stand by",
    ),
    gives(
        "liveness",
        WORDS["liveness"].enough(offered(LEASE)) | WORDS["liveness"].enough(publisher(PARTICIPANT_LEASE)),
        code="DDS537",
        name="loss-of-writer-unnoticed",
        because="a writer counts as alive until its lease, or that of its participant, has run out",
        clause="DDS 1.4, 2.2.3.11; DDSI-RTPS 2.5, 8.5.3.2",
        fixes=("liveliness.lease_duration",),
        help="with liveliness automatic only a dead process is noticed, with manual_by_topic a program that hangs as well",
    ),
    gives(
        "liveness",
        ~as_condition(offered(RELAYED)),
        code="DDS538",
        name="liveness-behind-bridge",
        because="a bridge stays alive when those whose samples it carries die",
        clause="C-QoS, guarantees over bridges",
        help="state `carries: [liveliness]` of the bridge, where it stops publishing when its source is gone",
    ),
)

# What a broken link costs: shorter than the participant leases, both ends stay matched and lost samples are sent again;
# longer, the match ends, and begins anew as for a late reader. All of it was seen by running Cyclone DDS and Fast DDS; a
# reader of Fast DDS remembers how far it had got.
WRITTEN_AGAIN: Final = define("written_again", topic(PERIOD) < "infinite")
NEVER_EXPIRES: Final = define("never_expires", offered(LIFESPAN) == "infinite")
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
        NEVER_EXPIRES | (offered(LIFESPAN) >= RESEND_ROUND_TRIPS * ROUND_TRIP + requested(TAKEN_EVERY)),
        code="DDS549",
        name="latest-expired",
        because="the newest sample is dropped too once it is older than the lifespan of its writer",
        clause="DDS 1.4, 2.2.3.16",
        help="state at the reader `taken_every`, how often the program takes samples, and the option `round_trip_time`",
    ),
    gives(
        "latest",
        NEVER_EXPIRES | WRITTEN_AGAIN,
        survives="subscriber_restart",
        code="DDS550",
        name="latest-expired-in-restart",
        because="what is kept is dropped once it is older than the lifespan of its writer",
        clause="DDS 1.4, 2.2.3.16",
        help=STATE_PERIOD,
    ),
)
OVER_AN_OUTAGE: Final = (
    gives(
        "latest",
        (KEPT & NEVER_EXPIRES) | WRITTEN_AGAIN,
        survives="link_outage",
        code="DDS540",
        name="latest-lost-in-outage",
        because="what is written while the link is down for longer than a participant lease reaches only a durable reader",
        clause="DDSI-RTPS 2.5, 8.5.3.2; DDS 1.4, 2.2.3.4",
        help=f"{STATE_PERIOD} if its writer writes again and again; else let both ends be durable",
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
        (STILL_MATCHED & spans(offered, SILENCE, "silence")) | (~STILL_MATCHED & STORE_KEEPS_ALL),
        survives="link_outage",
        code="DDS542",
        name="outage-longer-than-writer-keeps",
        because="the writer keeps less than is written while the link is down",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_PERIOD,
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all")
        | (STILL_MATCHED & lasts("requested_depth_spans_silence", requested(DEPTH), SILENCE)),
        survives="link_outage",
        code="DDS543",
        name="outage-longer-than-reader-keeps",
        because="what was written while the link was down arrives at once, and a keep_last reader replaces the oldest of it",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_PERIOD,
    ),
    gives(
        "loss_free",
        ~publisher_is("cyclonedds")
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

GUARANTEES: Final = (*LATEST, FILTERED_LAST, *LOSS_FREE, *ARRIVAL, *LATE, *TIME, *EXPIRED, *OVER_AN_OUTAGE)

RESTARTS: Final = ("subscriber_restart", "publisher_restart")
UNAFFECTED: Final = (
    *(
        Unaffected(
            word,
            ("broker_stop", "broker_crash"),
            "samples go from writer to reader; a durability service only has what late readers get",
            "DDS 1.4, 2.2.3.4",
        )
        for word in ("latest", "loss_free", "duplicate_free", "ordered", "max_age", "max_gap", "liveness")
    ),
    Unaffected(
        "duplicate_free", ("publisher_restart",), "no writer replays what another one wrote", "DDS 1.4, 2.2.3.4"
    ),
    Unaffected("ordered", RESTARTS, "order is kept per writer, and a restart makes a new one", "DDS 1.4, 2.2.3.6"),
    *(
        Unaffected(word, ("subscriber_restart",), "a restarted reader is a late reader again", "DDS 1.4, 2.2.3.4")
        for word in ("late_join", "offline")
    ),
    Unaffected("late_join", ("link_outage",), "what is kept stays with the writer or the service", "DDS 1.4, 2.2.3.4"),
    Unaffected("max_age", ("link_outage", *RESTARTS), "the lifespan travels with each sample", "DDS 1.4, 2.2.3.16"),
    Unaffected(
        "liveness",
        ("link_outage", "publisher_restart"),
        "a writer that is silent for its lease counts as lost, whatever silences it",
        "DDS 1.4, 2.2.3.11",
    ),
)
