"""The element of each policy in each XML form (DDS-XML 1.0, 7.3.2; Fast DDS: XML profiles)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_dds.extension_policies import COMPRESSION, DISABLE_POSITIVE_ACKS
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
from cqos_dds.policies import (
    ANNOUNCEMENT_PERIOD,
    ENTITY_FACTORY,
    GROUP_DATA,
    OWNERSHIP_STRENGTH,
    TIME_BASED_FILTER,
    TOPIC_DATA,
    TRANSPORT_PRIORITY,
    USER_DATA,
)
from cqos_dds.requested_policies import (
    ACCESS_SCOPE,
    COHERENT,
    DATA_REPRESENTATION,
    DEADLINE,
    DESTINATION_ORDER,
    DURABILITY,
    FORCE_TYPE_VALIDATION,
    IGNORE_MEMBER_NAMES,
    IGNORE_SEQUENCE_BOUNDS,
    IGNORE_STRING_BOUNDS,
    LATENCY_BUDGET,
    LEASE,
    LIVELINESS,
    MAX_BLOCKING_TIME,
    ORDERED,
    OWNERSHIP,
    PARTITION,
    PREVENT_TYPE_WIDENING,
    RELIABILITY,
    TYPE_CONSISTENCY,
)

if TYPE_CHECKING:
    from cqos_core.model.system import Role
    from cqos_core.packs import Policy

_RESOURCE_LIMITS: Final = {
    "max_samples": MAX_SAMPLES,
    "max_instances": MAX_INSTANCES,
    "max_samples_per_instance": MAX_PER_INSTANCE,
}
_SERVICE: Final = {
    "service_cleanup_delay": CLEANUP_DELAY,
    "history_kind": SERVICE_HISTORY,
    "history_depth": SERVICE_DEPTH,
    "max_samples": SERVICE_MAX_SAMPLES,
    "max_instances": SERVICE_MAX_INSTANCES,
    "max_samples_per_instance": SERVICE_MAX_PER_INSTANCE,
}
_TYPE_CONSISTENCY: Final = {
    "kind": TYPE_CONSISTENCY,
    "ignore_sequence_bounds": IGNORE_SEQUENCE_BOUNDS,
    "ignore_string_bounds": IGNORE_STRING_BOUNDS,
    "ignore_member_names": IGNORE_MEMBER_NAMES,
    "prevent_type_widening": PREVENT_TYPE_WIDENING,
    "force_type_validation": FORCE_TYPE_VALIDATION,
}
_REPRESENTATION: Final = {"value": DATA_REPRESENTATION, "compression_settings/compression_ids": COMPRESSION}

OMG: Final[dict[str, dict[str, Policy]]] = {
    "reliability": {"kind": RELIABILITY, "max_blocking_time": MAX_BLOCKING_TIME},
    "durability": {"kind": DURABILITY},
    "deadline": {"period": DEADLINE},
    "latency_budget": {"duration": LATENCY_BUDGET},
    "liveliness": {"kind": LIVELINESS, "lease_duration": LEASE},
    "ownership": {"kind": OWNERSHIP},
    "ownership_strength": {"value": OWNERSHIP_STRENGTH},
    "destination_order": {"kind": DESTINATION_ORDER},
    "lifespan": {"duration": LIFESPAN},
    "history": {"kind": HISTORY, "depth": DEPTH},
    "resource_limits": _RESOURCE_LIMITS,
    "time_based_filter": {"minimum_separation": TIME_BASED_FILTER},
    "transport_priority": {"value": TRANSPORT_PRIORITY},
    "durability_service": _SERVICE,
    "presentation": {"access_scope": ACCESS_SCOPE, "coherent_access": COHERENT, "ordered_access": ORDERED},
    "partition": {"name": PARTITION},
    "representation": _REPRESENTATION,
    "data_representation": _REPRESENTATION,
    "type_consistency": _TYPE_CONSISTENCY,
    "type_consistency_enforcement": _TYPE_CONSISTENCY,
    "writer_data_lifecycle": {"autodispose_unregistered_instances": AUTODISPOSE},
    "reader_data_lifecycle": {
        "autopurge_nowriter_samples_delay": AUTOPURGE_NOWRITER,
        "autopurge_disposed_samples_delay": AUTOPURGE_DISPOSED,
    },
    "user_data": {"value": USER_DATA},
    "topic_data": {"value": TOPIC_DATA},
    "group_data": {"value": GROUP_DATA},
    "entity_factory": {"autoenable_created_entities": ENTITY_FACTORY},
}
"""Element of a policy to its fields, in DDS-XML; a field may stand deeper, on a path."""

FAST_QOS: Final[dict[str, dict[str, Policy]]] = {
    "reliability": OMG["reliability"],
    "durability": OMG["durability"],
    "deadline": OMG["deadline"],
    "latencyBudget": OMG["latency_budget"],
    "liveliness": {"kind": LIVELINESS, "lease_duration": LEASE, "announcement_period": ANNOUNCEMENT_PERIOD},
    "ownership": OMG["ownership"],
    "ownershipStrength": OMG["ownership_strength"],
    "destinationOrder": OMG["destination_order"],
    "lifespan": OMG["lifespan"],
    "timeBasedFilter": OMG["time_based_filter"],
    "durabilityService": _SERVICE,
    "partition": {"names": PARTITION},
    "userData": OMG["user_data"],
    "groupData": OMG["group_data"],
    "disablePositiveAcks": {"enabled": DISABLE_POSITIVE_ACKS},
}
"""Element of a policy below ``qos`` to its fields, in profiles of Fast DDS."""

FAST_TOPIC: Final[dict[str, dict[str, Policy]]] = {
    "historyQos": OMG["history"],
    "resourceLimitsQos": _RESOURCE_LIMITS,
}
"""The same below ``topic``."""

FAST_ALSO: Final = {
    "destination_order": "destinationOrder",
    "latency_budget": "latencyBudget",
    "ownership_strength": "ownershipStrength",
    "time_based_filter": "timeBasedFilter",
    "durability_service": "durabilityService",
    "user_data": "userData",
    "group_data": "groupData",
}
"""Spellings of other versions."""

FAST_READ_ONLY: Final[dict[str, dict[str, Policy]]] = {
    "transport_priority": OMG["transport_priority"],
    "transportPriority": OMG["transport_priority"],
}
"""What only some versions know, so that it is read and never written."""

BESIDE_POLICIES: Final = frozenset(
    (
        "autopurge_disposed_instances_delay",
        "autopurge_nowriter_instances_delay",
        "autopurge_unregistered_instances_delay",
    )
)
"""What implementations have beside the standard under names near those of the standard."""

WRITER: Final = "datawriter_qos"
READER: Final = "datareader_qos"
PUBLISHER_QOS: Final = "publisher_qos"
SUBSCRIBER_QOS: Final = "subscriber_qos"
PARTS: Final[dict[str, tuple[str, Role]]] = {
    WRITER: ("writer", PUBLISHER),
    READER: ("reader", SUBSCRIBER),
    PUBLISHER_QOS: ("publisher", PUBLISHER),
    SUBSCRIBER_QOS: ("subscriber", SUBSCRIBER),
}
"""Element of the QoS of an entity to the entity, and the endpoints that take values from it."""

SPELLINGS: Final = {
    "data_writer_qos": WRITER,
    "data_reader_qos": READER,
    "participant_qos": "domain_participant_qos",
    "domainparticipant_qos": "domain_participant_qos",
}
PARTICIPANT: Final = "domain_participant_qos"
OTHER_ENTITIES: Final = {"topic_qos": "topic", PARTICIPANT: "participant"}
"""What has QoS that no endpoint takes values from."""
OF_ENTITIES: Final = {
    part: tuple(each.name for form in OMG.values() for each in form.values() if entity in each.entities)
    for part, (entity, _) in PARTS.items()
}
"""The policies that an element of DDS-XML may hold."""
OF_PROFILES: Final = tuple(
    dict.fromkeys(each.name for form in (FAST_QOS, FAST_TOPIC) for fields in form.values() for each in fields.values())
)
"""The policies that a profile of Fast DDS may hold."""
