"""Rules about implementations that depart from the standard, and about two of them that match.

Each end judges a pair by itself. Where only one of them refuses, the finding names both: the pair does not work, and the status of
the other end says that it does.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Literal, define, forbids, in_, offered, publisher, requested, requires, subscriber, topic
from cqos_dds.implementations import (
    CYCLONE_DDS,
    FAST_DDS,
    IMPLEMENTATION,
    NO_DESTINATION_ORDER,
    NO_LATENCY_BUDGET,
    NO_LIVELINESS_KIND,
    NO_PRESENTATION,
    either_is,
    is_on,
    only_one_is,
    publisher_is,
    subscriber_is,
)
from cqos_dds.kept_policies import DEPTH, HISTORY, MAX_INSTANCES, MAX_PER_INSTANCE, MAX_SAMPLES, SERVICE_DEPTH
from cqos_dds.policies import ANNOUNCEMENT_PERIOD, KEYED, SERVICE_RUNS, TIME_BASED_FILTER
from cqos_dds.requested_policies import (
    COHERENT,
    DATA_REPRESENTATION,
    DESTINATION_ORDER,
    DURABILITY,
    LEASE,
    LIVELINESS,
    ORDERED,
)
from cqos_dds.rules import (
    DESTINATION_ORDER_FITS,
    INCONSISTENT,
    LATENCY_FITS,
    LEASE_FITS,
    LIVELINESS_FITS,
    PRESENTATION_FITS,
    SCOPE_FITS,
    SERVICE_KEEPS_LAST,
    takes_encoding,
)

XCDR1, XML, XCDR2 = Literal("xcdr1"), Literal("xml"), Literal("xcdr2")
LISTED: Final = offered(DATA_REPRESENTATION)
LISTS_XCDR1, LISTS_XML, LISTS_XCDR2 = (
    define(f"lists_{encoding.value}", in_(encoding, LISTED)) for encoding in (XCDR1, XML, XCDR2)
)
SEVERAL_LISTED: Final = define(
    "several_listed",
    (LISTS_XCDR1 & LISTS_XCDR2) | (LISTS_XCDR1 & LISTS_XML) | (LISTS_XCDR2 & LISTS_XML),
)

# What they refuse, or let pass, in a pair -----------------------------------------------------------------------

# Dust DDS wants equal flags of presentation, and compares leases of equal kinds the wrong way round.
DUST_ALONE_REFUSES: Final = define(
    "dust_alone_refuses",
    define(
        "offers_more_presentation", (offered(COHERENT) > requested(COHERENT)) | (offered(ORDERED) > requested(ORDERED))
    )
    | ((offered(LIVELINESS) == requested(LIVELINESS)) & (offered(LEASE) < requested(LEASE))),
)
DUST_ALONE_ACCEPTS: Final = define("dust_alone_accepts", LIVELINESS_FITS & ~LEASE_FITS)
ONE_END_REFUSES: Final = (
    "{{publisher}} and {{subscriber}} do not fit in {}, which only one of their implementations looks at"
)
DISAGREEING: Final = "where nothing else keeps them apart, one end counts itself connected while the other refuses it"

PAIRS: Final = (
    requires(
        ~either_is("dust")
        | define(
            "presentation_equal", (offered(COHERENT) == requested(COHERENT)) & (offered(ORDERED) == requested(ORDERED))
        ),
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
        only_one_is(*NO_PRESENTATION) & ~(SCOPE_FITS & PRESENTATION_FITS),
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
        (takes_encoding(publisher_is) & ~takes_encoding(subscriber_is))
        | (takes_encoding(subscriber_is) & ~takes_encoding(publisher_is)),
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

# What they refuse to create, or do with it ------------------------------------------------------------------------

ENDPOINTS: Final = (
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
    ),
    forbids(
        publisher_is(*FAST_DDS)
        & (offered(LIVELINESS) < "manual_by_topic")
        & define("lease_too_short", (offered(LEASE) < "infinite") & (offered(LEASE) <= offered(ANNOUNCEMENT_PERIOD))),
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
        is_on(*CYCLONE_DDS) & in_(XML, DATA_REPRESENTATION),
        code="DDS327",
        name="xml-representation-on-cyclonedds",
        because=INCONSISTENT + "Cyclone DDS does not support the data representation XML",
        clause="Cyclone DDS, by running it",
        severity="error",
        creation=True,
        help="list xcdr1 and xcdr2 only",
    ),
    forbids(
        subscriber_is("fastdds_2_9") & (requested(HISTORY) == "keep_last") & (requested(DEPTH) == 0),
        code="DDS328",
        name="depth-zero-ends-readers-of-fastdds",
        because="Fast DDS 2.9 creates a keep_last reader of depth 0, and the reader ends its program with the first sample",
        clause="Fast DDS 2.9.1, by running it; DDS 1.4, 2.2.3.18",
        severity="error",
        fixes=("history.depth",),
    ),
    forbids(
        subscriber_is("cyclonedds") & (requested(TIME_BASED_FILTER) > 0),
        code="DDS356",
        name="filter-of-cyclonedds-11",
        because="Cyclone DDS filters since version 11, and before that ignores the filter",
        clause="Cyclone DDS 0.10.5 and 11.0.1, reader history",
        severity="note",
        fixes=("implementation",),
        help="state `implementation: cyclonedds_0_10` for an older version",
    ),
    forbids(
        publisher_is(*CYCLONE_DDS)
        & (offered(DURABILITY) == "transient_local")
        & SERVICE_KEEPS_LAST
        & define("stores_less", (offered(HISTORY) == "keep_all") | (offered(SERVICE_DEPTH) < offered(DEPTH))),
        code="DDS353",
        name="stored-depth-under-history-on-cyclonedds",
        says="{endpoint} with history {history} and depth {history.depth} stores {durability_service.history_depth} of each instance for late readers",
        because="each writer of Cyclone DDS keeps for late readers what its durability_service says, not what its history says",
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

DEPARTURES: Final = (*PAIRS, *ENDPOINTS)
