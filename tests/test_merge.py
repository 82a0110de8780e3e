"""Several sources as one system."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cqos_core.api import check
from cqos_core.files import SentFiles
from cqos_core.importers.source import Source
from cqos_core.loading import Given, read_together
from cqos_core.merging import merge
from cqos_core.system import Acceptance, Bridge, Broker, Overlay, Participant, Route, System, TeamRule
from tests.worlds import POST, box, codes, only, participant, place, profile, reader, settings, world, writer


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


def test_what_is_stated_alike_is_one_and_what_is_not_stays_that_of_the_first_with_a_warning():
    same = [profile("p", care="signed"), box("t", urgent=True)]
    assert said(merge([one(*same), other(*same)])) == []
    merged = merge(
        [
            one(
                profile("p", care="signed"),
                box("t", urgent=True),
                participant("a", town=1),
                options={"carrier": "bike"},
            ),
            other(profile("p", care="plain"), box("t"), participant("a", town=2), options={"carrier": "ship"}),
        ]
    )
    assert merged.profiles["p"].settings["care"].text == "signed"
    assert merged.participants["a"].settings["town"].text == "1"
    assert merged.options["post"]["carrier"].text == "bike"
    assert said(merged) == [
        "CQ060 warning: `town` of participant `a` is stated differently, as 1 and as 2; the first holds",
        "CQ060 warning: profile `p` is stated differently at None and at None; the first holds",
        "CQ060 warning: topic `t` is stated differently at None and at None; the first holds",
        "CQ060 warning: option `post.carrier` is stated differently, as bike and as ship; the first holds",
    ]


def test_the_warning_is_told_where_the_other_one_stands():
    late = replace(profile("p", care="plain"), place=place(9))
    report = check(one(replace(profile("p"), place=place(1))), other(late), packs=[POST])
    assert only(report, "CQ060").place == place(9)


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


def test_severities_that_differ_are_said_to():
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


def test_ids_that_two_files_use_are_told_apart():
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
        read = [each for each in read_together([Given(each, files) for each in given]) if isinstance(each, System)]
        assert merge(read) in read
        assert {endpoint.participant for endpoint in merge(read).endpoints} == {"w", "r"}
