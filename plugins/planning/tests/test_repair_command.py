"""``cqos repair``: plans of files as users have them, printed and written."""

import importlib.util
import json
import os
import shutil
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("ortools") is None and os.environ.get("CI") != "true",
    reason="OR-tools is not installed: pip install ./plugins/planning",
)

SYSTEM = """\
cqos: 1
protocol: ros2
# my robot
participants:
  lidar:
    publishes:
      /scan: {reliability: best_effort}   # cheap
  planner:
    subscribes:
      /scan: {reliability: reliable}
"""


def test_a_diagram_is_repaired_and_checked_again(cqos, files):
    shutil.copy(EXAMPLES / "smart_agriculture_incompatible.bpmn", files)
    name = "smart_agriculture_incompatible.bpmn"
    before = (files / name).read_text(encoding="utf-8")
    printed = cqos("repair", name)
    assert printed.code == 1
    assert "offer reliability `reliable` on Drone_ThrowReq" in printed.out
    assert "because of ROS104" in printed.out
    assert (files / name).read_text(encoding="utf-8") == before
    assert cqos("repair", "--fix", name).code == 0
    after = (files / name).read_text(encoding="utf-8")
    changed = [(a, b) for a, b in zip(before.splitlines(), after.splitlines(), strict=True) if a != b]
    assert len(changed) == 2
    assert cqos("check", name).code == 0


def test_a_change_takes_two_lines_and_its_reasons_are_shown_on_request(cqos, files):
    shutil.copy(EXAMPLES / "mobile_robot.yaml", files)
    short = cqos("repair", "mobile_robot.yaml").out
    changes = len(json.loads(cqos("repair", "mobile_robot.yaml", "--format", "json").out)["changes"])
    assert short.count("\n  --> ") == changes
    assert short.count("\n") <= 2 * changes + 6
    assert "because of ROS101\n" in short
    assert " ".join(short.split()).endswith("--show reasons explains them")
    reasons = cqos("repair", "mobile_robot.yaml", "--show", "reasons").out
    assert "because of ROS101: a best_effort publisher never sends" in reasons
    assert reasons.count("weight ") == changes + 1


def test_parameters_of_nodes_and_settings_of_rviz_are_edited(cqos, files):
    shutil.copytree(EXAMPLES / "robot_directory", files / "robot")
    done = cqos("repair", "--fix", "robot")
    assert done.code == 0
    assert "config/lidar.yaml:10" in done.out
    assert cqos("check", "--together", "robot").code == 0


def test_a_profile_of_dds_is_edited(cqos, files):
    (files / "qos.xml").write_text(
        """<dds>
  <qos_library name="lib">
    <qos_profile name="fast">  <!-- of the camera -->
      <datawriter_qos><reliability><kind>BEST_EFFORT_RELIABILITY_QOS</kind></reliability></datawriter_qos>
    </qos_profile>
  </qos_library>
</dds>
""",
        encoding="utf-8",
    )
    (files / "system.yaml").write_text(
        """cqos: 1
protocol: dds
participants:
  camera: {publishes: {Image: "lib::fast"}}
  viewer: {subscribes: {Image: {reliability: reliable}}}
""",
        encoding="utf-8",
    )
    done = cqos("repair", "--fix", "qos.xml", "system.yaml", "--keep", "system.yaml")
    assert done.code == 0, done.out + done.err
    text = (files / "qos.xml").read_text(encoding="utf-8")
    assert ">RELIABLE_RELIABILITY_QOS<" in text
    assert "<!-- of the camera -->" in text


def test_a_diff_and_a_form_for_programs_write_nothing(cqos, files):
    (files / "a.yaml").write_text(SYSTEM, encoding="utf-8")
    done = cqos("repair", "--diff", "a.yaml")
    assert done.code == 1
    assert cqos("repair", "--fix", "--diff", "a.yaml") == done
    assert "+      /scan: {reliability: reliable}   # cheap\n" in done.out
    plan = json.loads(cqos("repair", "--format", "json", "a.yaml").out)
    assert plan["confirmed"]
    assert plan["proven"]
    (change,) = plan["changes"]
    assert (change["policy"], change["old"], change["new"]) == ("reliability", "best_effort", "reliable")
    assert change["edits"][0]["place"] == "a.yaml:7:28"
    assert (files / "a.yaml").read_text(encoding="utf-8") == SYSTEM


def test_a_conflicting_set_names_rules_needs_and_what_is_kept(cqos, files):
    (files / "a.yaml").write_text(SYSTEM, encoding="utf-8")
    done = cqos("repair", "a.yaml", "--keep", "lidar", "--keep", "planner")
    assert done.code == 1
    assert "there is no repair" in done.out
    assert "ROS101" in done.out
    assert "`--keep lidar` keeps reliability" in done.out


