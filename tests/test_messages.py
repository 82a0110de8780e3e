"""Values travel as messages and come back as they were."""

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos.v1 import report_pb2, system_pb2
from cqos_core.checking.checker import check_system
from cqos_core.matching.pipeline import context
from cqos_core.model import finding as f
from cqos_core.model import report as r
from cqos_core.model import settings as t
from cqos_core.model import system as s
from cqos_core.remote import asked, messages
from cqos_core.remote.messages import (
    from_message,
    report_message,
    report_value,
    system_message,
    system_value,
    to_message,
)
from cqos_core.remote.request_problems import system_problems
from tests.laws.systems import BOTH, systems

EXAMPLES = [
    path for path in sorted((Path(__file__).parents[1] / "examples").iterdir()) if path.suffix in {".yaml", ".bpmn"}
]

UNKNOWN_ROLE: Any = 7  # of a newer contract

# Everything that UTF-8 can carry.
text = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
texts = st.lists(text, max_size=3).map(tuple)
number = st.integers(0, 2**31)
places = st.builds(
    t.Place, text, st.none() | st.integers(1, 9), st.none() | st.integers(1, 9), st.none() | text, st.none() | text
)
facts = st.builds(f.Fact, text, text, text, st.none() | places)
sides = st.builds(f.Side, text, texts, text, st.lists(facts, max_size=2).map(tuple), st.none() | places)
remedies = st.builds(
    f.Remedy,
    st.sampled_from(["publisher", "subscriber"]),
    texts,
    text,
    text,
    text,
    text,
    st.none() | number,
    st.none() | number,
)
verdicts = st.sampled_from(list(f.Verdict))
findings = st.builds(
    f.Finding,
    text,
    text,
    st.sampled_from(list(f.Severity)),
    text,
    text,
    st.none() | text,
    st.none() | verdicts,
    st.lists(sides, max_size=2).map(tuple),
    st.lists(remedies, max_size=2).map(tuple),
    texts,
    text,
    text,
    st.none() | text,
    number,
    st.dictionaries(text, verdicts, max_size=2),
    texts,
    st.none() | text,
)
groups = st.builds(r.Group, text, texts, texts, verdicts, text, number, texts)
reports = st.builds(
    r.Report,
    verdicts,
    st.lists(groups, max_size=3).map(tuple),
    st.lists(findings, max_size=3).map(tuple),
    texts,
    text,
    texts,
    number,
    number,
    assumed=st.lists(st.builds(r.Assumption, text, texts), max_size=2).map(tuple),
)


@given(reports)
def test_a_report_comes_back_as_it_was(report):
    data = report_message(report).SerializeToString()
    assert report_value(report_pb2.Report.FromString(data)) == report


@given(reports)
def test_what_a_message_adds_up_is_what_the_report_says(report):
    message = report_message(report)
    assert message.counts.pairs == report.pair_count == sum(group.pairs for group in message.groups)
    assert message.counts.errors == report.count(f.Severity.ERROR)
    assert message.counts.accepted == sum(finding.accepted is not None for finding in report.findings)
    for finding, sent in zip(report.findings, message.findings, strict=True):
        assert (from_message(sent.place) if sent.HasField("place") else None) == finding.place


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_a_system_comes_back_as_it_was(path):
    if path.parent.name == "opcua":
        pytest.skip("needs its pack")
    system = cqos.read(path)
    back = system_value(system_pb2.System.FromString(system_message(system).SerializeToString()))
    assert replace(back, sources=system.sources) == system
    assert list(back.sources) == list(system.sources)
    assert list(system_problems(system_message(system))) == []


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(data=st.data())
def test_any_system_comes_back_as_it_was(words, data):
    system = data.draw(systems(words))
    back = system_value(system_pb2.System.FromString(system_message(system).SerializeToString()))
    assert replace(back, sources=system.sources) == system


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(data=st.data())
def test_a_system_of_messages_has_the_report_of_one_of_objects(words, data):
    system = data.draw(systems(words))
    message = system_message(system)
    for each in message.endpoints:  # a modeler has no files
        for name in ("place", "room", "settings_stated"):
            each.ClearField(name)
    objects = replace(system_value(message), endpoints=[from_message(each) for each in message.endpoints])
    assert check_system(system_value(message), context()) == check_system(objects, context())


