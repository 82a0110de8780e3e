"""What the people who run a check say themselves: the team's own rules, accepted exceptions, severities."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta
from typing import TYPE_CHECKING, Any, Literal

import pytest

from cqos_core import Acceptance, Bound, Participant, TeamRule, read
from cqos_core.packs import Flag, Policy, Preset, RulePack, define, forbids
from tests.made_up_protocol import (
    CARE,
    DELAY,
    POST,
    SEALED,
    box,
    checked,
    codes,
    only,
    place,
    profile,
    reader,
    settings,
    world,
    writer,
)

if TYPE_CHECKING:
    from cqos_core import Report

Relation = Literal["exactly", "at_least", "at_most", "one_of", "not"]


def check(*require: Bound, where: dict[str, str] | None = None, sentence: str | None = None, **more: Any) -> TeamRule:
    """A check of the team, named `ours` because of `a reason`."""
    made = TeamRule("ours", tuple((where or {}).items()), require, "a reason", sentence)
    return replace(made, **more)


def bound(policy: str, relation: Relation, *values: str) -> Bound:
    return Bound(policy, relation, values)


def speaks(rule: TeamRule, **stated: Any) -> bool:
    """Whether a check speaks of a writer with these settings."""
    return "CQ605" in codes(checked(writer("box", **stated), reader("box"), checks=[rule]))


def test_a_check_may_use_the_definitions_of_the_pack():
    risky = define("risky", (CARE == "insured") & ~SEALED)
    pack = replace(POST, rules=(forbids(risky & (DELAY < "1s"), code="POST301", name="a", because="b"),))
    stated = [writer("box", care="insured"), reader("box")]
    found = only(checked(*stated, checks=[check(sentence="~risky")], packs=[pack]), "CQ605")
    assert found.notes[0] == 'required by check `ours`: ~risky; risky is (care == "insured") & ~sealed'


# Checks: each bound on both sides of its boundary

BOUNDS = [
    (bound("care", "exactly", "signed"), {"care": "signed"}, {"care": "insured"}),
    (bound("Treatment", "exactly", "CARE_SIGNED"), {"care": "Registered"}, {"care": "plain"}),
    (bound("care", "at_least", "signed"), {"care": "insured"}, {"care": "plain"}),
    (bound("care", "at_most", "signed"), {"care": "signed"}, {"care": "insured"}),
    (bound("care", "not", "plain"), {"care": "signed"}, {"care": "plain"}),
    (bound("care", "one_of", "plain", "insured"), {"care": "insured"}, {"care": "signed"}),
    (bound("delay", "at_most", "2s"), {"delay": "2s"}, {"delay": "2000000001ns"}),
    (bound("delay", "at_least", "2s"), {"delay": "2s"}, {"delay": "1999999999ns"}),
    (bound("delay", "not", "infinite"), {"delay": "9d"}, {}),
    (bound("copies", "at_least", "21"), {"copies": "21"}, {}),
    (bound("copies", "exactly", "all"), {"copies": "all"}, {"copies": "100"}),
    (bound("sealed", "exactly", "yes"), {"sealed": "true"}, {}),
    (bound("streets", "exactly", "[Elm, Oak]"), {"streets": "[Elm, Oak]"}, {"streets": "[Oak, Elm]"}),
    (bound("stamp", "exactly", "red"), {"stamp": "red"}, {"stamp": "blue"}),
    (bound("stamp", "one_of", "red", "green"), {"stamp": "green"}, {"stamp": "blue"}),
]


@pytest.mark.parametrize(("required", "kept", "broken"), BOUNDS, ids=[f"{b.policy} {b.relation}" for b, _, _ in BOUNDS])
def test_each_bound(required, kept, broken):
    writers = {"role": "publisher"}
    assert not speaks(check(required, where=writers), **kept)
    assert speaks(check(required, where=writers), **broken)


def test_a_check_may_be_a_whole_sentence_and_bounds_beside_it():
    rule = check(bound("copies", "at_least", "5"), sentence='(care == "plain") | sealed')
    assert not speaks(rule)
    assert not speaks(rule, care="signed", sealed=True)
    assert speaks(rule, care="signed")
    assert speaks(rule, copies="4")


def test_a_sentence_may_ask_what_was_written_down():
    """This includes policies for which no rule of the pack asks it."""
    rule = check(sentence="stated(copies)", where={"role": "publisher"})
    assert speaks(rule)
    assert not speaks(rule, copies="20")


def test_the_checks_of_one_system_do_not_change_the_report_on_others():
    """A service checks one system after the other in the same process."""
    pair = [writer("box", "a/w", copies="20"), writer("box", "b/w"), reader("box", care="signed")]
    before = checked(*pair)
    checked(*pair, checks=[check(sentence="stated(copies)")])
    assert checked(*pair) == before


def test_a_sentence_may_ask_what_was_written_down_of_a_topic():
    """A convention counts as little as a default."""
    rule = check(sentence="sealed | stated(topic(urgent))", where={"role": "publisher"})
    assert codes(checked(writer("a/urgent"), reader("a/urgent"), checks=[rule])) == ["CQ605"]
    stated = box("a/urgent", urgent="true")
    assert codes(checked(writer("a/urgent"), reader("a/urgent"), stated, checks=[rule])) == []


def test_a_sentence_of_one_side_is_asked_of_that_side_only():
    assert codes(checked(writer("box"), reader("box"), checks=[check(sentence="offered(sealed)")])) == ["CQ605"]
    assert codes(checked(writer("box", sealed=1), reader("box"), checks=[check(sentence="offered(sealed)")])) == []


def test_the_finding_says_who_requires_what_and_why():
    rule = check(bound("care", "at_least", "signed"), where={"role": "subscriber"}, severity="warning")
    finding = only(checked(writer("box", care="signed"), reader("box", "shop/r"), checks=[rule]), "CQ605")
    assert (finding.severity, finding.source, finding.verdict, finding.because) == (
        "warning",
        "checks",
        None,
        "a reason",
    )
    assert finding.message == "ours: subscriber `shop/r` has care plain: a reason"
    assert finding.notes[0] == 'required by check `ours`: care >= "signed"'
    assert [(remedy.policy, remedy.value) for remedy in finding.remedies] == [("care", "signed")]


def test_a_check_never_changes_the_verdict():
    report = checked(writer("box"), reader("box"), checks=[check(bound("care", "exactly", "insured"))])
    assert (report.verdict, codes(report)) == ("compatible", ["CQ605", "CQ605"])


def test_an_unknown_value_makes_a_check_unknown():
    report = checked(writer("box", care="usual"), reader("box"), checks=[check(bound("care", "exactly", "plain"))])
    finding = only(report, "CQ605")
    assert (
        finding.message == "ours: whether care of publisher `writer` will do is not known: it depends on post.carrier"
    )
    assert dict(finding.worlds) == {
        "post.carrier=bike": "compatible",
        "post.carrier=train": "incompatible",
        "post.carrier=ship": "incompatible",
    }


WHERE = [
    ({}, ["a/w", "a/r", "b/w", "b/r"]),
    ({"role": "publisher"}, ["a/w", "b/w"]),
    ({"topic": "news"}, ["a/w", "a/r"]),
    ({"topic": "*"}, ["a/w", "a/r", "b/w", "b/r"]),
    ({"topic": "/x/*"}, ["b/w", "b/r"]),
    ({"topic": "x/urg?nt"}, ["b/w", "b/r"]),
    ({"topic": "[!n]*"}, ["b/w", "b/r"]),
    ({"participant": "a"}, ["a/w", "a/r"]),
    ({"participant": "Shop *"}, ["b/w", "b/r"]),
    ({"protocol": "post"}, ["a/w", "a/r", "b/w", "b/r"]),
    ({"protocol": "mail"}, []),
    ({"type": "Letter"}, ["a/w"]),
    ({"id": "?/r"}, ["a/r", "b/r"]),
    ({"role": "subscriber", "participant": "b"}, ["b/r"]),
    ({"topic": "NEWS"}, []),
    ({"colour": "red"}, []),
]


@pytest.mark.parametrize(("where", "expected"), WHERE, ids=[str(where) for where, _ in WHERE])
def test_where_a_check_applies(where, expected):
    parts = [
        writer("news", "a/w", more={"type": "Letter"}),
        reader("news", "a/r"),
        writer("/x/urgent", "b/w"),
        reader("/x/urgent", "b/r"),
        Participant("b", label="Shop at the corner"),
    ]
    report = checked(*parts, checks=[check(bound("sealed", "exactly", "true"), where=where)])
    found = [member for finding in report.findings if finding.code == "CQ605" for member in finding.endpoints]
    assert sorted(found) == sorted(expected)


INVALID = {
    "an unknown policy": (check(bound("car", "exactly", "x")), "Post has no policy `car`; did you mean `care`?"),
    "a value that is none": (check(bound("care", "exactly", "express")), "`express` is not one of its values"),
    "a number out of range": (check(bound("copies", "at_least", "101")), "`101` is out of range"),
    "an order that there is not": (check(bound("streets", "at_least", "[a]")), "compares by order"),
    "no sentence": (check(sentence="care and sealed"), "use & and | instead of `and`"),
    "no policy in the sentence": (check(sentence="colour == 'red'"), "`colour` names no policy"),
    "nothing": (check(), "it requires nothing"),
    # A check looks at one endpoint; of two, or of all, it would hold of each by itself, whatever they are.
    "a pair": (check(sentence="offered(care) >= requested(care)"), "speaks of a pair, a check of one endpoint"),
    "a signal": (check(sentence="count(offered(care) == 'plain') < 2"), "speaks of a signal, a check of one endpoint"),
}


@pytest.mark.parametrize(("rule", "message"), INVALID.values(), ids=INVALID)
def test_a_check_that_cannot_be_applied_is_an_error_with_its_place(rule, message):
    finding = only(checked(writer("box"), reader("box"), checks=[replace(rule, place=place(7))]), "CQ604")
    assert finding.message.startswith("check `ours` cannot be applied: ")
    assert message in finding.message
    assert (finding.severity, finding.place) == ("error", place(7))


def test_a_check_for_one_of_two_protocols_is_no_mistake():
    mail = RulePack("mail", "Mail", (Policy("hurried", Flag(), "false"),), ())
    system = world(writer("box"), reader("box"), writer("box", "w2", more={"protocol": "mail"}))
    packs = [POST, mail]
    system.checks = [check(bound("hurried", "exactly", "true"))]
    assert codes(checked(system, packs=packs)) == ["CQ605", "CQ402"]
    system.checks = [check(bound("slow", "exactly", "true"))]
    assert "CQ604" in codes(checked(system, packs=packs))


def test_two_checks_of_the_same_values_are_two_findings():
    """This includes endpoints of instances, and endpoints whose value is not known."""
    rules = [check(bound("care", "at_least", "signed")), check(bound("care", "not", "plain"), name="theirs")]
    for more in ({"template": "w"}, {}):
        report = checked(writer("box", "w1", more=more), writer("box", "w2", more=more), checks=rules)
        assert codes(report).count("CQ605") == 2
    report = checked(writer("box", care="unknown"), checks=rules)
    assert codes(report).count("CQ605") == 2


def test_equal_values_are_one_finding_and_many_values_are_few():
    rule = check(bound("delay", "exactly", "infinite"), where={"role": "publisher"})
    alike = [writer("box", f"w{n}", delay="5s", copies=n + 1) for n in range(50)]
    assert codes(checked(*alike, reader("box"), checks=[rule])) == ["CQ605"]
    different = [writer("box", f"w{n:02}", delay=f"{n + 5}s") for n in range(50)]
    found = [f for f in checked(*different, reader("box"), checks=[rule]).findings if f.code == "CQ605"]
    assert len(found) == 26
    (rest,) = [finding for finding in found if "further" in finding.message]
    assert rest.message == (
        "ours: 25 further combinations of values break the rule, for instance: publisher `w25` has delay 30s: a reason"
    )
    assert len(rest.endpoints) == 25
    assert rest.remedies == ()


# Accepted exceptions

PAIR = [writer("box", "a/w"), reader("box", "b/r", care="signed")]


def accepting(*entries: Acceptance, parts: Any = None) -> Report:
    return checked(*(parts or PAIR), accept=list(entries))


def reasons(report: Report) -> dict[str, str | None]:
    return {finding.code: finding.accepted for finding in report.findings}


@pytest.mark.parametrize("rule", ["POST101", "post101", "care-below-requested", "POST001", "Post001"])
def test_a_finding_is_accepted_by_code_name_or_alias(rule):
    report = accepting(Acceptance(rule, "we insure elsewhere"))
    assert reasons(report) == {"POST101": "we insure elsewhere"}
    assert (report.verdict, report.fails(), report.count(report.findings[0].severity)) == ("incompatible", False, 0)


ENTRIES = [
    (Acceptance("POST101", "x", topic="box"), True),
    (Acceptance("POST101", "x", topic="b*"), True),
    (Acceptance("POST101", "x", topic="/box"), True),
    (Acceptance("POST101", "x", topic="Box"), False),
    (Acceptance("POST101", "x", topic="mail"), False),
    (Acceptance("POST101", "x", endpoint="a/w"), True),
    (Acceptance("POST101", "x", endpoint="b/r"), True),
    (Acceptance("POST101", "x", endpoint="?/r"), True),
    (Acceptance("POST101", "x", endpoint="c/r"), False),
    (Acceptance("POST101", "x", topic="box", endpoint="b/r"), True),
    (Acceptance("POST101", "x", topic="mail", endpoint="b/r"), False),
    (Acceptance("POST102", "x"), False),
]


@pytest.mark.parametrize(("entry", "expected"), ENTRIES)
def test_an_entry_may_be_about_one_topic_or_endpoint(entry, expected):
    report = accepting(entry)
    assert reasons(report)["POST101"] == ("x" if expected else None)
    # What matches nothing is reported, so that it cannot hide something new later.
    assert ("CQ601" in codes(report)) is not expected


def test_of_several_endpoints_only_the_one_named_is_excused():
    readers = [reader("box", f"r{n}", care="signed") for n in range(3)]
    report = accepting(Acceptance("POST101", "x", endpoint="r1"), parts=[writer("box"), *readers])
    assert {finding.endpoints[0]: finding.accepted for finding in report.findings} == {"r0": None, "r1": "x"}
    assert [finding.pairs for finding in report.findings] == [2, 1] or [f.pairs for f in report.findings] == [1, 2]
    assert report.fails()


def test_excuses_hold_for_every_kind_of_finding():
    apart = [
        *(writer("box", f"{name}/w") for name in "ab"),
        reader("box", "c/r"),
        Participant("c", settings=settings(town=1)),
    ]
    report = accepting(Acceptance("POST401", "far away", endpoint="a/w"), parts=apart)
    assert {f.endpoints[1]: f.accepted for f in report.findings if f.code == "POST401"} == {
        "a/w": "far away",
        "b/w": None,
    }
    wrong = [writer("box", "w1", care="express"), writer("box", "w2", care="express")]
    report = accepting(Acceptance("CQ203", "soon", endpoint="w1"), parts=wrong)
    assert [finding.accepted for finding in report.findings if finding.code == "CQ203"] == ["soon", None]
    insured = [writer("box", f"w{n}", care="insured") for n in range(2)]
    report = accepting(Acceptance("POST301", "open", endpoint="w1"), parts=insured)
    assert sorted(str(f.accepted) for f in report.findings if f.code == "POST301") == ["None", "open"]


def test_a_finding_over_several_topics_is_excused_for_all_of_them_or_not_at_all():
    parts = [
        *(writer(topic, f"{topic}/w", "usual", more={"observed": True}) for topic in ("a1", "a2")),
        *(reader(topic, f"{topic}/r", care="signed") for topic in ("a1", "a2")),
        profile("usual", delay="1s"),
    ]
    assert only(accepting(parts=parts), "POST101").more_topics == ("a2",)
    assert only(accepting(Acceptance("POST101", "x", topic="a?"), parts=parts), "POST101").accepted == "x"
    assert only(accepting(Acceptance("POST101", "x", topic="a1"), parts=parts), "POST101").accepted is None


def test_an_entry_holds_until_its_day_is_over():
    today = date.today()  # noqa: DTZ011 - as a check has it
    yesterday = today - timedelta(1)
    assert reasons(accepting(Acceptance("POST101", "x", until=str(today)))) == {"POST101": "x"}
    after = accepting(Acceptance("POST101", "x", until=str(yesterday), place=place(9)))
    assert reasons(after) == {"POST101": None, "CQ602": None}
    assert only(after, "CQ602").message == f"the acceptance of POST101 (x) expired on {yesterday}"
    assert only(after, "CQ602").place == place(9)


def test_entries_that_overlap_are_all_of_use():
    report = accepting(Acceptance("POST101", "first"), Acceptance("POST101", "second", topic="box"))
    assert reasons(report) == {"POST101": "first"}


def test_a_mistake_in_an_entry_is_reported_at_its_place():
    report = accepting(Acceptance("POST999", "x", place=place(3)), Acceptance("POST102", "y", place=place(4)))
    unknown, unused = only(report, "CQ603"), only(report, "CQ601")
    assert unknown.message == "an exception names rule `POST999`, which no installed pack has"
    assert unused.message == "the acceptance of POST102 (y) matches no finding"
    assert (unknown.place, unused.place) == (place(3), place(4))


# Severities


def severities(**wanted: str) -> dict[str, str]:
    report = checked(*PAIR, severities={name.replace("_", "-"): level for name, level in wanted.items()})
    assert report.verdict == "incompatible"  # a severity says how loud it is, not whether it fits
    return {finding.code: str(finding.severity) for finding in report.findings}


def test_severities_by_code_name_or_alias():
    assert severities() == {"POST101": "error"}
    assert severities(POST101="warning") == {"POST101": "warning"}
    assert severities(post101="note") == {"POST101": "note"}
    assert severities(care_below_requested="note") == {"POST101": "note"}
    assert severities(POST001="note") == {"POST101": "note"}
    assert severities(POST101="off") == {}
    assert severities(POST102="off") == {"POST101": "error"}


def test_the_code_counts_more_than_the_name_and_the_name_more_than_an_alias():
    assert severities(POST001="note", care_below_requested="warning", POST101="error") == {"POST101": "error"}
    assert severities(POST001="note", care_below_requested="warning") == {"POST101": "warning"}


def test_findings_of_the_core_have_severities_too():
    lonely = checked(reader("box"), severities={"CQ401": "error", "nothing-compared": "off"})
    assert [(finding.code, finding.severity) for finding in lonely.findings] == [("CQ401", "error")]
    unused = checked(*PAIR, accept=[Acceptance("POST102", "x")], severities={"CQ601": "off"})
    assert codes(unused) == ["POST101"]


def test_a_severity_of_an_unknown_rule_is_reported():
    finding = only(checked(*PAIR, severities={"POST999": "off"}), "CQ603")
    assert finding.message == "`severities` names rule `POST999`, which no installed pack has"
    assert "CQ603" not in codes(checked(*PAIR, severities={"POST302": "off"}))  # silent here, but a rule
    assert "CQ603" not in codes(checked(*PAIR, severities={"POST999": "off", "CQ603": "off"}))


def test_a_preset_of_the_pack_is_as_good_as_a_profile_for_a_check():
    pack = replace(POST, presets={**POST.presets, "gold": Preset({"care": "insured", "sealed": "true"})})
    system = world(writer("box", "w", "gold"), checks=[check(bound("care", "exactly", "insured"))])
    assert "CQ605" not in codes(checked(system, packs=[pack]))


@pytest.mark.parametrize("key", ["condition", "sentence"])
def test_a_system_file_states_a_condition_under_its_name_and_its_former_one(key):
    stated = f"{{cqos: 1, checks: [{{name: ours, because: so it is, {key}: depth >= 1}}]}}"
    assert read(stated.encode(), importer="yaml").checks[0].sentence == "depth >= 1"