def test_what_can_be_repaired_is_repaired_and_the_rest_is_named(cqos, files):
    more = "  camera:\n    publishes:\n      /image: {reliability: best_effort}\n  viewer:\n    subscribes:\n      /image: {}\n"
    (files / "a.yaml").write_text(SYSTEM + more, encoding="utf-8")
    done = cqos("repair", "--fix", "a.yaml", "--keep", "lidar", "--keep", "planner")
    assert done.code == 1
    assert "offer reliability `reliable` on camera/publisher/image" in done.out
    words = " ".join(done.out.split())
    assert "these are not repaired: they exclude each other, and none of them can be left out" in words
    assert "`--keep lidar` keeps reliability" in words
    assert "ROS101 stays" in done.err
    text = (files / "a.yaml").read_text(encoding="utf-8")
    assert "/scan: {reliability: best_effort}   # cheap" in text
    assert "/image: {reliability: reliable}" in text
    plan = json.loads(cqos("repair", "--format", "json", "a.yaml", "--keep", "lidar", "--keep", "planner").out)
    assert plan["changes"] == []
    assert len(plan["conflicts"]) == 1
    assert plan["conflict"] == plan["conflicts"][0]
    shutil.copy(EXAMPLES / "mqtt_greenhouse.yaml", files)
    done = cqos("repair", "--fix", "mqtt_greenhouse.yaml")
    assert done.code == 1
    assert "needs late_join" in done.out


def test_a_plan_names_the_warnings_that_it_brings(cqos, files):
    text = (
        "cqos: 1\nprotocol: dds\nparticipants:\n"
        "  a: {publishes: {t: {durability: transient_local}}}\n"
        "  b: {subscribes: {t: {durability: transient, reliability: best_effort}}}\n"
    )
    (files / "a.yaml").write_text(text, encoding="utf-8")
    done = cqos("repair", "a.yaml")
    assert "brings warning[" in done.out


def test_errors_that_no_setting_repairs_stay_and_are_named(cqos, files):
    shutil.copy(EXAMPLES / "mobile_robot.yaml", files)
    done = cqos("repair", "--fix", "mobile_robot.yaml")
    assert done.code == 1
    assert "ROS403 stays" in done.err
    report = json.loads(cqos("check", "--format", "json", "mobile_robot.yaml").out)
    assert {each["code"] for each in report["findings"] if each["severity"] == "error"} == {"ROS403"}


def test_what_cannot_be_planned_is_refused(cqos, files):
    assert cqos("repair", "-").code == 2
    (files / "a.yaml").write_text("cqos: 1\nprotocol: opc\nparticipants: {a: {publishes: {t: }}}\n", encoding="utf-8")
    done = cqos("repair", "a.yaml")
    assert done.code == 2
    assert "could be checked" in done.err


def test_settings_from_requirements_are_written(cqos, files):
    text = """\
cqos: 1
protocol: ros2
participants:
  a: {publishes: {t: }}  # not chosen yet
  b: {subscribes: {t: {needs: {late_join: 3, latest: true}}}}
"""
    (files / "a.yaml").write_text(text, encoding="utf-8")
    printed = cqos("suggest", "a.yaml")
    assert printed.code == 1
    assert "no weaker settings meet the requirements" in printed.out
    assert (files / "a.yaml").read_text(encoding="utf-8") == text
    assert cqos("suggest", "--fix", "a.yaml").code == 0
    assert "# not chosen yet" in (files / "a.yaml").read_text(encoding="utf-8")
    assert cqos("check", "--fail-on", "warning", "a.yaml").code == 0
    assert cqos("suggest", "a.yaml").code == 0


def test_a_conflict_names_the_setting_that_has_no_place(cqos, files):
    text = (EXAMPLES / "mixed" / "weather_station.yaml").read_text(encoding="utf-8")
    (files / "w.yaml").write_text(
        text.replace("needs: {latest: true,", "needs: {late_join: 1, latest: true,"), encoding="utf-8"
    )
    done = cqos("repair", "w.yaml")
    assert done.code == 1
    words = " ".join(done.out.split())
    assert "no file has a place to change durability of `mqtt_client/publisher/resp_weather_data`" in words


def test_a_path_over_a_bridge_is_repaired_on_both_protocols(cqos, files):
    text = (EXAMPLES / "mixed" / "weather_station.yaml").read_text(encoding="utf-8")
    weak = text.replace("reliability: reliable", "reliability: best_effort").replace(" qos: 1,", " qos: 0,")
    (files / "w.yaml").write_text(weak.replace("qos: 1}", "qos: 0}"), encoding="utf-8")
    assert cqos("check", "w.yaml").code == 1
    assert cqos("repair", "--fix", "w.yaml").code == 0
    assert cqos("check", "w.yaml").code == 0
