"""The rules of MQTT without requirements, one condition each; `guarantees` has those with requirements.

`requires` reports when its condition is false, `forbids` only when it is certainly true. If a `meets` condition is false, two
endpoints do not match. A bare policy is that of the endpoint itself, `offered` that of the publication, `requested` that of the
subscription. `publisher`, `subscriber` and `participant` are their connections, and `broker` is between them.

A stated QoS is no requirement, so its loss is a note: the option `implied_needs` makes it a warning, or disables it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.packs import (
    WORDS,
    all_equal,
    any_of,
    as_condition,
    broker,
    by_option,
    call,
    count,
    define,
    forbids,
    greatest,
    least,
    meets,
    offered,
    participant,
    publisher,
    requested,
    requires,
    stated,
    subscriber,
    topic,
)
from cqos_mqtt.policies import (
    ALIASES,
    BROKER,
    BROKER_ALIASES,
    BROKER_PACKET_SIZE,
    BURST_BYTES,
    BURSTS,
    CLEAN,
    CLIENT_ID,
    CLOSING,
    COMMAND,
    CONTROLLED,
    ENVELOPE,
    ENVELOPE_TO_BROKER,
    EXPIRY,
    GENERATED_ID,
    GRANTED_QOS,
    IDENTIFIER_AVAILABLE,
    IMPLIED_NEEDS,
    INFLIGHT,
    IS_WILL,
    MAXIMUM_QOS,
    MAY_PUBLISH,
    MIXED_QOS,
    NEEDS_RETAIN_FLAG,
    NEWEST,
    NO_LOCAL,
    OLDEST,
    OVERLAPPING,
    PACED,
    PACKET_SIZE,
    PAYLOAD,
    PROPERTIES,
    QOS,
    QUEUED,
    QUEUED_BYTES,
    READABLE,
    RECEIVE_MAXIMUM,
    REPEATED,
    RESERVED,
    RETAIN,
    RETAIN_AS_PUBLISHED,
    RETAIN_AVAILABLE,
    RETAIN_HANDLING,
    SAME_ID,
    SESSION,
    SESSION_EXPIRY,
    SHARED,
    SHARED_AVAILABLE,
    SUBSCRIPTION_ID,
    TOPIC_ALIAS,
    TOPIC_NAME,
    UNREADABLE,
    UPGRADES,
    VERSION,
    WILDCARD_AVAILABLE,
    WILDCARDS,
    WILL_DELAY,
    WILL_TOPIC,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.packs import Condition, Operand, Term

# The core of MQTT: what a subscription is granted, and with which guarantee a message arrives.
GRANTED: Final = define("granted", least(requested(QOS), broker(MAXIMUM_QOS), broker(GRANTED_QOS)))
EFFECTIVE: Final = define("effective", least(GRANTED, greatest(offered(QOS), broker(UPGRADES))))


def in_3_1_1(side: Callable[[Term], Operand]) -> Condition:
    """The connection speaks the older version."""
    return define(f"{side.__name__}_in_3_1_1", side(VERSION) == "3.1.1")


def keeps_session(side: Callable[[Term], Operand]) -> Condition:
    """The broker keeps the session of this connection while it is away."""
    in_5_0 = (side(VERSION) == "5.0") & (side(SESSION_EXPIRY) > "0s")
    return define(f"{side.__name__}_keeps_session", (in_3_1_1(side) & ~side(CLEAN)) | in_5_0)


# How severe the loss of a QoS is that was stated, and that no stated need asks for.
IMPLIED: Final = by_option(IMPLIED_NEEDS.name, note="note", warning="warning")

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
)

# MQTT3xx: retained messages ----------------------------------------------------------------------------------

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
        offered(RETAIN) & (offered(PAYLOAD) == 0),
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

# MQTT4xx: sessions -------------------------------------------------------------------------------------------

# What a client that states no receive maximum has, and one of 3.1.1 always.
WIDEST_WINDOW: Final = 65_535

SESSIONS: Final = (
    forbids(
        stated(offered(QOS)) & (offered(QOS) >= "1") & ~offered(IS_WILL) & ~keeps_session(publisher),
        code="MQTT404",
        name="publisher-without-session",
        says="{endpoint} publishes with QoS {qos}, but its session ends with the connection",
        because="what is on its way when the connection breaks is not sent again, because the session is gone",
        clause="MQTT 3.1.1, MQTT-4.4.0-1; MQTT 5.0, MQTT-4.4.0-1",
        fixes=("clean_start", "session_expiry_interval"),
        severity=IMPLIED,
        aliases=("MQTT454", "publisher-without-session-warned"),
    ),
    forbids(
        in_3_1_1(participant) & (participant(CLIENT_ID) == "") & ~participant(CLEAN),
        code="MQTT408",
        name="empty-client-id",
        because="the broker refuses an empty client id without clean session, because it could not find the session again",
        clause="MQTT 3.1.1, MQTT-3.1.3-7 and MQTT-3.1.3-8",
        severity="error",
    ),
    forbids(
        keeps_session(participant)
        & (participant(GENERATED_ID) | ((participant(VERSION) == "5.0") & (participant(CLIENT_ID) == ""))),
        code="MQTT409",
        name="generated-client-id",
        because="the session is kept, but never found again, because the client comes back with another id",
        clause="MQTT 5.0, MQTT-3.1.3-6 and MQTT-3.2.2-16",
    ),
    forbids(
        as_condition(participant(SAME_ID)),
        code="MQTT410",
        name="duplicate-client-id",
        because="two clients of one broker have the same id, so each ends the connection of the other",
        clause="MQTT 3.1.1, MQTT-3.1.4-2; MQTT 5.0, MQTT-3.1.4-3",
        severity="error",
    ),
    forbids(
        in_3_1_1(participant)
        & (
            (participant(SESSION_EXPIRY) > "0s")
            | (participant(WILL_DELAY) > "0s")
            | define(
                "states_limits",
                (participant(RECEIVE_MAXIMUM) < WIDEST_WINDOW)
                | (participant(PACKET_SIZE) < "unlimited")
                | (participant(ALIASES) > 0),
            )
        ),
        code="MQTT411",
        name="connection-field-not-in-3-1-1",
        because="MQTT 3.1.1 has no session expiry, no delay of the Will, and no limits that a client tells, so they cannot be sent",
        clause="MQTT 5.0, 3.1.2.11 and 3.1.3.2.2",
        severity="warning",
    ),
    forbids(
        in_3_1_1(publisher) & stated(offered(EXPIRY)) & (offered(EXPIRY) < "infinite"),
        code="MQTT412",
        name="message-expiry-not-in-3-1-1",
        because="MQTT 3.1.1 has no message expiry, so it cannot be sent, and the messages never expire",
        clause="MQTT 5.0, 3.3.2.3.3",
        severity="warning",
    ),
    forbids(
        in_3_1_1(publisher) & stated(offered(TOPIC_ALIAS)),
        code="MQTT413",
        name="topic-alias-not-in-3-1-1",
        says="{endpoint} of MQTT 3.1.1 states topic alias {topic_alias}",
        because="MQTT 3.1.1 has no topic aliases, so it cannot be sent",
        clause="MQTT 5.0, 3.3.2.3.4",
        severity="error",
    ),
)

MAX_AGE: Final = WORDS["max_age"].need

# MQTT5xx: the Will -------------------------------------------------------------------------------------------

WILL: Final = (
    forbids(
        (requested(MAX_AGE) < "infinite") & (offered(EXPIRY) <= requested(MAX_AGE)),
        code="MQTT503",
        name="age-counted-in-broker-only",
        says="{subscriber} needs max_age {requested need.max_age}, and the expiry of {publisher} counts whole seconds in the broker only",
        because="neither the time on the network nor that in the queues of clients counts",
        clause="MQTT 5.0, MQTT-3.3.2-6",
        severity="note",
    ),
    forbids(
        (participant(WILL_TOPIC) != "")
        & (participant(VERSION) == "5.0")
        & (participant(WILL_DELAY) > participant(SESSION_EXPIRY)),
        code="MQTT508",
        name="will-delay-cut",
        because="the Will is published when the session ends, which is before its delay is over",
        clause="MQTT 5.0, MQTT-3.1.2-8 and 3.1.3.2.2",
        severity="note",
    ),
    forbids(
        offered(IS_WILL) & ~offered(CLOSING),
        code="MQTT510",
        name="clean-exit-silent",
        says="{endpoint} is not published when the client ends in good order, and the client itself publishes nothing there",
        because="a client that disconnects in good order discards its Will, so no subscriber learns that it is gone",
        clause="MQTT 3.1.1, MQTT-3.14.4-3; MQTT 5.0, MQTT-3.14.4-3",
        severity=IMPLIED,
        aliases=("MQTT560", "clean-exit-silent-warned"),
    ),
    forbids(
        (count(offered(IS_WILL) & ~offered(RETAIN)) > 0) & (count(~offered(IS_WILL) & offered(RETAIN)) > 0),
        code="MQTT511",
        name="will-leaves-retained-state",
        says="the Will on `{topic}` is not retained, and what is published there is",
        because="once the client is lost, who subscribes later is sent the retained message of when it was still there",
        clause="MQTT 3.1.1, 3.3.1.3 and MQTT-3.1.2-16; MQTT 5.0, 3.3.1.3 and MQTT-3.1.2-14",
        help="retain the Will as well, so that it takes the place of that message",
    ),
)

# MQTT6xx: filters and options of subscriptions, who meets whom -----------------------------------------------

FILTERS: Final = (
    forbids(
        ~call("is_filter", topic(TOPIC_NAME)),
        code="MQTT601",
        name="invalid-filter",
        because="the broker refuses the subscription or ends the connection",
        clause="MQTT 3.1.1, MQTT-4.7.1-2, MQTT-4.7.1-3 and MQTT-4.7.3-1 to 3; MQTT 5.0, MQTT-4.7.1-1, MQTT-4.7.1-2, "
        "MQTT-4.7.3-1 to 3, MQTT-4.8.2-1 and MQTT-4.8.2-2",
        severity="error",
    ),
    forbids(
        ~call("is_topic", topic(TOPIC_NAME)),
        code="MQTT602",
        name="invalid-topic-name",
        because="the broker ends the connection of who publishes there",
        clause="MQTT 3.1.1, MQTT-3.3.2-2 and MQTT-4.7.1-1; MQTT 5.0, MQTT-3.3.2-2 and MQTT-4.7.0-1",
        severity="error",
    ),
    forbids(
        requested(OVERLAPPING) & (offered(QOS) >= "0"),
        code="MQTT605",
        name="overlapping-filters",
        says="{subscriber} and another filter of the same client both match `{topic}`",
        because="several filters of one client match the topic, so each message may come once for each of them",
        clause="MQTT 3.1.1, MQTT-3.3.5-1; MQTT 5.0, MQTT-3.3.4-2",
        severity="note",
        help="one filter that covers both, or one client for each",
    ),
    forbids(
        as_condition(requested(REPEATED)),
        code="MQTT606",
        name="same-filter-replaced",
        says="{endpoint} is stated more than once, with different settings",
        because="a client has one subscription per filter, and the settings that it sends last take the place of the others",
        clause="MQTT 3.1.1, MQTT-3.8.4-3; MQTT 5.0, MQTT-3.8.4-3",
        help="state the filter once",
    ),
    requires(
        ~requested(NO_LOCAL) | ~requested(SHARED),
        code="MQTT607",
        name="no-local-shared",
        says="{endpoint} is shared and has no_local",
        because="the broker ends the connection: No Local on a shared subscription is a protocol error",
        clause="MQTT 5.0, MQTT-3.8.3-4",
    ),
    meets(
        ~requested(NO_LOCAL) | (subscriber(SESSION) == "") | (publisher(SESSION) != subscriber(SESSION)),
        code="MQTT608",
        name="no-local-hides-own",
        because="with No Local a client is not sent what it publishes itself",
        clause="MQTT 5.0, MQTT-3.8.3-3",
    ),
    forbids(
        any_of(requested(SHARED)) & (count(offered(QOS) >= "0") == 0) & ~all_equal(requested(QOS)),
        code="MQTT611",
        name="shared-mixed-qos",
        says="the members of share group `{topic}` ask for different QoS",
        because="with which QoS a message arrives then depends on who of the group gets it",
        clause="MQTT 5.0, MQTT-4.8.2-3",
        help="ask for the same QoS in the whole group",
    ),
    forbids(
        requested(SHARED) & in_3_1_1(subscriber),
        code="MQTT612",
        name="share-in-3-1-1",
        says="{endpoint} is a shared subscription over MQTT 3.1.1",
        because="3.1.1 has no shared subscriptions: some brokers know them all the same, to others it is a filter that matches "
        "nothing",
        clause="MQTT 5.0, 4.8.2",
    ),
    forbids(
        in_3_1_1(subscriber)
        & (
            requested(NO_LOCAL)
            | requested(RETAIN_AS_PUBLISHED)
            | (requested(RETAIN_HANDLING) != "send")
            | (requested(SUBSCRIPTION_ID) != "none")
        ),
        code="MQTT613",
        name="subscription-option-not-in-3-1-1",
        says="{endpoint} of MQTT 3.1.1 states options of subscriptions that only 5.0 has",
        because="MQTT 3.1.1 has no options of subscriptions beside the QoS, so they cannot be sent",
        clause="MQTT 5.0, 3.8.2.1.2 and 3.8.3.1",
        severity="warning",
    ),
    forbids(
        requested(NEEDS_RETAIN_FLAG) & (in_3_1_1(subscriber) | ~requested(RETAIN_AS_PUBLISHED)),
        code="MQTT614",
        name="retain-flag-lost",
        because="messages that are forwarded come without their RETAIN flag, unless the subscription asks for it as published",
        clause="MQTT 3.1.1, MQTT-3.3.1-9; MQTT 5.0, MQTT-3.3.1-12 and MQTT-3.3.1-13",
        fixes=("retain_as_published",),
    ),
    requires(
        ~offered(RESERVED),
        code="MQTT622",
        name="published-to-sys",
        says="{endpoint} publishes below `$SYS/`, where only the broker publishes",
        because="brokers drop or refuse what clients publish there",
        clause="MQTT 3.1.1, 4.7.2; MQTT 5.0, 4.7.2; Mosquitto by running it",
        help="publish to a topic that does not begin with `$SYS/`",
    ),
    meets(
        offered(MAY_PUBLISH)
        & (
            (offered(CONTROLLED) == "")
            | call("may_read", offered(CONTROLLED), requested(READABLE), requested(UNREADABLE))
        ),
        code="MQTT621",
        name="not-allowed",
        because="the access control of the broker does not let the one publish there, or the other read it",
        clause="Mosquitto, mosquitto.conf(5), acl_file",
    ),
    meets(
        publisher(BROKER) == subscriber(BROKER),
        code="MQTT620",
        name="different-brokers",
        because="they are connected to different brokers",
        clause="MQTT 3.1.1, 1.2; MQTT 5.0, 1.2",
    ),
)

# MQTT7xx: flow and order -------------------------------------------------------------------------------------

SMALL_WINDOW: Final = 10

ROOM: Final = define("room", least(subscriber(RECEIVE_MAXIMUM), broker(INFLIGHT)) + broker(QUEUED))

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
        & requested(PACED)
        & (EFFECTIVE >= "1")
        & (
            (requested(BURSTS) > ROOM)
            | define("burst_over_bytes", (requested(BURSTS) > 0) & (requested(BURST_BYTES) >= broker(QUEUED_BYTES)))
        ),
        code="MQTT704",
        name="queue-overflow",
        says="the topics of {subscriber} and its client may bring {client_burst} messages at once, more than the broker keeps for it",
        because="what comes faster than a connected subscriber takes it is dropped once its queue is full, and the publisher is "
        "not told",
        clause="C-QoS, limits of brokers",
        help="a larger `max_queued_messages`, or fewer messages at once",
    ),
)

RULES: Final = (*DELIVERY, *CAPABILITIES, *RETAINED, *SESSIONS, *WILL, *FILTERS, *FLOW)
