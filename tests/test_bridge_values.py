"""Bridges in the small world: endpoints of routes, needs handed on, what a path gives, loops."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import pytest

from cqos_core import Bridge, Endpoint, InputError, Participant, Route, Session, explain
from cqos_core import check as check_file
from cqos_core.packs import NEEDS, RELAYED, WORDS, FromPeers, as_condition, gives, offered, requested
from tests.made_up_protocol import (
    CARE,
    COPIES,
    DELAY,
    POST,
    checked,
    codes,
    only,
    place,
    reader,
    settings,
    world,
    writer,
)

LATE_JOIN = requested(WORDS["late_join"].need)
GUARANTEES = (
    gives("latest", offered(CARE) >= "signed", code="POST511", name="mislaid", because="plain letters get lost"),
    gives(
        "latest",
        offered(CARE) >= "insured",
        survives="intermediary_restart",
        code="POST512",
        name="burnt",
        because="only insured letters are kept when the post office burns down",
    ),
    gives("late_join", offered(COPIES) >= LATE_JOIN, code="POST513", name="thin", because="the box holds no more"),
    gives("max_age", offered(DELAY), code="POST514", name="stale", because="letters lie about"),
    gives("liveness", offered(DELAY), code="POST515", name="unnoticed", because="nobody looks"),
    gives(
        "liveness",
        ~as_condition(offered(RELAYED)),
        code="POST516",
        name="relayed-life",
        because="a forwarder lives on",
    ),
)
GIVING = replace(POST, policies=(*POST.policies, *NEEDS), rules=(*POST.rules, *GUARANTEES))
ABROAD = replace(GIVING, id="mail", title="Mail")
PACKS = [GIVING, ABROAD]


def needing(topic, name="reader", more=None, **needs):
    return reader(topic, name, more={"needs": settings(**needs), **(more or {})})


def end(role, participant, topic, **stated):
    return Endpoint(id="", role=role, topic=topic, participant=participant, settings=settings(**stated), place=place(1))


def bridge(name, source, target, carries=(), receive=None, send=None):
    """A bridge of one route between ``(participant, topic)`` and the same."""
    route = Route(
        end("subscriber", *source, **(receive or {})), end("publisher", *target, **(send or {})), place=place(2)
    )
    return Bridge(name, (route,), carries, place(2))


def bridged(*parts, bridges, abroad=("out",), **fields):
    system = world(*parts, **fields)
    for each in bridges:
        system.bridges[each.id] = each
        for route in each.routes:
            for participant in (route.source.participant, route.target.participant):
                protocol = "mail" if participant in abroad else None
                system.participants.setdefault(participant, Participant(participant, protocol))
    for each in system.endpoints:
        if each.participant in abroad:
            system.participants[each.participant].protocol = "mail"
    return system


def across(*needs_and_ends, **more):
    """A writer here, a bridge, a reader abroad."""
    offer, send, needs = needs_and_ends
    return bridged(
        writer("box", "here/w", **offer),
        needing("far", "out2/r", **needs),
        bridges=[bridge("b", ("in", "box"), ("out", "far"), send=send, **more)],
        abroad=("out", "out2"),
    )


def bridge_findings(report):
    return [(each.code, each.endpoints) for each in report.findings if each.code.startswith(("POST51", "CQ5"))]


FIRST_HOP = ("b/subscriber/box", "here/w")
LAST_HOP = ("out2/r", "b/publisher/far")


def test_both_sides_of_a_bridge_are_judged_by_their_own_protocols():
    report = check(across({}, {}, {}))
    assert [(g.protocol, g.topic, g.publishers, g.subscribers) for g in report.groups] == [
        ("post", "box", ("here/w",), ("b/subscriber/box",)),
        ("mail", "far", ("b/publisher/far",), ("out2/r",)),
    ]
    assert report.verdict == "compatible"


def check(system):
    return checked(system, packs=PACKS)


@pytest.mark.parametrize(
    ("offer", "send", "found"),
    [
        ({"care": "signed"}, {"care": "signed"}, []),
        ({"care": "plain"}, {"care": "signed"}, [("POST511", FIRST_HOP)]),
        ({"care": "signed"}, {"care": "plain"}, [("POST511", LAST_HOP)]),
        ({"care": "plain"}, {"care": "plain"}, [("POST511", FIRST_HOP), ("POST511", LAST_HOP)]),
    ],
)
def test_the_hop_that_breaks_a_requirement_is_reported(offer, send, found):
    report = check(across(offer, send, {"latest": True}))
    assert sorted(bridge_findings(report)) == sorted(found)
    assert report.verdict == ("incompatible" if found else "compatible")


def test_a_need_that_was_handed_on_says_whose_it_is_and_where_it_stands():
    system = across({"care": "plain"}, {"care": "signed"}, {"latest": True})
    finding = only(check(system), "POST511")
    fact = next(each for side in finding.sides for each in side.facts if each.policy == "need.latest")
    assert fact.origin == "needed by out2/r behind bridge b"
    assert [remedy.text for remedy in finding.remedies] == ["offer care `signed` on here/w"]


def test_a_guarantee_of_one_side_is_fixed_on_that_side():
    finding = only(check(across({"care": "signed"}, {"care": "plain"}, {"latest": True})), "POST511")
    assert {remedy.role for remedy in finding.remedies} == {"publisher"}


@pytest.mark.parametrize(("first", "found"), [("30s", []), ("31s", [("POST514", FIRST_HOP)])])
def test_ages_add_up_over_the_hops(first, found):
    assert bridge_findings(check(across({"delay": first}, {"delay": "70s"}, {"max_age": "100s"}))) == found


def test_where_the_last_hop_spends_all_of_it_the_hop_before_is_not_blamed():
    assert bridge_findings(check(across({"delay": "1h"}, {"delay": "101s"}, {"max_age": "100s"}))) == [
        ("POST514", LAST_HOP)
    ]


def test_what_is_stored_for_late_subscribers_has_to_get_there_first():
    fine = across({"care": "signed"}, {"care": "signed", "copies": "5"}, {"late_join": 5})
    assert bridge_findings(check(fine)) == []
    assert bridge_findings(check(across({"care": "plain"}, {"care": "signed", "copies": "5"}, {"late_join": 5}))) == [
        ("POST511", FIRST_HOP)
    ]
    assert bridge_findings(check(across({"care": "signed"}, {"care": "signed", "copies": "4"}, {"late_join": 5}))) == [
        ("POST513", LAST_HOP)
    ]


def test_liveness_does_not_cross_a_bridge_unless_it_carries_it():
    needs, delay = {"liveness": "100s"}, {"delay": "40s"}
    assert bridge_findings(check(across(delay, delay, needs))) == [("POST516", LAST_HOP)]
    assert bridge_findings(check(across(delay, delay, needs, carries=("liveliness",)))) == []
    slow = check(across({"delay": "61s"}, delay, needs, carries=("liveliness",)))
    assert bridge_findings(slow) == [("POST515", FIRST_HOP)]


def test_a_bridge_that_restarts_is_a_restart_of_the_subscriber_before_it():
    needs = {"latest": True, "survives": ["intermediary_restart"]}
    lost = bridge_findings(check(across({"care": "signed"}, {"care": "insured"}, needs)))
    assert lost == [("POST512", FIRST_HOP)]
    assert bridge_findings(check(across({"care": "insured"}, {"care": "insured"}, needs))) == []


def test_needs_are_handed_on_along_a_chain():
    system = bridged(
        writer("a", "w", care="plain"),
        needing("c", "r", latest=True),
        bridges=[
            bridge("one", ("i1", "a"), ("o1", "b"), send={"care": "signed"}),
            bridge("two", ("i2", "b"), ("o2", "c"), send={"care": "signed"}),
        ],
    )
    report = check(system)
    assert bridge_findings(report) == [("POST511", ("one/subscriber/a", "w"))]
    way = explain(system, publisher="w", subscriber="r", packs=PACKS)
    assert [(hop.topic, hop.verdict, hop.bridge) for hop in way.hops] == [
        ("a", "incompatible", "one"),
        ("b", "compatible", "two"),
        ("c", "compatible", None),
    ]
    latest = next(each for each in way.guarantees if each.word == "latest")
    assert (latest.value, latest.lost) == ("no", (("POST511", "plain letters get lost"),))
    assert way.verdict == "incompatible"


def test_a_pattern_carries_every_topic_that_matches_with_its_rest():
    system = bridged(
        writer("home/a", "w1"),
        writer("home/b/c", "w2"),
        writer("house", "w3"),
        reader("far/b/c", "r"),
        bridges=[bridge("b", ("in", "home/*"), ("here", "far/*"))],
    )
    found = {(g.topic, g.publishers, g.subscribers) for g in check(system).groups}
    assert ("far/b/c", ("b/publisher/far/b/c",), ("r",)) in found
    assert ("home/a", ("w1",), ("b/subscriber/home/a",)) in found
    assert not [topic for topic, _, _ in found if topic == "house"]


def test_a_target_without_a_topic_has_that_of_the_source():
    system = bridged(writer("a", "w"), reader("a", "out/r"), bridges=[bridge("b", ("in", "a"), ("out", None))])
    assert [group.topic for group in check(system).groups] == ["a", "a"]


def test_a_pattern_that_matches_nothing_is_reported():
    finding = only(
        check(bridged(writer("a"), reader("a"), bridges=[bridge("b", ("in", "x*"), ("out", "y*"))])), "CQ502"
    )
    assert finding.message == "bridge `b` carries nothing by route 1: no topic matches `x*`"
    assert finding.place == place(2)


def test_a_missing_participant_of_a_bridge_is_reported_with_the_nearest_one():
    system = bridged(writer("a"), reader("a"), bridges=[bridge("b", ("gate", "a"), ("out", "y"))])
    del system.participants["gate"]
    system.participants["gaet"] = Participant("gaet")
    finding = only(check(system), "CQ501")
    assert finding.message == "bridge `b` has a side in participant `gate`, which the system does not have"
    assert finding.help.startswith("did you mean `gaet`?")


def test_a_loop_over_two_bridges_is_printed_as_a_path_and_once():
    there, back = bridge("there", ("i", "a"), ("o", "b")), bridge("back", ("o", "b"), ("i", "a"))
    system = bridged(writer("a", "w"), reader("b", "r"), bridges=[there, back], abroad=())
    finding = only(check(system), "CQ503")
    assert finding.message == ("what is published on `a` comes back over bridges: `a` → there → `b` → back → `a`")


def test_one_bridge_in_both_directions_is_no_loop():
    both = bridge("both", ("i", "a"), ("o", "b"))
    back = bridge("both", ("o", "b"), ("i", "a"))
    system = bridged(
        writer("a", "w"), reader("b", "r"), bridges=[replace(both, routes=(*both.routes, *back.routes))], abroad=()
    )
    assert "CQ503" not in codes(check(system))


def test_weaker_guarantees_behind_a_bridge_are_a_note_if_not_required():
    system = across({"care": "signed"}, {"care": "plain"}, {})
    finding = only(check(system), "CQ504")
    assert finding.severity == "note"
    assert finding.message == "bridge `b` carries `box` on as `far` with less: latest is lost behind it"
    assert "CQ504" not in codes(check(across({"care": "signed"}, {"care": "plain"}, {"latest": True})))
    assert "CQ504" not in codes(check(across({"care": "plain"}, {"care": "plain"}, {})))


@pytest.mark.parametrize(("copies", "reported"), [("1", True), ("2", False)])
def test_several_topics_into_one_that_stores_less_are_reported(copies, reported):
    system = bridged(
        writer("home/a", "w1"),
        writer("home/b", "w2"),
        reader("all", "r"),
        bridges=[bridge("b", ("in", "home/*"), ("here", "all"), send={"copies": copies})],
    )
    report = check(system)
    assert ("CQ505" in codes(report)) is reported
    if reported:
        message = "bridge `b` carries 2 topics into `all`, and a late subscriber gets 1 sample in all"
        assert only(report, "CQ505").message == message


def test_a_session_with_a_bridge_reports_as_a_fresh_check_does():
    system = across({"care": "plain"}, {"care": "signed"}, {"latest": True})
    session = Session(system, packs=[GIVING, ABROAD])
    assert session.report() == check(system)
    session.put(writer("box", "here/w", care="signed"))
    assert session.report().verdict == "compatible"
    assert bridge_findings(session.report()) == []


# Routes with patterns


def carried(system, name="b"):
    """The topics that a bridge subscribes to."""
    mine = [end for group in check(system).groups for end in group.subscribers if end.startswith(f"{name}/")]
    return {end.removeprefix(f"{name}/subscriber/") for end in mine}


def named(only=(), but=()):
    patterned = bridge("b", ("in", "home/*"), ("out", "far/*"))
    return replace(patterned, routes=(replace(patterned.routes[0], only=only, but=but),))


@pytest.mark.parametrize(
    ("only", "but", "expected"),
    [
        ((), (), {"home/a", "home/ab", "home/b/c"}),
        (("home/a",), (), {"home/a"}),
        (("home/a", ".*/c"), (), {"home/a", "home/b/c"}),
        ((), ("home/a.*",), {"home/b/c"}),
        (("home/a.*",), (".*b",), {"home/a"}),
        (("a",), (), set()),
    ],
)
def test_a_pattern_is_narrowed_by_expressions_for_whole_names(only, but, expected):
    topics = ("home/a", "home/ab", "home/b/c")
    system = bridged(*(writer(topic, topic) for topic in topics), bridges=[named(only, but)])
    assert carried(system) == expected
    left = [f"`{name}`" for name in topics if name not in expected]
    said = [finding.message for finding in check(system).findings if finding.code == "CQ506"]
    assert said == ([f"bridge `b` leaves out topic{'s' if len(left) > 1 else ''} {', '.join(left)}"] if left else [])


def test_what_another_route_carries_is_not_left_out():
    narrowed = named(but=("home/a", "home/b"))
    one_more = replace(
        narrowed.routes[0], source=end("subscriber", "in", "home/a"), target=end("publisher", "out", "far/a"), but=()
    )
    elsewhere = bridge("c", ("in", "home/b"), ("in", "home/c"))
    system = bridged(
        writer("home/a"),
        writer("home/b"),
        bridges=[replace(narrowed, routes=(narrowed.routes[0], one_more)), elsewhere],
    )
    said = [finding.message for finding in check(system).findings if finding.code == "CQ506"]
    assert said == ["bridge `b` leaves out topic `home/b`"]


def test_only_what_a_side_can_meet_is_carried():
    here, elsewhere = writer("home/a", "w1"), writer("home/b", "w2")
    system = bridged(here, elsewhere, bridges=[named()])
    system.participants["w2"].settings = settings(town=7)
    assert carried(system) == {"home/a"}
    system.participants["in"].settings = settings(town=7)
    assert carried(system) == {"home/b"}


def test_topics_of_a_pattern_need_no_subscriber():
    same_name = bridge("b", ("in", "home/*"), ("out", "home/*"))
    system = bridged(writer("home/a", "w1"), writer("home/b", "w2"), reader("home/b", "out/r"), bridges=[same_name])
    system.participants["out"].settings = settings(town=7)
    report = check(system)
    assert [finding.severity for finding in report.findings if "home/a" in finding.message] == []
    assert ("home/b", ("b/publisher/home/b",), ("out/r",)) in {
        (g.topic, g.publishers, g.subscribers) for g in report.groups
    }


def incoming(external=True):
    """A bridge that brings samples of publishers that are in no file."""
    patterned = bridge("b", ("out", "far/*"), ("in", "home/*"))
    (route,) = patterned.routes
    return replace(patterned, routes=(replace(route, source=replace(route.source, external=external)),))


def test_a_bridge_with_an_unknown_side_may_bring_any_topic_of_its_pattern():
    alone = bridged(reader("home/a", "r"), bridges=[incoming()])
    assert [(group.publishers, group.subscribers) for group in check(alone).groups] == [
        (("b/publisher/home/a",), ("r",))
    ]
    assert "CQ401" not in codes(check(alone))
    assert "CQ401" in codes(check(bridged(reader("home/a", "r"), bridges=[incoming(external=False)])))


@pytest.mark.parametrize("there", [writer("far/b", "out/w"), bridge("other", ("here", "x*"), ("out", "far/x*"))])
def test_a_bridge_with_a_known_side_brings_only_the_topics_of_that_side(there):
    parts, bridges = ([], [incoming(), there]) if isinstance(there, Bridge) else ([there], [incoming()])
    report = check(bridged(reader("home/a", "r"), *parts, bridges=bridges))
    assert only(report, "CQ401").endpoints == ("r",)


def test_what_is_published_here_is_not_waited_for_from_there():
    report = check(bridged(writer("home/a", "w"), reader("home/a", "r"), bridges=[incoming()]))
    assert [group.publishers for group in report.groups] == [("w",)]


# Values that are copied

_COPYING = {
    "sent": FromPeers("insured", "any", waits=True, side="publishers"),
    "wanted": FromPeers("insured", "any", waits=True, side="subscribers"),
    "first": FromPeers("insured", "any", waits=True, side="first"),
}
COPYING = replace(
    GIVING, policies=tuple(replace(p, words={**p.words, **_COPYING}) if p is CARE else p for p in GIVING.policies)
)
COPYING_ABROAD = replace(COPYING, id="mail", title="Mail")
COPIED = [COPYING, COPYING_ABROAD]


def chain(offered_care, requested_care, word, *, start=None, middle=None):
    """A writer, two bridges that copy, a reader."""
    first = bridge("one", ("i1", "a"), ("o1", "b"), receive={"care": word}, send={"care": middle or word})
    second = bridge("two", ("i2", "b"), ("o2", "c"), receive={"care": word}, send={"care": word})
    system = bridged(
        writer("a", "w", care=offered_care), reader("c", "r", care=requested_care), bridges=[first, second]
    )
    for late, early in (start or {}).items():
        system.participants[late].starts_after = (early,)
    return system


def verdicts(system):
    return [group.verdict for group in sorted(checked(system, packs=COPIED).groups, key=lambda each: each.topic)]


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        # offered plain, signed wanted: the hop where the two meet is the one that does not fit
        ("sent", ["compatible", "compatible", "incompatible"]),
        ("wanted", ["incompatible", "compatible", "compatible"]),
        ("first", ["unknown", "compatible", "unknown"]),
    ],
)
def test_values_are_copied_over_several_bridges(word, expected):
    assert verdicts(chain("plain", "signed", word)) == expected
    assert verdicts(chain("signed", "signed", word)) == ["compatible"] * 3


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        ({"r": "w"}, ["compatible", "compatible", "incompatible"]),
        ({"w": "r"}, ["incompatible", "compatible", "compatible"]),
        ({"r": "i1"}, ["unknown", "compatible", "unknown"]),
    ],
)
def test_who_is_copied_first_follows_from_who_starts_first(start, expected):
    assert verdicts(chain("plain", "signed", "first", start=start)) == expected


def test_an_end_that_has_its_own_value_is_what_others_copy():
    assert verdicts(chain("plain", "signed", "sent", middle="signed")) == ["compatible"] * 3
    assert verdicts(chain("signed", "signed", "sent", middle="plain")) == ["compatible", "compatible", "incompatible"]


def test_with_no_endpoint_on_one_side_the_other_is_copied():
    system = chain("plain", "signed", "first")
    system.endpoints = [each for each in system.endpoints if each.id == "w"]
    assert verdicts(system)[0] == "compatible"


def test_of_several_that_differ_any_may_be_copied():
    system = chain("signed", "signed", "sent")
    assert verdicts(system) == ["compatible"] * 3
    system.endpoints.append(writer("a", "w2", care="plain"))
    system.participants["w2"] = Participant("w2")
    assert verdicts(system) == ["unknown"] * 3


def test_bridges_in_a_circle_copy_what_comes_into_it():
    there = bridge("there", ("i", "a"), ("o", "b"), receive={"care": "sent"}, send={"care": "sent"})
    back = bridge("back", ("o", "b"), ("i", "a"), receive={"care": "sent"}, send={"care": "sent"})
    system = bridged(writer("a", "w", care="signed"), reader("b", "r", care="signed"), bridges=[there, back], abroad=())
    assert [group.verdict for group in checked(system, packs=COPIED).groups] == ["compatible"] * 2


def test_fixes_never_set_copied_values():
    report = checked(chain("plain", "signed", "first"), packs=COPIED)
    texts = {remedy.text for finding in report.findings for remedy in finding.remedies}
    assert texts == {"offer care `signed` on w", "request care `plain` on r"}


def test_without_a_bridge_there_is_nothing_to_copy_from_beyond_it():
    finding = only(checked(writer("a", "w", care="sent"), reader("a", "r", care="signed"), packs=COPIED), "POST101")
    assert finding.message.endswith("is not known: the bridge takes it from the publishers on its other side")


def test_a_session_copies_anew_after_an_edit():
    system = chain("plain", "signed", "sent")
    session = Session(system, packs=[COPYING, COPYING_ABROAD])
    assert session.report().verdict == "incompatible"
    session.put(writer("a", "w", care="signed"))
    assert session.report().verdict == "compatible"


def test_many_bridges_between_the_same_two_sides_are_copied_over_in_no_time():
    copied = {"receive": {"care": "first"}, "send": {"care": "first"}}
    bridges = [
        bridge(f"{way}{number}", ("i", f"{source}"), ("o", f"{target}"), **copied)
        for number in range(9)
        for way, source, target in (("there", "a", "b"), ("back", "b", "a"))
    ]
    system = bridged(writer("a", "w", care="signed"), reader("b", "r", care="signed"), bridges=bridges, abroad=())
    assert checked(system, packs=COPIED).verdict == "compatible"


# The same over several ways

ONCE = {"duplicate_free": "true"}


def beside(*bridges, at="b", needs=ONCE, **requested):
    """A writer at `a`, a reader elsewhere, and bridges between the two."""
    subscriber = needing(at, "r", more={"settings": settings(**requested)}, **needs)
    return bridged(writer("a", "w"), subscriber, bridges=bridges, abroad=())


def via(name, source="a", target="b", **values):
    return bridge(name, (f"{name}_in", source), (f"{name}_out", target), **values)


def repeated(system):
    return [(str(f.severity), f.message, f.endpoints) for f in check(system).findings if f.code == "CQ507"]


def test_samples_over_two_bridges_break_a_requirement_of_no_duplicates():
    said = "subscriber `r` needs duplicate_free, but what `w` publishes arrives at it twice: over `one`, and over `two`"
    assert repeated(beside(via("one"), via("two"))) == [("error", said, ("r",))]
    assert repeated(beside(via("one"), via("two"), needs={})) == []
    assert repeated(beside(via("one"))) == []


@pytest.mark.parametrize(
    ("bridges", "at", "ways"),
    [
        (
            [via("out", "a", "c"), via("back", "c", "b"), via("near")],
            "b",
            "over `near`, and over `out` and then `back`",
        ),
        (
            [via("one", "a", "c"), via("two", "a", "c"), via("on", "c")],
            "b",
            "over `one` and then `on`, and over `two` and then `on`",
        ),
        ([via("out", "a", "c"), via("back", "c", "a")], "a", "straight, and over `out` and then `back`"),
    ],
    ids=["of different length", "that part before another bridge", "one of them without a bridge"],
)
def test_ways_may_part_anywhere(bridges, at, ways):
    ((_, message, _),) = repeated(beside(*bridges, at=at))
    assert message.endswith(f"twice: {ways}")


def test_a_bridge_takes_nothing_back_so_that_both_directions_of_one_are_no_second_way():
    both = via("both")
    both.routes += bridge("", ("both_out", "b"), ("both_in", "a")).routes
    assert repeated(beside(both, at="a")) == []


def test_over_a_bridge_that_does_not_fit_nothing_arrives():
    assert repeated(beside(via("one"), via("two", receive={"care": "insured"}))) == []


def test_where_it_is_not_known_whether_a_bridge_fits_it_may_arrive_twice():
    ((severity, message, _),) = repeated(beside(via("one"), via("two", receive={"care": "unknown"})))
    assert (severity, "may arrive at it twice" in message) == ("warning", True)


def test_of_many_whose_samples_arrive_twice_one_is_named():
    system = beside(via("one"), via("two"))
    system.endpoints += [replace(system.endpoints[0], id=f"w{number}") for number in range(3)]
    ((_, message, _),) = repeated(system)
    assert message.endswith("over `one`, and over `two`; so does what 3 more publish")


def test_ways_between_many_bridges_are_found_in_no_time():
    steps = [via(f"{letter}{number}", letter, chr(ord(letter) + 1)) for letter in "abcdefgh" for number in range(9)]
    assert len(repeated(beside(*steps, at="i"))) == 1


# --- how much bridges may make ---


def longer(number, source="p", target="q"):
    """A bridge that puts a word before every name, and would take back what others do."""
    return bridge(f"b{number}", (source, "*"), (target, f"{chr(97 + number % 26)}{number}/*"))


def growing(bridges, *parts, **fields):
    report = check(bridged(*parts, bridges=bridges, abroad=(), **fields))
    return [finding.message.partition(": ")[2] for finding in report.findings if finding.code == "CQ508"]


def test_bridges_that_lengthen_the_names_of_each_other_are_reported_and_not_followed():
    assert growing([longer(0), longer(1)], writer("x", "p/w")) == ["`*` → b0 → `a0/*` → b1 → `b1/*` → b0 → `a0/*`"]


def test_names_that_come_back_longer_over_several_bridges_are_followed_round_once():
    towns = {f"p{n}": Participant(f"p{n}", settings=settings(town=str(n))) for n in range(3)}
    ring = [longer(n, f"p{n}", f"p{(n + 1) % 3}") for n in range(3)]
    assert growing(ring, writer("x", "p0/w"), participants=towns) == [
        "`x` → b0 → `a0/x` → b1 → `b1/a0/x` → b2 → `c2/b1/a0/x` → b0 → `a0/c2/b1/a0/x`"
    ]


def test_bridges_of_one_direction_that_rename_are_no_circle():
    towns = {f"p{n}": Participant(f"p{n}", settings=settings(town=str(n))) for n in range(4)}
    steps = [longer(n, f"p{n}", f"p{n + 1}") for n in range(3)]
    parts = [writer("x", "p0/w"), reader("c2/b1/a0/x", "p3/r")]
    assert growing(steps, *parts, participants=towns) == []
    system = bridged(*parts, bridges=steps, abroad=(), participants=towns)
    assert "p3/r" in {name for group in check(system).groups for name in group.subscribers}


def test_expressions_that_keep_what_comes_back_out_are_no_circle():
    narrowed = [replace(each, routes=(replace(each.routes[0], but=(".*/.*",)),)) for each in (longer(0), longer(1))]
    assert growing(narrowed, writer("x", "p/w")) == []


def test_a_name_that_gets_shorter_is_no_circle_of_growth():
    there, back = bridge("b", ("p", "a/*"), ("q", "b/*")), bridge("c", ("q", "b/a/*"), ("p", "*"))
    assert "CQ508" not in codes(check(bridged(writer("a/a/a/x", "p/w"), bridges=[there, back], abroad=())))


@pytest.mark.parametrize("most", [10, 51])
def test_more_endpoints_than_allowed_are_refused_with_the_limit_and_the_route(most, monkeypatch):
    monkeypatch.setenv("CQOS_MAX_ENDPOINTS", str(most))
    topics = [writer(f"home/{number}", f"in/{number}") for number in range(26)]
    system = bridged(*topics, bridges=[bridge("b", ("in", "home/*"), ("out", "far/*"))])
    with pytest.raises(InputError) as raised:
        check(system)
    (problem,) = raised.value.problems
    assert problem.code == "CQ029"
    assert problem.place == place(2)
    assert f"the limit of {most} endpoints" in problem.message
    assert "bridge `b`" in problem.message


def test_as_many_endpoints_as_allowed_are_taken(monkeypatch):
    monkeypatch.setenv("CQOS_MAX_ENDPOINTS", "78")
    topics = [writer(f"home/{number}", f"in/{number}") for number in range(26)]
    system = bridged(*topics, bridges=[bridge("b", ("in", "home/*"), ("out", "far/*"))])
    assert check(system).findings is not None


@pytest.mark.parametrize(
    ("make", "small", "large", "most"),
    [
        # Each of n bridges refuses the names of all others, which is little work beside its own.
        (lambda n: bridged(writer("x", "p/w"), bridges=[*map(longer, range(n))], abroad=()), 30, 60, 1.75),
        (lambda n: net(n, lambda a, b: a != b), 6, 12, 1.3),
        (lambda n: net(n, lambda a, b: b == (a + 1) % n), 30, 60, 1.3),
        (lambda n: net(n, lambda a, b: b == (a + 1) % n), 250, 500, 1.3),
    ],
    ids=["renaming", "clique", "ring", "large-ring"],
)
def test_what_bridges_cost_grows_with_their_number(make, small, large, most):
    """Counts calls of functions, which do not depend on the machine."""

    def cost(number):
        system, count = make(number), 0

        def counted(_frame, event, _argument):
            nonlocal count
            count += event == "call"

        check(make(number))  # what is remembered of values is the same for both
        sys.setprofile(counted)
        try:
            report = check(system)
        finally:
            sys.setprofile(None)
        assert report.findings
        return len(system.bridges), count

    (size, calls), (more, many) = cost(small), cost(large)
    assert math.log(many / calls) / math.log(more / size) <= most, (size, calls, more, many)


def net(number, joined):
    """So many places, in each a writer and a reader of one topic, and bridges between some."""
    parts = [each for at in range(number) for each in (writer("x", f"p{at}/w"), reader("x", f"p{at}/r"))]
    bridges = [
        bridge(f"b{a}_{b}", (f"p{a}", "x"), (f"p{b}", "x"))
        for a in range(number)
        for b in range(number)
        if joined(a, b)
    ]
    return bridged(*parts, bridges=bridges, abroad=())


def test_every_loop_up_to_a_number_is_listed_and_then_that_there_are_more():
    messages = [f.message for f in check(net(9, lambda a, b: a != b)).findings if f.code == "CQ503"]
    assert len(messages) == 26
    assert sum(message.startswith("there are more loops than the 25") for message in messages) == 1


STATED_SIDE = """cqos: 1
protocol: post
participants:
  w: {{publishes: {{home/a: {{care: plain}}}}}}
  g: {{subscribes: {{home/a: {{care: plain}}}}}}
  h: {{publishes: {{far/a: {{care: plain}}}}}}
  r: {{subscribes: {{far/a: {{care: plain}}}}}}
