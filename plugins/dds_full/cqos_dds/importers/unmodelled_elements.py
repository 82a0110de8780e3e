"""Elements of XML files of DDS that no policy models, sorted by what they can decide: one table for each format.

The lists of elements that these tables are held complete against stand in ``tests/importers/schemas``, with source and version.
An element that no table names may prevent a match.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.settings import Setting
from cqos_core.model.system import Overlay, Part
from cqos_core.packs.xml_importer import EFFECTS, Effect, ElementTable
from cqos_dds.extension_policies import EXTENSIONS, MAY_LOSE

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import System
    from cqos_core.packs.xml_importer import Placed

_NAMES: Final = "names that tools show"
_MEMORY: Final = "memory that is allocated beforehand, and room for what is remembered of peers"
_THREADS: Final = "threads and locks"
_ADDRESSES: Final = "addresses; whether the network connects participants is not checked"
_SENDING: Final = "when samples and announcements are sent and repaired"
_DEFAULT: Final = "the default, stated"
_TOOLS: Final = "for tools and services beside the pair"
_IGNORED: Final = "what the implementation announces or reads, and compares with nothing"
_ENDED: Final = "how long a reader remembers instances that have ended"
_BEST_EFFORT: Final = "what is lost of best-effort samples, of which nothing is promised"
_WITHOUT: Final = "nothing where the element that switches it on is not there, which is listed itself"


def _each(reason: str, *patterns: str) -> dict[str, str]:
    return dict.fromkeys(patterns, reason)


def _may(effect: Effect, *patterns: str) -> dict[str, Effect]:
    return dict.fromkeys(patterns, effect)


DDS_XML: Final = ElementTable(
    cannot_matter={
        **_each(
            _NAMES, "entity_name", "publication_name", "subscription_name", "publisher_name", "subscriber_name", "name"
        ),
        **_each(
            _MEMORY,
            "resource_limits/initial_*",
            "resource_limits/instance_hash_buckets",
            "resource_limits/instance_hash_bucket",
            "writer_resource_limits/initial_*",
            "writer_resource_limits/max_*",
            "writer_resource_limits/autoregister_instances",
            "writer_resource_limits/cookie_max_length",
            "reader_resource_limits/initial_*",
            "reader_resource_limits/max_samples_per_read",
            "reader_resource_limits/max_outstanding_reads",
            "reader_resource_limits/max_query_condition_filters",
            "reader_resource_limits/dynamically_allocate_*",
            "reader_resource_limits/shmem_ref_transfer_mode_attached_segment_allocation",
            "property/value/dds.data_*er.history.memory_manager.*",
        ),
        **_each(
            _THREADS,
            "asynchronous_publisher/thread",
            "asynchronous_publisher/asynchronous_batch_thread",
            "asynchronous_publisher/topic_query_publication_thread",
            "exclusive_area",
        ),
        **_each(_ADDRESSES, "unicast", "multicast", "encapsulation", "transport_selection", "transfer_mode"),
        **_each(
            _SENDING,
            "publish_mode/kind",
            "publish_mode/priority",
            "protocol/rtps_reliable_reader",
            "protocol/rtps_reliable_writer/*_watermark",
            "protocol/rtps_reliable_writer/*heartbeat*",
            "protocol/rtps_reliable_writer/*nack*",
            "protocol/rtps_reliable_writer/*send_window*",
            "protocol/rtps_reliable_writer/multicast_resend_threshold",
            "protocol/rtps_object_id",
            "protocol/disable_inline_keyhash",
            "protocol/serialize_key_with_dispose",
            "protocol/propagate_*",
            "liveliness/assertions_per_lease_duration",
            "representation/compression_settings/writer_compression_*",
            "batch/max_*",
            "batch/source_timestamp_resolution",
            "batch/thread_safe_write",
        ),
        **_each(
            _DEFAULT,
            "asynchronous_publisher/disable_*=false",
            "protocol/push_on_write=true",
            "protocol/disable_positive_acks=false",
            "protocol/expects_inline_qos=false",
            "protocol/rtps_reliable_writer/inactivate_nonprogressing_readers=false",
            "protocol/rtps_reliable_writer/max_heartbeat_retries=*unlimited*",
            "protocol/rtps_reliable_writer/max_heartbeat_retries=-1",
            "protocol/rtps_reliable_writer/max_send_window_size=*unlimited*",
            "protocol/rtps_reliable_writer/max_send_window_size=-1",
            "publish_mode/flow_controller_name=*default_flow_controller*",
            "batch/enable=false",
            "writer_batching/batch_updates=false",
            "reader_resource_limits/max_*=*unlimited*",
            "reader_resource_limits/max_*=-1",
            "writer_resource_limits/max_*=*unlimited*",
            "writer_resource_limits/max_*=-1",
            "reader_resource_limits/disable_fragmentation_support=false",
            "reliability/acknowledgment_kind=*protocol_acknowledgment_mode",
            "reliability/instance_state_*_kind=no_*",
            "destination_order/scope=*instance_scope*",
            "durability/direct_communication=true",
            "history/refilter=*none_refilter*",
            "presentation/drop_incomplete_coherent_set=true",
            "service/kind=*no_service*",
            "availability/enable_required_subscriptions=false",
        ),
        **_each(_TOOLS, "topic_query_dispatch", "type_support"),
        **_each(
            _ENDED,
            "reader_data_lifecycle/autopurge_*_instances_delay",
            "writer_data_lifecycle/autopurge_*_instances_delay",
        ),
    },
    may_decide={
        **_may(
            "match",
            "asynchronous_publisher/disable_*",
            "batch/enable",
            "durability/direct_communication",
            "multi_channel",
            "property/value/*",
            "protocol/disable_positive_acks",
            "protocol/expects_inline_qos",
            "protocol/push_on_write",
            "reader_resource_limits/max_remote_*",
            "reliability/acknowledgment_kind",
            "reliability/instance_state_*_kind",
            "service",
            "writer_resource_limits/max_remote_readers",
            "writer_resource_limits/max_virtual_writers",
            "writer_resource_limits/max_app_ack_remote_readers",
        ),
        **_may(
            "delivery",
            "availability",
            "destination_order/source_timestamp_tolerance",
            "history/refilter",
            "presentation/drop_incomplete_coherent_set",
            "protocol/rtps_reliable_writer/disable_positive_acks_*",
            "protocol/rtps_reliable_writer/inactivate_nonprogressing_readers",
            "protocol/rtps_reliable_writer/max_heartbeat_retries",
            "protocol/rtps_reliable_writer/max_send_window_size",
            "protocol/virtual_guid",
            "publish_mode/flow_controller_name",
            "reader_resource_limits/disable_fragmentation_support",
            "reader_resource_limits/max_fragment*",
            "reader_resource_limits/max_infos",
            "reader_resource_limits/max_samples_per_remote_writer",
            "reader_resource_limits/max_total_instances",
            "writer_resource_limits/instance_replacement",
            "writer_resource_limits/replace_empty_instances",
        ),
    },
)
"""In ``datawriter_qos``, ``datareader_qos``, ``publisher_qos`` and ``subscriber_qos`` of any implementation."""

DDS_XML_PARTICIPANT: Final = ElementTable(
    cannot_matter={
        **_each(_NAMES, "participant_name", "name"),
        **_each(_IGNORED, "user_data"),
        **_each(
            _MEMORY,
            "resource_limits/*_allocation/initial_count",
            "resource_limits/*_allocation/incremental_count",
            "resource_limits/*_hash_buckets",
            "resource_limits/max_gather_destinations",
            "resource_limits/deserialized_type_object_dynamic_allocation_threshold",
        ),
        **_each(_THREADS, "event", "receiver_pool", "database"),
        **_each(
            _ADDRESSES,
            "default_unicast",
            "multicast_mapping",
            "discovery/multicast_receive_addresses",
            "discovery/metatraffic_transport_priority",
            "wire_protocol/rtps_auto_id_kind",
            "wire_protocol/rtps_reserved_port_mask",
            "property/value/dds.transport.*",
        ),
        **_each(
            _SENDING,
            "discovery_config/*initial_participant_announcement*",
            "discovery_config/*_reader",
            "discovery_config/*_reader_resource_limits",
            "discovery_config/*_writer",
            "discovery_config/*_writer_data_lifecycle",
            "discovery_config/*_writer_publish_mode",
            "discovery_config/asynchronous_publisher",
        ),
        **_each("read as the lease of participants", "discovery_config/participant_liveliness_lease_duration"),
        **_each(
            _TOOLS,
            "type_support",
            "logging",
            "monitoring",
            "discovery_config/*default_domain_announcement*",
            "property/value/rti.monitor.*",
        ),
        **_each(
            _DEFAULT,
            "entity_factory/autoenable_created_entities=true",
            "discovery/accept_unknown_peers=true",
            "transport_builtin/mask=*udpv4*",
            "transport_builtin/mask=*mask_default*",
            "wire_protocol/*_id=*auto*",
            "wire_protocol/participant_id=-1",
            "discovery_config/builtin_discovery_plugins=*sdp*",
            "discovery_config/builtin_discovery_plugins=*mask_default*",
            "resource_limits/*_allocation/max_count=*unlimited*",
            "resource_limits/*_allocation/max_count=-1",
        ),
    },
    may_decide={
        **_may(
            "match",
            "discovery_config/builtin_discovery_plugins",
            "discovery_config/builtin_discovery_plugins=*sdp2*",
            "entity_factory/autoenable_created_entities",
            "property/value/*",
        ),
        **_may(
            "discovery",
            "discovery/enabled_transports",
            "discovery/initial_peers",
            "discovery/accept_unknown_peers",
            "discovery_config/participant_liveliness_assert_period",
            "resource_limits/*_allocation/max_count",
            "resource_limits/*_max_*length",
            "resource_limits/max_*",
            "transport_builtin",
            "transport_builtin/mask=*udpv4_wan*",
            "wire_protocol/participant_id",
            "wire_protocol/rtps_*_id",
            "wire_protocol/rtps_well_known_ports",
        ),
        **_may(
            "delivery",
            "discovery_config/max_liveliness_loss_detection_period",
            "discovery_config/remote_participant_purge_kind",
        ),
    },
)
"""In the QoS of participants and of their factory."""

FAST: Final = ElementTable(
    cannot_matter={
        **_each(_NAMES, "userDefinedID", "entityID", "qos/topicData", "qos/topic_data"),
        **_each(
            _MEMORY,
            "historyMemoryPolicy",
            "matched*Allocation/initial",
            "matched*Allocation/increment",
            "topic/resourceLimitsQos/allocated_samples",
            "topic/resourceLimitsQos/extra_samples",
        ),
        **_each(
            _ADDRESSES,
            "unicastLocatorList",
            "multicastLocatorList",
            "remoteLocatorList",
            "external_unicast_locators",
            "ignore_non_matching_locators",
            "propertiesPolicy/properties/fastdds.unique_network_flows",
            "qos/data_sharing/shared_dir",
            "qos/data_sharing/domain_ids",
            "qos/data_sharing/max_domains",
            "qos/data_sharing/data_sharing_listener_thread",
        ),
        **_each(
            _SENDING,
            "times",
            "throughputController",
            "qos/publishMode/kind",
            "qos/disable_heartbeat_piggyback",
            "qos/disableHeartbeatPiggyback",
            "qos/disablePositiveAcks/duration",
        ),
        **_each(_IGNORED, "qos/presentation", "qos/transport_priority"),
        **_each(
            _DEFAULT,
            "expectsInlineQos=false",
            "expects_inline_qos=false",
            "qos/data_sharing/kind=auto*",
            "qos/data_sharing/kind=off",
            "matched*Allocation/maximum=0",
        ),
    },
    may_decide=_may(
        "match",
        "expectsInlineQos",
        "expects_inline_qos",
        "matched*Allocation/maximum",
        "propertiesPolicy/*/*",
        "qos/data_sharing/kind",
        "qos/publishMode/flow_controller_name",
    ),
)
"""Below ``data_writer`` and ``data_reader`` in profiles of Fast DDS.

