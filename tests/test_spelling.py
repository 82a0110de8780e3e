"""One edit distance: letters inserted, deleted, replaced or swapped, counted up to a bound."""

import time
from itertools import product
from unittest.mock import Mock

import pytest

from cqos_core.model import spelling
from cqos_core.model.spelling import KnownNames, distance, nearest, typing_errors
from cqos_core.model.suggestions import suggestion


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        ("", "", 0),
        ("", "ab", 2),
        ("depth", "depth", 0),
        ("depht", "depth", 1),
        ("reliabilty", "reliability", 1),
        ("relaibilty", "reliability", 2),
        ("scan", "scna", 1),
        ("ca", "abc", 3),
        ("kitten", "sitting", 3),
    ],
)
def test_counts_typing_errors(one, other, apart):
    assert distance(one, other, 3) == distance(other, one, 3) == apart


def by_definition(one, other):
    """The restricted Damerau-Levenshtein distance, as its recurrence states it."""
    if not one or not other:
        return len(one) + len(other)
    best = min(
        by_definition(one[1:], other) + 1,
        by_definition(one, other[1:]) + 1,
        by_definition(one[1:], other[1:]) + (one[0] != other[0]),
    )
    if one[:2] == other[1::-1] and len(one) > 1 < len(other):
        best = min(best, by_definition(one[2:], other[2:]) + 1)
    return best


def test_equals_its_definition_up_to_the_bound():
    words = ["".join(letters) for size in range(5) for letters in product("abc", repeat=size)][::3]
    for one in words:
        for other in words:
            exact = by_definition(one, other)
            for most in range(4):
                assert distance(one, other, most) == min(exact, most + 1), (one, other, most)


def test_long_names_cost_little():
    long = "ab" * 5_000
    before = time.process_time()
    assert distance(long, f"x{long}y", 2) == 2
    assert distance(long, long[::-1], 2) == 2
    assert distance(long, "a" * 10_000, 2) == 3
    assert time.process_time() - before < 1


@pytest.mark.parametrize(
    ("word", "known", "found"),
    [
        ("reliabilty", ["durability", "reliability"], "reliability"),
        ("History Dept", ["history.kind", "history.depth"], "history.depth"),
        ("sensor", ["sensor_data", "services"], "sensor_data"),
        ("colour", ["depth", "reliability"], None),
        ("x" * 10_000, ["x"], None),
    ],
)
def test_nearest_name(word, known, found):
    assert nearest(word, known) == found


@pytest.mark.parametrize("word", ["q15432", "p154.32", "p15432x", "p15432"])
def test_of_many_numbered_names_few_are_compared(word, monkeypatch):
    known = KnownNames(f"p{number}" for number in range(10_000, 20_000))
    counted = Mock(side_effect=distance)
    monkeypatch.setattr(spelling, "distance", counted)
    assert known.nearest(word) == "p15432"
    assert 0 < counted.call_count < 40


def test_suggestion_names_the_nearest():
    assert suggestion("dept", ["durability", "depth"]) == "did you mean `depth`? known: depth, durability"


def test_numbered_names_and_short_words_are_no_typing_errors():
    names = ["/cam1/image", "/tf", "/left", "/a/b", "/scan/x"]
    assert typing_errors(names, ["/cam2/image", "/tg", "/right", "/a/c", "/scan"]) == {}


def test_in_a_long_word_a_letter_may_have_moved():
    assert typing_errors(["/ignd_box"], ["/ding_box"]) == {}
    assert typing_errors(["/diagnotisc"], ["/diagnostics"]) == {"/diagnotisc": ["/diagnostics"]}
    assert typing_errors(["/image_wra"], ["/image_raw", "/image_war"]) == {"/image_wra": ["/image_war", "/image_raw"]}


def test_a_star_in_a_name_is_no_word():
    assert typing_errors(["a/b"], ["a/*"]) == {}
    assert typing_errors(["*/state"], ["*/stat"]) == {"*/state": ["*/stat"]}


def test_a_long_number_at_the_end_is_meant():
    codes = ("ROS101", "ROS979", "MQTT517")
    assert nearest("ROS9999", codes) is None
    assert nearest("ROS978", codes) is None
    assert nearest("RSO979", codes) == "ROS979"
    assert nearest("ros1O1", codes) == "ROS101"
    assert nearest("ROS", codes) == "ROS101"
    assert nearest("fastdds_2_8", ("fastdds_2_9",)) == "fastdds_2_9"
