"""The MQTT pack with the preset `rabbitmq_3_10` against a running RabbitMQ: what it predicts, and what arrives."""

from __future__ import annotations

import json
import os
from itertools import product
from typing import Any

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("paho.mqtt.client", reason="paho-mqtt is not installed: pip install paho-mqtt")

from cqos_core import check
from cqos_mqtt.rules import EFFECTIVE
from tests.conformance import mqtt_comparison as ask
from tests.conformance.mosquitto import PATIENCE, V3, V5, Client
from tests.conformance.rabbitmq import Rabbit, program, version

MISSING = program() is None
if MISSING and os.environ.get("CI") == "true":
    raise RuntimeError("RabbitMQ is not installed, and where CI runs it has to be: apt-get install rabbitmq-server")
pytestmark = [
    pytest.mark.skipif(MISSING, reason="RabbitMQ is not installed: apt-get install rabbitmq-server"),
    pytest.mark.xdist_group("rabbitmq"),
]
PRESET = {"profile": "rabbitmq_3_10", "queue_grows": True}
LEVELS = (0, 1, 2)


@pytest.fixture(scope="module")
def broker():
    with Rabbit() as running:
        yield running


def system(publication: Any, subscription: Any, topic: str = "t", written: str | None = None, **client: Any) -> bytes:
    return json.dumps(
        {
            "cqos": 1,
            "protocol": "mqtt",
            "options": {"mqtt": {"protocol_version": "3.1.1"}},
            "brokers": {"main": PRESET},
            "topics": {topic: {"period": "1s"}},
            "participants": {
                "p": {"publishes": {topic: publication}},
                "s": {"client": client, "subscribes": {written or topic: subscription}},
            },
        }
    ).encode()


def codes(text: bytes) -> set[str]:
    return {each.code for each in check(text, importer="yaml").findings}


def test_it_grants_one_and_delivers_the_lower_qos(broker):
    publisher, subscriber = Client(broker, V3), Client(broker, V3)
    assert subscriber.subscribe([(f"q/{p}/{s}", s) for p, s in product(LEVELS, LEVELS)]) == [0, 1, 1] * 3
    for p, s in product(LEVELS, LEVELS):
        publisher.publish(f"q/{p}/{s}", p)
    arrived = {each.topic: each.qos for each in subscriber.collect(9)}
    for p, s in product(LEVELS, LEVELS):
        assert arrived[f"q/{p}/{s}"] == ask.level(EFFECTIVE, system({"qos": p}, {"qos": s}))
    assert "MQTT404" in codes(system({"qos": 2}, {"qos": 2, "needs": {"duplicate_free": True}}))


@pytest.mark.parametrize("written", ["r/a", "r/+", "r/#", "#"])
def test_it_sends_retained_messages_to_names_only(broker, written):
    publisher = Client(broker, V3)
    publisher.publish("r/a", 1, retain=True)
    subscriber = Client(broker, V3)
    subscriber.subscribe([(written, 1)])
    arrived = [each.topic for each in subscriber.collect(1 if written == "r/a" else None)]
    need = {"qos": 1, "needs": {"late_join": 1}}
    unmet = "MQTT340" in codes(system({"qos": 1, "retain": True}, need, "r/a", written))
    assert ("r/a" in arrived) is not unmet


