"""What two systems say differently: only what both know, and nothing twice."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.packs import Policy, Text
from tests.made_up_protocol import POST, box, participant, profile, reader, world, writer

SEEN = {"observed": True}


def diff(a, b, **more):
    return cqos.diff(a, b, **{"packs": [POST], **more})


def values(found):
    return [(each.a.id, each.b.id, each.policy, each.value_a.value, each.value_b.value) for each in found.different]


def missing(found):
    return [(str(each.only_in), each.endpoint.id) for each in found.missing]


def test_policies_with_both_values_origins_and_types():
    a = world(writer("t", "w/t", "good", delay="1s", more={"type": "Letter"}), profile("good", care="signed"))
    b = world(writer("t", "w/t", delay="2s", care="insured", more={"type": "Card"}))
    a.endpoints[0].settings["stamp"] = b.endpoints[0].settings["stamp"] = a.endpoints[0].settings["delay"]
    found = diff(a, b)
    assert values(found) == [
        ("w/t", "w/t", "care", "signed", "insured"),
        ("w/t", "w/t", "delay", "1s", "2s"),
    ]
    assert [(each.value_a.origin, each.value_b.origin) for each in found.different] == [
        ("profile good", "explicit"),
        ("explicit", "explicit"),
    ]
    assert (found.matched, found.by_topic, bool(found)) == (1, 0, True)


def test_a_default_is_a_value_of_a_design_but_not_of_what_was_observed():
    bare = world(writer("t", "w/t"))
    assert values(diff(world(writer("t", "w/t", copies=5)), bare)) == [("w/t", "w/t", "copies", "5", "20")]
    seen = world(writer("t", "w/t", care="plain", more=SEEN))
    assert not diff(world(writer("t", "w/t", copies=5)), seen)
    assert values(diff(world(writer("t", "w/t", care="signed")), seen)) == [("w/t", "w/t", "care", "signed", "plain")]


def test_values_that_may_be_equal_are_no_difference():
    usual = world(writer("t", "w/t", care="usual"))  # plain, signed or insured, by carrier
    assert not diff(usual, world(writer("t", "w/t", care="signed")))
    by_bike = world(writer("t", "w/t", care="usual"), options={"carrier": "bike"})
    assert values(diff(by_bike, world(writer("t", "w/t", care="signed")))) == [
        ("w/t", "w/t", "care", "plain", "signed")
    ]
    assert not diff(world(writer("t", "w/t", care="unknown")), world(writer("t", "w/t", care="signed")))
    assert not diff(world(writer("t", "w/t", care="oops")), world(writer("t", "w/t", care="signed")))


def test_values_from_peers_are_settled_first():
    a = world(writer("t", "w/t", care="plain"), reader("t", "r/t", care="best"))
    b = world(writer("t", "w/t", care="plain"), reader("t", "r/t", care="signed"))
    # plain if the writer was there first, else insured
    assert values(diff(a, b))[0][2] == "care"
    after = world(writer("t", "w/t", care="plain"), reader("t", "r/t", care="best", more={"starts_after": ("w",)}))
    assert not diff(after, world(writer("t", "w/t", care="plain"), reader("t", "r/t")))


def test_endpoints_of_one_side():
    a = world(writer("t", "w/t"), reader("t", "r/t"), writer("only_a", "w/a"))
    b = world(writer("t", "w/t"), writer("t", "x/t"), reader("t", "r/t"), reader("only_b", "r/b"))
    found = diff(a, b)
    assert missing(found) == [("a", "w/a"), ("b", "r/b"), ("b", "x/t")]
    assert (found.matched, values(found), found.not_compared) == (2, [], ())


def test_other_names_of_participants_are_matched_by_topic():
    a = world(writer("t", "old/t", care="signed"), writer("t", "kept/t"))
    b = world(writer("t", "new/t", care="insured"), writer("t", "kept/t"))
    found = diff(a, b)
    assert values(found) == [("old/t", "new/t", "care", "signed", "insured")]
    assert (found.matched, found.by_topic, missing(found)) == (2, 1, [])


def test_several_endpoints_are_matched_by_how_little_they_differ():
    a = world(*(writer("t", f"w/{n}", copies=n) for n in (1, 2, 3)))
    b = world(*(writer("t", f"w/x{n}", copies=n) for n in (3, 2, 4)))
    assert values(diff(a, b)) == [("w/1", "w/x4", "copies", "1", "4")]


def test_ids_of_designs_are_kept_together():
    a = world(writer("t", "w/main", copies=1), writer("t", "w/spare", copies=2))
    b = world(writer("t", "w/main", copies=2), writer("t", "w/spare", copies=1))
    assert [each[:2] for each in values(diff(a, b))] == [("w/main", "w/main"), ("w/spare", "w/spare")]


def test_what_was_not_looked_at_is_not_missing():
    design = world(writer("t", "w/t"), reader("t", "r/t"), writer("u", "w/u"))
    seen = world(writer("t", "w/t", more=SEEN), writer("more", "x/more", more=SEEN))
    found = diff(design, seen)
    assert missing(found) == [("b", "x/more")]
    assert found.not_compared == (
        "1 endpoint of A: B was observed and does not mention their topics",
        "1 endpoint of A: B was observed and reports no subscribers at all",
    )
    both = world(writer("t", "w/t", more=SEEN), reader("t", "someone/t", more=SEEN))
    assert missing(diff(world(writer("t", "w/t"), reader("t", "r/t"), reader("t", "s/t")), both)) == [("a", "s/t")]


def test_others_may_be_on_an_external_topic():
    seen = world(writer("t", "w/t", more=SEEN), reader("archive", "log", more=SEEN), reader("/u", "r/u", more=SEEN))
    found = diff(world(writer("t", "w/t"), box("u", external=True)), seen)
    assert (missing(found), len(found.not_compared)) == ([], 1)
    assert missing(diff(world(writer("t", "w/t")), world(writer("t", "w/t"), reader("u", "r/u"), box("u", True))))


def test_types_stated_of_the_topic():
    pack = replace(
        POST,
        policies=(*POST.policies, cqos_type("endpoint"), cqos_type("topic")),
    )
    a = world(writer("t", "w/t"), box("t", type="Letter"))
    found = diff(a, world(writer("t", "w/t", more={"type": "Card"})), packs=[pack])
    assert values(found) == [("w/t", "w/t", "type", "Letter", "Card")]
    assert not diff(a, world(writer("t", "w/t", more={"type": "Letter"})), packs=[pack])
    assert not diff(a, world(writer("t", "w/t")), packs=[pack])


def cqos_type(level):
    return Policy("type", Text(), None, "What is sent.", level=level)


def test_topics_can_be_chosen():
    a = world(writer("/a/t", "w/1", copies=1), writer("/b/t", "w/2", copies=1))
    b = world(writer("/a/t", "w/1", copies=2), writer("/b/t", "w/2", copies=2))
    assert len(values(diff(a, b))) == 2
    assert [each[0] for each in values(diff(a, b, topics=["/a/*"]))] == ["w/1"]
    assert [each[0] for each in values(diff(a, b, topics=["b/*"]))] == ["w/2"]
    assert [each[0] for each in values(diff(a, b, ignored=["/a/*"]))] == ["w/2"]


def test_a_protocol_without_a_pack_is_not_compared():
    a = world(writer("t", "w/t", copies=1), protocol="nobody's")
    assert missing(diff(a, world(writer("t", "w/t", copies=2)))) == [("b", "w/t")]
    assert diff(a, a).matched == 0


@pytest.mark.parametrize("size", [10, 500])
def test_many_endpoints(size):
    a = world(*(writer("t", f"w{n}/t", copies=n % 50 + 1) for n in range(size)))
    b = world(*(writer("t", f"v{n}/t", copies=n % 50 + 1) for n in range(size)))
    found = diff(a, b)
    assert (found.matched, found.by_topic, found.missing) == (size, size, ())


CARES = st.sampled_from(["plain", "signed", "insured", "usual", "best", "unknown"])


@st.composite
def posts(draw):
    parts = [
        draw(st.sampled_from([writer, reader]))(
            draw(st.sampled_from(["t", "u"])),
            f"{draw(st.sampled_from('ab'))}/{number}",
            care=draw(CARES),
            copies=draw(st.integers(1, 3)),
            more={"observed": draw(st.booleans())},
        )
        for number in range(draw(st.integers(0, 6)))
    ]
    return world(*parts, participant("a", carrier=draw(st.sampled_from(["bike", "train"]))))


@given(posts())
def test_a_system_does_not_differ_from_itself(system):
    found = diff(system, system)
    assert not found
    assert (found.matched, found.by_topic) == (len(system.endpoints), 0)


@given(posts(), posts())
def test_the_order_of_the_two_does_not_matter(a, b):
    there, back = diff(a, b), diff(b, a)
    assert bool(there) == bool(back)
    assert (there.matched, there.by_topic) == (back.matched, back.by_topic)
    assert sorted(each.endpoint.id for each in there.missing) == sorted(each.endpoint.id for each in back.missing)


def test_the_library_reads_both():
    text = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: {depth: %d}}}}\n"
    found = cqos.diff((text % 1).encode(), (text % 2).encode())
    assert isinstance(found, cqos.Diff)
    (one,) = found.different
    assert (one.policy, one.value_a.value, one.value_b.value, one.a.participant) == ("depth", "1", "2", "/a")
    assert one.value_a.place.line == 3
    assert not cqos.diff((text % 1).encode(), (text % 2).encode(), ignored=["/t"])
    assert not cqos.diff((text % 0).encode(), (text % 1).encode(), options={"ros2": {"rmw": "cyclonedds"}})
    # Compared is what values mean, however they are judged.
    judged = cqos.read((text % 1).encode() + b"options: {ros2: {comparison: rmw}}\n")
    judged.endpoints[0].settings["deadline"] = replace(judged.endpoints[0].settings["depth"], text="0s")
    assert not cqos.diff(judged, (text % 1).encode())


def test_participants_are_known_by_their_full_names():
    a = cqos.read(b"cqos: 1\nprotocol: ros2\nparticipants: {a: {namespace: /x, publishes: {t: {}}}}\n")
    b = cqos.read(b"cqos: 1\nprotocol: ros2\nparticipants: {/x/a: {publishes: {/x/t: {}}}}\n")
    found = cqos.diff(a, b)
    assert (bool(found), found.matched, found.by_topic) == (False, 1, 0)
