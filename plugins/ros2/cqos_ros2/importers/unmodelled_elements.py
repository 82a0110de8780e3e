"""Elements of participants in XML files of Fast DDS and Cyclone DDS, sorted by what they can decide.

The pack of DDS has the same tables; a law holds them together. An element that neither names may prevent a match.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.settings import Setting
from cqos_core.model.system import Overlay, Part
from cqos_core.packs.xml_importer import EFFECTS, Effect, ElementTable
from cqos_ros2.policies import PARTITION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.settings import Place
    from cqos_core.model.system import System

_NAMES: Final = "names that tools show"
_MEMORY: Final = "memory that is allocated beforehand, and room for what is remembered of peers"
_THREADS: Final = "threads and locks"
_ADDRESSES: Final = "addresses; whether the network connects participants is not checked"
_SENDING: Final = "when samples and announcements are sent and repaired"
_DEFAULT: Final = "the default, stated"
_TOOLS: Final = "for tools and services beside the pair"
_IGNORED: Final = "what the implementation announces or reads, and compares with nothing"
_BEST_EFFORT: Final = "what is lost of best-effort samples, of which nothing is promised"
_WITHOUT: Final = "nothing where the element that switches it on is not there, which is listed itself"


def _each(reason: str, *patterns: str) -> dict[str, str]:
    return dict.fromkeys(patterns, reason)


def _may(effect: Effect, *patterns: str) -> dict[str, Effect]:
    return dict.fromkeys(patterns, effect)


FAST_PARTICIPANT: Final = ElementTable(
    cannot_matter={
        **_each(_NAMES, "rtps/name"),
        **_each("ROS 2 states the domain itself", "domainId"),
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
"""Below ``participant`` in profiles of Fast DDS."""

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


def lay_over_nodes(system: System, found: Sequence[tuple[str, Place, Effect]], rmw: str) -> list[Part]:
    """Leave unknown whether nodes match where elements may decide it; return all that may decide as parts that are not read."""
    refusing = [(path, place) for path, place, effect in found if effect == "match"]
    for path, place in refusing[:1]:
        cause = f"`{path}` may prevent a match and is not judged"
        settings = {PARTITION.name: Setting("", place, unknown=cause)}
        system.overlays.append(
            Overlay("QoS of participants", settings, protocol="ros2", when=("rmw", rmw), place=place)
        )
    return [Part("element", path, EFFECTS[effect], place, 0) for path, place, effect in found]
