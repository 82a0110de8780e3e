"""Thing Descriptions, flows of Node-RED and configurations of Mosquitto; no importer claims a file of another format."""

import json
import os
from pathlib import Path
from typing import Any

import pytest

from cqos_core import InputError, Severity, check, read
from cqos_core.files.source_files import SentFiles, open_file, read_path
from cqos_core.files.source_reader import GivenSource, included_files, read_together
from cqos_mqtt.importers import detect
from cqos_mqtt.importers.codes import CODES

ROOT = Path(__file__).resolve().parents[4]
CLAIMS = {name: getattr(detect, f"claims_{name}") for name in ("asyncapi", "wot", "node_red", "mosquitto")}


def loud(*inputs: Any, **more: Any) -> list[str]:
    report = check(*inputs, **more)
    return [finding.code for finding in report.findings if finding.severity is not Severity.NOTE]


def settings(each: Any) -> dict[str, str]:
    return {name: setting.text for name, setting in each.settings.items()}


# Thing Descriptions

THING: dict[str, Any] = {
    "@context": "https://www.w3.org/2022/wot/td/v1.1",
    "title": "lamp",
    "base": "mqtt://broker:1883",
    "properties": {
        "state": {
            "forms": [
                {"href": "", "op": "observeproperty", "mqv:filter": "lamp/+/state", "mqv:qos": "1", "mqv:retain": True},
                {"href": "", "op": "writeproperty", "mqv:topic": "lamp/set", "mqv:qos": "2"},
            ]
        }
    },
    "events": {"gone": {"forms": [{"href": "mqtt://other/lamp/gone"}]}},
    "actions": {"blink": {"forms": [{"href": "", "mqv:controlPacket": "publish", "mqv:topic": "lamp/{id}/blink"}]}},
}


def test_a_thing_does_the_opposite_of_what_its_consumers_do():
    system = read(json.dumps(THING).encode())
    assert {each.id: settings(each) for each in system.endpoints} == {
        "lamp/publisher/lamp/+/state": {"qos": "1", "retain": "true"},
        "lamp/subscriber/lamp/set": {"qos": "2", "taken_every": "0s"},
        "lamp/subscriber/lamp/+/blink": {},
        "lamp at other/publisher/lamp/gone": {},
    }
    assert sorted(system.brokers) == ["broker:1883", "other"]


def test_the_qos_of_a_form_is_a_need():
    consumer = {
        "cqos": 1,
        "protocol": "mqtt",
        "participants": {"app": {"publishes": {"lamp/set": {"qos": 0}}, "subscribes": {"lamp/a/state": {"qos": 1}}}},
    }
    found = loud(json.dumps(THING).encode(), json.dumps(consumer).encode())
    assert [code for code in found if code.startswith("MQTT")] == ["MQTT101"]


def test_a_form_without_topic_is_reported():
    thing = {**THING, "properties": {"x": {"forms": [{"href": "mqtt://broker:1883", "mqv:qos": "0"}]}}}
    report = check(json.dumps(thing).encode())
    assert "MQTT920" in [finding.code for finding in report.findings]


# Node-RED

BROKER = {
    "id": "b1",
    "type": "mqtt-broker",
    "name": "",
    "broker": "localhost",
    "port": "1883",
    "clientid": "",
    "autoConnect": True,
    "usetls": False,
    "protocolVersion": "4",
    "keepalive": "60",
    "cleansession": True,
    "birthTopic": "",
    "birthQos": "0",
    "birthRetain": "false",
    "birthPayload": "",
    "birthMsg": {},
    "closeTopic": "",
    "willTopic": "",
    "willQos": "0",
    "willPayload": "",
    "sessionExpiry": "",
}


def node_in(number: int, **more: Any) -> dict[str, Any]:
    return {
        "id": f"i{number}",
        "type": "mqtt in",
        "z": "t",
        "name": "",
        "topic": f"home/room{number}/temperature",
        "qos": "2",
        "datatype": "auto-detect",
        "broker": "b1",
        "nl": False,
        "rap": True,
        "rh": 0,
        "inputs": 0,
        **more,
    }


