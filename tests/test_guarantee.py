"""What pairs give and subscriptions need: `gives`, and the laws of needs over the packs that we ship."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Setting, Severity, Verdict, check, check_pair, explain
from cqos_core.packs import LINK, NEEDS, RELAYED, WORDS, Unaffected, gives, offered
from cqos_core.packs.guarantee import FAULTS, SURVIVES
from cqos_dds.pack import PACK as DDS
from cqos_ros2.pack import PACK as ROS2
from tests.made_up_protocol import CARE, DELAY, POST, codes, only, pair_system, reader, settings, world, writer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core import PairReport, Report
    from cqos_core.packs import RulePack

GIVING = replace(
    POST,
    policies=(*POST.policies, *NEEDS),
    rules=(
        *POST.rules,
        gives("latest", offered(CARE) >= "signed", code="POST511", name="mislaid", because="plain letters get lost"),
        gives("max_age", offered(DELAY), code="POST512", name="stale", because="letters lie about"),
        gives(
            "latest",
            None,
            survives="publisher_restart",
            code="POST513",
            name="gone",
            because="nobody writes them again",
        ),
        gives(
            "loss_free",
            offered(CARE) == "insured",
            doubt=True,
            code="POST514",
            name="perhaps-lost",
            because="what becomes of them nobody sees",
        ),
    ),
)


# gives ----------------------------------------------------------------------------------------------------------------


def rule(word: str, what: Any, **more: Any) -> Any:
    return gives(word, what, code="POST599", name="bad", because="so it is", **more)


def test_a_rule_is_silent_until_the_need_is_stated():
    made = rule("latest", offered(CARE) >= "signed")
    assert str(made.condition) == '~requested(need.latest) | (offered(care) >= "signed")'
    assert (made.kind, made.severity, made.guarantee, made.survives) == ("requires", "error", "latest", "link")


def test_a_number_is_compared_with_what_is_needed():
    most, least = rule("max_age", offered(DELAY)), rule("offline", offered(DELAY))
    assert str(most.condition) == (
        '(requested(need.max_age) == "infinite") | (offered(delay) <= requested(need.max_age))'
    )
    assert str(least.condition) == '(requested(need.offline) == "0s") | (offered(delay) >= requested(need.offline))'


def losing(made: Any) -> RulePack:
    """A pack in which one rule may take `latest` from a reader."""
    link = gives("latest", offered(CARE) >= "plain", code="POST598", name="sent", because="so it is")
    return replace(POST, policies=(*POST.policies, *NEEDS), rules=(*POST.rules, link, made))


def lost(pack: RulePack, fault: str, care: str, **options: str) -> bool:
    """Whether the rule takes it from one that needs it to survive a fault."""
    needs: dict[str, Any] = {"latest": True, "survives": [fault]}
    report = check_pair("post", {"care": care}, {}, options, needs=needs, packs=[pack])
    return "POST599" in {finding.code for finding in report.findings}


@pytest.mark.parametrize(
    ("survives", "faults", "words"),
    [
        ("broker_crash", {"broker_crash"}, "after a broker crash"),
        (
            "intermediary_restart",
            {"broker_stop", "broker_crash"},
            "after a restart of the broker or relay between them",
        ),
    ],
)
def test_a_fault_counts_for_those_who_ask_for_it(survives, faults, words):
    made = rule("latest", offered(CARE) >= "signed", survives=survives)
    assert words in made.says
    pack = losing(made)
    assert {fault for fault in FAULTS if lost(pack, fault, "plain")} == faults
    assert not any(lost(pack, fault, "signed") for fault in FAULTS)


def test_nothing_holds_over_a_link_outage_whose_length_is_not_stated():
    made = rule("latest", offered(CARE) >= "signed", survives="link_outage")
    assert "over a link outage" in made.says
    pack = losing(made)
    assert lost(pack, "link_outage", "signed")
    assert not lost(pack, "link_outage", "signed", outage="1min")


def test_what_nothing_gives_must_not_be_needed():
    assert str(rule("latest", None).condition) == "~requested(need.latest)"


def test_there_is_no_other_word():
    with pytest.raises(KeyError, match="speed"):
        rule("speed", offered(DELAY))


def test_there_is_no_other_fault():
    with pytest.raises(ValueError, match=r"`flood` is none of link, intermediary_restart, link_outage"):
        rule("latest", None, survives="flood")


# What the core makes of it --------------------------------------------------------------------------------------------


def judged(needs: Mapping[str, Any], **offer: str) -> Any:
    return check(world(writer("box", **offer), reader("box", more={"needs": settings(**needs)})), packs=[GIVING])


def test_an_unmet_need_is_an_error_that_says_what_is_needed_and_why():
    report = judged({"max_age": "1s"}, delay="2s")
    finding = only(report, "POST512")
    assert report.verdict == "incompatible"
    assert finding.message == (
        "subscriber `reader` needs max_age 1s, which publisher `writer` does not give: letters lie about"
    )
    assert [(each.role, each.policy, each.value) for each in finding.remedies] == [("publisher", "delay", "1s")]


def test_a_need_in_doubt_is_a_warning():
    report = judged({"loss_free": "true"}, care="plain")
    finding = only(report, "POST514")
    assert (report.verdict, finding.severity) == (Verdict.UNKNOWN, Severity.WARNING)
    assert "may not give" in finding.message


def test_a_guarantee_in_doubt_is_not_known():
    report = check_pair("post", {"care": "plain"}, {}, packs=[GIVING])
    values = {each.word: each.value for each in report.guarantees}
    assert values["loss_free"] == "unknown"
    assert values["latest"] == "no"


def test_what_a_publisher_relays_cannot_be_stated():
    report = judged({"relayed": "true"})
    finding = only(report, "CQ202")
    assert "relayed" not in (finding.help or "").partition("known:")[2]
    assert "survives" in (finding.help or "")
    assert RELAYED.level == SURVIVES.level


def test_a_misspelt_need_has_a_suggestion():
    assert "did you mean `late_join`?" in (only(judged({"latejoin": "1"}), "CQ202").help or "")


def test_a_fault_that_there_is_not_is_no_silent_yes():
    finding = only(judged({"latest": "true", "survives": "[subscriber_restart, flood]"}, care="signed"), "CQ203")
    assert "`flood` is no fault" in finding.message
    assert (
        finding.help
        == "expected a list of link_outage, subscriber_restart, publisher_restart, broker_stop, broker_crash"
    )


def test_faults_are_read_in_any_spelling():
    report = judged({"latest": "true", "survives": "Publisher Restart"}, care="signed")
    assert "after a publisher restart" in only(report, "POST513").message


def test_a_restart_of_what_stands_between_is_both_faults_of_a_broker():
    needs = SURVIVES.domain
    assert needs.parse("[intermediary_restart, link_outage]") == ("broker_stop", "broker_crash", "link_outage")


def test_a_fault_that_the_pack_does_not_cover_is_a_warning():
    report = judged({"latest": "true", "survives": "[broker_crash]"}, care="signed")
    finding = only(report, "CQ218")
    assert (report.verdict, finding.severity) == (Verdict.UNKNOWN, Severity.WARNING)
    assert "needs latest after a broker crash, which publisher `writer` may not give" in finding.message


UNAFFECTED = replace(
    GIVING,
    unaffected=(Unaffected("latest", ("link_outage", "broker_crash"), "the letter carrier knows the way", "custom"),),
)


@pytest.mark.parametrize(
    ("fault", "options", "verdict"),
    [
        ("broker_crash", {}, "compatible"),
        ("broker_stop", {}, "unknown"),
        ("link_outage", {}, "unknown"),
        ("link_outage", {"outage": "1min"}, "compatible"),
    ],
)
def test_what_a_clause_says_is_unaffected_holds_and_over_an_outage_only_if_that_is_stated(fault, options, verdict):
    needs: dict[str, Any] = {"latest": True, "survives": [fault]}
    report = check_pair("post", {"care": "signed"}, {}, options, needs=needs, packs=[UNAFFECTED])
    assert report.verdict == verdict


def test_each_fault_has_a_cell_of_its_own():
    latest = check_pair("post", {"care": "signed"}, {}, packs=[UNAFFECTED]).guarantees[0]
    assert {cell.fault: cell.value for cell in latest.cells} == {
        "link": "yes",
        "link_outage": "unknown",
        "subscriber_restart": "unknown",
        "publisher_restart": "no",
        "broker_stop": "unknown",
    }
    # Nothing that is given changes by a crash.
    assert latest.survives == ("broker_crash",)


def test_a_guarantee_that_the_pack_does_not_cover_is_reported():
    assert "POST511" not in codes(judged({"ordered": "true"}, care="plain"))
    assert "needs ordered" in only(judged({"ordered": "true"}), "CQ211").message


@pytest.mark.parametrize("pack", [ROS2, DDS], ids=lambda pack: pack.id)
def test_our_packs_say_something_of_every_word(pack):
    assert set(pack.guaranteed) == set(WORDS)
    giving = [bound for bound in pack.bound_rules if bound.rule.guarantee]
    assert all(bound.rule.clause and bound.scope == "pair" for bound in giving)


# Laws over both packs -------------------------------------------------------------------------------------------------

RECOVERY = {"repair_time": ["0s", "40ms"], "rediscovery_time": ["100ms"]}
ROBOTS: tuple[Any, ...] = (
    ROS2,
    {
        "reliability": ["best_effort", "reliable", "system_default"],
        "durability": ["volatile", "transient_local", "system_default"],
        "history": ["keep_last", "keep_all"],
        "depth": ["0", "1", "5", "1000"],
        "deadline": ["500ms", "1s", "infinite"],
        "liveliness_lease_duration": ["1s", "infinite"],
    },
    {"lifespan": ["1s", "10s", "infinite"]},
    {"taken_every": ["0s", "100ms"]},
    {"rmw": ["cyclonedds", "fastdds", "zenoh", "micro_ros"], **RECOVERY},
    {"period": ["10ms", "1s", "infinite"], "keyed": ["true", "false"]},
)
PROGRAMS: tuple[Any, ...] = (
    DDS,
    {
        "reliability": ["best_effort", "reliable"],
        "durability": ["volatile", "transient_local", "transient"],
        "history": ["keep_last", "keep_all"],
        "history.depth": ["1", "5", "1000"],
        "resource_limits.max_samples": ["10", "unlimited"],
        "deadline": ["1s", "infinite"],
        "liveliness.lease_duration": ["1s", "infinite"],
        "ownership": ["shared", "exclusive"],
        "presentation.access_scope": ["instance", "topic"],
        "presentation.ordered_access": ["true", "false"],
    },
    {
        "lifespan": ["1s", "10s", "infinite"],
        "durability_service.history_depth": ["1", "5"],
        "writer_data_lifecycle": ["true", "false"],
    },
    {
        "time_based_filter": ["0s", "500ms"],
        "taken_every": ["0s", "100ms"],
        "reader_data_lifecycle.autopurge_nowriter_samples_delay": ["0s", "infinite"],
    },
    {
        "implementation": ["standard", "cyclonedds", "fastdds", "opendds"],
        "durability_service_runs": ["true", "false"],
        **RECOVERY,
    },
    {"period": ["10ms", "1s", "infinite"], "keyed": ["true", "false"]},
)
BARE = {
    "ros2": replace(ROS2, rules=tuple(rule for rule in ROS2.rules if not rule.guarantee)),
    "dds": replace(DDS, rules=tuple(rule for rule in DDS.rules if not rule.guarantee)),
}
# From the weakest on.
STRENGTHS = {
    "late_join": ["0", "1", "5", "6", "1000"],
    "offline": ["0s", "1s", "10s", "1h"],
    "max_age": ["infinite", "10s", "1s", "1ns"],
    "max_gap": ["infinite", "1s", "999ms", "1ns"],
    "liveness": ["infinite", "1s", "1ms"],
    **{word: ["false", "true"] for word in ("latest", "loss_free", "duplicate_free", "ordered")},
}
RANK = {"compatible": 0, "unknown": 1, "incompatible": 2}
Pair = dict[str, Any]


def some(table: Mapping[str, list[str]]) -> Any:
    return st.fixed_dictionaries({}, optional={name: st.sampled_from(texts) for name, texts in table.items()})


def needs() -> Any:
    faults = st.lists(st.sampled_from(FAULTS), unique=True).map(lambda names: {"survives": f"[{', '.join(names)}]"})
    return st.builds(lambda stated, survives: stated | survives, some(STRENGTHS), faults | st.just({}))


@st.composite
def pairs(draw) -> Pair:
    """A pair of ROS 2 or DDS without needs, as `check_pair` takes it."""
    pack, both, of_writers, of_readers, options, topic = draw(st.sampled_from([ROBOTS, PROGRAMS]))
    return {
        "protocol": pack.id,
        "offered": draw(some({**both, **of_writers})),
        "requested": draw(some({**both, **of_readers})),
        "options": draw(some(options)),
        "topic": draw(some(topic)),
        "packs": [pack],
    }


def given_up(report: Report | PairReport, pack: RulePack) -> set[str]:
    """Codes of guarantees that a report speaks of."""
    ours = {rule.code for rule in pack.rules if rule.guarantee}
    return {code for finding in report.findings for code in (finding.code, *finding.more_codes)} & ours


@given(pairs())
def test_without_needs_a_pack_speaks_as_if_it_gave_nothing(pair):
    report = check_pair(**pair)
    bare = check_pair(**pair | {"packs": [BARE[pair["protocol"]]]})
    assert given_up(report, pair["packs"][0]) == set()
    assert report.verdict == bare.verdict
    assert [finding.message for finding in report.findings] == [finding.message for finding in bare.findings]


@given(pairs(), needs(), st.data())
def test_a_weaker_need_never_adds_a_finding_and_never_makes_the_verdict_worse(pair, stated, data):
    weaker = dict(stated)
    name = data.draw(st.sampled_from([*STRENGTHS, "survives"]))
    if name == "survives":
        weaker.pop(name, None)
    else:
        order = STRENGTHS[name]
        weaker[name] = data.draw(st.sampled_from(order[: order.index(stated.get(name, order[0])) + 1]))
    before, after = check_pair(**pair, needs=stated), check_pair(**pair, needs=weaker)
    pack = pair["packs"][0]
    assert given_up(after, pack) <= given_up(before, pack)
    assert RANK[after.verdict] <= RANK[before.verdict]


@given(pairs(), needs())
def test_an_unmet_need_refuses_and_one_not_known_leaves_open(pair, stated):
    without, report = check_pair(**pair), check_pair(**pair, needs=stated)
    pack = pair["packs"][0]
    reported = [finding for finding in report.findings if finding.code in given_up(report, pack)]
    if without.verdict == "incompatible":
        assert reported == []
        assert report.verdict == "incompatible"
        return
    severities = {finding.severity for finding in reported}
    assert severities <= {Severity.ERROR, Severity.WARNING}
    for finding in reported:
        assert finding.verdict == ("incompatible" if finding.severity is Severity.ERROR else "unknown")
    worst = "incompatible" if Severity.ERROR in severities else "unknown" if reported else without.verdict
    assert report.verdict == worst


@given(pairs(), needs())
def test_requirements_stated_together_are_all_reported(pair, stated):
    pack = pair["packs"][0]
    survives = {name: text for name, text in stated.items() if name == "survives"}
    apart = [
        given_up(check_pair(**pair, needs={word: text} | survives), pack)
        for word, text in stated.items()
        if word != "survives"
    ]
    assert given_up(check_pair(**pair, needs=stated), pack) == set().union(*apart)


@given(pairs(), needs())
def test_a_fix_removes_its_finding(pair, stated):
    for finding in check_pair(**pair, needs=stated).findings:
        if finding.code not in {rule.code for rule in pair["packs"][0].rules if rule.guarantee}:
            continue
        for remedy in finding.remedies:
            side = "offered" if remedy.role == "publisher" else "requested"
            required = dict(stated)
            fixed = pair | {side: {**pair[side], remedy.policy: remedy.value}}
            if remedy.policy.startswith("need."):
                assert (remedy.weakens, len(finding.remedies)) == (True, 1), "only where no setting helps"
                fixed, required = pair, {**stated, remedy.policy.removeprefix("need."): remedy.value}
            assert finding.code not in {each.code for each in check_pair(**fixed, needs=required).findings}


@given(pairs(), needs())
def test_a_pair_a_system_and_an_explanation_agree(pair, stated):
    pack = pair["packs"][0]
    text = {side: pair[side] for side in ("offered", "requested", "options", "topic")}
    system = pair_system(pack.id, **text, needs=stated)
    alone = explain(system, publisher="publisher", subscriber="subscriber", packs=[pack])
    asked, checked = check_pair(**pair, needs=stated), check(system, packs=[pack])
    assert alone.verdict == asked.verdict == checked.verdict
    assert given_up(alone, pack) == given_up(asked, pack) == given_up(checked, pack)


def test_needs_of_one_subscription_are_not_those_of_another():
    system = world(
        writer("box", care="plain"),
        reader("box", "first", more={"needs": {"latest": Setting("true")}}),
        reader("box", "second"),
    )
    report = check(system, packs=[GIVING])
    assert {group.subscribers: str(group.verdict) for group in report.groups} == {
        ("first",): "incompatible",
        ("second",): "compatible",
    }
    assert only(report, "POST511").endpoints == ("first", "writer")


def test_a_node_that_needs_is_judged_on_the_wire_of_dds_too():
    text = b"""
