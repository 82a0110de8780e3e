"""What a connection states in MQTT, its session and its Will among it, and what follows from all clients together."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Count, Derived, Flag, Names, Policy, Text
from cqos_mqtt.endpoint_policies import LEFT_OPEN
from cqos_mqtt.kinds import Seconds, quality, unlimited

# What a connection states -----------------------------------------------------------------------------------

CLIENT_ID: Final = Policy(
    "client_id",
    Text(),
    None,
    "The name by which the broker finds the session of a client again; empty lets the broker make one up.",
    "MQTT 3.1.1, 3.1.3.1; MQTT 5.0, 3.1.3.1",
    level="participant",
    aliases=("clientid", "client_identifier"),
)
USERNAME: Final = Policy(
    "username",
    Text(),
    None,
    "The name with which the client logs in; by it the broker decides what it may do.",
    "MQTT 3.1.1, 3.1.3.4; MQTT 5.0, 3.1.3.5",
    level="participant",
    aliases=("user",),
)
GENERATED_ID: Final = Policy(
    "generated_client_id",
    Flag(),
    "false",
    "Whether the client makes up a new id at each start.",
    level="participant",
    aliases=("random_client_id",),
)
CLEAN: Final = Policy(
    "clean_start",
    Flag(),
    "true",
    "Whether the client begins with a new session each time it connects. In 3.1.1, as clean session, it also says that the "
    "session ends with the connection.",
    "MQTT 3.1.1, 3.1.2.4; MQTT 5.0, 3.1.2.4",
    level="participant",
    aliases=("clean_session", "cleansession", "cleanstart"),
    stronger="lower",
)
SESSION_EXPIRY: Final = Policy(
    "session_expiry_interval",
    Seconds(),
    "0s",
    "For how long the broker keeps the session after the connection ends; 3.1.1 has no such field.",
    "MQTT 5.0, 3.1.2.11.2",
    level="participant",
    aliases=("session_expiry",),
    words=LEFT_OPEN,
    stronger="higher",
)
KEEP_ALIVE: Final = Policy(
    "keep_alive",
    Seconds(65_535),
    "60s",
    "After how long of silence the client pings; after one and a half times of it the broker takes it for lost. 0 is off.",
    "MQTT 3.1.1, 3.1.2.10; MQTT 5.0, 3.1.2.10",
    level="participant",
    aliases=("keepalive",),
    words={"off": "infinite", **LEFT_OPEN},
    zero="off",
    stronger="lower",
)
STORES_SESSION: Final = Policy(
    "stores_session",
    Flag(),
    None,
    "Whether the client's part of the session is on disk. What is not acknowledged yet is then sent after the program was "
    "killed. Most libraries keep it in memory only.",
    "MQTT 3.1.1, 4.1; MQTT 5.0, 4.1",
    level="participant",
)
RECEIVE_MAXIMUM: Final = Policy(
    "receive_maximum",
    Count(1, 65_535),
    "65535",
    "How many messages of QoS 1 and 2 may be on their way to the client at once.",
    "MQTT 5.0, 3.1.2.11.3",
    level="participant",
    stronger="higher",
)
SENDS_AT_ONCE: Final = Policy(
    "max_inflight_messages",
    unlimited(1, 65_535),
    None,
    "How many messages of QoS 1 and 2 the client has on their way to the broker at once, where its library bounds them.",
    "MQTT 3.1.1, 4.6; MQTT 5.0, 4.9",
    level="participant",
    aliases=("send_maximum",),
    stronger="higher",
)
PACKET_SIZE: Final = Policy(
    "maximum_packet_size",
    unlimited(unit="bytes"),
    "unlimited",
    "The largest packet that the client takes; larger ones are dropped without a word.",
    "MQTT 5.0, 3.1.2.11.4",
    level="participant",
    aliases=("max_packet_size",),
    words=LEFT_OPEN,
    stronger="higher",
)
ALIASES: Final = Policy(
    "topic_alias_maximum",
    Count(0, 65_535),
    "0",
    "The highest topic alias that the client understands.",
    "MQTT 5.0, 3.1.2.11.5",
    level="participant",
    stronger="higher",
)
WILL_TOPIC: Final = Policy(
    "will.topic",
    Text(),
    "",
    "Where the broker publishes for the client when it is lost; empty is no Will.",
    "MQTT 3.1.1, 3.1.2.5; MQTT 5.0, 3.1.2.5",
    level="participant",
    aliases=("lastwill.topic", "last_will.topic"),
)
WILL_PAYLOAD: Final = Policy(
    "will.payload",
    Text(),
    None,
    "What the Will says.",
    "MQTT 3.1.1, 3.1.3.3; MQTT 5.0, 3.1.3.4",
    level="participant",
    aliases=("will.message", "lastwill.message", "last_will.payload"),
)
WILL_QOS: Final = Policy(
    "will.qos",
    quality(),
    "0",
    "The QoS of the Will.",
    "MQTT 3.1.1, 3.1.2.6; MQTT 5.0, 3.1.2.6",
    level="participant",
    aliases=("lastwill.qos", "last_will.qos"),
    stronger="higher",
)
WILL_RETAIN: Final = Policy(
    "will.retain",
    Flag(),
    "false",
    "Whether the Will is retained.",
    "MQTT 3.1.1, 3.1.2.7; MQTT 5.0, 3.1.2.7",
    level="participant",
    aliases=("lastwill.retain", "last_will.retain"),
)
WILL_DELAY: Final = Policy(
    "will.delay_interval",
    Seconds(),
    "0s",
    "How long the broker waits with the Will, in case the client comes back; 3.1.1 has no such field.",
    "MQTT 5.0, 3.1.3.2.2",
    level="participant",
    aliases=("will.delay",),
)
WILL_EXPIRY: Final = Policy(
    "will.message_expiry_interval",
    Seconds(),
    "infinite",
    "After how long in the broker the Will is no longer delivered.",
    "MQTT 5.0, 3.1.3.2.4",
    level="participant",
    aliases=("will.expiry",),
)
WILL_ALLOWED: Final = Policy(
    "will_allowed",
    Flag(),
    "true",
    "Whether the access control of the broker lets the client publish its Will; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    level="participant",
    derived=Derived(),
)
BRINGS_BACK: Final = Policy(
    "brings_back",
    Names(),
    "[]",
    "Filters of the topics that the client, a bridge, publishes here once more after another client has, because the other broker "
    "sends back what the bridge publishes there.",
    "Mosquitto, mosquitto.conf(5), try_private",
    level="participant",
)
# What follows from all clients together; filled in.
SAME_ID: Final = Policy(
    "client_id_taken",
    Flag(),
    "false",
    "Whether another client of the same broker has the same id; derived from all `client_id`.",
    "MQTT 3.1.1, 3.1.4; MQTT 5.0, 3.1.4",
    level="participant",
    derived=Derived(),
)
DOTTED: Final = Policy(
    "dotted",
    Flag(),
    "false",
    "Whether a topic of the client has a dot or a star and its broker changes these; derived from its topics.",
    "RabbitMQ 3.10.8, by running it",
    level="participant",
    derived=Derived(),
)
SESSION: Final = Policy(
    "session",
    Text(),
    "",
    "The client itself, where one of its subscriptions is not to see its own publications; derived from `no_local`.",
    "MQTT 5.0, 3.8.3.1",
    level="participant",
    derived=Derived(),
)
SUBSCRIBED: Final = Policy(
    "subscribed",
    Names(),
    "[]",
    "The filters of the client, where one client has to notice the loss of another; derived from the client's subscriptions.",
    level="participant",
    derived=Derived(),
)