bridges:
  b: {{routes: [{{from: {{participant: g, topic: {}}}, to: {{participant: h, topic: {}}}}}]}}
"""


def stated_side(text):
    return check_file(text.encode(), packs=PACKS)


def test_the_endpoint_that_a_participant_states_is_the_side_of_its_bridge():
    report = stated_side(STATED_SIDE.format("home/a", "far/a"))
    assert codes(report) == []
    assert {(group.publishers, group.subscribers) for group in report.groups} == {
        (("w/publisher/home/a",), ("g/subscriber/home/a",)),
        (("h/publisher/far/a",), ("r/subscriber/far/a",)),
    }


def test_a_side_takes_what_the_stated_endpoint_states():
    weak = STATED_SIDE.replace("care: plain", "care: signed")
    for sides in (("home/a", "far/a"), ('"home/*"', '"far/*"')):
        assert codes(stated_side(weak.format(*sides))) == []


def test_a_side_with_settings_is_an_endpoint_of_its_own():
    text = STATED_SIDE.format("home/a", "far/a").replace("topic: home/a}", "topic: home/a, care: plain}")
    (found,) = [group for group in stated_side(text).groups if group.topic == "home/a"]
    assert found.subscribers == ("b/subscriber/home/a", "g/subscriber/home/a")


def test_each_of_two_routes_from_a_stated_endpoint_has_what_it_states():
    second = ", {from: {participant: g, topic: home/a}, to: {participant: h, topic: far/b}}]}"
    report = stated_side(STATED_SIDE.format("home/a", "far/a").replace("]}", second))
    assert {each for each in codes(report) if each != "CQ402"} == set()
    (found,) = [group for group in report.groups if group.topic == "home/a"]
    assert found.subscribers == ("b/subscriber/home/a", "g/subscriber/home/a")
