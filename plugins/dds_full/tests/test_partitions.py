"""Partitions, beside the cases of DDS403: laws, and what the cases do not reach."""

import ctypes
import fnmatch
import platform
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_dds.implementations import IMPLEMENTATION
from cqos_dds.partitions import (
    OTHERS,
    as_cyclone_dds_does,
    as_opendds_does,
    as_the_standard_says,
    meet,
    meet_many,
    posix,
)
from tests.growth.linear import assert_linear

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


@pytest.mark.parametrize("implementation", ["standard", *OTHERS])
@pytest.mark.parametrize("piece", ["*a", "a+", "?*", "*[ab]", "[!b]*"])
def test_the_cost_of_an_expression_of_many_wildcards_grows_with_its_length(implementation, piece):
    judge = OTHERS.get(implementation, as_the_standard_says)

    def compare(size: int) -> None:
        assert not judge(("a" * size + "b",), (piece * 60 + "c",)) or implementation == "rustdds"

    assert_linear(compare, 200)


@given(st.text("ab+[]>?(", max_size=4), st.text("ab*+[]>?(", max_size=6))
def test_a_plus_repeats_what_is_before_it_for_dust(name, expression):
    wanted = re.sub(r"(?:\\\+)+", "+", fnmatch.translate(expression))
    try:
        expected = name == expression or re.fullmatch(wanted, name) is not None
        assert OTHERS["dust"]((name,), (expression,)) >= expected
    except re.error:
        pass


CLASSES = ("alnum", "alpha", "blank", "cntrl", "digit", "graph", "lower", "print", "punct", "space", "upper", "xdigit")
parts = st.sampled_from(
    ["*", "?", "[", "]", "!", "^", "-", "a", "B", "1", "_", "[[:alpha:]]", "[![:digit:]_]", "[:alpha:]"]
)
FNM_NOESCAPE = 2
"""As the C library of Linux has it, and as Fast DDS calls it."""
glibc = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="what is compared with is the C library of Linux")


def matches_in_c(name: str, expression: str) -> bool:
    return bool(ctypes.CDLL(None).fnmatch(expression.encode(), name.encode(), FNM_NOESCAPE) == 0)


@glibc
@given(st.lists(parts, max_size=5).map("".join), st.text("aB1_[]!-^ ", max_size=4))
def test_expressions_match_as_in_the_library_that_fast_dds_calls(expression, name):
    assert posix(name, expression) == matches_in_c(name, expression)


@glibc
@pytest.mark.parametrize("name", [*CLASSES, "word"])
def test_a_class_has_the_characters_that_it_has_in_that_library(name: str):
    for code in range(1, 128):
        for expression in (f"[[:{name}:]]", f"[![:{name}:]]"):
            assert posix(chr(code), expression) == matches_in_c(chr(code), expression), (code, expression)


@pytest.mark.parametrize("implementation", IMPLEMENTATION.domain.names)  # type: ignore[attr-defined]
@given(st.lists(lists, min_size=1, max_size=6), st.lists(lists, min_size=1, max_size=6))
def test_many_lists_at_once_match_as_each_two_do(implementation, writers, readers):
    rank = IMPLEMENTATION.domain.parse(implementation)
    assert isinstance(rank, int)
    bits = {reader: 1 << at for at, reader in enumerate(dict.fromkeys(readers))}
    expected = [sum(bit for reader, bit in bits.items() if meet(writer, reader, rank)) for writer in writers]
    assert meet_many(writers, bits, rank) == expected
