"""Law: a fix fixes, in every format that people design in. A correct design gets one mistake, and each of its fixes is applied."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from cqos_core import Severity, Verdict, apply, check
from tests.laws.test_fixes import errors, still_there

if TYPE_CHECKING:
    from cqos_core import Finding, Report

DESIGNS: Final = Path(__file__).parents[1] / "decisive/designs"
LOCAL: Final = """cqos: 1
protocol: mqtt
participants:
  till: {broker: barn, publishes: {sold: {qos: 1, retain: true}}}
  board: {broker: barn, subscribes: {sold: {qos: 1, needs: {late_join: true, survives: [broker_stop]}}}}
"""
PANEL: Final = """cqos: 1
protocol: mqtt
participants:
  panel: {broker: "broker:1883", subscribes: {farm/weather: {qos: 1, needs: {loss_free: true}}}}
"""
VALVE: Final = """cqos: 1
protocol: mqtt
participants:
  valve: {broker: "home:1883", subscribes: {room/1/valve: {qos: 1, needs: {loss_free: true}}}}
"""
ADDED: Final = {
    "RViz": (
        "rviz_and_parameters",
        {
            "robot.yaml": {
                "map_server: {publishes: {/map: {depth: 1, durability: transient_local,": "map_server: {publishes: {/map: {depth: 1,"
            }
        },
        "forklift.rviz",
        "Durability Policy: Volatile",
    ),
    "RViz, not stated": (
        "rviz_and_parameters",
        {
            "robot.yaml": {
                "{profile: sensor_data, type: sensor_msgs": "{depth: 5, reliability: best_effort, type: sensor_msgs"
            },
            "lidar.yaml": {"reliability: reliable, ": ""},
            "forklift.rviz": {
                "        Depth: 5\n        Durability Policy: Volatile\n        History Policy: Keep Last\n"
                "        Reliability Policy: Reliable\n        Value: /scan": "        Depth: 5\n        Value: /scan"
            },
        },
        "forklift.rviz",
        "Reliability Policy: Best Effort",
    ),
    "parameters": (
        "rviz_and_parameters",
        {"lidar.yaml": {"reliability: reliable": "reliability: best_effort"}},
        "lidar.yaml",
        "publisher: {reliability: reliable, depth: 10}",
    ),
    "DDS-XML, in a profile's user": (
        "press_dds.xml",
        {
            "press_dds.xml": {
                "<datawriter_qos>\n        <durability><kind>TRANSIENT_LOCAL_DURABILITY_QOS</kind></durability>": "<datawriter_qos>"
            }
        },
        "press_dds.xml",
        '<datawriter_qos base_name="Q::Kept"><durability><kind>TRANSIENT_LOCAL_DURABILITY_QOS</kind></durability></datawriter_qos>',
    ),
    "DDS-XML, a duration": (
        "press_dds.xml",
        {"press_dds.xml": {"<nanosec>500000000</nanosec>": "<nanosec>50000000</nanosec>"}},
        "press_dds.xml",
        '<datareader_qos base_name="Q::Measured"><deadline><period><sec>0</sec><nanosec>100000000</nanosec></period></deadline></datareader_qos>',
    ),
    "DDS-XML, where the entity states it": (
        "press_dds.xml",
        {
            "press_dds.xml": {
                '<data_writer name="Alarm" topic_ref="alarm"><datawriter_qos base_name="Q::Kept"/></data_writer>': """
          <data_writer name="Alarm" topic_ref="alarm">
            <datawriter_qos base_name="Q::Kept">
              <history><depth>5</depth></history>
              <reliability><kind>BEST_EFFORT_RELIABILITY_QOS</kind></reliability>
              <durability><kind>VOLATILE_DURABILITY_QOS</kind></durability>
            </datawriter_qos>
          </data_writer>"""
            }
        },
        "press_dds.xml",
        "<reliability><kind>RELIABLE_RELIABILITY_QOS</kind></reliability>",
    ),
    "Connext": (
        "scanner_connext.xml",
        {
            "scanner_connext.xml": {
                '<datawriter_qos base_name="Scanner::Status"/>': '<datawriter_qos base_name="Scanner::Stream"/>'
            }
        },
        "scanner_connext.xml",
        '<datawriter_qos base_name="Scanner::Stream"><reliability><kind>RELIABLE_RELIABILITY_QOS</kind></reliability></datawriter_qos>',
    ),
    "Fast DDS": (
        "crane_fastdds.xml",
        {
            "crane_fastdds.xml": {
                "<reliability><kind>RELIABLE</kind></reliability>\n        <durability><kind>TRANSIENT_LOCAL</kind></durability>\n      </qos>\n    </data_writer>": "<reliability><kind>RELIABLE</kind></reliability>\n        <durability><kind>VOLATILE</kind></durability>\n      </qos>\n    </data_writer>"
            }
        },
        "crane_fastdds.xml",
        "<durability><kind>TRANSIENT_LOCAL</kind></durability>",
    ),
    "Fast DDS, not stated": (
        "crane_fastdds.xml",
        {
            "crane_fastdds.xml": {
                "<qos><reliability><kind>BEST_EFFORT</kind></reliability></qos>\n    </data_reader>": "<qos><deadline><period><sec>1</sec></period></deadline></qos>\n    </data_reader>"
            }
        },
        "crane_fastdds.xml",
        "<kind>BEST_EFFORT</kind></reliability><deadline><period><sec>1</sec><nanosec>0</nanosec></period></deadline></qos>",
    ),
    "AsyncAPI": (
        "weather_asyncapi",
        {
            "station.yaml": {
                "bindings: {mqtt: {qos: 1, retain: true, messageExpiryInterval: 600}}": "bindings: {mqtt: {retain: true}}"
            },
            "panel.yaml": {"": PANEL},
        },
        "station.yaml",
        "bindings: {mqtt: {retain: true, qos: 1}}",
    ),
    "AsyncAPI without bindings": (
        "weather_asyncapi",
        {
            "station.yaml": {"\n    bindings: {mqtt: {qos: 1, retain: true, messageExpiryInterval: 600}}": ""},
            "panel.yaml": {"": PANEL},
        },
        "station.yaml",
        "\n    bindings: {mqtt: {qos: 1}}\n",
    ),
    "a Thing Description": (
        "lamp_thing",
        {
            "lamp.td.json": {', "mqv:qos": "1", "mqv:retain": true}': "}"},
            "app.yaml": {"{lamp/state: {qos: 1}}": "{lamp/state: {qos: 1, needs: {loss_free: true}}}"},
        },
        "lamp.td.json",
        '"mqv:filter": "lamp/state", "mqv:qos": 1}',
    ),
    "Node-RED": (
        "heating_flows.json",
        {
            "heating_flows.json": {'"topic": "room/1/valve", "qos": "1"': '"topic": "room/1/valve", "qos": ""'},
            "valve.yaml": {"": VALVE},
        },
        "heating_flows.json",
        '"topic": "room/1/valve", "qos": "1", "retain": "true"',
    ),
    "Node-RED, not stated": (
        "heating_flows.json",
        {
            "heating_flows.json": {
                '"topic": "room/1/valve", "qos": "1", "retain": "true", "broker": "b1"': '"topic": "room/1/valve", "broker": "b1"'
            },
            "valve.yaml": {"": VALVE},
        },
        "heating_flows.json",
        '"broker": "b1", "wires": [], "qos": "1"}',
    ),
    "a bridge of Mosquitto": (
        "barn_bridge",
        {
            "barn.conf": {"topic barn/# out 1": "topic barn/#"},
            "clients.yaml": {"barn/weight: {qos: 1}}\n": "barn/weight: {qos: 1, needs: {loss_free: true}}}\n"},
        },
        "barn.conf",
        "topic barn/# out 1\n",
    ),
    "mosquitto.conf, not stated": (
        "barn_bridge",
        {
            "barn.conf": {"persistence true\n": "# what is sold\n"},
            "local.yaml": {"": LOCAL},
        },
        "barn.conf",
        "persistence true\nlistener 1883\n# what is sold",
    ),
    "mosquitto.conf": (
        "barn_bridge",
        {"barn.conf": {"persistence true": "persistence  false"}, "local.yaml": {"": LOCAL}},
        "barn.conf",
        "listener 1883\npersistence true\n",
    ),
}


def laid_out(folder: Path, design: str, mistakes: dict[str, dict[str, str]]) -> list[Path]:
    """Copy a design into a folder, with mistakes put into its texts."""
    where = DESIGNS / design
    if where.is_dir():
        shutil.copytree(where, folder, dirs_exist_ok=True)
    else:
        shutil.copy(where, folder)
    for name, changes in mistakes.items():
        text = (folder / name).read_text(encoding="utf-8") if (folder / name).exists() else ""
        for old, new in changes.items():
            assert old in text, old
            text = text.replace(old, new)
        (folder / name).write_text(text, encoding="utf-8")
    return sorted(folder.iterdir())


def refused(report: Report) -> list[Finding]:
    return [
        each for each in report.findings if each.severity is Severity.ERROR and each.verdict is Verdict.INCOMPATIBLE
    ]


@pytest.mark.parametrize("name", ADDED)
def test_every_fix_of_a_mistake_in_a_file_fixes(name, tmp_path):
    design, mistakes, file, expected = ADDED[name]
    files = laid_out(tmp_path, design, mistakes)
    texts = {str(path): path.read_bytes() for path in files}
    before = check(*files)
    found = refused(before)
    assert found, "there is no mistake"
    offered = []
    for finding in found:
        assert any(remedy.edits for remedy in finding.remedies), f"{finding.code} has no fix as text"
        for remedy in finding.remedies:
            if not remedy.edits:
                continue
            edited = apply([str(path) for path in files], [remedy])
            assert not edited.left, (remedy.text, edited.left)
            for path, data in edited.texts.items():
                Path(path).write_bytes(data)
            after = check(*files)
            for path, data in texts.items():
                Path(path).write_bytes(data)
            assert not still_there(finding, remedy, after), remedy.text
            assert remedy.breaks or not errors(after) - errors(before), remedy.text
            offered += [text.decode() for path, text in edited.texts.items() if Path(path).name == file]
    assert any(expected in text for text in offered), "\n".join(offered)
