"""Rules about legal settings that may surprise: matches that lose samples, and settings without effect."""

from __future__ import annotations

from functools import reduce
from operator import and_
from typing import Final

from cqos_core.packs import (
    Condition,
    Policy,
    all_equal,
    ceil,
    count,
    define,
    forbids,
    offered,
    requested,
    requires,
    stated,
    topic,
    total,
)
from cqos_dds.implementations import CYCLONE_DDS, FAST_DDS, is_on, publisher_is, subscriber_is
from cqos_dds.kept_policies import (
    AUTODISPOSE,
    DEPTH,
    HISTORY,
    LIFESPAN,
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    SERVICE_DEPTH,
    SERVICE_HISTORY,
)
from cqos_dds.policies import (
    DEPTH_MARGIN,
    KEYED,
    LATCHED,
    OWNERSHIP_STRENGTH,
    PERIOD,
    RESEND_ROUND_TRIPS,
    ROUND_TRIP,
    SERVICE_RUNS,
    SOLE_WRITER,
    TIME_BASED_FILTER,
)
from cqos_dds.requested_policies import (
    ACCESS_SCOPE,
    COHERENT,
    DATA_REPRESENTATION,
    DEADLINE,
    DESTINATION_ORDER,
    DURABILITY,
    LATENCY_BUDGET,
    LEASE,
    LIVELINESS,
    ORDERED,
    OWNERSHIP,
    RELIABILITY,
    TYPE,
)
from cqos_dds.rules import KEEPS_ALL, NAMES_DECIDE

# Pairs and signals ---------------------------------------------------------------------------------------------

# Writers of Fast DDS are transient_local by default, which promises nothing to a late joiner.
ON_PURPOSE: Final = define("on_purpose", stated(offered(DURABILITY)) | ~publisher_is(*FAST_DDS))
REPLAY_UNREAD: Final = define(
    "replay_unread", (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) == "volatile")
)
BOTH_DURABLE: Final = define(
    "both_durable", (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) >= "transient_local")
)
# Cyclone DDS keeps what late readers get by DURABILITY_SERVICE already for transient_local writers; seen by running it.
KEPT_BY_SERVICE: Final = define("kept_by_service", (offered(DURABILITY) >= "transient") | publisher_is(*CYCLONE_DDS))
STORED_ALL: Final = define(
    "stored_all",
    (KEPT_BY_SERVICE & (offered(SERVICE_HISTORY) == "keep_all"))
    | (~KEPT_BY_SERVICE & (offered(HISTORY) == "keep_all")),
)
STORED_MORE_THAN_READ: Final = define(
    "stored_more_than_read",
    (KEPT_BY_SERVICE & (offered(SERVICE_DEPTH) > requested(DEPTH)))
    | (~KEPT_BY_SERVICE & (offered(DEPTH) > requested(DEPTH))),
)
STORED_LATEST: Final = define("stored_latest", (offered(DURABILITY) >= "transient_local") & ~STORED_ALL)


def alike(name: str, *policies: Policy) -> Condition:
    """Define that all writers of a topic offer the same of some policies."""
    return define(f"{name}_alike", reduce(and_, (all_equal(offered(policy)) for policy in policies)))


