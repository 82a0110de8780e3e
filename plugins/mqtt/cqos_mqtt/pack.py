"""The MQTT pack: fields, rules, guarantees, presets and filters, put together as one value."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    NEEDS,
    CommonMistake,
    Convention,
    Derivation,
    Dialect,
    Function,
    Implementations,
    RulePack,
    SystemFacts,
    Timing,
    TopicMatching,
)
from cqos_mqtt import filters, names, queues, sessions
from cqos_mqtt.broker_policies import IMPLEMENTATION
from cqos_mqtt.costs import COSTS
from cqos_mqtt.endpoint_policies import QOS
from cqos_mqtt.evidence import PROOFS
from cqos_mqtt.folding import FOLDING
from cqos_mqtt.guarantee_terms import GETS_RETAINED, NEVER_EXPIRES
from cqos_mqtt.guarantees import GUARANTEES, UNAFFECTED
from cqos_mqtt.importers.codes import CODES
from cqos_mqtt.panel import PANEL
from cqos_mqtt.policies import POLICIES
from cqos_mqtt.presets import PRESETS
from cqos_mqtt.rules import EFFECTIVE, RULES

COMMANDS: Final = {"command": "true"}
CONVENTIONS: Final = (
    Convention("$SYS/*", external=True, doc="What the broker tells of itself."),
    Convention(
        "mqtt_client/ros_msg_type/*", {"command": "false"}, doc="The type of messages that mqtt_client carries."
    ),
    Convention("*/set", COMMANDS, doc="Orders to a device (Home Assistant, Zigbee2MQTT)."),
    Convention("*/command", COMMANDS, doc="Orders to a device."),
    Convention("*/cmd", COMMANDS, doc="Orders to a device."),
    Convention("cmnd/*", COMMANDS, doc="Orders to a device (Tasmota)."),
    Convention("spBv1.0/*/[ND]CMD/*", COMMANDS, doc="Orders to an edge node or device (Sparkplug B)."),
    Convention("spBv1.0/STATE/*", external=True, doc="Births and deaths of host applications (Sparkplug B)."),
)

FUNCTIONS: Final = (
    Function("is_filter", names.is_filter, "Whether a text is a valid filter."),
    Function("is_topic", names.is_topic, "Whether a text is a valid name of a topic."),
    Function("may_read", names.may_read, "Whether a topic is among what may be read and not among what may not."),
    Function("filter_matches", filters.matches, "Whether a filter matches a topic."),
    Function("hears", names.hears, "Whether some of a list of filters matches a topic."),
)

DIALECTS: Final = {
    # System files of C-QoS, and all others: seconds need no unit where MQTT counts in seconds.
    "yaml": Dialect(),
    "bpmn": Dialect(bare_unit="s", writes={"name": "", "subscription_identifier": "subscription_id"}, words=("off",)),
}

# Retained messages are kept until they expire in the broker. Pings of the client's library show that it is there, whatever it
# sends, and no field of MQTT promises how often that is.
TIMING: Final = Timing(
    kept=("retain", ("true",)),
    replayed=GETS_RETAINED,
    kept_for="message_expiry_interval",
    expires=~NEVER_EXPIRES,
    period="period",
)

DERIVATIONS: Final = (
    Derivation(
        "arrives with QoS",
        EFFECTIVE,
        QOS,
        "the lowest of what is published, what is subscribed, and what the broker grants; a broker that raises QoS leaves out the first",
    ),
)

NOT_CHECKED: Final = (
    "whether user names, passwords, certificates and limits of connections let the clients connect",
    "whether the broker's access control lets them publish and subscribe, save what an acl_file says that was read",
    "whether subscribers keep up with what arrives, save where a `burst` or `taken_every` is stated",
    "what libraries do with messages that are published while they are not connected; they are taken to wait in the client",
    "messages that are published before a subscription is there, save retained ones",
    "delays of the network, which no expiry counts",
)

SLIPS: Final = (
    CommonMistake(r"(?:qos|reliability): best[_ ]effort", "qos: 0"),
    CommonMistake(r"(?:qos|reliability): reliable", "qos: 1"),
    CommonMistake(r"qos: (?:at_most_once|qos ?0)", "qos: 0"),
    CommonMistake(r"qos: (?:at_least_once|qos ?1)", "qos: 1"),
    CommonMistake(r"qos: (?:exactly_once|qos ?2)", "qos: 2"),
    CommonMistake(r"(?:qos ?)?([012])", r"{qos: \1}"),
    CommonMistake(r"at_most_once|best[_ ]effort|sensor_data", "{qos: 0}"),
    CommonMistake(r"at_least_once|reliable", "{qos: 1}"),
    CommonMistake(r"exactly_once", "{qos: 2}"),
    CommonMistake(r"retain(?:ed)?", "{retain: true}"),
    CommonMistake(r"durability: (?:transient_local|transient|persistent)|latched: true", "retain: true"),
    CommonMistake(r"durability: volatile|latched: false", "retain: false"),
    CommonMistake(r"(?:lifespan|ttl|expiry): (.+)", r"message_expiry: \1"),
)
"""Words of ROS 2 and DDS, and names of qualities where MQTT has numbers."""
PACK: Final = RulePack(
    id="mqtt",
    title="MQTT",
    summary="Messages over brokers by MQTT 3.1.1 and 5.0: publication, broker and subscription judged together.",
    policies=(*POLICIES, *NEEDS),
    rules=(*RULES, *GUARANTEES),
    presets=PRESETS,
    dialects=DIALECTS,
    conventions=CONVENTIONS,
    costs=COSTS,
    functions=FUNCTIONS,
    topic_matching=TopicMatching(
        names.resolve,
        folds=(
            ("differ only in upper and lower case", names.without_case),
            ("differ only in slashes at the ends", names.without_slashes),
            ("would meet but for a `$` at the start, which wildcards do not match", names.without_dollar),
        ),
        match=filters.match,
        overlapping="overlapping",
        one_way={"shared": "true"},
        described="publications and subscriptions of clients of one broker, where the filter matches the topic",
    ),
    system_facts=SystemFacts(sessions.complete, queues.sum_up, FOLDING),
    not_checked=NOT_CHECKED,
    unaffected=UNAFFECTED,
    derivations=DERIVATIONS,
    implementations=Implementations(
        IMPLEMENTATION.name,
        PROOFS,
        provers={"mosquitto": "cqos_live.mqtt.prove.runner:MOSQUITTO", "spin": "cqos_mqtt.promela.spin:SPIN"},
    ),
    common_mistakes=SLIPS,
    codes=CODES,
    panel=PANEL,
    timing=TIMING,
    source="OASIS MQTT 3.1.1 and 5.0, Sparkplug B 3.0; manuals of the brokers; Mosquitto by running it",
    validated=True,
)
