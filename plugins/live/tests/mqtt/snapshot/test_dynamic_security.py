"""The dynamic security plugin of a Mosquitto that runs: what it refuses is what C-QoS reads from its file."""

import asyncio
import json
import os
import shutil
import time
from pathlib import Path

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion

import cqos_core as cqos
from cqos_core.model.source import Source
from cqos_live.mqtt.prove.mosquitto import Mosquitto, program
from cqos_mqtt.importers.dynamic_security import UnclearAccessError, access_of, users_of
from tests.command_process import run

PLUGIN = next((each for each in Path("/usr/lib").glob("*/mosquitto_dynamic_security.so")), None)
PATIENCE = 20
needs_plugin = pytest.mark.skipif(
    os.environ.get("CI") != "true"
    and (program() is None or PLUGIN is None or shutil.which("mosquitto_passwd") is None),
    reason="mosquitto with its dynamic security plugin is not installed",
)
ROLES = [
    {
        "rolename": "sensors",
        "acls": [{"acltype": "publishClientSend", "topic": "farm/+/temp", "allow": True, "priority": 0}],
    },
    {
        "rolename": "readers",
        "acls": [
            {"acltype": "subscribePattern", "topic": "farm/#", "allow": True, "priority": 0},
            {"acltype": "unsubscribePattern", "topic": "#", "allow": True, "priority": 0},
        ],
    },
]
DEFAULTS = {"publishClientSend": False, "publishClientReceive": True, "subscribe": False, "unsubscribe": True}


def document(**changes):
    clients = [
        {"username": "sensor", "roles": [{"rolename": "sensors", "priority": -1}]},
        {"username": "dash board", "groups": [{"groupname": "people"}], "roles": []},
        {"username": "gone", "disabled": True, "roles": [{"rolename": "sensors"}]},
        {"username": "spare", "roles": []},
    ]
    groups = [{"groupname": "people", "roles": [{"rolename": "readers"}], "clients": [{"username": "dash board"}]}]
    return {"defaultACLAccess": DEFAULTS, "clients": clients, "groups": groups, "roles": ROLES, **changes}


def source(found):
    return Source("dynamic-security.json", json.dumps(found).encode())


def test_roles_of_users_and_groups_are_lines_of_access_control():
    assert sorted(access_of(source(document()))) == ["read dash_board farm/#", "write sensor farm/+/temp"]
    assert users_of(source(document())) == ["dash board", "sensor", "spare"]
    open_to_all = {"publishClientSend": True, "publishClientReceive": True, "subscribe": True}
    assert access_of(source(document(defaultACLAccess=open_to_all)))[:2] == ["write * #", "read * #"]
    assert access_of(source(document(clients=[], groups=[]))) == ["deny * #"]
    anonymous = access_of(source(document(anonymousGroup="people")))
    assert "read - farm/#" in anonymous


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ({"acltype": "publishClientSend", "topic": "a", "allow": False}, "depends on priorities"),
        ({"acltype": "subscribeLiteral", "topic": "a/#", "allow": True}, "as it stands only"),
        ({"acltype": "publishClientSend", "topic": "a/%c", "allow": True}, "version of Mosquitto"),
        ({"acltype": "publishClientSend"}, "no `topic`"),
    ],
)
def test_what_lines_cannot_say_is_not_read(entry, reason, tmp_path):
    found = document(roles=[{"rolename": "sensors", "acls": [entry]}])
    with pytest.raises(UnclearAccessError, match=reason):
        access_of(source(found))
    (tmp_path / "security.json").write_text(json.dumps(found))
    (tmp_path / "mosquitto.conf").write_text(
        "listener 1883\nplugin /usr/lib/mosquitto_dynamic_security.so\nplugin_opt_config_file security.json\n"
    )
    system = cqos.read(tmp_path / "mosquitto.conf")
    assert [each.code for each in system.notes] == ["MQTT941"]
    assert "acl" not in next(iter(system.brokers.values())).settings


