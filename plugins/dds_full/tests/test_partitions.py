"""Partitions, beside the cases of DDS403: laws, and what the cases do not reach."""

import fnmatch

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_dds.implementations import IMPLEMENTATION
from cqos_dds.partitions import OTHERS, as_cyclone_dds_does, as_opendds_does, as_the_standard_says, meet

lists = st.lists(st.text("ab*?[]!-\\+/.", max_size=4), max_size=3).map(tuple)
names = st.lists(st.text("abAB/._ -", max_size=4), max_size=3).map(tuple)


@given(lists, lists)
def test_both_ends_are_treated_alike(writer, reader):
    for judge in (as_the_standard_says, *OTHERS.values()):
        assert judge(writer, reader) == judge(reader, writer), judge.__name__


@given(names, names)
def test_names_without_wildcards_meet_by_equality(writer, reader):
    wanted = bool(set(writer or ("",)) & set(reader or ("",)))
    for judge in (as_the_standard_says, as_cyclone_dds_does, as_opendds_does):
        assert judge(writer, reader) is wanted, judge.__name__


@given(lists, lists)
def test_a_further_name_never_keeps_apart(writer, reader):
    for judge in (as_the_standard_says, *OTHERS.values()):
        if writer and judge(writer, reader):
            assert judge((*writer, "a"), reader), judge.__name__


@given(st.text("ab/.", max_size=5), st.text("ab*?/.", max_size=5).filter(lambda text: "*" in text or "?" in text))
def test_an_expression_is_a_shell_pattern(name, expression):
    assert as_the_standard_says((name,), (expression,)) == fnmatch.fnmatchcase(name, expression)
    assert as_cyclone_dds_does((name,), (expression,)) == fnmatch.fnmatchcase(name, expression)


@pytest.mark.parametrize("name", IMPLEMENTATION.domain.names)  # type: ignore[attr-defined]
def test_an_implementation_is_looked_up_by_its_rank(name: str):
    rank = IMPLEMENTATION.domain.parse(name)
    assert isinstance(rank, int)
    assert meet(("a", "b*"), ("bc",), rank)
    assert meet(("a",), ("b",), rank) == (name == "rustdds")


def test_an_expression_that_is_none_matches_nothing():
    assert not OTHERS["dust"](("+a",), ("aa",))