_PARTS: dict[str, Any] = {
    "role": report_pb2.ROLE_SUBSCRIBER,
    "settings": {"depth": "3", "reliability": "reliable", "": "x"},
    "settings_stated": [system_pb2.StatedSetting(name="depth", reported="CQ041")],
    "overlay": {"depth": "4"},
    "overlay_stated": [],
    "needs": {"late_join": "true"},
    "needs_stated": [],
    "profiles": [system_pb2.ProfileRef(name="p")],
    "starts_after": ["f"],
    "place": report_pb2.Place(source="a"),
    "room": system_pb2.Room(place=report_pb2.Place(source="a")),
}


@pytest.mark.parametrize("field", [*system_pb2.Endpoint.DESCRIPTOR.fields], ids=lambda field: field.name)
def test_an_endpoint_of_a_system_is_that_of_its_message_alone(field):
    value = _PARTS.get(field.name, True if field.type == field.TYPE_BOOL else f"x{field.name}")
    stated: dict[str, Any] = {"id": "e", "role": report_pb2.ROLE_PUBLISHER, "participant": "a", field.name: value}
    one = system_pb2.Endpoint(**stated)
    other = system_pb2.Endpoint(id="f", role=report_pb2.ROLE_PUBLISHER, participant="a", settings={"depth": "7"})
    read = system_value(system_pb2.System(endpoints=[one, other, one])).endpoints
    assert [*read] == [from_message(one), from_message(other), from_message(one)]


def test_every_kind_of_value_in_a_system_comes_back():
    place = t.Place("a.yaml", 3, 4, "e", "p.q")
    stated = {"b": t.Setting("1", place), "a": t.Setting("2"), "": t.Setting("")}
    system = s.System(
        name="all",
        protocol="ros2",
        options={"ros2": stated, "dds": {}},
        profiles={
            "p": s.Profile(
                "p",
                stated,
                (s.ProfileRef("q", place), s.ProfileRef("r", None, s.Scope("publisher", "a*", ("b",), "x"))),
                place,
            )
        },
        topics={"t": s.Topic("t", stated, external=True, protocol="dds", place=place), "u": s.Topic("u")},
        participants={
            "n": s.Participant(
                "n", "ros2", stated, {"b": "x", "a": "y"}, True, ("m",), "n$", "N", place, groups={"publishers": place}
            ),
            "m": s.Participant("m"),
        },
        endpoints=[
            s.Endpoint(
                id="e",
                role="publisher",
                topic="t",
                participant="n",
                settings=stated,
                profiles=(s.ProfileRef("p"),),
                overlay=stated,
                needs=stated,
                type="T",
                kind="service_server",
                dialect="bpmn",
                observed=True,
                external=True,
                topic_is_guess=True,
                starts_after=("n",),
                template="e$",
                protocol="dds",
                label="label",
                place=place,
            ),
            s.Endpoint(id="f", role="subscriber", topic=None, participant="m"),
            s.Endpoint(
                id="g",
                role="subscriber",
                topic="",
                participant="m",
                type="",
                label="",
                template="",
                protocol="",
                kind="",
                dialect="",
            ),
        ],
        overlays=[
            s.Overlay("o", stated, "publisher", "t*", "n*", "e", "ros2", ("rmw", "fastdds"), ("w",), "bpmn", place),
            s.Overlay("o", {}),
        ],
        brokers={"k": s.Broker("k", "mqtt", stated, (s.ProfileRef("p"),), place)},
        bridges={
            "l": s.Bridge(
                "l",
                (
                    s.Route(
                        s.Endpoint(id="", role="subscriber", topic="t", participant="n"),
                        s.Endpoint(id="", role="publisher", topic=None, participant="m"),
                        place,
                    ),
                ),
                ("liveliness",),
                place,
            )
        },
        checks=[
            s.TeamRule(
                name="c",
                where=(("role", "publisher"), ("topic", "*")),
                require=(s.Bound("a", "not", ("1", "2"), place),),
                because="why",
                sentence="a == b",
                severity="note",
                place=place,
            ),
            s.TeamRule("d", (), (), "why"),
        ],
        accept=[s.Acceptance("R1", "why", "t", "e", "2027-01-01", place), s.Acceptance("R2", "why")],
        severities={"R1": "off", "R0": "error"},
        notes=[s.ImportNote("CQ1", "note", "m", place, "h", "e"), s.ImportNote("CQ2", "error", "m")],
        sources={"b.yaml": b"", "a.yaml": b""},
    )
    message = system_message(system)
    back = system_value(system_pb2.System.FromString(message.SerializeToString()))
    assert back == system
    assert list(back.endpoints[0].settings) == ["b", "a", ""]
    assert list(back.participants["n"].remap) == ["b", "a"]
    assert list(back.sources) == ["b.yaml", "a.yaml"]
    assert list(system_problems(message)) == []


