"""What samples cost: headers of RTPS as implementations write them, and what endpoints keep.

The headers are those of DDSI-RTPS 2.5, 9.4, below IPv4 and UDP. How an implementation divides samples was measured on it.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Costs, Framing, Store, offered, requested
from cqos_dds.guarantee_terms import SERVICE_KEEPS_ALL
from cqos_dds.implementations import CYCLONE_DDS, publisher_is
from cqos_dds.kept_policies import DEPTH, HISTORY, MAX_INSTANCES, MAX_SAMPLES, SERVICE_DEPTH
from cqos_dds.policies import KEYED, TIME_BASED_FILTER
from cqos_dds.requested_policies import DURABILITY, RELIABILITY

_IP, _UDP, _RTPS = 20, 8, 20
_INFO_TS, _DATA, _DATA_FRAG, _ENCAPSULATION = 12, 24, 36, 4
_HEARTBEAT, _HEARTBEAT_FRAG = 32, 28
_MAX_MESSAGE: Final = 14_720
_PART: Final = 14_080  # measured: between 14,002 and 14,151

CYCLONE: Final = Framing(
    "cyclonedds",
    packet=_IP + _UDP + _RTPS,
    sample=_INFO_TS + _ENCAPSULATION,
    whole=_DATA,
    fragment=_DATA_FRAG,
    undivided=_MAX_MESSAGE - _RTPS - _INFO_TS - _DATA,
    part=_PART,
    encapsulation=_ENCAPSULATION,
    confirmed=(offered(RELIABILITY) == "reliable") & (requested(RELIABILITY) == "reliable"),
    last=_HEARTBEAT,
    other=_HEARTBEAT_FRAG,
    source="DDSI-RTPS 2.5, 9.4; Cyclone DDS 11.0.1, MaxMessageSize 14720 B, measured by tests/conformance/budgets.py",
)

# Debian builds Fast DDS as its CMake files do it by default, with the statistics module, which adds a submessage to each packet. A packet
# begins with INFO_DST. A reader sends ACKNACK 5 ms after a HEARTBEAT at the earliest.
_INFO_DST, _STATISTICS, _ACKNACK = 16, 60, 28
_FAST_PACKET: Final = _IP + _UDP + _RTPS + _INFO_DST + _STATISTICS
_FAST_PART: Final = 65_324
FAST: Final = Framing(
    "fastdds_2_9",
    packet=_FAST_PACKET + _INFO_TS,
    sample=_ENCAPSULATION,
    whole=_DATA,
    fragment=_DATA_FRAG,
    undivided=_FAST_PART,
    part=_FAST_PART,
    encapsulation=_ENCAPSULATION,
    confirmed=CYCLONE.confirmed,
    last=_HEARTBEAT,
    other=_HEARTBEAT,
    source="DDSI-RTPS 2.5, 9.4; Fast DDS 2.9.1 of Debian 12 over UDPv4, measured by tests/conformance/budgets.py",
    evenly=False,
    answer=_FAST_PACKET + _ACKNACK,
    answers=200,
)

# Writers of Cyclone DDS keep for late joiners what the durability service says, and its limits do not bind them.
SERVED: Final = publisher_is(*CYCLONE_DDS) & (offered(DURABILITY) == "transient_local")
COSTS: Final = Costs(
    KEYED,
    MAX_INSTANCES,
    (CYCLONE, FAST),
    (
        Store(SERVED & SERVICE_KEEPS_ALL, None),
        Store(
            SERVED & (offered(HISTORY) == "keep_last") & (offered(SERVICE_DEPTH) > offered(DEPTH)),
            SERVICE_DEPTH,
            each_instance=True,
        ),
        Store(offered(HISTORY) == "keep_last", DEPTH, each_instance=True),
        Store(offered(HISTORY) == "keep_all", MAX_SAMPLES),
    ),
    thinned=requested(TIME_BASED_FILTER) > "0s",
)
