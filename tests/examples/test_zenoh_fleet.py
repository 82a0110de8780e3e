"""The example of two Zenoh bridges: each counted mistake is found where it is, nothing else is, and the rest crosses."""

import re
import shutil
from pathlib import Path

import pytest

import cqos_core as cqos
from tests.command_process import run

EXAMPLE = Path(__file__).parents[2] / "examples" / "zenoh_fleet"
FILES = ("carrier.json5", "desk.json5", "fleet.yaml")
FOUND = {
    1: [("warning", "CQ403", "/carrier/battery_state")],
    2: [("warning", "ROS101", "/scan")],
    3: [("warning", "ROS103", "/carrier/odom")],
    4: [
        ("error", "ROS501", "/carrier/diagnostics"),
        ("error", "ROS501", "/diagnostics"),
        ("warning", "ROS523", "carrier/diagnostics"),
    ],
}
FIXES = {
    1: ("carrier.json5", 'publishers: ["/tf_static"', 'publishers: ["/battery_state", "/tf_static"'),
    2: ("fleet.yaml", "/carrier/scan: {depth: 5}", "/carrier/scan: {depth: 5, reliability: best_effort}"),
    3: ("fleet.yaml", "/carrier/odom: {depth: 5, deadline: 100ms}", "/carrier/odom: {depth: 5}"),
    4: ("fleet.yaml", "best_effort, needs: {latest: true}}", "best_effort}"),
}


def loud(folder):
    report = cqos.check(*(folder / name for name in FILES))
    return sorted((each.severity.value, each.code, each.topic) for each in report.findings if each.severity != "note")


def test_each_mistake_is_counted_and_found():
    text = "".join((EXAMPLE / name).read_text(encoding="utf-8") for name in FILES)
    assert sorted(int(number) for number in re.findall(r"(?:#|//) (\d): ", text)) == sorted(FOUND)
    assert loud(EXAMPLE) == sorted(each for found in FOUND.values() for each in found)


@pytest.mark.parametrize("number", FIXES)
def test_each_fix_removes_only_its_own_mistake(number, tmp_path):
    folder = shutil.copytree(EXAMPLE, tmp_path / "fleet")
    name, old, new = FIXES[number]
    text = (folder / name).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (folder / name).write_text(text.replace(old, new), encoding="utf-8")
    assert loud(folder) == sorted(each for other, found in FOUND.items() if other != number for each in found)


def test_the_way_of_the_map_is_explained_hop_by_hop():
    ends = ["localization/publisher/map", "dashboard/subscriber/carrier/map"]
    shown = run(["explain", EXAMPLE, *ends, "--show", "all"], Path.cwd()).out
    first, *_ = shown.partition("\n\nguarantee")
    assert first.splitlines() == [
        "publisher `localization/publisher/map`",
        "subscriber `dashboard/subscriber/carrier/map`",
        "over 2 bridges: compatible",
        "",
        "1. localization/publisher/map to zenoh_bridge_ros2dds (carrier)/subscriber/map on ros2 topic `/map`: compatible",
        "   then over bridge zenoh_bridge_ros2dds (carrier)",
        (
            "2. zenoh_bridge_ros2dds (carrier)/publisher/zenoh:/carrier/map to zenoh_bridge_ros2dds (desk)/subscriber/"
            "zenoh:/carrier/map on ros2 topic `carrier/map`: compatible"
        ),
        "   then over bridge zenoh_bridge_ros2dds (desk)",
        (
            "3. zenoh_bridge_ros2dds (desk)/publisher/carrier/map to dashboard/subscriber/carrier/map on ros2 topic "
            "`/carrier/map`: compatible"
        ),
    ]


def test_a_value_that_is_copied_says_so_at_its_bridge():
    report = cqos.check(*(EXAMPLE / name for name in FILES))
    (finding,) = [each for each in report.findings if each.code == "ROS103"]
    (offered,) = [fact for side in finding.sides for fact in side.facts if side.role == "publisher"]
    line = (EXAMPLE / "desk.json5").read_text(encoding="utf-8").splitlines()[(offered.place.line or 0) - 1]
    assert (Path(offered.place.source).name, line) == ("desk.json5", "    ros2dds: {")
    assert {"start order=publishers first": "incompatible", "start order=subscribers first": "compatible"} == {
        world: verdict.value for world, verdict in finding.worlds.items()
    }
