"""``cqos explain``: one pair, and which endpoints there are."""

import json
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "smart_agriculture_incompatible.bpmn"
ENDS = ("lidar/publisher/scan", "planner/subscriber/scan")


def row(text, policy):
    (line,) = (line for line in text.splitlines() if line.startswith(f"{policy} "))
    return line.split()


def test_every_policy_with_values_origins_verdict_and_rules(cqos, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    done = cqos("explain", "clashes.yaml", *ENDS, "--show", "all")
    assert done.code == 1
    assert row(done.out, "policy") == ["policy", "offered", "requested", "verdict", "rules"]
    assert row(done.out, "reliability") == ["reliability", "best_effort", "reliable", "incompatible", "ROS101"]
    durability = row(done.out, "durability")
    assert durability == [
        "durability",
        "volatile",
        "(preset",
        "default)",
        "volatile",
        "(preset",
        "default)",
        "compatible",
        "ROS102",
    ]
    assert row(done.out, "history")[-1] == "-"
    assert "error[ROS101] reliability-weaker-than-requested" in done.out
    assert "incompatible: 1 topic, 1 pair judged, 1 error" in done.out


def test_an_end_has_no_value_of_a_policy_of_the_other_role_and_derived_defaults_are_left_out(cqos, files, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    text = "{cqos: 1, protocol: mqtt, participants: {a: {publishes: {t: {}}}, b: {subscribes: {t: {}}}}}"
    (files / "mqtt.yaml").write_text(text)
    done = cqos("explain", "mqtt.yaml", "a", "b", "--show", "policies")
    assert row(done.out, "retain") == ["retain", "false", "(default)", "-"]
    assert row(done.out, "retain_handling") == ["retain_handling", "send", "(default)", "-"]
    assert done.out.count("closing_message") == 0


def test_a_pair_that_fits(cqos):
    done = cqos("explain", "fits.yaml", *ENDS)
    assert done.code == 0
    assert done.out.splitlines()[2] == "on ROS 2 topic `/scan`: compatible"
    assert "compatible: 1 topic, 1 pair judged, no findings" in cqos("explain", "fits.yaml", *ENDS, "--show", "all").out


USUAL = [
    ("smart_agriculture_incompatible.bpmn", "Drone_ThrowReq", "Station_CatchReq"),
    ("mobile_robot.yaml", "lidar_driver/publisher/scan", "safety_monitor/subscriber/scan"),
    ("mobile_robot.yaml", "lidar_driver/publisher/scan", "obstacle_detector/subscriber/scan"),
    ("delivery_robot.yaml", "lidar/publisher/scan", "planner/subscriber/scan"),
    ("mqtt_greenhouse.yaml", "controller/publisher/bed/2/valve/set", "valves/subscriber/bed/+/valve/set"),
]


@pytest.mark.parametrize(("file", "publisher", "subscriber"), USUAL)
def test_the_answer_is_a_screen_and_ends_with_what_else_is_shown(cqos, file, publisher, subscriber):
    path = EXAMPLE.with_name(file)
    done = cqos("explain", path, publisher, subscriber)
    lines = done.out.splitlines()
    assert len(lines) <= 20
    verdict = lines[2].rpartition(": ")[2]
    assert verdict == json.loads(cqos("explain", path, publisher, subscriber, "--format", "json").out)["verdict"]
    more = " ".join(done.out[done.out.index("more: ") :].split())
    assert "9 guarantees under faults (--show guarantees)" in more
    assert more.endswith("all (--show all)")


def test_the_answer_names_what_does_not_fit_and_what_to_write(cqos):
    out = cqos("explain", "clashes.yaml", *ENDS).out
    assert row(out, "reliability") == ["reliability", "best_effort", "reliable", "incompatible", "ROS101"]
    assert "\ncompatible: durability, deadline, " in out
    assert "\n  help: offer reliability `reliable` on lidar/publisher/scan\n  write: line 6: " in out


@pytest.mark.parametrize("other", [("--chains",), ("--budgets",), ("--log", "-")])
def test_sections_of_a_pair_go_with_nothing_else(cqos, other):
    assert cqos("explain", "clashes.yaml", "--show", "all", *other, stdin="").code == 2


def test_each_section_is_shown_on_request(cqos):
    whole = cqos("explain", "clashes.yaml", *ENDS, "--show", "all").out
    for section, begins in (("policies", "policy "), ("guarantees", "guarantee "), ("findings", "error[ROS101] ")):
        own = cqos("explain", "clashes.yaml", *ENDS, "--show", section).out.partition("\n\n")[2]
        assert own.startswith(begins)
        assert own in whole


def test_the_order_of_the_ids_does_not_matter(cqos):
    assert cqos("explain", "clashes.yaml", *reversed(ENDS)) == cqos("explain", "clashes.yaml", *ENDS)


def test_assumptions_count(cqos):
    assert cqos("explain", "clashes.yaml", *ENDS, "--option", "ros2.rmw=zenoh").code == 0


def test_as_json(cqos):
    done = cqos("explain", "clashes.yaml", *ENDS, "--format", "json")
    document = json.loads(done.out)
    assert done.code == 1
    assert {key: document[key] for key in ("version", "topic", "protocol", "verdict", "publisher", "subscriber")} == {
        "version": 1,
        "topic": "/scan",
        "protocol": "ros2",
        "verdict": "incompatible",
        "publisher": ENDS[0],
        "subscriber": ENDS[1],
    }
    reliability = next(each for each in document["policies"] if each["policy"] == "reliability")
    assert reliability["offered"]["value"] == "best_effort"
    assert reliability["offered"]["place"]["line"] == 6
    assert (reliability["verdict"], reliability["rules"]) == ("incompatible", ["ROS101"])
    assert [finding["code"] for finding in document["findings"]] == ["ROS101"]


def test_without_ids_the_endpoints_are_listed_by_topic(cqos):
    done = cqos("explain", EXAMPLE)
    assert done.code == 0
    assert done.out.startswith("Req weather data (ros2)\n  publisher   Drone_ThrowReq ")
    document = json.loads(cqos("explain", EXAMPLE, "--format", "json").out)
    assert document["topics"][0]["publishers"] == ["Drone_ThrowReq"]
    assert document["topics"][1]["subscribers"] == ["Drone_CatchResp"]


def test_several_paths_are_one_system(cqos, files):
    (files / "one.yaml").write_text((files / "clashes.yaml").read_text().partition("  planner")[0])
    (files / "other.yaml").write_text(
        "cqos: 1\nprotocol: ros2\nparticipants: {planner: {subscribes: {scan: default}}}\n"
    )
    assert cqos("explain", "one.yaml", "other.yaml", *ENDS).code == 1
    assert "planner/subscriber/scan" in cqos("explain", "one.yaml", "other.yaml").out


def test_an_unknown_id_is_an_error_with_the_nearest_and_all_ids(cqos):
    done = cqos("explain", "clashes.yaml", "lidar/publisher/scn", ENDS[1])
    assert (done.code, done.out) == (2, "")
    assert "there is no endpoint `lidar/publisher/scn`; did you mean `lidar/publisher/scan`?" in done.err
    assert "  subscriber  planner/subscriber/scan\n" in done.err


def test_an_unknown_id_of_many_is_an_error_with_similar_ids_only(cqos, files):
    sensors = "".join(f"  s{n}: {{publishes: {{t{n}: }}}}\n" for n in range(40))
    reader = "  log: {subscribes: {t7: }}\n"
    (files / "many.yaml").write_text(f"cqos: 1\nprotocol: ros2\nparticipants:\n{sensors}{reader}")
    done = cqos("explain", "many.yaml", "log/subscriber/t7", "s7/publsher/t7")
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        "error: there is no endpoint `s7/publsher/t7`; did you mean `s7/publisher/t7`?\n"
        "/t7 (ros2)\n"
        "  publisher   s7/publisher/t7\n"
        "  subscriber  log/subscriber/t7\n"
        "`cqos explain many.yaml` lists all 41 endpoints\n"
    )
    nothing = cqos("explain", "many.yaml", "?", "!")
    assert nothing.err.splitlines()[2:] == ["`cqos explain many.yaml` lists all 41 endpoints"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing.yaml"], "error[CQ001] missing.yaml: cannot be read"),
        (["missing.yaml", *ENDS], "error[CQ001] missing.yaml: cannot be read"),
        (["clashes.yaml", ENDS[0]], "two ids are needed"),
        (["clashes.yaml", ENDS[0], ENDS[0]], "both are publishers; a pair is a publisher and a subscriber"),
        (["lonely.yaml", "lidar/publisher/scan", "planner/subscriber/map"], "they never meet"),
        (["broken.yaml", *ENDS], "error[CQ001] broken.yaml:"),
        (["foreign.yaml"], "no installed importer recognises this format"),
        ([], "Missing argument"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_explained(cqos, arguments, said):
    done = cqos("explain", *arguments)
    assert (done.code, done.out) == (2, "")
    assert said in done.err


def test_a_system_without_endpoints(cqos):
    done = cqos("explain", "nothing.yaml")
    assert "there are no endpoints" in done.out


def test_readable_files_are_explained_and_the_others_reported(cqos):
    done = cqos("explain", "clashes.yaml", "broken.yaml", *ENDS)
    assert done.code == 2
    assert "ROS101" in done.out
    assert "error[CQ001] broken.yaml" in done.err


@pytest.mark.parametrize(("columns", "widest"), [(200, 200), (100, 100), (90, 90), (20, 87)])
def test_long_values_are_broken_in_a_narrow_terminal(cqos, monkeypatch, columns, widest):
    monkeypatch.setenv("COLUMNS", str(columns))
    shown = cqos("explain", "clashes.yaml", *ENDS, "--show", "policies").out
    lines = shown.partition("\n\n")[2].partition("\n\n")[0].splitlines()
    verdict = lines[0].index("verdict")
    assert max(map(len, lines)) <= widest
    assert all(line[verdict - 1 : verdict].strip() == "" for line in lines)


def test_names_of_participants_are_enough_for_the_only_pair(cqos, files):
    whole = cqos("explain", "lonely.yaml", "lidar/publisher/scan", "planner/subscriber/scan")
    for names in (["lidar", "planner"], ["planner", "lidar"], ["lidar", "planner/subscriber/scan"]):
        done = cqos("explain", "lonely.yaml", *names)
        assert (done.code, done.out) == (whole.code, whole.out)
    text = (files / "lonely.yaml").read_text().replace("{scan: default}", "{scan: default, map: default}")
    (files / "two.yaml").write_text(text)
    done = cqos("explain", "two.yaml", "lidar", "planner")
    assert done.code == 2
    assert "2 pairs are between `lidar` and `planner`, name one of them: lidar/publisher/" in done.err
    assert "no publisher matches a subscriber" in cqos("explain", "lonely.yaml", "lidar", "lidar").err
