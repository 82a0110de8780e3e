"""Law: however a pair is asked about, the answer is one: system, groups, explain, one pair, session, the two ends alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Session, Severity, System, Verdict, check, check_pair, explain
from tests.laws.systems import BOTH, PACKS, Vocabulary, systems

if TYPE_CHECKING:
    from cqos_core import Report

Verdicts = dict[tuple[str, str], str]
FROM_PEERS: Final = {"best", "best_available"}


def without_peers(words: Vocabulary) -> Vocabulary:
    """The words of a protocol but those that take a value from all partners: an end alone has the same values."""
    texts = {name: tuple(text for text in each if text not in FROM_PEERS) for name, each in words.open.items()}
    presets = tuple(each for each in words.presets if each not in FROM_PEERS)
    return replace(words, open=texts, presets=presets)


BY_THEMSELVES: Final = tuple(map(without_peers, BOTH))


def verdicts(report: Report) -> Verdicts:
    """Verdict by publisher and subscriber; every pair is in one group only."""
    found: Verdicts = {}
    for pair in report.pairs:
        assert (pair.publisher, pair.subscriber) not in found
        found[pair.publisher, pair.subscriber] = str(pair.verdict)
    return found


def codes_of_pairs(report: Report) -> dict[tuple[str, str], tuple[str, ...]]:
    return {(p, s): group.codes for group in report.groups for p in group.publishers for s in group.subscribers}


def alone(system: System, *names: str) -> Report:
    """The report on a system that has these endpoints and no other."""
    return check(replace(system, endpoints=[each for each in system.endpoints if each.id in names]), packs=PACKS)


def two_by_two(system: System) -> tuple[Verdicts, dict[tuple[str, str], tuple[str, ...]]]:
    """Every endpoint with every other one, as if there were only these two: verdicts and codes of their pairs."""
    found: Verdicts = {}
    spoken: dict[tuple[str, str], tuple[str, ...]] = {}
    for names in combinations([each.id for each in system.endpoints], 2):
        report = alone(system, *names)
        found |= verdicts(report)
        spoken |= codes_of_pairs(report)
    return found, spoken


@pytest.mark.parametrize("words", BY_THEMSELVES, ids=lambda words: words.protocol)
@given(st.data())
def test_a_pair_in_a_system_has_the_verdict_of_its_two_ends_alone(words, data):
    system = data.draw(systems(words))
    report = check(system, packs=PACKS)
    found, spoken = two_by_two(system)
    assert verdicts(report) == found
    codes = codes_of_pairs(report)
    assert all(set(spoken[pair]) <= set(codes[pair]) for pair in spoken)
    assert report.pair_count == len(found)
    worst = max(("compatible", "unknown", "incompatible").index(verdict) for verdict in found.values()) if found else 1
    assert report.verdict.rank == worst


@pytest.mark.parametrize("words", BY_THEMSELVES, ids=lambda words: words.protocol)
@given(st.data())
def test_findings_count_the_pairs_that_their_rules_speak_of(words, data):
    system = data.draw(systems(words))
    report = check(system, packs=PACKS)
    reported = Counter[str]()
    for finding in report.findings:
        reported[finding.code] += finding.pairs
    # An invalid value has its own finding, so the rules that read it report nothing more.
    unread = any(finding.code.startswith("CQ2") for finding in report.findings)
    for code, number in Counter(code for codes in two_by_two(system)[1].values() for code in codes).items():
        assert reported[code] == number or unread, code


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_explaining_a_pair_says_what_the_check_says(words, data):
    system = data.draw(systems(words, most=4))
    for (publisher, subscriber), verdict in verdicts(check(system, packs=PACKS)).items():
        explained = explain(system, publisher=publisher, subscriber=subscriber, packs=PACKS)
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

    report = check(system, packs=PACKS)
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
    assert Session(system, packs=PACKS).report() == check(system, packs=PACKS)


@pytest.mark.parametrize("words", BY_THEMSELVES, ids=lambda words: words.protocol)
@given(st.data())
def test_endpoint_rules_are_asked_of_every_endpoint(words, data):
    """Findings of a rule name every endpoint that breaks it where it is alone, and no other."""
    system = data.draw(systems(words))
    of_ends = {bound.rule.code for pack in PACKS for bound in pack.bound_rules if bound.scope == "endpoint"}

    def broken(report: Report) -> set[tuple[str, str]]:
        found = {(each.code, name) for each in report.findings if each.code in of_ends for name in each.endpoints}
        # Profiles that no endpoint uses are tried with endpoints that the system does not have.
        return {(code, name) for code, name in found if name.split("/")[0] in names}

    names = {each.id for each in system.endpoints}
    by_itself = [broken(alone(system, name)) for name in names]
    assert broken(check(system, packs=PACKS)) == set().union(*by_itself)


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_an_incompatible_pair_is_never_without_an_error(words, data):
    system = data.draw(systems(words))
    report = check(system, packs=PACKS)
    loud = [f for f in report.findings if f.severity in {Severity.ERROR, Severity.WARNING}]
    if report.verdict != "compatible":
        # That nothing was compared is a note where all partners are elsewhere.
        assert loud or (not report.groups and "CQ404" in {f.code for f in report.findings})
    for finding in report.findings:
        # What refuses an end concerns all its pairs, and counts none of its own.
        assert finding.verdict in {None, Verdict.INCOMPATIBLE} or finding.pairs > 0
        assert finding.message
        assert all(side.members == tuple(sorted(side.members)) for side in finding.sides)
