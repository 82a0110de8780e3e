"""Patterns mean what `fnmatch` says, with and without a regular expression."""

from fnmatch import fnmatchcase

from hypothesis import given
from hypothesis import strategies as st

from cqos_core.model.wildcards import fits


@given(st.text("ab/*", max_size=8), st.text("ab/*?[]!", max_size=6))
def test_fits_as_fnmatch(name, pattern):
    assert fits(name, pattern) == fnmatchcase(name, pattern)


def test_stars_do_not_overlap():
    assert not fits("aba", "*ab*ba")
    assert fits("abba", "*ab*ba")
    assert fits("", "*")
    assert not fits("a", "a*a")
