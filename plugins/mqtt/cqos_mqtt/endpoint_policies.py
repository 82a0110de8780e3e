"""What a publication or a subscription states in MQTT, and what follows for it from the other endpoints of its client."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Anything, Choice, Count, Derived, Duration, Flag, FromPeers, Names, Policy, Text
from cqos_mqtt.kinds import Seconds, quality, unlimited

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
    derived=Derived(("max_payload",)),
)
ENVELOPE_TO_BROKER: Final = Policy(
    "envelope_to_broker",
    Count(0, unit="bytes"),
    "0",
    "The same on the way to the broker, with a topic alias and the packet identifier that a QoS above 0 needs; derived.",
    "MQTT 3.1.1, 3.3.2.2; MQTT 5.0, 3.3.2.2",
    roles=PUBLICATION,
    derived=Derived(("max_payload", "qos", "topic_alias")),
)
PROPERTIES: Final = Policy(
    "property_bytes",
    Count(0, unit="bytes"),
    "0",
    "What the properties of a publication of 5.0 add, both to the broker and from it; derived from the expiry.",
    "MQTT 5.0, 3.3.2.3",
    roles=PUBLICATION,
    derived=Derived(("message_expiry_interval", "protocol_version")),
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
    derived=Derived(),
)
WILDCARDS: Final = Policy(
    "wildcards",
    Flag(),
    "false",
    "Whether the filter has wildcards; derived from the filter.",
    "MQTT 3.1.1, 4.7.1; MQTT 5.0, 4.7.1",
    roles=SUBSCRIPTION,
    derived=Derived(),
)
OVERLAPPING: Final = Policy(
    "overlapping",
    Flag(),
    "false",
    "Whether another filter of the same client matches the topic too; derived from the client's subscriptions.",
    "MQTT 3.1.1, 3.3.5; MQTT 5.0, 3.3.4",
    roles=SUBSCRIPTION,
    derived=Derived(),
)
REPEATED: Final = Policy(
    "repeated",
    Flag(),
    "false",
    "Whether the same client states the same filter again with other settings; derived from the client's subscriptions.",
    "MQTT 5.0, 3.8.4",
    roles=SUBSCRIPTION,
    derived=Derived(),
)
MIXED_QOS: Final = Policy(
    "mixed_qos",
    Flag(),
    "false",
    "Whether the same client publishes to the topic with another QoS too; derived from the client's publications.",
    "MQTT 3.1.1, 4.6",
    roles=PUBLICATION,
    derived=Derived(),
)
IS_WILL: Final = Policy(
    "will",
    Flag(),
    "false",
    "Whether this is the Will of a connection, which the broker publishes when the client is lost; derived from the client's `will`.",
    "MQTT 3.1.1, 3.1.2.5; MQTT 5.0, 3.1.2.5",
    roles=PUBLICATION,
    derived=Derived(),
)
CLOSING: Final = Policy(
    "closing_message",
    Flag(),
    "false",
    "Whether the client itself publishes to the topic of its Will, as it must where it ends in good order; derived from the client's publications.",
    "MQTT 3.1.1, 3.14.4; MQTT 5.0, 3.14.4",
    roles=PUBLICATION,
    derived=Derived(),
)

BROUGHT_BACK: Final = Policy(
    "brought_back",
    Flag(),
    "false",
    "Whether a bridge publishes the message here once more; derived from the clients' `brings_back`.",
    "Mosquitto, mosquitto.conf(5), try_private",
    roles=PUBLICATION,
    derived=Derived(),
)
RESERVED: Final = Policy(
    "reserved_topic",
    Flag(),
    "false",
    "Whether the topic is one on which only the broker itself publishes, `$SYS/…`; derived from the topic.",
    "MQTT 3.1.1, 4.7.2; MQTT 5.0, 4.7.2",
    roles=PUBLICATION,
    derived=Derived(),
)
MAY_PUBLISH: Final = Policy(
    "may_publish",
    Flag(),
    "true",
    "Whether the access control of the broker lets the client publish here; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=PUBLICATION,
    derived=Derived(),
)
CONTROLLED: Final = Policy(
    "controlled_topic",
    Text(),
    "",
    "The topic, where the broker controls who reads it; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=PUBLICATION,
    derived=Derived(),
)
READABLE: Final = Policy(
    "readable",
    Names(),
    "[]",
    "What the access control of the broker lets the client read, empty where that is not known; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=SUBSCRIPTION,
    derived=Derived(),
)
UNREADABLE: Final = Policy(
    "unreadable",
    Names(),
    "[]",
    "What the access control of the broker keeps from the client; derived from the broker's `acl`.",
    "Mosquitto, mosquitto.conf(5), acl_file",
    roles=SUBSCRIPTION,
    derived=Derived(),
)
TOPIC_AT_BROKER: Final = Policy(
    "topic_at_broker",
    Text(),
    "",
    "The topic as the broker changes its dots and stars, empty where it does not; derived from the topic and the broker's `dots_separate`.",
    "RabbitMQ 3.10.8, by running it",
    roles=PUBLICATION,
    derived=Derived(),
)
FILTER_AT_BROKER: Final = Policy(
    "filter_at_broker",
    Text(),
    "",
    "A filter with wildcards as the broker changes its dots and stars, empty where it does not; derived from the topic and the broker's "
    "`dots_separate`.",
    "RabbitMQ 3.10.8, by running it",
    roles=SUBSCRIPTION,
    derived=Derived(),
)
_FILLS: Final = (
    *("qos", "max_payload", "taken_every", "granted_qos", "maximum_qos"),
    *("max_queued_messages", "max_queued_bytes", "queue_qos0_messages"),
)
# In bytes, some brokers do not count what is on its way.
_FILLS_BYTES: Final = (*_FILLS, "queue_grows", "max_inflight_messages", "receive_maximum")
# What all topics of a client bring together; the broker has one queue for each client.
QUEUE_LASTS: Final = Policy(
    "queue_lasts",
    Duration(),
    "0s",
    "For how long the client may be away until its queue in the broker is full; derived from what all its topics bring, in "
    "messages and in bytes.",
    "Mosquitto, mosquitto.conf(5), max_queued_messages and max_queued_bytes",
    roles=SUBSCRIPTION,
    derived=Derived(_FILLS, together=True),
)
PACED: Final = Policy(
    "paced",
    Flag(),
    "false",
    "Whether `taken_every` is stated for a topic of the client; else nobody knows whether its program keeps up; derived.",
    roles=SUBSCRIPTION,
    derived=Derived(("taken_every",), together=True),
)
BURSTS: Final = Policy(
    "client_burst",
    unlimited(0),
    "0",
    "How many messages may come to the client at once on all its topics, where a `burst` is stated; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_messages",
    roles=SUBSCRIPTION,
    derived=Derived(_FILLS, together=True),
)
BURST_BYTES: Final = Policy(
    "client_burst_bytes",
    unlimited(0, unit="bytes"),
    "0",
    "How many bytes of such a burst wait when its last message comes, where the broker bounds them; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_bytes",
    roles=SUBSCRIPTION,
    derived=Derived(_FILLS_BYTES, together=True),
)
WAITING: Final = Policy(
    "waiting",
    unlimited(0),
    "0",
    "How many messages of all topics of the client wait from one take to the next, where `taken_every` is stated; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_messages",
    roles=SUBSCRIPTION,
    derived=Derived(_FILLS, together=True),
)
WAITING_BYTES: Final = Policy(
    "waiting_bytes",
    unlimited(0, unit="bytes"),
    "0",
    "How many bytes of these wait when the last of them comes, where the broker bounds them; derived.",
    "Mosquitto, mosquitto.conf(5), max_queued_bytes",
    roles=SUBSCRIPTION,
    derived=Derived(_FILLS_BYTES, together=True),
)
