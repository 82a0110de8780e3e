"""A check that keeps rows and outcomes of topics has the report of one that keeps all."""

from dataclasses import replace
from unittest.mock import patch

from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.checking import checker
from cqos_core.checking.checker import check_system
from cqos_core.matching import plain_pairs
from cqos_core.resolving import bulk_topics
from tests.benchmarks import inputs
from tests.laws.systems import BOTH, WHERE, systems


def both(check):
    """Return the reports with and without topics judged in bulk, and how many of these there were."""
    with patch.object(
        bulk_topics.BulkTopics, "others", autospec=True, side_effect=bulk_topics.BulkTopics.others
    ) as asked:
        one = check()
    with patch.object(checker, "may_be_in_bulk", return_value=False):
        other = check()
    return one, other, sum([len(each.args[0]) for each in asked.call_args_list])


@given(st.sampled_from(BOTH).flatmap(systems))
def test_nothing_is_lost_in_bulk(system):
    with patch.object(bulk_topics, "LEAST", 0), patch.object(plain_pairs, "_MANY", 0):
        one, other, _ = both(lambda: check_system(system, WHERE))
    assert one == other
    assert one.to_dict() == other.to_dict()


def test_most_topics_of_large_files_are_judged_in_bulk():
    for form in (inputs.system_file, inputs.diagram):
        text = b"".join(form(1_200))
        one, other, in_bulk = both(lambda: cqos.check(text))  # noqa: B023 - called at once
        assert one.to_dict() == other.to_dict()
        assert in_bulk > 570


def test_a_change_of_the_system_does_not_reach_a_report_that_was_made_before():
    for form in (inputs.system_file, inputs.diagram):
        system = cqos.read(b"".join(form(1_200)))
        whole = cqos.check(replace(system, endpoints=[*system.endpoints])).to_dict()
        system = cqos.read(b"".join(form(1_200)))
        report = cqos.check(system)
        for endpoint in system.endpoints:
            endpoint.settings = {"reliability": cqos.Setting("best_effort"), "depth": cqos.Setting("0")}
            endpoint.topic = "elsewhere"
        system.endpoints.clear()
        assert report.to_dict() == whole


LONELY = b"""
  late:
    subscribes:
      /line5/value: {reliability: best_effort}
      /line7/valeu: {depth: 3}
      /only: {}
    publishes:
      line9/value: {depth: 3}
"""


def test_what_is_no_plain_pair_joins_bulk_topics():
    text = b"".join(inputs.system_file(1_200)) + LONELY
    one, other, in_bulk = both(lambda: cqos.check(text))
    assert one.to_dict() == other.to_dict()
    assert {"CQ401"} <= {each.code for each in one.findings}
    assert in_bulk > 570
