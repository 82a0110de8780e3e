"""What a subscription really gets over MQTT, one sentence for each condition; see `cqos_core.packs.guarantee` for the words.

Publication, broker and subscription decide together. A guarantee holds where all its sentences do. They are asked only
where a subscription says by ``needs:`` that its application requires the guarantee; its QoS alone is no need.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    RELAYED,
    TAKEN_EVERY,
    WORDS,
    Unaffected,
    as_condition,
    broker,
    call,
    define,
    gives,
    least,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_mqtt.arrival_guarantees import ARRIVAL
from cqos_mqtt.broker_policies import (
    BROKER_SESSION_EXPIRY,
    EXPIRY_DELAY,
    NOTICES_LATER,
    PERSISTENCE,
    QUEUES_QOS0,
    SERVER_KEEP_ALIVE,
)
from cqos_mqtt.conditions import in_3_1_1, keeps_session
from cqos_mqtt.connection_policies import (
    CLEAN,
    KEEP_ALIVE,
    SESSION_EXPIRY,
    SUBSCRIBED,
    WILL_ALLOWED,
    WILL_DELAY,
    WILL_TOPIC,
)
from cqos_mqtt.endpoint_policies import (
    EXPIRY,
    QOS,
    QUEUE_LASTS,
    RETAIN,
    RETAIN_HANDLING,
    SHARED,
)
from cqos_mqtt.guarantee_terms import (
    BURST_FITS,
    COMES_BACK,
    CRASHES,
    FILTER_GETS_RETAINED,
    FORGETS,
    LIMITS,
    NEVER_EXPIRES,
    RENEWED_IN_TIME,
    RETAINED_OUTLIVES_OUTAGE,
    SAVE,
    SAVED_AT_ONCE,
    SAVING,
    SAY,
    SENDER_BRIDGES_OUTAGE,
    SENDER_COMES_BACK,
    TAKE,
    WAITING_FITS,
    outlasts,
    session_outlasts,
)
from cqos_mqtt.policies import PERIOD, REPAIR
from cqos_mqtt.rules import EFFECTIVE, GRANTED, IS_EMPTY

OFFLINE: Final = requested(WORDS["offline"].need)
LATE_JOIN: Final = requested(WORDS["late_join"].need)
MAX_AGE: Final = requested(WORDS["max_age"].need)
MAX_GAP: Final = requested(WORDS["max_gap"].need)
LIVENESS: Final = requested(WORDS["liveness"].need)
OLDEST: Final = define("oldest", offered(EXPIRY) + broker(EXPIRY_DELAY))
# The next message may have to be sent again.
REPAIRED_PERIOD: Final = define("repaired_period", topic(PERIOD) + REPAIR)
# In 3.1.1 a session that is kept has no end of its own, but a broker may put one to it (3.1.2.4).
WAITS_LONG_ENOUGH: Final = define(
    "waits_long_enough",
    define("sessions_outlast_absence", outlasts(broker(BROKER_SESSION_EXPIRY), OFFLINE))
    & session_outlasts(subscriber, OFFLINE, "absence"),
)
# A broker replaces the keep alive of 5.0 only: to a client of 3.1.1 it cannot say so, and Mosquitto leaves it; seen by
# running it.
PINGS_EVERY: Final = define("pings_every", least(publisher(KEEP_ALIVE), broker(SERVER_KEEP_ALIVE)))
KEEP_ALIVE_COUNTS: Final = define("keep_alive_counts", in_3_1_1(publisher) | (broker(SERVER_KEEP_ALIVE) > "0s"))
PINGS: Final = define(
    "pings",
    KEEP_ALIVE_COUNTS & ((publisher(KEEP_ALIVE) < "infinite") | (~in_3_1_1(publisher) & (PINGS_EVERY < "infinite"))),
)
# The Will comes after one and a half keep alives, the detection time of the broker, and the delay of the Will. The end of the
# session cuts the delay short. The
# broker counts the delay in steps, and looks once in a step: Mosquitto 2.0.11 sent a Will of 1 s after 2.45 s. All of it twice.
KEEP_ALIVE_NOTICED: Final = define("keep_alive_noticed", 3 * publisher(KEEP_ALIVE) + 2 * broker(NOTICES_LATER))
WILL_SENT_AFTER: Final = define(
    "will_sent_after",
    3 * PINGS_EVERY + 2 * broker(NOTICES_LATER) + 2 * least(publisher(WILL_DELAY), publisher(SESSION_EXPIRY)),
)
NOTICED_IN_TIME: Final = define(
    "noticed_in_time",
    (in_3_1_1(publisher) & (KEEP_ALIVE_NOTICED <= 2 * LIVENESS))
    | (
        ~in_3_1_1(publisher)
        & (WILL_SENT_AFTER <= 2 * LIVENESS)
        & define(
            "delay_ends_in_time",
            (publisher(WILL_DELAY) == "0s")
            | (publisher(SESSION_EXPIRY) == "0s")
            | (WILL_SENT_AFTER + 4 * broker(EXPIRY_DELAY) <= 2 * LIVENESS),
        )
    ),
)
RETAINED_EXPIRES: Final = "the retained message may expire before a newer one takes its place"

# A retained message of QoS 0 that is lost on its way comes again only in a new session: one that goes on need not subscribe again.
SENT_AGAIN: Final = define("sent_again", (EFFECTIVE >= "1") | ~COMES_BACK)
LOST_ONCE: Final = (
    "a retained message of QoS 0 that the break loses is sent again only where the client subscribes again"
)
RETAINED_ONCE: Final = "MQTT 3.1.1, 4.3.1 and MQTT-3.3.1-6; MQTT 5.0, 4.3.1, MQTT-3.3.1-9 and MQTT-3.3.1-10"

ABSENCE_AND_TIME: Final = (
    gives(
        "late_join",
        as_condition(offered(RETAIN)),
        code="MQTT301",
        name="not-retained",
        because="the broker stores the last message for later subscribers only if it is published with retain",
        clause="MQTT 3.1.1, MQTT-3.3.1-12; MQTT 5.0, MQTT-3.3.1-8",
    ),
    gives(
        "late_join",
        requested(RETAIN_HANDLING) != "do_not_send",
        code="MQTT302",
        name="retained-not-wanted",
        because="the subscription asks the broker not to send retained messages",
        clause="MQTT 5.0, MQTT-3.3.1-11",
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
        FILTER_GETS_RETAINED,
        code="MQTT340",
        name="retained-not-sent-to-wildcards",
        because="the broker sends retained messages to subscriptions whose filter has no wildcards, and to no others",
        clause="RabbitMQ, MQTT plugin, limitations; RabbitMQ 3.10.8, by running it",
        help="subscribe to each topic by its name",
    ),
    gives(
        "late_join",
        RENEWED_IN_TIME,
        code="MQTT306",
        name="retained-may-expire",
        because="the retained message may expire before the next one comes, so a late joiner may get none",
        clause="MQTT 5.0, MQTT-3.3.2-5",
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
        as_condition(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT319",
        name="retained-lost-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "late_join",
        SAVED_AT_ONCE,
        survives="broker_crash",
        code="MQTT328",
        name="retained-lost-with-broker-crash",
        because=CRASHES,
        clause=SAVING,
        help=SAVE,
    ),
    gives(
        "late_join",
        (requested(RETAIN_HANDLING) != "send_if_new") | ~COMES_BACK,
        survives="subscriber_restart",
        code="MQTT329",
        name="retained-not-sent-to-old-session",
        because="with retain_handling send_if_new a session that goes on is not sent the retained message again",
        clause="MQTT 5.0, MQTT-3.3.1-10",
        fixes=("retain_handling",),
    ),
    gives(
        "late_join",
        SENT_AGAIN,
        survives="link_outage",
        code="MQTT330",
        name="retained-lost-in-outage",
        because=LOST_ONCE,
        clause=RETAINED_ONCE,
    ),
    gives(
        "late_join",
        SENT_AGAIN,
        survives="intermediary_restart",
        code="MQTT331",
        name="retained-lost-on-its-way",
        because=LOST_ONCE,
        clause=RETAINED_ONCE,
    ),
    gives(
        "late_join",
        RETAINED_OUTLIVES_OUTAGE,
        survives="link_outage",
        code="MQTT332",
        name="retained-expires-in-outage",
        because=RETAINED_EXPIRES,
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "late_join",
        RETAINED_OUTLIVES_OUTAGE,
        survives="intermediary_restart",
        code="MQTT338",
        name="retained-expires-before-broker-is-back",
        because=RETAINED_EXPIRES,
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "late_join",
        ~offered(RETAIN) | ~IS_EMPTY,
        code="MQTT339",
        name="retained-without-payload",
        because="an empty retained message deletes the stored one and is itself not stored",
        clause="MQTT 3.1.1, MQTT-3.3.1-10 and MQTT-3.3.1-11; MQTT 5.0, MQTT-3.3.1-6 and MQTT-3.3.1-7",
    ),
    gives(
        "late_join",
        RETAINED_OUTLIVES_OUTAGE,
        survives="publisher_restart",
        doubt=True,
        code="MQTT333",
        name="retained-expires-before-publisher-is-back",
        because="the retained message expires where the publisher is away for longer",
        clause="MQTT 5.0, MQTT-3.3.2-5",
        help="publish without `message_expiry_interval`",
    ),
    gives(
        "ordered",
        (offered(QOS) == "0") | (SENDER_COMES_BACK & SENDER_BRIDGES_OUTAGE),
        survives="link_outage",
        code="MQTT708",
        name="order-in-new-session",
        because="a library that sends messages again in a new session sends the oldest of them after newer ones have arrived",
        clause="MQTT 3.1.1, 4.6 and MQTT-4.4.0-1; MQTT 5.0, 4.6 and MQTT-4.4.0-1",
    ),
    gives(
        "offline",
        ~requested(SHARED),
        code="MQTT427",
        name="offline-of-a-share",
        because="a member of a share group that is away finds its share of the messages when it comes back, and not all of them",
        clause="MQTT 5.0, 4.8.2",
        help="subscribe without `$share`",
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
        because="messages of QoS 0 do not wait for a client that is not connected",
        clause="MQTT 3.1.1, MQTT-3.1.2-5 and 3.1.2.4; MQTT 5.0, 4.1",
    ),
    gives(
        "offline",
        NEVER_EXPIRES | outlasts(offered(EXPIRY), OFFLINE),
        code="MQTT406",
        name="expires-while-away",
        because="messages expire in the broker before the subscriber comes back",
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "offline",
        OFFLINE <= requested(QUEUE_LASTS),
        code="MQTT407",
        name="queue-overflow-while-away",
        because="more comes, on all topics of the client together, than the broker keeps for an absent client",
        clause=LIMITS,
        help=SAY,
    ),
    gives(
        "offline",
        as_condition(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT417",
        name="session-lost-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "offline",
        SAVED_AT_ONCE,
        survives="broker_crash",
        code="MQTT428",
        name="session-lost-with-broker-crash",
        because=CRASHES,
        clause=SAVING,
        help=SAVE,
    ),
    gives(
        "max_age",
        (offered(EXPIRY) < "infinite") & ~in_3_1_1(publisher),
        code="MQTT501",
        name="age-not-bounded",
        because="messages without expiry wait in the broker for as long as they have to, also as retained ones",
        clause="MQTT 5.0, 3.3.2.3.3",
    ),
    gives(
        "max_age",
        NEVER_EXPIRES
        | (
            (offered(EXPIRY) <= MAX_AGE)
            & (OLDEST <= MAX_AGE)
            # No expiry ends a message that has left the broker: it waits in the client until its program takes it.
            & define("oldest_taken_in_time", OLDEST + requested(TAKEN_EVERY) <= MAX_AGE)
        ),
        code="MQTT502",
        name="age-too-long",
        because="messages may wait in the broker until they expire and until its clock shows it, and then for the program to take them",
        clause="MQTT 5.0, MQTT-3.3.2-5; C-QoS, Mosquitto by running it",
        help="state `expiry_delay` of the broker, how much later than their expiry it still delivers messages, and `taken_every` of the "
        "subscription",
        fixes=("message_expiry_interval",),
    ),
    gives(
        "max_age",
        offered(EXPIRY) > "0s",
        doubt=True,
        code="MQTT515",
        name="expiry-of-zero",
        because="Mosquitto takes an expiry of 0 for none, and other brokers may drop the message at once",
        clause="MQTT 5.0, 3.3.2.3.3; seen by running Mosquitto 2.0.11",
        help="state a `message_expiry_interval` of a second or more",
    ),
    gives(
        "max_gap",
        (topic(PERIOD) <= MAX_GAP)
        & (REPAIRED_PERIOD <= MAX_GAP)
        & define("taken_within_gap", REPAIRED_PERIOD + requested(TAKEN_EVERY) <= MAX_GAP),
        code="MQTT504",
        name="gap-not-bounded",
        because="MQTT promises no deadline, so only the period of the publisher bounds the gap, with the delay by the network and the time "
        "until the program takes the message",
        clause="C-QoS, deadlines over MQTT; RFC 6298",
        help="state `period` of the topic, the option `repair_time`, and `taken_every` of the subscription",
    ),
    gives(
        "max_gap",
        BURST_FITS & WAITING_FITS,
        code="MQTT516",
        name="gap-by-full-queue",
        because="the broker drops what comes while the queue of a slow client is full",
        clause=LIMITS,
        help=TAKE,
    ),
    gives(
        "max_gap",
        (offered(QOS) >= "1") & (GRANTED >= "1"),
        code="MQTT513",
        name="gap-over-qos-0",
        because="a message of QoS 0 that a break loses or a full queue drops is not sent again",
        clause="MQTT 3.1.1, 4.3.1; MQTT 5.0, 4.3.1; seen by running Mosquitto 2.0.11",
    ),
    gives(
        "liveness",
        (publisher(WILL_TOPIC) != "")
        & publisher(WILL_ALLOWED)
        & call("hears", publisher(WILL_TOPIC), subscriber(SUBSCRIBED)),
        code="MQTT505",
        name="liveness-without-will",
        because="only a Will reports the loss of a client, and only subscribers of its topic receive it",
        clause="MQTT 3.1.1, MQTT-3.1.2-8; MQTT 5.0, MQTT-3.1.2-7 and MQTT-3.1.2-8",
        help="give the publisher a Will, on a topic to which the subscriber's client subscribes",
    ),
    gives(
        "liveness",
        ~PINGS | NOTICED_IN_TIME,
        code="MQTT506",
        name="liveness-too-slow",
        because="the broker notices a loss after one and a half keep alives at the earliest, and sends the Will after its delay",
        clause="MQTT 3.1.1, MQTT-3.1.2-24; MQTT 5.0, MQTT-3.1.2-22 and MQTT-3.1.2-21",
        help="where a Will has a delay, state `expiry_delay` of the broker: how much later than that it sends the Will",
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
        because="the subscriber detects the loss of the bridge only, not the loss of a publisher behind it",
        clause="C-QoS, guarantees",
    ),
    gives(
        "liveness",
        None,
        survives="intermediary_restart",
        code="MQTT512",
        name="no-will-while-broker-is-down",
        because="a publisher that dies while the broker is down leaves no Will",
        clause="MQTT 3.1.1, 3.1.2.5; MQTT 5.0, 3.1.2.5",
    ),
)

GUARANTEES: Final = (*ARRIVAL, *ABSENCE_AND_TIME)

IN_ORDER: Final = "what is sent again is sent in the order in which it was sent first"
UNAFFECTED: Final = (
    Unaffected(
        "duplicate_free",
        ("publisher_restart",),
        "a publisher sends again only within its session, under an identifier that the broker knows",
        "MQTT 3.1.1, MQTT-4.4.0-1 and 4.3.3; MQTT 5.0, MQTT-4.4.0-1 and 4.3.3",
    ),
    Unaffected(
        "ordered",
        ("subscriber_restart", "publisher_restart"),
        IN_ORDER,
        "MQTT 3.1.1, MQTT-4.6.0-1 to MQTT-4.6.0-4; MQTT 5.0, MQTT-4.6.0-1 to MQTT-4.6.0-4",
    ),
    Unaffected("offline", ("subscriber_restart",), "a restart is an absence", "MQTT 3.1.1, 4.1; MQTT 5.0, 4.1"),
    Unaffected("max_age", ("subscriber_restart",), "the broker drops expired messages", "MQTT 5.0, MQTT-3.3.2-5"),
    Unaffected(
        "liveness",
        ("publisher_restart",),
        "it is the loss that is noticed",
        "MQTT 3.1.1, MQTT-3.1.2-8; MQTT 5.0, MQTT-3.1.2-7",
    ),
)
"""What faults leave as it is."""
