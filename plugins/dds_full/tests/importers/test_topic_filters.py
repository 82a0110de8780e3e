"""What two filters of topic names let through together, compared with matching each of them."""

import fnmatch
import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.model.re2_patterns import any_name_matcher
from cqos_dds.importers.topic_filters import expressions, in_both, patterns

NAMES = ["".join(each) for length in range(1, 5) for each in itertools.product("ab.", repeat=length)]
PIECES = st.sampled_from(["a", "b", ".", "?", "*", "[ab]", "[!a]", "[a-b]", "[", "[]a]", "[!]]", "[b-a]", "[a-]"])
FILTERS = st.lists(st.lists(PIECES, min_size=1, max_size=4).map("".join), min_size=1, max_size=2)


def lets_through(filters, name):
    return any(fnmatch.fnmatchcase(name, each) for each in filters)


@given(FILTERS, FILTERS)
def test_a_name_passes_both_exactly_if_it_passes_each(first, second):
    both = in_both(*(patterns(",".join(each)) for each in (first, second)))
    assert both is not None
    passes = any_name_matcher(expressions(both))
    expected = [name for name in NAMES if lets_through(first, name) and lets_through(second, name)]
    assert [name for name in NAMES if passes(name)] == expected


@given(FILTERS)
def test_an_expression_takes_what_its_pattern_takes(filters):
    passes = any_name_matcher(expressions(patterns(",".join(filters))))
    assert [name for name in NAMES if passes(name)] == [name for name in NAMES if lets_through(filters, name)]


@pytest.mark.parametrize(
    ("first", "second", "both"),
    [
        ("C*", "*d", ("C.*d",)),
        ("Sensor*", "Sensor?", (r"Sensor.",)),
        ("[CS]*", "[CS]*", ("[CS].*",)),
        ("a", "b", ()),
    ],
)
def test_it_is_again_a_list_of_patterns(first, second, both):
    found = in_both(patterns(first), patterns(second))
    assert found is not None
    assert expressions(found) == both


@pytest.mark.parametrize(
    ("first", "second"),
    [("*" + "a*" * 12, "*" + "b*" * 12), ("a" * 500, "b" * 500), ("*" + "a" * 200, "a" * 200 + "*")],
)
def test_of_too_many_parts_nothing_is_known(first, second):
    assert in_both(patterns(first), patterns(second)) is None


def test_long_lists_are_known():
    names = ",".join(f"Topic{number}" for number in range(2000))
    for other in ("*", names):
        both = in_both(patterns(names), patterns(other))
        assert both is not None
        assert len(both) == 2000
