"""The pack as a whole: light to register, described for machines, and right where several implementations meet."""

import json
import subprocess
import sys
from typing import Any

import pytest

from cqos_core import Report, check, check_pair
from cqos_core.packs import parse
from cqos_core.packs.catalogue import describe_pack, rule_table
from cqos_dds.pack import PACK


def judged(text: dict[str, Any]) -> Report:
    return check(json.dumps({"cqos": 1, "protocol": "dds", **text}).encode(), importer="yaml", packs=[PACK])


def codes(report: Any) -> list[str]:
    return [finding.code for finding in report.findings]


def table(code: str) -> list[tuple[str, ...]]:
    bound = next(each for each in PACK.bound_rules if each.rule.code == code)
    return [tuple(row.values()) for row in rule_table(bound)]


def test_registering_imports_nothing_heavy():
    script = "import sys, cqos_dds; print([m for m in sys.modules if m.startswith(('cqos_dds.', 'yaml', 'pydantic', 'cqos_core.packs.pack'))])"
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_the_pack_describes_itself_to_machines():
    described = json.loads(json.dumps(describe_pack(PACK)))
    assert described["id"] == "dds"
    assert all(each["because"] and each["clause"] for each in described["rules"])
    assert all(each["doc"] for each in described["policies"])


def test_partitions_alone_have_no_column_form():
    described = describe_pack(PACK)
    assert [each["code"] for each in described["rules"] if not each["column_form"]] == ["DDS403", "DDS404"]
    assert [each["name"] for each in described["functions"]] == ["partitions_meet"]


def test_every_sentence_has_a_text_form():
    for rule in PACK.rules:
        read = parse(str(rule.condition), PACK.definitions)
        assert (read, str(read)) == (rule.condition, str(rule.condition))


# The tables are derived from the sentences, under `standard`.


def test_the_table_of_reliability():
    assert table("DDS101") == [
        ("best_effort", "best_effort", "Yes"),
        ("best_effort", "reliable", "No"),
        ("reliable", "best_effort", "Yes"),
        ("reliable", "reliable", "Yes"),
    ]


def test_the_table_of_ownership():
    assert table("DDS107") == [
        ("shared", "shared", "Yes"),
        ("shared", "exclusive", "No"),
        ("exclusive", "shared", "No"),
        ("exclusive", "exclusive", "Yes"),
    ]


@pytest.mark.parametrize(
    ("code", "values", "no"),
    [
        ("DDS102", 4, 6),
        ("DDS104", 3, 3),
        ("DDS108", 2, 1),
        ("DDS109", 3, 3),
        ("DDS110", 2, 1),
        ("DDS111", 2, 1),
    ],
)
def test_the_tables_of_ordered_values(code: str, values: int, no: int):
    answers = [row[-1] for row in table(code)]
    assert len(answers) == values**2
    assert answers.count("No") == no


@pytest.mark.parametrize("code", ["DDS103", "DDS105", "DDS106"])
def test_the_tables_of_durations(code: str):
    assert ("infinite", "1s", "No") in table(code)
    assert ("1s", "infinite", "Yes") in table(code)
    assert ("2s", "2s", "Yes") in table(code)


# Implementations


@pytest.mark.parametrize(
    "implementation",
    ["standard", "cyclonedds", "fastdds_2_9", "fastdds_3_1", "fastdds_3_6", "opendds", "connext", "dust", "rustdds"],
)
def test_two_defaults_fit_everywhere(implementation: str):
    report = check_pair("dds", options={"implementation": implementation}, packs=[PACK])
    assert report.verdict == "compatible"
    assert [finding.code for finding in report.findings if finding.severity != "note"] == []


def test_the_implementations_of_a_system_may_differ_by_participant():
    report = judged(
        {
            "options": {"dds": {"implementation": "cyclonedds", "extensibility": "appendable"}},
            "participants": {
                "sensor": {"publishes": {"reading": {}}},
                "logger": {"subscribes": {"reading": {}}},
                "viewer": {"implementation": "fastdds_3_1", "subscribes": {"reading": {}}},
            },
        }
    )
    assert sorted((group.subscribers, group.verdict) for group in report.groups) == [
        (("logger/subscriber/reading",), "compatible"),
        (("viewer/subscriber/reading",), "incompatible"),
    ]
    assert codes(report) == ["DDS112", "DDS220"]


