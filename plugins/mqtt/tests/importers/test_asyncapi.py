"""AsyncAPI 2.x and 3.x: directions, references, traits, parameters, several documents as one system."""

import json
from typing import Any

import pytest

from cqos_core import InputError, check, read

V2 = """
asyncapi: 2.6.0
info: {title: station, version: 1.0.0}
servers:
  field:
    url: mqtt://broker:1883
    protocol: mqtt
    protocolVersion: "5.0"
    bindings:
      mqtt:
        clientId: st-1
        cleanSession: false
        keepAlive: 30
        sessionExpiryInterval: 3600
        lastWill: {topic: farm/a/gone, qos: 1, message: bye, retain: true}
  web: {url: "https://x", protocol: http}
channels:
  farm/{plot}/weather:
    parameters: {plot: {schema: {type: string}}}
    subscribe:
      traits:
        - $ref: "#/components/operationTraits/sure"
      bindings: {mqtt: {qos: 0, retain: true, messageExpiryInterval: 600}}
  farm/orders:
    publish:
      bindings:
        mqtt: {$ref: "#/components/operationBindings/sure/mqtt"}
components:
  operationTraits:
    sure: {bindings: {mqtt: {qos: 1}}}
  operationBindings:
    sure: {mqtt: {qos: 2}}
"""
V3 = """
asyncapi: 3.0.0
info: {title: display, version: 1.0.0}
servers:
  field: {host: "broker:1883", protocol: mqtts, protocolVersion: "5.0"}
channels:
  weather: {address: "farm/north/weather", servers: [{$ref: "#/servers/field"}]}
  orders: {address: "farm/orders"}
operations:
  show:
    action: receive
    channel: {$ref: "#/channels/weather"}
    traits: [{$ref: "#/components/operationTraits/sure"}]
    bindings: {mqtt: {qos: 2, x-noLocal: true}}
  order:
    action: send
    channel: {$ref: "#/channels/orders"}
    bindings: {mqtt: {qos: 1}}
components:
  operationTraits:
    sure: {bindings: {mqtt: {qos: 1}}}
"""


def endpoints(text: str) -> dict[str, dict[str, str]]:
    system = read(text.encode(), importer="asyncapi")
    return {each.id: {name: setting.text for name, setting in each.settings.items()} for each in system.endpoints}


def codes(text: str | bytes) -> list[str]:
    report = check(text.encode() if isinstance(text, str) else text, importer="asyncapi")
    return [finding.code for finding in report.findings if finding.severity != "note"]


def located(text: str, code: str) -> list[int | None]:
    report = check(text.encode(), importer="asyncapi")
    found = [finding for finding in report.findings if finding.code == code]
    assert all(finding.severity == "error" for finding in found)
    return [finding.place.line if finding.place else None for finding in found]


def test_version_2_takes_the_view_of_the_other_side():
    assert endpoints(V2) == {
        "station/publisher/farm/+/weather": {"qos": "1", "retain": "true", "message_expiry_interval": "600"},
        "station/subscriber/farm/orders": {"qos": "2"},
    }


def test_version_3_takes_its_own_view_and_traits_give_way():
    assert endpoints(V3) == {
        "display/subscriber/farm/north/weather": {"qos": "2", "no_local": "true"},
        "display/publisher/farm/orders": {"qos": "1"},
    }


def test_the_connection_is_that_of_the_server():
    system = read(V2.encode(), importer="asyncapi")
    (client,) = system.participants.values()
    assert {name: setting.text for name, setting in client.settings.items()} == {
        "broker": "broker:1883",
        "protocol_version": "5.0",
        "client_id": "st-1",
        "clean_start": "false",
        "keep_alive": "30",
        "session_expiry_interval": "3600",
        "will.topic": "farm/a/gone",
        "will.qos": "1",
        "will.payload": "bye",
        "will.retain": "true",
    }
    assert list(system.brokers) == ["broker:1883"]


def test_json_is_read_alike():
    yaml = pytest.importorskip("yaml")
    assert endpoints(json.dumps(yaml.safe_load(V3))) == endpoints(V3)


def test_several_documents_form_one_system():
    report = check(V2.encode(), V3.encode())
    assert report.verdict == "compatible"
    assert sorted((group.publishers, group.subscribers) for group in report.groups) == [
        (("display/publisher/farm/orders",), ("station/subscriber/farm/orders",)),
        (("station/publisher/farm/+/weather",), ("display/subscriber/farm/north/weather",)),
    ]


def test_every_value_has_its_place():
    report = check(V2.encode(), V3.replace("qos: 2,", "qos: 3,").encode())
    (finding,) = [finding for finding in report.findings if finding.code == "CQ203"]
    assert finding.place is not None
    assert finding.place.line == 14


