"""``cqos convert``: a system in another form."""

import json
import os
import sys
from pathlib import Path

import pytest
import yaml

import cqos_core as cqos_library

ROOT = Path(__file__).resolve().parents[2]
DIAGRAM = ROOT / "examples" / "smart_agriculture_incompatible.bpmn"


def test_a_diagram_becomes_a_system_file(forked, files):
    done = forked("convert", DIAGRAM, "--to", "yaml", "--output", "system.yaml")
    assert (done.code, done.out) == (0, "")
    assert "control flow" in done.err
    before = json.loads(forked("check", DIAGRAM, "--format", "json").out)
    after = json.loads(forked("check", "system.yaml", "--format", "json").out)
    assert after["verdict"] == before["verdict"]
    # A system file has no sequence flows, so nothing of what the drawing says about time.
    drawn = [each["code"] for each in before["findings"] if not each["code"].startswith("BP")]
    assert [each["code"] for each in after["findings"]] == drawn


def test_standard_output_and_input(forked):
    done = forked(
        "convert", "-", "--to", "yaml", "--stdin-name", "x.yaml", stdin="cqos: 1\nparticipants: {a: {publishes: {t: }}}"
    )
    assert (done.code, done.out) == (0, "# From x.yaml\ncqos: 1\n\nparticipants:\n  a:\n    publishes:\n      t: {}\n")


def test_all_paths_are_one_system(cqos):
    done = cqos("convert", "fits.yaml", "lonely.yaml", "--to", "yaml")
    planner = yaml.safe_load(done.out)["participants"]["planner"]
    assert {topic: isinstance(stated, list) for topic, stated in planner["subscribes"].items()} == {
        "scan": True,
        "map": False,
    }


def test_the_configuration_and_the_command_line_are_in_it(cqos, files):
    (files / "cqos.toml").write_text('[options.ros2]\ndistro = "jazzy"\n')
    done = cqos("convert", "fits.yaml", "--to", "yaml", "--option", "ros2.rmw=zenoh")
    assert yaml.safe_load(done.out)["options"] == {"ros2": {"distro": "jazzy", "rmw": "zenoh"}}


def test_settings_of_the_form(cqos):
    assert (
        "shared_1"
        in cqos("convert", ROOT / "examples/smart_agriculture.bpmn", "--to", "yaml", "--set", "profiles=shared").out
    )
    for bad, hint in (
        ("profiles=many", "`profiles` is not `many` help: write one of kept, shared"),
        ("profile=shared", "did you mean `profiles`?"),
        ("profiles", "has no setting `profiles`"),
    ):
        done = cqos("convert", "fits.yaml", "--to", "yaml", "--set", bad)
        assert done.code == 2
        assert hint in " ".join(done.err.split())
    done = cqos("convert", "fits.yaml", "--to", "rclpy", "--set", "a=b")
    assert "it has no settings" in done.err


# Remedies


def test_a_fixed_design(cqos, files):
    done = cqos("convert", DIAGRAM, "--to", "yaml", "--fix", "--output", "mended.yaml")
    assert "still there" in done.err  # one fix asks for less
    done = cqos("convert", DIAGRAM, "--to", "yaml", "--fix", "--weaken", "--output", "mended.yaml")
    assert done.code == 0
    *fixed, note = done.err.splitlines()
    assert fixed == [
        "fixed: offer reliability `reliable` on Drone_ThrowReq (for ROS101)",
        "fixed: request liveliness `automatic` on Station_CatchReq (for ROS104)",
    ]
    assert note.startswith("note: control flow is left out")
    assert "# reliability from a remedy of ROS101" in (files / "mended.yaml").read_text()
    assert cqos("check", "mended.yaml").code == 0


def test_only_what_was_changed_and_nodes_take_by_default(cqos):
    done = cqos("convert", DIAGRAM, "--to", "qos_overrides", "--fix")
    overrides = {"/req_weather_data": {"publisher": {"reliability": "reliable"}}}
    assert yaml.safe_load(done.out) == {"/Participant_Drone": {"ros__parameters": {"qos_overrides": overrides}}}


def test_nothing_to_fix(cqos, files):
    done = cqos("convert", "fits.yaml", "--to", "qos_overrides", "--fix", "--change-program", "--output", "out.yaml")
    assert (done.code, done.out) == (0, "")
    assert done.err == "note: there is no error to fix, so nothing is written\n"
    assert not (files / "out.yaml").exists()