def test_sessions_are_there_after_a_stop_and_a_kill_and_retained_messages_after_a_stop(broker):
    for number, crash in enumerate((False, True)):
        absent = Client(broker, V3, f"absent{number}", clean=False)
        absent.subscribe([(f"kept/{number}", 1)])
        absent.close()
        publisher = Client(broker, V3)
        for payload in ("a", "b"):
            publisher.publish(f"kept/{number}", 1, payload=payload)
        publisher.publish(f"state/{number}", 1, retain=True)
        joined = Client(broker, V3)
        joined.subscribe([(f"state/{number}", 1)])
        assert [each.retain for each in joined.collect(1)] == [True]
        broker.end(crash=crash)
        broker.start()
        absent = Client(broker, V3, f"absent{number}", clean=False)
        assert [each.payload for each in absent.collect(2)] == ["a", "b"]
        if not crash:  # after a kill, what was retained in the last two seconds may be missing
            joined = Client(broker, V3)
            joined.subscribe([(f"state/{number}", 1)])
            assert [each.topic for each in joined.collect(1)] == [f"state/{number}"]
    for fault, lost in (("broker_stop", False), ("broker_crash", True)):
        need = {"qos": 1, "needs": {"late_join": 1, "survives": [fault]}}
        assert ("MQTT328" in codes(system({"qos": 1, "retain": True}, need))) is lost


def test_its_queue_has_no_limit(broker):
    absent = Client(broker, V3, "long", clean=False)
    absent.subscribe([("long", 1)])
    absent.close()
    publisher = Client(broker, V3)
    for number in range(1500):  # more than the thousand at which others stop
        last = publisher.paho.publish("long", str(number), 1)
    last.wait_for_publish(PATIENCE)
    absent = Client(broker, V3, "long", clean=False)
    assert [each.payload for each in absent.collect(1500)] == [str(number) for number in range(1500)]


def test_a_share_is_an_ordinary_topic(broker):
    member, publisher = Client(broker, V3), Client(broker, V3)
    member.subscribe([("$share/g/k", 1), ("k2", 1)])
    publisher.publish("k", 1)
    publisher.publish("k2", 1)
    assert [each.topic for each in member.collect(1)] == ["k2"]
    assert "MQTT208" in codes(system({"qos": 1}, {"qos": 1}, "k", "$share/g/k"))


@pytest.mark.parametrize(("name", "arrives"), [("a.b/c", "a/b/c"), ("a/*", "a/+"), ("a/b", "a/b")])
def test_dots_and_stars_change(broker, name, arrives):
    subscriber, publisher = Client(broker, V3), Client(broker, V3)
    subscriber.subscribe([("a/#", 1)])
    publisher.publish(name, 1)
    assert [each.topic for each in subscriber.collect(1)] == [arrives]
    assert ("MQTT624" in codes(system({"qos": 1}, {"qos": 1}, name))) is (name != arrives)


@pytest.mark.parametrize(
    ("name", "written"),
    [
        *product(("a.b",), ("+", "#", "a.b", "a.b/#")),
        *product(("x/a.b",), ("x/+", "x/#", "+/a.b")),
        *product(("a/*",), ("a/+", "a/*")),
        *product(("a.c/c/d",), ("+/c/#", "+/c/d", "a.c/+/+")),
    ],
)
def test_dots_make_levels(broker, name, written):
    subscriber, publisher = Client(broker, V3), Client(broker, V3)
    subscriber.subscribe([(written, 1), ("end", 1)])
    publisher.publish(name, 1)
    publisher.publish("end", 1)
    subscriber.wait(1)
    arrived = len(subscriber.collect()) == 2
    found = check(system({"qos": 1}, {"qos": 1}, name, written), importer="yaml")
    assert ("MQTT625" in {each.code for each in found.findings}) is not arrived
    assert bool(found.groups and found.groups[0].topic) is arrived


def test_it_refuses_version_5(broker):
    if version().startswith("3.10."):
        client = Client(broker, V5)
        assert client.ended
        assert client.reason != "Success"


@pytest.mark.parametrize("ends", ["close", "cut"])
def test_a_will_comes_after_a_break_only(broker, ends):
    watching = Client(broker, V3)
    watching.subscribe([("gone", 1), ("end", 1)])
    dying = Client(broker, V3, will={"topic": "gone", "payload": "x", "qos": 1})
    getattr(dying, ends)()
    if ends == "close":
        Client(broker, V3).publish("end", 1)
    assert [each.topic for each in watching.collect(1)] == (["gone"] if ends == "cut" else ["end"])
