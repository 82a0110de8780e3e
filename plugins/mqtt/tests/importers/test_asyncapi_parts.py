"""AsyncAPI: replies, parameters of few values, and parts that stand in other files."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cqos_core import Finding, Report, System, check, read
from cqos_core.files.path_loader import load_paths

Write = Callable[..., list[str]]

REQUESTER = """
asyncapi: 3.0.0
info: {title: dashboard, version: 1.2.0}
servers:
  plant: {host: "broker.plant:1883", protocol: mqtt, protocolVersion: "5.0"}
channels:
  statusRequested:
    address: plant/status/get
    messages: {request: {payload: {type: object}}}
  statusReported:
    address: plant/status/reply
    messages: {status: {payload: {type: object}}}
operations:
  askForStatus:
    action: send
    channel: {$ref: "#/channels/statusRequested"}
    bindings: {mqtt: {qos: 1, bindingVersion: "0.2.0"}}
    reply:
      channel: {$ref: "#/channels/statusReported"}
      messages: [{$ref: "#/channels/statusReported/messages/status"}]
"""
RESPONDER = REQUESTER.replace("dashboard", "controller").replace("action: send", "action: receive")

LIGHTS_V2 = """
asyncapi: 2.6.0
info: {title: lights, version: 1.0.0}
servers:
  production: {url: "mqtt://broker:1883", protocol: mqtt}
defaultContentType: application/json
channels:
  smartylighting/{env}/lights/{lightId}/measured:
    parameters:
      env:
        description: where the light is
        schema: {type: string, enum: [street, tunnel]}
      lightId: {$ref: "#/components/parameters/lightId"}
    publish:
      operationId: measured
      message: {$ref: "https://schemas.example.org/light.json"}
components:
  parameters:
    lightId: {schema: {type: string}}
"""
LIGHTS_V3 = """
asyncapi: 3.0.0
info: {title: lights, version: 1.0.0}
servers:
  production: {host: "broker:1883", protocol: mqtt}
channels:
  measured:
    address: smartylighting/{env}/lights/{lightId}/measured
    parameters:
      env: {description: where the light is, enum: [street, tunnel], default: street}
      lightId: {description: its number}
operations:
  measured: {action: receive, channel: {$ref: "#/channels/measured"}}
"""


def meter(topic: str, qos: int = 0) -> str:
    """Return an application that publishes to one topic on the same broker."""
    return f"""
