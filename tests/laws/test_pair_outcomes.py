"""The functions that tell which rules report on a pair agree with the rules."""

from dataclasses import replace
from itertools import product
from random import Random
from unittest.mock import patch

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.checking import topic_check
from cqos_core.checking.checker import check_system
from cqos_core.language.expression import any_of, offered
from cqos_core.matching import pair_outcomes, rule_set
from cqos_core.matching.pair_outcomes import PairEnd, kind_of, outcome
from cqos_core.matching.topic_groups import GroupKey, TopicShape
from cqos_core.matching.topic_outcomes import judge_shape
from cqos_core.packs.rule import forbids
from tests.benchmarks import inputs
from tests.effort import EXPLORE
from tests.laws.systems import BOTH, WHERE, systems
from tests.laws.test_condition_compiler import PACKS, plain, with_much_in_common
from tests.made_up_protocol import CARE, POST
from tests.random_rules import any_rules


@given(st.sampled_from(BOTH).flatmap(systems))
def test_pairs_have_the_report_that_their_rules_make(system):
    with patch.object(rule_set, "_WORTH_A_FUNCTION", 0):
        check_system(system, WHERE)
        known = check_system(system, WHERE)
        with patch.object(topic_check, "outcome_of", return_value=None):
            assert check_system(system, WHERE) == known


def test_functions_tell_which_rules_report_on_most_pairs_of_a_large_system():
    found = []

    def asked(*ends):
        found.append(pair_outcomes.outcome_of(*ends))
        return found[-1]

    text = b"".join(inputs.system_file(1_000))
    with patch.object(topic_check, "outcome_of", asked):
        report = cqos.check(text)
    assert sum(each is not None for each in found) > 450
    assert 10 > len({id(each) for each in found if each is not None}) > 3
    with patch.object(topic_check, "outcome_of", return_value=None):
        assert cqos.check(text) == report


ONE_RULE = replace(
    POST,
    id="one",
    rules=(forbids(any_of(offered(CARE) >= "signed"), code="ONE101", name="signed", because="it is so"),),
)
"""A pack with a rule that only the condition itself decides, and that reads all publishers of a topic and nothing else."""


def ends(random, pack, opened):
    """Return some publishers and some subscribers that differ in little, each with whether it was observed; nothing is needed."""
    nothing = dict(pack.needs.values())
    may_change = [at for at, each in enumerate(pack.policies) if each.level not in {"option", "need"}]
    _, others = with_much_in_common(random, pack, opened)
    for one in next(others):
        side = [one.with_values(nothing)]
        for at in random.sample(may_change, 8):
            side.append(side[0].with_values({at: plain(random, pack.policies[at])}))
        side += (side[1].with_values({}, beside=["X1"]), side[1].with_values({}, refused=["X2"]))
        yield [*((each, False) for each in side), (side[0], True)]


def said(result):
    """Return what a result says; what keeps groups apart is compared by identity."""
    return result.met, [(each.bound, each.missed) for each in result.kept_apart], result.rows, result.hits


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(40 if EXPLORE else 2))
@pytest.mark.parametrize("pack", [*PACKS, any_rules(2), any_rules(2, 1), ONE_RULE], ids=lambda pack: pack.id)
def test_what_is_remembered_of_a_pair_is_what_its_rules_say(pack, seed):
    pair_outcomes._KINDS.clear()
    pair_outcomes._OUTCOMES.clear()
    random = Random(seed)  # noqa: S311 - no secrets
    pairs = [pair for opened in (0.0, 0.05, 0.2) for pair in product(*ends(random, pack, opened))]
    found = []
    for publisher, subscriber in pairs:
        sides = zip((publisher, subscriber), ("publisher", "subscriber"), strict=True)
        here, there = (PairEnd(kind_of(each, role, seen), each, None) for (each, seen), role in sides)
        alone = ((GroupKey(each, seen, frozenset(), False, 1),) for each, seen in (publisher, subscriber))
        found.append(outcome(here, there))
        assert said(found[-1]) == said(judge_shape(TopicShape(pack, *alone)))
    assert len({id(each) for each in found}) < len(pairs) / 2
