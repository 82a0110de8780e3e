"""The functions that find a topic quiet agree with the rules: nothing reports on it."""

from unittest.mock import patch

from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.checking import topic
from cqos_core.checking.checker import check_system
from cqos_core.matching import quiet, rule_set
from tests.benchmarks import inputs
from tests.laws.systems import BOTH, WHERE, systems


@given(st.sampled_from(BOTH).flatmap(systems))
def test_quiet_topics_have_the_report_of_any_other(system):
    with patch.object(rule_set, "_WORTH_A_FUNCTION", 0):
        known = check_system(system, WHERE)
        assert check_system(system, WHERE) == known
        with patch.object(topic, "is_quiet", return_value=False):
            assert check_system(system, WHERE) == known


def test_most_topics_of_a_large_system_are_quiet():
    found = []

    def asked(*ends):
        found.append(quiet.is_quiet(*ends))
        return found[-1]

    text = b"".join(inputs.system_file(1_000))
    with patch.object(topic, "is_quiet", asked):
        report = cqos.check(text)
    assert sum(found) > 400
    with patch.object(topic, "is_quiet", return_value=False):
        assert cqos.check(text) == report