@pytest.mark.parametrize(
    ("what", "instead", "code", "line"),
    [
        ("bindings: {mqtt: {qos: 1}}\ncomponents", "bindings: {mqtt: {qos: 3}}\ncomponents", "CQ203", 18),
        ("{qos: 1}}\ncomponents", "{qos: 1, messageExpiryInterval: -5}}\ncomponents", "CQ203", 18),
        ("#/channels/orders", "#/channels/oders", "MQTT901", 17),
        ("#/channels/orders", "other.yaml#/channels/orders", "MQTT901", 17),
        ("farm/orders", "farm/#/orders", "MQTT601", 15),
    ],
)
def test_bad_input_gives_a_located_error(what, instead, code, line):
    assert what in V3
    assert located(V3.replace(what, instead), code) == [line]


@pytest.mark.parametrize(
    ("what", "instead", "line", "message"),
    [
        ('channel: {$ref: "#/channels/orders"}', "channel: orders", 17, "`channel` must be a reference to a channel"),
        ('channel: {$ref: "#/channels/orders"}', "channel: {$ref: '#/info/title'}", 3, "`channel` must be a reference"),
        ('servers: [{$ref: "#/servers/field"}]', "servers: [field]", 7, "`servers` must be a list of references"),
    ],
)
def test_a_name_where_3_0_wants_a_reference_is_refused(what, instead, line, message):
    assert what in V3
    with pytest.raises(InputError, match=message) as raised:
        read(V3.replace(what, instead).encode(), importer="asyncapi")
    assert [problem.place.line for problem in raised.value.problems if problem.place] == [line]


def test_a_reference_beyond_a_list_leads_to_nothing():
    text = V3.replace("#/channels/orders", f"#/channels/weather/servers/{'9' * 5000}")
    assert located(text, "MQTT901") == [17]


def test_circular_references_are_reported_where_they_begin():
    text = V3.replace(
        '{address: "farm/orders"}', '{$ref: "#/channels/a"}\n  a: {$ref: "#/channels/b"}\n  b: {$ref: "#/channels/a"}'
    )
    report = check(text.encode(), importer="asyncapi")
    (finding,) = [finding for finding in report.findings if finding.code == "MQTT902"]
    assert "#/channels/a → #/channels/b → #/channels/a" in finding.message
    assert finding.place is not None


def test_fields_of_5_0_in_a_server_of_3_1_1_are_warnings():
    text = V2.replace('"5.0"', '"3.1.1"')
    report = check(text.encode(), V3.encode())
    found = {finding.code: finding for finding in report.findings}
    assert found["MQTT411"].severity == found["MQTT412"].severity == "warning"
    assert found["MQTT412"].place is not None


def test_recursive_schemas_are_no_circle():
    text = V3 + "  schemas: {node: {type: object, properties: {next: {$ref: '#/components/schemas/node'}}}}\n"
    assert codes(text) == codes(V3)


@pytest.mark.parametrize(
    ("schema", "text"),
    [("{const: 60}", "60"), ("{enum: [60]}", "60"), ("{type: integer, minimum: 30, maximum: 300}", "unknown")],
)
def test_a_schema_in_place_of_a_value(schema, text):
    found = endpoints(V2.replace("messageExpiryInterval: 600", f"messageExpiryInterval: {schema}"))
    assert found["station/publisher/farm/+/weather"]["message_expiry_interval"] == text


def test_what_a_schema_leaves_open_is_not_known():
    text = V2.replace("messageExpiryInterval: 600", "messageExpiryInterval: {minimum: 30, maximum: 300}")
    report = check(text.encode(), V3.encode())
    assert "MQTT905" in [finding.code for finding in report.findings]


def test_a_document_without_mqtt_says_so():
    assert codes(V3.replace("mqtts", "kafka")) == ["MQTT903"]


@pytest.mark.parametrize("version", ["1.2.0", "4.0.0", "three"])
def test_other_versions_are_refused(version):
    with pytest.raises(InputError) as raised:
        read(V3.replace("3.0.0", version).encode(), importer="asyncapi")
    assert [(problem.code, problem.place.line) for problem in raised.value.problems] == [("MQTT907", 2)]


@pytest.mark.parametrize(
    "text",
    [
        "asyncapi: 3.0.0\n",
        "asyncapi: 3.0.0\nservers: []\n",
        "asyncapi: 2.0.0\nchannels: {a: 1}\n",
        "[]",
        "asyncapi: 3.0.0\nservers: {a: {protocol: mqtt}}\noperations: {o: {action: x}}",
    ],
)
def test_what_is_not_as_it_should_be_is_no_traceback(text):
    try:
        report: Any = check(text.encode(), importer="asyncapi")
    except InputError as error:
        report = error
    assert report


BOUND = """
asyncapi: 3.0.0
info: {title: display, version: 1.0.0}
channels: {orders: {address: orders}}
operations:
  order: {action: send, channel: {$ref: "#/channels/orders"}, bindings: {mqtt: {qos: 1}}}
"""


def test_servers_may_be_missing_where_bindings_are_of_mqtt():
    assert endpoints(BOUND) == {"display/publisher/orders": {"qos": "1"}}
    assert "MQTT903" in codes(BOUND.replace("bindings: {mqtt:", "bindings: {kafka:"))
    assert "MQTT903" in codes(BOUND + "servers: {a: {host: h, protocol: kafka}}\n")