cqos: 1
participants:
  program: {protocol: dds, publishes: {rt/scan: {reliability: reliable, lifespan: 10s}}}
  node: {protocol: ros2, rmw: cyclonedds, subscribes: {scan: {needs: {max_age: 1s}}}}
"""
    report = check(text, importer="yaml", packs=[ROS2, DDS])
    assert only(report, "DDS533").severity is Severity.ERROR


OUTAGE_NOT_STATED = """
cqos: 1
protocol: dds
topics: {t: {period: 1s, size: 8, keyed: false, external: true}}
participants:
  p: {publishes: {t: {history: keep_all, reliability.max_blocking_time: infinite}}}
  s: {subscribes: {t: {reliability: reliable, history: keep_all, needs: {loss_free: true, ordered: true, survives: [link_outage]}}}}
"""


def test_what_one_missing_fact_leaves_open_is_one_finding_with_all_its_rules():
    (finding,) = [each for each in check(OUTAGE_NOT_STATED.encode()).findings if each.severity is not Severity.NOTE]
    assert finding.message == (
        "whether subscriber `s/subscriber/t` gets what it needs from publisher `p/publisher/t`, loss_free and ordered, is not "
        "known: option outage is not set"
    )
    assert (finding.pairs, finding.code, finding.more_codes) == (1, "DDS541", ("DDS542", "DDS543", "DDS544", "DDS546"))


TWO_PROTOCOLS = """
cqos: 1
participants:
  p: {protocol: dds, publishes: {a: {history.depth: 5}}}
  s: {protocol: dds, subscribes: {a: {reliability: reliable, history.depth: 5, needs: {loss_free: true}}}}
  rp: {protocol: ros2, publishes: {/r: {depth: 5}}}
  rs: {protocol: ros2, subscribes: {/r: {depth: 5, needs: {loss_free: true}}}}
