"""One topic as a unit: its groups, what keeps endpoints apart, and that however many there are the findings stay few."""

from __future__ import annotations

import json
import pickle
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core import Endpoint, Participant, Severity, Verdict
from cqos_core.packs import Function, call, offered, requested, requires
from tests.made_up_protocol import (
    CARE,
    COPIES,
    POST,
    box,
    checked,
    codes,
    only,
    participant,
    place,
    reader,
    settings,
    world,
    writer,
)

if TYPE_CHECKING:
    from cqos_core import Report


def groups(report: Report) -> set[tuple[tuple[str, ...], tuple[str, ...], str, tuple[str, ...]]]:
    return {(each.publishers, each.subscribers, str(each.verdict), each.codes) for each in report.groups}


def found(report: Report, code: str) -> list[Any]:
    return [finding for finding in report.findings if finding.code == code]


# Groups


def test_pairs_that_are_judged_alike_are_one_group():
    report = checked(
        writer("box", "w1"),
        writer("box", "w2", copies=5),
        writer("box", "w3", care="signed"),
        reader("box", "r1"),
        reader("box", "r2", care="signed"),
        reader("box", "r3", copies=7),
    )
    assert groups(report) == {
        (("w1", "w2"), ("r2",), "incompatible", ("POST101",)),
        (("w1", "w2"), ("r1", "r3"), "compatible", ()),
        (("w3",), ("r1", "r2", "r3"), "compatible", ()),
    }
    assert report.pair_count == len(list(report.pairs)) == 9
    assert Counter(pair.verdict for pair in report.pairs) == {Verdict.INCOMPATIBLE: 2, Verdict.COMPATIBLE: 7}
    assert report.verdict == "incompatible"


def test_a_group_names_the_rules_that_spoke_of_it_also_those_that_leave_the_verdict():
    report = checked(writer("box", care="insured", sealed=True), reader("box"))
    assert groups(report) == {(("writer",), ("reader",), "compatible", ("POST201",))}
    assert [(finding.code, finding.severity) for finding in report.findings] == [("POST201", "note")]


def test_a_report_is_as_bad_as_its_worst_pair():
    pairs = [writer("box", care="plain"), reader("box", "r1"), reader("box", "r2", care="unknown")]
    assert checked(*pairs).verdict == "unknown"
    assert checked(*pairs, reader("box", "r3", care="signed")).verdict == "incompatible"


def test_pairs_within_one_participant_are_counted_and_noted():
    report = checked(writer("box", "a/w"), reader("box", "a/r"), reader("box", "b/r"))
    assert [group.internal for group in report.groups] == [1]
    finding = only(report, "CQ406")
    assert (finding.severity, finding.message) == (
        *("note", "participant `a` subscribes to `box`, which it publishes itself"),
    )
    assert codes(checked(writer("box", "a/w"), reader("box", "b/r"))) == []


# Findings


def test_one_finding_per_rule_and_values_with_all_who_have_them():
    report = checked(
        *(writer("box", f"w{n}", care=("plain", "signed")[n % 2]) for n in range(4)),
        *(reader("box", f"r{n}", care="insured", sealed=True) for n in range(3)),
    )
    plain, signed = found(report, "POST101")
    assert [(side.members, side.facts[0].value) for side in plain.sides] == [
        (("r0", "r1", "r2"), "insured"),
        (("w0", "w2"), "plain"),
    ]
    assert [(side.members, side.facts[0].value) for side in signed.sides][1] == (("w1", "w3"), "signed")
    assert (plain.pairs, signed.pairs) == (6, 6)
    assert plain.message == (
        "publisher `w0` (and 1 more) offers care plain, subscriber `r0` (and 2 more) requests care insured"
    )


def test_a_headline_may_be_the_rules_own():
    report = checked(writer("a/urgent", "w", copies=50), reader("a/urgent", "r"))
    assert only(report, "POST202").message == "publisher `w` fills box `a/urgent` with 50, subscriber `r` takes 20"


