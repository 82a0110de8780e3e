"""Law: a stronger offer, or a weaker request, never makes a pair worse."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cqos_core import check
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, System
from tests.laws.systems import BOTH, PACKS, Vocabulary, systems

if TYPE_CHECKING:
    from cqos_core.model.report import Report

RANKS = ("compatible", "unknown", "incompatible")


def ranks(report: Report, name: str) -> dict[tuple[str, str], int]:
    return {
        (pair.publisher, pair.subscriber): RANKS.index(pair.verdict)
        for pair in report.pairs
        if name in {pair.publisher, pair.subscriber}
    }


def with_value(system: System, number: int, policy: str, text: str) -> System:
    changed = deepcopy(system)
    changed.endpoints[number].overlay = {}
    changed.endpoints[number].dialect = "yaml"
    changed.endpoints[number].settings[policy] = Setting(text)
    return changed


def takes_from_peers(system: System) -> bool:
    """Whether an endpoint takes a value from its peers, so that a stronger offer makes a stronger request."""
    stating = [each.settings for each in system.endpoints] + [each.settings for each in system.profiles.values()]
    return (
        any(setting.text in {"best", "best_available"} for settings in stating for setting in settings.values())
        or any(ref.name == "best_available" for e in (*system.endpoints,) for ref in e.profiles)
        or any(ref.name == "best_available" for p in system.profiles.values() for ref in p.base)
    )


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_a_stronger_offer_and_a_weaker_request_never_make_a_pair_worse(words: Vocabulary, data):
    system = data.draw(systems(words, most=4))
    assume(not takes_from_peers(system))
    number = data.draw(st.integers(0, len(system.endpoints) - 1))
    policy, values = data.draw(st.sampled_from(sorted(words.order.items())))
    offers = system.endpoints[number].role == PUBLISHER
    low, high = sorted(data.draw(st.lists(st.sampled_from(range(len(values))), min_size=2, max_size=2)))
    before, after = (low, high) if offers else (high, low)
    name = system.endpoints[number].id
    worse = ranks(check(with_value(system, number, policy, values[before]), packs=PACKS), name)
    better = ranks(check(with_value(system, number, policy, values[after]), packs=PACKS), name)
    assert worse.keys() == better.keys()
    assert all(better[pair] <= worse[pair] for pair in worse)
