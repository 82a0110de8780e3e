"""A policy of one role: no rule reports the other role through a default that it does not have."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core import Session, check
from cqos_core.language.expression import as_condition, offered, requested
from cqos_core.model.problems import PackError
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bound, Endpoint, Participant, System, TeamRule
from cqos_core.packs.rule import forbids, requires
from tests.made_up_protocol import POST, RETURNED, SEALED, checked, codes, only, place, reader, world, writer

if TYPE_CHECKING:
    from cqos_core.language.expression import Condition
    from cqos_core.packs.pack import RulePack


def with_rule(sentence: Condition, **more: Any) -> RulePack:
    rule = forbids(sentence, code="POST999", name="of-one-role", because="it is so", **more)
    return replace(POST, rules=(*POST.rules, rule))


@pytest.mark.parametrize("severity", ["note", "warning", "error"])
def test_a_rule_about_a_publishers_policy_reports_no_subscriber(severity):
    pack = with_rule(~as_condition(RETURNED), severity=severity)
    report = checked(writer("box"), reader("box"), packs=[pack])
    assert only(report, "POST999").endpoints == ("writer",)
    alone = checked(writer("box", returned=True), reader("box"), packs=[pack])
    assert "POST999" not in codes(alone)
    assert alone.verdict == "compatible"


def test_what_the_rule_says_of_other_policies_holds_for_both_roles():
    packs = [with_rule(as_condition(RETURNED) | as_condition(SEALED))]
    report = checked(writer("box", returned=True), reader("box", sealed=True), packs=packs)
    reported = [finding.endpoints for finding in report.findings if finding.code == "POST999"]
    assert sorted(reported) == [("reader",), ("writer",)]


def test_a_check_of_the_team_follows_too():
    team = TeamRule("returns", (), (Bound("returned", "exactly", ("true",)),), "we want them back")
    report = checked(replace(world(writer("box"), reader("box")), checks=[team]))
    assert only(report, "CQ605").endpoints == ("writer",)


@pytest.mark.parametrize(
    "wrong",
    [
        requires(as_condition(requested(RETURNED)), code="POST999", name="n", because="b"),
        forbids(as_condition(RETURNED), code="POST999", name="n", because="b", role="subscriber"),
    ],
)
def test_a_rule_that_reads_it_of_the_other_role_is_refused(wrong):
    with pytest.raises(PackError, match=r"is of a subscriber, and only a publisher has `returned`"):
        replace(POST, rules=(*POST.rules, wrong))
    allowed = forbids(as_condition(offered(RETURNED)), code="POST999", name="n", because="b")
    assert replace(POST, rules=(*POST.rules, allowed)).rule("POST999") is allowed


def test_needs_of_a_publisher_are_reported_and_change_nothing():
    needing = {"latest": Setting("true", place(3))}
    endpoints = [
        Endpoint(
            id="p",
            role=PUBLISHER,
            topic="t",
            participant="p",
            settings={"reliability": Setting("reliable")},
            needs=needing,
        ),
        Endpoint(id="s", role=SUBSCRIBER, topic="t", participant="s"),
    ]
    system = System(protocol="ros2", participants={name: Participant(name) for name in "ps"}, endpoints=endpoints)
    report = check(system)
    finding = only(report, "CQ210")
    assert finding.message == "publisher `p` states `needs`, which only a subscriber has"
    assert (finding.severity, finding.endpoints, str(finding.place)) == ("warning", ("p",), "world.yaml:3")
    assert report.verdict == "compatible"
    assert Session(system).report() == report


def test_arguments_of_an_endpoint_have_names_so_that_none_can_be_swapped():
    with pytest.raises(TypeError, match="positional argument"):
        Endpoint("publisher", "a", "t", "p")  # type: ignore[call-arg, arg-type]


def test_needs_of_an_event_that_throws_are_reported_too():
    throwing = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos">
      <process id="P"><intermediateThrowEvent id="T"><extensionElements><qos:need name="latest" value="true"/>
      </extensionElements><signalEventDefinition signalRef="S"/></intermediateThrowEvent></process>
      <signal id="S" name="topic"/></definitions>"""
    assert only(check(throwing.encode(), protocol="ros2"), "CQ210").endpoints == ("T",)
