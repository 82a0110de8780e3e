"""Every format of text that a registered importer reads: findings at their places, hover of settings and endpoints, outline, hints."""

from pathlib import Path

import pytest

import cqos_core as cqos
from cqos_core import InputError, Severity
from cqos_core.files.importer_choice import recognise
from cqos_core.model.excerpt import exact
from cqos_core.model.source import Source
from cqos_core.plugins import load_plugins

ROOT = Path(__file__).resolve().parents[3]
CASES = "plugins/ros2/tests/importers/cases"
DESIGNS = "tests/decisive/designs"
FILES = {
    "bpmn": ["examples/smart_agriculture_incompatible.bpmn"],
    "yaml": ["examples/delivery_robot.yaml", "examples/mixed/weather_station.yaml", "tests/cli/cases/clashes.yaml"],
    "dds_xml": ["examples/vehicle_qos.xml", f"{DESIGNS}/press_dds.xml"],
    "fastdds_xml": [f"{DESIGNS}/crane_fastdds.xml", f"{CASES}/fastdds/default_and_named.xml"],
    "asyncapi": [f"{DESIGNS}/weather_asyncapi/station.yaml"],
    "wot": [f"{DESIGNS}/lamp_thing/lamp.td.json"],
    "node_red": [f"{DESIGNS}/heating_flows.json"],
    "mosquitto": ["examples/incidents/bridge-clean/site.conf", f"{DESIGNS}/barn_bridge/barn.conf"],
    "topic_info": ["examples/robot_directory/drivers.txt", f"{CASES}/topic_info/foxy_fastdds.txt"],
    "rosbag2": [f"{CASES}/rosbag2/v9_jazzy.yaml"],
    "rosbag2_overrides": [f"{CASES}/rosbag2_overrides/everything.yaml"],
    "qos_overrides": [f"{CASES}/qos_overrides/without_effect.yaml", "examples/robot_directory/config/lidar.yaml"],
    "rviz": ["examples/robot_directory/config/porter.rviz"],
    "gz_bridge": [f"{CASES}/gz_bridge/every_way.yaml", f"{CASES}/gz_bridge/refused.yaml"],
    "ros1_bridge": ["examples/incidents/ros1-map/bridge.yaml"],
    "domain_bridge": [f"{CASES}/domain_bridge/qos.yaml", f"{CASES}/domain_bridge/refused.yaml"],
    "zenoh_bridge": ["examples/zenoh_fleet/carrier.json5", f"{CASES}/zenoh_bridge/refused.json5"],
    "ros2_model": [f"{CASES}/ros2_model/rossdl_test.ros2", f"{CASES}/ros2_model/unknown_parts.ros2"],
}
TEXTS = {
    "mosquitto_log": (
        "farm.log",
        """\
1: mosquitto version 2.0.18 starting
1: New client connected from 127.0.0.1:1 as dash (p2, c1, k60).
2: dash 1 farm/#
3: Received PUBLISH from dash (d0, q1, r0, m1, 'farm/t', ... (2 bytes))
""",
    ),
    "mqtt_client": (
        "mqtt_client.yaml",
        """\
/**:
  ros__parameters:
    broker: {host: localhost, port: 1883}
    bridge:
      ros2mqtt:
        ros_topics: [/scan]
        /scan:
          mqtt_topic: farm/scan
          advanced: {mqtt: {qos: 3}}
""",
    ),
    "cyclonedds_xml": (
        "cyclone.xml",
        '<?xml version="1.0"?>\n<CycloneDDS><Domain id="any"/></CycloneDDS>\n',
    ),
    "opendds_ini": ("opendds.ini", "[rtps_discovery/a]\nLeaseDuration=30\n[endpoint/w]\ntype=writer\n"),
    "nodl": (
        "camera.nodl.yaml",
        """\
nodl_version: 2
publishers:
  - name: "~/image"
    type: sensor_msgs/msg/Image
    qos: {history: KEEP_LAST, depth: 5, reliability: BEST_EFFORT, deadline_ns: 100000000}
subscriptions: [{name: mode, type: std_msgs/String, qos: {history: KEEP_ALL, reliability: RELIABLE}}]
""",
    ),
}
ELSEWHERE = {
    "workspace": "reads folders",
    "fastdds": "reads what fastdds_xml reads, together with nodes of ROS 2",
    "cyclonedds": "reads what cyclonedds_xml reads, together with nodes of ROS 2",
}
SAMPLES = [
    *((importer, file) for importer, files in FILES.items() for file in files),
    *((importer, name) for importer, (name, _) in TEXTS.items()),
]


def test_every_importer_has_a_document_here():
    assert {*FILES, *TEXTS, *ELSEWHERE} == {*load_plugins().importers}


@pytest.fixture(params=SAMPLES, ids=lambda each: f"{each[0]}-{Path(each[1]).name}")
def document(request, tmp_path):
    """A document by itself, with the name of the importer that reads it."""
    importer, file = request.param
    data = TEXTS[importer][1].encode() if importer in TEXTS else (ROOT / file).read_bytes()
    path = tmp_path / Path(file).name
    path.write_bytes(data)
    assert recognise(Source(str(path), data), load_plugins()).name == importer
    return path


def expected(path):
    """Return code and line of all that the library finds in a document."""
    try:
        report = cqos.check(path)
    except InputError as refused:
        return {(each.code, each.place.line) for each in refused.problems}, None
    shown = [each for each in report.findings if each.severity is not Severity.NOTE and each.accepted is None]
    return {(each.code, each.place.line if each.place is not None else None) for each in shown}, report


def asked(editor, path, method, place):
    found = editor.at(path, method, place.line - 1, max(0, (place.column or 1) - 1))
    return "" if found is None else found["contents"]["value"]


def test_a_document_of_every_importer(editor, document):
    """The server finds what the library finds, at the same lines, and explains each setting and each endpoint at its place."""
    wanted, report = expected(document)
    found = editor.open(document, language="plaintext")
    lines = len(document.read_text(encoding="utf-8").splitlines())
    assert {(code, line + 1) for code, line, *_ in found} == {(code, line or 1) for code, line in wanted}
    assert all(0 <= line < lines + 1 for _, line, *_ in found)
    if report is None:
        return
    system = cqos.read(document)
    here = [end for end in system.endpoints if end.place is not None and end.place.line is not None]
    places = exact((end.place for end in here if end.place is not None), system.sources)
    outline = editor.ask("textDocument/documentSymbol", {"textDocument": {"uri": document.as_uri()}})
    assert bool(outline) == bool(here or system.profiles or system.participants)
    for end in here[:10]:
        assert asked(editor, document, "hover", places[end.place]), f"nothing at {end.id}, {end.place}"
    settings = [(end, name, each) for end in here for name, each in end.settings.items()]
    for end, name, each in settings[:: 1 + len(settings) // 10]:
        if each.place is not None and each.place.line is not None and each.place.column is not None:
            said = asked(editor, document, "hover", each.place)
            assert said, f"nothing at {name} of {end.id}, {each.place}"
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": lines, "character": 0}}
    editor.ask("textDocument/inlayHint", {"textDocument": {"uri": document.as_uri()}, "range": whole})
    editor.ask(
        "textDocument/codeAction",
        {"textDocument": {"uri": document.as_uri()}, "range": whole, "context": {"diagnostics": []}},
    )
