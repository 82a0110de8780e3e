"""The rules of DDS, one sentence each.

`requires` speaks when its sentence is false, `forbids` only when it is definitely true, and where a `meets`
sentence is false two endpoints of one topic never meet. A bare policy is that of the endpoint itself,
`offered` is the writer's or its publisher's, `requested` the reader's or its subscriber's.
"""

from __future__ import annotations

from typing import Final

from cqos_core.expression import (
    Literal,
    all_equal,
    call,
    ceil,
    count,
    first,
    in_,
    offered,
    overlaps,
    publisher,
    requested,
    stated,
    subscriber,
    topic,
    total,
)
from cqos_core.rule import forbids, meets, requires
from cqos_dds.implementations import (
    FAST_DDS,
    IMPLEMENTATION,
    NO_DESTINATION_ORDER,
    NO_LATENCY_BUDGET,
    NO_LIVELINESS_KIND,
    NO_PRESENTATION,
    NO_REPRESENTATION,
    both_are,
    either_is,
    is_on,
    only_one_is,
    publisher_is,
)
from cqos_dds.policies import (
    ACCESS_SCOPE,
    ANNOUNCEMENT_PERIOD,
    AUTODISPOSE,
    COHERENT,
    DATA_REPRESENTATION,
    DEADLINE,
    DEPTH,
    DEPTH_MARGIN,
    DESTINATION_ORDER,
    DOMAIN,
    DURABILITY,
    HISTORY,
    KEYED,
    LATCHED,
    LATENCY_BUDGET,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    ORDERED,
    OWNERSHIP,
    OWNERSHIP_STRENGTH,
    PARTITION,
    PERIOD,
    RELIABILITY,
    RESEND_ROUND_TRIPS,
    ROUND_TRIP,
    SERVICE_DEPTH,
    SERVICE_HISTORY,
    SERVICE_MAX_INSTANCES,
    SERVICE_MAX_PER_INSTANCE,
    SERVICE_MAX_SAMPLES,
    SERVICE_RUNS,
    TIME_BASED_FILTER,
    TOPIC_TYPE,
    TYPE,
)

# DDS1xx: what a reader requests must be offered --------------------------------------------------------------

SCOPE_FITS: Final = offered(ACCESS_SCOPE) >= requested(ACCESS_SCOPE)
COHERENCE_FITS: Final = offered(COHERENT) >= requested(COHERENT)
ORDER_FITS: Final = offered(ORDERED) >= requested(ORDERED)
LATENCY_FITS: Final = offered(LATENCY_BUDGET) <= requested(LATENCY_BUDGET)
DESTINATION_ORDER_FITS: Final = offered(DESTINATION_ORDER) >= requested(DESTINATION_ORDER)
LIVELINESS_FITS: Final = offered(LIVELINESS) >= requested(LIVELINESS)
LEASE_FITS: Final = offered(LEASE) <= requested(LEASE)
ENCODING_FITS: Final = in_(first(offered(DATA_REPRESENTATION)), requested(DATA_REPRESENTATION))
XCDR1, XML, XCDR2 = Literal("xcdr1"), Literal("xml"), Literal("xcdr2")
SOME_ENCODING_FITS: Final = overlaps(offered(DATA_REPRESENTATION), requested(DATA_REPRESENTATION))

