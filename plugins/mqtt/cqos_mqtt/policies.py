"""The fields of MQTT 3.1.1 and 5.0: what a connection, a broker, a publication and a subscription may state.

Values stand in order where they have one. A value in quotes is written as a person writes it; seconds need no unit.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import TAKEN_EVERY, Anything, Choice, Count, Duration, Flag, FromPeers, Names, Policy, Text
from cqos_mqtt.kinds import Access, Raised, Seconds, quality, unlimited

PUBLICATION: Final = ("publisher",)
SUBSCRIPTION: Final = ("subscriber",)
VERSIONS: Final = ("3.1.1", "5.0")


# What a schema leaves open; see the AsyncAPI importer.
LEFT_OPEN: Final = {"unknown": Anything("its document leaves it open")}


def version() -> Choice:
    """Return the domain of a version of the protocol; the numbers on the wire are 4 and 5."""
    spellings = {"3.1.1": ("4", "311", "3.1", "3", "v3", "v311", "v3.1.1", "mqtt311"), "5.0": ("5", "v5", "mqtt5")}
    return Choice(*VERSIONS, synonyms={word: name for name, words in spellings.items() for word in words})


# What a publication or a subscription states ---------------------------------------------------------------

QOS: Final = Policy(
    "qos",
    quality(),
    "0",
    "With which guarantee a message goes to the broker, and at most from it to a subscriber: at most once, at least once, "
    "exactly once. What a subscription states is a maximum, not a demand.",
    "MQTT 3.1.1, 4.3; MQTT 5.0, 4.3",
    aliases=("quality_of_service",),
    stronger="higher",
)
RETAIN: Final = Policy(
    "retain",
    Flag(),
    "false",
    "Whether the broker keeps the last message of the topic for those who subscribe later.",
    "MQTT 3.1.1, 3.3.1.3; MQTT 5.0, 3.3.1.3",
    aliases=("retained",),
    roles=PUBLICATION,
    words={**LEFT_OPEN, "from_publishers": FromPeers("false", "any", side="publishers")},
)
EXPIRY: Final = Policy(
    "message_expiry_interval",
    Seconds(),
    "infinite",
    "After how long in the broker a message is no longer delivered; 3.1.1 has no such field.",
    "MQTT 5.0, 3.3.2.3.3",
    aliases=("message_expiry", "expiry"),
    roles=PUBLICATION,
    words=LEFT_OPEN,
)
PAYLOAD: Final = Policy(
    "max_payload",
    Count(0, 268_435_455, unit="bytes"),
    None,
    "The size of the largest payload.",
    "MQTT 5.0, 2.1.4",
    aliases=("payload_size",),
    roles=PUBLICATION,
)
ENVELOPE: Final = Policy(
    "envelope",
    Count(0, unit="bytes"),
    "0",
    "What a packet has at least around the largest payload: fixed header and topic; derived from the topic and the payload.",
    "MQTT 3.1.1, 2.2 and 3.3; MQTT 5.0, 2.1 and 3.3",
    roles=PUBLICATION,
    derived=True,
    follows=("max_payload",),
)
ENVELOPE_TO_BROKER: Final = Policy(
    "envelope_to_broker",
    Count(0, unit="bytes"),
    "0",
    "The same on the way to the broker, with a topic alias and the packet identifier that a QoS above 0 needs; derived.",
    "MQTT 3.1.1, 3.3.2.2; MQTT 5.0, 3.3.2.2",
    roles=PUBLICATION,
    derived=True,
    follows=("max_payload", "qos", "topic_alias"),
)
PROPERTIES: Final = Policy(
    "property_bytes",
    Count(0, unit="bytes"),
    "0",
    "What the properties of a publication of 5.0 add, both to the broker and from it; derived from the expiry.",
    "MQTT 5.0, 3.3.2.3",
    roles=PUBLICATION,
    derived=True,
    follows=("message_expiry_interval", "protocol_version"),
)
TOPIC_ALIAS: Final = Policy(
    "topic_alias",
    Count(0, 65_535),
    None,
    "The number sent in place of the topic's name.",
    "MQTT 5.0, 3.3.2.3.4",
    roles=PUBLICATION,
)
NO_LOCAL: Final = Policy(
    "no_local",
    Flag(),
    "false",
    "Whether the client's own publications are kept from this subscription; 3.1.1 cannot send it.",
    "MQTT 5.0, 3.8.3.1",
    aliases=("nl",),
    roles=SUBSCRIPTION,
)
RETAIN_AS_PUBLISHED: Final = Policy(
    "retain_as_published",
    Flag(),
    "false",
    "Whether forwarded messages keep their RETAIN flag; 3.1.1 cannot send it.",
    "MQTT 5.0, 3.8.3.1",
    aliases=("rap",),
    roles=SUBSCRIPTION,
)
RETAIN_HANDLING: Final = Policy(
    "retain_handling",
    Choice(
        "send",
        "send_if_new",
        "do_not_send",
        ordered=False,
        synonyms={"0": "send", "1": "send_if_new", "2": "do_not_send", "never": "do_not_send"},
    ),
    "send",
    "Whether retained messages are sent at subscribing: always, only where the session does not have the subscription yet, "
    "or never; 3.1.1 cannot send it.",
    "MQTT 5.0, 3.8.3.1",
    aliases=("rh",),
    roles=SUBSCRIPTION,
)
SUBSCRIPTION_ID: Final = Policy(
    "subscription_identifier",
    Count(1, 268_435_455, unlimited=("none",)),
    "none",
    "The number by which the client tells which of its subscriptions a message comes from; 3.1.1 cannot send it.",
    "MQTT 5.0, 3.8.2.1.2",
    aliases=("subscription_id",),
    roles=SUBSCRIPTION,
)
NEEDS_RETAIN_FLAG: Final = Policy(
    "needs_retain_flag",
    Flag(),
    "false",
    "Whether who subscribes must see which messages were retained when they were published, as a bridge must.",
    roles=SUBSCRIPTION,
    stronger="higher",
)

# What follows from the name and from the other endpoints of a client; filled in.
SHARED: Final = Policy(
    "shared",
    Flag(),
    "false",
    "Whether the subscription is a share of a group, `$share/group/filter`; derived from the filter.",
    "MQTT 5.0, 4.8.2",
    roles=SUBSCRIPTION,
    derived=True,
)
WILDCARDS: Final = Policy(
    "wildcards",
    Flag(),
    "false",
    "Whether the filter has wildcards; derived from the filter.",
    "MQTT 3.1.1, 4.7.1; MQTT 5.0, 4.7.1",
    roles=SUBSCRIPTION,
    derived=True,
)
OVERLAPPING: Final = Policy(
    "overlapping",
    Flag(),
    "false",
    "Whether another filter of the same client matches the topic too; derived from the client's subscriptions.",
    "MQTT 3.1.1, 3.3.5; MQTT 5.0, 3.3.4",
    roles=SUBSCRIPTION,
    derived=True,
)
REPEATED: Final = Policy(
    "repeated",
    Flag(),
    "false",
    "Whether the same client states the same filter again with other settings; derived from the client's subscriptions.",
    "MQTT 5.0, 3.8.4",
    roles=SUBSCRIPTION,
    derived=True,
)
MIXED_QOS: Final = Policy(
    "mixed_qos",
    Flag(),
    "false",
    "Whether the same client publishes to the topic with another QoS too; derived from the client's publications.",
    "MQTT 3.1.1, 4.6",
    roles=PUBLICATION,
    derived=True,
)
IS_WILL: Final = Policy(
    "will",
    Flag(),
    "false",
    "Whether this is the Will of a connection, which the broker publishes when the client is lost; derived from the client's `will`.",
    "MQTT 3.1.1, 3.1.2.5; MQTT 5.0, 3.1.2.5",
    roles=PUBLICATION,
    derived=True,
)
CLOSING: Final = Policy(
    "closing_message",
    Flag(),
    "false",
    "Whether the client itself publishes to the topic of its Will, as it must where it ends in good order; derived from the client's publications.",
    "MQTT 3.1.1, 3.14.4; MQTT 5.0, 3.14.4",
    roles=PUBLICATION,
    derived=True,
)

RESERVED: Final = Policy(
    "reserved_topic",
    Flag(),
    "false",
    "Whether the topic is one on which only the broker itself publishes, `$SYS/…`; derived from the topic.",
    "MQTT 3.1.1, 4.7.2; MQTT 5.0, 4.7.2",
    roles=PUBLICATION,
    derived=True,
)
MAY_PUBLISH: Final = Policy(
    "may_publish",
    Flag(),
    "true",
    "Whether the access control of the broker lets the client publish here; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=PUBLICATION,
    derived=True,
)
CONTROLLED: Final = Policy(
    "controlled_topic",
    Text(),
    "",
    "The topic, where the broker controls who reads it; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=PUBLICATION,
    derived=True,
)
READABLE: Final = Policy(
    "readable",
    Names(),
    "[]",
    "What the access control of the broker lets the client read, empty where that is not known; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=SUBSCRIPTION,
    derived=True,
)
UNREADABLE: Final = Policy(
    "unreadable",
    Names(),
    "[]",
    "What the access control of the broker keeps from the client; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=SUBSCRIPTION,
    derived=True,
)
_FILLS: Final = (
    *("qos", "max_payload", "taken_every", "granted_qos", "maximum_qos"),
    *("max_queued_messages", "max_queued_bytes", "queue_qos0_messages"),
)
# What all topics of a client bring together; the broker has one queue for each client.
QUEUE_LASTS: Final = Policy(
    "queue_lasts",
    Duration(),
    "0s",
    "For how long the client may be away until its queue in the broker is full; derived from what all its topics bring, in "
    "messages and in bytes.",
    "Mosquitto, mosquitto.conf(5), max_queued_messages and max_queued_bytes",
    roles=SUBSCRIPTION,
    derived=True,
    follows=_FILLS,
    together=True,
)
PACED: Final = Policy(
    "paced",
    Flag(),
    "false",
    "Whether a `burst` or `taken_every` is stated for a topic of the client; else it is taken to keep up; derived.",
    roles=SUBSCRIPTION,
    derived=True,
    follows=("taken_every",),
    together=True,
)
BURSTS: Final = Policy(
    "client_burst",
    unlimited(0),
    "0",
    "How many messages may come to the client at once on all its topics, where a `burst` is stated; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_messages",
    roles=SUBSCRIPTION,
    derived=True,
    follows=_FILLS,
    together=True,
)
BURST_BYTES: Final = Policy(
    "client_burst_bytes",
    unlimited(0, unit="bytes"),
    "0",
    "How many bytes of such a burst wait when its last message comes, where the broker bounds them; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_bytes",
    roles=SUBSCRIPTION,
    derived=True,
    follows=_FILLS,
    together=True,
)
WAITING: Final = Policy(
    "waiting",
    unlimited(0),
    "0",
    "How many messages of all topics of the client wait from one take to the next, where `taken_every` is stated; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_messages",
    roles=SUBSCRIPTION,
    derived=True,
    follows=_FILLS,
    together=True,
)
WAITING_BYTES: Final = Policy(
    "waiting_bytes",
    unlimited(0, unit="bytes"),
    "0",
    "How many bytes of these wait when the last of them comes, where the broker bounds them; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_bytes",
    roles=SUBSCRIPTION,
    derived=True,
    follows=_FILLS,
    together=True,
)

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
    "Whether the client's part of the session is on disk, so that what is not sent or not acknowledged yet is sent after its "
    "program was killed. Most libraries keep it in memory only.",
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
    derived=True,
)
# What follows from all clients together; filled in.
SAME_ID: Final = Policy(
    "client_id_taken",
    Flag(),
    "false",
    "Whether another client of the same broker has the same id; derived from all `client_id`.",
    "MQTT 3.1.1, 3.1.4; MQTT 5.0, 3.1.4",
    level="participant",
    derived=True,
)
SESSION: Final = Policy(
    "session",
    Text(),
    "",
    "The client itself, where one of its subscriptions is not to see its own publications; derived from `no_local`.",
    "MQTT 5.0, 3.8.3.1",
    level="participant",
    derived=True,
)
SUBSCRIBED: Final = Policy(
    "subscribed",
    Names(),
    "[]",
    "The filters of the client, where one client has to notice the loss of another; derived from the client's subscriptions.",
    level="participant",
    derived=True,
)

# What a broker can do ---------------------------------------------------------------------------------------

IMPLEMENTATION: Final = Policy(
    "implementation",
    Choice("mosquitto", "hivemq_ce", "emqx", "aws_iot_core", "zenoh", "other", ordered=False),
    None,
    "Which software it is; `cqos explain` says what of a pair was seen on that.",
    level="broker",
)

MAXIMUM_QOS: Final = Policy(
    "maximum_qos",
    quality(),
    "2",
    "The highest QoS it takes; a publication above it ends the connection.",
    "MQTT 5.0, 3.2.2.3.4",
    level="broker",
    aliases=("max_qos",),
    stronger="higher",
)
GRANTED_QOS: Final = Policy(
    "granted_qos",
    quality(),
    "2",
    "The highest QoS it grants a subscription, where that is less than it takes.",
    "MQTT 3.1.1, 3.9.3; MQTT 5.0, 3.9.3",
    level="broker",
    stronger="higher",
)
RETAIN_AVAILABLE: Final = Policy(
    "retain_available",
    Flag(),
    "true",
    "Whether it keeps retained messages; if not, a retained publication ends the connection.",
    "MQTT 5.0, 3.2.2.3.5",
    level="broker",
    stronger="higher",
)
WILDCARD_AVAILABLE: Final = Policy(
    "wildcard_subscription_available",
    Flag(),
    "true",
    "Whether it takes filters with wildcards.",
    "MQTT 5.0, 3.2.2.3.11",
    level="broker",
    stronger="higher",
)
SHARED_AVAILABLE: Final = Policy(
    "shared_subscription_available",
    Flag(),
    "true",
    "Whether it takes shared subscriptions.",
    "MQTT 5.0, 3.2.2.3.13",
    level="broker",
    stronger="higher",
)
IDENTIFIER_AVAILABLE: Final = Policy(
    "subscription_identifier_available",
    Flag(),
    "true",
    "Whether it takes subscription identifiers.",
    "MQTT 5.0, 3.2.2.3.12",
    level="broker",
    stronger="higher",
)
BROKER_SESSION_EXPIRY: Final = Policy(
    "session_expiry_interval",
    Seconds(),
    "infinite",
    "The longest time that it keeps a session, whatever the client asks for.",
    "MQTT 5.0, 3.2.2.3.2",
    level="broker",
    aliases=("persistent_client_expiration", "maximum_session_expiry"),
    stronger="higher",
)
SERVER_KEEP_ALIVE: Final = Policy(
    "server_keep_alive",
    Seconds(65_535),
    "infinite",
    "The longest keep alive that it allows; it takes the place of a longer one of a client of 5.0.",
    "MQTT 5.0, 3.2.2.3.14",
    level="broker",
    aliases=("max_keepalive",),
    stronger="lower",
)
BROKER_RECEIVE_MAXIMUM: Final = Policy(
    "receive_maximum",
    Count(1, 65_535),
    "65535",
    "How many messages of QoS 1 and 2 a client may send before it waits for an answer.",
    "MQTT 5.0, 3.2.2.3.3",
    level="broker",
    stronger="higher",
)
BROKER_PACKET_SIZE: Final = Policy(
    "maximum_packet_size",
    unlimited(unit="bytes"),
    "unlimited",
    "The largest packet that it takes.",
    "MQTT 5.0, 3.2.2.3.6",
    level="broker",
    aliases=("max_packet_size",),
    stronger="higher",
)
BROKER_ALIASES: Final = Policy(
    "topic_alias_maximum",
    Count(0, 65_535),
    None,
    "The highest topic alias that it understands; a broker that announces none understands none.",
    "MQTT 5.0, 3.2.2.3.8",
    level="broker",
    stronger="higher",
)
OLDEST: Final = Policy("oldest_version", version(), "3.1.1", "The oldest version it speaks.", level="broker")
NEWEST: Final = Policy("newest_version", version(), "5.0", "The newest version it speaks.", level="broker")
INFLIGHT: Final = Policy(
    "max_inflight_messages",
    unlimited(1, 65_535),
    "unlimited",
    "How many messages of QoS 1 and 2 it has on their way to one client at most.",
    level="broker",
    stronger="higher",
)
QUEUED: Final = Policy(
    "max_queued_messages",
    unlimited(0),
    None,
    "How many messages it keeps for a client that is absent or slow; further messages are dropped, and the publisher gets no report.",
    level="broker",
    stronger="higher",
)
QUEUED_BYTES: Final = Policy(
    "max_queued_bytes",
    unlimited(0, unit="bytes"),
    "unlimited",
    "How many bytes of payload it keeps for a client that is absent or slow; what comes then is dropped.",
    "Mosquitto, mosquitto.conf(5), max_queued_bytes",
    level="broker",
    stronger="higher",
)
QUEUES_QOS0: Final = Policy(
    "queue_qos0_messages",
    Flag(),
    "false",
    "Whether it keeps messages of QoS 0 for absent clients too.",
    "MQTT 3.1.1, 3.1.2.4; MQTT 5.0, 4.1",
    level="broker",
    stronger="higher",
)
PERSISTENCE: Final = Policy(
    "persistence",
    Flag(),
    None,
    "Whether sessions and retained messages are still there after it was restarted.",
    level="broker",
    stronger="higher",
)
NOTICES_LATER: Final = Policy(
    "keep_alive_delay",
    Duration(bare_unit="s"),
    "0s",
    "By how much it notices a silent client later than one and a half keep alives, because it looks only now and then.",
    "C-QoS, Mosquitto by running it",
    level="broker",
)
AUTOSAVE: Final = Policy(
    "autosave_interval",
    Duration(bare_unit="s"),
    None,
    "How often it saves sessions, retained and waiting messages, so that a crash loses no more than what came since; 0s: each "
    "message is saved before it is acknowledged; infinite: it saves only when it ends in good order.",
    "Mosquitto, mosquitto.conf(5), autosave_interval",
    level="broker",
)
UPGRADES: Final = Policy(
    "upgrade_outgoing_qos",
    Raised(),
    "false",
    "Whether it delivers with the QoS of the subscription also where the publication has less, which MQTT does not allow.",
    level="broker",
)

ACCESS: Final = Policy(
    "acl",
    Access(),
    None,
    "Who may do what, one line each: `read`, `write`, `readwrite` or `deny`, the user (`*` everybody, `-` who gives no name), "
    "the filter. Where there is any, all else is forbidden.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    level="broker",
)

# What is known about a topic --------------------------------------------------------------------------------

TOPIC_NAME: Final = Policy("name", Text(), None, "The name or filter; judged where names are read.", level="topic")
PERIOD: Final = Policy(
    "period",
    Duration(),
    None,
    "The time between two messages.",
    level="topic",
    aliases=("publish_period",),
)
BURST: Final = Policy("burst", Count(), None, "How many messages may come at once.", level="topic")
COMMAND: Final = Policy(
    "command",
    Flag(),
    "false",
    "Messages are orders, which must not be carried out again for a later subscription.",
    level="topic",
)

# What is assumed of the deployment --------------------------------------------------------------------------

VERSION: Final = Policy(
    "protocol_version",
    version(),
    None,
    "The version of MQTT that a client speaks; where it is not stated, both are looked at.",
    "MQTT 3.1.1, 3.1.2.2; MQTT 5.0, 3.1.2.2",
    level="option",
    aliases=("version", "mqtt_version"),
    assume=VERSIONS,
)
BROKER: Final = Policy(
    "broker",
    Text(),
    None,
    "The broker that a client connects to; clients of different brokers never meet.",
    level="option",
)
IMPLIED_NEEDS: Final = Policy(
    "implied_needs",
    Choice("off", "note", "warning", ordered=False),
    "note",
    "What a stated QoS counts for where no requirement is stated: nothing, a note, or a warning.",
    level="option",
)

POLICIES: Final = (
    QOS,
    RETAIN,
    EXPIRY,
    PAYLOAD,
    ENVELOPE,
    ENVELOPE_TO_BROKER,
    PROPERTIES,
    TOPIC_ALIAS,
    NO_LOCAL,
    RETAIN_AS_PUBLISHED,
    RETAIN_HANDLING,
    SUBSCRIPTION_ID,
    NEEDS_RETAIN_FLAG,
    TAKEN_EVERY,
    SHARED,
    WILDCARDS,
    OVERLAPPING,
    REPEATED,
    MIXED_QOS,
    IS_WILL,
    CLOSING,
    RESERVED,
    MAY_PUBLISH,
    CONTROLLED,
    READABLE,
    UNREADABLE,
    QUEUE_LASTS,
    PACED,
    BURSTS,
    BURST_BYTES,
    WAITING,
    WAITING_BYTES,
    CLIENT_ID,
    USERNAME,
    GENERATED_ID,
    CLEAN,
    SESSION_EXPIRY,
    KEEP_ALIVE,
    STORES_SESSION,
    RECEIVE_MAXIMUM,
    SENDS_AT_ONCE,
    PACKET_SIZE,
    ALIASES,
    WILL_TOPIC,
    WILL_PAYLOAD,
    WILL_QOS,
    WILL_RETAIN,
    WILL_DELAY,
    WILL_EXPIRY,
    WILL_ALLOWED,
    SAME_ID,
    SESSION,
    SUBSCRIBED,
    IMPLEMENTATION,
    MAXIMUM_QOS,
    GRANTED_QOS,
    RETAIN_AVAILABLE,
    WILDCARD_AVAILABLE,
    SHARED_AVAILABLE,
    IDENTIFIER_AVAILABLE,
    BROKER_SESSION_EXPIRY,
    SERVER_KEEP_ALIVE,
    BROKER_RECEIVE_MAXIMUM,
    BROKER_PACKET_SIZE,
    BROKER_ALIASES,
    OLDEST,
    NEWEST,
    INFLIGHT,
    QUEUED,
    QUEUED_BYTES,
    QUEUES_QOS0,
    PERSISTENCE,
    NOTICES_LATER,
    AUTOSAVE,
    UPGRADES,
    ACCESS,
    TOPIC_NAME,
    PERIOD,
    BURST,
    COMMAND,
    VERSION,
    BROKER,
    IMPLIED_NEEDS,
)
