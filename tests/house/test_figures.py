"""No figure of the house rises unless a commit says so: `python3 dev.py house --record`."""

from __future__ import annotations

from tests.house import figures


def test_no_figure_rises():
    recorded = figures.recorded()
    risen = {name: f"{recorded[name]} to {now}" for name, now in figures.figures().items() if now > recorded[name]}
    assert not risen, "`python3 dev.py house` prints where; where it must be, `dev.py house --record` and say why"