def node_out(number: int, **more: Any) -> dict[str, Any]:
    return {
        "id": f"o{number}",
        "type": "mqtt out",
        "z": "t",
        "name": "",
        "topic": f"home/room{number}/set",
        "qos": "",
        "retain": "",
        "broker": "b1",
        **more,
    }


def flows(*nodes: dict[str, Any], broker: dict[str, Any] | None = None) -> bytes:
    return json.dumps([{"id": "t", "type": "tab", "label": "home"}, {**BROKER, **(broker or {})}, *nodes]).encode()


@pytest.mark.parametrize("version", ["4", "5"])
def test_a_dashboard_of_forty_default_nodes_gives_no_warning_at_all(version):
    nodes = [node_in(n) for n in range(25)] + [node_out(n) for n in range(10)]
    nodes += [node_in(98, topic="home/+/temperature"), node_in(99, topic="home/#"), node_in(97, topic="home/room1/set")]
    nodes += [node_out(96, topic="home/room1/temperature"), node_in(95, topic="home/room2/set")]
    assert len(nodes) == 40
    report = check(flows(*nodes, broker={"protocolVersion": version}))
    assert [finding.message for finding in report.findings if finding.severity is not Severity.NOTE] == []
    assert report.endpoints == 40


def test_forty_unmatched_default_nodes_give_no_warning():
    nodes = [node_in(n) for n in range(20)] + [node_out(n) for n in range(20)]
    assert loud(flows(*nodes)) == []
    assert loud(flows(*(node_in(n) for n in range(40)))) == []


def test_what_is_changed_counts():
    text = flows(node_in(1, qos="1", rh=2), node_out(1, qos="2", retain="true"), broker={"protocolVersion": "5"})
    system = read(text)
    assert [settings(each) for each in system.endpoints] == [
        {"qos": "1", "retain_handling": "2", "retain_as_published": "true"},
        {"qos": "2", "retain": "true"},
    ]


def test_a_retained_order_is_reported():
    assert loud(flows(node_out(1, retain="true", qos="1"))) == ["MQTT310"]


def test_without_client_id_there_is_no_kept_session():
    system = read(flows(node_in(1), broker={"cleansession": False}))
    (client,) = system.participants.values()
    assert settings(client)["clean_start"] == "true"
    system = read(flows(node_in(1), broker={"cleansession": False, "clientid": "flows"}))
    (client,) = system.participants.values()
    assert settings(client)["clean_start"] == "false"


def test_birth_close_and_will_are_publications():
    broker = {
        "birthTopic": "home/status",
        "birthQos": "1",
        "willTopic": "home/status",
        "willQos": "1",
        "willPayload": "gone",
    }
    report = check(flows(node_in(1, topic="home/status"), broker=broker))
    assert sorted(group.publishers for group in report.groups) == [
        ("localhost/publisher/home/status", "localhost/will")
    ]


@pytest.mark.parametrize(
    ("node", "code"),
    [
        (node_in(1, topic="", inputs=1), "MQTT921"),
        (node_out(1, topic=""), "MQTT921"),
        (node_in(1, topic="home/${ROOM}"), "MQTT921"),
        (node_in(1, broker="gone"), "MQTT922"),
        (node_in(1, topic="home/#/x"), "MQTT601"),
        (node_in(1, qos="3"), "CQ203"),
    ],
)
def test_a_mistake_in_a_node_is_reported_at_its_place(node, code):
    report = check(flows(node))
    (finding,) = [finding for finding in report.findings if finding.code == code]
    assert finding.place is not None
    assert finding.place.line == 1


def test_what_is_disabled_is_not_there():
    text = json.dumps(
        [{"id": "t", "type": "tab", "disabled": True}, BROKER, node_in(1), node_in(2, z="u"), node_in(3, z="u", d=True)]
    )
    assert [each.topic for each in read(text.encode()).endpoints] == ["home/room2/temperature"]


# Mosquitto

CONF = """\
# the house
listener 1883
max_qos 1
persistence true
max_queued_messages 5
max_queued_bytes 1000
autosave_interval 0
max_keepalive 120
acl_file {acl}
"""
ACL = """\
# anonymous
topic read $SYS/#
user alice
topic write home/#
topic deny home/secret
user bob
topic read home/+/temperature
pattern readwrite clients/%u/#
"""
SYSTEM = """
cqos: 1
protocol: mqtt
participants:
  sensor: {client: {username: alice}, publishes: {home/a/temperature: {qos: 2}, home/secret: {}}}
  viewer: {client: {username: bob}, subscribes: {home/+/temperature: {}, home/secret: {}}}
"""


