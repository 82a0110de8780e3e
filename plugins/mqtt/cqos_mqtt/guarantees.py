"""What a subscription really gets over MQTT, one sentence for each condition; see `cqos_core.guarantee` for the words.

Publication, broker and subscription decide together. A guarantee holds where all its sentences do. They are asked only
where a subscription says by ``needs:`` that its application counts on the guarantee; its QoS alone is no need.
"""

from __future__ import annotations

from typing import Final

from cqos_core.expression import (
    as_sentence,
    broker,
    call,
    ceil,
    least,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_core.guarantee import RELAYED, WORDS, gives
from cqos_mqtt.policies import (
    BROKER_RECEIVE_MAXIMUM,
    BROKER_SESSION_EXPIRY,
    CLEAN,
    EXPIRY,
    INFLIGHT,
    KEEP_ALIVE,
    OVERLAPPING,
    PERIOD,
    PERSISTENCE,
    QOS,
    QUEUED,
    QUEUES_QOS0,
    RECEIVE_MAXIMUM,
    RETAIN,
    RETAIN_HANDLING,
    SENDS_AT_ONCE,
    SERVER_KEEP_ALIVE,
    SESSION_EXPIRY,
    SHARED,
    SUBSCRIBED,
    WILL_DELAY,
    WILL_TOPIC,
)
from cqos_mqtt.rules import EFFECTIVE, GRANTED, in_3_1_1, keeps_session

OFFLINE: Final = requested(WORDS["offline"].need)
LATE_JOIN: Final = requested(WORDS["late_join"].need)
MAX_AGE: Final = requested(WORDS["max_age"].need)
LIVENESS: Final = requested(WORDS["liveness"].need)

GETS_RETAINED: Final = offered(RETAIN) & (requested(RETAIN_HANDLING) != "do_not_send") & ~requested(SHARED)
COMES_BACK: Final = keeps_session(subscriber) & ~subscriber(CLEAN)
# In 3.1.1 a session that is kept has no end of its own, but a broker may put one to it (3.1.2.4).
WAITS_LONG_ENOUGH: Final = (OFFLINE <= broker(BROKER_SESSION_EXPIRY)) & (
    in_3_1_1(subscriber) | (OFFLINE <= subscriber(SESSION_EXPIRY))
)
# A broker replaces the keep alive of 5.0 only: to a client of 3.1.1 it cannot say so, and Mosquitto leaves it; seen by
# running it.
PINGS_EVERY: Final = least(publisher(KEEP_ALIVE), broker(SERVER_KEEP_ALIVE))
PINGS: Final = (publisher(KEEP_ALIVE) < "infinite") | (~in_3_1_1(publisher) & (PINGS_EVERY < "infinite"))
NEVER_EXPIRES: Final = offered(EXPIRY) == "infinite"
# The Will comes after one and a half keep alives and its delay, which the end of the session cuts short. All of it twice.
TOLD_AFTER: Final = 3 * PINGS_EVERY + 2 * least(publisher(WILL_DELAY), publisher(SESSION_EXPIRY))
TOLD_IN_TIME: Final = (in_3_1_1(publisher) & (3 * publisher(KEEP_ALIVE) <= 2 * LIVENESS)) | (
    ~in_3_1_1(publisher) & (TOLD_AFTER <= 2 * LIVENESS)
)

SHARES: Final = "each message goes to one member of a share group only"
FORGETS: Final = "the broker loses its sessions and messages when it is restarted without persistence"

GUARANTEES: Final = (
    gives(
        "loss_free",
        (offered(QOS) >= "1") & (GRANTED >= "1"),
        code="MQTT101",
        name="loss",
        because="only with QoS 1 or 2 on both ways, to the broker and from it, a message is sent again until it has arrived",
        clause="MQTT 3.1.1, MQTT-3.8.4-6 and 4.3.1; MQTT 5.0, MQTT-3.8.4-8 and 4.3.1",
        fixes=("qos",),
    ),
    gives(
        "loss_free",
        ~requested(SHARED),
        code="MQTT609",
        name="shared-partial",
        because=SHARES,
        clause="MQTT 5.0, 4.8.2",
        help="subscribe without `$share`",
    ),
    gives(
        "loss_free",
        keeps_session(publisher),
        survives="publisher_restart",
        code="MQTT414",
        name="publisher-session-lost",
        because="messages on their way at the break are sent again only within the same session, and it is not kept",
        clause="MQTT 3.1.1, MQTT-4.4.0-1; MQTT 5.0, MQTT-4.4.0-1",
    ),
    gives(
        "loss_free",
        COMES_BACK,
        survives="subscriber_restart",
        code="MQTT415",
        name="subscriber-session-lost",
        because="what is published meanwhile waits only in a session that is kept and taken up again",
        clause="MQTT 3.1.1, MQTT-3.1.2-5; MQTT 5.0, MQTT-3.1.2-5 and 4.1",
    ),
    gives(
        "loss_free",
        as_sentence(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT416",
        name="loss-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "latest",
        (offered(QOS) >= "1") & ((GRANTED >= "1") | GETS_RETAINED),
        code="MQTT108",
        name="latest-over-qos-0",
        because="a message of QoS 0 that is lost at a break is not sent again, and the newest may be the one",
        clause="MQTT 3.1.1, 4.3.1; MQTT 5.0, 4.3.1",
        fixes=("qos", "retain"),
    ),
    gives(
        "latest",
        ~requested(SHARED),
        code="MQTT615",
        name="latest-of-a-share",
        because=SHARES,
        clause="MQTT 5.0, 4.8.2",
        help="subscribe without `$share`",
    ),
    gives(
        "latest",
        GETS_RETAINED | (COMES_BACK & (EFFECTIVE >= "1")),
        survives="subscriber_restart",
        code="MQTT317",
        name="latest-not-kept",
        because="what was published before a client subscribes reaches it only as a retained message, or in a session that it "
        "comes back to",
        clause="MQTT 3.1.1, MQTT-3.3.1-6; MQTT 5.0, 3.3.1.3",
        fixes=("retain", "retain_handling"),
    ),
    gives(
        "latest",
        as_sentence(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT318",
        name="latest-lost-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "duplicate_free",
        (offered(QOS) != "1") & (EFFECTIVE != "1"),
        code="MQTT102",
        name="duplicates",
        because="with QoS 1 a message is sent again until it is acknowledged, so it may come twice",
        clause="MQTT 3.1.1, 3.8.4 and 4.3.2; MQTT 5.0, 3.8.4 and 4.3.2",
        fixes=("qos",),
    ),
    gives(
        "duplicate_free",
        ~requested(OVERLAPPING),
        code="MQTT616",
        name="duplicates-by-overlap",
        because="another filter of the same client matches the topic too, and a broker may send a message once for each",
        clause="MQTT 3.1.1, MQTT-3.3.5-1; MQTT 5.0, MQTT-3.3.4-2",
        help="one filter that covers both, or one client for each",
    ),
    gives(
        "ordered",
        ~requested(SHARED),
        code="MQTT610",
        name="shared-order",
        because="order holds for subscriptions that are not shared",
        clause="MQTT 5.0, MQTT-4.6.0-6",
        help="subscribe without `$share`",
    ),
    gives(
        "ordered",
        (EFFECTIVE != "1") | (broker(INFLIGHT) == 1) | (~in_3_1_1(subscriber) & (subscriber(RECEIVE_MAXIMUM) == 1)),
        code="MQTT702",
        name="order-in-qos-1-window",
        because="with QoS 1 and several messages on their way, one that is sent again may come after newer ones",
        clause="MQTT 3.1.1, 4.6; MQTT 5.0, 4.6",
        fixes=("qos",),
        help="`receive_maximum: 1` of a subscriber of 5.0, or `max_inflight_messages: 1` of the broker, lets one message be on "
        "its way at a time",
    ),
    gives(
        "ordered",
        (offered(QOS) != "1")
        | (publisher(SENDS_AT_ONCE) == 1)
        | (~in_3_1_1(publisher) & (broker(BROKER_RECEIVE_MAXIMUM) == 1)),
        code="MQTT705",
        name="order-on-the-way-to-the-broker",
        because="what is published with QoS 1, several at a time, may come to the broker again after newer ones, and is passed on",
        clause="MQTT 3.1.1, 4.6; MQTT 5.0, 4.6",
        fixes=("qos",),
        help="state `max_inflight_messages: 1` of the publisher's client where it waits for each acknowledgement",
    ),
    gives(
        "late_join",
        as_sentence(offered(RETAIN)),
        code="MQTT301",
        name="not-retained",
        because="the broker keeps the last message for those who come later only if it is published with retain",
        clause="MQTT 3.1.1, MQTT-3.3.1-12; MQTT 5.0, MQTT-3.3.1-8",
        fixes=("retain",),
    ),
    gives(
        "late_join",
        requested(RETAIN_HANDLING) != "do_not_send",
        code="MQTT302",
        name="retained-not-wanted",
        because="the subscription asks the broker not to send retained messages",
        clause="MQTT 5.0, MQTT-3.3.1-11",
        fixes=("retain_handling",),
    ),
    gives(
        "late_join",
        ~requested(SHARED),
        code="MQTT304",
        name="shared-never-retained",
        because="shared subscriptions are not sent retained messages",
        clause="MQTT 5.0, 3.8.4 and 4.8.2",
        help="subscribe without `$share`",
    ),
    gives(
        "late_join",
        NEVER_EXPIRES | (topic(PERIOD) <= offered(EXPIRY)),
        code="MQTT306",
        name="retained-may-expire",
        because="the retained message may expire before the next one comes, and then there is none",
        clause="MQTT 5.0, MQTT-3.3.2-5",
        fixes=("message_expiry_interval",),
    ),
    gives(
        "late_join",
        LATE_JOIN <= 1,
        code="MQTT307",
        name="depth-one",
        because="the broker keeps one retained message for each topic",
        clause="MQTT 3.1.1, MQTT-3.3.1-5; MQTT 5.0, MQTT-3.3.1-5",
        help="one topic for each value that late subscribers need",
    ),
    gives(
        "late_join",
        as_sentence(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT319",
        name="retained-lost-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "offline",
        keeps_session(subscriber),
        code="MQTT401",
        name="no-session-kept",
        because="the session of the subscriber ends with its connection, so nothing waits for it",
        clause="MQTT 3.1.1, MQTT-3.1.2-6; MQTT 5.0, 3.1.2.11.2 and MQTT-4.1.0-2",
    ),
    gives(
        "offline",
        ~keeps_session(subscriber) | WAITS_LONG_ENOUGH,
        code="MQTT402",
        name="session-too-short",
        because="the session is given up before the subscriber comes back",
        clause="MQTT 3.1.1, 3.1.2.4; MQTT 5.0, MQTT-3.1.2-23 and MQTT-4.1.0-2",
    ),
    gives(
        "offline",
        in_3_1_1(subscriber) | ~subscriber(CLEAN),
        code="MQTT403",
        name="clean-start-discards",
        because="the subscriber always begins with a new session, which discards the one that was kept for it",
        clause="MQTT 5.0, MQTT-3.1.2-4",
    ),
    gives(
        "offline",
        (EFFECTIVE >= "1") | (broker(QUEUES_QOS0) & (offered(QOS) >= "0")),
        code="MQTT405",
        name="qos-0-not-queued",
        because="messages of QoS 0 do not wait for those who are absent",
        clause="MQTT 3.1.1, MQTT-3.1.2-5 and 3.1.2.4; MQTT 5.0, 4.1",
        fixes=("qos",),
    ),
    gives(
        "offline",
        OFFLINE <= offered(EXPIRY),
        code="MQTT406",
        name="expires-while-away",
        because="messages expire in the broker before the subscriber comes back",
        clause="MQTT 5.0, MQTT-3.3.2-5",
        fixes=("message_expiry_interval",),
    ),
    gives(
        "offline",
        (broker(QUEUED) == "unlimited") | (ceil(OFFLINE, topic(PERIOD)) <= broker(QUEUED)),
        code="MQTT407",
        name="queue-overflow-while-away",
        because="more messages come than the broker keeps for an absent client, and it drops the rest without telling",
        clause="C-QoS, limits of brokers",
        help="state `period` of the topic and `max_queued_messages` of the broker",
    ),
    gives(
        "offline",
        as_sentence(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT417",
        name="session-lost-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "max_age",
        (offered(EXPIRY) < "infinite") & ~in_3_1_1(publisher),
        code="MQTT501",
        name="age-not-bounded",
        because="messages without expiry wait in the broker for as long as they have to, also as retained ones",
        clause="MQTT 5.0, 3.3.2.3.3",
        fixes=("message_expiry_interval",),
    ),
    gives(
        "max_age",
        NEVER_EXPIRES | (offered(EXPIRY) <= MAX_AGE),
        code="MQTT502",
        name="age-too-long",
        because="messages may wait in the broker until they expire",
        clause="MQTT 5.0, MQTT-3.3.2-5",
        fixes=("message_expiry_interval",),
    ),
    gives(
        "max_gap",
        topic(PERIOD),
        code="MQTT504",
        name="gap-not-bounded",
        because="MQTT promises no deadline, so there is only the period of the publisher to count on",
        clause="C-QoS, deadlines over MQTT",
        help="state `period` of the topic",
    ),
    gives(
        "liveness",
        (publisher(WILL_TOPIC) != "") & call("hears", publisher(WILL_TOPIC), subscriber(SUBSCRIBED)),
        code="MQTT505",
        name="liveness-without-will",
        because="only a Will tells that a client is lost, to those who subscribe to its topic",
        clause="MQTT 3.1.1, MQTT-3.1.2-8; MQTT 5.0, MQTT-3.1.2-7 and MQTT-3.1.2-8",
        help="give the publisher a Will, on a topic to which the subscriber's client subscribes",
    ),
    gives(
        "liveness",
        ~PINGS | TOLD_IN_TIME,
        code="MQTT506",
        name="liveness-too-slow",
        because="a loss is noticed after one and a half keep alives, and told after the delay of the Will",
        clause="MQTT 3.1.1, MQTT-3.1.2-24; MQTT 5.0, MQTT-3.1.2-22 and MQTT-3.1.2-21",
    ),
    gives(
        "liveness",
        PINGS,
        code="MQTT507",
        name="keep-alive-off",
        because="without keep alive the broker does not notice that the publisher is gone",
        clause="MQTT 3.1.1, 3.1.2.10; MQTT 5.0, 3.1.2.10",
    ),
    gives(
        "liveness",
        ~offered(RELAYED),
        code="MQTT509",
        name="liveness-of-a-bridge",
        because="what is noticed is the loss of the bridge, not that of who publishes on its other side",
        clause="C-QoS, guarantees",
    ),
)
