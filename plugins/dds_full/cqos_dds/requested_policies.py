"""The policies of DDS that must be offered as they are requested, and those that decide who meets whom."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    Anything,
    Choice,
    Flag,
    Names,
    PerRole,
    Policy,
    Text,
    by_option,
)
from cqos_dds.implementations import ANNOUNCE_TYPES, CYCLONE_DDS, FAST_DDS
from cqos_dds.kinds import Representations, choice, duration

WRITER: Final = ("publisher",)
READER: Final = ("subscriber",)

# What the standard sets a policy on.
TOPIC_WRITER_READER: Final = ("topic", "writer", "reader")
TOPIC_WRITER: Final = ("topic", "writer")
GROUPS: Final = ("publisher", "subscriber")

# What an implementation does not have at all; the rules state what it has and does not compare.
# Neither the reader history of Cyclone DDS 0.10 nor RustDDS looks at the filter.
NO_FILTER: Final = {"implementation": dict.fromkeys((*FAST_DDS, "cyclonedds_0_10", "rustdds"), "no")}
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
            **dict.fromkeys(
                CYCLONE_DDS,
                PerRole(
                    publisher=by_option("extensibility", otherwise="[xcdr1]", appendable="[xcdr2]", mutable="[xcdr2]"),
                    subscriber="[xcdr1, xcdr2]",
                ),
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
    "their names. Cyclone DDS, OpenDDS and Fast DDS 3 do so by default.",
    "DDS-XTypes 1.3, 7.6.3.2",
    words={"default": by_option("implementation", **dict.fromkeys(ANNOUNCE_TYPES, "true"), otherwise="false")},
)
TYPE_EXTENSIBILITY: Final = Policy(
    "type_extensibility",
    Choice("final", "appendable", "mutable", ordered=False, synonyms={"extensible": "appendable"}),
    None,
    "How the data type of this end may grow, where the two ends may differ.",
    "DDS-XTypes 1.3, 7.2.3",
    changeable=False,
    unseen=True,
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