asyncapi: 3.0.0
info: {{title: meter, version: 1.0.0}}
servers: {{production: {{host: "broker:1883", protocol: mqtt}}}}
channels: {{out: {{address: {topic}}}}}
operations: {{tell: {{action: send, channel: {{$ref: "#/channels/out"}}, bindings: {{mqtt: {{qos: {qos}}}}}}}}}
"""


def system(text: str) -> System:
    return read(text.encode(), importer="asyncapi")


def ids(text: str) -> list[str]:
    return [endpoint.id for endpoint in system(text).endpoints]


def findings_of(report: Report, *codes: str) -> list[Finding]:
    return [finding for finding in report.findings if finding.code in codes]


# Replies


def test_who_sends_a_request_receives_the_reply_and_the_other_way_round():
    assert ids(REQUESTER) == ["dashboard/publisher/plant/status/get", "dashboard/subscriber/plant/status/reply"]
    assert ids(RESPONDER) == ["controller/subscriber/plant/status/get", "controller/publisher/plant/status/reply"]


def test_both_ends_of_request_and_reply_meet():
    report = check(REQUESTER.encode(), RESPONDER.encode())
    assert (report.verdict, report.pair_count) == ("compatible", 2)
    assert not findings_of(report, "CQ401", "CQ402")


def test_the_qos_of_a_request_says_nothing_of_its_reply():
    request, reply = system(REQUESTER).endpoints
    assert "qos" in request.settings
    assert "qos" not in reply.settings
    assert reply.place is not None
    assert (reply.place.line, reply.place.column) == (18, 5)


@pytest.mark.parametrize(
    "channel",
    [
        "{address: {location: '$message.header#/replyTo'}, channel: {$ref: '#/channels/statusReported'}}",
        "{address: {location: '$message.header#/replyTo'}}",
        "{channel: {$ref: '#/channels/somewhere'}}",
        "{messages: []}",
    ],
)
def test_where_a_reply_goes_may_be_known_at_run_time_only(channel: str):
    start, _, _ = REQUESTER.partition("    reply:")
    start = start.replace("operations:", "  somewhere: {address: null}\noperations:")
    text = f"{start}    reply: {channel}\n"
    assert ids(text) == ["dashboard/publisher/plant/status/get"]
    (finding,) = findings_of(check(text.encode(), importer="asyncapi"), "MQTT921")
    assert finding.severity == "note"
    assert "askForStatus" in finding.message
    assert finding.place is not None
    assert finding.place.line == 19


def test_an_operation_of_its_own_says_more_of_replies():
    text = REQUESTER + (
        "  takeStatus:\n"
        '    action: receive\n    channel: {$ref: "#/channels/statusReported"}\n    bindings: {mqtt: {qos: 2}}\n'
    )
    _, replies = system(text).endpoints
    assert replies.settings["qos"].text == "2"


def answering(message: str, reply: str = "") -> str:
    """The requester, whose message says where its answers go."""
    start, _, _ = REQUESTER.partition("    reply:")
    return start.replace("{payload: {type: object}}", f"{{payload: {{type: object}}, {message}}}", 1) + reply


RESPONSE = "bindings: {mqtt: {responseTopic: plant/status/answer}}"


@pytest.mark.parametrize(
    "message",
    [
        RESPONSE,
        "bindings: {mqtt: {responseTopic: {type: string, const: plant/status/answer}}}",
        "bindings: {mqtt: {responseTopic: {type: string, enum: [plant/status/answer]}}}",
        f"traits: [{{{RESPONSE}}}]",
    ],
)
def test_a_message_may_say_where_its_answer_goes(message: str):
    assert ids(answering(message)) == [
        "dashboard/publisher/plant/status/get",
        "dashboard/subscriber/plant/status/answer",
    ]
    responder = answering(message).replace("action: send", "action: receive")
    assert ids(responder) == ["dashboard/subscriber/plant/status/get", "dashboard/publisher/plant/status/answer"]


def test_a_response_topic_with_parameters_is_a_filter():
    text = answering("bindings: {mqtt: {responseTopic: 'clients/{id}/status'}}")
    assert ids(text)[1:] == ["dashboard/subscriber/clients/+/status"]


def test_an_example_of_a_response_topic_is_a_guess():
    request, response = system(
        answering("bindings: {mqtt: {responseTopic: {type: string, examples: [a/b]}}}")
    ).endpoints
    assert (response.topic, response.topic_is_guess, request.topic_is_guess) == ("a/b", True, False)


@pytest.mark.parametrize(
    "message",
    [
        "bindings: {mqtt: {responseTopic: {type: string}}}",
        "bindings: {mqtt: {responseTopic: {type: string, enum: [a, b]}}}",
        "bindings: {mqtt: {responseTopic: {type: string, examples: [a, b]}}}",
        "bindings: {mqtt: {responseTopic: {type: string, enum: 5, examples: {}}}}",
        "bindings: {mqtt: {responseTopic: {$ref: '#/components/gone'}}}",
        "bindings: {mqtt: {responseTopic: {$ref: 'https://example.org/topic'}}}",
        "bindings: {mqtt: {responseTopic: [a]}}",
        "bindings: {mqtt: 5}",
        "traits: 5",
        "bindings: {$ref: '#/channels/statusRequested/messages/request/bindings'}",
    ],
)
def test_where_the_answer_goes_may_be_open(message: str):
    read_system = system(answering(message))
    assert [endpoint.id for endpoint in read_system.endpoints] == ["dashboard/publisher/plant/status/get"]
    assert read_system.notes == []


def test_the_channel_of_a_reply_overrides_its_messages():
    reply = '    reply: {channel: {$ref: "#/channels/statusReported"}}\n'
    assert ids(answering(RESPONSE, reply))[1:] == ["dashboard/subscriber/plant/status/reply"]


def test_messages_say_what_the_address_of_a_reply_leaves_open():
    answered = system(answering(RESPONSE, "    reply: {address: {location: '$message.header#/replyTo'}}\n"))
    assert [endpoint.id for endpoint in answered.endpoints][1:] == ["dashboard/subscriber/plant/status/answer"]
    assert answered.notes == []


def test_an_operation_of_its_own_says_more_of_answers():
    own = """  answers: {address: 'plant/status/#'}
operations:
  listen: {action: receive, channel: {$ref: "#/channels/answers"}, bindings: {mqtt: {qos: 2}}}
