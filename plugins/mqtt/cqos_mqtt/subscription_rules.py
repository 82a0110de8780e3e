"""The rules of MQTT about filters and options of subscriptions, and who meets whom (MQTT6xx)."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    all_equal,
    any_of,
    as_condition,
    call,
    count,
    forbids,
    matched_if,
    offered,
    participant,
    publisher,
    requested,
    requires,
    subscriber,
    topic,
)
from cqos_mqtt.conditions import in_3_1_1
from cqos_mqtt.connection_policies import DOTTED, SESSION
from cqos_mqtt.endpoint_policies import (
    CONTROLLED,
    FILTER_AT_BROKER,
    MAY_PUBLISH,
    NEEDS_RETAIN_FLAG,
    NO_LOCAL,
    OVERLAPPING,
    QOS,
    READABLE,
    REPEATED,
    RESERVED,
    RETAIN_AS_PUBLISHED,
    RETAIN_HANDLING,
    SHARED,
    SUBSCRIPTION_ID,
    TOPIC_AT_BROKER,
    UNREADABLE,
)
from cqos_mqtt.policies import BROKER, TOPIC_NAME

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
    matched_if(
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
    forbids(
        as_condition(participant(DOTTED)),
        code="MQTT624",
        name="dot-becomes-slash",
        says="the client of {endpoint} has a dot or a star in a topic, and the broker changes it",
        because="the broker takes a dot for a slash and a star for a plus sign, so the topic arrives under another name and meets filters that "
        "MQTT does not match with it",
        clause="RabbitMQ, MQTT plugin, topic level separator; RabbitMQ 3.10.8, by running it",
        severity="warning",
        help="name topics without `.` and `*`",
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
    matched_if(
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
    matched_if(
        (requested(FILTER_AT_BROKER) == "")
        | (offered(TOPIC_AT_BROKER) == "")
        | call("filter_matches", requested(FILTER_AT_BROKER), offered(TOPIC_AT_BROKER)),
        code="MQTT625",
        name="dots-make-levels",
        because="the broker takes a dot for a slash and a star for a plus sign, and the filter does not match the topic that comes of it",
        clause="RabbitMQ, MQTT plugin, topic level separator; RabbitMQ 3.10.8, by running it",
    ),
    matched_if(
        publisher(BROKER) == subscriber(BROKER),
        code="MQTT620",
        name="different-brokers",
        because="they are connected to different brokers",
        clause="MQTT 3.1.1, 1.2; MQTT 5.0, 1.2",
    ),
)