@pytest.fixture
def house(tmp_path: Path) -> tuple[str, str]:
    (tmp_path / "acl").write_text(ACL, encoding="utf-8")
    (tmp_path / "mosquitto.conf").write_text(CONF.format(acl="acl"), encoding="utf-8")
    (tmp_path / "house.yaml").write_text(SYSTEM, encoding="utf-8")
    return str(tmp_path / "house.yaml"), str(tmp_path / "mosquitto.conf")


def test_limits_of_the_broker_are_read(house):
    broker = read(house[1]).brokers["mosquitto"]
    assert {name: text for name, text in settings(broker).items() if name != "acl"} == {
        "maximum_qos": "1",
        "persistence": "true",
        "max_queued_messages": "5",
        "max_queued_bytes": "1000",
        "autosave_interval": "infinite",
        "server_keep_alive": "120",
    }
    assert json.loads(settings(broker)["acl"])[2:4] == ["deny alice home/secret", "read bob home/+/temperature"]


def test_the_broker_of_a_configuration_judges_its_clients(house):
    report = check(*house)
    found = {finding.code: finding for finding in report.findings}
    assert found["MQTT201"].severity == "error"
    assert found["MQTT621"].topic == "home/secret"
    assert [(group.topic, group.verdict) for group in report.groups] == [("home/a/temperature", "incompatible")]


def test_a_missing_acl_file_is_reported(tmp_path):
    (tmp_path / "mosquitto.conf").write_text(CONF.format(acl="gone"), encoding="utf-8")
    report = check(str(tmp_path / "mosquitto.conf"))
    assert "MQTT941" in [finding.code for finding in report.findings]


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("max_qos 3", 10),
        ("persistence yes", 10),
        ("persistent_client_expiration 2x", 10),
        ("persistent_client_expiration 0d", 10),
        ("persistent_client_expiration 0h", 10),
        ("persistent_client_expiration d", 10),
        ("max_keepalive 9", 10),
        ("max_keepalive 65536", 10),
        ("autosave_interval 30min", 10),
    ],
)
def test_what_mosquitto_refuses_is_a_located_error(tmp_path, line, number):
    path = tmp_path / "mosquitto.conf"
    path.write_text(CONF.format(acl="x") + line, encoding="utf-8")
    report = check(str(path))
    assert [(each.code, each.place.line) for each in report.findings if each.severity == "error"] == [
        ("MQTT940", number)
    ]
    assert "MQTT201" not in {each.code for each in report.findings}  # nothing is concluded from a value that is refused


@pytest.mark.parametrize(
    ("line", "policy", "value"),
    [
        ("max_queued_messages 200000", "max_queued_messages", "200000"),
        ("max_queued_messages 70000 # of 8 MB each", "max_queued_messages", "70000"),
        ("max_queued_messages -1", "max_queued_messages", "unlimited"),
        ("persistence true # yes", "persistence", "true"),
        ("retain_available 0", "retain_available", "false"),
        ("persistent_client_expiration 1d then gone", "session_expiry_interval", "86400s"),
        ("max_keepalive 60 s", "server_keep_alive", "60"),
    ],
)
def test_a_value_is_the_first_word_as_mosquitto_takes_it(line, policy, value):
    (broker,) = read(f"{line}\n".encode(), importer="mosquitto").brokers.values()
    assert settings(broker)[policy] == value


def test_a_line_that_is_refused_leaves_the_rest_of_the_file():
    data = b"max_qos 1\nmax_keepalive 9\nretain_available false\n"
    system = read(data, importer="mosquitto")
    (broker,) = system.brokers.values()
    assert settings(broker)["maximum_qos"] == "1"
    assert settings(broker)["retain_available"] == "false"
    assert broker.settings["server_keep_alive"].unknown == "Mosquitto refuses `9`"
    assert [each.code for each in system.notes] == ["MQTT940"]


