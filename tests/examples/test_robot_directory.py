"""The files of one robot, checked together: the findings, the file and line of each value, and the fixes."""

import json
import shutil
from pathlib import Path

import pytest

import cqos_core as cqos
from tests import command_process

EXAMPLE = Path(__file__).parents[2] / "examples" / "robot_directory"
FILES = {"bag/metadata.yaml", "config/lidar.yaml", "config/porter.rviz", "drivers.txt", "robot.yaml"}

# Rule and topic to both values: each with its text, its origin, its file and its line.
FOUND = {
    ("ROS101", "/camera/image_raw"): {
        "offered": ("best_effort", "explicit", "drivers.txt", "  Reliability: BEST_EFFORT"),
        "requested": ("reliable", "explicit", "config/porter.rviz", "        Reliability Policy: Reliable"),
    },
    ("ROS101", "/imu/data"): {
        "offered": ("best_effort", "explicit", "bag/metadata.yaml", "            reliability: best_effort"),
        "requested": ("reliable", "explicit", "robot.yaml", "      /imu/data: {depth: 50, reliability: reliable}"),
    },
    ("ROS101", "/scan"): {
        "offered": ("best_effort", "qos_overrides", "config/lidar.yaml", "          reliability: best_effort"),
        "requested": (
            *("reliable", "explicit", "robot.yaml"),
            "      /scan: {depth: 5, reliability: reliable, deadline: 150ms}",
        ),
    },
    ("ROS102", "/battery_state"): {
        "offered": ("volatile", "explicit", "drivers.txt", "  Durability: VOLATILE"),
        "requested": (
            *("transient_local", "explicit", "robot.yaml"),
            "      /battery_state: {depth: 1, durability: transient_local}",
        ),
    },
    ("ROS103", "/scan"): {
        "offered": ("200ms", "qos_overrides", "config/lidar.yaml", "          deadline: 200000000"),
        "requested": (
            *("150ms", "explicit", "robot.yaml"),
            "      /scan: {depth: 5, reliability: reliable, deadline: 150ms}",
        ),
    },
}

# A change in one file, and the findings that it removes.
FIXES = [
    (
        *("config/porter.rviz", "Reliable\n        Value: /camera", "Best Effort\n        Value: /camera"),
        {("ROS101", "/camera/image_raw")},
    ),
    (
        "robot.yaml",
        "depth: 50, reliability: reliable",
        "depth: 50, reliability: best_effort",
        {("ROS101", "/imu/data")},
    ),
    ("bag/metadata.yaml", "reliability: best_effort", "reliability: reliable", {("ROS101", "/imu/data")}),
    ("config/lidar.yaml", "reliability: best_effort", "reliability: reliable", {("ROS101", "/scan")}),
    ("config/lidar.yaml", "deadline: 200000000", "deadline: 150000000", {("ROS103", "/scan")}),
    ("config/lidar.yaml", "lidar_driver:", "other_driver:", {("ROS101", "/scan"), ("ROS103", "/scan")}),
    (
        *("drivers.txt", "(10)\n  Durability: VOLATILE", "(10)\n  Durability: TRANSIENT_LOCAL"),
        {("ROS102", "/battery_state")},
    ),
]


def run(*arguments, folder=EXAMPLE.parent):
    return command_process.run_here([*arguments, "--no-config"], folder)


def errors(report):
    return {(each.code, each.topic) for each in report.findings if each.severity == "error"}


def test_findings_name_file_and_line_of_every_value():
    code, out, err = run("check", EXAMPLE.name, "--together", "--format", "json")
    assert (code, err) == (1, "")
    found: dict[tuple[str, str], dict[str, tuple[str, ...]]] = {}
    for finding in json.loads(out)["findings"]:
        if finding["severity"] == "note":
            continue
        sides = found.setdefault((finding["code"], finding["topic"]), {})
        for side in finding["sides"]:
            fact = side["facts"][0]
            place = fact["place"]
            line = (EXAMPLE.parent / place["source"]).read_text(encoding="utf-8").splitlines()[place["line"] - 1]
            assert line[place["column"] - 1 :].strip()
            assert line[place["column"] - 2] in " {"
            role = {"publisher": "offered", "subscriber": "requested"}[side["role"]]
            sides[role] = (fact["value"], fact["origin"], place["source"].removeprefix(f"{EXAMPLE.name}/"), line)
    assert found == FOUND


def test_every_file_has_a_part_in_it():
    system = cqos.read(EXAMPLE)
    assert {Path(name).relative_to(EXAMPLE).as_posix() for name in system.sources} == FILES
    assert {value[2] for sides in FOUND.values() for value in sides.values()} == FILES


def test_the_order_of_the_files_does_not_matter():
    names = sorted(FILES)
    reports = [cqos.check(*(EXAMPLE / name for name in order)) for order in (names, names[::-1])]
    assert errors(reports[0]) == errors(reports[1]) == set(FOUND)


@pytest.mark.parametrize(("file", "old", "new", "gone"), FIXES)
def test_a_fix_in_one_file_removes_its_findings(tmp_path, file, old, new, gone):
    folder = shutil.copytree(EXAMPLE, tmp_path / "robot")
    text = (folder / file).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    assert errors(cqos.check(folder)) == set(FOUND) - gone


def test_will_this_bag_play_into_the_stack():
    code, out, _ = run("check", "robot.yaml", "bag/", "--together", "--format", "concise", folder=EXAMPLE)
    assert code == 1
    assert out.startswith("robot.yaml:25:43: error[ROS101] publisher `rosbag2_player/publisher/imu/data` ")
    assert out.count("error[") == 1


def test_an_override_for_the_player_makes_it_play(tmp_path):
    override = tmp_path / "play.yaml"
    code, _, err = run(
        *("convert", EXAMPLE / "robot.yaml", EXAMPLE / "bag", "--to", "rosbag2_overrides", "--output", override)
    )
    assert (code, err) == (0, "")
    code, out, _ = run("check", EXAMPLE / "robot.yaml", EXAMPLE / "bag", override, "--together", "--format", "json")
    assert [each["code"] for each in json.loads(out)["findings"] if each["severity"] == "error"] == []
    assert code == 0


def test_exported_parameters_fix_what_parameters_can(tmp_path):
    """Parameters fix the driver and the monitor; the bag, RViz and observed endpoints need other changes."""
    fix = tmp_path / "fix.yaml"
    code, _, err = run("convert", EXAMPLE, "--to", "qos_overrides", "--fix", "--weaken", "--output", fix)
    assert code == 0
    assert "not from parameters" in err
    assert err.count("was observed as it was") == 1
    # Without an option of the program, parameters set history, depth and reliability only.
    for policy in ("durability", "deadline"):
        assert f": {policy} is left out: a program takes it from parameters only where it lists it" in err
    code, out, _ = run("check", EXAMPLE, fix, "--together", "--format", "json")
    left = {(each["code"], each["topic"]) for each in json.loads(out)["findings"] if each["severity"] == "error"}
    assert left == set(FOUND) - {("ROS101", "/scan")}