def test_a_finding_shows_the_order_of_what_it_compares():
    finding = only(checked(writer("box"), reader("box", care="signed")), "POST101")
    assert finding.notes == ("order of care: plain < signed < insured",)
    assert finding.sides[0].label == "requested here"
    assert (finding.because, finding.clause, finding.source, finding.topic) == (
        *("letters are treated worse than the reader asks for", "Postal code, 1", "post", "box"),
    )


def test_rules_about_creating_an_endpoint_are_not_asked_of_observed_ones():
    assert codes(checked(writer("box", delay="1ms"), reader("box"))) == ["POST302"]
    assert codes(checked(writer("box", more={"observed": True}, delay="1ms", care="plain"), reader("box"))) == []


def test_consequences_of_a_reported_mistake_are_not_reported_again():
    report = checked(writer("box", care="express"), reader("box", care="signed"))
    assert (report.verdict, codes(report)) == ("unknown", ["CQ203"])


# Signals


def test_rules_over_a_signal_look_at_everybody():
    writers = [writer("box", "w1"), writer("box", "w2", care="signed")]
    finding = only(checked(*writers, reader("box")), "POST501")
    assert (finding.message, finding.severity, finding.pairs) == (
        *("on topic `box`, some letters arrive and others do not", Severity.NOTE, 0),
    )
    assert finding.endpoints == ("w1", "w2")
    assert codes(checked(writers[0], writer("box", "w3"), reader("box"))) == []


@pytest.mark.parametrize(("number", "expected"), [(2, []), (3, ["POST502"])])
def test_rules_over_a_signal_count_endpoints_not_groups(number, expected):
    writers = [writer("a/urgent", care="signed")]
    readers = [reader("a/urgent", f"r{n}", care="signed") for n in range(number)]
    assert codes(checked(*writers, *readers)) == expected
    different = [reader("a/urgent", f"r{n}", care="signed", streets=f"[{n}, a]") for n in range(number)]
    assert codes(checked(replace(writers[0], settings=settings(care="signed", streets="[a]")), *different)) == expected


def test_endpoints_that_do_not_meet_are_signals_of_their_own():
    """Two towns with one writer each are not one box with two writers that differ."""
    parts = [
        *(writer("box", f"{town}/w", care=care) for town, care in (("a", "plain"), ("b", "signed"))),
        *(reader("box", f"{town}/r2") for town in "ab"),
        participant("b", town=1),
    ]
    assert "POST501" not in codes(checked(*parts))
    assert "POST501" in codes(checked(*parts, writer("box", "a/w2", care="signed")))


# Who does not meet


def test_an_endpoint_kept_apart_is_reported_with_the_failures_behind_it():
    report = checked(writer("box", "a/w"), reader("box", "b/r", care="signed"), participant("b", town=1))
    finding = only(report, "POST401")
    assert report.verdict == "unknown"
    assert codes(report) == ["CQ404", "POST401"]
    assert finding.message == (
        "publisher `a/w` and subscriber `b/r` on topic `box` never meet (publisher has town 0; subscriber has town 1): "
        "letters do not leave the town"
    )
    assert finding.notes == (
        "behind it: publisher `a/w` offers care plain, subscriber `b/r` requests care signed (POST101)",
    )
    assert (finding.severity, finding.verdict, finding.pairs, finding.remedies) == ("warning", None, 0, ())


def test_if_all_endpoints_have_partners_a_split_is_one_note_per_topic():
    parts = [
        *(make("box", f"{town}{n}/{make.__name__}") for town in "ab" for n in range(3) for make in (writer, reader)),
        *(participant(f"b{n}", town=1) for n in range(3)),
    ]
    finding = only(checked(*parts), "POST401")
    assert (finding.severity, finding.message) == (
        *("note", "some endpoints on topic `box` never meet: letters do not leave the town"),
    )
    assert len(finding.endpoints) == 12