def test_a_file_with_a_port_of_mqtt_only_is_recognised(tmp_path):
    (tmp_path / "a.conf").write_text("port 1883\n", encoding="utf-8")
    (broker,) = read(str(tmp_path / "a.conf")).brokers.values()
    assert broker.addresses


@pytest.mark.parametrize(("text", "limit"), [("0", "infinite"), ("10", "10"), ("65535", "65535")])
def test_a_keep_alive_of_0_is_no_limit_of_mosquitto(text, limit):
    """Mosquitto 2.0.13 and later; the Server Keep Alive of the standard is another thing: MQTT507."""
    system = read(f"max_keepalive {text}\n".encode(), importer="mosquitto")
    (broker,) = system.brokers.values()
    assert settings(broker)["server_keep_alive"] == limit


def test_a_limit_below_a_connection_is_of_the_broker(tmp_path):
    path = tmp_path / "mosquitto.conf"
    path.write_text(
        "max_queued_messages 1\nconnection barn\naddress barn:1883\nmax_queued_messages 9\n", encoding="utf-8"
    )
    assert settings(read(str(path)).brokers["mosquitto"])["max_queued_messages"] == "9"


# Who claims what

FOREIGN = [
    ("flow.json", b'[{"id": "a", "type": "inject"}]'),
    ("openapi.yaml", b"openapi: 3.0.0\npaths: {}\n"),
    ("kafka.yaml", b"asyncapi: 3.0.0\nservers: {a: {protocol: kafka}}\n"),
    (
        "thing.json",
        b'{"@context": "https://www.w3.org/2022/wot/td/v1.1", "properties": {"a": {"forms": [{"href": "http://x"}]}}}',
    ),
    ("nginx.conf", b"server { listen 80; }\n"),
    ("values.yaml", b"mqtt:\n  asyncapi_url: x\n"),
    ("system.yaml", b"cqos: 1\nprotocol: mqtt\nparticipants: {}\n"),
    ("list.yaml", b"- topic: a\n  qos: 1\n"),
    ("ha.yaml", b"mqtt:\n  sensor:\n    - state_topic: a\n      qos: 1\n"),
]


@pytest.mark.parametrize(("name", "data"), FOREIGN)
def test_no_importer_claims_foreign_files(name, data):
    assert [each for each, claims in CLAIMS.items() if claims(name, data)] == []


def test_mqtt_importers_claim_no_files_of_other_importers():
    files = [*ROOT.glob("examples/**/*.yaml"), *ROOT.glob("plugins/*/tests/cases/*.yml"), *ROOT.glob("docs/*.json")]
    assert len(files) > 100
    for path in files:
        head = path.read_bytes()[:65536]
        assert [each for each, claims in CLAIMS.items() if claims(path.name, head)] == [], path


@pytest.mark.parametrize(
    ("name", "data", "claimed"),
    [
        ("a.yaml", b"asyncapi: '2.6.0'\nservers: {a: {protocol: mqtt}}\n", "asyncapi"),
        ("a.json", b'{"asyncapi": "3.0.0", "servers": {"a": {"protocol": "secure-mqtt"}}}', "asyncapi"),
        ("lamp.td.json", json.dumps(THING).encode(), "wot"),
        ("flows.json", flows(), "node_red"),
        ("mosquitto.conf", b"", "mosquitto"),
        ("limits.conf", b"max_queued_messages 5\n", "mosquitto"),
    ],
)
def test_each_claims_its_own(name, data, claimed):
    assert [each for each, claims in CLAIMS.items() if claims(name, data)] == [claimed]


def test_every_code_has_its_page_and_its_use():
    pack = Path(detect.__file__).parents[1]
    files = (*(pack / "importers").glob("*.py"), *(ROOT / "plugins/live/cqos_live/mqtt/snapshot").glob("*.py"))
    sources = "\n".join(path.read_text(encoding="utf-8") for path in files)
    for info in CODES:
        assert sources.count(info.code) > 1, info.code


# What is misspelt, long or elsewhere


