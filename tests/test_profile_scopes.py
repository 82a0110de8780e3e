"""Profiles with parts for different endpoints: by role, by topic, and by the part that a reference names."""

from dataclasses import replace

import pytest

from cqos_core import Place, Profile, ProfileRef, Scope, Session
from cqos_core.files.system_merge import merge
from cqos_core.files.yaml_design import design_of
from cqos_core.packs.export import ExportContext
from tests.made_up_protocol import CONTEXT, POST, checked, facts, reader, settings, world, writer

SENDER, BOX = "sender", "box"


def ref(name, role=None, topic="*", but=(), part=None):
    return ProfileRef(name, Place("p.xml", 1), Scope(role, topic, but, part))


def profile(name, *base, **stated):
    return Profile(name, settings(**stated), base)


# A library: a profile with parts for publishers and for subscribers, and another one based on it.
LIBRARY = (
    profile("base", ref("base/w", "publisher", part=SENDER), ref("base/r", "subscriber", part=SENDER)),
    profile("base/w", care="signed", copies=3),
    profile("base/r", care="insured", sealed=True),
    profile(
        "own",
        ref("base"),
        ref("own/w", "publisher", "a*", part=SENDER),
        ref("own/any", "publisher", but=("a*",), part=SENDER),
        ref("own/box", "publisher", part=BOX),
    ),
    profile("own/w", care="insured"),
    profile("own/any", copies=7),
    profile("own/box", streets="[here]"),
)


def values(system, endpoint):
    found = facts(system, of=endpoint)
    return {name: found[name].value for name in ("care", "copies", "sealed", "streets")}


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        (writer("b", "w", "base"), {"care": "signed", "copies": "3", "sealed": "false", "streets": "[]"}),
        (reader("b", "r", "base"), {"care": "insured", "copies": "20", "sealed": "true", "streets": "[]"}),
        (writer("abc", "w", "own"), {"care": "insured", "copies": "3", "sealed": "false", "streets": "[here]"}),
        (writer("b", "w", "own"), {"care": "signed", "copies": "7", "sealed": "false", "streets": "[here]"}),
        (reader("b", "r", "own"), {"care": "insured", "copies": "20", "sealed": "true", "streets": "[]"}),
    ],
)
def test_an_endpoint_takes_what_is_for_its_role_and_topic(end, expected):
    assert values(world(end, *LIBRARY), end.id) == expected


@pytest.mark.parametrize(("part", "streets", "copies"), [(SENDER, "[]", "7"), (BOX, "[here]", "20")])
def test_of_a_part_nothing_else_is_taken_also_from_its_base(part, streets, copies):
    end = replace(writer("b", "w"), profiles=(ref("own", part=part),))
    found = values(world(end, *LIBRARY), "w")
    assert (found["streets"], found["copies"]) == (streets, copies)


def test_equal_endpoints_on_different_topics_take_different_parts():
    system = world(writer("abc", "w1", "own"), writer("b", "w2", "own"), *LIBRARY)
    assert (values(system, "w1")["copies"], values(system, "w2")["copies"]) == ("3", "7")


def test_a_circle_and_an_unknown_base_are_reported_once_with_their_place():
    circle = (profile("x", ref("y")), profile("y", ref("z", "publisher")), profile("z", ref("x")))
    lost = profile("lost", ref("bse"))
    report = checked(world(writer("t", "w", "x"), reader("t", "r", "x"), *circle))
    (finding,) = [each for each in report.findings if each.code == "CQ212"]
    assert finding.message == "profiles are based on each other in a circle: x → y → z → x"
    report = checked(world(writer("t", "w", "lost"), reader("t", "r", "lost"), lost, *LIBRARY))
    (finding,) = [each for each in report.findings if each.code == "CQ204"]
    assert str(finding.help).startswith("did you mean `base`? known: ")
    assert "base/w" not in str(finding.help)
    assert str(finding.place) == "p.xml:1"


def test_a_session_keeps_to_it():
    system = world(writer("abc", "w", "own"), reader("abc", "r", "base"), *LIBRARY)
    session = Session(system, packs=[POST])
    assert session.report() == checked(system)
    session.put(writer("b", "w", "own"))
    session.put(reader("b", "r", "base"))
    again = world(writer("b", "w", "own"), reader("b", "r", "base"), *LIBRARY)
    assert session.report().groups == checked(again).groups


def test_a_design_has_a_profile_for_each_way_in_which_it_reads():
    ends = (writer("abc", "w1", "own"), writer("b", "w2", "own"), reader("b", "r", "own"), reader("abc", "r2", "base"))
    system = world(*ends, *LIBRARY)
    design = design_of(system, ExportContext(CONTEXT.find_pack)).system
    assert all(each.scope == Scope() for one in design.profiles.values() for each in one.base)
    for end in ends:
        assert values(design, end.id) == values(system, end.id)
    unused = design_of(world(*LIBRARY), ExportContext(CONTEXT.find_pack)).system
    assert {"base-publisher", "base-subscriber", "own-publisher", "own-subscriber"} <= set(unused.profiles)


def test_two_files_that_scope_a_base_differently_state_it_differently():
    one, other = (world(profile("p", ref("q", role))) for role in ("publisher", "subscriber"))
    merged = merge([one, other])
    assert len(merged.profiles) == 2
    assert not merge([world(*LIBRARY), world(*LIBRARY)]).notes
