"""Topic names and filters: the tables of the standard, laws, and that a hundred thousand of each take a moment."""

import time
from itertools import product

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cqos_mqtt.filters import (
    LONGEST,
    Trie,
    has_wildcards,
    intersect,
    match,
    matches,
    share,
    wrong_with_filter,
    wrong_with_name,
)
from cqos_mqtt.folding import finder, reaches

# MQTT 3.1.1 and 5.0, 4.7: what stands in the text of the standard, and what follows from it.
MATCHING = [
    ("sport/tennis/player1/#", "sport/tennis/player1"),
    ("sport/tennis/player1/#", "sport/tennis/player1/ranking"),
    ("sport/tennis/player1/#", "sport/tennis/player1/score/wimbledon"),
    ("sport/#", "sport"),
    ("sport/+", "sport/"),
    ("sport/+", "sport/x"),
    ("+/+", "/finance"),
    ("/+", "/finance"),
    ("+", "finance"),
    ("#", "a"),
    ("#", "/"),
    ("+/#", "a"),
    ("a//b", "a//b"),
    ("a/+/b", "a//b"),
    ("$SYS/#", "$SYS/x"),
    ("$SYS/+", "$SYS/x"),
    ("a/#", "a/$b"),
    ("a/+", "a/$b"),
    ("$share/g/a/+", "a/b"),
    ("Accounts payable/ü", "Accounts payable/ü"),
]
APART = [
    ("sport/tennis/player1/#", "sport/tennis"),
    ("sport/+", "sport"),
    ("sport/+", "sport/x/y"),
    ("+", "/finance"),
    ("+", "$x"),
    ("#", "$SYS/x"),
    ("+/monitor/Clients", "$SYS/monitor/Clients"),
    ("$SYS/#", "sys/x"),
    ("a", "A"),
    ("/a", "a"),
    ("a/", "a"),
    ("a/#", "ab"),
    ("$share/g/a/+", "$share/g/a/b"),
    ("ACCOUNTS", "Accounts"),
]


@pytest.mark.parametrize(("written", "name"), MATCHING)
def test_a_filter_matches(written, name):
    assert matches(written, name)


@pytest.mark.parametrize(("written", "name"), APART)
def test_a_filter_does_not_match(written, name):
    assert not matches(written, name)


@pytest.mark.parametrize(
    ("one", "other", "met"),
    [
        ("a/+", "+/b", True),
        ("a/#", "a", True),
        ("a/#", "+", True),
        ("a/+/c", "a/b", False),
        ("+/b", "a/c", False),
        ("#", "$SYS/#", False),
        ("+/x", "$SYS/x", False),
        ("$SYS/+", "$SYS/#", True),
        ("a/#", "b/#", False),
        ("a/+/#", "a", False),
        ("a/+/#", "a/b", True),
        ("farm/+/weather", "farm/north/+", True),
        ("$share/g/a/+", "a/b", True),
    ],
)
def test_two_filters_have_a_topic_in_common(one, other, met):
    assert intersect(one, other) is met
    assert intersect(other, one) is met


@pytest.mark.parametrize(
    ("written", "expected"),
    [("$share/g/a/b", ("g", "a/b")), ("$share/g", ("g", "")), ("a/b", None), ("$shared/x", None)],
)
def test_a_share_is_taken_apart(written, expected):
    assert share(written) == expected


@pytest.mark.parametrize("name", ["a", "/", "a b", "$SYS/x", "a" * LONGEST, "ü" * (LONGEST // 2)])
def test_a_valid_name_is_a_valid_filter(name):
    assert wrong_with_name(name) is None
    assert wrong_with_filter(name) is None


@pytest.mark.parametrize("text", ["", "a\0", "a" * (LONGEST + 1), "ü" * (LONGEST // 2 + 1), "a\ud800"])
def test_what_is_neither(text):
    assert wrong_with_name(text)
    assert wrong_with_filter(text)


# Few levels and few words, so that much of it meets.
LEVELS = st.sampled_from(["a", "b", "", "$x"])
names = st.lists(LEVELS, min_size=1, max_size=4).map("/".join).filter(bool)
filters = st.builds(
    lambda levels, rest: "/".join([*levels, *(["#"] if rest else [])]),
    st.lists(LEVELS | st.just("+"), min_size=0, max_size=4),
    st.booleans(),
).filter(bool)


@given(st.sets(filters, max_size=12), names)
def test_the_trie_finds_what_matches(held, name):
    assert sorted(Trie(held).matching(name)) == sorted(each for each in held if matches(each, name))


@example({"/#", "+", "$share/g/+"}, "/#")
@given(st.sets(filters, max_size=12), filters)
def test_the_trie_finds_what_two_filters_have_in_common(held, pattern):
    assert sorted(Trie(held).intersecting(pattern)) == sorted(each for each in held if intersect(each, pattern))


ALL_NAMES = [
    "/".join(levels)
    for length in range(1, 6)
    for levels in product(("a", "b", "", "$x", "c"), repeat=length)
    if levels != ("",)
]


@example("/#", "+")
@given(filters, filters)
def test_two_filters_meet_where_a_name_matches_both(one, other):
    both = any(matches(one, name) and matches(other, name) for name in ALL_NAMES)
    assert intersect(one, other) is both


@given(st.sets(names | filters, max_size=8), st.sets(filters, max_size=8))
def test_pairs_are_those_of_different_keys_that_meet(published, subscribed):
    expected = {
        (name, written)
        for name in published
        for written in subscribed
        if name != written and (intersect(name, written) if has_wildcards(name) else matches(written, name))
    }
    found = list(match(published, subscribed))
    assert len(found) == len(set(found))
    assert set(found) == expected


def test_a_hundred_thousand_filters_and_as_many_names_take_seconds():
    published = [f"site{n % 10}/hall{n % 100}/machine{n}/value" for n in range(100_000)]
    subscribed = [f"site{n % 10}/+/machine{n}/#" for n in range(99_990)] + [f"site{n}/#" for n in range(10)]
    began = time.process_time()
    assert sum(1 for _ in match(published, subscribed)) == 99_990 + 100_000
    # One by one it would take hours, so the bound may be generous to slow machines.
    assert time.process_time() - began < 30


@given(st.sets(filters.filter(reaches), max_size=12), names)
def test_a_fleet_finds_the_filters_that_match(held, name):
    assert sorted(finder(held)(name)) == sorted(each for each in held if matches(each, name))


@given(filters | names)
def test_a_filter_that_reaches_no_other_topic_matches_its_own_name_only(written):
    if not reaches(written):
        assert all(matches(written, name) == (name == written) for name in ("a", "a/b", "/a", "$x", written))