def test_an_error_without_a_fix_is_reported(cqos, files):
    (files / "types.yaml").write_text(
        "cqos: 1\nprotocol: ros2\nparticipants:\n"
        "  a: {publishes: {/t: {type: a/msg/A}}}\n  b: {subscribes: {/t: {type: b/msg/B}}}\n"
    )
    done = cqos("convert", "types.yaml", "--to", "yaml", "--fix", "--change-program")
    assert (done.code, done.out) == (0, "")
    assert "warning: still there: " in done.err
    assert "no such fix is known for 1 error, so nothing is written" in done.err


# What goes wrong


@pytest.mark.parametrize("bad", ["missing.yaml", "broken.yaml", "foreign.yaml"])
def test_half_of_a_system_is_not_written(cqos, files, bad):
    done = cqos("convert", "fits.yaml", bad, "--to", "yaml", "--output", "out.yaml")
    assert (done.code, done.out) == (2, "")
    assert bad in done.err
    assert not (files / "out.yaml").exists()


def test_overrides_alone_say_what_to_name_beside_them(cqos, files):
    (files / "overrides.yaml").write_text("/scan:\n  reliability: best_effort\n  depth: 5\n")
    done = cqos("convert", "overrides.yaml", "--to", "yaml")
    assert done.code == 2
    assert "no endpoint is in it, so name the files of the participants beside it" in done.err


def test_nothing_of_it_can_be_expressed(cqos, files):
    (files / "old.yaml").write_text("before")
    (files / "only.yaml").write_text("cqos: 1\nprotocol: ros2\nparticipants: {a: {serves: {s: {}}}}\n")
    done = cqos("convert", "only.yaml", "--to", "qos_overrides", "--output", "old.yaml")
    assert done.code == 2
    assert "is a service server, and only publishers and subscriptions have `qos_overrides`" in done.err
    assert "nothing of it can be expressed as qos_overrides, so nothing is written" in done.err
    assert (files / "old.yaml").read_text() == "before"


def test_warnings_of_importers_are_repeated(cqos, files):
    (files / "trap.yaml").write_text(
        "cqos: 1\nprotocol: mqtt\nparticipants:\n  a:\n    subscribes:\n      sensors/: #\n"
    )
    done = cqos("convert", "trap.yaml", "--to", "yaml")
    assert "warning[CQ019] trap.yaml:6:" in done.err


def test_an_input_is_not_overwritten(cqos, files):
    before = (files / "fits.yaml").read_text()
    done = cqos("convert", "fits.yaml", "--to", "yaml", "--output", "fits.yaml")
    assert (done.code, "would be overwritten" in done.err) == (2, True)
    assert (files / "fits.yaml").read_text() == before
    assert cqos("convert", "fits.yaml", "--to", "yaml", "--output", "nowhere/out.yaml").code == 2


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(cqos, files):
    (files / "closed").mkdir(mode=0o500)
    assert cqos("convert", "fits.yaml", "--to", "yaml", "--output", "closed/out.yaml").code == 2


def test_wrong_usage(cqos):
    assert cqos("convert", "fits.yaml").code == 2
    done = cqos("convert", "fits.yaml", "--to", "yml")
    assert (done.code, "did you mean `yaml`?" in done.err) == (2, True)
    assert cqos("convert", "--to", "yaml").code == 2
    assert cqos("convert", "fits.yaml", "--to", "yaml", "--change-program").code == 2


def test_many_notes_are_counted(cqos, files):
    services = "".join(f"      s{number}: {{}}\n" for number in range(60))
    (files / "many.yaml").write_text(f"cqos: 1\nprotocol: ros2\nparticipants:\n  a:\n    serves:\n{services}")
    done = cqos("convert", "many.yaml", "--to", "rosbag2_overrides")
    assert done.err.count("overrides are of topics only") == 50
    assert "note: 10 more like these" in done.err


def test_forms_are_listed(cqos):
    listed = json.loads(cqos("packs", "--format", "json").out)
    assert {each["name"] for each in listed["exporters"]} >= {
        "yaml",
        "qos_overrides",
        "rosbag2_overrides",
        "rclpy",
        "rclcpp",
    }


def test_what_is_written_can_be_read_by_the_library(cqos):
    text = cqos("convert", "clashes.yaml", "--to", "yaml").out
    assert cqos_library.check(text.encode()).verdict == "incompatible"
