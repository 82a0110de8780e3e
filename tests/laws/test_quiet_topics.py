"""A check that keeps nothing of quiet topics has the report of one that keeps all."""

from unittest.mock import patch

from hypothesis import given, settings
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.checking import checker
from cqos_core.checking.checker import check_system
from cqos_core.matching import plain_pairs
from cqos_core.resolving import quiet_topics
from tests.benchmarks import inputs
from tests.laws.systems import BOTH, WHERE, systems


def both(check):
    """Return the reports with and without quiet topics, and how many of these there were."""
    with patch.object(
        quiet_topics.QuietTopics, "others", autospec=True, side_effect=quiet_topics.QuietTopics.others
    ) as asked:
        one = check()
    with patch.object(checker, "may_be_quiet", return_value=False):
        other = check()
    return one, other, sum([len(each.args[0]) for each in asked.call_args_list])


@given(st.sampled_from(BOTH).flatmap(systems))
@settings(max_examples=20)
def test_nothing_is_lost_with_quiet_topics(system):
    with patch.object(quiet_topics, "LEAST", 0), patch.object(plain_pairs, "_MANY", 0):
        one, other, _ = both(lambda: check_system(system, WHERE))
    assert one == other
    assert one.to_dict() == other.to_dict()


def test_most_topics_of_large_files_are_quiet():
    for form in (inputs.system_file, inputs.diagram):
        text = b"".join(form(1_200))
        one, other, quiet = both(lambda: cqos.check(text))  # noqa: B023 - called at once
        assert one.to_dict() == other.to_dict()
        assert quiet > 450


LONELY = b"""
  late:
    subscribes:
      /line5/value: {reliability: best_effort}
      /line7/valeu: {depth: 3}
      /only: {}
    publishes:
      line9/value: {depth: 3}
"""


def test_what_is_no_plain_pair_joins_quiet_topics():
    text = b"".join(inputs.system_file(1_200)) + LONELY
    one, other, quiet = both(lambda: cqos.check(text))
    assert one.to_dict() == other.to_dict()
    assert {"CQ401"} <= {each.code for each in one.findings}
    assert quiet > 450
