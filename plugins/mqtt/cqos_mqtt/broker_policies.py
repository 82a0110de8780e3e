"""What a broker of MQTT can do."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Choice, Count, Duration, Flag, Policy
from cqos_mqtt.endpoint_policies import version
from cqos_mqtt.kinds import Access, Raised, Saving, Seconds, quality, unlimited

# What a broker can do ---------------------------------------------------------------------------------------

NO_LIMIT: Final = {"no_limit": "unlimited"}
"""What 0 stands for in a limit of Mosquitto."""
IMPLEMENTATION: Final = Policy(
    "implementation",
    Choice("mosquitto", "hivemq_ce", "emqx", "aws_iot_core", "rabbitmq", "zenoh", "other", ordered=False),
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
RETAINED_BY_NAME_ONLY: Final = Policy(
    "retained_by_name_only",
    Flag(),
    "false",
    "Whether a new subscription gets retained messages only if its filter has no wildcards.",
    "RabbitMQ 3.10.8, by running it",
    level="broker",
    stronger="lower",
)
DOTS_SEPARATE: Final = Policy(
    "dots_separate",
    Flag(),
    "false",
    "Whether it takes a dot in a name for a slash, and a star for a plus sign.",
    "RabbitMQ 3.10.8, by running it",
    level="broker",
    stronger="lower",
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
SESSION_EXPIRY_3_1_1: Final = Policy(
    "session_expiry_3_1_1",
    Seconds(),
    "infinite",
    "How long it keeps the session of a client of 3.1.1, which cannot ask for a time, where that is shorter than `session_expiry_interval`.",
    "MQTT 3.1.1, 3.1.2.4",
    level="broker",
    stronger="higher",
)
SERVER_KEEP_ALIVE: Final = Policy(
    "server_keep_alive",
    Seconds(65_535),
    "infinite",
    "The longest keep alive that it allows; it takes the place of a longer one of a client of 5.0. 0 turns the keep alive of all clients "
    "of 5.0 off.",
    "MQTT 5.0, 3.2.2.3.14 and 3.1.2.10",
    level="broker",
    aliases=("max_keepalive",),
    words={"off": "0s"},
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
    unlimited(0, 65_535),
    "unlimited",
    "How many messages of QoS 1 and 2 it has on their way to one client at most; 0 is no limit.",
    level="broker",
    words=NO_LIMIT,
    zero="no_limit",
    stronger="higher",
)
QUEUED: Final = Policy(
    "max_queued_messages",
    unlimited(0),
    None,
    "How many messages it keeps for a client that is absent or slow; further messages are dropped, and the publisher gets no report. 0 is "
    "no limit.",
    level="broker",
    words=NO_LIMIT,
    zero="no_limit",
    stronger="higher",
)
QUEUED_BYTES: Final = Policy(
    "max_queued_bytes",
    unlimited(0, unit="bytes"),
    "unlimited",
    "How many bytes of payload it keeps for a client that is absent or slow; what comes then is dropped. 0 is no limit.",
    "Mosquitto, mosquitto.conf(5), max_queued_bytes",
    level="broker",
    words=NO_LIMIT,
    zero="no_limit",
    stronger="higher",
)
GROWS: Final = Policy(
    "queue_grows",
    Flag(),
    None,
    "Whether the queue of a connected client has room for as many messages more as may be on their way to it, whose bytes do not count. Mosquitto "
    "does so from 2.0.13 on.",
    "Mosquitto 2.0.13, db__ready_for_queue; seen by running 2.0.11 and 2.0.21",
    level="broker",
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
EXPIRY_DELAY: Final = Policy(
    "expiry_delay",
    Duration(bare_unit="s"),
    None,
    "By how much it delivers a message, or keeps a session, for longer than its expiry says, because it counts time in coarser steps.",
    "C-QoS, Mosquitto by running it",
    level="broker",
)
AUTOSAVE: Final = Policy(
    "autosave_interval",
    Saving(),
    None,
    "How often it saves sessions, retained and waiting messages, so that a crash loses no more than what came since; 0 or infinite: it "
    "saves only when it ends in good order; each_message: it saves each message before it acknowledges it.",
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