REQUEST_OFFER: Final = (
    requires(
        offered(RELIABILITY) >= requested(RELIABILITY),
        code="DDS101",
        name="reliability-weaker-than-requested",
        because="a best_effort writer never sends a lost sample again, so a reliable reader refuses it",
        clause="DDS 1.4, 2.2.3.14",
    ),
    requires(
        offered(DURABILITY) >= requested(DURABILITY),
        code="DDS102",
        name="durability-weaker-than-requested",
        because="what is written is kept for late readers for a shorter time than the reader counts on",
        clause="DDS 1.4, 2.2.3.4",
    ),
    requires(
        offered(DEADLINE) <= requested(DEADLINE),
        code="DDS103",
        name="deadline-longer-than-requested",
        because="the writer promises samples less often than the reader counts on",
        clause="DDS 1.4, 2.2.3.7",
    ),
    requires(
        LIVELINESS_FITS | both_are(*NO_LIVELINESS_KIND),
        code="DDS104",
        name="liveliness-weaker-than-requested",
        because="the reader wants a sign of life from nearer to the program than the writer gives one",
        clause="DDS 1.4, 2.2.3.11",
    ),
    requires(
        LEASE_FITS | both_are("dust"),
        code="DDS105",
        name="lease-longer-than-requested",
        because="the writer shows that it is alive less often than the reader counts on",
        clause="DDS 1.4, 2.2.3.11",
    ),
    requires(
        LATENCY_FITS | both_are(*NO_LATENCY_BUDGET),
        code="DDS106",
        name="latency-budget-longer-than-requested",
        because="the writer may put samples off for longer than the reader accepts",
        clause="DDS 1.4, 2.2.3.8",
    ),
    requires(
        offered(OWNERSHIP) == requested(OWNERSHIP),
        code="DDS107",
        name="ownership-differs",
        because="both ends must say the same: exclusive is no stronger form of shared",
        clause="DDS 1.4, 2.2.3.9",
    ),
    requires(
        DESTINATION_ORDER_FITS | both_are(*NO_DESTINATION_ORDER),
        code="DDS108",
        name="destination-order-weaker-than-requested",
        because="the reader orders samples by when they were written, which this writer does not offer",
        clause="DDS 1.4, 2.2.3.17",
    ),
    requires(
        SCOPE_FITS | both_are(*NO_PRESENTATION),
        code="DDS109",
        name="access-scope-narrower-than-requested",
        because="the reader wants coherence or order over more than the publisher keeps together",
        clause="DDS 1.4, 2.2.3.6",
    ),
    requires(
        COHERENCE_FITS | both_are(*NO_PRESENTATION),
        code="DDS110",
        name="coherent-access-not-offered",
        because="the reader wants sets of changes as a whole, which the publisher does not mark",
        clause="DDS 1.4, 2.2.3.6",
    ),
    requires(
        ORDER_FITS | both_are(*NO_PRESENTATION),
        code="DDS111",
        name="ordered-access-not-offered",
        because="the reader wants changes in the order in which they were made, which the publisher does not record",
        clause="DDS 1.4, 2.2.3.6",
    ),
    requires(
        ENCODING_FITS | (both_are("opendds") & SOME_ENCODING_FITS) | both_are(*NO_REPRESENTATION),
        code="DDS112",
        name="data-representation-not-accepted",
        because="the writer encodes by the first representation of its list, which the reader does not understand",
        clause="DDS-XTypes 1.3, 7.6.3.1",
    ),
    # What implementations refuse beyond the standard.
    requires(
        ~either_is("dust") | ((offered(COHERENT) == requested(COHERENT)) & (offered(ORDERED) == requested(ORDERED))),
        code="DDS120",
        name="presentation-differs-on-dust",
        because="Dust DDS wants coherent and ordered access equal on both sides",
        clause="Dust DDS, request/offer check",
    ),
    requires(
        ~either_is("dust") | (offered(LIVELINESS) != requested(LIVELINESS)) | (offered(LEASE) >= requested(LEASE)),
        code="DDS121",
        name="lease-shorter-than-requested-on-dust",
        because="for equal kinds of liveliness Dust DDS compares the lease the wrong way round",
        clause="Dust DDS, request/offer check",
    ),
)

# DDS2xx: pairs and signals that connect, but not as one may think --------------------------------------------

REPLAY_UNREAD: Final = (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) == "volatile")
BOTH_DURABLE: Final = (offered(DURABILITY) >= "transient_local") & (requested(DURABILITY) >= "transient_local")
# Cyclone DDS keeps what late readers get by DURABILITY_SERVICE already for transient_local writers; seen by running it.
KEPT_BY_SERVICE: Final = (offered(DURABILITY) >= "transient") | publisher_is("cyclonedds")
STORED_ALL: Final = (KEPT_BY_SERVICE & (offered(SERVICE_HISTORY) == "keep_all")) | (
    ~KEPT_BY_SERVICE & (offered(HISTORY) == "keep_all")
)
STORED_MORE_THAN_READ: Final = (KEPT_BY_SERVICE & (offered(SERVICE_DEPTH) > requested(DEPTH))) | (
    ~KEPT_BY_SERVICE & (offered(DEPTH) > requested(DEPTH))
)
STORED_LATEST: Final = (offered(DURABILITY) >= "transient_local") & ~STORED_ALL

