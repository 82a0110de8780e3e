"""What C-QoS says of many systems is as recorded: `python3 dev.py goldens` records it anew, and `git diff` shows what changed."""

from __future__ import annotations

import pytest

from tests.goldens import inputs, record
from tests.goldens.folding import listed, plain

MOST = 200  # lines of a difference that are shown


@pytest.mark.parametrize("name", inputs.files())
def test_golden(name, monkeypatch):
    monkeypatch.chdir(inputs.ROOT)
    found = [*record.difference(name, record.recorded(name), record.text(name))]
    more = [f"... and {len(found) - MOST} more lines"] if len(found) > MOST else []
    if found:
        pytest.fail("\n".join([*found[:MOST], *more, "intended? `python3 dev.py goldens` records it"]), pytrace=False)


def test_each_golden_is_of_something():
    assert record.kept() <= inputs.files().keys()


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ((7,), "a7"),
        ((7, 9), "a7, a9"),
        ((7, 7, 7), "3 x a7"),
        ((7, 8, 9), "a{7..9}"),
        ((0, 30, 60, 90), "a{0..90/30}"),
        ((3, 5, 11, 13, 19, 21), "a{3,5 +8 x3}"),
        ((1, 3, 5, 11, 13, 19, 21), "a{1, 3,5 +8 x3}"),
        ((3, 5, 11, 13, 19, 21, 22), "a{3,5 +8 x3, 22}"),
        ((5, 5, 6, 1), "a{5*2, 6, 1}"),
        ((5, 5, 5, 1), "a{5*3, 1}"),
        ((4, 1, 5, 5, 6, 6, 7, 7, 1, 4), "a{4, 1, 5..7*2, 1, 4}"),
    ],
)
def test_numbers_are_written_as_progressions(numbers, text):
    assert plain(listed([f"a{number}" for number in numbers])) == text


def test_names_of_several_forms_stay_apart():
    assert plain(listed(["a1", "b1", "a2", "a3", "b2"])) == "a{1..3}, b1, b2"