"""
    text = answering(RESPONSE).replace("operations:\n", own)
    assert ids(text) == ["dashboard/subscriber/plant/status/#", "dashboard/publisher/plant/status/get"]


def test_messages_of_version_2_say_it_too():
    message = 'message: {oneOf: [{payload: {}}, {$ref: "#/components/messages/ask"}]}'
    text = LIGHTS_V2.replace('message: {$ref: "https://schemas.example.org/light.json"}', message)
    text += f"  messages: {{ask: {{{RESPONSE}}}}}\n"
    assert ids(text)[-1] == "lights/publisher/plant/status/answer"


def test_a_dangling_reply_is_reported_at_its_place():
    text = REQUESTER.replace(
        '      channel: {$ref: "#/channels/statusReported"}', '      channel: {$ref: "#/channels/no"}'
    )
    (finding,) = findings_of(check(text.encode(), importer="asyncapi"), "MQTT901")
    assert finding.place is not None
    assert finding.place.line == 19


# Parameters of few values


@pytest.mark.parametrize("text", [LIGHTS_V2, LIGHTS_V3])
def test_a_parameter_of_few_values_stands_for_as_many_topics(text: str):
    assert [endpoint.topic for endpoint in system(text).endpoints] == [
        "smartylighting/street/lights/+/measured",
        "smartylighting/tunnel/lights/+/measured",
    ]


@pytest.mark.parametrize("text", [LIGHTS_V2, LIGHTS_V3])
def test_it_meets_those_values_and_no_others(text: str):
    met = check(meter("smartylighting/street/lights/7/measured").encode(), text.encode())
    apart = check(meter("smartylighting/harbour/lights/7/measured").encode(), text.encode())
    assert (met.pair_count, apart.pair_count) == (1, 0)


@pytest.mark.parametrize("text", [LIGHTS_V2, LIGHTS_V3])
def test_an_unused_value_is_no_finding_while_another_is_used(text: str):
    report = check(meter("smartylighting/tunnel/lights/7/measured").encode(), text.encode())
    assert [finding.code for finding in report.findings if finding.severity != "note"] == []
    assert not findings_of(report, "CQ401", "CQ402")


@pytest.mark.parametrize("text", [LIGHTS_V2, LIGHTS_V3])
def test_a_publisher_on_none_of_the_values_is_unmatched(text: str):
    report = check(meter("elsewhere").encode(), text.encode())
    assert findings_of(report, "CQ404")
    near = check(meter("SmartyLighting/tunnel/lights/7/measured").encode(), text.encode())
    assert findings_of(near, "CQ403")


def test_one_finding_covers_all_values():
    text = LIGHTS_V3.replace('measured"}}', 'measured"}, bindings: {mqtt: {qos: 2, x-noLocal: true}}}')
    report = check(text.replace("mqtt}", 'mqtt, protocolVersion: "3.1.1"}').encode(), importer="asyncapi")
    (finding,) = findings_of(report, "MQTT613")
    assert finding.endpoints == (
        "lights/subscriber/smartylighting/street/lights/+/measured",
        "lights/subscriber/smartylighting/tunnel/lights/+/measured",
    )


def test_what_is_published_by_few_values_are_topics_of_their_own():
    text = LIGHTS_V3.replace("receive", "send").replace("/{lightId}", "/all")
    heard = check(text.encode(), LIGHTS_V3.replace("title: lights", "title: hall").encode())
    assert [group.topic for group in heard.groups] == [
        "smartylighting/street/lights/all/measured",
        "smartylighting/tunnel/lights/all/measured",
    ]


@pytest.mark.parametrize(
    ("values", "topics"),
    [
        ("{enum: [street]}", ["smartylighting/street/lights/+/measured"]),
        ("{enum: [street, street]}", ["smartylighting/street/lights/+/measured"]),
        ("{enum: []}", ["smartylighting/+/lights/+/measured"]),
        ("{enum: [{}, street]}", ["smartylighting/+/lights/+/measured"]),
        ("{const: tunnel}", ["smartylighting/tunnel/lights/+/measured"]),
        (f"{{enum: {[f'e{n}' for n in range(101)]}}}", ["smartylighting/+/lights/+/measured"]),
    ],
)
def test_how_many_topics_there_are(values: str, topics: list[str]):
    text = LIGHTS_V3.replace("{description: where the light is, enum: [street, tunnel], default: street}", values)
    assert [endpoint.topic for endpoint in system(text).endpoints] == topics


def test_too_many_topics_become_one_filter_with_a_finding():
    text = LIGHTS_V3.replace("[street, tunnel]", str([f"e{n}" for n in range(101)]))
    (finding,) = findings_of(check(text.encode(), importer="asyncapi"), "MQTT905")
    assert "101 topics" in finding.message


# Parts in other files

APPLICATION = """
asyncapi: 3.0.0
info: {title: display, version: 1.0.0}
servers:
  plant: {$ref: "./common/mqtt.yaml#/servers/plant"}
channels:
  weather: {$ref: "common/channels.yaml#/weather"}
operations:
  show:
    action: receive
    channel: {$ref: "#/channels/weather"}
    traits: [{$ref: "common/channels.yaml#/traits/sure"}]
