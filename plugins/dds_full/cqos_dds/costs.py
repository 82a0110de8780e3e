"""What samples cost: headers of RTPS as implementations write them, and what endpoints keep.

The headers are those of DDSI-RTPS 2.5, 9.4, below IPv4 and UDP. How an implementation divides samples was measured on it.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Costs, Framing, Store, offered, requested
from cqos_dds.guarantee_terms import SERVICE_KEEPS_ALL
from cqos_dds.implementations import publisher_is
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

# Writers of Cyclone DDS keep for late joiners what the durability service says, and its limits do not bind them.
SERVED: Final = publisher_is("cyclonedds") & (offered(DURABILITY) == "transient_local")
COSTS: Final = Costs(
    KEYED,
    MAX_INSTANCES,
    (CYCLONE,),
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
