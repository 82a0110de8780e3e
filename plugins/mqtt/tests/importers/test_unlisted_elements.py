"""Elements of documents that no table has: what is stated for the same is then not known, and the report says so."""

from __future__ import annotations

import json

import pytest

from cqos_core import check, read
from cqos_mqtt.importers import asyncapi, node_red, wot

# The properties of bindings/mqtt of spec-json-schemas of AsyncAPI, versions 0.1.0 and 0.2.0.
SERVER = {
    "clientId",
    "cleanSession",
    "lastWill",
    "keepAlive",
    "sessionExpiryInterval",
    "maximumPacketSize",
    "bindingVersion",
}
WILL = {"topic", "qos", "message", "retain"}
OPERATION = {"qos", "retain", "messageExpiryInterval", "bindingVersion"}
MESSAGE = {"payloadFormatIndicator", "correlationData", "contentType", "responseTopic", "bindingVersion"}
# The defaults of the MQTT nodes in 10-mqtt.html of Node-RED 4, without those that every node has.
BROKER = [
    "name",
    "broker",
    "port",
    "tls",
    "clientid",
    "autoConnect",
    "usetls",
    "verifyservercert",
    "compatmode",
    "protocolVersion",
    "keepalive",
    "cleansession",
    "autoUnsubscribe",
    "birthTopic",
    "birthQos",
    "birthRetain",
    "birthPayload",
    "birthMsg",
    "closeTopic",
    "closeQos",
    "closeRetain",
    "closePayload",
    "closeMsg",
    "willTopic",
    "willQos",
    "willRetain",
    "willPayload",
    "willMsg",
    "userProps",
    "sessionExpiry",
]
IN = ["name", "topic", "qos", "datatype", "broker", "nl", "rap", "rh", "inputs"]
OUT = ["name", "topic", "qos", "retain", "respTopic", "contentType", "userProps", "correl", "expiry", "broker"]


def test_every_field_of_asyncapi_is_in_a_table():
    assert asyncapi._OTHERS >= SERVER | OPERATION | MESSAGE
    assert asyncapi._WILL.keys() >= WILL


def test_every_field_of_node_red_is_in_a_table():
    assert {*node_red._OF_BROKERS, *node_red._OTHERS} >= {*BROKER}
    assert {*node_red._OF_NODES, *node_red._OTHERS} >= {*IN, *OUT}


def test_every_term_of_things_is_in_a_table():
    """Those of the MQTT binding template of WoT."""
    terms = {f"mqv:{each}" for each in ("controlPacket", "filter", "qos", "retain", "topic")}
    assert {*wot._TERMS, *wot._OTHER_TERMS} >= terms


def channels(server=None, operation=None, message=None):
    bindings = {"bindings": {"mqtt": {"qos": 1, **(operation or {})}}}
    channel = {"publish": bindings, "subscribe": {**bindings, "message": {"bindings": {"mqtt": message or {}}}}}
    return {
        "asyncapi": "2.6.0",
        "info": {"title": "t", "version": "1"},
        "servers": {"s": {"url": "h", "protocol": "mqtt", "bindings": {"mqtt": {"clientId": "c", **(server or {})}}}},
        "channels": {"t": channel},
    }


def thing(**terms):
    form = {"href": "mqtt://h", "mqv:filter": "t", **terms}
    return {
        "@context": "https://www.w3.org/2022/wot/td/v1.1",
        "title": "lamp",
        "events": {"on": {"forms": [{"op": "subscribeevent", **form}]}},
    }


def flows(broker=None, node=None):
    both = {"broker": "b", "topic": "t", "qos": "1"}
    return [
        {"id": "b", "type": "mqtt-broker", "broker": "h", "port": "1883", **(broker or {})},
        {"id": "i", "type": "mqtt in", **both, **(node or {})},
        {"id": "o", "type": "mqtt out", **both},
    ]


@pytest.mark.parametrize(
    ("plain", "more", "name"),
    [
        (channels(), channels(server={"flowWindow": 5}), "flowWindow"),
        (channels(), channels(operation={"priority": 5}), "priority"),
        (channels(), channels(server={"lastWill": {"topic": "t", "urgency": 3}}), "urgency"),
        (thing(), thing(**{"mqv:controlPacketValue": "SUBSCRIBE"}), "mqv:controlPacketValue"),
        (thing(), thing(**{"mqv:options": [{"mqv:optionName": "qos", "mqv:optionValue": 1}]}), "mqv:options"),
        (flows(), flows(broker={"window": 5}), "window"),
        (flows(), flows(node={"filterBy": "x"}), "filterBy"),
    ],
)
def test_what_no_table_has_is_named_and_is_not_green(plain, more, name):
    before, after = (check(json.dumps(each).encode()) for each in (plain, more))
    assert "MQTT948" not in {each.code for each in before.findings}
    found = [each for each in after.findings if each.code == "MQTT948"]
    assert found
    assert all(f"`{name}`" in each.message for each in found)
    assert {each.kind for each in after.coverage.unread} == {"element"}
    assert after.coverage.unclear or after.verdict == "unknown"
    assert after.verdict_words != "compatible"


def test_extensions_of_a_team_are_no_elements_of_the_format():
    assert "MQTT948" not in {each.code for each in check(json.dumps(channels(server={"x-team": 1})).encode()).findings}


def test_an_expiry_of_a_birth_message_is_read():
    broker = {"protocolVersion": "5", "birthTopic": "up", "birthMsg": {"expiry": "5"}}
    endpoint = next(each for each in read(json.dumps(flows(broker)).encode()).endpoints if each.topic == "up")
    assert endpoint.settings["message_expiry_interval"].text == "5"
