"""``cqos snapshot mqtt`` sees what real clients did at a Mosquitto that runs, and reads answers of other brokers."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any, ClassVar

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.subscribeoptions import SubscribeOptions

import cqos_core as cqos
from cqos_live.mqtt.prove.mosquitto import Mosquitto, program
from tests.command_process import Done, run

COMMAND = str(Path(sys.executable).with_name("cqos"))
PATIENCE = 20

if os.environ.get("CI") != "true" and program() is None:
    pytest.skip("mosquitto is not installed", allow_module_level=True)


# Mosquitto


class Client:
    """A client of paho that waits until the broker has answered."""

    def __init__(
        self, broker: Mosquitto, name: str, *, five: bool, clean: bool = True, will: str | None = None
    ) -> None:
        version = paho.MQTTv5 if five else paho.MQTTv311
        of_3 = None if five else clean
        self.paho = paho.Client(CallbackAPIVersion.VERSION2, name, protocol=version, clean_session=of_3)
        self.answers = 0
        self.paho.on_connect = self.paho.on_subscribe = self.paho.on_unsubscribe = self.paho.on_publish = self.answered
        if will is not None:
            self.paho.will_set(will, "gone", 1, retain=True)
        self.paho.connect("127.0.0.1", broker.port, 30, clean_start=clean if five else paho.MQTT_CLEAN_START_FIRST_ONLY)
        self.paho.loop_start()
        self.wait(1)

    def answered(self, *_: Any) -> None:
        self.answers += 1

    def wait(self, answers: int) -> None:
        until = time.monotonic() + PATIENCE
        while self.answers < answers:
            assert time.monotonic() < until, "the broker does not answer"
            time.sleep(0.01)

    def does(self, what: str, *arguments: Any, **more: Any) -> None:
        wanted = self.answers + 1
        getattr(self.paho, what)(*arguments, **more)
        self.wait(wanted)

    def leave(self) -> None:
        self.paho.disconnect()
        self.paho.loop_stop()


@pytest.fixture
def broker(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Mosquitto]:
    mosquitto = Mosquitto(["log_timestamp_format %Y-%m-%dT%H:%M:%S", *request.param[0]], request.param[1])
    mosquitto.log = tmp_path / "farm.log"
    asyncio.run(mosquitto.start())
    yield mosquitto
    asyncio.run(mosquitto.close())


everything = pytest.mark.parametrize("broker", [(["log_type all"], ())], indirect=True)


@everything
def test_the_log_of_mosquitto_becomes_its_clients(broker: Mosquitto, tmp_path: Path):
    dash = Client(broker, "dash board", five=False, clean=False)
    dash.does("subscribe", [("farm/+/temp", 1), ("farm/#", 0), ("a 1 b/c", 2)])
    sensor = Client(broker, "sensor", five=True, will="farm/will")
    sensor.does("subscribe", "cmd", options=SubscribeOptions(qos=2, noLocal=True))
    alias = Properties(PacketTypes.PUBLISH)
    alias.TopicAlias = 3
    sensor.does("publish", "farm/1/temp", b"21", 1, retain=True, properties=alias)
    sensor.does("publish", "", b"22", 1, properties=alias)  # its topic is the alias
    sensor.does("publish", "it's, 'x'", b"23", 2)
    dash.does("unsubscribe", "farm/#")
    dash.leave()
    sensor.leave()
    asyncio.run(broker.end())
    system = cqos.read(broker.log)
    stated = {
        (each.participant, each.role, each.topic): {
            name: value.text for name, value in each.settings.items() if not value.unknown
        }
        for each in system.endpoints
    }
    assert set(stated) == {
        ("dash board", "subscriber", "farm/+/temp"),
        ("dash board", "subscriber", "a 1 b/c"),
        ("sensor", "subscriber", "cmd"),
        ("sensor", "publisher", "farm/1/temp"),
        ("sensor", "publisher", "it's, 'x'"),
    }
    # Options of 5.0 are not in the log; 3.1.1 has none, so there they are known.
    assert stated["sensor", "subscriber", "cmd"] == {"qos": "2"}
    assert stated["dash board", "subscriber", "a 1 b/c"]["no_local"] == "false"
    assert stated["sensor", "publisher", "it's, 'x'"] == {"qos": "2", "retain": "false"}
    client = {name: each.text for name, each in system.participants["sensor"].settings.items() if not each.unknown}
    assert client | {"broker": "farm"} == {
        "broker": "farm",
        "client_id": "sensor",
        "clean_start": "true",
        "keep_alive": "30s",
        "protocol_version": "5.0",
        "will.topic": "farm/will",
        "will.qos": "1",
        "will.retain": "true",
    }
    assert system.participants["dash board"].settings["clean_start"].text == "false"
    done = run(["snapshot", "mqtt", broker.log], tmp_path)
    assert done.code == 0, done.err
    again = cqos.read(done.out.encode())
    assert {(each.participant, each.role, each.topic) for each in again.endpoints} == set(stated)


@everything
def test_a_session_that_begins_anew_has_no_old_subscription(broker: Mosquitto):
    for topic in ("old", "new"):
        client = Client(broker, "one", five=False)
        client.does("subscribe", topic, 1)
        client.leave()
    asyncio.run(broker.end())
    assert [each.topic for each in cqos.read(broker.log).endpoints] == ["new"]


@pytest.mark.parametrize(
    "broker", [(["log_type all"], ["topic write open", "topic read open"]), (["log_type debug"], [])], indirect=True
)
def test_what_the_broker_refuses_is_no_endpoint(broker: Mosquitto):
    controlled = (broker.configuration.parent / "acl").exists()
    client = Client(broker, "one", five=False)
    client.does("subscribe", [("open", 1), ("closed", 1)])
    client.does("publish", "closed", b"", 1)
    client.does("publish", "open", b"", 1)
    client.leave()
    asyncio.run(broker.end())
    system = cqos.read(broker.log)
    found = sorted((each.role, each.topic or "") for each in system.endpoints)
    both = [("publisher", "open"), ("subscriber", "open")]
    refused = [each.message for each in system.notes if each.code == "MQTT946"]
    if controlled:
        # By an acl_file Mosquitto grants every subscription, and delivers nothing that is not to be read.
        assert found == [both[0], ("subscriber", "closed"), both[1]]
        assert refused == ["the broker refused what `one` published to `closed`"]
    else:
        # Without `log_type notice` and `subscribe` the log has neither connections nor granted subscriptions.
        assert found == [("publisher", "closed"), *both[:1], ("subscriber", "closed"), *both[1:]]
        assert refused == []


def test_a_subscription_that_is_asked_for_and_not_granted_is_refused():
    log = b"""1700000000: mosquitto version 2.0.18 starting
