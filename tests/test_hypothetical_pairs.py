"""C-QoS tries unused profiles: each as a publisher and a subscriber that match."""

import pytest

from cqos_core import ProfileRef, Scope, Session, check
from cqos_core.files.system_merge import merge
from tests.made_up_protocol import POST, reader, world, writer
from tests.test_profile_scopes import profile, ref

ALIKE = profile("alike", care="signed")
APART = (
    profile("apart", ref("apart/w", "publisher", part="x"), ref("apart/r", "subscriber", part="x")),
    profile("apart/w", care="plain"),
    profile("apart/r", care="insured", sealed=True),
)


def report(*profiles):
    return check(world(*profiles), packs=[POST])


def ends(report):
    """The endpoints that are told of a delay that none can have, with their topics."""
    return sorted((name, each.topic) for each in report.findings if each.code == "POST302" for name in each.endpoints)


def test_both_ends_of_a_profile_match_on_a_topic_of_their_own_and_set_no_verdict():
    found = report(ALIKE, *APART)
    assert (str(found.verdict), found.groups, found.hypothetical) == ("unknown", (), 2)
    apart = [each for each in found.findings if each.verdict is not None]
    assert {(each.topic, str(each.verdict), str(each.severity)) for each in apart} == {
        ("apart", "incompatible", "warning")
    }
    assert not found.fails()
    (note,) = [each for each in found.findings if each.code == "CQ061"]
    assert note.message.startswith("there are no endpoints here but 2 profiles, each tried")
    assert note.severity == "note"


def test_a_profile_for_one_role_is_tried_in_that_role_without_a_partner():
    only = (profile("only", ref("only/w", "publisher", part="x")), profile("only/w", care="insured"))
    found = report(*only)
    assert [each.code for each in found.findings if each.severity != "note"] == ["POST301"]
    assert found.endpoints == 1


def test_profiles_of_nearly_one_name_for_two_roles_are_no_near_miss():
    writers = profile("camera", ref("camera/w", "publisher", part="x")), profile("camera/w", care="insured")
    readers = profile("cammera", ref("cammera/r", "subscriber", part="x")), profile("cammera/r", care="insured")
    assert not {each.code for each in report(*writers, *readers).findings} & {"CQ401", "CQ402", "CQ403"}


def test_topics_that_a_profile_tells_apart_are_tried_each():
    found = report(
        profile("p", ref("p/1", "publisher", "a*", part="x"), ref("p/2", "publisher", "b?", part="x")),
        profile("p/1", care="signed", delay="1ms"),
        profile("p/2", care="plain", delay="2ms"),
    )
    assert ends(found) == [("p/publisher on a*", "ap"), ("p/publisher on b?", "bx")]


def test_a_circle_of_profiles_without_settings_is_reported():
    found = report(profile("a", ref("b")), profile("b", ref("c")), profile("c", ref("a")), profile("d", ref("a")))
    (finding,) = [each for each in found.findings if each.severity == "error"]
    assert (finding.code, finding.message.partition(": ")[2]) == ("CQ212", "a → b → c → a")


def test_what_is_reached_twice_is_no_circle():
    empty = report(profile("a", ref("b"), ref("c")), profile("b", ref("d")), profile("c", ref("d")), profile("d"))
    assert (empty.hypothetical, empty.endpoints) == (0, 0)
    assert "CQ212" not in [each.code for each in empty.findings]


def test_a_missing_base_is_reported():
    found = report(profile("lost", ProfileRef("nowhere")))
    assert "CQ204" in [each.code for each in found.findings]


@pytest.mark.parametrize(
    ("parts", "pairs"),
    [
        ((writer("t", "w"), ALIKE), 1),
        ((reader("t", "r"), *APART), 1),
        ((), 0),
        ((profile("empty"),), 0),
        ((profile("p", ProfileRef("q", None, Scope(part="x"))),), 1),
    ],
)
def test_only_profiles_with_settings_or_bases_are_tried(parts, pairs):
    assert report(*parts).hypothetical == pairs


def test_without_a_protocol_no_profile_is_tried():
    system = world(ALIKE)
    system.protocol = None
    assert check(system, packs=[POST]).hypothetical == 0
    assert check(system, protocol="post", packs=[POST]).hypothetical == 1
    assert system.endpoints == []


def test_a_session_says_the_same():
    system = world(ALIKE, *APART)
    session = Session(system, packs=[POST])
    assert session.report() == check(system, packs=[POST])
    session.put_participant(world(writer("t", "w")).participants["w"])
    session.put(writer("t", "w"))
    assert session.report().groups == ()


WHOLE = (writer("t", "w"), reader("t", "r"))
LOST = (profile("lost", ProfileRef("nowhere"), care="plain"),)
CIRCLE = (profile("a", ref("b"), care="plain"), profile("b", ref("a")))


def errors(report):
    """What keeps ends from being created or from matching; hypothetical pairs that do not fit are warnings."""
    return {
        (each.code, str(each.severity), each.message)
        for each in report.findings
        if each.severity == "error" or each.verdict == "incompatible"
    }


@pytest.mark.parametrize("library", [APART, LOST, CIRCLE, (*APART, *LOST, *CIRCLE)])
def test_a_broken_library_has_the_same_errors_beside_a_system(library):
    alone, beside = report(*library), check(world(*WHOLE, *library), packs=[POST])
    assert errors(alone)
    assert errors(beside) == errors(alone)
    assert (str(beside.verdict), beside.hypothetical) == ("compatible", alone.hypothetical)
    assert beside.pair_count == 1


def test_a_library_keeps_its_protocol_beside_a_system_of_another():
    other = world(writer("t", "x"), protocol="other")
    whole = merge([world(*APART), other])
    assert whole.protocol is None
    assert errors(check(whole, packs=[POST])) >= errors(report(*APART))


def test_a_profile_that_endpoints_use_is_not_tried_by_itself():
    used = check(world(writer("t", "w", "alike"), reader("t", "r", "alike"), ALIKE), packs=[POST])
    assert used.hypothetical == 0
    base, better = profile("base", care="plain"), profile("better", ref("base"), sealed=True)
    assert (
        check(world(writer("t", "w", "better"), reader("t", "r", "better"), base, better), packs=[POST]).hypothetical
        == 0
    )


def test_what_a_used_profile_states_for_the_other_role_alone_is_tried():
    parts = (*APART[:2], profile("apart/r", care="insured", sealed=True, delay="1ms"))
    assert ends(report(writer("t", "w", "apart"), *parts)) == [("apart/subscriber", "apart")]


def test_what_a_used_profile_states_for_both_roles_need_not_make_both():
    alike = profile("alike", care="signed", delay="1ms")
    assert ends(report(writer("t", "w", "alike"), alike)) == [("w", "t")]


def test_what_is_not_known_of_an_unused_profile_is_no_finding_beside_a_system():
    assert not errors(check(world(*WHOLE, profile("open", care="unknown")), packs=[POST]))


def test_a_session_tries_a_profile_that_is_no_longer_used():
    session = Session(world(writer("t", "w", "apart"), reader("t", "r", "apart"), *APART), packs=[POST])
    assert session.report().hypothetical == 0
    session.put(writer("t", "w"))
    session.put(reader("t", "r"))
    assert session.report() == check(session.system, packs=[POST])
    assert session.report().hypothetical == 1
    session.put(writer("t", "w", "apart"))
    session.remove("r")
    assert session.report() == check(session.system, packs=[POST])
