"""XML that is written and read again means the same: DDS-XML and profiles of Fast DDS."""

from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core import Endpoint, Participant, ProfileRef, Setting, System, Topic
from cqos_core.api import context
from cqos_core.files import yaml_writer
from cqos_core.files.export import ExportContext
from cqos_core.plugins import load_plugins
from cqos_dds.exporters import dds_xml, fastdds_xml
from cqos_dds.pack import PACK

FIND = context([PACK]).find_pack
IMPLEMENTATIONS = ("standard", "cyclonedds", "fastdds_3_6", "opendds", "dust")
DURATIONS = ("0s", "1ns", "1500ms", "2s", "1d", "infinite", "{sec: 2147483647, nanosec: 5}")
VALUES: dict[str, tuple[str, ...]] = {
    "reliability": ("best_effort", "reliable"),
    "reliability.max_blocking_time": DURATIONS,
    "durability": ("volatile", "transient_local", "persistent", "default"),
    "deadline": DURATIONS,
    "latency_budget": DURATIONS,
    "liveliness": ("automatic", "manual_by_participant", "manual_by_topic"),
    "liveliness.lease_duration": DURATIONS,
    "ownership": ("shared", "exclusive"),
    "destination_order": ("by_reception_timestamp", "by_source_timestamp"),
    "history": ("keep_last", "keep_all"),
    "history.depth": ("1", "5", "100"),
    "resource_limits.max_samples": ("unlimited", "50", "1000"),
    "resource_limits.max_samples_per_instance": ("unlimited", "3", "default"),
    "user_data": ("", "0x00ff", "plain <text> & ünicode"),
    "entity_factory": ("true", "false"),
}
OMG_ONLY: dict[str, tuple[str, ...]] = {
    "presentation.access_scope": ("instance", "topic", "group"),
    "presentation.coherent_access": ("true", "false"),
    "presentation.ordered_access": ("true", "false"),
    "data_representation": ("[]", "[xcdr1]", "[xcdr2, xcdr1]", "default", "auto"),
}
PARTITION = ("[]", '[""]', "[a]", '[a, "b*"]', '["*"]', '["ä<&>"]')
WRITER: dict[str, tuple[str, ...]] = {
    "lifespan": DURATIONS,
    "ownership_strength": ("-3", "0", "7"),
    "transport_priority": ("0", "4"),
    "durability_service.history_depth": ("1", "9"),
    "durability_service.max_samples": ("unlimited", "4"),
    "writer_data_lifecycle": ("true", "false"),
}
READER: dict[str, tuple[str, ...]] = {
    "time_based_filter": DURATIONS,
    "type_consistency": ("allow_type_coercion", "disallow_type_coercion"),
    "type_consistency.prevent_type_widening": ("true", "false"),
    "reader_data_lifecycle.autopurge_nowriter_samples_delay": DURATIONS,
}
TOPICS = ("scan", "/scan", "a b", "Größe::ä", "<t> & 'q'")


@st.composite
def systems(draw, shared):
    """Draw a system of DDS endpoints with values of ``shared``, of their partition and of their role."""
    system = System(name="s", protocol="dds")
    for name in ("p", "q/r", "x::y"):
        settings = draw(st.sampled_from([{}, {"domain": Setting("0")}, {"domain": Setting("7")}]))
        system.participants[name] = Participant(name, settings=settings)
    for number in range(draw(st.integers(1, 7))):
        role = draw(st.sampled_from(["publisher", "subscriber"]))
        values = shared | {"partition": PARTITION} | (WRITER if role == "publisher" else READER)
        chosen = draw(
            st.fixed_dictionaries({}, optional={name: st.sampled_from(each) for name, each in values.items()})
        )
        system.endpoints.append(
            Endpoint(
                id=f"e{number}",
                role=role,
                topic=draw(st.sampled_from(TOPICS[:2] if number % 2 else TOPICS)),
                participant=draw(st.sampled_from(sorted(system.participants))),
                settings={name: Setting(text) for name, text in chosen.items()},
                type=draw(st.sampled_from([None, "T", "M::T"])),
            )
        )
    return system


def verdicts(system, implementation):
    """How many pairs of each topic have which verdict, and what is wrong with endpoints and pairs."""
    report = cqos.check(system, options={"dds": {"implementation": implementation}}, packs=[PACK])
    pairs: Counter[tuple[str, str]] = Counter()
    for group in report.groups:
        pairs[group.topic, str(group.verdict)] += len(group.publishers) * len(group.subscribers)
    wrong = {(finding.code, finding.topic) for finding in report.findings if finding.severity == "error"}
    return pairs, wrong


