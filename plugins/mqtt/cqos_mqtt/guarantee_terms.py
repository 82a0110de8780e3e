"""What the guarantees of MQTT rest on: sessions, restarts, saving, the Will; and what to do where one is lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.packs import (
    OUTAGE,
    TAKEN_EVERY,
    broker,
    define,
    offered,
    publisher,
    requested,
    subscriber,
    topic,
)
from cqos_mqtt.broker_policies import (
    AUTOSAVE,
    BROKER_SESSION_EXPIRY,
    INFLIGHT,
    QUEUED,
    QUEUED_BYTES,
    RETAINED_BY_NAME_ONLY,
    SESSION_EXPIRY_3_1_1,
)
from cqos_mqtt.conditions import in_3_1_1, keeps_session
from cqos_mqtt.connection_policies import (
    CLEAN,
    SENDS_AT_ONCE,
    SESSION_EXPIRY,
)
from cqos_mqtt.endpoint_policies import (
    BURST_BYTES,
    BURSTS,
    EXPIRY,
    IS_WILL,
    PACED,
    QOS,
    QUEUE_LASTS,
    RETAIN,
    RETAIN_HANDLING,
    SHARED,
    WAITING,
    WAITING_BYTES,
    WILDCARDS,
)
from cqos_mqtt.kinds import EACH
from cqos_mqtt.policies import PERIOD
from cqos_mqtt.rules import EFFECTIVE, IS_EMPTY, has_room

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.packs import Condition, Operand, Term


def outlasts(limit: Operand, time: Operand) -> Condition:
    """Say that what MQTT counts in whole seconds is longer than a time, whichever way the broker rounds."""
    return (limit == "infinite") | (time + SECOND <= limit)


SECOND: Final = "1s"
# An empty retained message deletes the one that is stored, and is not stored itself.
IS_KEPT: Final = define("is_kept", offered(RETAIN) & ~IS_EMPTY)
FILTER_GETS_RETAINED: Final = define("filter_gets_retained", ~requested(WILDCARDS) | ~broker(RETAINED_BY_NAME_ONLY))
GETS_RETAINED: Final = define(
    "gets_retained",
    IS_KEPT & (requested(RETAIN_HANDLING) != "do_not_send") & ~requested(SHARED) & FILTER_GETS_RETAINED,
)
COMES_BACK: Final = define("comes_back", keeps_session(subscriber) & ~subscriber(CLEAN))
# A Will is sent by the broker, so no session of its client matters to it.
SENDER_COMES_BACK: Final = define(
    "sender_comes_back", offered(IS_WILL) | (keeps_session(publisher) & ~publisher(CLEAN))
)


def session_outlasts(side: Callable[[Term], Operand], time: Operand, name: str) -> Condition:
    """Whether the session of a client lasts longer than a time: as long as it asks for, or in 3.1.1 as long as the broker keeps it."""
    asked = define(f"{side.__name__}_asks_beyond_{name}", outlasts(side(SESSION_EXPIRY), time))
    kept = define(f"kept_in_3_1_1_beyond_{name}", outlasts(broker(SESSION_EXPIRY_3_1_1), time))
    return (in_3_1_1(side) & kept) | (~in_3_1_1(side) & asked)


SESSIONS_OUTLAST_OUTAGE: Final = define("sessions_outlast_outage", outlasts(broker(BROKER_SESSION_EXPIRY), OUTAGE))
BRIDGES_OUTAGE: Final = define(
    "bridges_outage",
    SESSIONS_OUTLAST_OUTAGE & session_outlasts(subscriber, OUTAGE, "outage"),
)
SESSION_LASTS: Final = define("session_lasts", COMES_BACK & BRIDGES_OUTAGE)
SENDER_BRIDGES_OUTAGE: Final = define(
    "sender_bridges_outage",
    offered(IS_WILL)
    | (SESSIONS_OUTLAST_OUTAGE & define("sender_outlasts_outage", session_outlasts(publisher, OUTAGE, "outage"))),
)
QUEUE_BRIDGES_OUTAGE: Final = define(
    "queue_bridges_outage", (requested(QUEUE_LASTS) == "infinite") | (OUTAGE <= requested(QUEUE_LASTS))
)
NOT_REPLAYED: Final = define(
    "not_replayed",
    ~IS_KEPT
    | (requested(RETAIN_HANDLING) == "do_not_send")
    | (COMES_BACK & (requested(RETAIN_HANDLING) == "send_if_new")),
)
# A client whose session goes on need not subscribe again, so only a client with a new session certainly gets what is retained.
FOUND_AGAIN: Final = define("found_again", (GETS_RETAINED & ~COMES_BACK) | (COMES_BACK & (EFFECTIVE >= "1")))
NEWEST_WAITS: Final = define(
    "newest_waits", (GETS_RETAINED & ~SESSION_LASTS) | (SESSION_LASTS & (EFFECTIVE >= "1") & QUEUE_BRIDGES_OUTAGE)
)
SAVED_AT_ONCE: Final = broker(AUTOSAVE) == EACH
# What was published meanwhile comes at once after the break. Mosquitto 2.0.11 drops messages of QoS 2 beyond its own window, which
# 3.1.1 cannot announce; seen by running it.
FEW_AT_ONCE: Final = define(
    "few_at_once",
    (offered(QOS) != "2") | ~in_3_1_1(publisher) | offered(IS_WILL) | (publisher(SENDS_AT_ONCE) <= broker(INFLIGHT)),
)
NEVER_EXPIRES: Final = define("never_expires", (offered(EXPIRY) == "infinite") | in_3_1_1(publisher))
TAKEN_IN_TIME: Final = define("taken_in_time", NEVER_EXPIRES | (requested(TAKEN_EVERY) <= offered(EXPIRY)))
# Mosquitto drops a retained message up to a second before its expiry ends, and others up to a second after; seen by running 2.0.11.
RENEWED_IN_TIME: Final = define("renewed_in_time", NEVER_EXPIRES | (topic(PERIOD) + SECOND <= offered(EXPIRY)))
RETAINED_OUTLIVES_OUTAGE: Final = define(
    "retained_outlives_outage", NEVER_EXPIRES | (topic(PERIOD) + OUTAGE + SECOND <= offered(EXPIRY))
)
OUTLIVES_OUTAGE: Final = define("outlives_outage", NEVER_EXPIRES | outlasts(offered(EXPIRY), OUTAGE))

BURST_FITS: Final = (requested(BURSTS) == 0) | define(
    "burst_fits", has_room(requested(BURSTS)) & (requested(BURST_BYTES) < broker(QUEUED_BYTES))
)
# Only an endless queue has room whatever the program does.
WAITING_FITS: Final = define(
    "waiting_fits",
    define("queue_is_endless", (broker(QUEUED) == "unlimited") & (broker(QUEUED_BYTES) == "unlimited"))
    | (
        (requested(PACED) | (requested(TAKEN_EVERY) == "0s"))
        & define(
            "queue_has_room",
            (requested(WAITING) == 0)
            | (has_room(requested(WAITING)) & (requested(WAITING_BYTES) < broker(QUEUED_BYTES))),
        )
    ),
)


SHARES: Final = "each message goes to one member of a share group only"
FORGETS: Final = "the broker loses its sessions and messages when it is restarted without persistence"
CRASHES: Final = "a broker that crashes loses what it has not saved yet, also messages that it has acknowledged"
SAVING: Final = "Mosquitto, mosquitto.conf(5), autosave_interval"
TOO_MANY: Final = "after a break all that waits is sent at once, and the broker drops messages of QoS 2 beyond those that it has on their way"
WINDOW: Final = "Mosquitto, mosquitto.conf(5), max_inflight_messages; seen by running Mosquitto 2.0.11"
NARROW: Final = "state `max_inflight_messages` of the publisher's client, no more than that of the broker"
LIMITS: Final = "C-QoS, limits of brokers; Mosquitto, mosquitto.conf(5), max_queued_messages and max_queued_bytes"
TAKE: Final = "state `taken_every` of the subscription, or `max_queued_messages: unlimited` of the broker"
BACK: Final = "a bridge publishes here once more what the other broker sends back to it"
SAY: Final = "state `period` of all topics of the client and `max_queued_messages` of the broker"
SAVE: Final = (
    "use a broker that saves each message before it acknowledges it, and state `autosave_interval: each_message` of it"
)
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