# Dust DDS wants equal flags of presentation, and compares leases of equal kinds the wrong way round.
DUST_ALONE_REFUSES: Final = (
    (offered(COHERENT) > requested(COHERENT))
    | (offered(ORDERED) > requested(ORDERED))
    | ((offered(LIVELINESS) == requested(LIVELINESS)) & (offered(LEASE) < requested(LEASE)))
)
DUST_ALONE_ACCEPTS: Final = LIVELINESS_FITS & ~LEASE_FITS
ONE_END_REFUSES: Final = (
    "{{publisher}} and {{subscriber}} do not fit in {}, which only one of their implementations looks at"
)
DISAGREEING: Final = "one end counts itself connected while the other refuses it, so its status says nothing"

PAIRS: Final = (
    forbids(
        REPLAY_UNREAD & ~topic(LATCHED),
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
        says="on latched topic `{topic}`, {publisher} with durability {offered durability}, {subscriber} with {requested durability}: who starts late gets nothing",
        because="the topic is written once and read later, so a volatile reader that starts late gets nothing",
        clause="DDS 1.4, 2.2.3.4",
        fixes=("durability",),
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
        fixes=("lifespan", "latency_budget"),
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
        ~(
            all_equal(offered(RELIABILITY))
            & all_equal(offered(DURABILITY))
            & all_equal(offered(DEADLINE))
            & all_equal(offered(LATENCY_BUDGET))
            & all_equal(offered(OWNERSHIP))
            & all_equal(offered(LIVELINESS))
            & all_equal(offered(LEASE))
            & all_equal(offered(DESTINATION_ORDER))
            & all_equal(offered(ACCESS_SCOPE))
            & all_equal(offered(COHERENT))
            & all_equal(offered(ORDERED))
            & all_equal(offered(DATA_REPRESENTATION))
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
            < total(offered(DEPTH), STORED_LATEST & ~KEPT_BY_SERVICE)
            + total(offered(SERVICE_DEPTH), STORED_LATEST & KEPT_BY_SERVICE)
        ),
        code="DDS212",
        name="depth-below-latched-writers",
        says="{subscriber} with depth {requested history.depth} has no room for what all writers of `{topic}` replay to it",
        because="a topic without keys is one instance, so what all its writers replay to a late reader shares one history",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history.depth",),
    ),
    forbids(
        (publisher(IMPLEMENTATION) != subscriber(IMPLEMENTATION))
        & (publisher(IMPLEMENTATION) != "standard")
        & (subscriber(IMPLEMENTATION) != "standard"),
        code="DDS220",
        name="mixed-implementations",
        says="{publisher} and {subscriber} are of different implementations",
        because="each end judges the other by its own rules and defaults, so both are asked",
        clause="C-QoS, implementations of DDS",
        severity="note",
    ),
    forbids(
        only_one_is(*NO_PRESENTATION) & ~(SCOPE_FITS & COHERENCE_FITS & ORDER_FITS),
        code="DDS221",
        name="presentation-compared-by-one-end",
        says=ONE_END_REFUSES.format("presentation"),
        because=DISAGREEING,
        clause="Fast DDS, request/offer check",
    ),
    forbids(
        only_one_is(*NO_LATENCY_BUDGET) & ~LATENCY_FITS,
        code="DDS222",
        name="latency-budget-compared-by-one-end",
        says=ONE_END_REFUSES.format("latency_budget"),
        because=DISAGREEING,
        clause="Fast DDS, request/offer check",
    ),
    forbids(
        only_one_is(*NO_DESTINATION_ORDER) & ~DESTINATION_ORDER_FITS,
        code="DDS223",
        name="destination-order-compared-by-one-end",
        says=ONE_END_REFUSES.format("destination_order"),
        because=DISAGREEING,
        clause="Fast DDS and OpenDDS, request/offer check",
    ),
    forbids(
        only_one_is(*NO_LIVELINESS_KIND) & ~LIVELINESS_FITS,
        code="DDS224",
        name="liveliness-compared-by-one-end",
        says=ONE_END_REFUSES.format("the kind of liveliness"),
        because=DISAGREEING,
        clause="RustDDS, request/offer check",
    ),
    forbids(
        ~ENCODING_FITS & (only_one_is(*NO_REPRESENTATION) | (only_one_is("opendds") & SOME_ENCODING_FITS)),
        code="DDS225",
        name="data-representation-compared-differently",
        says=ONE_END_REFUSES.format("data_representation"),
        because=DISAGREEING,
        clause="Fast DDS 2.9, RustDDS and OpenDDS, request/offer check",
    ),
    forbids(
        only_one_is("dust") & (DUST_ALONE_REFUSES | DUST_ALONE_ACCEPTS),
        code="DDS226",
        name="compared-differently-by-dust",
        says="one end is Dust DDS, which judges {publisher} and {subscriber} otherwise than the other end",
        because=DISAGREEING,
        clause="Dust DDS, request/offer check",
    ),
)

