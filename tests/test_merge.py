"""Several sources as one system."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cqos_core.api import check
from cqos_core.files.source_files import SentFiles
from cqos_core.files.source_reader import GivenSource, read_together
from cqos_core.files.system_merge import merge
from cqos_core.model.source import Source
from cqos_core.model.system import Acceptance, Bridge, Broker, Overlay, Participant, Route, System, TeamRule
from tests.made_up_protocol import POST, box, codes, only, participant, place, profile, reader, settings, world, writer


def said(system: System) -> list[str]:
    return [f"{note.code} {note.severity}: {note.message}" for note in system.notes]


def one(*parts: Any, **fields: Any) -> System:
    return replace(world(*parts, **fields), name="one")


def other(*parts: Any, **fields: Any) -> System:
    return replace(world(*parts, **fields), name="other")


def test_one_system_stays_what_it_is():
    system = one(writer("box"))
    assert merge([system]) is system


def test_a_publisher_of_one_file_meets_a_subscriber_of_another():
    report = check(one(writer("box")), other(reader("box", care="signed")), packs=[POST])
    assert (report.system, report.pair_count, codes(report)) == ("one + other", 1, ["POST101"])


def test_a_participant_that_several_state_is_one():
    first = participant("p", {"label": "The post", "starts_after": ("a",), "remap": {"x": "y"}}, town=1)
    second = participant("p", {"starts_after": ("b",), "remap": {"x": "z", "v": "w"}}, town=1, carrier="bike")
    merged = merge([one(first), other(second)])
    known = merged.participants["p"]
    assert {name: setting.text for name, setting in known.settings.items()} == {"town": "1", "carrier": "bike"}
    assert (known.label, known.starts_after, known.remap) == ("The post", ("a", "b"), {"x": "y", "v": "w"})
    assert said(merged) == []


def test_what_is_stated_alike_is_one_and_what_is_not_is_unknown_with_a_warning():
    same = [profile("p", care="signed"), box("t", urgent=True)]
    assert said(merge([one(*same), other(*same)])) == []
    merged = merge(
        [
            one(box("t", urgent=True), participant("a", town=1), writer("t", "a/w")),
            other(box("t", urgent=False), participant("a", town=2), reader("t", "a/r", care="signed")),
        ]
    )
    assert said(merged) == [
        "CQ060 warning: `town` of participant `a` is stated differently, as 1 and as 2; which of them holds is not known",
        "CQ060 warning: `urgent` of topic `t` is stated differently, as true and as false; which of them holds is not known",
    ]
    assert merged.participants["a"].settings["town"].unknown == "it is stated as 1 and as 2"


def test_each_source_has_its_own_of_the_profiles_that_several_define():
    first = one(profile("p", care="signed"), writer("t", "w", "p"))
    second = other(profile("p", "q", care="plain"), profile("q"), reader("t", "r", "p", care="signed"))
    for merged in (merge([first, second]), merge([second, first])):
        assert said(merged) == []
        ends = {each.id: each.profiles[0].name for each in merged.endpoints}
        assert ends == {"w": "p (one)", "r": "p (other)"}
        assert merged.profiles["p (other)"].base[0].name == "q"
    assert check(first, second, packs=[POST]).verdict == "compatible"


def test_a_profile_that_two_define_differently_is_unknown_to_a_third():
    definers = [
        one(replace(profile("p", care="signed"), place=place(1))),
        other(replace(profile("p", care="plain"), place=place(9))),
    ]
    third = other(writer("t", "w", "p"), reader("t", "r", care="signed"))
    report = check(*definers, third, packs=[POST])
    assert report.verdict == "unknown"
    assert only(report, "CQ060").message == (
        "profile `p` is stated differently at world.yaml:1, world.yaml:9; which of them holds is not known"
    )
    near = [replace(each, sources={f"{folder}/x": b""}) for folder, each in zip("abb", [*definers, third], strict=True)]
    assert check(*near, packs=[POST]).verdict == "incompatible"


def test_options_that_differ_are_those_of_the_participants_of_each_source():
    first, second = (
        one(writer("t", "a/w"), options={"carrier": "bike"}),
        other(reader("t", "b/r"), options={"carrier": "ship"}),
    )
    merged = merge([first, second])
    assert said(merged) == []
    assert merged.options == {"post": {}}
    assert {name: each.settings["carrier"].text for name, each in merged.participants.items()} == {
        "a": "bike",
        "b": "ship",
    }


def test_protocols_stay_those_of_each_source():
    merged = merge([one(writer("box", "a/w")), other(reader("box", "b/r"), protocol="mail")])
    assert merged.protocol is None
    assert [endpoint.protocol for endpoint in merged.endpoints] == ["post", "mail"]
    clash = merge([one(participant("p")), other(participant("p"), protocol="mail")])
    assert said(clash) == [
        "CQ060 warning: protocol of participant `p` is stated differently, as post and as mail; the first holds",
    ]
    # Its endpoints stay what their own source made of them.
    clash = merge([one(writer("box", "p/w")), other(reader("box", "p/r"), protocol="mail")])
    assert [endpoint.protocol for endpoint in clash.endpoints] == ["post", "mail"]


def test_different_severities_are_reported():
    merged = merge([one(severities={"POST101": "off"}), other(severities={"POST101": "note", "POST102": "off"})])
    assert merged.severities == {"POST101": "off", "POST102": "off"}
    assert len(said(merged)) == 1


def test_everything_else_adds_up():
    def full(name: str) -> System:
        return replace(
            one(writer("box", name), accept=[Acceptance("POST101", name)], checks=[TeamRule(name, (), (), "x")]),
            overlays=[Overlay(name, settings(care="signed"))],
            brokers={name: Broker(name)},
            sources={name: b"x"},
        )

    merged = merge([full("a"), full("b")])
    assert [each.because for each in merged.accept] == ["a", "b"]
    assert [each.name for each in merged.checks] == ["a", "b"]
    assert [each.name for each in merged.overlays] == ["a", "b"]
    assert (list(merged.brokers), list(merged.sources)) == (["a", "b"], ["a", "b"])


def test_equal_ids_of_two_files_are_made_unique():
    report = check(one(writer("box", "w")), other(writer("box", "w"), reader("box", care="signed")), packs=[POST])
    assert only(report, "POST101").endpoints == ("reader", "w", "w~2")


def test_external_is_only_what_every_source_calls_so():
    outside = Participant("p", external=True)
    assert merge([one(outside), other(replace(outside))]).participants["p"].external
    assert not merge([one(replace(outside)), other(Participant("p"))]).participants["p"].external


def test_a_bridge_carries_what_every_source_says():
    def bridge(*topics: str, carries: tuple[str, ...] = ()) -> Bridge:
        ends = [(replace(reader(topic), id=""), replace(writer(topic), id="")) for topic in topics]
        return Bridge("b", tuple(Route(*pair, place(number)) for number, pair in enumerate(ends)), carries)

    there = replace(one(), bridges={"b": bridge("box", "bag")})
    more = replace(other(), bridges={"b": bridge("bag", "jar", carries=("liveliness",))})
    (whole,) = merge([there, more]).bridges.values()
    assert [route.source.topic for route in whole.routes] == ["box", "bag", "jar"]
    assert whole.carries == ("liveliness",)


def test_a_source_that_another_one_includes_is_read_as_part_of_that():
    main = Source(
        "main.yaml", b"cqos: 1\nsystem: office\ninclude: part.yaml\nparticipants: {w: {publishes: {box: {}}}}\n"
    )
    part = Source("part.yaml", b"cqos: 1\nparticipants: {r: {subscribes: {box: {}}}}\n")
    files = SentFiles([main, part])
    for given in ([main, part], [part, main]):
        read = [
            each for each in read_together([GivenSource(each, files) for each in given]) if isinstance(each, System)
        ]
        assert merge(read) in read
        assert {endpoint.participant for endpoint in merge(read).endpoints} == {"w", "r"}