def test_an_unmatched_endpoint_is_a_warning_beside_the_note_about_the_rest():
    parts = [writer("box", "a/w"), reader("box", "a/r2"), reader("box", "b/r"), participant("b", town=1)]
    finding = only(checked(*parts), "POST401")
    assert (finding.severity, finding.endpoints) == ("warning", ("b/r", "a/w"))
    parts += [writer("box", "c/w"), reader("box", "c/r2"), participant("c", town=2)]
    assert sorted(f.severity for f in found(checked(*parts), "POST401")) == ["note", "warning", "warning"]


def test_who_expects_its_partner_elsewhere_is_not_left_alone():
    apart: list[Any] = [writer("box", "a/w", more={"external": True}), reader("box", "b/r"), participant("b", town=1)]
    assert "POST401" in codes(checked(*apart))  # the reader is alone
    both = [apart[0], replace(apart[1], external=True), apart[2]]
    assert "POST401" not in codes(checked(*both))
    assert "POST401" not in codes(checked(*apart, box("box", external=True)))
    owner = Participant("b", settings=settings(town=1), external=True)
    assert "POST401" not in codes(checked(apart[0], apart[1], owner))


def test_a_condition_may_speak_of_every_pair_it_keeps_apart():
    """Another stamp is a mistake also where everybody has some partner, and where partners are elsewhere."""
    parts = [
        *(writer("box", f"w{n}", stamp=stamp) for n, stamp in enumerate(("red", "blue"))),
        *(reader("box", f"r{n}", stamp=stamp) for n, stamp in enumerate(("red", "blue"))),
    ]
    report = checked(*parts, box("box", external=True))
    assert [(f.severity, f.endpoints) for f in found(report, "POST403")] == [
        ("error", ("r1", "w0")),
        ("error", ("r0", "w1")),
    ]
    assert report.pair_count == 2


def test_if_several_conditions_keep_a_pair_apart_the_first_is_reported():
    report = checked(
        writer("box", "a/w", streets="[Elm]"), reader("box", "b/r", streets="[Oak]"), participant("b", town=1)
    )
    assert codes(report) == ["CQ404", "POST401"]


# However many there are


def size(report: Report) -> int:
    return len(json.dumps(report.to_dict()))


def test_two_thousand_by_two_thousand_that_all_fail_are_one_finding():
    report = checked(
        *(writer("box", f"w{n}/w") for n in range(2000)),
        *(reader("box", f"r{n}/r", care="signed") for n in range(2000)),
    )
    assert codes(report) == ["POST101"]
    assert (report.findings[0].pairs, report.pair_count, len(report.groups)) == (4_000_000, 4_000_000, 1)
    assert (report.findings[0].remedies[0].mends, report.findings[0].remedies[0].breaks) == (4_000_000, 0)
    # Every id stands in it a few times: in the group, in the finding, in its remedies.
    assert size(report) < 8 * sum(len(f'"w{n}/w", "r{n}/r", ') for n in range(2000))


def test_where_everybody_differs_the_findings_are_few_and_their_counts_add_up():
    report = checked(
        *(writer("box", f"w{n}", delay=f"{1000 + n}ms", copies=n % 100 + 1) for n in range(300)),
        *(reader("box", f"r{n}", delay=f"{1000 + n}ms", copies=n % 90 + 1) for n in range(300)),
    )
    failing = sum(1 for offered in range(300) for requested in range(300) if offered > requested)
    assert Counter(pair.verdict for pair in report.pairs) == {
        Verdict.INCOMPATIBLE: failing,
        Verdict.COMPATIBLE: 90_000 - failing,
    }
    reported = found(report, "POST102")
    assert len(reported) == 26
    assert sum(finding.pairs for finding in reported) == failing
    (rest,) = [finding for finding in reported if "further" in finding.message]
    assert rest.message.startswith(
        f"{failing - 25} further combinations of values break the rule, for instance: publisher `w"
    )
    # The combinations have no value in common, so the finding shows none, and no change fixes them all.
    assert (rest.remedies, [side.facts for side in rest.sides]) == ((), [(), ()])


