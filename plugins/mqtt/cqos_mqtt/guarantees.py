"""What a subscription really gets over MQTT, one sentence for each condition; see `cqos_core.packs.guarantee` for the words.

Publication, broker and subscription decide together. A guarantee holds where all its sentences do. They are asked only
where a subscription says by ``needs:`` that its application requires the guarantee; its QoS alone is no need.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    OUTAGE,
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
from cqos_mqtt.policies import (
    AUTOSAVE,
    BROKER_RECEIVE_MAXIMUM,
    BROKER_SESSION_EXPIRY,
    BURST_BYTES,
    BURSTS,
    CLEAN,
    EXPIRY,
    INFLIGHT,
    IS_WILL,
    KEEP_ALIVE,
    NOTICES_LATER,
    OVERLAPPING,
    PACED,
    PERIOD,
    PERSISTENCE,
    QOS,
    QUEUE_LASTS,
    QUEUED_BYTES,
    QUEUES_QOS0,
    RECEIVE_MAXIMUM,
    RETAIN,
    RETAIN_HANDLING,
    SENDS_AT_ONCE,
    SERVER_KEEP_ALIVE,
    SESSION_EXPIRY,
    SHARED,
    STORES_SESSION,
    SUBSCRIBED,
    WAITING,
    WAITING_BYTES,
    WILL_ALLOWED,
    WILL_DELAY,
    WILL_TOPIC,
)
from cqos_mqtt.rules import EFFECTIVE, GRANTED, ROOM, in_3_1_1, keeps_session

OFFLINE: Final = requested(WORDS["offline"].need)
LATE_JOIN: Final = requested(WORDS["late_join"].need)
MAX_AGE: Final = requested(WORDS["max_age"].need)
LIVENESS: Final = requested(WORDS["liveness"].need)

GETS_RETAINED: Final = define(
    "gets_retained", offered(RETAIN) & (requested(RETAIN_HANDLING) != "do_not_send") & ~requested(SHARED)
)
COMES_BACK: Final = define("comes_back", keeps_session(subscriber) & ~subscriber(CLEAN))
# A Will is sent by the broker, so no session of its client matters to it.
SENDER_COMES_BACK: Final = define(
    "sender_comes_back", offered(IS_WILL) | (keeps_session(publisher) & ~publisher(CLEAN))
)
# In 3.1.1 a session that is kept has no end of its own, but a broker may put one to it (3.1.2.4).
WAITS_LONG_ENOUGH: Final = define(
    "waits_long_enough",
    (OFFLINE <= broker(BROKER_SESSION_EXPIRY)) & (in_3_1_1(subscriber) | (OFFLINE <= subscriber(SESSION_EXPIRY))),
)
BRIDGES_OUTAGE: Final = define(
    "bridges_outage",
    (OUTAGE <= broker(BROKER_SESSION_EXPIRY)) & (in_3_1_1(subscriber) | (OUTAGE <= subscriber(SESSION_EXPIRY))),
)
SESSION_LASTS: Final = define("session_lasts", COMES_BACK & BRIDGES_OUTAGE)
SENDER_BRIDGES_OUTAGE: Final = define(
    "sender_bridges_outage",
    offered(IS_WILL)
    | ((OUTAGE <= broker(BROKER_SESSION_EXPIRY)) & (in_3_1_1(publisher) | (OUTAGE <= publisher(SESSION_EXPIRY)))),
)
NOT_REPLAYED: Final = define(
    "not_replayed",
    ~offered(RETAIN)
    | (requested(RETAIN_HANDLING) == "do_not_send")
    | (COMES_BACK & (requested(RETAIN_HANDLING) == "send_if_new")),
)
# A client whose session goes on need not subscribe again, so only a client with a new session certainly gets what is retained.
FOUND_AGAIN: Final = define("found_again", (GETS_RETAINED & ~COMES_BACK) | (COMES_BACK & (EFFECTIVE >= "1")))
SAVED_AT_ONCE: Final = broker(AUTOSAVE) == "0s"
# A broker replaces the keep alive of 5.0 only: to a client of 3.1.1 it cannot say so, and Mosquitto leaves it; seen by
# running it.
PINGS_EVERY: Final = define("pings_every", least(publisher(KEEP_ALIVE), broker(SERVER_KEEP_ALIVE)))
PINGS: Final = define(
    "pings", (publisher(KEEP_ALIVE) < "infinite") | (~in_3_1_1(publisher) & (PINGS_EVERY < "infinite"))
)
# What was published meanwhile comes at once after the break. Mosquitto 2.0.11 drops messages of QoS 2 beyond its own window, which
# 3.1.1 cannot announce; seen by running it.
FEW_AT_ONCE: Final = define(
    "few_at_once",
    (offered(QOS) != "2") | ~in_3_1_1(publisher) | offered(IS_WILL) | (publisher(SENDS_AT_ONCE) <= broker(INFLIGHT)),
)
NEVER_EXPIRES: Final = define("never_expires", (offered(EXPIRY) == "infinite") | in_3_1_1(publisher))
TAKEN_IN_TIME: Final = define("taken_in_time", NEVER_EXPIRES | (requested(TAKEN_EVERY) <= offered(EXPIRY)))
# The Will comes after one and a half keep alives, the detection time of the broker, and the delay of the Will. The end of the
# session cuts the delay short. All of it twice.
KEEP_ALIVE_NOTICED: Final = define("keep_alive_noticed", 3 * publisher(KEEP_ALIVE) + 2 * broker(NOTICES_LATER))
WILL_SENT_AFTER: Final = define(
    "will_sent_after",
    3 * PINGS_EVERY + 2 * broker(NOTICES_LATER) + 2 * least(publisher(WILL_DELAY), publisher(SESSION_EXPIRY)),
)
NOTICED_IN_TIME: Final = define(
    "noticed_in_time",
    (in_3_1_1(publisher) & (KEEP_ALIVE_NOTICED <= 2 * LIVENESS))
    | (~in_3_1_1(publisher) & (WILL_SENT_AFTER <= 2 * LIVENESS)),
)

SHARES: Final = "each message goes to one member of a share group only"
FORGETS: Final = "the broker loses its sessions and messages when it is restarted without persistence"
CRASHES: Final = "a broker that crashes loses what it has not saved yet, also messages that it has acknowledged"
SAVING: Final = "Mosquitto, mosquitto.conf(5), autosave_interval"
TOO_MANY: Final = "after a break all that waits is sent at once, and the broker drops messages of QoS 2 beyond those that it has on their way"
WINDOW: Final = "Mosquitto, mosquitto.conf(5), max_inflight_messages; seen by running Mosquitto 2.0.11"
NARROW: Final = "state `max_inflight_messages` of the publisher's client, no more than that of the broker"
LIMITS: Final = "C-QoS, limits of brokers; Mosquitto, mosquitto.conf(5), max_queued_messages and max_queued_bytes"
SAY: Final = "state `period` of all topics of the client and `max_queued_messages` of the broker"
SAVE: Final = "use a broker that saves each message before it acknowledges it, and state `autosave_interval: 0s` of it"
ENDS: Final = (
    "the session of the subscriber ends with its connection, so what is published before it subscribes again is lost"
)
UNSENT: Final = (
    "the session of the publisher ends with its connection, so a message on its way at that moment is not sent again"
)
UNSTORED: Final = "a client that keeps its part of the session in memory only forgets it when its program is killed"
STORE: Final = "state `stores_session` of the client: whether its library keeps unacknowledged messages on disk"
REPLAYED: Final = "a retained message is sent once more when the client subscribes again"
EXPIRED: Final = "a message that waits in the broker for longer than its expiry is dropped"
SESSION_CLAUSE: Final = "MQTT 3.1.1, 4.1 and MQTT-4.4.0-1; MQTT 5.0, 4.1 and MQTT-4.4.0-1"

GUARANTEES: Final = (
    gives(
        "loss_free",
        (offered(QOS) >= "1") & (GRANTED >= "1"),
        code="MQTT101",
        name="loss",
        because="only with QoS 1 or 2 on both ways, to the broker and from it, a message is sent again until it has arrived",
        clause="MQTT 3.1.1, MQTT-3.8.4-6 and 4.3.1; MQTT 5.0, MQTT-3.8.4-8 and 4.3.1",
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
        SENDER_COMES_BACK,
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
        as_condition(broker(PERSISTENCE)),
        survives="intermediary_restart",
        code="MQTT416",
        name="loss-with-broker",
        because=FORGETS,
        clause="MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    ),
    gives(
        "loss_free",
        publisher(STORES_SESSION) | offered(IS_WILL),
        survives="publisher_restart",
        code="MQTT422",
        name="publisher-session-in-memory",
        because=UNSTORED,
        clause=SESSION_CLAUSE,
        help=STORE,
    ),
    gives(
        "loss_free",
        COMES_BACK & BRIDGES_OUTAGE,
        survives="link_outage",
        code="MQTT418",
        name="session-ends-with-link",
        because="the session of the subscriber does not outlast the outage, so what is published meanwhile is lost",
        clause=SESSION_CLAUSE,
    ),
    gives(
        "loss_free",
        SENDER_COMES_BACK & SENDER_BRIDGES_OUTAGE,
        survives="link_outage",
        code="MQTT419",
        name="publisher-session-ends-with-link",
        because="the session of the publisher does not outlast the outage, so messages on their way at the break are not sent again",
        clause=SESSION_CLAUSE,
    ),
    gives(
        "loss_free",
        OUTAGE <= requested(QUEUE_LASTS),
        survives="link_outage",
        code="MQTT420",
        name="queue-overflow-in-outage",
        because="more comes during the outage, on all topics of the client together, than the broker keeps for it",
        clause=LIMITS,
        help=SAY,
    ),
    gives(
        "loss_free",
        FEW_AT_ONCE,
        survives="link_outage",
        code="MQTT429",
        name="too-many-on-their-way-after-outage",
        because=TOO_MANY,
        clause=WINDOW,
        doubt=True,
        help=NARROW,
    ),
    gives(
        "loss_free",
        FEW_AT_ONCE,
        survives="intermediary_restart",
        code="MQTT430",
        name="too-many-on-their-way-after-broker-restart",
        because=TOO_MANY,
        clause=WINDOW,
        doubt=True,
        help=NARROW,
    ),
    gives(
        "loss_free",
        NEVER_EXPIRES | (OUTAGE <= offered(EXPIRY)),
        survives="link_outage",
        code="MQTT421",
        name="expires-in-outage",
        because=EXPIRED,
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "loss_free",
        COMES_BACK,
        survives="intermediary_restart",
        code="MQTT423",
        name="session-ends-with-broker",
        because=ENDS,
        clause=SESSION_CLAUSE,
    ),
    gives(
        "loss_free",
        SENDER_COMES_BACK,
        survives="intermediary_restart",
        code="MQTT424",
        name="publisher-session-ends-with-broker",
        because=UNSENT,
        clause=SESSION_CLAUSE,
    ),
    gives(
        "loss_free",
        SAVED_AT_ONCE,
        survives="broker_crash",
        code="MQTT425",
        name="loss-with-broker-crash",
        because=CRASHES,
        clause=SAVING,
        help=SAVE,
    ),
    gives(
        "loss_free",
        TAKEN_IN_TIME,
        code="MQTT426",
        name="expires-before-it-is-taken",
        because=EXPIRED,
        clause="MQTT 5.0, MQTT-3.3.2-5",
        help="state `taken_every` of the subscription, no longer than the expiry",
    ),
    gives(
        "loss_free",
        ~requested(PACED)
        | (requested(BURSTS) == 0)
        | define("burst_fits", (requested(BURSTS) <= ROOM) & (requested(BURST_BYTES) < broker(QUEUED_BYTES))),
        code="MQTT706",
        name="burst-overflows-queue",
        because="more may come at once, on all topics of the client together, than the broker keeps for a connected client",
        clause=LIMITS,
        help="a larger `max_queued_messages`, or fewer messages at once",
    ),
    gives(
        "loss_free",
        ~requested(PACED)
        | (requested(WAITING) == 0)
        | ((requested(WAITING) <= ROOM) & (requested(WAITING_BYTES) < broker(QUEUED_BYTES))),
        code="MQTT707",
        name="slow-subscriber-overflows-queue",
        because="more comes from one take to the next, on all topics of the client together, than the broker keeps for it",
        clause=LIMITS,
        help=SAY + ", or take messages more often",
    ),
    gives(
        "latest",
        (offered(QOS) >= "1") & ((GRANTED >= "1") | GETS_RETAINED),
        code="MQTT108",
        name="latest-over-qos-0",
        because="a message of QoS 0 that is lost at a break is not sent again, and the newest may be the one",
        clause="MQTT 3.1.1, 4.3.1; MQTT 5.0, 4.3.1",
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
        TAKEN_IN_TIME,
        code="MQTT326",
        name="latest-expires",
        because=EXPIRED,
        clause="MQTT 5.0, MQTT-3.3.2-5",
        help="state `taken_every` of the subscription, no longer than the expiry",
    ),
    gives(
        "latest",
        (GETS_RETAINED & ~SESSION_LASTS) | (SESSION_LASTS & (EFFECTIVE >= "1") & (OUTAGE <= requested(QUEUE_LASTS))),
        survives="link_outage",
        code="MQTT320",
        name="latest-lost-in-outage",
        because="what is published during the outage waits only in a session that outlasts it, or as a retained message for a client "
        "that subscribes again",
        clause=SESSION_CLAUSE,
        fixes=("retain", "retain_handling"),
    ),
    gives(
        "latest",
        SENDER_COMES_BACK & SENDER_BRIDGES_OUTAGE,
        survives="link_outage",
        code="MQTT321",
        name="latest-not-sent-after-outage",
        because="the session of the publisher does not outlast the outage, so messages on their way at the break are not sent again",
        clause=SESSION_CLAUSE,
    ),
    gives(
        "latest",
        NEVER_EXPIRES | (OUTAGE <= offered(EXPIRY)),
        survives="link_outage",
        code="MQTT322",
        name="latest-expires-in-outage",
        because=EXPIRED,
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "latest",
        GETS_RETAINED & ((requested(RETAIN_HANDLING) == "send") | ~COMES_BACK),
        survives="subscriber_restart",
        code="MQTT317",
        name="latest-not-kept",
        because="a program that was started again is sent the newest message once more only if that is retained, and not with "
        "retain_handling send_if_new in a session that goes on",
        clause="MQTT 3.1.1, MQTT-3.3.1-6; MQTT 5.0, 3.3.1.3 and MQTT-3.3.1-10",
        fixes=("retain", "retain_handling"),
    ),
    gives(
        "latest",
        NEVER_EXPIRES | (topic(PERIOD) <= offered(EXPIRY)),
        survives="subscriber_restart",
        code="MQTT327",
        name="latest-expires-before-restart",
        because="the retained message may expire before the next one comes, and then the broker has none",
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "latest",
        SENDER_COMES_BACK & (publisher(STORES_SESSION) | offered(IS_WILL)),
        survives="publisher_restart",
        code="MQTT323",
        name="latest-lost-with-publisher",
        because="a message on its way when the publisher is killed is sent again only from a session that both sides have kept",
        clause=SESSION_CLAUSE,
        help=STORE,
    ),
    gives(
        "latest",
        FOUND_AGAIN & SENDER_COMES_BACK,
        survives="intermediary_restart",
        code="MQTT324",
        name="latest-not-found-after-broker",
        because="a message on its way when the broker ends arrives only if the publisher's session goes on, and then the subscriber's "
        "session, or a retained message for a new one",
        clause=SESSION_CLAUSE,
    ),
    gives(
        "latest",
        SAVED_AT_ONCE,
        survives="broker_crash",
        code="MQTT325",
        name="latest-lost-with-broker-crash",
        because=CRASHES,
        clause=SAVING,
        help=SAVE,
    ),
    gives(
        "latest",
        as_condition(broker(PERSISTENCE)),
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
        "duplicate_free",
        NOT_REPLAYED,
        survives="link_outage",
        code="MQTT109",
        name="retained-again-after-outage",
        because=REPLAYED,
        clause="MQTT 3.1.1, MQTT-3.3.1-6; MQTT 5.0, MQTT-3.3.1-9 and MQTT-3.3.1-10",
        fixes=("retain_handling",),
    ),
    gives(
        "duplicate_free",
        ~offered(RETAIN) | (requested(RETAIN_HANDLING) == "do_not_send") | BRIDGES_OUTAGE,
        survives="link_outage",
        code="MQTT110",
        name="retained-in-new-session",
        because="the session ends before the outage does, and in a new one a retained message is sent once more",
        clause="MQTT 5.0, MQTT-3.3.1-10",
    ),
    gives(
        "duplicate_free",
        (offered(QOS) == "0") | (SENDER_COMES_BACK & SENDER_BRIDGES_OUTAGE),
        survives="link_outage",
        code="MQTT111",
        name="sent-again-in-new-session",
        because="a library that sends a message of QoS 2 again in a new session sends one that the broker does not know as the same",
        clause=SESSION_CLAUSE,
    ),
    gives(
        "duplicate_free",
        NOT_REPLAYED,
        survives="subscriber_restart",
        code="MQTT112",
        name="retained-again-after-restart",
        because=REPLAYED,
        clause="MQTT 3.1.1, MQTT-3.3.1-6; MQTT 5.0, MQTT-3.3.1-9 and MQTT-3.3.1-10",
        fixes=("retain_handling",),
    ),
    gives(
        "duplicate_free",
        (EFFECTIVE == "0") | ~COMES_BACK | subscriber(STORES_SESSION),
        survives="subscriber_restart",
        code="MQTT113",
        name="identifiers-in-memory",
        because=UNSTORED + ", so it takes a message of QoS 2 that is sent again for a new one",
        clause="MQTT 3.1.1, 4.1 and 4.3.3; MQTT 5.0, 4.1 and 4.3.3",
        help=STORE,
    ),
    gives(
        "duplicate_free",
        NOT_REPLAYED,
        survives="intermediary_restart",
        code="MQTT114",
        name="retained-again-after-broker",
        because=REPLAYED,
        clause="MQTT 3.1.1, MQTT-3.3.1-6; MQTT 5.0, MQTT-3.3.1-9 and MQTT-3.3.1-10",
        fixes=("retain_handling",),
    ),
    gives(
        "duplicate_free",
        (offered(QOS) == "0") | (broker(PERSISTENCE) & SENDER_COMES_BACK),
        survives="intermediary_restart",
        code="MQTT115",
        name="duplicates-after-broker",
        because="a broker that has lost its sessions takes a message of QoS 2 that is sent again for a new one",
        clause=SESSION_CLAUSE,
    ),
    gives(
        "duplicate_free",
        ((offered(QOS) == "0") & (EFFECTIVE == "0") & ~broker(QUEUES_QOS0)) | SAVED_AT_ONCE,
        survives="broker_crash",
        code="MQTT116",
        name="duplicates-after-broker-crash",
        because="a broker that crashes comes back with an older state, and sends again what it had delivered since",
        clause=SAVING,
        help=SAVE,
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
        as_condition(offered(RETAIN)),
        code="MQTT301",
        name="not-retained",
        because="the broker keeps the last message for those who come later only if it is published with retain",
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
        NEVER_EXPIRES | (topic(PERIOD) <= offered(EXPIRY)),
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
        because="messages of QoS 0 do not wait for those who are absent",
        clause="MQTT 3.1.1, MQTT-3.1.2-5 and 3.1.2.4; MQTT 5.0, 4.1",
    ),
    gives(
        "offline",
        OFFLINE <= offered(EXPIRY),
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
        NEVER_EXPIRES | (offered(EXPIRY) <= MAX_AGE),
        code="MQTT502",
        name="age-too-long",
        because="messages may wait in the broker until they expire",
        clause="MQTT 5.0, MQTT-3.3.2-5",
    ),
    gives(
        "max_gap",
        topic(PERIOD),
        code="MQTT504",
        name="gap-not-bounded",
        because="MQTT promises no deadline, so only the period of the publisher bounds the gap",
        clause="C-QoS, deadlines over MQTT",
        help="state `period` of the topic",
    ),
    gives(
        "liveness",
        (publisher(WILL_TOPIC) != "")
        & publisher(WILL_ALLOWED)
        & call("hears", publisher(WILL_TOPIC), subscriber(SUBSCRIBED)),
        code="MQTT505",
        name="liveness-without-will",
        because="only a Will tells that a client is lost, to those who subscribe to its topic",
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
        ("link_outage", "subscriber_restart", "publisher_restart"),
        IN_ORDER,
        "MQTT 3.1.1, MQTT-4.6.0-1 to MQTT-4.6.0-4; MQTT 5.0, MQTT-4.6.0-1 to MQTT-4.6.0-4",
    ),
    Unaffected(
        "late_join",
        ("link_outage", "publisher_restart"),
        "the broker keeps a retained message, also while no client is connected",
        "MQTT 3.1.1, 3.1.2.4 and 3.3.1.3; MQTT 5.0, 3.3.1.3 and 4.1",
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
