"""The rules of MQTT about sessions (MQTT4xx) and the Will (MQTT5xx)."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    WORDS,
    as_condition,
    broker,
    count,
    define,
    forbids,
    offered,
    participant,
    publisher,
    requested,
    stated,
)
from cqos_mqtt.broker_policies import EXPIRY_DELAY
from cqos_mqtt.conditions import IMPLIED, in_3_1_1, keeps_session
from cqos_mqtt.connection_policies import (
    ALIASES,
    CLEAN,
    CLIENT_ID,
    GENERATED_ID,
    PACKET_SIZE,
    RECEIVE_MAXIMUM,
    SAME_ID,
    SESSION_EXPIRY,
    WILL_DELAY,
    WILL_PAYLOAD,
    WILL_TOPIC,
)
from cqos_mqtt.endpoint_policies import (
    CLOSING,
    EXPIRY,
    IS_WILL,
    QOS,
    RETAIN,
    TOPIC_ALIAS,
)
from cqos_mqtt.policies import VERSION

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
        (requested(MAX_AGE) < "infinite") & (offered(EXPIRY) + broker(EXPIRY_DELAY) <= requested(MAX_AGE)),
        code="MQTT503",
        name="age-counted-in-broker-only",
        says="{subscriber} needs max_age {requested need.max_age}, and the expiry of {publisher} counts the time in the broker only",
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
        because="after the loss of the client, a later subscriber still receives the retained message from before",
        clause="MQTT 3.1.1, 3.3.1.3 and MQTT-3.1.2-16; MQTT 5.0, 3.3.1.3 and MQTT-3.1.2-14",
        help="retain the Will as well, so that it takes the place of that message",
    ),
    forbids(
        (count(offered(IS_WILL) & offered(RETAIN) & ~(publisher(WILL_PAYLOAD) == "")) > 0)
        & (count(~offered(IS_WILL) & offered(RETAIN)) < 1)
        & (count(requested(QOS) >= "0") > 0),  # who does not meet a subscriber is judged alone
        code="MQTT517",
        name="will-stays-for-ever",
        says="the Will on `{topic}` is retained, and no retained message there takes its place when the client is back",
        because="after the first loss of the client every later subscriber receives the Will, also while the client is there",
        clause="MQTT 3.1.1, 3.1.2.5 and 3.3.1.3; MQTT 5.0, 3.1.2.5 and 3.3.1.3",
        help="publish a retained message on the topic of the Will after each connect, such as `online`",
    ),
)