def written(exporter, system, **settings):
    exported = exporter.write(system, ExportContext(FIND, settings=settings))
    return exported, cqos.read(exported.text.encode(), importer=exporter.__name__.rpartition(".")[2])


def one_type_for_each_topic(system):
    """In DDS a participant has a topic with one type only, so that is what XML can say."""
    types: dict[tuple[str, str | None], str | None] = {}
    for end in system.endpoints:
        types.setdefault((end.participant, end.topic), end.type)
    ends = [replace(end, type=types[end.participant, end.topic]) for end in system.endpoints]
    return replace(system, endpoints=ends)


@given(systems(VALUES | OMG_ONLY), st.sampled_from(IMPLEMENTATIONS))
def test_dds_xml_read_again_gives_the_same_verdicts(system, implementation):
    system = one_type_for_each_topic(system)
    exported, again = written(dds_xml, system)
    assert exported.expressed == len(again.endpoints) == len(system.endpoints)
    assert verdicts(again, implementation) == verdicts(system, implementation)
    assert [note.code for note in again.notes] == []


@given(systems(VALUES), st.sampled_from(["fastdds_2_9", "fastdds_3_1", "fastdds_3_6"]))
def test_profiles_of_fast_dds_read_again_give_the_same_verdicts(system, implementation):
    system.participants = {name: replace(each, settings={}) for name, each in system.participants.items()}
    system.options["dds"] = {"implementation": Setting(implementation)}
    exported, again = written(fastdds_xml, system, topics="named")
    assert exported.expressed == len(again.endpoints) == len(system.endpoints)
    before, after = verdicts(system, implementation), verdicts(again, implementation)
    assert after[0] == before[0]
    # These profiles cannot hold lifecycles and type checks; neither causes an error.
    assert after[1] == before[1]


def dds(*ends, **more):
    system = System(name="s", protocol="dds", **more)
    for end in ends:
        system.endpoints.append(end)
        system.participants.setdefault(end.participant, Participant(end.participant))
    return system


def end(name, role, topic="t", **settings):
    stated = {key.replace("__", "."): Setting(text) for key, text in settings.items()}
    return Endpoint(id=name, role=role, topic=topic, participant="p", settings=stated)


def test_endpoints_of_one_topic_share_a_profile_where_they_can():
    text = dds_xml.write(
        dds(
            end("w1", "publisher", reliability="best_effort"),
            end("w2", "publisher", reliability="best_effort"),
            end("w3", "publisher", reliability="reliable"),
            end("r", "subscriber", deadline="1s"),
        ),
        ExportContext(FIND),
    ).text
    assert text.count("<qos_profile ") == 2
    assert text.count('<datawriter_qos base_name="Qos::t"/>') == 2
    assert text.count('<datawriter_qos base_name="Qos::t~2"/>') == 1


def test_notes_name_what_the_forms_cannot_hold():
    system = dds(
        end("w", "publisher", presentation__access_scope="group", transport_priority="3", reliability="nonsense"),
        Endpoint(id="m", role="publisher", topic="t", participant="ros", protocol="ros2"),
        end("bell", "publisher", "a\x07b"),
        options={"dds": {"implementation": Setting("cyclonedds")}},
    )
    system.topics["t"] = Topic("t", {"keyed": Setting("true")}, external=True)
    general = (
        "1 endpoint of other protocols left out",
        "what is known of topics as such (keys, periods, sizes) has no place in the form",
        "that some have partners outside of this system has no place in the form",
        "the implementation (cyclonedds) has no place in the form: state it with --option dds.implementation=…",
    )
    assert dds_xml.write(system, ExportContext(FIND)).notes == (
        "endpoint `w`: left out, because the value is not known: reliability",
        "endpoint `bell` has no topic name that XML can hold",
        *general,
    )
    assert fastdds_xml.write(system, ExportContext(FIND)).notes == (
        "endpoint `w`: left out, because the value is not known: reliability",
        "endpoint `w`: profiles of Fast DDS have no presentation.access_scope",
        "endpoint `w`: profiles of Fast DDS have no transport_priority",
        "endpoint `bell` has no topic name that XML can hold",
        *general,
    )


