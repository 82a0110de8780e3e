"""The functions that tell which rules report on a pair agree with the rules."""

from unittest.mock import patch

from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.checking import topic
from cqos_core.checking.checker import check_system
from cqos_core.matching import pair_outcomes, rule_set
from tests.benchmarks import inputs
from tests.laws.systems import BOTH, WHERE, systems


@given(st.sampled_from(BOTH).flatmap(systems))
def test_pairs_have_the_report_that_their_rules_make(system):
    with patch.object(rule_set, "_WORTH_A_FUNCTION", 0):
        check_system(system, WHERE)
        known = check_system(system, WHERE)
        with patch.object(topic, "reporting_rules", return_value=None):
            assert check_system(system, WHERE) == known


def test_functions_tell_which_rules_report_on_most_pairs_of_a_large_system():
    found = []

    def asked(*ends):
        found.append(pair_outcomes.reporting_rules(*ends))
        return found[-1]

    text = b"".join(inputs.system_file(1_000))
    with patch.object(topic, "reporting_rules", asked):
        report = cqos.check(text)
    assert sum(each is not None for each in found) > 450
    assert 10 > len({each[1] for each in found if each is not None}) > 3
    with patch.object(topic, "reporting_rules", return_value=None):
        assert cqos.check(text) == report