"""
SERVERS = 'servers: {plant: {host: "broker:1883", protocol: mqtt, protocolVersion: "3.1.1"}}\n'
CHANNELS = """
weather:
  address: farm/north/weather
  servers: [{$ref: "mqtt.yaml#/servers/plant"}]
traits:
  sure:
    bindings: {mqtt: {$ref: "#/mqtt"}}
mqtt: {qos: 3}
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def files(**texts: str) -> list[str]:
        for name, text in texts.items():
            path = tmp_path / name.replace("__", "/")
            path.parent.mkdir(exist_ok=True)
            path.with_suffix(".yaml").write_text(text)
        return [str(tmp_path / name.replace("__", "/")) + ".yaml" for name in texts]

    return files


def test_parts_stand_in_other_files_and_name_each_other_from_there(write: Write):
    path, *_ = write(display=APPLICATION, common__mqtt=SERVERS, common__channels=CHANNELS)
    found = read(path)
    (endpoint,) = found.endpoints
    assert (endpoint.id, list(found.brokers)) == ("display/subscriber/farm/north/weather", ["broker:1883"])


def test_a_mistake_in_another_file_is_reported_in_that_file(write: Write):
    path, _, channels = write(display=APPLICATION, common__mqtt=SERVERS, common__channels=CHANNELS)
    (finding,) = findings_of(check(path), "CQ203")
    assert finding.place is not None
    assert (finding.place.source, finding.place.line, finding.place.column) == (channels, 8, 13)


def test_a_file_is_read_once_and_is_no_system_of_its_own(write: Write, tmp_path: Path):
    write(display=APPLICATION, common__mqtt=f"asyncapi: 3.0.0\n{SERVERS}", common__channels=CHANNELS)
    loaded = load_paths([str(tmp_path)])
    assert [Path(path).name for path, _ in loaded.systems] == ["display.yaml"]


def test_an_application_that_another_refers_to_remains_one(write: Write, tmp_path: Path):
    other = APPLICATION.replace("display", "screen").replace(
        "common/channels.yaml#/weather", "display.yaml#/channels/weather"
    )
    write(display=APPLICATION, screen=other, common__mqtt=SERVERS, common__channels=CHANNELS)
    loaded = load_paths([str(tmp_path)])
    assert [Path(path).name for path, _ in loaded.systems] == ["display.yaml", "screen.yaml"]
    assert [endpoint.id for _, system in loaded.systems for endpoint in system.endpoints] == [
        "display/subscriber/farm/north/weather",
        "screen/subscriber/farm/north/weather",
    ]


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("common/gone.yaml#/weather", "No such file or directory"),
        ("common/channels.yaml#/wether", "leads to nothing"),
        ("common#/weather", "Is a directory"),
        ("common/%00.yaml", "cannot be read"),
    ],
)
def test_a_dangling_reference_is_reported_at_the_reference(write: Write, reference: str, message: str):
    text = APPLICATION.replace("common/channels.yaml#/weather", reference)
    path, *_ = write(display=text, common__mqtt=SERVERS, common__channels=CHANNELS)
    (finding,) = findings_of(check(path), "MQTT901")
    assert message in finding.message
    assert finding.place is not None
    assert (finding.place.source, finding.place.line) == (path, 7)


def test_a_circle_through_files_is_a_path(write: Write):
    channels = 'weather: {$ref: "../display.yaml#/channels/weather"}\ntraits: {sure: {}}\n'
    path, _, other = write(display=APPLICATION, common__mqtt=SERVERS, common__channels=channels)
    (finding,) = findings_of(check(path), "MQTT902")
    assert f"circle: #/channels/weather → {other}#/weather → #/channels/weather" in finding.message


def test_a_file_that_is_no_yaml_is_reported_where_it_breaks(write: Write):
    path, _, channels = write(display=APPLICATION, common__mqtt=SERVERS, common__channels="weather: {address: [\n")
    (outcome,) = load_paths([path]).outcomes
    assert {problem.code for problem in outcome.problems} == {"CQ001"}
    assert outcome.problems[0].place is not None
    assert outcome.problems[0].place.source == channels


def test_the_network_is_never_asked():
    text = LIGHTS_V2.replace(
        '$ref: "#/components/parameters/lightId"', "$ref: https://schemas.example.org/parameters.yaml"
    )
    report = check(text.encode(), importer="asyncapi")
    (finding,) = findings_of(report, "MQTT906")
    assert finding.severity == "warning"
    assert finding.place is not None
    assert finding.place.line == 13


def test_bytes_have_no_files_beside_them():
    findings = findings_of(check(APPLICATION.encode(), importer="asyncapi"), "MQTT901")
    assert findings
    assert all("given as bytes" in finding.message for finding in findings)