def test_the_example_of_many_combinations_is_one_of_them():
    report = checked(
        *(writer("box", f"w{n}", delay=f"{2000 + n}ms") for n in range(10)),
        *(reader("box", f"r{n}", delay=f"{1000 + n}ms") for n in range(10)),
    )
    (rest,) = [finding for finding in report.findings if "further" in finding.message]
    example = rest.message.partition("for instance: ")[2]
    assert example not in {finding.message for finding in report.findings}
    _, offering, _, requesting, _ = example.split("`")
    alone = checked(
        writer("box", offering, delay=f"{2000 + int(offering[1:])}ms"),
        reader("box", requesting, delay=f"{1000 + int(requesting[1:])}ms"),
    )
    assert only(alone, "POST102").message == example


def test_endpoint_rules_over_many_values_are_few_findings_too():
    report = checked(*(writer("box", f"w{n:02}", delay=f"{n + 1}ms") for n in range(60)), reader("box"))
    reported = found(report, "POST302")
    assert len(reported) == 26
    assert sorted(member for finding in reported for member in finding.endpoints) == [f"w{n:02}" for n in range(60)]
    (rest,) = [finding for finding in reported if "further" in finding.message]
    assert rest.message == "35 further combinations of values break the rule, for instance: publisher `w25` wants 26ms"


def test_what_keeps_many_apart_is_few_findings_too():
    report = checked(
        *(writer("box", f"w{n}", stamp=f"w{n}") for n in range(40)),
        *(reader("box", f"r{n}", stamp=f"r{n}") for n in range(40)),
    )
    reported = found(report, "POST403")
    assert (report.verdict, report.pair_count, len(reported)) == ("unknown", 0, 26)
    (rest,) = [finding for finding in reported if "further" in finding.message]
    assert rest.message.startswith(
        "1575 further combinations of values keep endpoints apart, for instance: publisher `w"
    )


def test_what_is_not_known_of_many_values_is_few_findings_too():
    report = checked(
        *(writer("box", f"w{n}", more={"observed": True}) for n in range(40)),
        *(reader("box", f"r{n}", delay=f"{n + 1000}ms") for n in range(40)),
    )
    reported = found(report, "POST102")
    assert report.verdict == "unknown"
    assert sum(finding.pairs for finding in reported) == 1600
    assert len(reported) <= 26


# What is found alike on several topics


def test_one_cause_on_several_topics_is_one_finding():
    parts = [
        part
        for n in range(5)
        for part in (writer(f"t{n}", f"w{n}", care="usual"), reader(f"t{n}", f"r{n}", care="signed"))
    ]
    finding = only(checked(*parts), "POST101")
    assert (finding.topic, finding.more_topics, finding.pairs) == ("t0", ("t1", "t2", "t3", "t4"), 5)
    assert [side.members for side in finding.sides] == [
        tuple(f"r{n}" for n in range(5)),
        tuple(f"w{n}" for n in range(5)),
    ]
    (request, offer) = sorted(finding.remedies, key=lambda remedy: remedy.role, reverse=True)
    assert (request.members, request.value, request.mends) == (tuple(f"r{n}" for n in range(5)), "plain", 5)
    assert (offer.members, offer.value, offer.mends) == (tuple(f"w{n}" for n in range(5)), "signed", 5)


def test_a_change_that_fixes_several_findings_is_counted_once():
    finding = only(
        checked(writer("box", "w0"), writer("box", "w1", care="unknown"), reader("box", "r", care="unknown")), "POST101"
    )
    assert finding.pairs == 2
    (request,) = (remedy for remedy in finding.remedies if remedy.role == "subscriber")
    assert (request.members, request.mends) == (("r",), 2)


