"""What a reader really gets in DDS, one sentence for each condition; see `cqos_core.packs.guarantee` for the words.

A guarantee holds where all its sentences do. They are asked only where a reader says by ``needs:`` that its application
requires the guarantee. Depth, period, deadline and filter are per instance, and so are the guarantees that rest on them.
What other writers of the topic do is not seen in one pair: where that decides, the answer is in doubt.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cqos_core.packs import (
    RELAYED,
    REPAIR_TIME,
    TAKEN_EVERY,
    WORDS,
    Condition,
    Policy,
    Term,
    Unaffected,
    as_condition,
    define,
    gives,
    offered,
    publisher,
    requested,
    topic,
)
from cqos_dds.extension_policies import DISABLE_POSITIVE_ACKS, EXTENSIONS
from cqos_dds.guarantee_terms import (
    DURABLE,
    KEPT,
    MAX_GAP,
    OUTLIVES,
    PASSES,
    RELIABLE,
    RUN_SERVICE,
    STATE_PERIOD,
    STATE_REPAIR,
    STATE_TAKEN,
    STORE_KEEPS_ALL,
    covers_repair,
    instance_limit,
    lives,
)
from cqos_dds.implementations import CYCLONE_DDS, FAST_DDS, either_is, subscriber_is
from cqos_dds.kept_policies import (
    AUTOPURGE_DISPOSED,
    AUTOPURGE_NOWRITER,
    HISTORY,
    LIFESPAN,
    MAX_INSTANCES,
    MAX_SAMPLES,
)
from cqos_dds.late_guarantees import LATE
from cqos_dds.other_writers import ONE_OF_EACH, OTHER_WRITERS
from cqos_dds.outage_guarantees import EXPIRED, OVER_AN_OUTAGE
from cqos_dds.policies import (
    KEYED,
    PARTICIPANT_LEASE,
    PERIOD,
    TIME_BASED_FILTER,
)
from cqos_dds.requested_policies import (
    ACCESS_SCOPE,
    DEADLINE,
    LEASE,
    MAX_BLOCKING_TIME,
    ORDERED,
    OWNERSHIP,
)

# A lost sample can be sent again only while the writer still has it.
WRITER_REPAIRS: Final = define("writer_repairs", (offered(HISTORY) == "keep_all") | covers_repair(offered))


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
    (requested(TIME_BASED_FILTER) <= topic(PERIOD)) | ~subscriber_is(*CYCLONE_DDS),
    code="DDS539",
    name="latest-lost-to-filter",
    because="Cyclone DDS drops for good what the reader's filter holds back, the newest sample as well",
    clause="DDS 1.4, 2.2.3.12; Cyclone DDS, seen by running it",
    help=STATE_PERIOD,
)

NEVER_PURGED: Final = define(
    "never_purged", (requested(AUTOPURGE_NOWRITER) == "infinite") & (requested(AUTOPURGE_DISPOSED) == "infinite")
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
        WRITER_REPAIRS,
        code="DDS505",
        name="loss-by-shallow-writer",
        because="a sample that is lost on the way can be sent again only while the writer still has it",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_REPAIR,
    ),
    gives(
        "loss_free",
        (requested(HISTORY) == "keep_all") | covers_repair(requested),
        code="DDS506",
        name="loss-by-shallow-reader",
        because="a keep_last reader replaces the oldest samples that the program has not taken",
        clause="DDS 1.4, 2.2.3.18",
        help=f"{STATE_REPAIR}; {STATE_TAKEN}",
    ),
    gives(
        "loss_free",
        ~as_condition(offered(DISABLE_POSITIVE_ACKS)),
        code="DDS565",
        name="loss-without-positive-acks",
        because="a writer without positive acks forgets samples after a time, whether they have arrived or not",
        clause="Fast DDS, DisablePositiveACKsQosPolicy",
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
        NEVER_PURGED,
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
            define("deadline_within_gap", offered(DEADLINE) + requested(TIME_BASED_FILTER) + REPAIR_TIME <= MAX_GAP)
            | define(
                "period_within_gap",
                define(
                    "filtered_period_within_gap",
                    topic(PERIOD) + requested(TIME_BASED_FILTER) + REPAIR_TIME <= MAX_GAP,
                )
                | (PASSES & define("written_period_within_gap", topic(PERIOD) + REPAIR_TIME <= MAX_GAP)),
            )
        ),
        code="DDS534",
        name="gap-not-bounded",
        because="neither the writer's deadline nor the period of the topic, with the reader's filter and the time until a lost "
        "sample has arrived, promises a sample in time",
        clause="DDS 1.4, 2.2.3.7 and 2.2.3.12; DDSI-RTPS 2.5, 8.4.15",
        help=STATE_REPAIR,
    ),
    gives(
        "max_gap",
        WRITER_REPAIRS,
        code="DDS552",
        name="gap-by-shallow-writer",
        because="a lost sample that its writer has overwritten never arrives, and any number of samples may be lost in a row",
        clause="DDS 1.4, 2.2.3.18",
        help=STATE_REPAIR,
    ),
    gives(
        "max_gap",
        lives("lives_until_repaired", REPAIR_TIME),
        doubt=True,
        code="DDS553",
        name="gap-by-lifespan",
        because="a lost sample may expire before it has arrived",
        clause="DDS 1.4, 2.2.3.16",
        help="state the option `repair_time`",
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

NOT_MODELLED: Final = tuple(
    gives(
        word,
        (offered(EXTENSIONS) == "none") & (requested(EXTENSIONS) == "none"),
        doubt=True,
        code=code,
        name=f"{name}-by-extension",
        because="a file sets what C-QoS does not model and what may lose samples or delay the loss of a writer",
        fixes=(WORDS[word].need.name,),
        clause="C-QoS, elements that are not modelled",
        help="state `extensions: none` where the elements decide nothing",
    )
    for code, word, name in (
        ("DDS566", "latest", "latest-lost"),
        ("DDS567", "loss_free", "loss"),
        ("DDS568", "late_join", "late-join-lost"),
        ("DDS569", "offline", "offline-lost"),
        ("DDS570", "max_gap", "gap"),
        ("DDS571", "liveness", "loss-of-writer-noticed-late"),
    )
)

# What DDS565 and DDS513 say of every sample holds of the newest, and of kept ones, too. How long the writer keeps them is not read.
FORGOTTEN: Final = tuple(
    gives(
        word,
        ~as_condition(offered(DISABLE_POSITIVE_ACKS)),
        doubt=True,
        code=code,
        name=f"{name}-without-positive-acks",
        because="a writer without positive acks forgets samples after a time, whether they have arrived or not",
        clause="Fast DDS, DisablePositiveACKsQosPolicy",
    )
    for code, word, name in (
        ("DDS577", "latest", "latest-lost"),
        ("DDS578", "late_join", "late-join-lost"),
        ("DDS579", "offline", "offline-lost"),
        ("DDS580", "max_gap", "gap"),
    )
)
PURGED: Final = gives(
    "latest",
    (
        define("taken_before_nowriter_purge", requested(AUTOPURGE_NOWRITER) >= requested(TAKEN_EVERY))
        & define("taken_before_disposed_purge", requested(AUTOPURGE_DISPOSED) >= requested(TAKEN_EVERY))
    )
    | NEVER_PURGED,
    doubt=True,
    code="DDS581",
    name="latest-lost-by-autopurge",
    because="what the program has not taken is dropped some time after an instance is disposed or has no writer any more",
    clause="DDS 1.4, 2.2.3.22",
    help=STATE_TAKEN,
)

GUARANTEES: Final = (
    *(*LATEST, FILTERED_LAST, *LOSS_FREE, *ARRIVAL, *LATE, *TIME),
    *(*OTHER_WRITERS, *NOT_MODELLED, *FORGOTTEN, PURGED, *EXPIRED, *OVER_AN_OUTAGE),
)

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