1700000001: Received SUBSCRIBE from one
1700000001: \topen (QoS 1)
1700000001: one 1 open
1700000001: \tclosed (QoS 1)
"""
    system = cqos.read(log)
    assert [each.topic for each in system.endpoints] == ["open"]
    assert {each.code: each.message for each in system.notes} == {
        "MQTT945": "no line of this log is about a publication, so who publishes is not known",
        "MQTT946": "the broker refused `one` the subscription of `closed`",
    }


@everything
def test_watching_prints_what_changes(broker: Mosquitto):
    first = Client(broker, "first", five=False)
    first.does("subscribe", "farm/temp", 1)
    command = [COMMAND, "snapshot", "mqtt", str(broker.log), "--watch", "--every", "0.2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        lines = [watching.stdout.readline() for _ in range(2)]
        second = Client(broker, "second", five=False)
        second.does("publish", "farm/temp", b"1", 0)
        lines += [watching.stdout.readline() for _ in range(2)]
        watching.send_signal(signal.SIGINT)
        try:
            watching.wait(PATIENCE)
        finally:
            watching.kill()
    assert lines[1::2] == ["+ first subscribes farm/temp (qos 1)\n", "+ second publishes farm/temp\n"]
    assert watching.returncode == 0
    first.leave()
    second.leave()


# Management interfaces: the answers of EMQX and HiveMQ are written by their documents, those of RabbitMQ were recorded


class Written(BaseHTTPRequestHandler):
    """Answers with what a test wrote, to clients that log in."""

    answers: ClassVar[dict[str, Any]] = {}

    def do_GET(self) -> None:
        known = self.headers.get("Authorization") == "Basic bWU6c2VjcmV0"
        answer = self.answers.get(self.path)
        self.send_response(200 if known and answer is not None else 404 if known else 401)
        self.end_headers()
        if known and answer is not None:
            self.wfile.write(answer if isinstance(answer, bytes) else json.dumps(answer).encode())

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@pytest.fixture
def interface() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), Written)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


ANSWERS: dict[str, dict[str, Any]] = {
    "emqx": {
        "/api/v5/clients?page=1&limit=1000": {
            "data": [
                {
                    "clientid": "dash",
                    "username": "joe",
                    "proto_name": "MQTT",
                    "proto_ver": 5,
                    "keepalive": 60,
                    "clean_start": False,
                    "expiry_interval": 7200,
                    "connected": True,
                }
            ],
            "meta": {"page": 1, "limit": 1000, "count": 2, "hasnext": True},
        },
        "/api/v5/clients?page=2&limit=1000": {
            "data": [{"clientid": "old", "proto_ver": 4, "keepalive": 30, "clean_start": True, "expiry_interval": 0}],
            "meta": {"page": 2, "limit": 1000, "count": 2, "hasnext": False},
        },
        "/api/v5/subscriptions?page=1&limit=1000": {
            "data": [
                {"clientid": "dash", "topic": "farm/#", "qos": 1, "nl": 1, "rap": 0, "rh": 2},
                {"clientid": "old", "topic": "farm/1", "qos": 0, "nl": 0, "rap": 0, "rh": 0},
            ],
            "meta": {"page": 1, "limit": 1000, "count": 2},
        },
    },
    "hivemq": {
        "/api/v1/mqtt/clients": {"items": [{"id": "dash"}], "_links": {"next": "/api/v1/mqtt/clients?cursor=x"}},
        "/api/v1/mqtt/clients?cursor=x": {"items": [{"id": "old"}]},
        "/api/v1/mqtt/clients/dash": {
            "client": {
                "id": "dash",
                "connected": True,
                "sessionExpiryInterval": 7200,
                "connection": {"keepAlive": 60, "mqttVersion": "MQTTv5", "cleanStart": False, "username": "joe"},
            }
        },
        "/api/v1/mqtt/clients/dash/subscriptions": {
            "items": [
                {
                    "topicFilter": "farm/#",
                    "qos": "AT_LEAST_ONCE",
                    "noLocal": True,
                    "retainAsPublished": False,
                    "retainHandling": "SEND_IF_NEW_SUBSCRIPTION",
                    "subscriptionIdentifier": None,
                }
            ]
        },
        "/api/v1/mqtt/clients/old": {
            "client": {"id": "old", "connection": {"keepAlive": 30, "mqttVersion": "MQTTv3_1_1", "cleanStart": True}}
        },
        "/api/v1/mqtt/clients/old/subscriptions": {"items": [{"topicFilter": "farm/1", "qos": "AT_MOST_ONCE"}]},
    },
}


def asked(interface: str, broker: str, user: str = "me") -> Done:
    environment = {**os.environ, "CQOS_BROKER_USER": user, "CQOS_BROKER_PASSWORD": "secret"}
    return run(["snapshot", "mqtt", interface, "--broker", broker], Path.cwd(), environment)


@pytest.mark.parametrize("broker", ANSWERS)
def test_the_interface_of_a_broker_reports_its_subscriptions(interface: str, broker: str, monkeypatch: Any):
    monkeypatch.setattr(Written, "answers", ANSWERS[broker])
    done = asked(interface, broker)
    assert done.code == 0, done.err
    system = cqos.read(done.out.encode())
    found = {(each.participant, each.topic): each for each in system.endpoints}
    assert {key: each.settings["qos"].text for key, each in found.items()} == {
        ("dash", "farm/#"): "1",
        ("old", "farm/1"): "0",
    }
    dash, old = (system.participants[name].settings for name in ("dash", "old"))
    assert (dash["protocol_version"].text, old["protocol_version"].text) == ("5.0", "3.1.1")
    assert (dash["keep_alive"].text, old["keep_alive"].text) == ("60s", "30s")
    options = found["dash", "farm/#"].settings
    assert options["no_local"].text == "true"
    assert options["retain_handling"].text == {"emqx": "do_not_send", "hivemq": "send_if_new"}[broker]
    assert dash["session_expiry_interval"].text == "7200s"


def test_what_rabbitmq_answered_becomes_its_clients(interface: str, monkeypatch: Any):
    """`record_rabbitmq` says which clients there were, and what they subscribed."""
    recorded = json.loads(Path(__file__).with_name("rabbitmq.json").read_text())
    assert recorded["version"] == "3.10.8"
    monkeypatch.setattr(Written, "answers", {f"/{path}": answer for path, answer in recorded["answers"].items()})
    done = asked(interface, "rabbitmq")
    assert done.code == 0, done.err
    system = cqos.read(done.out.encode())

    def stated_qos(each: Any) -> str:
        shared = [system.profiles[profile.name].settings for profile in each.profiles]
        return str(next(settings["qos"].text for settings in (each.settings, *shared) if "qos" in settings))

    assert {(each.participant, each.topic): stated_qos(each) for each in system.endpoints} == {
        ("dash board", "farm/+/temp"): "1",
        ("dash board", "farm/#"): "0",
        ("dash board", "a/b/c"): "1",  # RabbitMQ takes the dot of a.b/c for a slash, and grants 1 for 2
        ("old", "farm/1"): "1",
        ("old", "#"): "0",
        ("subscription-xqos1", "x*y/z"): "1",
        ("subscription-xqos1", "$share/g/k"): "1",
        ("subscription-xqos1", "/lead"): "0",
        ("gone", "left/#"): "1",
    }
    assert "sensor" in system.participants
    stated = {name: each.settings for name, each in system.participants.items()}
    assert {name: each["clean_start"].text for name, each in stated.items() if "clean_start" in each} == {
        "dash board": "false",
        "old": "true",
        "subscription-xqos1": "false",
        "gone": "false",
    }
    assert stated["dash board"]["protocol_version"].text == "3.1.1"
    [broker] = system.brokers.values()
    assert broker.settings["shared_subscription_available"].text == "false"


def test_an_interface_that_does_not_answer_as_expected_is_named(interface: str, monkeypatch: Any):
    monkeypatch.setattr(Written, "answers", {"/api/v1/mqtt/clients": b"<html>", "/api/connections": {"error": "x"}})
    refused = asked(interface, "emqx", user="other")
    assert (refused.code, "answers 401" in refused.err, "CQOS_BROKER_USER" in refused.err) == (2, True, True)
    assert "answers 404" in asked(interface, "emqx").err
    assert "does not answer with JSON" in asked(interface, "hivemq").err
    other = asked(interface, "rabbitmq")
    assert (other.code, "is it another broker?" in other.err) == (2, True)
    assert "no address of a management interface" in asked("ftp://x", "emqx").err
    assert "password in an address" in asked(interface.replace("//", "//me:secret@"), "emqx").err
    assert "--broker" in run(["snapshot", "mqtt", interface], Path.cwd()).err


def test_a_log_is_compared_with_its_design(tmp_path: Path):
    (tmp_path / "design.yaml").write_text(
        "cqos: 1\nprotocol: mqtt\nparticipants:\n  one: {protocol_version: 3.1.1, subscribes: {open: {qos: 2}}}\n"
    )
    (tmp_path / "broker.log").write_bytes(
        b"1: New client connected from 127.0.0.1:1 as one (p2, c1, k60).\n1: one 1 open\n"
    )
    done = run(["diff", "broker.log", "--against", "design.yaml"], tmp_path)
    assert (done.code, "qos is 2 in A (design.yaml:4" in done.out) == (1, True)
    assert run(["diff", "broker.log"], tmp_path).code == 2


def test_subscribers_that_lose_publishers_are_listed(tmp_path: Path):
    (tmp_path / "system.yaml").write_text("""cqos: 1
protocol: ros2
participants:
  good: {publishes: {scan: {reliability: reliable}, map: {reliability: best_effort}}}
  weak: {publishes: {scan: {reliability: best_effort}}}
  reader: {subscribes: {scan: {reliability: reliable}, map: {reliability: reliable}}}
""")
    done = run(["check", "system.yaml", "--show", "subscribers"], tmp_path)
    assert "reader/subscriber/scan loses 1 of 2 publishers on /scan\n" in done.out
    assert "reader/subscriber/map gets nothing on /map\n" in done.out
