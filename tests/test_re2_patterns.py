"""Regular expressions over names: what they match, what is refused, and that none takes long."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.model.re2_patterns import PatternError, name_matcher
from tests.growth.linear import assert_linear

MATCHING = [
    ("", "", True),
    ("/tf", "/tf", True),
    ("/tf", "/tf_static", False),
    ("/tf", "/robot/tf", False),
    (".*/pose", "/a/b/pose", True),
    ("[^/]+/temp", "barn/temp", True),
    ("[^/]+/temp", "barn/roof/temp", False),
    ("(?:/bot[0-9]+)?/scan", "/bot12/scan", True),
    ("(?P<robot>/a|/b)/x", "/b/x", True),
    ("/a|/b", "/b", True),
    ("x{2,3}", "xxx", True),
    ("x{2,3}", "x", False),
    ("x{2}", "xx", True),
    ("x{2,}", "xxxxx", True),
    ("x{0}", "", True),
    ("a+?b*?", "aab", True),
    (r"\d\w\.", "1a.", True),
    (r"^/a$", "/a", True),
    (r"a^b", "ab", False),
    (r"\A.\z", "é", True),
    (".", "\n", False),
    (r"[\]\-x]+", "]-x", True),
    ("(?i)/TF", "/tf", True),
    (r"/\p{L}+", "/é", True),
    ("[[:alpha:]_]+", "a_b", True),
    ("/a", "/\ud800", False),
]


@pytest.mark.parametrize(("text", "name", "expected"), MATCHING)
def test_a_whole_name_is_matched(text, name, expected):
    assert name_matcher(text)(name) is expected


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("(a", "missing )"),
        ("a)", "unexpected )"),
        ("*a", "no argument for repetition operator: *"),
        ("(?=a)", "invalid perl operator: (?="),
        (r"(a)\1", r"invalid escape sequence: \1"),
        ("[a", "missing ]"),
        ("[a-z&&[^b]]", "`&&` within a class of characters"),
        ("[a-z--b]", "`--` within a class of characters"),
        ("[^x[a]]", "`[` within a class of characters"),
        ("[z-a]", "invalid character class range: z-a"),
        ("a{3,2}", "invalid repetition size: {3,2}"),
        ("a{1001}", "invalid repetition size: {1001}"),
        ("((a{1000}){1000}){1000}", "invalid repetition size"),
        ("\\", "trailing \\"),
    ],
)
def test_what_cannot_be_read_is_refused_with_a_reason(text, why):
    with pytest.raises(PatternError, match=re.escape(why)):
        name_matcher(text)


@pytest.mark.parametrize("text", ["(a+)+b", "(a|a)*b", "(a*)*b", "(.*.*.*)*b", "(a?){30}a{30}b"])
def test_an_expression_is_matched_in_linear_time(text):
    def match(size: int) -> None:
        assert not name_matcher(text)("a" * size)

    assert_linear(match, 5_000)


PIECES = st.sampled_from(
    ["a", "b", "/", ".", "[ab]", "[^a]", "(a|b)", "(?:ab)", "a?", "b*", "/+", "(a*b)+", "a{1,2}", "|"]
)


@given(st.lists(PIECES, max_size=6).map("".join), st.text("ab/", max_size=6))
def test_it_matches_what_python_matches(text, name):
    assert name_matcher(text)(name) == (re.fullmatch(text, name) is not None)