# DDS3xx: one endpoint by itself -------------------------------------------------------------------------------

# What creating an endpoint refuses.
INCONSISTENT: Final = "it cannot be created, because "
KEEPS_LAST: Final = HISTORY == "keep_last"
KEEPS_ALL: Final = HISTORY == "keep_all"
SERVICE_KEEPS_LAST: Final = offered(SERVICE_HISTORY) == "keep_last"
CHECKS_SERVICE: Final = ~publisher_is(*FAST_DDS)

LISTED: Final = offered(DATA_REPRESENTATION)
SEVERAL_LISTED: Final = (
    (in_(XCDR1, LISTED) & in_(XCDR2, LISTED))
    | (in_(XCDR1, LISTED) & in_(XML, LISTED))
    | (in_(XCDR2, LISTED) & in_(XML, LISTED))
)

CREATION: Final = (
    requires(
        requested(DEADLINE) >= requested(TIME_BASED_FILTER),
        code="DDS301",
        name="deadline-under-separation",
        because=INCONSISTENT + "its filter drops the samples that its deadline counts on",
        clause="DDS 1.4, 2.2.3.7 and 2.2.3.12",
        creation=True,
    ),
    forbids(
        KEEPS_LAST & (DEPTH > MAX_PER_INSTANCE) & ~is_on("fastdds_2_9", "fastdds_3_1"),
        code="DDS302",
        name="depth-over-limit",
        because=INCONSISTENT + "the history wants to keep more of an instance than the resource limits allow",
        clause="DDS 1.4, 2.2.3.18 and 2.2.3.19",
        severity="error",
        creation=True,
    ),
    forbids(
        (MAX_PER_INSTANCE < "unlimited") & (MAX_SAMPLES < MAX_PER_INSTANCE),
        code="DDS303",
        name="max-samples-under-max-per-instance",
        because=INCONSISTENT + "one instance may hold more samples than there may be in all",
        clause="DDS 1.4, 2.2.3.19",
        severity="error",
        creation=True,
    ),
    forbids(
        KEEPS_LAST & (DEPTH == 0) & ~is_on("dust", "fastdds_2_9"),
        code="DDS304",
        name="depth-zero",
        because=INCONSISTENT + "keep_last keeps at least one sample",
        clause="DDS 1.4, 2.2.3.18",
        severity="error",
        creation=True,
        fixes=("history.depth",),
    ),
    forbids(
        KEEPS_LAST & (DEPTH == "unlimited") & ~is_on("opendds", "fastdds_2_9"),
        code="DDS305",
        name="depth-unlimited",
        because=INCONSISTENT + "keep_last keeps a number of samples; keep_all is the history without one",
        clause="DDS 1.4, 2.2.3.18",
        severity="error",
        creation=True,
        fixes=("history", "history.depth"),
    ),
    forbids(
        (MAX_SAMPLES == 0) | (MAX_INSTANCES == 0) | (MAX_PER_INSTANCE == 0),
        code="DDS306",
        name="limit-zero",
        because=INCONSISTENT + "a resource limit is at least 1, or unlimited",
        clause="DDS 1.4, 2.2.3.19",
        severity="error",
        creation=True,
    ),
    forbids(
        SERVICE_KEEPS_LAST & (offered(SERVICE_DEPTH) > offered(SERVICE_MAX_PER_INSTANCE)) & CHECKS_SERVICE,
        code="DDS307",
        name="service-depth-over-limit",
        because=INCONSISTENT + "the durability service is to keep more of an instance than its limits allow",
        clause="DDS 1.4, 2.2.3.5",
        severity="error",
        creation=True,
    ),
    forbids(
        (offered(SERVICE_MAX_PER_INSTANCE) < "unlimited")
        & (offered(SERVICE_MAX_SAMPLES) < offered(SERVICE_MAX_PER_INSTANCE))
        & CHECKS_SERVICE,
        code="DDS308",
        name="service-max-samples-under-max-per-instance",
        because=INCONSISTENT + "the durability service may hold more samples of one instance than in all",
        clause="DDS 1.4, 2.2.3.5",
        severity="error",
        creation=True,
    ),
    forbids(
        SERVICE_KEEPS_LAST & ((offered(SERVICE_DEPTH) == 0) | (offered(SERVICE_DEPTH) == "unlimited")) & CHECKS_SERVICE,
        code="DDS309",
        name="service-depth-no-number",
        because=INCONSISTENT + "with keep_last the durability service keeps a number of samples, at least one",
        clause="DDS 1.4, 2.2.3.5",
        severity="error",
        creation=True,
    ),
    forbids(
        (
            (offered(SERVICE_MAX_SAMPLES) == 0)
            | (offered(SERVICE_MAX_INSTANCES) == 0)
            | (offered(SERVICE_MAX_PER_INSTANCE) == 0)
        )
        & CHECKS_SERVICE,
        code="DDS310",
        name="service-limit-zero",
        because=INCONSISTENT + "a limit of the durability service is at least 1, or unlimited",
        clause="DDS 1.4, 2.2.3.5",
        severity="error",
        creation=True,
    ),
    # What single implementations refuse.
    forbids(
        is_on("dust") & (MAX_PER_INSTANCE == "unlimited") & (MAX_SAMPLES < "unlimited"),
        code="DDS320",
        name="unlimited-per-instance-on-dust",
        because=INCONSISTENT + "to Dust DDS an unlimited number per instance is more than any number in all",
        clause="Dust DDS, consistency of RESOURCE_LIMITS",
        severity="error",
        creation=True,
    ),
    forbids(
        is_on(*FAST_DDS) & topic(KEYED) & (MAX_SAMPLES < MAX_INSTANCES * MAX_PER_INSTANCE),
        code="DDS321",
        name="max-samples-under-all-instances-on-fastdds",
        because=INCONSISTENT + "for keyed types Fast DDS wants room for the full number of samples of every instance",
        clause="Fast DDS, consistency of RESOURCE_LIMITS",
        severity="error",
        creation=True,
    ),
    forbids(
        is_on("opendds") & (HISTORY == "keep_all") & (DEPTH > MAX_PER_INSTANCE),
        code="DDS322",
        name="keep-all-depth-over-limit-on-opendds",
        because=INCONSISTENT + "OpenDDS compares the depth with the resource limits also for keep_all",
        clause="OpenDDS, consistency of HISTORY",
        severity="error",
        creation=True,
        fixes=("history.depth", "resource_limits.max_samples_per_instance"),
    ),
    forbids(
        publisher_is(*FAST_DDS)
        & (offered(LIVELINESS) < "manual_by_topic")
        & (offered(LEASE) < "infinite")
        & (offered(LEASE) <= offered(ANNOUNCEMENT_PERIOD)),
        code="DDS323",
        name="lease-under-announcement-period-on-fastdds",
        because=INCONSISTENT
        + "Fast DDS wants the lease longer than the announcement period, which is infinite by default",
        clause="Fast DDS, LivelinessQosPolicy",
        severity="error",
        creation=True,
        fixes=("liveliness.announcement_period", "liveliness.lease_duration"),
    ),
    forbids(
        is_on(*FAST_DDS) & (DESTINATION_ORDER == "by_source_timestamp"),
        code="DDS324",
        name="by-source-timestamp-on-fastdds",
        because=INCONSISTENT + "Fast DDS does not support by_source_timestamp",
        clause="Fast DDS, DestinationOrderQosPolicy",
        severity="error",
        creation=True,
    ),
    forbids(
        is_on("fastdds_2_9") & ((DURABILITY == "persistent") | ((DURABILITY == "transient") & ~SERVICE_RUNS)),
        code="DDS325",
        name="durability-unsupported-on-fastdds",
        because=INCONSISTENT + "Fast DDS 2 refuses persistent, and transient without a persistence plug-in",
        clause="Fast DDS 2.9, DurabilityQosPolicy",
        severity="error",
        creation=True,
        fixes=("durability",),
    ),
    forbids(
        publisher_is("connext", "dust") & SEVERAL_LISTED,
        code="DDS326",
        name="several-representations-offered",
        because=INCONSISTENT + "this implementation takes one data representation of a writer only",
        clause="DDS-XTypes 1.3, 7.6.3.1; RTI Connext, Dust DDS",
        severity="error",
        creation=True,
        help="offer one data representation",
    ),
    forbids(
        is_on("cyclonedds") & in_(XML, DATA_REPRESENTATION),
        code="DDS327",
        name="xml-representation-on-cyclonedds",
        because=INCONSISTENT + "Cyclone DDS does not support the data representation XML",
        clause="Cyclone DDS, by running it",
        severity="error",
        creation=True,
        help="list xcdr1 and xcdr2 only",
    ),
)