@pytest.mark.parametrize("exporter", [dds_xml, fastdds_xml, yaml_writer])
def test_what_is_not_known_is_not_written_as_a_default(exporter):
    base = 'base_name="BuiltinQosLib::Pattern.Status"'
    text = f"""<dds><qos_library name="L"><qos_profile name="A" {base}>
      <datawriter_qos><reliability><kind>$(KIND)</kind></reliability></datawriter_qos></qos_profile>
      <qos_profile name="C"><datawriter_qos><history><depth>2</depth></history>
      <reliability><kind>$(KIND)</kind></reliability></datawriter_qos></qos_profile>
      <qos_profile name="F"><datawriter_qos topic_filter="X*"><history><depth>3</depth></history></datawriter_qos>
      </qos_profile></qos_library></dds>"""
    exported = exporter.write(cqos.read(text.encode()), ExportContext(FIND))
    assert any("known" in note for note in exported.notes)
    assert any("for some topics only" in note for note in exported.notes)
    if exporter is yaml_writer:
        assert "variable `KIND` is not set" in exported.text
        assert cqos.check(exported.text.encode()).verdict == "unknown"
    else:
        assert 'name="A"' not in exported.text


@pytest.mark.parametrize("exporter", [dds_xml, fastdds_xml])
def test_of_nothing_nothing_is_written(exporter):
    ros = dds(Endpoint(id="m", role="publisher", topic="t", participant="ros", protocol="ros2"))
    for system in System(protocol="dds"), ros:
        exported = exporter.write(system, ExportContext(FIND))
        assert (exported.expressed, exported.text) == (0, "")


PAIRS_OF_PROFILES = """cqos: 1
protocol: dds
options: {dds: {implementation: fastdds_3_6}}
participants:
  p: {publishes: {a: "L::A", b: "L::B", Xb: "L::B"}}
  q: {subscribes: {a: "L::A", b: "L::B", Xb: "L::B"}}
"""


def verdicts_of_profiles(system):
    """The verdicts of pairs of a system file that take the profiles of a library."""
    report = cqos.check(PAIRS_OF_PROFILES.encode(), system, packs=[PACK])
    return {group.topic: str(group.verdict) for group in report.groups}


def tried(system):
    """How many pairs of profiles are tried out, and on which topics a wrong one is reported."""
    report = cqos.check(system, options={"dds": {"implementation": "fastdds_3_6"}}, packs=[PACK])
    assert (report.groups, report.verdict) == ((), "unknown")
    # As a warning: nothing says that its ends ever match.
    return report.hypothetical, {
        (each.topic, str(each.severity)) for each in report.findings if each.verdict == "incompatible"
    }


def test_a_library_is_written_in_either_form_and_tried_out_to_the_same_verdicts():
    text = """<dds><qos_library name="L"><qos_profile name="A">
      <datawriter_qos><reliability><kind>BEST_EFFORT_RELIABILITY_QOS</kind></reliability></datawriter_qos>
      <datareader_qos><reliability><kind>RELIABLE_RELIABILITY_QOS</kind></reliability></datareader_qos></qos_profile>
      <qos_profile name="B" base_name="A"><datareader_qos><reliability><kind>BEST_EFFORT_RELIABILITY_QOS</kind></reliability>
      </datareader_qos><datawriter_qos topic_filter="X*"/></qos_profile></qos_library></dds>"""
    system = cqos.read(text.encode())
    # What a profile has for some topics only is tried on one of them, and not written.
    assert tried(system) == (3, {("L::A", "warning")})
    assert verdicts_of_profiles(system) == {"a": "incompatible", "b": "compatible", "Xb": "compatible"}
    for exporter in dds_xml, fastdds_xml:
        _, again = written(exporter, system)
        assert tried(again) == (2, {("L::A", "warning")})
        assert verdicts_of_profiles(again) == verdicts_of_profiles(system)
        assert not again.endpoints


def test_export_of_fixes_writes_only_the_changed_values():
    system = dds(end("w", "publisher", reliability="reliable"), end("r", "subscriber", deadline="1s"))
    exported = dds_xml.write(system, ExportContext(FIND, changed=frozenset({("w", "reliability")})))
    assert exported.expressed == 1
    assert "RELIABLE_RELIABILITY_QOS" in exported.text
    assert "deadline" not in exported.text


def test_a_profile_from_yaml_is_written_with_the_values_it_gives():
    system = dds(
        Endpoint(
            id="w",
            role="publisher",
            topic="t",
            participant="p",
            settings={},
            profiles=(ProfileRef("BuiltinQosLib::Generic.StrictReliable"),),
        )
    )
    text = dds_xml.write(system, ExportContext(FIND)).text
    assert "KEEP_ALL_HISTORY_QOS" in text


def test_they_are_registered_with_their_settings():
    exporters = load_plugins().exporters
    assert exporters["dds_xml"].choices() == {"participants": ("with", "without")}
    assert exporters["fastdds_xml"].choices() == {"topics": ("unnamed", "named")}
