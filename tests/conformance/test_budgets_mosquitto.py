"""The bytes of MQTT messages as computed, and as a running Mosquitto and its clients send them, byte for byte."""

import os
import socket
import threading
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, cast

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("paho.mqtt", reason="paho-mqtt is not installed: pip install paho-mqtt")

from cqos_core.api import context, read
from cqos_core.behaviour.paths.budgets import budgets_of_system
from cqos_core.matching.pipeline import Pipeline
from tests.conformance.mosquitto import V3, V5, Client, program, running

if program() is None and os.environ.get("CI") != "true":
    pytest.skip("mosquitto is not installed", allow_module_level=True)

TOPIC = "bed/1/moisture"
SAMPLES = 5
TCP = 40
# QoS of publication and of subscription, size, expiry and identifier of the subscription.
PLAIN: tuple[tuple[Any, ...], ...] = (
    (0, 2, 10, 0, None),
    (1, 1, 100, 0, None),
    (2, 2, 5_000, 0, None),
    (2, 1, 200, 0, None),
)
OF_5: tuple[tuple[Any, ...], ...] = ((1, 1, 100, 60, 7), (1, 0, 20_000, 60, 200))
DESIGN = """
cqos: 1
protocol: mqtt
options: {{mqtt: {{protocol_version: "{version}"}}}}
brokers: {{hub: {{maximum_qos: 2}}}}
topics: {{{topic}: {{period: 1s, size: {size}}}}}
participants:
  a: {{broker: hub, client_id: a, publishes: {{{topic}: {{qos: {offered}{expiry}}}}}}}
  b: {{broker: hub, client_id: b, subscribes: {{{topic}: {{qos: {requested}{number}}}}}}}
"""


class Counter:
    """Counts what goes to a broker and from it, over a port of its own."""

    def __init__(self, port):
        self.there = self.back = 0
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.port = self.listening.getsockname()[1]
        self.target = port
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        client, _ = self.listening.accept()
        broker = socket.create_connection(("127.0.0.1", self.target))
        threading.Thread(target=self._pump, args=(client, broker, "there"), daemon=True).start()
        self._pump(broker, client, "back")

    def _pump(self, source, target, name):
        try:
            while data := source.recv(65_536):
                setattr(self, name, getattr(self, name) + len(data))
                target.sendall(data)
        except OSError:
            pass
        finally:
            target.close()


@contextmanager
def connected(broker, version, **more):
    """A client behind a counter."""
    counter = Counter(broker.port)
    client = Client(cast("Any", SimpleNamespace(port=counter.port)), version, **more)
    try:
        yield client, counter
    finally:
        client.close()
        counter.listening.close()


def measured(broker, version, offered, requested, size, expiry, number):
    """Return the bytes of a sample on the way to the broker, and from it."""
    with connected(broker, version) as (subscriber, from_broker), connected(broker, version) as (publisher, to_broker):
        subscriber.subscribe([(TOPIC, requested)], number)
        before = to_broker.there, from_broker.back
        for _ in range(SAMPLES):
            publisher.publish(TOPIC, offered, expiry=expiry or None, payload="x" * size)
        subscriber.collect(SAMPLES)
        assert len(subscriber.messages) == SAMPLES
        return (to_broker.there - before[0]) / SAMPLES, (from_broker.back - before[1]) / SAMPLES


@pytest.mark.parametrize("version", [V3, V5])
def test_messages_have_the_bytes_that_are_computed(version):
    cases = [*PLAIN, *(OF_5 if version == V5 else ())]
    with running() as broker:
        for offered, requested, size, expiry, number in cases:
            text = DESIGN.format(
                version=version,
                topic=TOPIC,
                size=size,
                offered=offered,
                requested=requested,
                expiry=f", message_expiry_interval: {expiry}s" if expiry else "",
                number=f", subscription_identifier: {number}" if number else "",
            )
            (stream,) = budgets_of_system(Pipeline(read(text.encode()), context())).streams
            ways = [stream.to_broker or (), stream.parts or ()]
            computed: list[int] = [sum([each * many for each, many in way]) - TCP for way in ways]
            assert [*measured(broker, version, offered, requested, size, expiry, number)] == computed
