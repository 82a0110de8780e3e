"""The benchmarks run, and their inputs are what they claim to be; the figures are in docs/benchmarks.md."""

from __future__ import annotations

from collections import Counter

import pytest

import cqos_core as cqos
from tests.benchmarks import inputs
from tests.benchmarks.__main__ import GROUPS, line


@pytest.mark.parametrize("name", ["pairs", "files", "one-topic", "edits"])
def test_a_small_run_measures_every_row(name):
    rows = list(GROUPS[name](0.001))
    assert rows
    assert all(row.ratio > 0 for row in rows)
    assert all(line(row).count(" | ") == 5 for row in rows)


@pytest.mark.parametrize("form", ["system_file", "diagram"])
def test_one_topic_of_ten_has_a_mistake_and_values_are_diverse(form):
    system = cqos.read(b"".join(getattr(inputs, form)(400)))
    report = cqos.check(system)
    of_verdict = Counter(dict.fromkeys(cqos.Verdict, 0))
    for group in report.groups:
        of_verdict[group.verdict] += group.pairs
    assert list(of_verdict.values()) == [180, 0, 20]
    settings = {tuple((name, each.text) for name, each in e.settings.items()) for e in system.endpoints}
    assert len(settings) > 390
