"""What Cyclone DDS finds in a domain: its built-in topics read, its policies put into the words of the pack.

A policy that is not announced has the value that DDSI-RTPS says (2.5, section 9.6.3), and Cyclone DDS fills it in. That
goes for what discovery carries at all. History, resource limits, transport priority and the lifecycles are not part of it;
Cyclone DDS announces them all the same, so they are known of its own endpoints only.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
    BuiltinTopicDcpsTopic,
)
from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy

from cqos_core.model.problems import CqosError
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Role
from cqos_core.packs import INFINITE
from cqos_dds.pack import PACK
from cqos_live.dds.snapshot.ros_nodes import RosNodes
from cqos_live.dds.snapshot.seen_endpoints import Seen, SeenEndpoint, SeenParticipant, SeenTopic

VENDORS: Final = {
    "0101": "connext",
    "0103": "opendds",
    "010f": "fastdds",
    "0110": "cyclonedds",
    "0112": "rustdds",
    "0114": "dust",
}
"""The first two bytes of a GUID say whose it is (DDSI-RTPS 2.5, 9.3.1.1); the numbers are given out by the OMG."""
PROPERTIES: Final = {
    "__ProcessName": "process",
    "__Pid": "pid",
    "__Hostname": "host",
    "fastdds.physical_data.process": "pid",
    "fastdds.physical_data.host": "host",
}
"""Properties in which implementations tell who runs a participant."""
_BATCH: Final = 1000


class Discovery:
    """A participant that joins a domain and listens, also to the topic on which nodes of ROS 2 announce themselves."""

    def __init__(self, domain: int) -> None:
        """Join the domain; from now on everybody in it is found.

        Raises:
            CqosError: Cyclone DDS cannot join it.
        """
        self.domain = domain
        try:
            self._self = DomainParticipant(domain)
            self._participants = BuiltinDataReader(self._self, BuiltinTopicDcpsParticipant)
            self._writers = BuiltinDataReader(self._self, BuiltinTopicDcpsPublication)
            self._readers = BuiltinDataReader(self._self, BuiltinTopicDcpsSubscription)
            self._topics = BuiltinDataReader(self._self, BuiltinTopicDcpsTopic)
            self._nodes = RosNodes(self._self)
        except DDSException as error:
            raise CqosError(
                f"Cyclone DDS cannot join domain {domain}: {error.msg or error}",
                "its configuration is in the environment variable CYCLONEDDS_URI",
            ) from None

    def seen(self) -> Seen:
        """Return who is there now."""
        own = self._self.guid
        seen = Seen(self.domain)
        for reader, role in ((self._writers, PUBLISHER), (self._readers, SUBSCRIBER)):
            seen.endpoints += [_endpoint(sample, role) for sample in _alive(reader) if sample.participant_key != own]
        # A participant is announced before its endpoints: read afterwards, the participants have the names of all of them.
        seen.participants = [_participant(sample) for sample in _alive(self._participants) if sample.key != own]
        seen.nodes = self._nodes.seen()
        seen.topics = [SeenTopic(sample.topic_name, sample.type_name) for sample in _alive(self._topics)]
        return seen


def _alive(reader: Any) -> list[Any]:
    """Return what a built-in topic says of all who have not left; the next look finds them again."""
    condition = ReadCondition(reader, ViewState.Any | SampleState.Any | InstanceState.Alive)
    most, samples = _BATCH, list(reader.read(_BATCH, condition))
    while len(samples) == most:
        most *= 4
        samples = list(reader.read(most, condition))
    return samples


def _participant(sample: Any) -> SeenParticipant:
    key = str(sample.key)
    properties = {
        field: policy.value
        for policy in sample.qos
        if isinstance(policy, Policy.Property) and (field := PROPERTIES.get(policy.key)) is not None
    }
    return SeenParticipant(key, _name(sample.qos), VENDORS.get(key[:4]), **properties)


def _endpoint(sample: Any, role: Role) -> SeenEndpoint:
    key = str(sample.key)
    return SeenEndpoint(
        key,
        str(sample.participant_key),
        role,
        sample.topic_name,
        sample.type_name,
        {
            **settings(sample.qos, role, VENDORS.get(key[:4])),
            "type_information": str(sample.type_id is not None).lower(),
        },
        _name(sample.qos),
        _KEYED.get(key[-2:]),
    )


_KEYED: Final = {"02": True, "07": True, "03": False, "04": False}
"""Whether a topic has keys, by the last octet of the GUID of a user's writer or reader (RTPS 2.5, 9.3.1.2)."""


def _name(qos: Any) -> str:
    named = qos[Policy.EntityName]
    return "" if named is None else str(named.name)


