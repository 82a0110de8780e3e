"""How people see the settings of DDS: headings, names, and what each value means."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Panel

_DELIVERY: Final = ("reliability", "durability", "history", "history.depth")
_TIMING: Final = ("deadline", "lifespan", "latency_budget", "time_based_filter")
_LIVELINESS: Final = ("liveliness", "liveliness.lease_duration", "liveliness.announcement_period")
_ACCESS: Final = ("presentation.access_scope", "presentation.coherent_access", "presentation.ordered_access")
_TYPE_RULES: Final = (
    "type_consistency",
    "type_consistency.ignore_sequence_bounds",
    "type_consistency.ignore_string_bounds",
    "type_consistency.ignore_member_names",
    "type_consistency.prevent_type_widening",
    "type_consistency.force_type_validation",
)
_LIMITS: Final = (
    "reliability.max_blocking_time",
    "resource_limits.max_samples",
    "resource_limits.max_instances",
    "resource_limits.max_samples_per_instance",
)
_SERVICE: Final = (
    "durability_service.service_cleanup_delay",
    "durability_service.history_kind",
    "durability_service.history_depth",
    "durability_service.max_samples",
    "durability_service.max_instances",
    "durability_service.max_samples_per_instance",
)
_LIFECYCLE: Final = (
    "writer_data_lifecycle",
    "reader_data_lifecycle.autopurge_nowriter_samples_delay",
    "reader_data_lifecycle.autopurge_disposed_samples_delay",
    "entity_factory",
)
_EXTENSIONS: Final = ("disable_positive_acks", "topic_kind", "compression_ids", "extensions")
_DATA: Final = ("user_data", "group_data", "topic_data")
_HISTORY: Final = {
    "keep_last": "The last samples of each instance are kept, as many as the depth says.",
    "keep_all": "All samples are kept, up to the resource limits.",
}
_EXTENSIBILITY: Final = {
    "final": "A type never grows.",
    "appendable": "Members may be added at the end.",
    "mutable": "Members may be added and removed anywhere.",
}
_NETWORK: Final = (
    *("round_trip_time", "repair_time", "rediscovery_time"),
    *("resend_round_trips", "reliable_depth_margin"),
)

PANEL: Final = Panel(
    groups={
        "Delivery": _DELIVERY,
        "Timing": _TIMING,
        "Liveliness": _LIVELINESS,
        "Ownership and order": (
            *("ownership", "ownership_strength", "strongest_writer", "destination_order"),
            *_ACCESS,
        ),
        "Matching": (
            "partition",
            "data_representation",
            "type_information",
            "type_extensibility",
            *_TYPE_RULES,
            *_EXTENSIONS,
        ),
        "Limits": (*_LIMITS, "transport_priority", "taken_every"),
        "Durability service": _SERVICE,
        "Lifecycle": _LIFECYCLE,
        "Data of discovery": _DATA,
        "Topic": ("type", "period", "latched", "keyed", "size", "sole_writer"),
        "Deployment": ("implementation", "domain", "outage", "extensibility", "durability_service_runs", *_NETWORK),
        "Participant": ("participant_lease",),
    },
    advanced=(
        *("latency_budget", "time_based_filter", "liveliness.announcement_period"),
        *("destination_order", "data_representation", "type_information", "transport_priority", "taken_every"),
        *("strongest_writer", "type_extensibility"),
        *(*_ACCESS, *_TYPE_RULES, *_EXTENSIONS, *_LIMITS, *_SERVICE, *_LIFECYCLE, *_DATA, *_NETWORK),
        *("keyed", "size", "sole_writer", "extensibility", "durability_service_runs", "participant_lease", "relayed"),
    ),
    labels={
        "history.depth": "Depth",
        "liveliness.lease_duration": "Lease duration",
        "liveliness.announcement_period": "Announcement period",
        "reliability.max_blocking_time": "Max blocking time",
        "presentation.access_scope": "Access scope",
        "presentation.coherent_access": "Coherent access",
        "presentation.ordered_access": "Ordered access",
        "resource_limits.max_samples": "Max samples",
        "resource_limits.max_instances": "Max instances",
        "resource_limits.max_samples_per_instance": "Max samples per instance",
        "durability_service.service_cleanup_delay": "Cleanup delay of the service",
        "durability_service.history_kind": "History of the service",
        "durability_service.history_depth": "Depth of the service",
        "durability_service.max_samples": "Max samples of the service",
        "durability_service.max_instances": "Max instances of the service",
        "durability_service.max_samples_per_instance": "Max samples per instance of the service",
        "type_consistency.ignore_sequence_bounds": "Ignore sequence bounds",
        "type_consistency.ignore_string_bounds": "Ignore string bounds",
        "type_consistency.ignore_member_names": "Ignore member names",
        "type_consistency.prevent_type_widening": "Prevent type widening",
        "type_consistency.force_type_validation": "Force type validation",
        "writer_data_lifecycle": "Dispose what is unregistered",
        "reader_data_lifecycle.autopurge_nowriter_samples_delay": "Purge delay without writers",
        "reader_data_lifecycle.autopurge_disposed_samples_delay": "Purge delay after disposal",
        "entity_factory": "Enable at once",
        "type": "Data type",
        "topic_kind": "Kind of the topic",
        "compression_ids": "Compression",
        "extensions": "QoS that is not modelled",
    },
    values={
        "reliability": {
            "best_effort": "A lost sample is not sent again.",
            "reliable": "Lost samples are sent again until they arrive.",
        },
        "durability": {
            "volatile": "A late reader gets no sample from before.",
            "transient_local": "The writer keeps samples for late readers.",
            "transient": "A service keeps samples in memory, beyond the life of the writer.",
            "persistent": "A service keeps samples on disk, beyond a restart of the system.",
            "default": "What the implementation has by default.",
        },
        "history": _HISTORY,
        "durability_service.history_kind": _HISTORY,
        "liveliness": {
            "automatic": "The middleware says that the writer is alive.",
            "manual_by_participant": "One assertion counts for all writers of the participant.",
            "manual_by_topic": "The program says so for each writer.",
        },
        "ownership": {
            "shared": "All writers may update an instance.",
            "exclusive": "Only the strongest writer that is alive updates an instance.",
        },
        "destination_order": {
            "by_reception_timestamp": "The sample that arrived later is the newer one.",
            "by_source_timestamp": "The sample that was written later is the newer one.",
        },
        "presentation.access_scope": {
            "instance": "Coherence and order hold within an instance.",
            "topic": "They hold within a topic.",
            "group": "They hold over all topics of a publisher.",
            "highest_offered": "The reader takes what each writer offers.",
        },
        "type_consistency": {
            "disallow_type_coercion": "Only samples of exactly the reader's type are taken.",
            "allow_type_coercion": "Samples of a type that can be read as the reader's own are taken too.",
        },
        "extensibility": _EXTENSIBILITY
        | {"of_compiler": "The IDL says nothing, and the compiler of each implementation decides."},
        "type_extensibility": _EXTENSIBILITY,
        "implementation": {"standard": "Judged by the texts of the standard alone."},
        "topic_kind": {"no_key": "The data type has no key.", "with_key": "The data type has a key."},
        "extensions": {
            "none": "No other QoS decides anything.",
            "may_lose": "Other QoS may lose samples.",
            "refusing": "Other QoS keeps the ends from matching.",
            "unknown": "The QoS has elements that C-QoS does not model.",
        },
        "latched": {"true": "A late reader needs the last sample.", "false": "It needs none from before."},
    },
    value_labels={
        "implementation": {
            "standard": "The standard",
            "cyclonedds": "Cyclone DDS 11",
            "cyclonedds_0_10": "Cyclone DDS 0.10",
            "fastdds_2_9": "Fast DDS 2.9",
            "fastdds_3_1": "Fast DDS 3.1",
            "fastdds_3_6": "Fast DDS 3.6",
            "opendds": "OpenDDS",
            "connext": "RTI Connext",
            "dust": "Dust DDS",
            "rustdds": "RustDDS",
        },
    },
)