"""


def test_the_same_words_about_another_protocol_are_another_fact():
    loud = [each for each in check(TWO_PROTOCOLS.encode()).findings if "period is not stated" in each.message]
    assert {(each.source, each.topic) for each in loud} == {("dds", "a"), ("ros2", "/r")}
    assert not any(each.more_topics or each.more_codes for each in loud)


def test_a_rule_that_is_switched_off_takes_no_other_with_it():
    text = OUTAGE_NOT_STATED + "severities: {DDS541: off}\n"
    (finding,) = [each for each in check(text.encode()).findings if each.severity is not Severity.NOTE]
    assert (finding.code, finding.more_codes) == ("DDS542", ("DDS543", "DDS544", "DDS546"))


@pytest.mark.parametrize(
    ("protocol", "settings", "expected"),
    [
        ("dds", {}, False),
        ("dds", {"durability": "transient", "reliability": "reliable"}, True),  # a durability service stands between
        ("ros2", {}, False),
        ("mqtt", {}, True),
    ],
)
def test_faults_of_a_broker_are_listed_only_if_there_may_be_one(protocol, settings, expected):
    options = {"durability_service_runs": "true"} if settings else {}
    faults = {
        cell.fault for each in check_pair(protocol, settings, settings, options).guarantees for cell in each.cells
    }
    assert {LINK, "link_outage", "subscriber_restart", "publisher_restart"} <= faults
    assert ("broker_stop" in faults) is expected


RIVALS = """
cqos: 1
protocol: dds
topics: {t: {period: 1s, keyed: false}}
participants:
  weak: {publishes: {t: {history: keep_all, ownership: exclusive, ownership_strength: 1}}}
  strong: {publishes: {t: {history: keep_all, ownership: exclusive, ownership_strength: 10}}}
  s: {subscribes: {t: {reliability: reliable, history: keep_all, ownership: exclusive}}}
