"""What messages cost: the bytes of MQTT around a payload, to the broker and from it.

The fixed header has one byte and a length of up to four; the variable header begins with the name of the topic. `further` is PUBREL,
which a sender of QoS 2 sends with each message. What receivers confirm goes the other way, and is left out.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Costs, MessageFraming, offered, publisher, requested, stated, subscriber
from cqos_mqtt.endpoint_policies import EXPIRY, QOS, SUBSCRIPTION_ID, TOPIC_ALIAS
from cqos_mqtt.policies import VERSION
from cqos_mqtt.rules import EFFECTIVE

_SOURCE: Final = (
    "MQTT 3.1.1, 2.2, 3.3 and 3.6; MQTT 5.0, 2.1, 2.2.2, 3.3 and 3.6; Mosquitto 2.0, measured by tests/conformance"
)
_ONE_BYTE: Final = 127  # a larger number takes a second one
_FIXED, _NAME, _PACKET_ID, _PROPERTIES, _EXPIRY, _ALIAS, _SUBSCRIPTION, _PUBREL = 1, 2, 2, 1, 5, 3, 2, 4
_EXPIRES: Final = offered(EXPIRY) < "infinite"
_FROM_5: Final = publisher(VERSION) == "5.0"
_TO_5: Final = subscriber(VERSION) == "5.0"

COSTS: Final = Costs(
    to_broker=MessageFraming(
        _FIXED,
        _NAME,
        fields=(
            (offered(QOS) >= "1", _PACKET_ID),
            (_FROM_5, _PROPERTIES),
            (_FROM_5 & _EXPIRES, _EXPIRY),
            (_FROM_5 & stated(offered(TOPIC_ALIAS)), _ALIAS),
        ),
        further=((offered(QOS) == "2", _PUBREL),),
        source=_SOURCE,
    ),
    from_broker=MessageFraming(
        _FIXED,
        _NAME,
        fields=(
            (EFFECTIVE >= "1", _PACKET_ID),
            (_TO_5, _PROPERTIES),
            (_TO_5 & _FROM_5 & _EXPIRES, _EXPIRY),
            (_TO_5 & (requested(SUBSCRIPTION_ID) != "none"), _SUBSCRIPTION),
            (_TO_5 & (requested(SUBSCRIPTION_ID) != "none") & (requested(SUBSCRIPTION_ID) > _ONE_BYTE), 1),
        ),
        further=((EFFECTIVE == "2", _PUBREL),),
        source=_SOURCE,
    ),
)