def test_what_the_types_decide_is_left_open_by_name():
    report = judged(
        {
            "participants": {
                "sensor": {"implementation": "cyclonedds", "publishes": {"reading": {}}},
                "viewer": {"implementation": "fastdds_3_1", "subscribes": {"reading": {}}},
            }
        }
    )
    (finding,) = [finding for finding in report.findings if finding.code == "DDS112"]
    assert report.verdict == "unknown"
    assert dict(finding.worlds) == {
        "dds.extensibility=final": "compatible",
        "dds.extensibility=appendable": "incompatible",
        "dds.extensibility=mutable": "incompatible",
        "dds.extensibility=of_compiler": "compatible",
    }


def test_fast_dds_without_a_version_lists_the_versions_that_differ():
    report = check_pair("dds", {"data_representation": "[xcdr2]"}, {}, {"implementation": "fastdds"}, packs=[PACK])
    (finding,) = [finding for finding in report.findings if finding.code == "DDS112"]
    assert finding.worlds["dds.implementation=fastdds_2_9"] == "compatible"
    assert finding.worlds["dds.implementation=fastdds_3_6"] == "incompatible"
    assert "--option dds.implementation" in (finding.help or "")


# Groups


def test_settings_of_a_group_reach_its_endpoints_and_keep_their_origin():
    report = judged(
        {
            "participants": {
                "sensor": {"publishers": {"raw": {"partition": ["raw"], "publishes": {"reading": {}}}}},
                "logger": {"subscribes": {"reading": {"reliability": "reliable"}}},
            }
        }
    )
    (finding,) = [finding for finding in report.findings if finding.code == "DDS403"]
    side = next(side for side in finding.sides if side.role == "publisher")
    assert next((each.policy, each.value) for each in side.facts) == ("partition", "[raw]")


def test_a_split_lists_the_rules_that_would_fail_without_it():
    report = judged(
        {
            "participants": {
                "sensor": {
                    "publishers": {
                        "raw": {"partition": ["raw"], "publishes": {"reading": {"reliability": "best_effort"}}}
                    }
                },
                "logger": {"subscribes": {"reading": {"reliability": "reliable"}}},
            }
        }
    )
    (finding,) = [finding for finding in report.findings if finding.code == "DDS403"]
    assert finding.severity == "warning"
    assert any("DDS101" in note for note in finding.notes)


@pytest.mark.parametrize("topic", ["DCPSParticipant", "DCPSPublication"])
def test_built_in_topics_are_written_by_others(topic: str):
    report = judged({"participants": {"tool": {"subscribes": {topic: {}}}}})
    assert "CQ401" not in codes(report)


@pytest.mark.parametrize(("ownership", "twice"), [("shared", True), ("exclusive", False)])
def test_of_bridges_before_a_reader_of_exclusive_ownership_one_is_heard(ownership: str, twice: bool):
    ends = {f"{bridge}{domain}": {"domain": domain} for bridge in "ab" for domain in (1, 2)}
    report = judged(
        {
            "participants": {
                "lidar": {"domain": 1, "publishes": {"scan": {}}},
                "logger": {
                    "domain": 2,
                    "subscribes": {"scan": {"ownership": ownership, "needs": {"duplicate_free": True}}},
                },
                **ends,
            },
            "bridges": {
                bridge: {
                    "routes": [
                        {
                            "from": {"participant": f"{bridge}1", "topic": "scan"},
                            "to": {"participant": f"{bridge}2", "ownership": ownership},
                        }
                    ]
                }
                for bridge in "ab"
            },
        }
    )
    assert ("CQ507" in codes(report)) is twice


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ("max_samples: 1, max_samples_per_instance: 5", "unknown"),  # as without it: further writers may exist
        ("max_samples: 5, max_samples_per_instance: 5", "incompatible"),
    ],
)
def test_a_writer_that_cannot_be_created_owns_nothing(limits, expected):
    own = "ownership: exclusive, deadline: 1s, durability: transient_local"
    design = f"""cqos: 1
protocol: dds
topics: {{T: {{keyed: false}}}}
participants:
  w1: {{publishes: {{T: {{{own}, history: keep_all, ownership_strength: 1}}}}}}
  w2: {{publishes: {{T: {{{own}, history: keep_all, ownership_strength: 5, {limits}}}}}}}
  r: {{subscribes: {{T: {{ownership: exclusive, durability: transient_local, reliability: reliable, history: keep_all, needs: {{latest: true}}}}}}}}
"""
    found = check(design.encode(), packs=[PACK])
    verdicts = {name: str(each.verdict) for each in found.groups for name in each.publishers}
    assert {name.partition("/")[0]: verdict for name, verdict in verdicts.items()}["w1"] == expected
    assert ("DDS573" in [each.code for each in found.findings]) is (expected == "incompatible")