# What can be created, but does not do what one may think.
DURABLE: Final = DURABILITY >= "transient_local"
MANUAL: Final = LIVELINESS >= "manual_by_participant"
RESENDING: Final = RESEND_ROUND_TRIPS * ROUND_TRIP
LIMITED: Final = (MAX_SAMPLES < "unlimited") | (MAX_INSTANCES < "unlimited") | (MAX_PER_INSTANCE < "unlimited")

ENDPOINTS: Final = (
    forbids(
        DURABLE & (RELIABILITY == "best_effort"),
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
        (OWNERSHIP == "exclusive") & (LEASE == "infinite") & (DEADLINE == "infinite"),
        code="DDS332",
        name="exclusive-without-failover",
        because="with neither a lease nor a deadline nobody notices that the owner is gone, so no other writer takes over",
        clause="DDS 1.4, 2.2.3.9.2",
        severity="note",
        fixes=("liveliness.lease_duration", "deadline"),
    ),
    forbids(
        stated(offered(OWNERSHIP_STRENGTH)) & (offered(OWNERSHIP) == "shared"),
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
        MANUAL & (LEASE == "infinite"),
        code="DDS336",
        name="manual-no-lease",
        because="without a lease duration liveliness can never be lost, so asserting it has no effect",
        clause="DDS 1.4, 2.2.3.11",
        severity="note",
        fixes=("liveliness",),
        help="state the lease duration within which the program asserts its liveliness",
    ),
    forbids(
        (LIVELINESS == "manual_by_topic") & (DEADLINE < "infinite") & (LEASE < DEADLINE),
        code="DDS337",
        name="lease-under-deadline",
        because="a writer that keeps its deadline is declared dead before the next sample is due",
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
        fixes=("deadline",),
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
        (offered(RELIABILITY) == "reliable") & (offered(LIFESPAN) < topic(PERIOD) + RESENDING),
        code="DDS345",
        name="reliable-short-lifespan",
        says="{endpoint} with lifespan {lifespan}, period {period} and round trip {round_trip_time}: lost samples expire before they are sent again",
        because="a lost sample has expired before it can be sent again",
        clause="DDS 1.4, 2.2.3.16",
        fixes=("lifespan",),
    ),
    forbids(
        offered(LIFESPAN) + offered(LIFESPAN) < ROUND_TRIP,
        code="DDS346",
        name="lifespan-under-delivery-time",
        says="{endpoint} with lifespan {lifespan} and round trip {round_trip_time}: samples expire on their way",
        because="samples expire before they arrive, half a round trip later",
        clause="DDS 1.4, 2.2.3.16",
        fixes=("lifespan",),
    ),
    forbids(
        KEEPS_ALL & stated(DEPTH),
        code="DDS347",
        name="keep-all-depth",
        says="{endpoint} states a depth beside history keep_all",
        because="keep_all ignores the depth",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history",),
    ),
    forbids(
        DURABLE & KEEPS_ALL & (MAX_SAMPLES == "unlimited") & (MAX_PER_INSTANCE == "unlimited"),
        code="DDS348",
        name="durable-keep-all",
        because="what is kept for late readers grows without bound unless resource limits are set",
        clause="DDS 1.4, 2.2.3.18",
        severity="note",
        fixes=("history",),
    ),
    forbids(
        (offered(DURABILITY) >= "transient_local") & stated(offered(LIFESPAN)) & (offered(LIFESPAN) < "infinite"),
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
        (requested(TIME_BASED_FILTER) > 0) & (requested(LEASE) < requested(TIME_BASED_FILTER)),
        code="DDS351",
        name="lease-under-separation",
        because="the reader may count a writer as dead between two samples that its filter lets through",
        clause="DDS 1.4, 2.2.3.12",
        severity="note",
        fixes=("time_based_filter", "liveliness.lease_duration"),
    ),
    forbids(
        (requested(TIME_BASED_FILTER) > 0) & (requested(DEADLINE) < requested(TIME_BASED_FILTER) + topic(PERIOD)),
        code="DDS352",
        name="deadline-under-separation-and-period",
        says="{endpoint} with filter {time_based_filter}, deadline {deadline} and period {period}: dropped samples look like missed deadlines",
        because="the sample after the separation may come a whole period later, which is after the deadline",
        clause="DDS 1.4, 2.2.3.12",
        severity="note",
        fixes=("deadline", "time_based_filter"),
    ),
    forbids(
        publisher_is("cyclonedds")
        & (offered(DURABILITY) == "transient_local")
        & (offered(SERVICE_HISTORY) == "keep_last")
        & ((offered(HISTORY) == "keep_all") | (offered(SERVICE_DEPTH) < offered(DEPTH))),
        code="DDS353",
        name="stored-depth-under-history-on-cyclonedds",
        says="{endpoint} with history {history} and depth {history.depth} stores {durability_service.history_depth} for late readers",
        because="Cyclone DDS keeps for late readers what durability_service says, not what history says",
        clause="Cyclone DDS, DURABILITY_SERVICE; seen by running it",
        fixes=("durability_service.history_depth", "durability_service.history_kind"),
    ),
    forbids(
        (MAX_PER_INSTANCE == "unlimited") & (MAX_SAMPLES < "unlimited") & ~is_on("dust"),
        code="DDS354",
        name="unlimited-per-instance",
        because="implementations differ: some take it, Dust DDS and for keyed types Fast DDS refuse it",
        clause="DDS 1.4, 2.2.3.19",
        severity="note",
        help="limit the samples per instance as well",
    ),
    forbids(
        SEVERAL_LISTED & ~publisher_is("connext", "dust", "opendds"),
        code="DDS355",
        name="later-representations-unused",
        because="a writer uses the first data representation of its list only",
        clause="DDS-XTypes 1.3, 7.6.3.1",
        severity="note",
        help="offer one data representation",
    ),
)

