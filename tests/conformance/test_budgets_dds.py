"""Some figures of budgets, measured on Cyclone DDS; `dev.py conformance` measures all, also on Fast DDS, for which it compiles a program."""

import os

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from tests.conformance.budgets import ALLOWED, CASES, DOCUMENT, FEW, computed, measured, missing


@pytest.mark.parametrize("case", FEW, ids=str)
def test_traffic_is_as_computed(case):
    lacking = missing()
    if lacking is not None and os.environ.get("CI") == "true":
        pytest.fail(f"traffic has to be measured where CI runs: {lacking}")
    if lacking is not None:
        pytest.skip(lacking)
    assert measured(case) == pytest.approx(computed(case), rel=ALLOWED)


def test_the_page_has_every_case_within_its_bound():
    rows = [line.split("|")[1:-1] for line in DOCUMENT.read_text(encoding="utf-8").splitlines()[-len(CASES) :]]
    assert [(kind.strip(), size.strip()) for _, kind, size, *_ in rows] == [
        (each.kind, f"{each.size:,}") for each in CASES
    ]
    assert all(abs(float(difference.strip().rstrip("%"))) <= 100 * ALLOWED for *_, difference in rows)
    expected = [f"{computed(each):,.0f}" for each in CASES]
    assert [row[4].strip() for row in rows] == expected
