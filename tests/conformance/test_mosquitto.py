"""The MQTT pack against a running Mosquitto: what it predicts, and what arrives."""

import os
import time

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("paho.mqtt.client", reason="paho-mqtt is not installed: pip install paho-mqtt")

from tests.conformance.mosquitto import PATIENCE, Client, program, running, version
from tests.conformance.mqtt_table import DEPARTURES, DOCUMENT, document, sections

MISSING = program() is None
if MISSING and os.environ.get("CI") == "true":
    raise RuntimeError("Mosquitto is not installed, and where CI runs it has to be: apt-get install mosquitto")
# One process asks everything, so that the broker runs once.
pytestmark = [
    pytest.mark.skipif(MISSING, reason="Mosquitto is not installed: apt-get install mosquitto"),
    pytest.mark.xdist_group("mosquitto"),
]

ASKED = {
    "online: QoS of publication and subscription, versions": 36,
    "retained: QoS of publication and subscription, versions": 36,
    "late join: retain, retain handling, shares": 13,
    "offline: sessions, QoS, versions": 54,
    "offline, with queue_qos0_messages": 54,
    "expiry: waiting and retained messages, sessions": 13,
    "options: no local, retain as published, shares, overlaps": 11,
    "Will: QoS, end in good order or by a break": 12,
    "filters: which name each matches": 8632,
    "filters and names: which are valid": 106,
    "capabilities: max_qos, retain_available, max_packet_size": 34,
    "queue overflow: max_queued_messages": 2,
}


def test_what_is_predicted_is_what_happens():
    """All in one test, because every question is asked of a broker that has to be started."""
    unknown = {
        section.name: [each for each in section.differences if each[0] not in DEPARTURES] for section in sections()
    }
    assert {name: found for name, found in unknown.items() if found} == {}
    assert {section.name: section.asked for section in sections()} == ASKED
    written = DOCUMENT.read_text(encoding="utf-8")
    if f"Mosquitto {version()} does" in written:
        assert written == document(), "run: python -m tests.conformance.mqtt_table"


def test_a_broker_is_gone_when_its_block_is_left():
    with running() as broker:
        client = Client(broker)
        assert client.reason == "Success"
        client.close()
    assert broker.process.returncode is not None


def test_an_expiry_ends_no_message_that_has_left_the_broker():
    """So it bounds no age, and a subscriber that keeps what it did not ask for yet still has it."""
    with running() as broker:
        reader, writer = Client(broker), Client(broker)
        reader.subscribe([("t", 1)])
        reader.paho.loop_stop()
        writer.publish("t", 1, expiry=1, retain=True)
        time.sleep(2.2)
        late = Client(broker)
        late.subscribe([("t", 1)])
        assert late.collect() == []
        until = time.monotonic() + PATIENCE
        while not reader.messages and time.monotonic() < until:
            reader.paho.loop(0.1)
        assert [each.topic for each in reader.messages] == ["t"]
        for each in (reader, writer, late):
            each.close()
