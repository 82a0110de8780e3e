"""Law: a fix that is applied to the system removes its finding, and changes as many pairs as it counts."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Setting, System, check
from cqos_core.packs import normalise
from tests.laws.systems import BOTH, PACKS, WHERE, Vocabulary, systems

if TYPE_CHECKING:
    from cqos_core import Finding, Remedy, Report
    from cqos_core.packs import RulePack

RANKS = ("compatible", "unknown", "incompatible")


def applied(system: System, remedy: Remedy, pack: RulePack) -> System:
    """Return a copy of the system with the fix applied."""
    changed = deepcopy(system)
    policy = pack.policy(remedy.policy)
    for endpoint in changed.endpoints:
        if endpoint.id in remedy.members:
            for table in (endpoint.settings, endpoint.overlay):
                for name in [name for name in table if normalise(name) in policy.spellings]:
                    del table[name]
            endpoint.settings[remedy.policy] = Setting(remedy.value)
    return changed


def speaks_of(report: Report, code: str) -> set[Any]:
    """Return the pairs, or the endpoints, on which a rule reports."""
    pairs: set[Any] = {
        (p, s) for group in report.groups if code in group.codes for p in group.publishers for s in group.subscribers
    }
    return pairs | {member for f in report.findings if f.code == code and not f.pairs for member in f.endpoints}


def verdicts(report: Report, topics: set[str]) -> dict[tuple[str, str], int]:
    return {
        (pair.publisher, pair.subscriber): RANKS.index(pair.verdict) for pair in report.pairs if pair.topic in topics
    }


def affected(finding: Finding, remedy: Remedy) -> set[Any]:
    """Return the pairs, or the endpoints, of the finding that the fix promises to repair."""
    if not finding.pairs:
        return set(remedy.members)
    by_role = {side.role: side.members for side in finding.sides}
    return {(p, s) for p in by_role["publisher"] for s in by_role["subscriber"] if {p, s} & set(remedy.members)}


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_a_remedy_does_what_it_says(words: Vocabulary, data):
    pack = WHERE.find_pack(words.protocol)
    assert pack is not None
    system = data.draw(systems(words, opened=False, most=5))
    system.checks, system.accept = [], []
    for endpoint in system.endpoints:
        endpoint.dialect = "yaml"  # fixes use the words of the YAML form
    before = check(system, packs=PACKS)
    for finding in before.findings:
        order = [(bool(remedy.breaks), len(remedy.members)) for remedy in finding.remedies]
        assert order == sorted(order), "the fix of the fewest endpoints comes first"
        for remedy in finding.remedies:
            if not set(remedy.members) <= {endpoint.id for endpoint in system.endpoints}:
                continue  # a part of a service, which has no settings of its own
            if " of topic " in remedy.text:
                continue  # a change of the topic; the law over fixes as text applies it
            after = check(applied(system, remedy, pack), packs=PACKS)
            assert not speaks_of(after, finding.code) & affected(finding, remedy) & speaks_of(before, finding.code)
            if remedy.mends is None:
                continue
            topics = {finding.topic or "", *finding.more_topics}
            old, new = verdicts(before, topics), verdicts(after, topics)
            # A pair that no longer meets is worse than any verdict, one that now meets is better than none.
            moved = [new.get(pair, 3) - old.get(pair, 3) for pair in old.keys() | new.keys()]
            assert (remedy.mends, remedy.breaks) == (sum(m < 0 for m in moved), sum(m > 0 for m in moved)), remedy