A writer or reader refuses further matches at its maximum, where 0 is no maximum. One with data sharing ``ON`` cannot be created with a
history that grows, nor a writer with a flow controller that its participant does not have. Cyclone DDS drops a reader that expects
inline QoS.
"""

FAST_PARTICIPANT: Final = ElementTable(
    cannot_matter={
        **_each(_NAMES, "rtps/name"),
        **_each(_IGNORED, "rtps/userData"),
        **_each("read as the lease of participants", "rtps/builtin/discovery_config/leaseDuration"),
        **_each(
            _ADDRESSES,
            "rtps/default*LocatorList",
            "rtps/default_external_unicast_locators",
            "rtps/ignore_non_matching_locators",
            "rtps/*SocketBufferSize",
            "rtps/netmask_filter",
            "rtps/builtin/metatraffic*",
            "rtps/builtin/mutation_tries",
        ),
        **_each(
            _SENDING,
            "rtps/throughputController",
            "rtps/flow_controller_descriptor_list",
            "rtps/builtin/flow_controller_name",
            "rtps/builtin/avoid_builtin_multicast",
            "rtps/builtin/discovery_config/leaseAnnouncement",
            "rtps/builtin/discovery_config/initialAnnouncements",
            "rtps/builtin/discovery_config/clientAnnouncementPeriod",
        ),
        **_each(
            _MEMORY,
            "rtps/allocation/*/initial",
            "rtps/allocation/*/increment",
            "rtps/allocation/remote_locators",
            "rtps/allocation/send_buffers",
        ),
        **_each(_WITHOUT, "rtps/builtin/*PayloadSize"),
        **_each(_THREADS, "rtps/*_thread", "rtps/*_threads"),
        **_each(
            _TOOLS,
            "rtps/propertiesPolicy/properties/fastdds.statistics",
            "rtps/propertiesPolicy/properties/fastdds.physical_data.*",
        ),
        **_each(
            _DEFAULT,
            "domainId=0",
            "rtps/allocation/*=0",
            "rtps/useBuiltinTransports=true",
            "rtps/builtinTransports=default",
            "rtps/builtin/*HistoryMemoryPolicy=preallocated_with_realloc",
            "rtps/builtin/*HistoryMemoryPolicy=dynamic*",
            "rtps/builtin/use_WriterLivelinessProtocol=true",
            "rtps/builtin/discovery_config/discoveryProtocol=simple",
            "rtps/builtin/discovery_config/ignoreParticipantFlags=no_filter",
            "rtps/builtin/discovery_config/EDP=simple",
            "rtps/builtin/discovery_config/simpleEDP/*=true",
        ),
    },
    may_decide={
        **_may(
            "match",
            "rtps/builtin/discovery_config/discoveryProtocol=none",
            "rtps/builtin/discovery_config/ignoreParticipantFlags",
            "rtps/builtin/discovery_config/EDP",
            "rtps/builtin/discovery_config/simpleEDP",
            "rtps/builtin/discovery_config/static_edp_xml_config",
            "rtps/propertiesPolicy/*/*",
        ),
        **_may(
            "discovery",
            "domainId",
            "rtps/allocation",
            "rtps/builtin/discovery_config/discoveryProtocol",
            "rtps/builtin/discovery_config/discoveryServersList",
            "rtps/builtin/initialPeersList",
            "rtps/builtin/*HistoryMemoryPolicy",
            "rtps/builtinTransports",
            "rtps/easy_mode_ip",
            "rtps/participantID",
            "rtps/port",
            "rtps/prefix",
            "rtps/useBuiltinTransports",
            "rtps/userTransports",
        ),
        **_may("delivery", "rtps/builtin/use_WriterLivelinessProtocol"),
    },
)
"""Below ``participant`` in profiles of Fast DDS. The domain counts only where a program creates a participant from the profile alone."""

FAST_SECTIONS: Final = ElementTable(
    cannot_matter={
        **_each(_ADDRESSES, "transport_descriptors"),
        **_each(_TOOLS, "log", "types"),
        **_each(_SENDING, "library_settings"),
        **_each(_THREADS, "domainparticipant_factory/qos/*_thread", "domainparticipant_factory/qos/*_threads"),
        **_each(_DEFAULT, "domainparticipant_factory/qos/entity_factory/autoenable_created_entities=true"),
    },
    may_decide={
        **_may("match", "domainparticipant_factory"),
        **_may("delivery", "topic", "requester", "replier"),
    },
)
"""Sections beside the profiles of participants, writers and readers. A program may create its endpoints with the QoS of a topic."""

CYCLONE: Final = ElementTable(
    any_case=True,
    cannot_matter={
        **_each("read as the domain, and as the lease of participants", "id", "discovery/leaseduration"),
        **_each(_NAMES, "general/entityautonaming"),
        **_each(_THREADS, "threads", "internal/livelinessmonitoring"),
        **_each(_TOOLS, "tracing", "internal/controltopic", "internal/measurehbtoacklatency", "internal/monitorport"),
        **_each(
            _TOOLS,
            "internal/enableexpensivechecks",
            "discovery/enabletopicdiscoveryendpoints",
            "discovery/dsgraceperiod",
        ),
        **_each(
            _ADDRESSES,
            "compatibility/manysocketsmode",
            "discovery/defaultmulticastaddress",
            "general/addrsetcosts",
            "general/dontroute",
            "general/external*",
            "general/interfaces",
            "general/multicast*",
            "general/networkinterfaceaddress",
            "general/redundantnetworking",
            "sharedmemory",
        ),
        **_each(
            _SENDING,
            "discovery/*prunedelay",
            "discovery/spdpinterval",
            "general/fragmentsize",
            "general/max*messagesize",
            "internal/*ackdelay",
            "internal/*nackdelay",
            "internal/*rexmit*",
            "internal/*retransmit*",
            "internal/burstsize",
            "internal/defragreliablemaxsamples",
            "internal/deliveryqueuemaxsamples",
            "internal/extendedpacketinfo",
            "internal/generatekeyhash",
            "internal/heartbeatinterval",
            "internal/lateackmode",
            "internal/spdpresponsemaxdelay",
            "internal/*reordermaxsamples",
            "internal/synchronousdelivery*",
            "internal/usemulticastifmreqn",
            "internal/minimumsocket*",
        ),
        **_each(_MEMORY, "sizing", "internal/socket*buffersize", "internal/multiplereceivethreads"),
        **_each(_BEST_EFFORT, "internal/defragunreliablemaxsamples", "internal/retryonrejectbesteffort"),
        **_each("no guarantee holds over the end of a writer", "internal/writerlingerduration"),
        **_each(_WITHOUT, "ssl/*", "tcp/*"),
        **_each(
            _DEFAULT,
            "compatibility/*=false",
            "compatibility/standardsconformance=lax",
            "discovery/externaldomainid=default",
            "discovery/participantindex=default",
            "discovery/participantindex=auto",
            "discovery/peers=",
            "discovery/ports=",
            "general/allowmulticast=true",
            "general/allowmulticast=default",
            "general/enablemulticastloopback=true",
            "general/transport=default",
            "general/transport=udp",
            "general/useipv6=false",
            "general/useipv6=default",
            "internal/builtinendpointset=writers",
            "internal/maxparticipants=0",
            "internal/squashparticipants=false",
            "internal/test=",
            "internal/watermarks=",
            "partitioning/ignoredpartitions=",
            "partitioning/networkpartitions=",
            "partitioning/partitionmappings=",
            "ssl/enable=false",
            "tcp/enable=false",
            "tcp/enable=default",
        ),
    },
    may_decide={
        **_may(
            "match",
            "compatibility/a*",
            "compatibility/e*",
            "compatibility/i*",
            "compatibility/p*",
            "compatibility/s*",
            "discovery/externaldomainid",
            "discovery/tag",
            "internal/builtinendpointset",
            "internal/squashparticipants",
            "partitioning/ignoredpartitions",
            "security",
        ),
        **_may(
            "discovery",
            "discovery/maxautoparticipantindex",
            "discovery/participantindex",
            "discovery/peers",
            "discovery/ports",
            "discovery/spdpmulticastaddress",
            "general/allowmulticast",
            "general/enablemulticastloopback",
            "general/transport",
            "general/useipv6",
            "internal/maxparticipants",
            "partitioning/networkpartitions",
            "partitioning/partitionmappings",
            "ssl/enable",
            "tcp/enable",
        ),
        **_may(
            "delivery",
            "internal/maxsamplesize",
            "internal/rediscoveryblacklistduration",
            "internal/test",
            "internal/watermarks",
        ),
    },
)
"""Below a domain in ``cyclonedds.xml``."""


OPENDDS: Final = ElementTable(
    cannot_matter={
        **_each("read as the lease of participants", "rtps_discovery/LeaseDuration"),
        **_each(
            _TOOLS,
            "common/*Debug*",
            "common/*Log*",
            "common/DCPSMonitor",
            "common/DCPSBit*",
            "common/bit_*",
            "common/DCPSThreadStatusInterval",
            "common/DCPSTypeObjectEncoding",
        ),
        **_each(
            _MEMORY, "common/DCPSChunk*", "common/pool_*", "rtps_discovery/*Preallocated*", "rtps_discovery/*BufferSize"
        ),
        **_each(_THREADS, "common/DCPSEventDispatcherThreads", "common/Scheduler", "common/scheduler_slice"),
        **_each(
            _ADDRESSES,
            "common/DCPSDefaultAddress",
            "common/DCPSBidirGIOP",
            "config/*",
            "ice/*",
            "transport/*",
            "transport_template/*",
            "Customization/*",
            "rtps_discovery/*LocalAddress",
            "rtps_discovery/*MulticastInterface",
            "rtps_discovery/GuidInterface",
            "rtps_discovery/TTL",
            "rtps_discovery/*StunServerAddress",
            "rtps_discovery/UseIce",
        ),
        **_each(
            _SENDING,
            "common/DCPSPendingTimeout",
            "common/DCPSLivelinessFactor",
            "common/DCPSPublisherContentFilter",
            "rtps_discovery/*Resend*",
            "rtps_discovery/*Delay",
            "rtps_discovery/*Period",
            "rtps_discovery/SedpMaxMessageSize",
            "rtps_discovery/MaxSpdpSequenceMsgResetChecks",
            "rtps_discovery/*ResponsiveMode",
            "rtps_discovery/SedpPassiveConnectDuration",
            "rtps_discovery/*DirectedSpdp",
            "rtps_discovery/UseRtpsDurationFraction",
            "rtps_discovery/MinimumCleanupSeparation",
            "rtps_discovery/TypeLookupServiceReplyTimeout",
        ),
        **_each("the store of a durability service; state `durability_service_runs`", "common/DCPSPersistentDataDir"),
        **_each(_WITHOUT, "rtps_discovery/MaxAuthTime", "rtps_discovery/*Auth*", "rtps_discovery/Secur*"),
        **_each(
            _WITHOUT, "topic/*", "datawriterqos/*", "datareaderqos/*", "publisherqos/*", "subscriberqos/*", "endpoint/*"
        ),
        **_each(
            _DEFAULT,
            "common/DCPSSecurity=0",
            "common/DCPSSecurityFakeEncryption=0",
            "rtps_discovery/*UserTag*=0",
            "common/DCPSGlobalTransportConfig=$file",
            "rtps_discovery/UseXTypes=no",
            "common/DCPSDefaultDiscovery=default_rtps",
        ),
    },
    may_decide={
        **_may(
            "match",
            "common/DCPSSecurity",
            "common/DCPSSecurityFakeEncryption",
            "rtps_discovery/*UserTag*",
            "rtps_discovery/UseXTypes",
        ),
        **_may(
            "discovery",
            "common/DCPSDefaultDiscovery",
            "common/DCPSGlobalTransportConfig",
            "common/DCPSInfoRepo",
            "DomainRange/*",
            "domain/*",
            "repository/*",
            "rtps_discovery/*MulticastAddress",
            "rtps_discovery/*MulticastGroup",
            "rtps_discovery/*MulticastOverride",
            "rtps_discovery/*Relay*",
            "rtps_discovery/*AdvertisedLocalAddress",
            "rtps_discovery/CheckSourceIp",
            "rtps_discovery/D?",
            "rtps_discovery/P?",
            "rtps_discovery/*PortMode",
            "rtps_discovery/SedpMulticast",
            "rtps_discovery/SpdpRequestRandomPort",
            "rtps_discovery/SpdpSendAddrs",
            "rtps_discovery/UndirectedSpdp",
            "rtps_discovery/LeaseExtension",
            "rtps_discovery/MaxLeaseDuration",
            "rtps_discovery/MaxParticipantsInAuthentication",
        ),
    },
)
"""Sections and keys in configurations of OpenDDS. QoS stands in them for static endpoints only, which are named themselves."""


def leave_unknown(settings: Settings, paths: list[str], place: Place) -> None:
    """Let what elements may decide of a match be unknown, beside what earlier elements have left so."""
    known = settings.get(EXTENSIONS.name)
    earlier = known.text.split(", ") if known is not None and known.unknown else ()
    settings[EXTENSIONS.name] = _unknown([*earlier, *paths], known.place or place if known is not None else place)


def leave_losses_open(settings: Settings, place: Place) -> None:
    """Let guarantees about samples be unknown, unless earlier elements leave the match unknown, too."""
    settings.setdefault(EXTENSIONS.name, Setting(MAY_LOSE, place, derived=True))


def lay_over_participants(
    system: System,
    found: Sequence[Placed],
    implementations: Iterable[str],
    *,
    participant: str = "*",
    kind: str = "element",
) -> list[Part]:
    """Leave unknown what elements of participants may decide; return those that may keep pairs apart, as parts that were not read.

    Args:
        system: where the overlays go.
        found: elements that may decide.
        implementations: those that read the file.
        participant: pattern of the participants.
        kind: what a part of the file is called.
    """
    settings: Settings = {}
    refusing = [(path, place) for path, place, effect in found if effect == "match"]
    if refusing:
        leave_unknown(settings, [path for path, _ in refusing], refusing[0][1])
    for _, place, effect in found:
        if effect == "delivery":
            leave_losses_open(settings, place)
    if settings:
        lay_extensions(system, settings[EXTENSIONS.name], implementations, participant)
    return [Part(kind, path, EFFECTS[effect], place, 0) for path, place, effect in found if effect != "delivery"]


def lay_extensions(system: System, setting: Setting, implementations: Iterable[str], participant: str) -> None:
    """Lay what the QoS of participants leaves open over their endpoints."""
    for implementation in implementations:
        system.overlays.append(
            Overlay(
                "QoS of participants",
                {EXTENSIONS.name: setting},
                participant=participant,
                protocol="dds",
                when=("implementation", implementation),
                fills=("default", MAY_LOSE),  # what the QoS of endpoints leaves open, but not what a person states
                place=setting.place,
            )
        )


def _unknown(paths: Iterable[str], place: Place) -> Setting:
    """Return the setting of elements that may decide a match."""
    named = [*dict.fromkeys(paths)]
    *others, last = (f"`{path}`" for path in named)
    listed = f"{', '.join(others)} and {last}" if others else last
    does = "they do" if others else "it does"
    cause = f"C-QoS does not model {listed}, which may decide a match; state `extensions: none` where {does} not"
    return Setting(", ".join(named), place, unknown=cause)