def test_what_an_included_folder_may_state_is_not_known(tmp_path):
    system = {
        "cqos": 1,
        "protocol": "mqtt",
        "participants": {
            "a": {"broker": "mosquitto", "publishes": {"t": {"qos": 1}}},
            "b": {"broker": "mosquitto", "subscribes": {"t": {"qos": 1}}},
        },
    }
    (tmp_path / "s.yaml").write_text(json.dumps(system), encoding="utf-8")
    path = tmp_path / "mosquitto.conf"
    verdicts = []
    for text in ("max_inflight_messages 5\n", "max_inflight_messages 5\ninclude_dir conf.d\n"):
        path.write_text(text, encoding="utf-8")
        report = check(str(tmp_path / "s.yaml"), str(path))
        verdicts.append([group.verdict for group in report.groups])
    assert verdicts == [["compatible"], ["unknown"]]
    assert "MQTT944" in [finding.code for finding in report.findings]


def included(tmp_path, main="include_dir conf.d\n", **files):
    (tmp_path / "conf.d").mkdir()
    for name, text in files.items():
        (tmp_path / "conf.d" / f"{name}.conf").write_text(text, encoding="utf-8")
    (tmp_path / "mosquitto.conf").write_text(main, encoding="utf-8")
    system = read(str(tmp_path / "mosquitto.conf"))
    return system, {name: setting.text for name, setting in system.brokers["mosquitto"].settings.items()}


def test_files_of_a_folder_are_read_in_the_order_of_mosquitto(tmp_path):
    """Seen on Mosquitto 2.0.11, whose log names the files as it loads them."""
    order = ["00", "01", "1", "10", "A", "AB", "Ab", "a-", "a.b", "a", "a.conf", "aB", "ab", "abc", "a_", "B", "b", "_"]
    system, settings = included(tmp_path, **{name: f"max_queued_messages {at}\n" for at, name in enumerate(order, 1)})
    assert settings["max_queued_messages"] == str(len(order))
    read_as = [os.path.basename(name) for name in system.sources if "conf.d" in name]  # noqa: PTH119 - as it is named
    assert read_as == [f"{name}.conf" for name in order]


def test_only_files_of_the_right_name_are_read_and_only_from_the_main_file(tmp_path):
    (tmp_path / "e").mkdir()
    (tmp_path / "e" / "x.conf").write_text("max_queued_messages 9\n", encoding="utf-8")
    system, settings = included(tmp_path, **{"a": f"include_dir {tmp_path / 'e'}\n", ".b": "max_queued_messages 3\n"})
    (tmp_path / "conf.d" / "README").write_text("bogus_qos 1\n", encoding="utf-8")
    (tmp_path / "conf.d" / "c.CONF").write_text("max_queued_messages 4\n", encoding="utf-8")
    (tmp_path / "conf.d" / ".conf").write_text("max_queued_messages 5\n", encoding="utf-8")
    assert (settings["max_queued_messages"], system.notes) == ("3", [])


@pytest.mark.parametrize(
    ("main", "one", "limits"),
    [
        ("listener 1884\ninclude_dir conf.d\n", "max_qos 1\n", {"port 1883": "1", "port 1884": "2"}),
        ("include_dir conf.d\nmax_qos 1\n", "listener 1884\n", {"port 1883": "1", "port 1884": "2"}),
    ],
)
def test_an_included_file_begins_with_the_default_listener(tmp_path, main, one, limits):
    """Seen on Mosquitto 2.0.11 by what it announces to clients on either port."""
    system, _ = included(tmp_path, main, a=one)
    cases = system.brokers["mosquitto"].settings["maximum_qos"].unknown
    assert dict(cases.values) == limits


def test_an_included_file_begins_outside_of_all_connections(tmp_path):
    """Mosquitto 2.0.11: `Invalid bridge configuration`."""
    system, _ = included(tmp_path, "connection x\ninclude_dir conf.d\n", a="address h\n")
    first = system.notes[0]
    assert "belongs below a `connection`" in first.message
    assert str(first.place).endswith("a.conf:1:1")


def test_the_configuration_of_debian_is_read_without_a_warning(tmp_path):
    text = """# Place your local configuration in /etc/mosquitto/conf.d/

pid_file /run/mosquitto/mosquitto.pid

persistence true
persistence_location /var/lib/mosquitto/

log_dest file /var/log/mosquitto/mosquitto.log

include_dir conf.d
"""
    system, settings = included(tmp_path, text)
    assert (system.notes, settings) == ([], {"persistence": "true"})


