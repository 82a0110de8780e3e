"""How people see the settings of MQTT: headings, names, and what each value means."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Panel

_QOS: Final = {
    "0": "The message is sent once and may be lost.",
    "1": "The message is sent until it is acknowledged, and may arrive twice.",
    "2": "The message arrives exactly once, at the cost of two round trips.",
}
_QOS_LABELS: Final = {"0": "0: at most once", "1": "1: at least once", "2": "2: exactly once"}
_SUBSCRIPTION: Final = ("retain_handling", "no_local", "retain_as_published", "subscription_identifier")
_WILL: Final = (
    *("will.topic", "will.payload", "will.qos", "will.retain"),
    *("will.delay_interval", "will.message_expiry_interval"),
)
_FLOW: Final = ("receive_maximum", "max_inflight_messages", "maximum_packet_size", "topic_alias_maximum")

PANEL: Final = Panel(
    groups={
        "Delivery": ("qos", "retain", "message_expiry_interval"),
        "Subscription": _SUBSCRIPTION,
        "Message": ("max_payload", "topic_alias"),
        "Program": ("taken_every", "needs_retain_flag"),
        "Session": ("clean_start", "session_expiry_interval", "stores_session", "keep_alive"),
        "Client": ("client_id", "generated_client_id", "username", "protocol_version", "broker"),
        "Flow": _FLOW,
        "Will": _WILL,
        "Bridge": ("brings_back",),
        "Topic": ("period", "size", "burst", "command"),
        "Deployment": ("outage", "repair_time", "implied_needs"),
    },
    advanced=(
        *("no_local", "retain_as_published", "subscription_identifier", "max_payload", "topic_alias"),
        *("taken_every", "needs_retain_flag", "stores_session", "generated_client_id", "username"),
        *(*_FLOW, *_WILL, "size", "burst", "repair_time", "implied_needs", "relayed", "brings_back"),
    ),
    labels={
        "qos": "QoS",
        "message_expiry_interval": "Message expiry",
        "session_expiry_interval": "Session expiry",
        "max_payload": "Largest payload",
        "client_id": "Client id",
        "generated_client_id": "New client id at each start",
        "username": "User name",
        "stores_session": "Session on disk",
        "needs_retain_flag": "Needs the RETAIN flag",
        "protocol_version": "MQTT version",
        "will.topic": "Topic of the Will",
        "will.payload": "Payload of the Will",
        "will.qos": "QoS of the Will",
        "will.retain": "Retain the Will",
        "will.delay_interval": "Delay of the Will",
        "will.message_expiry_interval": "Expiry of the Will",
        "repair_time": "Longest delay by the network",
        "brings_back": "Topics that it brings back",
        "implied_needs": "QoS without a requirement",
    },
    values={
        "qos": _QOS,
        "will.qos": _QOS,
        "retain": {
            "true": "The broker keeps the last message for later subscribers.",
            "false": "Only present subscribers get the message.",
        },
        "retain_handling": {
            "send": "Retained messages are sent at every subscribing.",
            "send_if_new": "They are sent only if the session does not have the subscription yet.",
            "do_not_send": "They are never sent at subscribing.",
        },
        "clean_start": {
            "true": "Each connection begins with a new session.",
            "false": "A connection goes on with the session that the broker kept.",
        },
        "keep_alive": {"off": "The client sends no pings."},
        "command": {
            "true": "Messages are orders, which a later subscriber must not carry out again.",
            "false": "Messages are no orders.",
        },
        "implied_needs": {
            "off": "It counts for nothing.",
            "note": "What it would promise and does not hold is a note.",
            "warning": "What it would promise and does not hold is a warning.",
        },
    },
    value_labels={"qos": _QOS_LABELS, "will.qos": _QOS_LABELS},
)
