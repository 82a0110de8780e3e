"""Whatever the input: a system that can be checked or an `InputError` with a place, and never anything else."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import InputError, check, read
from cqos_core.plugins import load_plugins

ASYNCAPI = b"""asyncapi: 3.0.0
info: {title: x}
servers: {a: {host: h, protocol: mqtt, protocolVersion: '5.0', bindings: {mqtt: {keepAlive: 30, lastWill: {topic: t, qos: 1}}}}}
channels: {c: {address: 'a/{b}/c', servers: [{$ref: '#/servers/a'}]}}
operations: {o: {action: send, channel: {$ref: '#/channels/c'}, traits: [{bindings: {mqtt: {qos: 1}}}], bindings: {mqtt: {retain: true}}}}
"""
THING = {
    "@context": "https://www.w3.org/2022/wot/td/v1.1",
    "title": "x",
    "base": "mqtt://h",
    "properties": {
        "p": {
            "forms": [{"href": "a", "op": ["observeproperty", "writeproperty"], "mqv:filter": ["a/#"], "mqv:qos": "1"}]
        }
    },
}
FLOWS = [
    {
        "id": "b",
        "type": "mqtt-broker",
        "broker": "h",
        "port": "1883",
        "protocolVersion": "5",
        "willTopic": "w",
        "willMsg": {"delay": "1"},
    },
    {"id": "i", "type": "mqtt in", "broker": "b", "topic": "a/+", "qos": "2", "rh": 0},
    {"id": "o", "type": "mqtt out", "broker": "b", "topic": "a/b", "qos": "", "retain": ""},
]
CONF = b"listener 1883\nmax_qos 1\npersistence true\npersistent_client_expiration 2d\nmax_queued_messages 5\nconnection x\n"
SEEDS = {
    "asyncapi": ASYNCAPI,
    "wot": json.dumps(THING, indent=1).encode(),
    "node_red": json.dumps(FLOWS, indent=1).encode(),
    "mosquitto": CONF,
}
KEYS = (
    *(
        "asyncapi",
        "servers",
        "channels",
        "operations",
        "bindings",
        "mqtt",
        "protocol",
        "action",
        "channel",
        "$ref",
        "traits",
    ),
    *(
        "address",
        "publish",
        "subscribe",
        "properties",
        "forms",
        "href",
        "op",
        "mqv:topic",
        "type",
        "broker",
        "topic",
        "id",
    ),
)
PIECES = [
    b"\n",
    b" ",
    b": ",
    b"- ",
    b"{",
    b"}",
    b"[",
    b"]",
    b",",
    b'"',
    b"'",
    b"null",
    b"-1",
    b"3",
    b"#/a",
    b"$ref",
    b"\x00",
    b"\xff",
    b"true",
    b"+",
    b"#",
]


@pytest.mark.parametrize("name", SEEDS)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused_with_a_place(name, data):
    damaged = bytearray(SEEDS[name])
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(damaged)))
        end = min(len(damaged), start + data.draw(st.integers(0, 12)))
        damaged[start:end] = data.draw(st.sampled_from(PIECES) | st.binary(max_size=3))
    load_plugins().importers[name].load_claim()("x", bytes(damaged))
    try:
        system = read(bytes(damaged), importer=name)
    except InputError as error:
        refused = error
    else:
        assert check(system, protocol="mqtt").endpoints >= len(system.endpoints)
        return
    assert all(problem.place is not None for problem in refused.problems)


@pytest.mark.parametrize("name", ["asyncapi", "wot", "node_red"])
@given(
    tree=st.recursive(
        st.none()
        | st.booleans()
        | st.integers(-3, 5)
        | st.sampled_from(["a", "mqtt", "#/servers", "mqtt in", "3.0.0", ""]),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(
                    KEYS,
                ),
                inner,
                max_size=4,
            )
        ),
        max_leaves=20,
    )
)
def test_any_document_is_read_or_refused(name, tree):
    try:
        read(json.dumps(tree).encode(), importer=name)
    except InputError as error:
        refused = error
    else:
        return
    assert all(problem.place is not None for problem in refused.problems)