PAIRS: Final = (
    forbids(
        REPLAY_UNREAD & ON_PURPOSE & ~topic(LATCHED),
        code="DDS201",
        name="history-not-requested",
        says="{publisher} with durability {offered durability}, {subscriber} with {requested durability}: what is kept for late readers is not requested",
        because="samples are kept for late readers, but this one does not ask for them",
        clause="DDS 1.4, 2.2.3.4",
        severity="note",
    ),
    forbids(
        REPLAY_UNREAD & topic(LATCHED),
        code="DDS202",
        name="latched-topic-read-volatile",
        says="on latched topic `{topic}`, {publisher} with durability {offered durability}, {subscriber} with {requested durability}: a late subscriber gets nothing",
        because="the topic is written once and read later, so a volatile reader that starts late gets nothing",
        clause="DDS 1.4, 2.2.3.4",
        fixes=("requested durability",),
    ),
    forbids(
        BOTH_DURABLE & (requested(HISTORY) == "keep_last") & (STORED_ALL | STORED_MORE_THAN_READ),
        code="DDS203",
        name="history-cut-short",
        says="{subscriber} with depth {requested history.depth} has no room for all that {publisher} keeps for it",
        because="the reader has no room for all that is kept for it: only the newest samples remain",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history.depth",),
    ),
    forbids(
        (requested(DEADLINE) < "infinite") & (offered(LIFESPAN) < requested(DEADLINE)),
        code="DDS204",
        name="lifespan-under-requested-deadline",
        because="a sample expires before the reader must have the next one, so for a time it has none",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        offered(LIFESPAN) < requested(LATENCY_BUDGET),
        code="DDS205",
        name="lifespan-under-latency-budget",
        because="a sample may expire within the delay that the reader accepts",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
    ),
    forbids(
        (requested(TIME_BASED_FILTER) > 0)
        & (offered(DEADLINE) < "infinite")
        & (requested(DEADLINE) < requested(TIME_BASED_FILTER) + offered(DEADLINE)),
        code="DDS206",
        name="filter-eats-deadline",
        says="{subscriber} with filter {time_based_filter} and deadline {requested deadline}, {publisher} with deadline {offered deadline}: dropped samples look like missed deadlines",
        because="a sample just before the separation is over is dropped, and the next may come too late for the reader's deadline",
        clause="DDS 1.4, 2.2.3.12",
        severity="note",
        fixes=("time_based_filter",),
    ),
    forbids(
        (offered(DURABILITY) == "volatile")
        & (requested(DURABILITY) == "volatile")
        & topic(LATCHED)
        & stated(topic(LATCHED)),
        code="DDS207",
        name="latched-topic-volatile",
        says="latched topic `{topic}` is volatile on both sides, {publisher} and {subscriber}: a late subscriber gets nothing",
        because="the topic is written once and read later, and no endpoint keeps the samples",
        clause="DDS 1.4, 2.2.3.4",
        help="both sides of a latched topic are durable",
    ),
    forbids(
        ~(
            alike("delivery", RELIABILITY, DURABILITY, OWNERSHIP, DATA_REPRESENTATION)
            & alike("timing", DEADLINE, LATENCY_BUDGET, LIVELINESS, LEASE)
            & alike("order", DESTINATION_ORDER, ACCESS_SCOPE)
            & alike("presentation", COHERENT, ORDERED)
        ),
        code="DDS210",
        name="writers-differ",
        says="the writers of `{topic}` offer different QoS",
        because="a reader may then get the samples of some writers of the topic and not of others",
        clause="DDS 1.4, 2.2.3",
        severity="note",
        help="offer the same on every writer of the topic",
    ),
    forbids(
        (count(offered(OWNERSHIP) == "exclusive") > 1) & all_equal(offered(OWNERSHIP_STRENGTH)),
        code="DDS211",
        name="equal-ownership-strengths",
        says="exclusive writers of `{topic}` have the same ownership strength",
        because="which of them owns an instance is then decided by their ids, which change from start to start",
        clause="DDS 1.4, 2.2.3.9.2",
        help="give each exclusive writer a strength of its own",
    ),
    forbids(
        ~topic(KEYED)
        & (requested(DURABILITY) >= "transient_local")
        & (requested(HISTORY) == "keep_last")
        & (count(STORED_LATEST) > 1)
        & (
            requested(DEPTH)
            < define(
                "replayed",
                total(offered(DEPTH), STORED_LATEST & ~KEPT_BY_SERVICE)
                + total(offered(SERVICE_DEPTH), STORED_LATEST & KEPT_BY_SERVICE),
            )
        ),
        code="DDS212",
        name="depth-below-latched-writers",
        says="{subscriber} with depth {requested history.depth} has no room for what all writers of `{topic}` replay to it",
        because="a topic without keys is one instance, so what all its writers replay to a late reader shares one history",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
    ),
    forbids(
        topic(SOLE_WRITER) & ~topic(KEYED) & (count(offered(RELIABILITY) >= "best_effort") > 1),
        code="DDS214",
        name="more-writers-than-stated",
        severity="error",
        says="topic `{topic}` states `sole_writer`, and has several writers",
        because="guarantees rest on the fact that no other writer writes an instance, and a topic without keys is one instance",
        clause="C-QoS, guarantees",
        help="leave out `sole_writer`",
    ),
    requires(
        ~(stated(offered(TYPE)) & stated(requested(TYPE))) | (offered(TYPE) == requested(TYPE)) | NAMES_DECIDE,
        code="DDS213",
        doubt=True,
        name="type-names-differ",
        says="{publisher} has type {offered type}, {subscriber} has {requested type}: whether one can be read as the other is not known",
        because="both ends announce their types in full and compare them member by member, as type_consistency says",
        clause="DDS-XTypes 1.3, 7.6.3.4",
        fixes=("type",),
    ),
)

# One endpoint by itself ----------------------------------------------------------------------------------------


DURABLE: Final = DURABILITY >= "transient_local"
MANUAL: Final = LIVELINESS >= "manual_by_participant"
RESENDING: Final = define("resending", RESEND_ROUND_TRIPS * ROUND_TRIP)
LIMITED: Final = define(
    "limited", (MAX_SAMPLES < "unlimited") | (MAX_INSTANCES < "unlimited") | (MAX_PER_INSTANCE < "unlimited")
)