def test_the_files_of_a_folder_are_sent_along_to_a_service(tmp_path):
    own, _ = included(tmp_path, a="max_queued_messages 7\n")
    path = str(tmp_path / "mosquitto.conf")
    given = [GivenSource(read_path(path), open_file)]
    sent = SentFiles([each.source for each in given] + list(included_files(given)))
    (there,) = read_together([GivenSource(given[0].source, sent)])
    assert there == own
    (without,) = read_together([GivenSource(given[0].source, SentFiles([given[0].source]))])
    assert [each.code for each in without.notes] == ["MQTT944"]


def test_bytes_have_no_folder_to_include():
    system = read(b"listener 1883\ninclude_dir /etc\n", importer="mosquitto")
    assert [(each.code, each.severity) for each in system.notes] == [("MQTT944", "warning")]
    assert "given as bytes" in system.notes[0].message


def test_flows_whose_mqtt_nodes_come_late_are_recognised(tmp_path):
    filler = [{"id": f"n{i}", "type": "inject", "z": "tab", "wires": [[]]} for i in range(2000)]
    path = tmp_path / "flows.json"
    path.write_text(json.dumps([*filler, *json.loads(flows(node_in(1)))]), encoding="utf-8")
    assert path.read_bytes().find(b"mqtt") > 65_536
    assert read(str(path)).endpoints
    path.write_text(json.dumps(filler), encoding="utf-8")
    assert [each.code for each in read(str(path)).notes] == ["MQTT923"]


def test_a_thing_has_a_client_at_each_host():
    system = read(json.dumps(THING).encode())
    assert {each.id: each.settings["broker"].text for each in system.participants.values()} == {
        "lamp": "broker:1883",
        "lamp at other": "other",
    }


def test_terms_of_forms_with_typing_errors_are_reported():
    form = {"href": "mqtt://h/a", "op": "observeproperty", "mqv:qoss": "1"}
    thing = {**THING, "events": {}, "actions": {}, "properties": {"a": {"forms": [form]}}}
    system = read(json.dumps(thing).encode())
    assert [(each.code, each.severity) for each in system.notes] == [("CQ040", "warning")]
    (endpoint,) = system.endpoints
    assert endpoint.settings["qos"].unknown


def test_fields_of_nodes_with_typing_errors_are_reported():
    text = flows(node_in(1), node_out(1))
    nodes = json.loads(text)
    assert not [each for each in read(text).notes if each.code == "CQ040"]
    nodes = [{("qoss" if name == "qos" else name): value for name, value in node.items()} for node in nodes]
    notes = [each for each in read(json.dumps(nodes).encode()).notes if each.code == "CQ040"]
    assert notes
    assert {each.help for each in notes} == {"did you mean `qos`?"}


def test_fields_of_a_will_with_typing_errors_are_reported():
    nodes = json.loads(flows(node_in(1)))
    broker = next(each for each in nodes if each["type"] == "mqtt-broker")
    broker |= {"willTopic": "gone", "willMsg": {"delai": "5", "expirry": "3"}}
    notes = [each for each in read(json.dumps(nodes).encode()).notes if each.code == "CQ040"]
    assert [each.help for each in notes] == ["did you mean `delay`?", "did you mean `expiry`?"]


@pytest.mark.parametrize("name", ["lastWil", "lastwill", "last_will"])
def test_a_misspelt_will_of_an_asyncapi_document_is_not_known(name):
    servers = {"a": {"host": "h", "protocol": "mqtt", "bindings": {"mqtt": {name: {"topic": "gone"}}}}}
    document = {"asyncapi": "3.0.0", "servers": servers, "channels": {}, "operations": {}}
    system = read(json.dumps(document).encode())
    assert [(each.code, each.severity) for each in system.notes] == [("CQ040", "warning")]
    (client,) = system.participants.values()
    assert client.settings["will.topic"].unknown
    assert not [each for each in check(json.dumps(document).encode()).findings if each.code == "MQTT510"]


@pytest.mark.parametrize("data", [b"asyncapi: 3.0.0\nservers: {a: {protocol: kafka}}\n", b'{"asyncapi": "3.0.0"}'])
def test_asyncapi_over_another_protocol_is_named_as_what_it_is(data):
    with pytest.raises(InputError, match="no importer reads"):
        read(data)
