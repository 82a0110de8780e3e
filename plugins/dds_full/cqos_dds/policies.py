"""The QoS policies of DDS: the table of DDS 1.4, section 2.2.3, with those that DDS-XTypes adds.

Values stand in order of strength, weakest first, and are written as a person writes them. A policy with several
fields is one entry per field. `entities` says what the standard sets it on, `changeable` whether it may change once
the entity is enabled; what is set on a DDS publisher or subscriber is stated for the group of its endpoints.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    TAKEN_EVERY,
    Anything,
    Choice,
    Count,
    Duration,
    Flag,
    Names,
    PerRole,
    Policy,
    Text,
    by_option,
)
from cqos_dds.implementations import FAST_DDS, IMPLEMENTATION
from cqos_dds.kinds import Representations, choice, duration, length, number

WRITER: Final = ("publisher",)
READER: Final = ("subscriber",)

# What the standard sets a policy on.
TOPIC_WRITER_READER: Final = ("topic", "writer", "reader")
TOPIC_WRITER: Final = ("topic", "writer")
GROUPS: Final = ("publisher", "subscriber")

# What an implementation does not have at all; the rules state what it has and does not compare.
NOT_IN_FAST_DDS: Final = {"implementation": dict.fromkeys(FAST_DDS, "no")}
NOT_IN_RUSTDDS: Final = {"implementation": {"rustdds": "no"}}

# What must be offered as it is requested --------------------------------------------------------------------

RELIABILITY: Final = Policy(
    "reliability",
    choice("RELIABILITY", "best_effort", "reliable"),
    {"publisher": "reliable", "subscriber": "best_effort"},
    "Whether lost samples are sent again.",
    "DDS 1.4, 2.2.3.14",
    aliases=("reliability.kind",),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
MAX_BLOCKING_TIME: Final = Policy(
    "reliability.max_blocking_time",
    duration(),
    "100ms",
    "How long a write may wait for room in the history; it acts at the writer only and is not compared.",
    "DDS 1.4, 2.2.3.14",
    aliases=("max_blocking_time",),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
DURABILITY: Final = Policy(
    "durability",
    choice("DURABILITY", "volatile", "transient_local", "transient", "persistent"),
    "default",
    "Whether a reader that comes late gets samples of before: those the writer keeps, those a service keeps in memory, "
    "or those a service keeps on disk. The default is volatile; writers of Fast DDS have transient_local.",
    "DDS 1.4, 2.2.3.4",
    aliases=("durability.kind",),
    words={
        "default": by_option(
            "implementation",
            otherwise="volatile",
            **dict.fromkeys(FAST_DDS, PerRole(publisher="transient_local", subscriber="volatile")),
        )
    },
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
DEADLINE: Final = Policy(
    "deadline",
    duration(),
    "infinite",
    "The longest time between two samples of an instance that a writer promises or a reader puts up with.",
    "DDS 1.4, 2.2.3.7",
    aliases=("deadline.period",),
    promise=True,
    entities=TOPIC_WRITER_READER,
    changeable=True,
    stronger="lower",
)
LATENCY_BUDGET: Final = Policy(
    "latency_budget",
    duration(),
    "0s",
    "How long the delivery of a sample may be put off, for instance to send several together; a hint.",
    "DDS 1.4, 2.2.3.8",
    aliases=("latency_budget.duration",),
    entities=TOPIC_WRITER_READER,
    changeable=True,
    stronger="lower",
)
LIVELINESS: Final = Policy(
    "liveliness",
    choice("LIVELINESS", "automatic", "manual_by_participant", "manual_by_topic"),
    "automatic",
    "Who says that a writer is alive: the middleware, the participant, or the program for each topic.",
    "DDS 1.4, 2.2.3.11",
    aliases=("liveliness.kind",),
    promise=True,
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
LEASE: Final = Policy(
    "liveliness.lease_duration",
    duration(),
    "infinite",
    "The time without a liveliness assertion after which a writer counts as lost.",
    "DDS 1.4, 2.2.3.11",
    aliases=("lease_duration", "liveliness_lease_duration"),
    promise=True,
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="lower",
)
OWNERSHIP: Final = Policy(
    "ownership",
    choice("OWNERSHIP", "shared", "exclusive", ordered=False),
    "shared",
    "Whether all writers may update an instance, or only the strongest one that is alive. Both ends must say the same.",
    "DDS 1.4, 2.2.3.9",
    aliases=("ownership.kind",),
    entities=TOPIC_WRITER_READER,
    changeable=False,
)
DESTINATION_ORDER: Final = Policy(
    "destination_order",
    choice("DESTINATIONORDER", "by_reception_timestamp", "by_source_timestamp"),
    "by_reception_timestamp",
    "Which of two samples is the newer one: the one that arrived later, or the one that was written later.",
    "DDS 1.4, 2.2.3.17",
    aliases=("destination_order.kind",),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
ACCESS_SCOPE: Final = Policy(
    "presentation.access_scope",
    choice("PRESENTATION", "instance", "topic", "group"),
    "instance",
    "How far coherence and order reach: within an instance, a topic, or all topics of one publisher.",
    "DDS 1.4, 2.2.3.6",
    aliases=("access_scope",),
    words={
        "highest_offered": PerRole(
            publisher=Anything("highest_offered is no offer, only a request"),
            subscriber=by_option("implementation", connext="instance"),
        )
    },
    entities=GROUPS,
    changeable=False,
    stronger="higher",
)
COHERENT: Final = Policy(
    "presentation.coherent_access",
    Flag(),
    "false",
    "Whether a set of changes is seen as a whole or not at all.",
    "DDS 1.4, 2.2.3.6",
    aliases=("coherent_access",),
    promise=True,
    entities=GROUPS,
    changeable=False,
    stronger="higher",
)
ORDERED: Final = Policy(
    "presentation.ordered_access",
    Flag(),
    "false",
    "Whether changes are seen in the order in which they were made.",
    "DDS 1.4, 2.2.3.6",
    aliases=("ordered_access",),
    entities=GROUPS,
    changeable=False,
    stronger="higher",
)
DATA_REPRESENTATION: Final = Policy(
    "data_representation",
    Representations(),
    "[]",
    "How samples are encoded: a writer uses the first of its list, a reader understands all of its own. An empty list is "
    "[xcdr1]; implementations have defaults of their own.",
    "DDS-XTypes 1.3, 7.6.3.1",
    aliases=("data_representation.value", "representation"),
    words={
        "default": by_option(
            "implementation",
            cyclonedds=PerRole(
                publisher=by_option("extensibility", final="[xcdr1]", appendable="[xcdr2]", mutable="[xcdr2]"),
                subscriber="[xcdr1, xcdr2]",
            ),
            opendds=PerRole(publisher="[xcdr2]", subscriber="[xcdr1, xcdr2]"),
            otherwise="[xcdr1]",
        ),
        "auto": by_option("implementation", connext="[xcdr1]"),
    },
    entities=TOPIC_WRITER_READER,
    changeable=False,
)

# What decides who meets whom --------------------------------------------------------------------------------

PARTITION: Final = Policy(
    "partition",
    Names(),
    "[]",
    "Names of the partitions an endpoint is in, with `*`, `?` and `[abc]` as wildcards; an empty list is the one "
    "partition without a name. Ends that share no partition do not match, and no status reports it.",
    "DDS 1.4, 2.2.3.13",
    aliases=("partition.name", "partitions"),
    enforced=NOT_IN_RUSTDDS,
    entities=GROUPS,
    changeable=True,
)
TYPE: Final = Policy(
    "type",
    Text(),
    None,
    "The name of the data type, such as Weather::Reading.",
    "DDS 1.4, 2.2.2.3",
    aliases=("type_name", "data_type"),
)
TYPE_INFORMATION: Final = Policy(
    "type_information",
    Flag(),
    "default",
    "Whether an endpoint announces its data type in full, so that types are compared by their members rather than by "
    "their names. Cyclone DDS does so by default.",
    "DDS-XTypes 1.3, 7.6.3.2",
    words={"default": by_option("implementation", cyclonedds="true", otherwise="false")},
)
TYPE_CONSISTENCY: Final = Policy(
    "type_consistency",
    Choice("disallow_type_coercion", "allow_type_coercion", ordered=False, affixes=("dds_",)),
    "allow_type_coercion",
    "Whether a reader takes samples of a type that is not its own but can be read as it.",
    "DDS-XTypes 1.3, 7.6.3.4",
    roles=READER,
    aliases=("type_consistency.kind", "type_consistency_enforcement", "type_consistency_enforcement.kind"),
    entities=("reader",),
    changeable=False,
)


def type_check(field: str, default: str, doc: str) -> Policy:
    """Return a flag of TYPE_CONSISTENCY_ENFORCEMENT."""
    return Policy(
        f"type_consistency.{field}",
        Flag(),
        default,
        doc,
        "DDS-XTypes 1.3, 7.6.3.4",
        roles=READER,
        aliases=(field, f"type_consistency_enforcement.{field}"),
        entities=("reader",),
        changeable=False,
    )


IGNORE_SEQUENCE_BOUNDS: Final = type_check(
    "ignore_sequence_bounds", "true", "Whether sequences of different bounds may be read as each other."
)
IGNORE_STRING_BOUNDS: Final = type_check(
    "ignore_string_bounds", "true", "Whether strings of different bounds may be read as each other."
)
IGNORE_MEMBER_NAMES: Final = type_check(
    "ignore_member_names", "false", "Whether members of different names may be read as each other."
)
PREVENT_TYPE_WIDENING: Final = type_check(
    "prevent_type_widening", "false", "Whether a type with fewer members is refused as one with more."
)
FORCE_TYPE_VALIDATION: Final = type_check(
    "force_type_validation", "false", "Whether ends without type information are refused rather than compared by name."
)

# What is kept ----------------------------------------------------------------------------------------------

HISTORY: Final = Policy(
    "history",
    choice("HISTORY", "keep_last", "keep_all"),
    "keep_last",
    "How many samples of an instance are kept: the last `history.depth` ones, or all that resources allow.",
    "DDS 1.4, 2.2.3.18",
    aliases=("history.kind",),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
DEPTH: Final = Policy(
    "history.depth",
    length(),
    "1",
    "How many samples of an instance keep_last keeps.",
    "DDS 1.4, 2.2.3.18",
    aliases=("depth", "history_depth"),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)


def limit(field: str, unit: str, doc: str, before_fast_dds_3_5: str) -> Policy:
    """Return a field of RESOURCE_LIMITS."""
    words = {
        "default": by_option(
            "implementation", otherwise="unlimited", fastdds_2_9=before_fast_dds_3_5, fastdds_3_1=before_fast_dds_3_5
        )
    }
    return Policy(
        f"resource_limits.{field}",
        length(unit),
        "default",
        f"{doc} The default is unlimited; Fast DDS before 3.5 has {before_fast_dds_3_5}.",
        "DDS 1.4, 2.2.3.19",
        aliases=(field,),
        words=words,
        entities=TOPIC_WRITER_READER,
        changeable=False,
        stronger="higher",
    )


MAX_SAMPLES: Final = limit("max_samples", "samples", "The most samples an endpoint keeps.", "5000")
MAX_INSTANCES: Final = limit("max_instances", "instances", "The most instances an endpoint keeps.", "10")
MAX_PER_INSTANCE: Final = limit(
    "max_samples_per_instance", "samples", "The most samples an endpoint keeps of one instance.", "400"
)
CLEANUP_DELAY: Final = Policy(
    "durability_service.service_cleanup_delay",
    duration(),
    "0s",
    "How long a durability service remembers an instance that is disposed and has no writers.",
    "DDS 1.4, 2.2.3.5",
    roles=WRITER,
    aliases=("service_cleanup_delay",),
    entities=TOPIC_WRITER,
    changeable=False,
)
SERVICE_HISTORY: Final = Policy(
    "durability_service.history_kind",
    choice("HISTORY", "keep_last", "keep_all"),
    "keep_last",
    "What a durability service keeps of an instance. Cyclone DDS keeps by it what transient_local writers replay.",
    "DDS 1.4, 2.2.3.5",
    roles=WRITER,
    aliases=("history_kind",),
    entities=TOPIC_WRITER,
    changeable=False,
    stronger="higher",
)
SERVICE_DEPTH: Final = Policy(
    "durability_service.history_depth",
    length(),
    "1",
    "How many samples of an instance a durability service keeps with keep_last.",
    "DDS 1.4, 2.2.3.5",
    roles=WRITER,
    entities=TOPIC_WRITER,
    changeable=False,
    stronger="higher",
)


def service_limit(field: str, unit: str, doc: str) -> Policy:
    """Return a limit of DURABILITY_SERVICE."""
    return Policy(
        f"durability_service.{field}",
        length(unit),
        "unlimited",
        doc,
        "DDS 1.4, 2.2.3.5",
        roles=WRITER,
        entities=TOPIC_WRITER,
        changeable=False,
        stronger="higher",
    )


SERVICE_MAX_SAMPLES: Final = service_limit("max_samples", "samples", "The most samples a durability service keeps.")
SERVICE_MAX_INSTANCES: Final = service_limit(
    "max_instances", "instances", "The most instances a durability service keeps."
)
SERVICE_MAX_PER_INSTANCE: Final = service_limit(
    "max_samples_per_instance", "samples", "The most samples a durability service keeps of one instance."
)
LIFESPAN: Final = Policy(
    "lifespan",
    duration(),
    "infinite",
    "How old a sample may be when it is delivered; older ones are dropped.",
    "DDS 1.4, 2.2.3.16",
    roles=WRITER,
    aliases=("lifespan.duration",),
    entities=TOPIC_WRITER,
    changeable=True,
)
AUTODISPOSE: Final = Policy(
    "writer_data_lifecycle",
    Flag(),
    "true",
    "Whether an instance that its writer unregisters, also by ending, is disposed for all readers.",
    "DDS 1.4, 2.2.3.21",
    roles=WRITER,
    aliases=("writer_data_lifecycle.autodispose_unregistered_instances", "autodispose_unregistered_instances"),
    entities=("writer",),
    changeable=True,
)
AUTOPURGE_NOWRITER: Final = Policy(
    "reader_data_lifecycle.autopurge_nowriter_samples_delay",
    duration(),
    "infinite",
    "How long a reader keeps an instance that has no writer any more.",
    "DDS 1.4, 2.2.3.22",
    roles=READER,
    aliases=("autopurge_nowriter_samples_delay",),
    entities=("reader",),
    changeable=True,
)
AUTOPURGE_DISPOSED: Final = Policy(
    "reader_data_lifecycle.autopurge_disposed_samples_delay",
    duration(),
    "infinite",
    "How long a reader keeps an instance that was disposed.",
    "DDS 1.4, 2.2.3.22",
    roles=READER,
    aliases=("autopurge_disposed_samples_delay",),
    entities=("reader",),
    changeable=True,
)

# What else there is -----------------------------------------------------------------------------------------

OWNERSHIP_STRENGTH: Final = Policy(
    "ownership_strength",
    number(),
    "0",
    "Which of several exclusive writers owns an instance: the one with the largest number.",
    "DDS 1.4, 2.2.3.10",
    roles=WRITER,
    aliases=("ownership_strength.value",),
    entities=("writer",),
    changeable=True,
)
TIME_BASED_FILTER: Final = Policy(
    "time_based_filter",
    duration(),
    "0s",
    "The shortest time between two samples of an instance that a reader wants to see; those between are dropped.",
    "DDS 1.4, 2.2.3.12",
    roles=READER,
    aliases=("time_based_filter.minimum_separation", "minimum_separation"),
    enforced=NOT_IN_FAST_DDS,
    entities=("reader",),
    changeable=True,
    stronger="lower",
)
TRANSPORT_PRIORITY: Final = Policy(
    "transport_priority",
    number(),
    "0",
    "How urgent the samples are to the transport; a hint.",
    "DDS 1.4, 2.2.3.15",
    roles=WRITER,
    aliases=("transport_priority.value",),
    entities=TOPIC_WRITER,
    changeable=True,
)
ENTITY_FACTORY: Final = Policy(
    "entity_factory",
    Flag(),
    "true",
    "Whether what is created by a publisher or subscriber works at once, or only when the program enables it.",
    "DDS 1.4, 2.2.3.20",
    aliases=("entity_factory.autoenable_created_entities", "autoenable_created_entities"),
    entities=("factory", "participant", *GROUPS),
    changeable=True,
)
USER_DATA: Final = Policy(
    "user_data",
    Text(),
    "",
    "Bytes that discovery hands on, for the program's own use.",
    "DDS 1.4, 2.2.3.1",
    aliases=("user_data.value",),
    entities=("participant", "writer", "reader"),
    changeable=True,
)
GROUP_DATA: Final = Policy(
    "group_data",
    Text(),
    "",
    "Bytes of a publisher or subscriber that discovery hands on.",
    "DDS 1.4, 2.2.3.3",
    aliases=("group_data.value",),
    entities=GROUPS,
    changeable=True,
)
TOPIC_DATA: Final = Policy(
    "topic_data",
    Text(),
    "",
    "Bytes of a topic that discovery hands on.",
    "DDS 1.4, 2.2.3.2",
    level="topic",
    aliases=("topic_data.value",),
    entities=("topic",),
    changeable=True,
)
ANNOUNCEMENT_PERIOD: Final = Policy(
    "liveliness.announcement_period",
    duration(),
    "infinite",
    "How often a writer of Fast DDS announces that it is alive; no other implementation has it.",
    "Fast DDS, LivelinessQosPolicy",
    roles=WRITER,
    aliases=("announcement_period",),
    stronger="lower",
)

# What is known about a topic ---------------------------------------------------------------------------------

TOPIC_TYPE: Final = Policy(
    "type",
    Text(),
    None,
    "The data type the topic is declared with.",
    "DDS 1.4, 2.2.2.3",
    level="topic",
    aliases=("type_name", "data_type"),
)
KEYED: Final = Policy(
    "keyed", Flag(), None, "Whether the data type has key fields, so that the topic has instances.", level="topic"
)
PERIOD: Final = Policy(
    "period",
    Duration(),
    None,
    "The time between two samples of an instance.",
    level="topic",
    aliases=("publish_period",),
)
LATCHED: Final = Policy(
    "latched",
    Flag(),
    "false",
    "A late reader needs the last sample: the topic is written once and read later.",
    level="topic",
)
SIZE: Final = Policy("size", Count(unit="bytes"), None, "The size of one sample.", level="topic")

# What is assumed of the deployment ---------------------------------------------------------------------------

DOMAIN: Final = Policy(
    "domain",
    Count(0, 232),
    "0",
    "The DDS domain; participants of different domains never meet.",
    "DDS 1.4, 2.2.2.2.1",
    level="option",
    aliases=("domain_id",),
)
EXTENSIBILITY: Final = Policy(
    "extensibility",
    Choice("final", "appendable", "mutable", ordered=False),
    None,
    "How data types may grow, where an implementation chooses the encoding by it.",
    "DDS-XTypes 1.3, 7.2.3",
    level="option",
    assume=("final", "appendable", "mutable"),
)
SERVICE_RUNS: Final = Policy(
    "durability_service_runs",
    Flag(),
    "false",
    "Whether a durability service runs that keeps what transient and persistent writers write.",
    "DDS 1.4, 2.2.3.4",
    level="option",
)
ROUND_TRIP: Final = Policy(
    "round_trip_time",
    Duration(),
    None,
    "How long a packet takes to a peer and back.",
    level="option",
    aliases=("rtt",),
)
RESEND_ROUND_TRIPS: Final = Policy(
    "resend_round_trips",
    Count(),
    "2",
    "How many round trips a lost sample needs until it is sent again.",
    level="option",
)
DEPTH_MARGIN: Final = Policy(
    "reliable_depth_margin",
    Count(),
    "1",
    "How many samples a reliable writer keeps beyond those that may have to be sent again.",
    level="option",
)

PARTICIPANT_LEASE: Final = Policy(
    "participant_lease",
    duration(),
    "of_implementation",
    "How long a participant counts as alive after its last message; then its writers and readers are no longer matched.",
    "DDSI-RTPS 2.5, 8.5.3.2 and 9.6.2.2; Cyclone DDS, Discovery/LeaseDuration; Fast DDS, Discovery, lease duration; OpenDDS "
    "Developer's Guide, LeaseDuration of rtps_discovery; RTI knowledge base, liveliness of a DomainParticipant",
    level="participant",
    aliases=("participant_lease_duration", "participant_liveliness_lease_duration"),
    words={
        "of_implementation": by_option(
            "implementation",
            Anything("the participant lease of the implementation is not known"),
            standard="100s",
            cyclonedds="10s",
            **dict.fromkeys(FAST_DDS, "20s"),
            opendds="300s",
            connext="100s",
            # Dust announces 100 s and forgets no participant: its pull request 502.
        )
    },
)

POLICIES: Final = (
    RELIABILITY,
    MAX_BLOCKING_TIME,
    DURABILITY,
    DEADLINE,
    LATENCY_BUDGET,
    LIVELINESS,
    LEASE,
    OWNERSHIP,
    DESTINATION_ORDER,
    ACCESS_SCOPE,
    COHERENT,
    ORDERED,
    DATA_REPRESENTATION,
    PARTITION,
    TYPE,
    TYPE_INFORMATION,
    TYPE_CONSISTENCY,
    IGNORE_SEQUENCE_BOUNDS,
    IGNORE_STRING_BOUNDS,
    IGNORE_MEMBER_NAMES,
    PREVENT_TYPE_WIDENING,
    FORCE_TYPE_VALIDATION,
    HISTORY,
    DEPTH,
    MAX_SAMPLES,
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    CLEANUP_DELAY,
    SERVICE_HISTORY,
    SERVICE_DEPTH,
    SERVICE_MAX_SAMPLES,
    SERVICE_MAX_INSTANCES,
    SERVICE_MAX_PER_INSTANCE,
    LIFESPAN,
    AUTODISPOSE,
    AUTOPURGE_NOWRITER,
    AUTOPURGE_DISPOSED,
    OWNERSHIP_STRENGTH,
    TIME_BASED_FILTER,
    TRANSPORT_PRIORITY,
    ENTITY_FACTORY,
    USER_DATA,
    GROUP_DATA,
    TOPIC_DATA,
    ANNOUNCEMENT_PERIOD,
    TAKEN_EVERY,
    TOPIC_TYPE,
    KEYED,
    PERIOD,
    LATCHED,
    SIZE,
    IMPLEMENTATION,
    DOMAIN,
    EXTENSIBILITY,
    SERVICE_RUNS,
    ROUND_TRIP,
    RESEND_ROUND_TRIPS,
    DEPTH_MARGIN,
    PARTICIPANT_LEASE,
)