@pytest.mark.parametrize("data", [b"{", b"[]", b'{"clients": 1}', b'{"clients": [{}]}', b"[" * 100_000])
def test_another_file_is_refused_in_words(data):
    with pytest.raises(UnclearAccessError):
        access_of(Source("x", data))


@pytest.fixture
def broker(tmp_path):
    """A Mosquitto whose users were made by its own program."""
    file = tmp_path / "dynamic-security.json"
    mosquitto = Mosquitto(["log_type all", f"plugin {PLUGIN}", f"plugin_opt_config_file {file}"])
    mosquitto.log = tmp_path / "farm.log"
    text = mosquitto.configuration.read_text().replace("allow_anonymous true", "allow_anonymous false")
    mosquitto.configuration.write_text(text)
    found = document()
    for client in found["clients"]:
        client.update(hashed("secret"))
    file.write_text(json.dumps(found))
    file.chmod(0o600)
    asyncio.run(mosquitto.start())
    yield mosquitto, file
    asyncio.run(mosquitto.close())


def hashed(password):
    import base64
    import hashlib

    salt = b"twelve bytes"
    found = hashlib.pbkdf2_hmac("sha512", password.encode(), salt, 101)
    return {"password": base64.b64encode(found).decode(), "salt": base64.b64encode(salt).decode(), "iterations": 101}


def connected(port, user):
    said = []
    client = paho.Client(CallbackAPIVersion.VERSION2, user, protocol=paho.MQTTv5)
    client.username_pw_set(user, "secret")
    client.on_connect = lambda *each: said.append(("connected", each[3].value))
    client.on_subscribe = lambda *each: said.append(("subscribed", [code.value for code in each[3]]))
    client.on_publish = lambda *each: said.append(("published", each[3].value))
    client.on_message = lambda *each: said.append(("got", each[2].topic))
    client.connect("127.0.0.1", port)
    client.loop_start()
    wait(lambda: said)
    return client, said


def wait(done):
    until = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < until, "the broker does not answer"
        time.sleep(0.01)


@needs_plugin
def test_the_plugin_refuses_what_its_file_says(broker, tmp_path):
    mosquitto, file = broker
    dash, seen = connected(mosquitto.port, "dash board")
    dash.subscribe([("farm/#", 1), ("other", 1)])
    wait(lambda: len(seen) == 2)
    assert seen[1] == ("subscribed", [1, 0x87])  # not authorized
    sensor, said = connected(mosquitto.port, "sensor")
    for number, (topic, code) in enumerate([("farm/1/temp", 0), ("farm/1/door", 0x87)], 2):
        sensor.publish(topic, b"", 1)
        wait(lambda number=number: len(said) == number)
        assert said[-1] == ("published", code)
    wait(lambda: ("got", "farm/1/temp") in seen)
    assert connected(mosquitto.port, "gone")[1][0][1] != 0
    for each in (dash, sensor):
        each.disconnect()
        each.loop_stop()
    asyncio.run(mosquitto.end())

    done = run(["snapshot", "mqtt", mosquitto.log, "--security", file, "--output", "running.yaml"], tmp_path)
    assert done.code == 0, done.err
    assert "1 user of" in done.err
    assert "did not connect: `spare`" in done.err
    system = cqos.read(tmp_path / "running.yaml")
    [running] = system.brokers.values()
    assert sorted(json.loads(running.settings["acl"].text)) == ["read dash_board farm/#", "write sensor farm/+/temp"]

    (tmp_path / "design.yaml").write_text(f"""cqos: 1
protocol: mqtt
include: [{mosquitto.configuration}]
participants:
  sensor: {{username: sensor, publishes: {{farm/1/temp: , farm/1/door: }}}}
  dash: {{username: dash board, subscribes: {{farm/1/temp: , farm/1/door: }}}}
""")
    report = cqos.check(tmp_path / "design.yaml")
    assert {(each.topic, each.verdict.value) for each in report.pairs} >= {("farm/1/temp", "compatible")}
    assert "MQTT621" in {each.code for each in report.findings}
    assert ("farm/1/door", "compatible") not in {(each.topic, each.verdict.value) for each in report.pairs}
