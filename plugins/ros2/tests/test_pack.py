"""The pack as a whole: light to register, described for machines, and right about recordings, diagrams and conventions."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from cqos_core import Endpoint, Participant, Report, Setting, System, check, check_pair, explain
from cqos_core.packs import parse
from cqos_core.packs.catalogue import describe_pack, rule_table
from cqos_ros2.conventions import CONVENTIONS
from cqos_ros2.pack import PACK

RAW = PACK.variants["comparison", "rmw"]


def one_topic(topic: str, *endpoints: dict[str, Any]) -> Report:
    system = System(protocol="ros2")
    for number, each in enumerate(endpoints):
        settings = {name: Setting(text) for name, text in each.pop("settings", {}).items()}
        owner = f"p{number}"
        system.participants[owner] = Participant(owner)
        system.endpoints.append(Endpoint(id=f"e{number}", topic=topic, participant=owner, settings=settings, **each))
    return check(system, packs=[PACK])


def test_registering_imports_nothing_heavy():
    script = "import sys, cqos_ros2; print([m for m in sys.modules if m.startswith(('cqos_ros2.', 'yaml', 'pydantic', 'cqos_core.packs.pack'))])"
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.mark.parametrize("pack", [PACK, RAW], ids=["semantic", "rmw"])
def test_the_pack_describes_itself_to_machines(pack):
    described = json.loads(json.dumps(describe_pack(pack)))
    assert described["id"] == "ros2"
    assert all(each["because"] and each["clause"] for each in described["rules"])
    assert all(each["doc"] for each in described["policies"])
    assert all(each["column_form"] for each in described["rules"])


@pytest.mark.parametrize("pack", [PACK, RAW], ids=["semantic", "rmw"])
def test_every_sentence_has_a_text_form(pack):
    for rule in pack.rules:
        read = parse(str(rule.condition), pack.definitions)
        assert (read, str(read)) == (rule.condition, str(rule.condition))


def test_the_first_table_of_the_paper_is_derived():
    bound = next(each for each in PACK.bound_rules if each.rule.code == "ROS101")
    assert [tuple(row.values()) for row in rule_table(bound)] == [
        ("best_effort", "best_effort", "Yes"),
        ("best_effort", "reliable", "No"),
        ("reliable", "best_effort", "Yes"),
        ("reliable", "reliable", "Yes"),
    ]


def test_both_comparisons_use_the_same_codes():
    assert {rule.code: rule.name for rule in RAW.rules}.items() <= {rule.code: rule.name for rule in PACK.rules}.items()


# Dialects


def test_the_integers_of_the_original_tool():
    zeros = dict.fromkeys(
        [
            "history",
            "depth",
            "reliability",
            "durability",
            "deadline",
            "lifespan",
            "liveliness",
            "leaseDuration",
        ],
        "0",
    )
    ones = {"history": "1", "reliability": "1", "durability": "1", "liveliness": "1"}
    report = one_topic(
        "a",
        {"role": "publisher", "dialect": "bpmn", "settings": zeros},
        {"role": "subscriber", "dialect": "bpmn", "settings": ones},
    )
    # best_effort against reliable, transient_local against volatile, automatic against manual_by_topic
    assert [f.code for f in report.findings if f.severity == "error"] == ["ROS101", "ROS104"]


def test_a_zero_of_the_original_tool_is_unset_and_numbers_are_seconds():
    report = one_topic(
        "a",
        {"role": "publisher", "dialect": "bpmn", "settings": {"deadline": "2"}},
        {"role": "subscriber", "dialect": "bpmn", "settings": {"deadline": "0"}},
        {"role": "subscriber", "dialect": "bpmn", "settings": {"deadline": "2.0"}},
        {"role": "subscriber", "dialect": "bpmn", "settings": {"deadline": "10"}},
        {"role": "subscriber", "dialect": "yaml", "settings": {"deadline": "2s"}},
    )
    assert report.verdict == "compatible"


def test_the_integers_of_rmw_are_not_ordered_by_strength():
    recorded = {"reliability": "2", "durability": "2", "history": "3", "depth": "0", "liveliness": "1"}
    infinite = "{sec: 9223372036, nsec: 854775807}"
    durations = dict.fromkeys(["deadline", "lifespan", "liveliness_lease_duration"], infinite)
    report = one_topic(
        "a",
        {"role": "publisher", "dialect": "rosbag", "observed": True, "settings": {**recorded, **durations}},
        {"role": "subscriber", "settings": {"reliability": "reliable"}},
        {"role": "subscriber", "settings": {"reliability": "best_effort"}},
    )
    assert sorted((group.verdict, group.codes) for group in report.groups) == [
        ("compatible", ()),
        ("incompatible", ("ROS101",)),
    ]


def test_the_marker_of_best_available_is_no_duration_of_292_years():
    marker = "{sec: 9223372036, nsec: 854775806}"
    report = one_topic(
        "a",
        {"role": "publisher", "settings": {"deadline": "1s"}},
        {"role": "subscriber", "dialect": "rosbag", "settings": {"deadline": marker}},
    )
    assert report.verdict == "compatible"


def test_parameters_are_nanoseconds():
    report = one_topic(
        "a",
        {"role": "publisher", "dialect": "parameters", "settings": {"deadline": "200000000"}},
        {"role": "subscriber", "settings": {"deadline": "200ms"}},
        {"role": "subscriber", "settings": {"deadline": "199999999ns"}},
    )
    assert sorted(group.verdict for group in report.groups) == ["compatible", "incompatible"]


# Observed endpoints


def test_nothing_is_filled_in_for_what_discovery_did_not_report():
    report = one_topic(
        "a",
        {"role": "publisher", "observed": True, "settings": {"reliability": "reliable"}},
        {"role": "subscriber", "settings": {"durability": "transient_local"}},
    )
    assert report.verdict == "unknown"
    assert {code for group in report.groups for code in group.codes} == {"ROS102"}


def test_rules_about_creating_an_endpoint_are_not_asked_of_one_that_exists():
    report = one_topic(
        "a",
        {
            "role": "publisher",
            "observed": True,
            "settings": {"raw": "true", "history": "keep_last", "reliability": "unknown"},
        },
        {"role": "subscriber", "settings": {"reliability": "best_effort"}},
    )
    assert not [finding.code for finding in report.findings if finding.code.startswith("ROS3")]


# Conventions


@pytest.mark.parametrize("topic", ["/clock", "/rosout", "/parameter_events", "/robot/parameter_events", "/diagnostics"])
@pytest.mark.parametrize("role", ["publisher", "subscriber"])
def test_the_other_side_of_these_is_seldom_part_of_a_design(topic: str, role: str):
    report = one_topic(topic, {"role": role})
    assert not {"CQ401", "CQ402"} & {finding.code for finding in report.findings}


@pytest.mark.parametrize(
    "service", ["/planner/set_parameters", "/robot/planner/get_parameters", "/planner/change_state"]
)
@pytest.mark.parametrize("kind", ["service_client", "service_server"])
def test_nodes_serve_their_parameters_and_states_without_saying_so(service: str, kind: str):
    assert not lonely(service, kind)


@pytest.mark.parametrize("service", ["/set_speed", "/planner/set_parameter", "/planner/reset_state", "/change_state"])
def test_other_services_are_missed(service: str):
    assert lonely(service, "service_client") == {"CQ401"}


def lonely(service: str, kind: str) -> set[str]:
    system = System(protocol="ros2")
    system.participants["tuner"] = Participant("tuner")
    system.endpoints.append(Endpoint(id="a", role="subscriber", topic=service, participant="tuner", kind=kind))
    return {each.code for each in check(system, packs=[PACK]).findings} & {"CQ401", "CQ402"}


def test_conventions_speak_of_policies_that_exist():
    for convention in CONVENTIONS:
        for name, text in convention.settings.items():
            assert PACK.policy(name, "topic").domain.parse(text)


def test_namespaces_are_near_misses():
    system = System(protocol="ros2")
    system.participants |= {
        "lidar": Participant("lidar", settings={"namespace": Setting("/robot")}),
        "planner": Participant("planner"),
    }
    system.endpoints += [
        Endpoint(id="a", role="publisher", topic="scan", participant="lidar"),
        Endpoint(id="b", role="subscriber", topic="scan", participant="planner"),
    ]
    report = check(system, packs=[PACK])
    assert "CQ403" in {finding.code for finding in report.findings}


def test_two_defaults_say_nothing():
    report = check_pair("ros2", packs=[PACK])
    assert (report.verdict, report.findings) == ("compatible", ())


def test_case_files_are_named_after_their_rule():
    for path in (Path(__file__).parent / "cases").glob("*.yml"):
        assert path.read_text().startswith(f"rule: {path.stem}\n")


@pytest.mark.parametrize("policy", ["deadline", "liveliness_lease_duration"])
@pytest.mark.parametrize("text", ["{sec: 9223372036, nsec: 854775806}", "9223372036854775806ns", "best_available"])
def test_the_marker_of_best_available_is_that_word(policy, text):
    liveliness = {"liveliness": "best_available"} if policy != "deadline" else {}
    options = {"rmw": "cyclonedds", "distro": "jazzy"}
    said, meant = (
        check_pair("ros2", {policy: "1s"}, {policy: value, **liveliness}, options) for value in (text, "best_available")
    )
    assert (said.verdict, [each.code for each in said.findings]) == (
        meant.verdict,
        [each.code for each in meant.findings],
    )


def test_cells_proven_on_the_dds_below_say_so():
    system = {
        "cqos": 1,
        "protocol": "ros2",
        "options": {"ros2": {"rmw": "cyclonedds"}},
        "participants": {"a": {"publishes": {"t": {}}}, "b": {"subscribes": {"t": {}}}},
    }
    report = explain(json.dumps(system).encode(), publisher="a/publisher/t", subscriber="b/subscriber/t")
    proven = {text for each in report.guarantees for cell in each.cells for text in cell.proven}
    assert "Cyclone DDS 11.0.1 as plain DDS" in proven


def test_no_fix_changes_a_setting_that_a_middleware_ignores():
    publisher: dict[str, Any] = {"publishes": {"t": {}}}
    system = {
        "cqos": 1,
        "protocol": "ros2",
        "participants": {
            "a": publisher,
            "b": {**publisher, "rmw": "micro_ros"},
            "c": {"subscribes": {"t": {"liveliness": "manual_by_topic"}}},
        },
    }
    report = check(json.dumps(system).encode(), importer="yaml")
    (finding,) = (each for each in report.findings if each.code == "ROS104")
    assert set(finding.endpoints) == {"a/publisher/t", "b/publisher/t", "c/subscriber/t"}
    assert [remedy.members for remedy in finding.remedies] == [("c/subscriber/t",)]