"""


def latest_of(writer: str) -> str:
    pair = explain(RIVALS.encode(), publisher=f"{writer}/publisher/t", subscriber="s/subscriber/t")
    return next(each.value for each in pair.guarantees if each.word == "latest")


def test_a_weaker_writer_beside_a_stronger_one_gives_nothing():
    assert latest_of("weak") == "no"


def test_what_may_have_a_stronger_writer_beside_it_elsewhere_is_no_promise():
    assert latest_of("strong") == "unknown"


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ("{ownership_strength: 2, ownership: exclusive, history: keep_all}", "no"),
        ("{ownership_strength: 1, ownership: exclusive, history: keep_all}", "unknown"),
        ("{ownership_strength: 2, history: keep_all}", "unknown"),  # shared does not match
        ("{ownership_strength: 2, ownership: exclusive, reliability: best_effort}", "unknown"),  # nor does that
        ("{ownership_strength: 2, ownership: exclusive, partition: [b]}", "unknown"),
    ],
)
def test_only_a_writer_that_is_stronger_and_fits_takes_the_ownership(other, expected):
    system = RIVALS.replace(
        "strong: {publishes: {t: {history: keep_all, ownership: exclusive, ownership_strength: 10}}}",
        f"strong: {{publishes: {{t: {other}}}}}",
    )
    pair = explain(system.encode(), publisher="weak/publisher/t", subscriber="s/subscriber/t")
    assert next(each.value for each in pair.guarantees if each.word == "latest") == expected


@pytest.mark.parametrize(("keyed", "expected"), [("true", "unknown"), ("false", "no")])
def test_instances_may_have_owners_of_their_own(keyed, expected):
    pair = explain(
        RIVALS.replace("keyed: false", f"keyed: {keyed}").encode(),
        publisher="weak/publisher/t",
        subscriber="s/subscriber/t",
    )
    assert next(each.value for each in pair.guarantees if each.word == "latest") == expected