def settings(qos: Any, role: Role, implementation: str | None = "cyclonedds") -> dict[str, str]:
    """Return the policies that ``qos`` of Cyclone DDS holds, as far as an endpoint of this implementation announces them."""
    stated = {"partition": "[]"}  # Cyclone DDS leaves an empty list out
    for policy in qos:
        scope = policy.__scope__
        if scope in _NOT_IN_DISCOVERY and implementation != "cyclonedds":
            continue
        read = _READ.get(scope)
        if read is not None:
            stated |= {
                name: _text(name, value) for name, value in read(policy).items() if role in PACK.policy(name).roles
            }
    if role == PUBLISHER and "xcdr1, xcdr2" in stated.get("data_representation", ""):
        # Discovery does not report their order, and a writer uses the first.
        del stated["data_representation"]
    return {policy.name: stated[policy.name] for policy in PACK.policies if policy.name in stated}


def _text(name: str, value: Any) -> str:
    """Write a value of Cyclone DDS as the pack writes it."""
    domain = PACK.policy(name).domain
    if isinstance(value, bytes):
        text = value.decode("ascii", "replace")
        return text if text.isascii() and text.isprintable() else f"0x{value.hex()}"
    if isinstance(value, str):
        return value
    if value == -1 and domain.kind == "count" and name.partition(".")[0] in _WITH_LENGTHS:
        value = INFINITE
    return domain.format(value)


def _kind(policy: Any) -> str:
    """``best_effort`` of what is called ``Policy.Reliability.BestEffort``."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", type(policy).__name__.rpartition(".")[2]).lower()


def _history(policy: Any, kind: str, depth: str) -> dict[str, Any]:
    # With keep_all there is no depth.
    return {kind: _kind(policy), **({depth: policy.depth} if hasattr(policy, "depth") else {})}


def _limits(policy: Any, of: str) -> dict[str, Any]:
    return {
        f"{of}.{name}": getattr(policy, name) for name in ("max_samples", "max_instances", "max_samples_per_instance")
    }


def _fields(policy: Any, of: str, *names: str) -> dict[str, Any]:
    return {f"{of}.{name}": getattr(policy, name) for name in names if hasattr(policy, name)}


_WITH_LENGTHS: Final = ("resource_limits", "durability_service")
_NOT_IN_DISCOVERY: Final = frozenset(
    {"History", "ResourceLimits", "TransportPriority", "WriterDataLifecycle", "ReaderDataLifecycle"}
)
_READ: Final[dict[str, Callable[[Any], dict[str, Any]]]] = {
    "Reliability": lambda p: {"reliability": _kind(p), **_fields(p, "reliability", "max_blocking_time")},
    "Durability": lambda p: {"durability": _kind(p)},
    "Deadline": lambda p: {"deadline": p.deadline},
    "LatencyBudget": lambda p: {"latency_budget": p.budget},
    "Liveliness": lambda p: {"liveliness": _kind(p), "liveliness.lease_duration": p.lease_duration},
    "Ownership": lambda p: {"ownership": _kind(p)},
    "OwnershipStrength": lambda p: {"ownership_strength": p.strength},
    "DestinationOrder": lambda p: {"destination_order": _kind(p)},
    "PresentationAccessScope": lambda p: {
        "presentation.access_scope": _kind(p),
        **_fields(p, "presentation", "coherent_access", "ordered_access"),
    },
    "Partition": lambda p: {"partition": tuple(p.partitions)},
    "DataRepresentation": lambda p: {
        "data_representation": ("xcdr1",) * p.use_cdrv0_representation + ("xcdr2",) * p.use_xcdrv2_representation
    },
    "TypeConsistency": lambda p: {
        "type_consistency": _kind(p),
        **_fields(
            p,
            "type_consistency",
            "ignore_sequence_bounds",
            "ignore_string_bounds",
            "ignore_member_names",
            "prevent_type_widening",
            "force_type_validation",
        ),
    },
    "History": lambda p: _history(p, "history", "history.depth"),
    "ResourceLimits": lambda p: _limits(p, "resource_limits"),
    "DurabilityService": lambda p: {
        "durability_service.service_cleanup_delay": p.cleanup_delay,
        **_history(p.history, "durability_service.history_kind", "durability_service.history_depth"),
        **_limits(p, "durability_service"),
    },
    "Lifespan": lambda p: {"lifespan": p.lifespan},
    "TimeBasedFilter": lambda p: {"time_based_filter": p.filter_time},
    "TransportPriority": lambda p: {"transport_priority": p.priority},
    "WriterDataLifecycle": lambda p: {"writer_data_lifecycle": p.autodispose},
    "ReaderDataLifecycle": lambda p: _fields(
        p, "reader_data_lifecycle", "autopurge_nowriter_samples_delay", "autopurge_disposed_samples_delay"
    ),
    "Userdata": lambda p: {"user_data": p.data},
    "Groupdata": lambda p: {"group_data": p.data},
}
