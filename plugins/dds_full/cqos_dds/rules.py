"""The rules of the standard, one condition each: compatibility, creation of endpoints, matching.

How to read them: `offered` is the value of the writer or its publisher, `requested` that of the reader or its subscriber. A bare
policy is that of the endpoint itself. `requires` reports if its condition is false, `forbids` only if it is certainly true. If a
`matched_if` condition is false, two endpoints of one topic do not match. Values have the order of the standard, so `>=` is "at least
as strong as". `both_are(...)` is about implementations that do not compare a policy: no end refuses only if both are such.

`implementation_rules` has the differences of implementations from the standard, `advice_rules` connections that may surprise.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cqos_core.packs import (
    Condition,
    Literal,
    Term,
    as_condition,
    call,
    define,
    first,
    forbids,
    in_,
    matched_if,
    offered,
    overlaps,
    publisher,
    requested,
    requires,
    stated,
    subscriber,
    topic,
)
from cqos_dds.extension_policies import COMPRESSION, DISABLE_POSITIVE_ACKS, EXTENSIONS, TOPIC_KIND
from cqos_dds.implementations import (
    CYCLONE_DDS,
    FAST_DDS,
    IMPLEMENTATION,
    LOOK_AT_NAMES,
    NO_DESTINATION_ORDER,
    NO_LATENCY_BUDGET,
    NO_LIVELINESS_KIND,
    NO_PRESENTATION,
    NO_REPRESENTATION,
    both_are,
    either_is,
    is_on,
    publisher_is,
    subscriber_is,
)
from cqos_dds.kept_policies import (
    DEPTH,
    HISTORY,
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    SERVICE_DEPTH,
    SERVICE_HISTORY,
    SERVICE_MAX_INSTANCES,
    SERVICE_MAX_PER_INSTANCE,
    SERVICE_MAX_SAMPLES,
)
from cqos_dds.policies import DOMAIN, EXTENSIBILITY, OF_COMPILER, TIME_BASED_FILTER, TOPIC_TYPE
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
    PARTITION,
    RELIABILITY,
    TYPE,
    TYPE_EXTENSIBILITY,
    TYPE_INFORMATION,
)

# What a reader requests must be offered --------------------------------------------------------------

RELIABILITY_FITS: Final = offered(RELIABILITY) >= requested(RELIABILITY)
DURABILITY_FITS: Final = offered(DURABILITY) >= requested(DURABILITY)
DEADLINE_FITS: Final = offered(DEADLINE) <= requested(DEADLINE)
LATENCY_FITS: Final = offered(LATENCY_BUDGET) <= requested(LATENCY_BUDGET)
LIVELINESS_FITS: Final = offered(LIVELINESS) >= requested(LIVELINESS)
LEASE_FITS: Final = offered(LEASE) <= requested(LEASE)
OWNERSHIP_FITS: Final = offered(OWNERSHIP) == requested(OWNERSHIP)
DESTINATION_ORDER_FITS: Final = offered(DESTINATION_ORDER) >= requested(DESTINATION_ORDER)
SCOPE_FITS: Final = offered(ACCESS_SCOPE) >= requested(ACCESS_SCOPE)
COHERENCE_FITS: Final = offered(COHERENT) >= requested(COHERENT)
ORDER_FITS: Final = offered(ORDERED) >= requested(ORDERED)
PRESENTATION_FITS: Final = define("sets_and_order_fit", COHERENCE_FITS & ORDER_FITS)
ENCODING_FITS: Final = define("encoding_fits", in_(first(offered(DATA_REPRESENTATION)), requested(DATA_REPRESENTATION)))
SOME_ENCODING_FITS: Final = define(
    "some_encoding_fits", overlaps(offered(DATA_REPRESENTATION), requested(DATA_REPRESENTATION))
)


def takes_encoding(end_is: Callable[..., Condition]) -> Condition:
    """One end takes the pair for a match, as far as encodings go."""
    takes = ENCODING_FITS | (end_is("opendds") & SOME_ENCODING_FITS) | end_is(*NO_REPRESENTATION)
    return define(f"{end_is.__name__.removesuffix('_is')}_takes_encoding", takes)


COMPRESSES_NOT: Final = define("compresses_not", offered(COMPRESSION) == "[]")
BY_ZLIB, BY_BZIP2, BY_LZ4 = (
    define(f"compresses_by_{each}", in_(Literal(each), offered(COMPRESSION))) for each in ("zlib", "bzip2", "lz4")
)
COMPRESSES_BY_SEVERAL: Final = define(
    "compresses_by_several", (BY_ZLIB & BY_BZIP2) | (BY_ZLIB & BY_LZ4) | (BY_BZIP2 & BY_LZ4)
)

REQUEST_OFFER: Final = (
    requires(
        RELIABILITY_FITS,
        code="DDS101",
        name="reliability-weaker-than-requested",
        because="a best_effort writer never sends a lost sample again, so a reliable reader refuses it",
        clause="DDS 1.4, 2.2.3.14",
    ),
    requires(
        DURABILITY_FITS,
        code="DDS102",
        name="durability-weaker-than-requested",
        because="the offered durability is weaker than the requested one: samples are kept for late joiners for a shorter time",
        clause="DDS 1.4, 2.2.3.4",
    ),
    requires(
        DEADLINE_FITS,
        code="DDS103",
        name="deadline-longer-than-requested",
        because="the offered deadline is longer than the requested one",
        clause="DDS 1.4, 2.2.3.7",
    ),
    requires(
        LIVELINESS_FITS | both_are(*NO_LIVELINESS_KIND),
        code="DDS104",
        name="liveliness-weaker-than-requested",
        because="the offered liveliness kind is weaker than the requested one (automatic < manual_by_participant < manual_by_topic)",
        clause="DDS 1.4, 2.2.3.11",
    ),
    requires(
        LEASE_FITS | both_are("dust"),
        code="DDS105",
        name="lease-longer-than-requested",
        because="the offered liveliness lease_duration is longer than the requested one",
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
        OWNERSHIP_FITS,
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
        takes_encoding(publisher_is) & takes_encoding(subscriber_is),
        code="DDS112",
        name="data-representation-not-accepted",
        because="the writer encodes by the first representation of its list, which the reader does not understand",
        clause="DDS-XTypes 1.3, 7.6.3.1",
    ),
    requires(
        offered(DISABLE_POSITIVE_ACKS) | ~as_condition(requested(DISABLE_POSITIVE_ACKS)),
        code="DDS113",
        name="positive-acks-disabled-by-the-reader-alone",
        because="the writer waits for acknowledgements that a reader without positive acks never sends",
        clause="Fast DDS, DisablePositiveACKsQosPolicy; seen by running Fast DDS 2.9.1",
    ),
    requires(
        COMPRESSES_NOT | overlaps(offered(COMPRESSION), requested(COMPRESSION)),
        code="DDS114",
        name="compression-not-accepted",
        because="the writer compresses samples by an algorithm that the reader does not take",
        clause="RTI Connext, User's Manual, DATA_REPRESENTATION QosPolicy",
    ),
    requires(
        (offered(EXTENSIONS) != "refusing") & (requested(EXTENSIONS) != "refusing"),
        code="DDS115",
        name="extension-refuses",
        because="QoS that C-QoS does not model keeps one end from matching",
        clause="C-QoS, elements that are not modelled",
        help="state `extensions: none` where the elements decide nothing",
    ),
)

# What creating an endpoint refuses ----------------------------------------------------------------------------

INCONSISTENT: Final = "it cannot be created, because "
KEEPS_LAST: Final = HISTORY == "keep_last"
KEEPS_ALL: Final = HISTORY == "keep_all"
SERVICE_KEEPS_LAST: Final = define("service_keeps_last", offered(SERVICE_HISTORY) == "keep_last")
SERVICE_LIMIT: Final = define("service_limit", offered(SERVICE_MAX_PER_INSTANCE))
CHECKS_SERVICE: Final = ~publisher_is(*FAST_DDS)

CREATION: Final = (
    requires(
        requested(DEADLINE) >= requested(TIME_BASED_FILTER),
        code="DDS301",
        name="deadline-under-separation",
        because=INCONSISTENT + "its filter drops the samples that its deadline requires",
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
        # Fast DDS looks at the limits of keyed types only, and then at more of them: DDS321.
        (MAX_PER_INSTANCE < "unlimited") & (MAX_SAMPLES < MAX_PER_INSTANCE) & ~is_on(*FAST_DDS),
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
    ),
    forbids(
        ((MAX_SAMPLES == 0) | (MAX_INSTANCES == 0) | (MAX_PER_INSTANCE == 0)) & ~is_on("fastdds_2_9"),
        code="DDS306",
        name="limit-zero",
        because=INCONSISTENT + "a resource limit is at least 1, or unlimited",
        clause="DDS 1.4, 2.2.3.19",
        severity="error",
        creation=True,
    ),
    forbids(
        SERVICE_KEEPS_LAST & (offered(SERVICE_DEPTH) > SERVICE_LIMIT) & CHECKS_SERVICE,
        code="DDS307",
        name="service-depth-over-limit",
        because=INCONSISTENT + "the durability service is to keep more of an instance than its limits allow",
        clause="DDS 1.4, 2.2.3.5",
        severity="error",
        creation=True,
    ),
    forbids(
        (SERVICE_LIMIT < "unlimited") & (offered(SERVICE_MAX_SAMPLES) < SERVICE_LIMIT) & CHECKS_SERVICE,
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
        COMPRESSES_BY_SEVERAL,
        code="DDS311",
        name="several-compression-ids-offered",
        because=INCONSISTENT + "a writer compresses by one algorithm at most",
        clause="RTI Connext, API Reference, CompressionSettings_t",
        severity="error",
        creation=True,
        fixes=("compression_ids",),
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
)

# Who meets whom -----------------------------------------------------------------------------------------------

PUBLISHER_MEETS: Final = define(
    "publisher_meets", call("partitions_meet", offered(PARTITION), requested(PARTITION), publisher(IMPLEMENTATION))
)
SUBSCRIBER_MEETS: Final = define(
    "subscriber_meets", call("partitions_meet", offered(PARTITION), requested(PARTITION), subscriber(IMPLEMENTATION))
)

# XCDR1 encodes a final and an appendable type alike, so ends that compare names of types alone understand each other.
BY_NAME_IN_XCDR1: Final = define(
    "types_by_name_in_xcdr1",
    ~(offered(TYPE_INFORMATION) & requested(TYPE_INFORMATION)) & (first(offered(DATA_REPRESENTATION)) == "xcdr1"),
)


def is_final(extensibility: Term, implementation: Term) -> Condition:
    """Say that types of a participant are final: so stated, or by the compiler of Cyclone DDS, which departs from the standard."""
    by_compiler = (extensibility == OF_COMPILER) & in_(implementation, *CYCLONE_DDS)
    return (extensibility == "final") | by_compiler


PUBLISHER_FINAL: Final = define(
    "types_of_publisher_are_final", is_final(publisher(EXTENSIBILITY), publisher(IMPLEMENTATION))
)
SUBSCRIBER_FINAL: Final = define(
    "types_of_subscriber_are_final", is_final(subscriber(EXTENSIBILITY), subscriber(IMPLEMENTATION))
)
BOTH_MUTABLE: Final = define(
    "both_mutable", (publisher(EXTENSIBILITY) == "mutable") & (subscriber(EXTENSIBILITY) == "mutable")
)
NEITHER_MUTABLE: Final = define(
    "neither_mutable", (publisher(EXTENSIBILITY) != "mutable") & (subscriber(EXTENSIBILITY) != "mutable")
)
BOTH_FINAL_OR_NEITHER: Final = define(
    "both_final_or_neither", (PUBLISHER_FINAL & SUBSCRIBER_FINAL) | (~PUBLISHER_FINAL & ~SUBSCRIBER_FINAL)
)
TYPES_FIT: Final = define(
    "types_of_participants_fit", BOTH_MUTABLE | (NEITHER_MUTABLE & (BOTH_FINAL_OR_NEITHER | BY_NAME_IN_XCDR1))
)
LEFT_TO_COMPILERS: Final = define(
    "extensibility_left_to_compilers",
    stated(offered(TYPE_EXTENSIBILITY), OF_COMPILER) & stated(requested(TYPE_EXTENSIBILITY), OF_COMPILER),
)
STATED_PER_TYPE: Final = define(
    "extensibility_stated_per_type",
    stated(offered(TYPE_EXTENSIBILITY)) & stated(requested(TYPE_EXTENSIBILITY)) & ~LEFT_TO_COMPILERS,
)
NAMES_DECIDE: Final = define(
    "names_of_types_decide",
    ~(offered(TYPE_INFORMATION) & requested(TYPE_INFORMATION)) | either_is(*LOOK_AT_NAMES),
)

MEETING: Final = (
    matched_if(
        publisher(DOMAIN) == subscriber(DOMAIN),
        code="DDS401",
        name="domain-split",
        because="participants of different domains never meet",
        clause="DDS 1.4, 2.2.2.2.1",
    ),
    matched_if(
        (offered(TYPE) == requested(TYPE)) | ~NAMES_DECIDE,
        code="DDS402",
        name="type-mismatch",
        because="endpoints of one topic with different data types never exchange a sample",
        clause="DDS 1.4, 2.2.2.3",
        severity="error",
        always=True,
    ),
    matched_if(
        (offered(TYPE_EXTENSIBILITY) == requested(TYPE_EXTENSIBILITY))
        | (
            BY_NAME_IN_XCDR1
            & define(
                "types_not_mutable",
                (offered(TYPE_EXTENSIBILITY) != "mutable") & (requested(TYPE_EXTENSIBILITY) != "mutable"),
            )
        ),
        code="DDS407",
        name="extensibility-mismatch",
        because="a final, an appendable and a mutable type are not assignable to each other, and XCDR2 encodes each of them otherwise",
        clause="DDS-XTypes 1.3, 7.2.4.4.8 and 7.4.3",
        severity="error",
        always=True,
        help="give the type the same extensibility at both ends",
    ),
    matched_if(
        TYPES_FIT | STATED_PER_TYPE,
        code="DDS408",
        name="extensibility-of-participants-differs",
        because="a final, an appendable and a mutable type are not assignable to each other, and XCDR2 encodes each of them otherwise",
        clause="DDS-XTypes 1.3, 7.2.4.4.8 and 7.4.3",
        severity="error",
        always=True,
        help="give the types the same extensibility in the IDL of both participants, and state it as the option `extensibility`; "
        "`of_compiler` if the IDL has no annotation",
    ),
    matched_if(
        offered(TOPIC_KIND) == requested(TOPIC_KIND),
        code="DDS406",
        name="topic-kind-mismatch",
        because="a writer of a data type with a key and a reader of one without never match, and no status reports it",
        clause="DDSI-RTPS 2.5, 9.3.1.2; seen by running Fast DDS 2.9.1",
        severity="error",
        always=True,
        help="state the kind that the data type has at both ends",
    ),
    matched_if(
        PUBLISHER_MEETS | SUBSCRIBER_MEETS,
        code="DDS403",
        name="partition-split",
        because="they share no partition, and a split alone is no incompatibility that a status reports",
        clause="DDS 1.4, 2.2.3.13",
    ),
    matched_if(
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

RULES: Final = (*REQUEST_OFFER, *CREATION, *MEETING)
