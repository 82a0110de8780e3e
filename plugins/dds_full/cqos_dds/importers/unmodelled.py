"""Elements inside the QoS of an entity that no policy models: those that cannot change matching or delivery, and all others.

A pattern is a path below the element of the QoS, perhaps with the text of the element: ``batch/enable=false``. Properties have
their name as the last part of the path. An element that no pattern covers leaves `extensions` unknown.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from cqos_core.importers.xml_source import children, elements, local, text_of
from cqos_core.model.settings import Setting
from cqos_dds.extension_policies import EXTENSIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Place, Settings

_NAMES: Final = "names that tools show"
_MEMORY: Final = "memory that is allocated beforehand, and room for what is remembered of peers"
_THREADS: Final = "threads and locks"
_ADDRESSES: Final = "addresses and transports; whether discovery works is not checked"
_SENDING: Final = "when samples are sent and repaired"
_DEFAULT: Final = "the default, stated"
_TOOLS: Final = "for tools and services beside the pair"
_IGNORED: Final = "what the implementation announces or reads, and compares with nothing"
_ENDED: Final = "how long a reader remembers instances that have ended"

DDS_XML: Final = {
    **dict.fromkeys(
        ("entity_name", "publication_name", "subscription_name", "publisher_name", "subscriber_name"), _NAMES
    ),
    **dict.fromkeys(
        (
            "resource_limits/initial_*",
            "resource_limits/instance_hash_buckets",
            "resource_limits/instance_hash_bucket",
            *(f"{side}_resource_limits/{field}" for side in ("writer", "reader") for field in ("initial_*", "max_*")),
            "reader_resource_limits/disable_fragmentation_support",
            "reader_resource_limits/dynamically_allocate_*",
            "reader_resource_limits/shmem_ref_transfer_mode_attached_segment_allocation",
            "writer_resource_limits/cookie_max_length",
            "property/value/dds.data_*er.history.memory_manager.*",
        ),
        _MEMORY,
    ),
    **dict.fromkeys(("asynchronous_publisher", "exclusive_area"), _THREADS),
    **dict.fromkeys(("unicast", "multicast", "encapsulation", "transport_selection", "transfer_mode"), _ADDRESSES),
    **dict.fromkeys(
        (
            "publish_mode",
            "protocol/rtps_reliable_writer",
            "protocol/rtps_reliable_reader",
            "protocol/rtps_object_id",
            "protocol/disable_inline_keyhash",
            "protocol/serialize_key_with_dispose",
            "protocol/propagate_*",
            "protocol/expects_inline_qos",
            "liveliness/assertions_per_lease_duration",
            "representation/compression_settings/writer_compression_*",
        ),
        _SENDING,
    ),
    **dict.fromkeys(
        (
            "protocol/push_on_write=true",
            "protocol/disable_positive_acks=false",
            "batch/enable=false",
            "batch/max_*",
            "batch/source_timestamp_resolution",
            "batch/thread_safe_write",
            "writer_batching/batch_updates=false",
            "reliability/acknowledgment_kind=*protocol_acknowledgment_mode",
            "reliability/instance_state_*_kind=no_*",
            "destination_order/scope=*instance_scope*",
            "durability/direct_communication=true",
            "history/refilter=*none_refilter*",
            "presentation/drop_incomplete_coherent_set=true",
        ),
        _DEFAULT,
    ),
    **dict.fromkeys(("topic_query_dispatch", "service", "type_support"), _TOOLS),
    **dict.fromkeys(
        ("reader_data_lifecycle/autopurge_*_instances_delay", "writer_data_lifecycle/autopurge_*_instances_delay"),
        _ENDED,
    ),
}
"""Paths in ``datawriter_qos``, ``datareader_qos``, ``publisher_qos`` and ``subscriber_qos`` of any implementation, with the reason."""

FAST: Final = {
    **dict.fromkeys(("userDefinedID", "entityID", "qos/topicData", "qos/topic_data"), _NAMES),
    **dict.fromkeys(
        (
            "historyMemoryPolicy",
            "matchedSubscribersAllocation",
            "matchedPublishersAllocation",
            "topic/resourceLimitsQos/allocated_samples",
            "topic/resourceLimitsQos/extra_samples",
        ),
        _MEMORY,
    ),
    **dict.fromkeys(
        (
            "unicastLocatorList",
            "multicastLocatorList",
            "remoteLocatorList",
            "external_unicast_locators",
            "ignore_non_matching_locators",
            "propertiesPolicy/properties/fastdds.unique_network_flows",
            "qos/data_sharing",
        ),
        _ADDRESSES,
    ),
    **dict.fromkeys(
        (
            "times",
            "throughputController",
            "expectsInlineQos",
            "expects_inline_qos",
            "qos/publishMode",
            "qos/disable_heartbeat_piggyback",
            "qos/disableHeartbeatPiggyback",
            "qos/disablePositiveAcks/duration",
        ),
        _SENDING,
    ),
    **dict.fromkeys(("qos/presentation",), _IGNORED),
}
"""The same in profiles of Fast DDS, below ``data_writer`` and ``data_reader``."""


def undecided(element: Element, path: str, table: dict[str, str]) -> Iterator[str]:
    """Yield the paths of an element, or of those in it, that no pattern of a table covers."""
    written = f"{path}={text_of(element).lower()}"
    if any(fnmatchcase(path, pattern) or fnmatchcase(written, pattern) for pattern in table):
        return
    inner = [*elements(element)]
    if not inner or not any(pattern.startswith(f"{path}/") for pattern in table):
        yield path
        return
    for child in inner:
        named = children(child, "name")
        yield from undecided(child, f"{path}/{text_of(named[0]) if named else local(child)}", table)


def leave_unknown(settings: Settings, paths: list[str], place: Place) -> None:
    """Let what elements may decide be unknown, beside what earlier elements have left so."""
    known = settings.get(EXTENSIONS.name)
    named = [*(known.text.split(", ") if known is not None else ()), *paths]
    *others, last = (f"`{path}`" for path in dict.fromkeys(named))
    listed = f"{', '.join(others)} and {last}" if others else last
    cause = (
        f"C-QoS does not model {listed}, which may decide a match; state `extensions: none` where it does not"
        if not others
        else f"C-QoS does not model {listed}, which may decide a match; state `extensions: none` where they do not"
    )
    settings[EXTENSIONS.name] = Setting(
        ", ".join(dict.fromkeys(named)), known.place if known is not None else place, unknown=cause
    )
