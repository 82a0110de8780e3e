"""Values filed under patterns are those whose pattern matches, as if every pattern were tried."""

from fnmatch import fnmatchcase

from hypothesis import given
from hypothesis import strategies as st

from cqos_core.language.name_index import NameIndex

NAMES = st.text("ab/*?[]!", max_size=6)


@given(st.lists(NAMES, max_size=8), st.lists(NAMES, max_size=3))
def test_finds_what_matches_any_name(patterns, names):
    index = NameIndex((pattern, number) for number, pattern in enumerate(patterns))
    expected = [
        number
        for number, pattern in enumerate(patterns)
        if any(pattern == name or fnmatchcase(name, pattern) for name in names)
    ]
    assert index.matching(*names) == expected
    assert list(index) == list(range(len(patterns)))
    assert bool(index) == bool(patterns)


def test_patterns_begin_or_end_with_plain_text():
    index = NameIndex([("/robot/*", 1), ("*/scan", 2), ("*", 3), ("/robot/scan", 4), ("/b[ao]t", 5), ("*[xy]", 6)])
    assert index.matching("/robot/scan") == [1, 2, 3, 4]
    assert index.matching("/bot", "/x") == [3, 5, 6]
