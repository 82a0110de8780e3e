"""What only the whole system can tell: lonely endpoints, names that nearly agree, and every code of the core."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.checking.checker import check_system
from cqos_core.language.domains import Count
from cqos_core.language.parser import parse
from cqos_core.language.policy import Policy
from cqos_core.language.vocabulary import Function
from cqos_core.model.codes import CODES
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import Acceptance, Bound, Endpoint, ImportNote, Overlay, Participant, TeamRule
from cqos_core.packs.rule import forbids
from cqos_core.packs.topic_matching import NameContext, Naming, TopicMatching
from tests.made_up_protocol import (
    CONTEXT,
    POLICIES,
    POST,
    box,
    checked,
    codes,
    only,
    participant,
    place,
    profile,
    reader,
    settings,
    world,
    writer,
)

if TYPE_CHECKING:
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report

# Every code of the core, with a system that has the finding and a twin that does not

PAIR = [writer("box"), reader("box")]
FAIL = [writer("box"), reader("box", care="signed")]


def folded(written: str, _: NameContext) -> Naming:
    return Naming(written.casefold().replace(" ", "_"), written)


FOLDING = [replace(POST, topic_matching=TopicMatching(folded))]


def failing(*_: object) -> bool:
    raise ValueError("no")


BROKEN = [
    replace(
        POST,
        functions=(*POST.functions, Function("failing", failing)),
        rules=(*POST.rules, forbids(parse("failing(stamp)"), code="POST900", name="a", because="b")),
    )
]
BEFORE, LATER = (str(date.today() + timedelta(days)) for days in (-10, 10))  # noqa: DTZ011 - as a check has it


def needing(stated: Endpoint) -> Endpoint:
    return replace(stated, needs=settings(latest="true"))


def check(**more: Any) -> TeamRule:
    return TeamRule("ours", (), (Bound("care", "exactly", ("plain",)),), "a reason", **more)


def overlay(topic: str, **more: Any) -> Overlay:
    return Overlay("the law", settings(care="signed"), "publisher", topic, **more)


CASES: dict[str, tuple[Any, Any]] = {
    "CQ201": (world(*PAIR, protocol="mail"), world(*PAIR)),
    "CQ202": (world(writer("box", car="x"), reader("box")), world(*PAIR)),
    "CQ203": (world(writer("box", care="x"), reader("box")), world(*PAIR)),
    "CQ204": (
        world(writer("box", "w", "x"), reader("box")),
        world(writer("box", "w", "x"), reader("box"), profile("x")),
    ),
    "CQ205": (
        world(writer("box", delay="1s"), options={"carrier": "pigeon"}),
        world(writer("box", delay="1s"), options={"carrier": "bike"}),
    ),
    "CQ206": (
        world(writer("box", "w", "careful"), profile("careful", care="plain")),
        world(writer("box", "w", "careful"), profile("careful", care="insured")),
    ),
    "CQ207": (
        world(writer("box", "w", "modern"), options={"year": "y1990"}),
        world(writer("box", "w", "modern"), options={"year": "y2000"}),
    ),
    "CQ208": (world(*PAIR, options={"year": "y2050"}), world(*PAIR, options={"year": "y2010"})),
    "CQ209": (
        world(writer("box", care="plain", treatment="signed")),
        world(writer("box", care="plain", treatment="plain")),
    ),
    "CQ210": (world(reader("box", returned=True)), world(writer("box", returned=True))),
    "CQ211": (world(writer("box"), needing(reader("box"))), world(*PAIR)),
    "CQ212": (
        world(writer("box", "w", "a"), profile("a", "a")),
        world(writer("box", "w", "a"), profile("a", "careful")),
    ),
    "CQ213": (
        world(writer("box", more={"starts_after": ("nobody",)})),
        world(writer("box", more={"starts_after": ("writer",)})),
    ),
    "CQ214": (world(*PAIR, overlays=[overlay("mail")]), world(*PAIR, overlays=[overlay("b*")])),
    "CQ217": (
        world(replace(writer("box"), settings={"care": Setting("", None, "it is elsewhere")}), reader("box")),
        world(*PAIR),
    ),
    "CQ401": (world(reader("box")), world(reader("box", more={"external": True}))),
    "CQ402": (world(writer("box")), world(writer("box"), box("box", external=True))),
    "CQ403": (world(writer("Box"), reader("box")), world(writer("Box"), reader("bx"))),
    "CQ404": (world(writer("a"), reader("b")), world(*PAIR)),
    "CQ405": (
        (world(writer("My box"), reader("my Box")), FOLDING),
        (world(writer("My box"), reader("My box"), reader("my_box", "r2")), FOLDING),
    ),
    "CQ406": (world(writer("box", "a/w"), reader("box", "a/r")), world(writer("box", "a/w"), reader("box", "b/r"))),
    "CQ601": (world(*FAIL, accept=[Acceptance("POST102", "x")]), world(*FAIL, accept=[Acceptance("POST101", "x")])),
    "CQ602": (
        (world(*FAIL, accept=[Acceptance("POST101", "x", until=BEFORE)]), [POST]),
        (world(*FAIL, accept=[Acceptance("POST101", "x", until=LATER)]), [POST]),
    ),
    "CQ603": (world(*FAIL, severities={"POST1": "off"}), world(*FAIL, severities={"POST101": "off"})),
    "CQ604": (
        world(*PAIR, checks=[replace(check(), require=(Bound("car", "exactly", ("x",)),))]),
        world(*PAIR, checks=[check()]),
    ),
    "CQ605": (world(writer("box", care="signed"), checks=[check()]), world(*PAIR, checks=[check()])),
    "CQ701": ((world(writer("box", stamp="x")), BROKEN), (world(writer("box")), BROKEN)),
}
ELSEWHERE = {
    "CQ219": "of parts that are not described: tests/test_coverage.py",
    "CQ218": "of guarantees under faults: tests/test_guarantee.py",
    "CQ215": "of overlays that only fill in: plugins/ros2/tests",
    "CQ216": "of brokers: plugins/mqtt/tests",
    **dict.fromkeys((f"CQ{number}" for number in range(501, 509)), "of bridges: tests/test_bridge_values.py"),
    **dict.fromkeys((f"CQ{number}" for number in range(801, 806)), "of chains: tests/test_chains.py"),
    **dict.fromkeys((f"CQ{number}" for number in range(811, 814)), "of links: tests/test_budgets.py"),
    "CQ606": "of baselines: tests/test_baseline.py",
    "CQ607": "of comments: tests/importers/test_inline_exceptions.py",
    "CQ407": "of two versions: tests/cli/test_breaking.py",
    "CQ702": "of importers: tests/cli/test_plugins.py",
}


def report_of(case: Any) -> Report:
    system, packs = case if isinstance(case, tuple) else (case, [POST])
    return checked(system, packs=packs)


@pytest.mark.parametrize("code", CASES)
def test_every_code_speaks_and_is_silent(code):
    speaking, silent = CASES[code]
    finding = only(report_of(speaking), code)
    info = CODES[code]
    assert finding.name == info.name
    assert finding.severity == info.severity
    assert finding.because
    assert finding.message[0].islower() or finding.message[0] == "`"
    assert code not in codes(report_of(silent))


def test_every_code_of_a_check_has_its_cases():
    asked = {code for code in CODES if code[2] in "24567"}
    assert asked - set(CASES) - set(ELSEWHERE) == set()


# Lonely endpoints


def test_a_subscriber_without_publisher_is_a_warning_and_a_publisher_without_subscriber_a_note():
    report = checked(
        reader("box", "a/r"), reader("box", "b/r"), writer("mail", "w"), writer("news", "w2"), writer("news", "w3")
    )
    assert [(finding.severity, finding.code, finding.message) for finding in report.findings] == [
        ("warning", "CQ401", "`a/r` and 1 more subscribe to `box`, which no endpoint in the system publishes"),
        ("warning", "CQ404", "no publisher meets a subscriber among 5 endpoints, so nothing was compared"),
        ("note", "CQ402", "`w` publishes `mail`, which no endpoint in the system subscribes to"),
        ("note", "CQ402", "`w2` and 1 more publish `news`, which no endpoint in the system subscribes to"),
    ]
    assert only(report, "CQ401").endpoints == ("a/r", "b/r")


def test_instances_of_a_template_without_partner_are_one_finding():
    def instance(n: int, topic: str) -> Endpoint:
        return reader(topic, f"r{n}", more={"template": "r${n}"})

    report = checked(instance(1, "box1"), instance(2, "box2"), reader("box3", "r3"))
    assert [each.endpoints for each in report.findings if each.code == "CQ401"] == [("r1", "r2"), ("r3",)]
    together = report.findings[0]
    assert (together.topic, together.more_topics) == ("box1", ("box2",))
    assert [side.templates for side in together.sides] == [("r${n}",)]


def test_an_accepted_instance_is_a_finding_of_its_own():
    def instance(n: int) -> Endpoint:
        return reader(f"box{n}", f"r{n}", more={"template": "r${n}"})

    report = checked(instance(1), instance(2), accept=[Acceptance("CQ401", "it is elsewhere", topic="box1")])
    assert [each.accepted for each in report.findings if each.code == "CQ401"] == ["it is elsewhere", None]


EXTERNAL: dict[str, list[Any]] = {
    "the endpoint": [reader("box", more={"external": True})],
    "the participant": [reader("box"), Participant("reader", external=True)],
    "the topic": [reader("box"), box("box", external=True)],
    "a convention": [reader("archive")],
}


@pytest.mark.parametrize("parts", EXTERNAL.values(), ids=EXTERNAL)
def test_an_endpoint_with_external_partners_is_not_reported_as_unmatched(parts):
    assert codes(checked(*parts)) == ["CQ404"]


def test_one_of_several_may_expect_its_partner_elsewhere():
    report = checked(reader("box", "a", more={"external": True}), reader("box", "b"))
    assert only(report, "CQ401").endpoints == ("b",)


def test_endpoints_without_a_topic_are_in_no_pair():
    report = checked(writer(None, "w"), reader(None, "r"))
    assert (codes(report), report.endpoints, report.topics) == (["CQ404"], 2, 0)


def test_protocols_keep_to_themselves():
    other = replace(POST, id="mail")
    packs = [POST, other]
    report = checked(writer("box"), reader("box", more={"protocol": "mail"}), packs=packs)
    assert codes(report) == ["CQ401", "CQ404", "CQ402"]


# Names that nearly agree


@pytest.mark.parametrize(
    ("published", "subscribed", "words"),
    [
        ("Box", "box", "the names differ only in upper and lower case"),
        ("STRASSE", "straße", "the names differ only in upper and lower case"),
        ("/box", "box", "the names differ only in slashes at the ends"),
        ("box/", "box", "the names differ only in slashes at the ends"),
        ("box", "box ", None),
        ("box1", "box2", None),
        ("a/box", "box", None),
    ],
)
def test_near_misses(published, subscribed, words):
    report = checked(writer(published, "w"), reader(subscribed, "r"))
    if words is None:
        assert {"CQ401", "CQ402"} <= set(codes(report))
        assert "CQ403" not in codes(report)
        return
    finding = only(report, "CQ403")
    assert finding.message == f"subscriber `r` on `{subscribed}` and publisher `w` on `{published}` never meet: {words}"
    # It takes the place of saying that each is alone.
    assert codes(report) == ["CQ403", "CQ404"]


def test_a_near_miss_names_everybody_on_both_sides():
    report = checked(
        *(replace(writer("Box", f"w{n}"), place=place(n + 1)) for n in (2, 1)),
        *(replace(reader("box", f"r{n}"), place=place(n + 5)) for n in (2, 1)),
    )
    finding = only(report, "CQ403")
    assert [(side.role, side.members, side.label) for side in finding.sides] == [
        ("subscriber", ("r1", "r2"), "subscribed here"),
        ("publisher", ("w1", "w2"), "published here"),
    ]
    assert finding.place == place(6)


def test_names_of_different_types_mean_no_common_topic():
    letters = replace(writer("Box"), type="Letter")
    assert "CQ403" not in codes(checked(letters, replace(reader("box"), type="Parcel")))
    assert "CQ403" in codes(checked(letters, reader("box")))


def test_where_there_are_two_to_choose_from_none_is_guessed():
    report = checked(writer("Box", "w1"), writer("BOX", "w2"), reader("box"))
    assert "CQ403" not in codes(report)
    assert "CQ401" in codes(report)


@pytest.mark.parametrize(
    ("published", "subscribed"),
    [
        ("letter", "leter"),
        ("letter", "lettre"),
        ("mail_box", "mailbox"),
        ("post/letter", "post/lettre"),
        ("heap", "hep"),
    ],
)
def test_names_that_differ_by_a_typing_error_are_a_near_miss(published, subscribed):
    finding = only(checked(writer(published, "w"), reader(subscribed, "r")), "CQ403")
    assert finding.message.endswith(f"differ by a typing error; did you mean `{published}`?")
    there = [writer(published, "w1"), reader(published, "r1")]
    assert only(checked(*there, reader(subscribed, "r2")), "CQ401").help == f"did you mean `{published}`?"


def test_a_typing_error_is_no_guess_between_two_topics_or_types():
    two = checked(writer("letter", "w1"), writer("leater", "w2"), reader("leter", "r"))
    assert "CQ403" not in codes(two)
    typed = [replace(writer("letter"), type="Card"), replace(reader("leter"), type="Parcel")]
    assert "CQ403" not in codes(checked(*typed))


def test_a_subscriber_with_partners_outside_finds_a_misspelt_publisher():
    report = checked(writer("lettre", "w"), replace(reader("letter", "r"), external=True))
    assert only(report, "CQ403").message.endswith("did you mean `lettre`?")


def test_a_matched_topic_is_no_near_miss_of_another():
    report = checked(writer("Box", "w1"), reader("Box", "r1"), reader("box", "r2"))
    assert codes(report) == ["CQ401"]


def test_who_is_alone_beside_others_is_asked_whether_it_meant_their_topic():
    there = [writer("Box", "w1"), reader("Box", "r1")]
    asked = "did you mean `Box`? the names differ only in upper and lower case"
    assert only(checked(*there, reader("box", "r2")), "CQ401").help == asked
    assert only(checked(*there, writer("box", "w2")), "CQ402").help == asked
    assert only(checked(*there, reader("bx", "r2")), "CQ401").help == CODES["CQ401"].help


def test_what_is_expected_elsewhere_is_no_near_miss():
    assert "CQ403" not in codes(checked(writer("Box"), reader("box", more={"external": True})))


# Names that become one


def test_spellings_of_one_topic_are_reported_with_all_their_endpoints():
    report = checked(
        *(replace(writer("My box", f"w{n}"), place=place(n)) for n in (3, 2)),
        reader("my Box", "r"),
        packs=FOLDING,
    )
    finding = only(report, "CQ405")
    assert finding.message == "`My box` and `my Box` both stand for topic `my_box`"
    assert (finding.sides[0].members, finding.place) == (("r", "w2", "w3"), place(2))
    assert report.pair_count == 2


# The order of start


def test_starts_after_may_name_participants_and_endpoints():
    known = [writer("box", "a/w", more={"starts_after": ("b", "b/r")}), reader("box", "b/r")]
    assert codes(checked(*known)) == []
    report = checked(*known, participant("a", {"starts_after": ("c",), "place": place(4)}))
    finding = only(report, "CQ213")
    assert finding.message == "`a` starts after `c`, which is neither a participant nor an endpoint"
    assert finding.help == "known: a, a/w, b, b/r"
    assert finding.place == place(4)


# Rules over what endpoints share


def test_rules_over_participants_and_options_are_asked_once_of_all_who_share_the_values():
    rules = (
        forbids(parse("participant(shelves) > 5"), code="POST801", name="a", because="the wall gives way"),
        forbids(parse("option(year) == 'y1990'"), code="POST802", name="b", because="nobody remembers"),
    )
    packs = [replace(POST, policies=(*POLICIES, Policy("shelves", Count(), "1", level="participant")), rules=rules)]
    parts = [*(writer("box", f"p{n}/w") for n in range(3)), reader("box", "p0/r")]
    parts_of = [participant(f"p{n}", shelves=(9, 9, 2)[n]) for n in range(3)]
    report = checked(*parts, *parts_of, packs=packs, options={"year": "y1990"})
    assert only(report, "POST801").sides[0].members == ("p0", "p1")
    assert only(report, "POST801").message == "participant `p0` (and 1 more) has shelves 9: the wall gives way"
    assert only(report, "POST802").sides[0].members == ("p0", "p1", "p2")
    assert not {"POST801", "POST802"} & set(codes(checked(*parts, packs=packs)))


def test_a_rule_that_counts_what_depends_on_an_assumption_reports_on_each_of_many_topics():
    rules = (
        forbids(parse("count(offered(care) >= 'plain') > 1"), code="POST801", name="a", because="it is crowded"),
        forbids(
            parse("(offered(care) == 'insured') & (count(offered(copies) > 50) > 0)"),
            code="POST802",
            name="b",
            because="it is dear",
        ),
    )
    boxes = [f"box{number}" for number in range(1, 31)]
    writers = [writer(box, f"{box}{name}", care="usual", copies=n) for n, box in enumerate(boxes, 1) for name in "ab"]
    assert codes(checked(*writers, packs=[replace(POST, rules=rules)])).count("POST801") == len(boxes)


# The report


def test_what_an_importer_has_to_say_is_part_of_the_report():
    note = ImportNote("CQ030", "warning", "it is odd", place(3), "mend it", "w")
    finding = next(f for f in checked(*PAIR, notes=[note]).findings if f.message == "it is odd")
    assert (finding.severity, finding.place, finding.help, finding.sides[0].members) == (
        "warning",
        place(3),
        "mend it",
        ("w",),
    )


def test_findings_stand_in_the_order_of_severity_code_topic_and_message():
    report = checked(
        writer("b/urgent", "w1", copies=90, care="insured"),
        reader("b/urgent", "r1", care="insured", copies=5),
        *(writer("a", "w2"), reader("a", "r2", care="signed")),
        *(reader("z", "r3"), writer("y", "w4")),
        severities={"POST202": "error"},
    )

    def key(finding: Finding) -> tuple[Any, ...]:
        return finding.severity.rank, finding.code, finding.topic or "", finding.message

    assert list(report.findings) == sorted(report.findings, key=key)
    assert codes(report) == ["POST101", "POST202", "CQ401", "POST301", "POST301", "CQ402"]


def test_a_report_counts_what_it_looked_at():
    report = checked(*PAIR, writer("news", "w2"))
    assert (report.endpoints, report.topics, report.pair_count, report.system) == (3, 2, 1, "world")
    assert report.not_checked == ("whether the postman is ill",)
    assert not report.fails(Severity.WARNING)
    assert report.fails(Severity.NOTE)
    assert [report.count(severity) for severity in Severity] == [0, 0, 1]


def test_progress_is_reported_before_each_topic():
    steps: list[tuple[int, int]] = []
    check_system(world(*PAIR, writer("news", "w2")), CONTEXT, lambda done, of: steps.append((done, of)))
    assert steps == [(0, 2), (1, 2)]


def test_a_place_prints_what_it_knows():
    assert [
        str(each)
        for each in (Place("f"), Place("f", 3), Place("f", 3, 4), Place("f", 3, None, "e"), Place("f", path="a.b"))
    ] == [
        *("f", "f:3", "f:3:4", "f:3 (e)", "f (a.b)"),
    ]


def test_findings_are_a_tuple_to_callers():
    report = checked(*FAIL)
    assert report.verdict is Verdict.INCOMPATIBLE
    assert [finding.code for finding in (*report.findings, *report.findings)] == ["POST101"] * 2
    (finding,) = report.findings
    assert report.findings + (finding,) == (finding,) + report.findings == (finding, finding)  # noqa: RUF005 - as callers may