# DDS4xx: who meets whom ---------------------------------------------------------------------------------------

PUBLISHER_MEETS: Final = call("partitions_meet", offered(PARTITION), requested(PARTITION), publisher(IMPLEMENTATION))
SUBSCRIBER_MEETS: Final = call("partitions_meet", offered(PARTITION), requested(PARTITION), subscriber(IMPLEMENTATION))

MEETING: Final = (
    meets(
        publisher(DOMAIN) == subscriber(DOMAIN),
        code="DDS401",
        name="domain-split",
        because="participants of different domains never meet",
        clause="DDS 1.4, 2.2.2.2.1",
    ),
    meets(
        offered(TYPE) == requested(TYPE),
        code="DDS402",
        name="type-mismatch",
        because="endpoints of one topic with different data types never exchange a sample",
        clause="DDS 1.4, 2.2.2.3",
        severity="error",
        always=True,
    ),
    meets(
        PUBLISHER_MEETS | SUBSCRIBER_MEETS,
        code="DDS403",
        name="partition-split",
        because="they share no partition, and neither side is told",
        clause="DDS 1.4, 2.2.3.13",
    ),
    meets(
        (PUBLISHER_MEETS & SUBSCRIBER_MEETS) | (~PUBLISHER_MEETS & ~SUBSCRIBER_MEETS),
        code="DDS404",
        name="partitions-compared-differently",
        because="their implementations compare partitions differently: one end counts itself connected, the other does not",
        clause="DDS 1.4, 2.2.3.13",
        always=True,
    ),
    forbids(
        TYPE != topic(TOPIC_TYPE),
        code="DDS405",
        name="type-differs-from-topic",
        says="{endpoint} has another data type than topic `{topic}` is declared with",
        because="the topic is declared with another data type",
        clause="DDS 1.4, 2.2.2.3",
        fixes=("type",),
    ),
)

RULES: Final = (*REQUEST_OFFER, *PAIRS, *CREATION, *ENDPOINTS, *MEETING)