@pytest.mark.parametrize(
    ("binding", "policy"),
    [
        ("{mqtt: {qoss: 1}}", "qos"),
        ("{mqtt: {reatin: true}}", "retain"),
        ("{mqtt: {messageExpiryIntervall: 1}}", "message_expiry_interval"),
        ("{qos: 1, mqtt: {}}", "qos"),
    ],
)
def test_a_binding_with_a_typing_error_is_reported_and_unknown(binding, policy):
    system = read(BOUND.replace("{mqtt: {qos: 1}}", binding).encode(), importer="asyncapi")
    assert [(each.code, each.severity) for each in system.notes] == [("CQ040", "warning")]
    (endpoint,) = system.endpoints
    assert {name for name, setting in endpoint.settings.items() if setting.unknown} == {policy}


def test_a_document_over_another_protocol_names_it():
    text = BOUND + "servers: {a: {host: h, protocol: kafka}}\n"
    (note,) = read(text.encode(), importer="asyncapi").notes
    assert "no importer reads AsyncAPI over kafka" in note.message


def test_thousands_of_parameters_are_no_endless_number():
    names = [f"p{number}" for number in range(14_000)]
    channel = {
        "address": "/".join(f"{{{name}}}" for name in names),
        "parameters": {name: {"enum": ["a", "b"]} for name in names},
    }
    document = {
        "asyncapi": "3.0.0",
        "servers": {"a": {"host": "h", "protocol": "mqtt"}},
        "channels": {"c": channel},
        "operations": {"o": {"action": "send", "channel": {"$ref": "#/channels/c"}}},
    }
    (note,) = read(json.dumps(document).encode()).notes
    assert note.code == "MQTT905"
    assert "more than 1000000 topics" in note.message


def test_the_name_of_a_file_may_be_longer_than_any_file_system_has_it(tmp_path):
    name = "a" * 300
    path = tmp_path / "display.yaml"
    path.write_text(BOUND.replace("#/channels/orders", f"{name}.yaml#/orders"), encoding="utf-8")
    (note,) = [each for each in read(str(path)).notes if each.code == "MQTT901"]
    assert "too long" in note.message
    path = tmp_path / "mosquitto.conf"
    path.write_text(f"acl_file {name}\n", encoding="utf-8")
    assert [each.code for each in read(str(path)).notes] == ["MQTT941"]
    path = tmp_path / "system.yaml"
    path.write_text(f"cqos: 1\nprotocol: mqtt\ninclude: [{name}.yaml]\n", encoding="utf-8")
    with pytest.raises(InputError, match="too long"):
        read(str(path))


def test_who_may_read_is_known_for_topics_of_the_broker_too(tmp_path):
    (tmp_path / "acl").write_text("topic read a/#\n", encoding="utf-8")
    (tmp_path / "mosquitto.conf").write_text("acl_file acl\n", encoding="utf-8")
    system = {
        "cqos": 1,
        "protocol": "mqtt",
        "participants": {
            "a": {"broker": "mosquitto", "subscribes": {"$own/x": {}}},
            "b": {"broker": "mosquitto", "publishes": {"$own/x": {}}},
        },
    }
    (tmp_path / "s.yaml").write_text(json.dumps(system), encoding="utf-8")
    report = check(str(tmp_path / "s.yaml"), str(tmp_path / "mosquitto.conf"))
    assert "MQTT621" in [finding.code for finding in report.findings]


SERVER = """asyncapi: 2.6.0
info: {{title: {title}, version: '1'}}
servers: {{p: {{url: '{url}', protocol: mqtt, variables: {variables}}}}}
channels:
  room: {{{verb}: {{operationId: a, bindings: {{mqtt: {{qos: 1}}}}, message: {{name: X}}}}}}
"""
PLAIN = SERVER.format(title="Display", url="mqtt.example.com:1883", variables="{}", verb="publish")


@pytest.mark.parametrize(
    ("variables", "verdict", "pairs"),
    [
        ("{host: {default: mqtt.example.com}, port: {default: '1883'}}", "compatible", 1),
        ("{host: {default: other.example.com}, port: {default: '1883'}}", "unknown", 0),
        ("{host: {description: where it is}, port: {default: '1883'}}", "unknown", 1),
        ("{port: {default: '1883'}}", "unknown", 1),
        ("{host: {default: ''}, port: {default: '1883'}}", "unknown", 1),
    ],
)
def test_variables_of_a_server_have_their_defaults(variables, verdict, pairs):
    sensor = SERVER.format(title="Sensor", url="{host}:{port}", variables=variables, verb="subscribe")
    report = check(sensor.encode(), PLAIN.encode())
    assert (report.verdict, report.pair_count) == (verdict, pairs)
    has = "an empty default" if "''" in variables else "no default"
    open_ = f"the variable `host` of server `p` has {has}"
    assert any(open_ in each.message for each in report.findings) is (verdict == "unknown" and pairs == 1)
