"""The rules of MQTT without requirements, one condition each; `guarantees` has those with requirements.

`requires` reports when its condition is false, `forbids` only when it is certainly true. If a `matched_if` condition is false, two
endpoints do not match. A bare policy is that of the endpoint itself, `offered` that of the publication, `requested` that of the
subscription. `publisher`, `subscriber` and `participant` are their connections, and `broker` is between them.

A stated QoS is no requirement, so its loss is a note: the option `implied_needs` makes it a warning, or disables it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.packs import (
    WORDS,
    as_condition,
    broker,
    define,
    forbids,
    greatest,
    least,
    offered,
    participant,
    publisher,
    requested,
    requires,
    stated,
    subscriber,
    topic,
)
from cqos_mqtt.broker_policies import (
    BROKER_ALIASES,
    BROKER_PACKET_SIZE,
    GRANTED_QOS,
    GROWS,
    IDENTIFIER_AVAILABLE,
    IMPLEMENTATION,
    INFLIGHT,
    MAXIMUM_QOS,
    NEWEST,
    OLDEST,
    QUEUED,
    QUEUED_BYTES,
    RETAIN_AVAILABLE,
    SERVER_KEEP_ALIVE,
    SHARED_AVAILABLE,
    UPGRADES,
    WILDCARD_AVAILABLE,
)
from cqos_mqtt.conditions import IMPLIED, in_3_1_1, keeps_session
from cqos_mqtt.connection_policies import (
    KEEP_ALIVE,
    PACKET_SIZE,
    RECEIVE_MAXIMUM,
)
from cqos_mqtt.endpoint_policies import (
    BURST_BYTES,
    BURSTS,
    ENVELOPE,
    ENVELOPE_TO_BROKER,
    IS_WILL,
    MIXED_QOS,
    PAYLOAD,
    PROPERTIES,
    QOS,
    RETAIN,
    RETAIN_HANDLING,
    SHARED,
    SUBSCRIPTION_ID,
    TOPIC_ALIAS,
    WILDCARDS,
)
from cqos_mqtt.policies import COMMAND, SIZE, VERSION
from cqos_mqtt.session_rules import SESSIONS, WILL
from cqos_mqtt.subscription_rules import FILTERS

if TYPE_CHECKING:
    from cqos_core.packs import Condition, Operand

# The core of MQTT: what a subscription is granted, and with which guarantee a message arrives.
GRANTED: Final = define("granted", least(requested(QOS), broker(MAXIMUM_QOS), broker(GRANTED_QOS)))
EFFECTIVE: Final = define("effective", least(GRANTED, greatest(offered(QOS), broker(UPGRADES))))

# MQTT1xx: with which QoS messages arrive ---------------------------------------------------------------------

DELIVERY: Final = (
    forbids(
        stated(requested(QOS)) & (EFFECTIVE < GRANTED),
        code="MQTT103",
        name="publisher-limits",
        because="a message arrives with the lower QoS of the two, and the subscription's is only a maximum",
        clause="MQTT 3.1.1, MQTT-3.8.4-6; MQTT 5.0, MQTT-3.8.4-8",
        fixes=("qos",),
        severity=IMPLIED,
        aliases=("MQTT153", "publisher-limits-warned"),
    ),
    forbids(
        stated(offered(QOS)) & (offered(QOS) == "2") & (GRANTED < "2"),
        code="MQTT104",
        name="subscriber-downgrades",
        because="what is published exactly once arrives with the lower QoS that the subscription is granted",
        clause="MQTT 3.1.1, MQTT-3.8.4-6; MQTT 5.0, MQTT-3.8.4-8",
        severity=IMPLIED,
        aliases=("MQTT154", "subscriber-downgrades-warned"),
    ),
    forbids(
        stated(offered(QOS)) & (offered(QOS) == "1") & (GRANTED == "0"),
        code="MQTT105",
        name="worst-pair",
        because="messages may come twice on the way to the broker and be lost on the way from it",
        clause="MQTT 3.1.1, 3.8.4; MQTT 5.0, 3.8.4",
        severity=IMPLIED,
        aliases=("MQTT155", "worst-pair-warned"),
    ),
    forbids(
        stated(requested(QOS)) & (requested(QOS) > broker(GRANTED_QOS)),
        code="MQTT106",
        name="granted-below-request",
        says="{endpoint} asks for QoS {qos}, and the broker grants at most {granted_qos}",
        because="the broker grants less than is asked for, and who does not look at its answer never knows",
        clause="MQTT 3.1.1, MQTT-3.8.4-5; MQTT 5.0, MQTT-3.8.4-7",
    ),
    forbids(
        (broker(UPGRADES) > offered(QOS)) & (offered(QOS) < GRANTED),
        code="MQTT107",
        name="upgrading-broker",
        because="the broker delivers with a higher QoS than the message had on the way to it, where it may have been lost",
        clause="MQTT 3.1.1, MQTT-3.8.4-6; MQTT 5.0, MQTT-3.8.4-8",
        fixes=("qos",),
    ),
)

# MQTT2xx: what the broker can do -----------------------------------------------------------------------------

REFUSED: Final = "the broker ends the connection, because "

# Packets are counted whole, with fixed header, topic and properties; what else a program may add is not known here.
TO_BROKER: Final = define("to_broker", offered(PAYLOAD) + offered(ENVELOPE_TO_BROKER))
_PACKET_ID: Final = 2
FROM_BROKER: Final = define("from_broker", offered(PAYLOAD) + offered(ENVELOPE) + offered(PROPERTIES))

CAPABILITIES: Final = (
    requires(
        offered(IS_WILL) | (offered(QOS) <= broker(MAXIMUM_QOS)),
        code="MQTT201",
        name="publish-above-maximum-qos",
        says="{endpoint} publishes with QoS {qos}, and the broker takes at most {maximum_qos}",
        because=REFUSED + "it does not take messages of this QoS",
        clause="MQTT 5.0, MQTT-3.2.2-11; reason code 0x9B",
    ),
    forbids(
        in_3_1_1(publisher) & (offered(QOS) > broker(MAXIMUM_QOS)),
        code="MQTT202",
        name="refused-without-reason",
        says="{endpoint} of MQTT 3.1.1 publishes with QoS {qos}, and the broker closes the connection without a reason",
        because="the broker cannot tell a client of 3.1.1 what it takes, so the connection just ends, again and again",
        clause="MQTT 5.0, 3.2.2.3.4",
        severity="note",
    ),
    forbids(
        stated(requested(QOS)) & (requested(QOS) > broker(MAXIMUM_QOS)),
        code="MQTT203",
        name="subscribe-above-maximum-qos",
        says="{endpoint} asks for QoS {qos}, and the broker grants at most {maximum_qos}",
        because="the subscription is accepted, but granted a lower QoS",
        clause="MQTT 5.0, MQTT-3.2.2-9 and MQTT-3.2.2-10",
    ),
    requires(
        ~offered(IS_WILL) | (offered(QOS) <= broker(MAXIMUM_QOS)),
        code="MQTT204",
        name="will-above-maximum-qos",
        says="{endpoint} has QoS {qos}, and the broker takes at most {maximum_qos}",
        because="the broker refuses the connection, because it does not take a Will of this QoS",
        clause="MQTT 5.0, MQTT-3.2.2-12; reason code 0x9B",
    ),
    requires(
        offered(IS_WILL) | ~offered(RETAIN) | broker(RETAIN_AVAILABLE),
        code="MQTT205",
        name="retain-unavailable",
        says="{endpoint} retains its messages, and the broker retains none",
        because=REFUSED + "it keeps no retained messages",
        clause="MQTT 5.0, MQTT-3.2.2-14; reason code 0x9A",
    ),
    requires(
        ~offered(IS_WILL) | ~offered(RETAIN) | broker(RETAIN_AVAILABLE),
        code="MQTT206",
        name="will-retain-unavailable",
        says="{endpoint} is retained, and the broker retains nothing",
        because="the broker refuses the connection, because it keeps no retained messages",
        clause="MQTT 5.0, MQTT-3.2.2-13; reason code 0x9A",
    ),
    requires(
        ~requested(WILDCARDS) | broker(WILDCARD_AVAILABLE),
        code="MQTT207",
        name="wildcard-unavailable",
        says="{endpoint} has a filter with wildcards, and the broker takes none",
        because="the broker refuses the subscription",
        clause="MQTT 3.1.1, MQTT-3.8.3-2; MQTT 5.0, 3.2.2.3.11; reason code 0xA2",
        help="subscribe to the topics by name",
    ),
    requires(
        ~requested(SHARED) | broker(SHARED_AVAILABLE),
        code="MQTT208",
        name="shared-unavailable",
        says="{endpoint} is a shared subscription, and the broker takes none",
        because="the broker refuses the subscription",
        clause="MQTT 5.0, 3.2.2.3.13; reason code 0x9E",
        help="subscribe without `$share`, or use a broker that has shared subscriptions",
    ),
    requires(
        (requested(SUBSCRIPTION_ID) == "none") | broker(IDENTIFIER_AVAILABLE),
        code="MQTT213",
        name="subscription-identifier-unavailable",
        says="{endpoint} has subscription identifier {subscription_identifier}, and the broker takes none",
        because=REFUSED + "it does not support subscription identifiers",
        clause="MQTT 5.0, 3.2.2.3.12; reason code 0xA1",
        help="subscribe without one, and tell messages apart by their topics",
    ),
    forbids(
        (TO_BROKER > broker(BROKER_PACKET_SIZE))
        | (~in_3_1_1(publisher) & (TO_BROKER + offered(PROPERTIES) > broker(BROKER_PACKET_SIZE))),
        code="MQTT209",
        name="message-too-big-for-broker",
        says="{endpoint} sends up to {max_payload} bytes beside topic and headers, and the broker takes packets of {maximum_packet_size}",
        because=REFUSED + "the packet is larger than it takes",
        clause="MQTT 5.0, MQTT-3.2.2-15; reason code 0x95",
        severity="error",
        fixes=("maximum_packet_size", "max_payload"),
    ),
    requires(
        in_3_1_1(subscriber)
        | (subscriber(PACKET_SIZE) == "unlimited")
        | define(
            "fits_subscriber",
            (FROM_BROKER <= subscriber(PACKET_SIZE))
            & ((EFFECTIVE == "0") | (FROM_BROKER + _PACKET_ID <= subscriber(PACKET_SIZE))),
        ),
        code="MQTT210",
        name="message-too-big-for-subscriber",
        because="the broker drops what is larger than the subscriber takes, continues as if it had been sent, and reports it to neither side",
        clause="MQTT 5.0, MQTT-3.1.2-24 and MQTT-3.1.2-25",
        fixes=("max_payload", "maximum_packet_size"),
    ),
    forbids(
        (offered(TOPIC_ALIAS) == 0) | (offered(TOPIC_ALIAS) > broker(BROKER_ALIASES)),
        code="MQTT211",
        name="alias-above-maximum",
        says="{endpoint} uses topic alias {topic_alias}, which is none that the broker understands",
        because=REFUSED + "it does not understand the topic alias",
        clause="MQTT 5.0, MQTT-3.3.2-8, MQTT-3.3.2-9 and MQTT-3.3.2-11",
        severity="error",
        fixes=("topic_alias_maximum", "topic_alias"),
    ),
    forbids(
        (participant(VERSION) > broker(NEWEST)) | (participant(VERSION) < broker(OLDEST)),
        code="MQTT212",
        name="version-unsupported",
        because="the broker refuses the connection, because it does not speak the version",
        clause="MQTT 3.1.1, MQTT-3.1.2-2; MQTT 5.0, MQTT-3.1.2-2",
        severity="error",
    ),
    forbids(
        in_3_1_1(participant)
        & (broker(IMPLEMENTATION) == "mosquitto")
        & (broker(SERVER_KEEP_ALIVE) > "0s")
        & (participant(KEEP_ALIVE) > broker(SERVER_KEEP_ALIVE)),
        code="MQTT214",
        name="keep-alive-above-limit",
        says="{endpoint} speaks MQTT 3.1.1 with keep alive {keep_alive}, and the broker allows at most {server_keep_alive}",
        because="the broker cannot tell a client of 3.1.1 another keep alive: Mosquitto refuses the connection since 2.0.12",
        clause="Mosquitto, ChangeLog of 2.0.12, and mosquitto.conf(5), max_keepalive",
        help="let the client ping at least so often, or raise the limit of the broker",
    ),
)

# MQTT3xx: retained messages ----------------------------------------------------------------------------------

# A payload whose size nothing states is not taken for an empty one.
IS_EMPTY: Final = define("is_empty", stated(offered(PAYLOAD), "0") | stated(topic(SIZE), "0"))

RETAINED: Final = (
    forbids(
        (requested(RETAIN_HANDLING) == "send_if_new") & keeps_session(subscriber),
        code="MQTT303",
        name="retained-not-repeated",
        because="a client that comes back to its session and subscribes again is not sent the retained message again",
        clause="MQTT 5.0, MQTT-3.3.1-10",
        severity="note",
        fixes=("retain_handling",),
    ),
    forbids(
        offered(RETAIN) & (offered(QOS) == "0") & stated(offered(RETAIN)),
        code="MQTT305",
        name="retained-qos-0-optional",
        because="the broker may drop a retained message of QoS 0 at any time",
        clause="MQTT 3.1.1, MQTT-3.3.1-7; MQTT 5.0, 3.3.1.3",
        fixes=("qos",),
        severity=IMPLIED,
        aliases=("MQTT355", "retained-qos-0-optional-warned"),
    ),
    forbids(
        offered(RETAIN) & IS_EMPTY,
        code="MQTT309",
        name="empty-retained",
        says="{endpoint} retains messages without payload",
        because="an empty retained message deletes the stored one and is itself not stored",
        clause="MQTT 3.1.1, MQTT-3.3.1-10 and MQTT-3.3.1-11; MQTT 5.0, MQTT-3.3.1-6 and MQTT-3.3.1-7",
    ),
    forbids(
        offered(RETAIN) & topic(COMMAND),
        code="MQTT310",
        name="retained-command",
        says="{endpoint} retains orders on `{topic}`: a later subscriber carries out the last one again",
        because="a retained order is carried out again by everybody who subscribes or comes back later",
        clause="C-QoS, practice",
    ),
)

# MQTT7xx: flow and order -------------------------------------------------------------------------------------

SMALL_WINDOW: Final = 10

WINDOW: Final = define("window", least(subscriber(RECEIVE_MAXIMUM), broker(INFLIGHT)))
ROOM: Final = define("room", WINDOW + broker(QUEUED))


def has_room(messages: Operand) -> Condition:
    """So many messages have room for a connected client: on their way, and in a queue that may grow by as many."""
    return (messages <= ROOM) | (as_condition(broker(GROWS)) & (messages <= define("larger_room", ROOM + WINDOW)))


FLOW: Final = (
    forbids(
        (requested(QOS) >= "1") & (subscriber(RECEIVE_MAXIMUM) < SMALL_WINDOW),
        code="MQTT701",
        name="small-receive-maximum",
        because="few messages may be on their way at once, so others wait in the queue of the broker",
        clause="MQTT 5.0, MQTT-3.3.4-7, MQTT-3.3.4-9 and MQTT-4.9.0-2",
        severity=IMPLIED,
        aliases=("MQTT751", "small-receive-maximum-warned"),
    ),
    forbids(
        as_condition(offered(MIXED_QOS)),
        code="MQTT703",
        name="order-across-qos",
        says="{endpoint} is published with several QoS by one client",
        because="messages keep their order within one QoS of a topic, not across several",
        clause="MQTT 3.1.1, MQTT-4.6.0-6; MQTT 5.0, MQTT-4.6.0-5",
        severity=IMPLIED,
        aliases=("MQTT753", "order-across-qos-warned"),
    ),
    forbids(
        ~as_condition(requested(WORDS["loss_free"].need))
        & (EFFECTIVE >= "1")
        & (
            ~has_room(requested(BURSTS))
            | define("burst_over_bytes", (requested(BURSTS) > 0) & (requested(BURST_BYTES) >= broker(QUEUED_BYTES)))
        ),
        code="MQTT704",
        name="queue-overflow",
        says="the topics of {subscriber} and its client may bring {client_burst} messages at once, more than the broker keeps for it",
        because="what comes faster than a connected subscriber takes it is dropped once its queue is full, and the publisher does "
        "not learn of it",
        clause="C-QoS, limits of brokers",
        help="a larger `max_queued_messages`, or fewer messages at once",
    ),
)

RULES: Final = (*DELIVERY, *CAPABILITIES, *RETAINED, *SESSIONS, *WILL, *FILTERS, *FLOW)
