"""The QoS of a vehicle: both marked mistakes are found at their lines, and the same QoS in a system file is judged the same."""

from pathlib import Path

import pytest

import cqos_core as cqos
from cqos_core.api import context
from cqos_core.files.export import ExportContext
from cqos_core.files.yaml_writer import write

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "examples" / "vehicle_qos.xml"
LINES = FILE.read_text(encoding="utf-8").splitlines()
WHERE = ExportContext(context().find_pack)
# What a team would write that has no XML: every profile for both ends, with what it is based on.
BY_HAND = """
cqos: 1
protocol: dds
profiles:
  periodic_w: {reliability: best_effort, deadline: 100ms}
  periodic_r: {deadline: 200ms}
  state_w: {durability: transient_local, liveliness: automatic, lease_duration: 5s, partition: vehicle}
  state_r: {reliability: reliable, durability: transient_local, lease_duration: 10s, partition: [vehicle]}
participants:
  writers:
    publishes:
      "Common::Periodic": periodic_w
      "Common::State": state_w
      "Vehicle::Position": {profile: periodic_w, deadline: 1s}
      "Vehicle::Route": state_w
      "Vehicle::Mode": state_w
  readers:
    subscribes:
      "Common::Periodic": periodic_r
      "Common::State": state_r
      "Vehicle::Position": periodic_r
      "Vehicle::Route": {profile: state_r, depth: 20, max_samples_per_instance: 10}
      "Vehicle::Mode": state_r
"""


def verdicts(report):
    return {group.topic: str(group.verdict) for group in report.groups}


def tried(report, profiles):
    """The verdicts of hypothetical pairs, which are in no group."""
    apart = {each.topic for each in report.findings if each.verdict == "incompatible"}
    return {profile: "incompatible" if profile in apart else "compatible" for profile in profiles}


def codes(report):
    return sorted((each.code, each.topic) for each in report.findings if not each.code.startswith("CQ"))


def codes_of(topic, report):
    """Those about one topic; profiles that no endpoint uses are tried on others."""
    return [each for each in codes(report) if each[1] == topic]


def test_each_mistake_is_found_where_it_stands():
    report = cqos.check(FILE)
    found = {each.code: each for each in report.findings if each.severity != "note"}
    assert sorted(found) == ["DDS103", "DDS302"]
    facts = {
        (code, fact.policy): fact.place.line
        for code, each in found.items()
        for side in each.sides
        for fact in side.facts
    }
    lines = {key: LINES[(line or 0) - 1].strip() for key, line in facts.items()}
    assert lines["DDS302", "history.depth"].endswith("<depth>20</depth></history>")
    assert lines["DDS302", "resource_limits.max_samples_per_instance"].startswith("<max_samples_per_instance>10")
    offered = next(fact for side in found["DDS103"].sides if side.role == "publisher" for fact in side.facts)
    assert LINES[(offered.place.line or 0) - 1].strip() == "<deadline><period><sec>1</sec></period></deadline>"
    assert (found["DDS302"].severity, found["DDS103"].severity) == ("error", "warning")
    assert (report.verdict, report.hypothetical) == ("unknown", 5)


def test_the_same_qos_in_a_system_file_gives_the_same_verdicts():
    in_xml, by_hand = cqos.check(FILE), cqos.check(BY_HAND.encode())
    assert verdicts(by_hand) == tried(in_xml, verdicts(by_hand))
    assert codes(by_hand) == codes(in_xml)


@pytest.mark.parametrize(
    "profile", ["Common::Periodic", "Common::State", "Vehicle::Position", "Vehicle::Route", "Vehicle::Mode"]
)
def test_profiles_used_from_a_system_file_give_the_same_verdicts(profile, tmp_path):
    system = tmp_path / "s.yaml"
    system.write_text(
        f"cqos: 1\nprotocol: dds\ninclude: {FILE.as_posix()}\nparticipants:\n"
        f'  a: {{publishes: {{t: "{profile}"}}}}\n  b: {{subscribes: {{t: "{profile}"}}}}\n'
    )
    report = cqos.check(system)
    assert verdicts(report)["t"] == tried(cqos.check(FILE), [profile])[profile]
    converted = write(cqos.read(system), WHERE).text
    assert verdicts(cqos.check(converted.encode())) == verdicts(report)
    assert codes_of("t", cqos.check(converted.encode())) == codes_of("t", report)


@pytest.mark.xfail(
    strict=True,
    reason="a profile of the system file has no role, so the parts of one role are tried as both ends: needs a key of the YAML form",
)
def test_a_converted_system_tries_unused_profiles_in_their_roles(tmp_path):
    system = tmp_path / "s.yaml"
    system.write_text(
        f"cqos: 1\nprotocol: dds\ninclude: {FILE.as_posix()}\nparticipants:\n"
        '  a: {publishes: {t: "Vehicle::Mode"}}\n  b: {subscribes: {t: "Vehicle::Mode"}}\n'
    )
    converted = cqos.check(write(cqos.read(system), WHERE).text.encode())
    assert [code for code, _ in codes(converted)] == [code for code, _ in codes(cqos.check(system))]