def test_one_cause_with_other_verdicts_elsewhere_is_another_finding():
    parts = [
        *(writer(f"t{n}", f"w{n}", care="usual") for n in range(2)),
        *(reader("t0", "r0", care="signed"), reader("t1", "r1", care="insured", sealed=True)),
    ]
    first, second = found(checked(*parts), "POST101")
    assert dict(first.worlds) != dict(second.worlds)
    assert (first.more_topics, second.more_topics) == ((), ())


def test_instances_of_one_template_are_one_finding():
    def fleet(*ids: int, care: str = "signed") -> list[Endpoint]:
        parts: list[Endpoint] = []
        for n in ids:
            parts.append(writer(f"d{n}/box", f"d{n}/w", more={"template": "${d}/w"}))
            parts.append(reader(f"d{n}/box", f"d{n}/r", care=care, more={"template": "${d}/r"}))
        return parts

    finding = only(checked(*fleet(1, 2, 3)), "POST101")
    assert (finding.topic, finding.more_topics, finding.pairs) == ("d1/box", ("d2/box", "d3/box"), 3)
    assert finding.endpoints == ("d1/r", "d2/r", "d3/r", "d1/w", "d2/w", "d3/w")
    assert [remedy.mends for remedy in finding.remedies] == [3, 3]
    # An instance with another value is something else.
    assert len(found(checked(*fleet(1, 2), *fleet(3, care="insured")), "POST101")) == 2


def test_a_merged_finding_shows_only_values_that_all_of_it_have():
    """The values of the first would otherwise be shown as those of all."""
    parts = [
        *(writer("t0", "w0", more={"observed": True}, care="plain", sealed=True), reader("t0", "r0", delay="1s")),
        *(writer("t1", "w1", more={"observed": True}, care="plain", sealed=True), reader("t1", "r1", delay="2s")),
    ]
    finding = only(checked(*parts), "POST102")
    assert finding.more_topics == ("t1",)
    requested, offered = finding.sides
    assert requested.facts == ()
    assert [fact.value for fact in offered.facts] == ["unknown"]


def test_places_are_those_of_the_first_member():
    parts = [
        replace(writer("box", "w2"), place=place(2)),
        replace(writer("box", "w1"), place=place(1)),
        replace(reader("box", "r", care="signed"), place=place(3)),
    ]
    finding = only(checked(*parts), "POST101")
    assert [(side.members, side.place) for side in finding.sides] == [(("r",), place(3)), (("w1", "w2"), place(1))]


def test_a_system_without_endpoints_says_so():
    report = checked(world())
    assert (report.verdict, codes(report), report.endpoints, report.topics) == ("unknown", ["CQ404"], 0, 0)


def test_fixes_are_computed_when_they_are_read():
    """What judges a change is a function of the pack, which sees the values of the change."""
    judged: list[tuple[int, int]] = []

    def few(filled: int, taken: int) -> bool:
        judged.append((filled, taken))
        return filled + taken < 10

    rule = requires(
        call("few", offered(COPIES), requested(COPIES)) & (offered(CARE) >= requested(CARE)),
        code="POST199",
        name="too-many",
        because="the box is small",
    )
    functions = (*POST.functions, Function("few", few, "Whether both are few."))
    pack = replace(POST, rules=(*POST.rules, rule), functions=functions)
    parts = (writer("box", copies=7, care="plain"), reader("box", copies=1, care="signed"))
    report = checked(*parts, packs=[pack])
    assert codes(report) == ["POST101", "POST199"]
    assert set(judged) == {(7, 1)}
    copy = pickle.loads(pickle.dumps(report))  # noqa: S301 - our own bytes
    assert (copy, hash(copy.findings)) == (report, hash(report.findings))
    tried = len(judged)
    assert len(set(judged)) > 1
    assert all(each.remedies for each in report.findings)
    assert len(judged) == tried, "once"