def test_half_a_character_is_replaced_since_no_message_can_carry_it():
    report = r.Report(f.Verdict.UNKNOWN, (r.Group("\ud800", ("a\udfff",), (), f.Verdict.UNKNOWN, "ros2"),))
    back = report_value(report_message(report))
    assert (back.groups[0].topic, back.groups[0].publishers) == ("?", ("a?",))


def test_everything_wrong_with_a_system_is_named_with_its_field():
    message = system_pb2.System(
        participants=[system_pb2.Participant(id=name) for name in ("n", "", "n")],
        endpoints=[
            system_pb2.Endpoint(participant="n"),
            system_pb2.Endpoint(id="e", role=UNKNOWN_ROLE, participant="x"),
        ],
        profiles=[system_pb2.Profile()],
        bridges=[system_pb2.Bridge(routes=[system_pb2.Route(source=system_pb2.Endpoint(participant="n"), only=["["])])],
        overlays=[system_pb2.Overlay(role=UNKNOWN_ROLE)],
        checks=[system_pb2.TeamRule(require=[system_pb2.Bound(policy="p", relation="about")])],
        accept=[system_pb2.Acceptance(until="tomorrow")],
        severities={"R1": "loud"},
        notes=[system_pb2.ImportNote()],
    )
    found = {problem.field: problem.description for problem in system_problems(message)}
    assert set(found) == {
        "system.participants[1].id",
        "system.participants[2].id",
        "system.endpoints[0].id",
        "system.endpoints[0].role",
        "system.endpoints[1].role",
        "system.endpoints[1].participant",
        "system.profiles[0].name",
        "system.bridges[0].id",
        "system.bridges[0].routes[0].source.role",
        "system.bridges[0].routes[0].target.role",
        "system.bridges[0].routes[0].target.participant",
        "system.bridges[0].routes[0].only[0]",
        "system.overlays[0].role",
        "system.checks[0].require[0].relation",
        "system.checks[0].require[0].values",
        "system.accept[0].because",
        "system.accept[0].until",
        "system.severities[R1]",
        "system.notes[0].severity",
    }
    assert found["system.endpoints[1].role"] == "7 is no role: 1 is ROLE_PUBLISHER, 2 is ROLE_SUBSCRIBER"


def test_a_finding_alone_travels_too():
    finding = f.Finding("ROS101", "weaker", f.Severity.ERROR, "m")
    assert from_message(to_message(finding, report_pb2.Finding)) == finding
    assert list(itertools.islice(from_message(report_pb2.Report(verdict=report_pb2.VERDICT_COMPATIBLE)).pairs, 1)) == []


def test_guarantees_that_are_alike_are_written_once_and_say_the_same():
    pairs = [({"depth": str(depth), "deadline": "100ms"}, {"deadline": f"{depth}s"}) for depth in (1, 7, 7, 50)]
    for offered, requested in pairs:
        report = cqos.check_pair("ros2", offered=offered, requested=requested)
        plain = messages._make_writer(report_pb2.PairReport, lambda each: each)  # remembers none
        for _ in range(2):
            assert asked.write_pair(report_pb2.PairReport(), report) == plain(report)
    assert 0 < len(asked._PARTS) < 24 * len(pairs)
