"""Settings as the QoS of Cyclone DDS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Final

from cyclonedds.internal import dds_c_t
from cyclonedds.qos import BasePolicy, Policy, Qos, _CQos

INFINITE: Final = 2**63 - 1
NAMED: Final = {
    11: "reliability",
    2: "durability",
    3: "presentation",
    4: "deadline",
    5: "latency_budget",
    6: "ownership",
    8: "liveliness",
    12: "destination_order",
    25: "data_representation",
}
"""The ids of policies in Cyclone DDS, in the order in which it compares them; it names the first that does not fit."""


@dataclass(frozen=True)
class Representations(BasePolicy):  # type: ignore[no-untyped-call]
    """Data representations in any order, which the policy that comes with Cyclone DDS cannot say."""

    __scope__: ClassVar[str] = "DataRepresentation"
    ids: tuple[int, ...]


def _set_representations(qos: Any, policy: Representations) -> Any:
    ids = (dds_c_t.data_representation_id * len(policy.ids))(*policy.ids)
    return _CQos._set_data_representation(qos, len(policy.ids), ids)  # noqa: SLF001 - the binding has no other door


setattr(_CQos, "_set_p_datarepresentation", staticmethod(_set_representations))  # noqa: B010 - a method is replaced


def group(stated: Mapping[str, Any]) -> Qos:
    """Return what is set on the publisher or subscriber, from what `cqos_live.dds.prove.settings.parsed` returns."""
    policies: list[Any] = []
    if any(name.startswith("presentation.") for name in stated):
        scope = getattr(
            Policy.PresentationAccessScope, stated.get("presentation.access_scope", "instance").capitalize()
        )
        flags = (bool(stated.get(f"presentation.{flag}_access", 0)) for flag in ("coherent", "ordered"))
        policies.append(scope(*flags))
    if "partition" in stated:
        policies.append(Policy.Partition(stated["partition"]))
    if "group_data" in stated:
        policies.append(Policy.Groupdata(stated["group_data"].encode()))
    return Qos(*policies)


def qos(stated: Mapping[str, Any]) -> Qos:
    """Return what is set on the writer or reader."""
    policies = [make(stated) for name, make in _POLICIES.items() if name in {each.partition(".")[0] for each in stated}]
    return Qos(*policies)


def _history(kind: str, depth: int) -> Any:
    return Policy.History.KeepAll if kind == "keep_all" else Policy.History.KeepLast(depth)


def _camel(word: str) -> str:
    return "".join(part.capitalize() for part in word.split("_"))


def _reliability(stated: Mapping[str, Any]) -> Any:
    if stated["reliability"] == "best_effort":
        return Policy.Reliability.BestEffort
    return Policy.Reliability.Reliable(stated.get("reliability.max_blocking_time", 100_000_000))


def _limits(stated: Mapping[str, Any], of: str) -> tuple[int, ...]:
    names = ("max_samples", "max_instances", "max_samples_per_instance")
    return tuple(stated.get(f"{of}.{name}", -1) for name in names)


def _type_consistency(stated: Mapping[str, Any]) -> Any:
    force = bool(stated.get("type_consistency.force_type_validation", 0))
    if stated.get("type_consistency") == "disallow_type_coercion":
        return Policy.TypeConsistency.DisallowTypeCoercion(force)
    flags = {
        "ignore_sequence_bounds": 1,
        "ignore_string_bounds": 1,
        "ignore_member_names": 0,
        "prevent_type_widening": 0,
    }
    chosen = {name: bool(stated.get(f"type_consistency.{name}", default)) for name, default in flags.items()}
    return Policy.TypeConsistency.AllowTypeCoercion(**chosen, force_type_validation=force)


_POLICIES: dict[str, Callable[[Mapping[str, Any]], Any]] = {
    "reliability": _reliability,
    "durability": lambda s: getattr(Policy.Durability, _camel(s["durability"])),
    "deadline": lambda s: Policy.Deadline(s["deadline"]),
    "latency_budget": lambda s: Policy.LatencyBudget(s["latency_budget"]),
    "liveliness": lambda s: getattr(Policy.Liveliness, _camel(s.get("liveliness", "automatic")))(
        s.get("liveliness.lease_duration", INFINITE)
    ),
    "ownership": lambda s: getattr(Policy.Ownership, _camel(s["ownership"])),
    "destination_order": lambda s: getattr(Policy.DestinationOrder, _camel(s["destination_order"])),
    "data_representation": lambda s: Representations(
        tuple(("xcdr1", "xml", "xcdr2").index(name) for name in s["data_representation"])
    ),
    "history": lambda s: _history(s.get("history", "keep_last"), s.get("history.depth", 1)),
    "resource_limits": lambda s: Policy.ResourceLimits(*_limits(s, "resource_limits")),
    "durability_service": lambda s: Policy.DurabilityService(
        s.get("durability_service.service_cleanup_delay", 0),
        _history(s.get("durability_service.history_kind", "keep_last"), s.get("durability_service.history_depth", 1)),
        *_limits(s, "durability_service"),
    ),
    "time_based_filter": lambda s: Policy.TimeBasedFilter(s["time_based_filter"]),
    "lifespan": lambda s: Policy.Lifespan(s["lifespan"]),
    "ownership_strength": lambda s: Policy.OwnershipStrength(s["ownership_strength"]),
    "transport_priority": lambda s: Policy.TransportPriority(s["transport_priority"]),
    "writer_data_lifecycle": lambda s: Policy.WriterDataLifecycle(bool(s["writer_data_lifecycle"])),
    "reader_data_lifecycle": lambda s: Policy.ReaderDataLifecycle(
        *(s.get(f"reader_data_lifecycle.autopurge_{of}_samples_delay", INFINITE) for of in ("nowriter", "disposed"))
    ),
    "type_consistency": _type_consistency,
    "user_data": lambda s: Policy.Userdata(s["user_data"].encode()),
}
