"""Law: however a pair is asked about, the answer is one: system, groups, explain, one pair, session, brute force."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Session, check_pair
from cqos_core.api import explain_pair
from cqos_core.checking.checker import check_system
from cqos_core.matching.judge import apart, judge_endpoint, judge_pair, of_end, undecided_meeting, worst
from cqos_core.matching.pairing import EndpointGroup, bucket, group
from cqos_core.matching.peer_values import settle
from cqos_core.model.report import Report, Severity, Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, System
from cqos_core.resolving.resolve import resolve
from tests.laws.systems import BOTH, PACKS, WHERE, systems

Verdicts = dict[tuple[str, str], str]


def verdicts(report: Report) -> Verdicts:
    """Verdict by publisher and subscriber; every pair is in one group only."""
    found: Verdicts = {}
    for pair in report.pairs:
        assert (pair.publisher, pair.subscriber) not in found
        found[pair.publisher, pair.subscriber] = str(pair.verdict)
    return found


def codes_of_pairs(report: Report) -> dict[tuple[str, str], tuple[str, ...]]:
    return {(p, s): group.codes for group in report.groups for p in group.publishers for s in group.subscribers}


def brute_force(system: System) -> tuple[Verdicts, dict[tuple[str, str], tuple[str, ...]]]:
    """Every publisher with every subscriber of its topic, one by one, without groups and classes."""
    found: Verdicts = {}
    spoken: dict[tuple[str, str], tuple[str, ...]] = {}
    for endpoints in bucket(resolve(system, WHERE.find_pack).endpoints).values():
        topic = group(endpoints)
        settle(topic)
        profiles = {
            endpoint.id: (endpoint.role, members)
            for members in (*topic.publishers, *topic.subscribers)
            for endpoint in members.endpoints
        }
        for one, (role, offering) in profiles.items():
            for other, (other_role, requesting) in profiles.items():
                if role == PUBLISHER != other_role and not apart(offering.profile, requesting.profile):
                    verdict, spoken[one, other] = of_pair(offering, requesting)
                    found[one, other] = str(verdict)
    return found, spoken


def of_pair(offering: EndpointGroup, requesting: EndpointGroup) -> tuple[Verdict, tuple[str, ...]]:
    """What the rules of the pair and those of its ends amount to, and the codes of the former."""
    judgement = judge_pair(offering.profile, requesting.profile)
    ends = [
        verdict
        for role, members in ((PUBLISHER, offering), (SUBSCRIBER, requesting))
        for verdict, _ in of_end(members.profile, role, members.observed, members.wired)
    ]
    meetings = offering.profile.pack.by_scope["meets"]
    undecided = [each for b in meetings if (each := undecided_meeting(b, offering.profile, requesting.profile))]
    spoken = (*undecided, *judgement.spoken)
    at_best = [Verdict.UNKNOWN] if undecided else []
    return worst([judgement.verdict, *ends, *at_best]), tuple(each.bound.rule.code for each in spoken)


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_groups_are_exactly_the_pairs_that_meet_with_their_verdicts(words, data):
    system = data.draw(systems(words))
    report = check_system(system, WHERE)
    found, spoken = brute_force(system)
    assert verdicts(report) == found
    codes = codes_of_pairs(report)
    assert codes.keys() == spoken.keys()
    assert all(set(spoken[pair]) <= set(codes[pair]) for pair in spoken)
    assert report.pair_count == len(found)
    worst = max(("compatible", "unknown", "incompatible").index(verdict) for verdict in found.values()) if found else 1
    assert report.verdict.rank == worst


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_findings_speak_of_the_pairs_that_their_rules_speak_of(words, data):
    """Every failing pair is covered by a finding, and the numbers of pairs add up."""
    system = data.draw(systems(words))
    report = check_system(system, WHERE)
    reported: dict[str, int] = {}
    for finding in report.findings:
        reported[finding.code] = reported.get(finding.code, 0) + finding.pairs
    spoken: dict[str, int] = {}
    for codes in brute_force(system)[1].values():
        for code in codes:
            spoken[code] = spoken.get(code, 0) + 1
    for code, number in spoken.items():
        # An invalid value has its own finding, so the rules that read it report nothing more.
        unread = any(finding.code.startswith("CQ2") for finding in report.findings)
        assert reported.get(code, 0) == number or unread, code


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_explaining_a_pair_says_what_the_check_says(words, data):
    system = data.draw(systems(words, most=4))
    for (publisher, subscriber), verdict in verdicts(check_system(system, WHERE)).items():
        explained = explain_pair(system, publisher, subscriber, WHERE)
        assert explained.verdict == verdict
        lines = [line.verdict.rank for line in explained.policies if line.verdict is not None]
        # One rule may rest on what is no policy of an endpoint; else the pair is as bad as its worst line.
        ends = {finding.verdict for finding in explained.findings if finding.verdict is not None and not finding.pairs}
        unread = any(finding.code.startswith("CQ2") for finding in explained.findings)
        assert max(lines, default=0) == explained.verdict.rank or ends or unread


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_asking_about_one_pair_says_what_the_check_says(words, data):
    """`check_pair` knows nothing but two sets of settings and the options."""
    system = data.draw(systems(words, rich=False, opened=False, most=4))
    by_id = {endpoint.id: endpoint for endpoint in system.endpoints}
    options = {name: setting.text for name, setting in system.options.get(words.protocol, {}).items()}

    def settings(name: str) -> dict[str, Any]:
        return {key: setting.text for key, setting in by_id[name].settings.items()}

    report = check_system(system, WHERE)
    for (publisher, subscriber), verdict in verdicts(report).items():
        name = by_id[publisher].topic or ""
        pair = check_pair(
            words.protocol, settings(publisher), settings(subscriber), options, {"name": name}, packs=PACKS
        )
        assert pair.verdict == verdict
        loud = {finding.code for finding in pair.findings if finding.verdict is not None}
        assert loud <= set(codes_of_pairs(report)[publisher, subscriber])


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_a_session_says_what_the_check_says(words, data):
    system = data.draw(systems(words))
    assert Session(system, packs=PACKS).report() == check_system(system, WHERE)


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_endpoint_rules_are_asked_of_every_endpoint(words, data):
    """By brute force too: findings of a rule name every endpoint that breaks it, and no other."""
    system = data.draw(systems(words))
    report = check_system(system, WHERE)
    expected: dict[str, set[str]] = {}
    scopes: dict[str, str] = {}
    for endpoints in bucket(resolve(system, WHERE.find_pack).endpoints).values():
        topic = group(endpoints)
        settle(topic)
        for members in (*topic.publishers, *topic.subscribers):
            for bound in members.profile.pack.bound_rules:
                scopes[bound.rule.code] = bound.scope
            for spoken in judge_endpoint(members.profile, members.first.role, members.observed):
                if not spoken.unknown:
                    expected.setdefault(spoken.bound.rule.code, set()).update(each.id for each in members.endpoints)
    # Profiles that no endpoint uses are tried with endpoints that the system does not have.
    own = {each.id for each in resolve(system, WHERE.find_pack).endpoints}
    reported: dict[str, set[str]] = {}
    for finding in report.findings:
        if scopes.get(finding.code) == "endpoint" and own & {*finding.endpoints}:
            reported.setdefault(finding.code, set()).update(finding.endpoints)
    assert reported == expected


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_an_incompatible_pair_is_never_without_an_error(words, data):
    system = data.draw(systems(words))
    report = check_system(system, WHERE)
    loud = [f for f in report.findings if f.severity in {Severity.ERROR, Severity.WARNING}]
    if report.verdict != "compatible":
        # That nothing was compared is a note where all partners are elsewhere.
        assert loud or (not report.groups and "CQ404" in {f.code for f in report.findings})
    for finding in report.findings:
        # What refuses an end concerns all its pairs, and counts none of its own.
        assert finding.verdict in {None, Verdict.INCOMPATIBLE} or finding.pairs > 0
        assert finding.message
        assert all(side.members == tuple(sorted(side.members)) for side in finding.sides)
