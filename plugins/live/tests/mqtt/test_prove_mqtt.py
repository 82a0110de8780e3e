"""The runner without a broker: packets byte by byte, and what a configuration of Mosquitto can say."""

import asyncio

import pytest

from cqos_core.analysis.run_plan import prepare
from cqos_core.api import context
from cqos_core.api import read as read_system
from cqos_core.packs.prover import End, NotRunnableError, Outcome, Plan
from cqos_live.mqtt.prove import packets
from cqos_live.mqtt.prove.mosquitto import program
from cqos_live.mqtt.prove.runner import MOSQUITTO, access_list, configuration, connection
from cqos_live.prove.outcomes import not_seen
from cqos_mqtt.runnable_pairs import ensure_runnable


@pytest.mark.parametrize("value", [0, 1, 127, 128, 16_383, 16_384, 2_097_151, 2_097_152, 268_435_455])
def test_lengths_are_read_as_they_are_written(value):
    written = packets.number(value)
    assert len(written) == 1 + sum(value >= limit for limit in (128, 16_384, 2_097_152))
    if value <= 16_384:
        received = read(packets.packet(packets.PUBACK, 0, b"x" * value))
        assert (received.kind, len(received.body)) == (packets.PUBACK, value)


@pytest.mark.parametrize("five", [True, False])
@pytest.mark.parametrize("qos", [0, 1, 2])
def test_publications_are_read_as_they_are_written(five, qos):
    body = packets.text("a/ü") + (b"\0\7" if qos else b"") + (packets.properties({2: 60, 0x23: None}) if five else b"")
    received = read(packets.packet(packets.PUBLISH, qos << 1 | 1, body + b"12"))
    assert packets.publication(received, five=five) == packets.Message("a/ü", b"12", qos, True, 7 if qos else 0)


def test_limits_of_a_connack_are_found_behind_other_properties():
    entries: dict[int, int | str | None] = {0x12: "made-up", 0x21: 20, 0x13: 30, 0x0B: 300}
    received = packets.Packet(packets.CONNACK, 0, b"\0\0" + packets.properties(entries))
    assert packets.limits(received, five=True) == {0x21: 20, 0x13: 30, 0x0B: 300}


def read(data: bytes) -> packets.Packet:
    async def receive() -> packets.Packet:
        stream = asyncio.StreamReader()
        stream.feed_data(data)
        return await packets.receive(stream)

    return asyncio.run(receive())


def test_values_of_a_broker_become_its_configuration():
    lines = configuration(
        {
            "max_queued_messages": "unlimited",
            "max_inflight_messages": "7",
            "persistence": "true",
            "autosave_interval": "30min",
            "server_keep_alive": "2min",
            "session_expiry_interval": "2h",
        }
    )
    assert {
        "max_queued_messages 0",
        "max_queued_bytes 0",
        "max_inflight_messages 7",
        "persistence true",
        "autosave_interval 1800",
        "max_keepalive 120",
        "persistent_client_expiration 2h",
    } <= set(lines)
    assert not any("max_packet_size" in line for line in lines)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("granted_qos", "0"),
        ("shared_subscription_available", "false"),
        ("autosave_interval", "each_message"),
        ("maximum_packet_size", "10"),
        ("server_keep_alive", "0s"),
        ("session_expiry_interval", "90s"),
    ],
)
def test_what_mosquitto_cannot_be_configured_with_is_not_run(name, value):
    with pytest.raises(NotRunnableError, match=name if name != "session_expiry_interval" else "whole hours"):
        configuration({name: value})


def test_access_control_is_written_as_an_acl_file():
    lines = ["write alice home/#", "read - home/a", "readwrite * clients/%u/#"]
    written = access_list({"acl": str(lines).replace("'", '"')})
    assert written == ["topic read home/a", "user alice", "topic write home/#", "pattern readwrite clients/%u/#"]


def test_a_client_connects_with_what_is_stated():
    own = connection(
        End("p", {}, {"protocol_version": "3.1.1", "clean_start": "false", "client_id": "x", "keep_alive": "off"}),
        "publisher",
    )
    assert (own.five, own.clean, own.client_id, own.keep_alive, own.will) == (False, False, "x", 0, None)


ONE_ID = """
cqos: 1
protocol: mqtt
participants:
  server: {client: {client_id: server}, publishes: {news: {qos: 1}}}
  first: {client: {client_id: window}, subscribes: {news: {qos: 1}}}
  second: {client: {client_id: window}, subscribes: {news: {qos: 1}}, publishes: {old: {}}}
  third: {client: {client_id: other}, subscribes: {news: {qos: 1}, old: {}}}
"""


@pytest.mark.parametrize(
    ("publisher", "subscriber", "named"),
    [
        ("server/publisher/news", "first/subscriber/news", "first/subscriber/news"),
        ("second/publisher/old", "third/subscriber/old", "second/publisher/old"),
        ("server/publisher/news", "third/subscriber/news", None),
    ],
)
def test_clients_with_one_id_are_not_run(publisher, subscriber, named):
    """A run starts one of them, so it would contradict MQTT410."""
    where = context()
    plan = prepare(read_system(ONE_ID.encode(), importer="yaml"), publisher, subscriber, where, "mosquitto").plan
    if named is None:
        ensure_runnable(plan)
        return
    with pytest.raises(NotRunnableError, match=f"`{named}` has the id `window`"):
        ensure_runnable(plan)


@pytest.mark.parametrize(("arrived", "codes"), [(range(1, 20), []), (range(20), ["MQTT101"])])
def test_a_loss_in_a_run_shows_the_need_that_is_not_met(arrived, codes):
    own = """
cqos: 1
protocol: mqtt
participants:
  p: {publishes: {t: {qos: 0}}}
  s: {subscribes: {t: {needs: {loss_free: true}}}}
"""
    where = context()
    trial = prepare(read_system(own.encode(), importer="yaml"), "p/publisher/t", "s/subscriber/t", where, "mosquitto")
    outcome = Outcome("Mosquitto", (), matched=True, sent=tuple(range(20)), arrived=tuple(arrived))
    assert [code for code, _ in not_seen(trial, outcome, where)] == codes


@pytest.mark.skipif(program() is None, reason="Mosquitto is not installed: apt-get install mosquitto")
def test_a_will_is_not_sent_by_a_client():
    with pytest.raises(NotRunnableError, match="Will"):
        MOSQUITTO.prove(Plan("mqtt", "t", End("p", {"will": "true"}), End("s", {})))
