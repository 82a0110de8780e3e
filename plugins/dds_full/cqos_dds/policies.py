"""The QoS policies of DDS: the table of DDS 1.4, section 2.2.3, with those that DDS-XTypes adds.

Values stand in order of strength, weakest first, and are written as a person writes them. A policy with several
fields is one entry per field. `entities` says what the standard sets it on, `changeable` whether it may change once
the entity is enabled; what is set on a DDS publisher or subscriber is stated for the group of its endpoints.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    REDISCOVERY_TIME,
    REPAIR_TIME,
    TAKEN_EVERY,
    Anything,
    Choice,
    Count,
    Duration,
    Flag,
    Policy,
    Text,
    by_option,
)
from cqos_dds.extension_policies import COMPRESSION, DISABLE_POSITIVE_ACKS, EXTENSIONS, TOPIC_KIND
from cqos_dds.implementations import CYCLONE_DDS, FAST_DDS, IMPLEMENTATION
from cqos_dds.kept_policies import (
    AUTODISPOSE,
    AUTOPURGE_DISPOSED,
    AUTOPURGE_NOWRITER,
    CLEANUP_DELAY,
    DEPTH,
    HISTORY,
    LIFESPAN,
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    SERVICE_DEPTH,
    SERVICE_HISTORY,
    SERVICE_MAX_INSTANCES,
    SERVICE_MAX_PER_INSTANCE,
    SERVICE_MAX_SAMPLES,
)
from cqos_dds.kinds import duration, number
from cqos_dds.requested_policies import (
    ACCESS_SCOPE,
    COHERENT,
    DATA_REPRESENTATION,
    DEADLINE,
    DESTINATION_ORDER,
    DURABILITY,
    FORCE_TYPE_VALIDATION,
    GROUPS,
    IGNORE_MEMBER_NAMES,
    IGNORE_SEQUENCE_BOUNDS,
    IGNORE_STRING_BOUNDS,
    LATENCY_BUDGET,
    LEASE,
    LIVELINESS,
    MAX_BLOCKING_TIME,
    NO_FILTER,
    ORDERED,
    OWNERSHIP,
    PARTITION,
    PREVENT_TYPE_WIDENING,
    READER,
    RELIABILITY,
    TOPIC_WRITER,
    TYPE,
    TYPE_CONSISTENCY,
    TYPE_EXTENSIBILITY,
    TYPE_INFORMATION,
    WRITER,
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
STRONGEST_WRITER: Final = Policy(
    "strongest_writer",
    number(),
    "-2147483648",
    "The largest ownership_strength of the exclusive writers from which a reader takes samples; that of the design counts by itself.",
    "DDS 1.4, 2.2.3.10",
    roles=READER,
    changeable=True,
    unseen=True,
)
TIME_BASED_FILTER: Final = Policy(
    "time_based_filter",
    duration(),
    "0s",
    "The shortest time between two samples of an instance that a reader wants to see; those between are dropped.",
    "DDS 1.4, 2.2.3.12",
    roles=READER,
    aliases=("time_based_filter.minimum_separation", "minimum_separation"),
    enforced=NO_FILTER,
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
SOLE_WRITER: Final = Policy(
    "sole_writer",
    Flag(),
    "false",
    "Whether no two writers write the same instance, also none of another design.",
    level="topic",
)

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
OF_COMPILER: Final = "of_compiler"
EXTENSIBILITY: Final = Policy(
    "extensibility",
    Choice("final", "appendable", "mutable", OF_COMPILER, ordered=False),
    None,
    "How data types may grow, as their IDL states. `of_compiler`: it states nothing, and the compiler of the implementation decides: "
    "final for Cyclone DDS, appendable for the others.",
    "DDS-XTypes 1.3, 7.2.3; idlc of Cyclone DDS, -x; opendds_idl, --default-extensibility",
    level="option",
    assume=("final", "appendable", "mutable", OF_COMPILER),
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
            **dict.fromkeys(CYCLONE_DDS, "10s"),
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
    TYPE_EXTENSIBILITY,
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
    STRONGEST_WRITER,
    TIME_BASED_FILTER,
    TRANSPORT_PRIORITY,
    ENTITY_FACTORY,
    USER_DATA,
    GROUP_DATA,
    TOPIC_DATA,
    ANNOUNCEMENT_PERIOD,
    DISABLE_POSITIVE_ACKS,
    TOPIC_KIND,
    COMPRESSION,
    EXTENSIONS,
    TAKEN_EVERY,
    TOPIC_TYPE,
    KEYED,
    PERIOD,
    LATCHED,
    SIZE,
    SOLE_WRITER,
    IMPLEMENTATION,
    DOMAIN,
    EXTENSIBILITY,
    SERVICE_RUNS,
    ROUND_TRIP,
    REPAIR_TIME,
    REDISCOVERY_TIME,
    RESEND_ROUND_TRIPS,
    DEPTH_MARGIN,
    PARTICIPANT_LEASE,
)
