"""The benchmarks themselves work: a small run measures everything, and what scales scales."""

from tests.benchmarks.ratios import rows, table


def test_a_small_run_measures_everything():
    measured = list(rows(0.01))
    assert len(measured) == 6
    assert all(row.seconds > 0 and row.base > 0 for row in measured)
    assert len(table(measured).splitlines()) == 2 + len(measured)
