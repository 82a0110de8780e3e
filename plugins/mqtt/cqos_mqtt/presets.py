"""Presets: brokers as they come, and the messages of Sparkplug B.

A broker's limits are those of its defaults; a broker with other limits states them beside the preset.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Preset


def a_broker(doc: str, *aliases: str, fixed: bool = False, hosts: tuple[str, ...] = (), **limits: str) -> Preset:
    """Write one broker: what it can do, its clause, whether its users cannot change that, and at which addresses it is for certain."""
    return Preset(limits, doc, aliases=aliases, level="broker", fixed=fixed, hosts=hosts)


def sparkplug(doc: str, qos: str, *, retain: bool = False) -> Preset:
    """Write one row of the table of Sparkplug B."""
    return Preset({"qos": qos, "retain": "true" if retain else "false"}, f"Sparkplug B 3.0: {doc}")


BROKERS: Final = {
    "mosquitto": a_broker(
        "Eclipse Mosquitto 2 without configuration (mosquitto.conf(5); receive maximum and topic aliases as it announces them; "
        "keep alives are looked at every 6 s; all times are in whole seconds).",
        "eclipse_mosquitto",
        implementation="mosquitto",
        max_queued_messages="1000",
        max_inflight_messages="20",
        receive_maximum="20",
        topic_alias_maximum="10",
        queue_qos0_messages="false",
        persistence="false",
        autosave_interval="30min",
        keep_alive_delay="7s",
        expiry_delay="1s",
    ),
    "hivemq_ce": a_broker(
        "HiveMQ Community Edition (config.xml: defaults of <mqtt> and <restrictions>).",
        "hivemq",
        implementation="hivemq_ce",
        max_queued_messages="1000",
        receive_maximum="10",
        topic_alias_maximum="5",
        maximum_packet_size="268435460",
        queue_qos0_messages="false",
        persistence="true",
    ),
    "emqx": a_broker(
        "EMQX 5 (configuration `mqtt`: defaults; its session_expiry_interval is for clients of 3.1.1; sessions and retained messages are in memory).",
        implementation="emqx",
        session_expiry_3_1_1="2h",
        max_queued_messages="1000",
        max_inflight_messages="32",
        receive_maximum="32",
        topic_alias_maximum="65535",
        maximum_packet_size="1048576",
        queue_qos0_messages="true",
        persistence="false",
    ),
    "aws_iot_core": a_broker(
        "A cloud broker without QoS 2: AWS IoT Core (AWS IoT Core message broker and protocol limits and quotas).",
        "cloud_without_qos_2",
        fixed=True,
        hosts=("*.iot.*.amazonaws.com", "*.iot.*.amazonaws.com.cn"),
        implementation="aws_iot_core",
        maximum_qos="1",
        session_expiry_interval="7d",
        session_expiry_3_1_1="1h",
        server_keep_alive="1200",
        receive_maximum="100",
        topic_alias_maximum="8",
        subscription_identifier_available="false",
        maximum_packet_size="131072",
        persistence="true",
    ),
    "rabbitmq_3_10": a_broker(
        "RabbitMQ 3.10 with its MQTT plugin and without configuration (seen by running 3.10.8; its in-flight limit is `mqtt.prefetch`; sessions of "
        "3.1.1 end after `mqtt.subscription_ttl`; what was retained in the last 2 s does not survive a crash). From 3.13 on it also speaks 5.0.",
        fixed=True,
        implementation="rabbitmq",
        newest_version="3.1.1",
        granted_qos="1",
        retained_by_name_only="true",
        dots_separate="true",
        shared_subscription_available="false",
        session_expiry_3_1_1="1d",
        max_queued_messages="unlimited",
        max_inflight_messages="10",
        queue_qos0_messages="false",
        persistence="true",
        autosave_interval="2s",
    ),
    "zenoh": a_broker(
        "The MQTT plug-in of Zenoh, which grants QoS 0 to everybody (zenoh-plugin-mqtt, README).",
        "zenoh_mqtt",
        fixed=True,
        implementation="zenoh",
        granted_qos="0",
        persistence="false",
    ),
}

SPARKPLUG: Final = {
    "sparkplug_message": sparkplug("NBIRTH, DBIRTH, NDATA, DDATA, DDEATH, NCMD and DCMD.", "0"),
    "sparkplug_death": sparkplug("NDEATH, which is the Will of an edge node.", "1"),
    "sparkplug_state": sparkplug("STATE, birth and death of a host application.", "1", retain=True),
    "sparkplug_commands": sparkplug("the subscription of an edge node to NCMD and DCMD, which come with QoS 0.", "1"),
}

NODE_RED: Final = {
    "node_red_in": Preset({"qos": "2"}, "A node `mqtt in` of Node-RED as it is created."),
    "node_red_out": Preset({"qos": "0", "retain": "false"}, "A node `mqtt out` of Node-RED as it is created."),
}

BRIDGES: Final = {
    "mqtt_client": Preset({"qos": "0", "retain": "false"}, "The MQTT side of mqtt_client (ROS 2) as it comes."),
    "mqtt_bridge": Preset({"qos": "0", "retain": "false"}, "The MQTT side of mqtt_bridge (ROS) as it comes."),
    "mosquitto_bridge": Preset({"qos": "0"}, "A topic of a connection of Mosquitto without a QoS."),
}

PRESETS: Final = {**BROKERS, **SPARKPLUG, **NODE_RED, **BRIDGES}