ENDPOINTS: Final = (
    forbids(
        DURABLE & (RELIABILITY == "best_effort") & (stated(DURABILITY) | ~is_on(*FAST_DDS)),
        code="DDS330",
        name="durable-best-effort",
        says="{endpoint} with durability {durability} and reliability {reliability}: stored samples are never replayed",
        because="stored samples are replayed over the reliable protocol only, so best_effort never gets them",
        clause="DDSI-RTPS 2.5, 8.4",
    ),
    forbids(
        (offered(DURABILITY) >= "transient") & ~SERVICE_RUNS,
        code="DDS331",
        name="no-durability-service",
        says="{endpoint} offers durability {durability}, but no durability service is part of the design",
        because="a service must keep the samples, which most implementations do not contain",
        clause="DDS 1.4, 2.2.3.4",
        help="set the option `durability_service_runs` where one runs",
    ),
    forbids(
        # A reader notices by the lease that the writer offers, so its own may be infinite; seen by running Cyclone DDS.
        (offered(OWNERSHIP) == "exclusive") & (offered(LEASE) == "infinite") & (offered(DEADLINE) == "infinite"),
        code="DDS332",
        name="exclusive-without-failover",
        because="with neither a lease nor a deadline another writer takes over only when the lease of the owner's participant has run out",
        clause="DDS 1.4, 2.2.3.9.2; DDSI-RTPS 2.5, 8.5.3.2",
        severity="note",
        help="state a lease duration or a deadline, after which another writer takes over",
    ),
    forbids(
        (offered(OWNERSHIP_STRENGTH) != 0) & (offered(OWNERSHIP) == "shared"),
        code="DDS333",
        name="strength-without-exclusive",
        because="the strength counts among exclusive writers only",
        clause="DDS 1.4, 2.2.3.10",
        severity="note",
        fixes=("ownership",),
    ),
    forbids(
        (offered(HISTORY) == "keep_all") & (offered(RELIABILITY) == "reliable") & LIMITED,
        code="DDS334",
        name="keep-all-limited",
        because="once the limits are reached, each write waits for the slowest reader, up to max_blocking_time, and may fail",
        clause="DDS 1.4, 2.2.3.19",
        severity="note",
        fixes=("history",),
    ),
    forbids(
        (COHERENT | ORDERED) & (ACCESS_SCOPE == "instance"),
        code="DDS335",
        name="presentation-of-instances",
        because="within an instance there are no sets to keep together, and samples are in order anyway",
        clause="DDS 1.4, 2.2.3.6",
        severity="note",
        fixes=("presentation.access_scope",),
    ),
    forbids(
        # As in DDS332 it is the writer's lease that counts.
        (offered(LIVELINESS) >= "manual_by_participant") & (offered(LEASE) == "infinite"),
        code="DDS336",
        name="manual-no-lease",
        because="without a lease duration only the loss of the whole participant is noticed, so asserting liveliness has no effect",
        clause="DDS 1.4, 2.2.3.11",
        severity="note",
        help="state the lease duration within which the program asserts its liveliness",
    ),
    forbids(
        (offered(LIVELINESS) == "manual_by_topic")
        & (offered(DEADLINE) < "infinite")
        & (offered(LEASE) < offered(DEADLINE)),
        code="DDS337",
        name="lease-under-deadline",
        because="a writer that keeps its deadline counts as dead before the next sample is due, unless its program asserts it in between",
        clause="DDS 1.4, 2.2.3.11",
        fixes=("liveliness.lease_duration", "liveliness"),
    ),
    forbids(
        MANUAL & (RELIABILITY == "best_effort"),
        code="DDS338",
        name="manual-best-effort",
        because="asserting liveliness over best_effort may get lost, and a healthy writer then counts as dead",
        clause="DDSI-RTPS 2.5, 8.4.13",
        severity="note",
    ),
    forbids(
        (DEADLINE < "infinite") & (RELIABILITY == "best_effort"),
        code="DDS339",
        name="deadline-best-effort",
        because="every lost sample looks like a missed deadline",
        clause="DDS 1.4, 2.2.3.7",
        severity="note",
    ),
    forbids(
        (offered(DEADLINE) < "infinite") & (offered(LIFESPAN) < offered(DEADLINE)),
        code="DDS340",
        name="lifespan-under-deadline",
        because="samples expire before the next one is due",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        offered(DEADLINE) < topic(PERIOD),
        code="DDS341",
        name="deadline-under-period",
        because="the writer promises samples more often than it writes any",
        clause="DDS 1.4, 2.2.3.7",
    ),
    forbids(
        (DEADLINE < "infinite") & (LATENCY_BUDGET > DEADLINE),
        code="DDS342",
        name="latency-budget-over-deadline",
        because="a sample may be put off for longer than the time until the next one is due",
        clause="DDS 1.4, 2.2.3.8",
        severity="note",
        fixes=("latency_budget",),
    ),
    forbids(
        (offered(HISTORY) == "keep_last")
        & (offered(LIFESPAN) < "infinite")
        & (offered(LIFESPAN) > offered(DEPTH) * topic(PERIOD)),
        code="DDS343",
        name="lifespan-over-history",
        says="{endpoint} with lifespan {lifespan}, depth {history.depth} and period {period}: the history drops samples before they expire",
        because="the history drops samples before their lifespan is over",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history.depth", "lifespan"),
    ),
    forbids(
        (offered(RELIABILITY) == "reliable")
        & (offered(HISTORY) == "keep_last")
        & (offered(DEPTH) < ceil(RESENDING, topic(PERIOD)) + DEPTH_MARGIN),
        code="DDS344",
        name="reliable-shallow",
        says="{endpoint} with depth {history.depth}, period {period} and round trip {round_trip_time}: lost samples are overwritten before they are sent again",
        because="a lost sample is overwritten by newer ones before it can be sent again",
        clause="DDS 1.4, 2.2.3.14",
        fixes=("history.depth", "history"),
    ),
    forbids(
        # A reader learns of a loss by heartbeats too, so the period of the samples does not matter.
        (offered(RELIABILITY) == "reliable") & (offered(LIFESPAN) < RESENDING),
        code="DDS345",
        name="reliable-short-lifespan",
        says="{endpoint} with lifespan {lifespan} and round trip {round_trip_time}: lost samples expire before they are sent again",
        because="a lost sample has expired before it can be sent again; what arrives at once is not concerned",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        offered(LIFESPAN) + offered(LIFESPAN) < ROUND_TRIP,
        code="DDS346",
        name="lifespan-under-delivery-time",
        says="{endpoint} with lifespan {lifespan} and round trip {round_trip_time}: samples expire on their way",
        because="samples expire before they arrive, half a round trip later",
        clause="DDS 1.4, 2.2.3.16",
    ),
    forbids(
        KEEPS_ALL & stated(DEPTH),
        code="DDS347",
        name="keep-all-depth",
        says="{endpoint} states a depth beside history keep_all",
        because="keep_all ignores the depth",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
    ),
    forbids(
        (offered(DURABILITY) >= "transient_local")
        & STORED_ALL
        & define("no_limit", (offered(MAX_SAMPLES) == "unlimited") & (offered(MAX_PER_INSTANCE) == "unlimited")),
        code="DDS348",
        name="durable-keep-all",
        because="what each writer keeps for late readers grows without bound unless resource limits are set",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history", "durability_service.history_kind"),
    ),
    forbids(
        (offered(DURABILITY) >= "transient_local")
        & ON_PURPOSE
        & stated(offered(LIFESPAN))
        & (offered(LIFESPAN) < "infinite"),
        code="DDS349",
        name="durable-finite-lifespan",
        because="a reader that comes later than the lifespan gets none of the stored samples",
        clause="DDS 1.4, 2.2.3.16",
        severity="note",
        fixes=("lifespan",),
    ),
    forbids(
        (offered(DURABILITY) >= "transient") & offered(AUTODISPOSE),
        code="DDS350",
        name="durable-autodispose",
        because="a writer that ends disposes its instances, so what should outlive it is gone for late readers",
        clause="DDS 1.4, 2.2.3.21",
        severity="note",
        fixes=("writer_data_lifecycle",),
    ),
    forbids(
        # Of automatic liveliness samples are no sign, and Cyclone DDS takes each sample for one before it filters.
        define(
            "lease_under_filter",
            (requested(TIME_BASED_FILTER) > 0) & (requested(LEASE) < requested(TIME_BASED_FILTER)),
        )
        & (requested(LIVELINESS) == "manual_by_topic")
        & ~subscriber_is(*CYCLONE_DDS),
        code="DDS351",
        name="lease-under-separation",
        because="a writer may leave out for the reader what its filter drops, and then asserts no liveliness within the lease",
        clause="DDS 1.4, 2.2.3.11 and 2.2.3.12; of Cyclone DDS by running it",
        severity="note",
        fixes=("time_based_filter", "liveliness.lease_duration"),
    ),
    forbids(
        # A deadline below the filter itself is DDS301's to tell.
        (requested(TIME_BASED_FILTER) > 0)
        & (requested(DEADLINE) >= requested(TIME_BASED_FILTER))
        & (requested(DEADLINE) < requested(TIME_BASED_FILTER) + topic(PERIOD)),
        code="DDS352",
        name="deadline-under-separation-and-period",
        says="{endpoint} with filter {time_based_filter}, deadline {deadline} and period {period}: dropped samples look like missed deadlines",
        because="the sample after the separation may come a whole period later, which is after the deadline",
        clause="DDS 1.4, 2.2.3.12",
        severity="note",
    ),
)

ADVICE: Final = (*PAIRS, *ENDPOINTS)
