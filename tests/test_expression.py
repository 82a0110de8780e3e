"""The sentences as text: what is written is what is read, and nothing else is."""

import gc
import sys
import time
from copy import copy
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.language.expression import (
    CONDITION_FUNCTIONS,
    HOLDS,
    SCOPES,
    VALUE_FUNCTIONS,
    Apply,
    Condition,
    Literal,
    Node,
    Term,
    Test,
    all_equal,
    any_of,
    call,
    ceil,
    count,
    define,
    definitions,
    first,
    greatest,
    in_,
    least,
    matches,
    offered,
    option,
    overlaps,
    own,
    requested,
    stated,
    stated_here,
    topic,
    total,
    unfolded,
)
from cqos_core.language.parser import MAXIMUM_TEXT, parse, parse_value
from cqos_core.model.problems import ConditionError
from tests.made_up_protocol import CARE, COPIES, DELAY, INTERVAL, RULES, SEALED, STAMP, STREETS

# The manual: how a sentence is built, and how it is written

BUILT = [
    (offered(CARE) >= requested(CARE), "offered(care) >= requested(care)"),
    (CARE == "signed", 'care == "signed"'),
    (COPIES < 5, "copies < 5"),
    (COPIES != -5, "copies != -5"),
    (SEALED == True, "sealed == True"),  # noqa: E712 - `==` is the language's
    (DELAY <= topic(INTERVAL), "delay <= topic(interval)"),
    (offered("reader_limits.max_samples") > 0, "offered(reader_limits.max_samples) > 0"),
    (own("a.b.c") == own("d"), "a.b.c == d"),
    (SEALED & (CARE > "plain"), 'sealed & (care > "plain")'),
    (~SEALED | topic("urgent"), "~sealed | topic(urgent)"),
    (~(CARE > "plain"), '~(care > "plain")'),
    ((CARE > "plain") & (COPIES > 1) & SEALED, '(care > "plain") & (copies > 1) & sealed'),
    ((CARE > "plain") & (SEALED & (COPIES > 1)), '(care > "plain") & (sealed & (copies > 1))'),
    (SEALED | topic("urgent") & (COPIES > 1), "sealed | (topic(urgent) & (copies > 1))"),
    (COPIES + 1 + 2 > 3, "copies + 1 + 2 > 3"),
    (COPIES + (COPIES + 1) > 3, "copies + (copies + 1) > 3"),
    (2 * DELAY + "1s" > topic(INTERVAL), '2 * delay + "1s" > topic(interval)'),
    (2 * (DELAY + "1s") > topic(INTERVAL), '2 * (delay + "1s") > topic(interval)'),
    (COPIES * (COPIES * 2) > 9, "copies * (copies * 2) > 9"),
    (least(COPIES, 5) + greatest(COPIES, 1, 2) > 3, "min(copies, 5) + max(copies, 1, 2) > 3"),
    (ceil(DELAY, topic(INTERVAL)) + 1 > COPIES, "ceil(delay, topic(interval)) + 1 > copies"),
    (first(STREETS) == "Elm", 'first(streets) == "Elm"'),
    (in_(CARE, "plain", "signed"), 'in_(care, "plain", "signed")'),
    (overlaps(offered(STREETS), requested(STREETS)), "overlaps(offered(streets), requested(streets))"),
    (matches(STAMP, "rt/*"), 'matches(stamp, "rt/*")'),
    (stated(CARE) & ~stated(DELAY, "0"), 'stated(care) & ~stated(delay, "0")'),
    (stated_here(requested(DELAY)), "stated_here(requested(delay))"),
    (~all_equal(offered(CARE)), "~all_equal(offered(care))"),
    (any_of(offered(SEALED)), "any_of(offered(sealed))"),
    (count(offered(COPIES) > 1) == 2, "count(offered(copies) > 1) == 2"),
    (total(offered(COPIES), offered(SEALED)) < 7, "total(offered(copies), offered(sealed)) < 7"),
    (call("is_filter", STAMP, "a/#"), 'is_filter(stamp, "a/#")'),
    (option("carrier") == 'the "fast" one', r'option(carrier) == "the \"fast\" one"'),
    (STAMP == "back\\slash\ttab\nline", r'stamp == "back\\slash\ttab\nline"'),
    (STAMP == "天気 é", r'stamp == "\u5929\u6c17 \xe9"'),
]


@pytest.mark.parametrize(("sentence", "text"), BUILT, ids=[text for _, text in BUILT])
def test_a_sentence_is_written_as_python_would_write_it_and_read_back(sentence, text):
    assert str(sentence) == text
    assert parse(text) == sentence
    assert hash(parse(text)) == hash(sentence)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("(care) >= (requested(care))", "care >= requested(care)"),
        ("  copies>5  ", "copies > 5"),
        ("copies > 1_000", "copies > 1000"),
        ("copies > 0x10", "copies > 16"),
        ("care == 'signed'", 'care == "signed"'),
        ("(copies > 1\n  ) & (\n copies < 9)", "(copies > 1) & (copies < 9)"),
        ("~~sealed", "~~sealed"),
        ("sealed | urgent & late", "sealed | (urgent & late)"),
        ("(sealed | urgent) & late", "(sealed | urgent) & late"),
        ("~sealed & late", "~sealed & late"),
        ("~(sealed & late)", "~(sealed & late)"),
        ("a | b | c", "a | b | c"),
        ("a | (b | c)", "a | (b | c)"),
        ("a + b * c > d", "a + b * c > d"),
        ("(a + b) * c > d", "(a + b) * c > d"),
        ("a * b * c > d", "a * b * c > d"),
    ],
)
def test_layout_is_free_and_precedence_is_that_of_python(written, meant):
    assert str(parse(written)) == meant


def test_and_binds_tighter_than_a_comparison_so_parentheses_are_asked_for():
    with pytest.raises(
        ConditionError, match=r"`b & c` is a condition where a value is expected; put each comparison .* in parentheses"
    ):
        parse("a > b & c")


# The law, over the whole language

names = st.lists(st.from_regex(r"[a-z][a-z0-9_]{0,6}", fullmatch=True), min_size=1, max_size=3).map(".".join)
reserved = set(SCOPES) | set(VALUE_FUNCTIONS) | set(CONDITION_FUNCTIONS)
keywords = {"and", "as", "assert", "async", "await", "break", "class", "continue", "def", "del", "elif", "else"} | {
    *("except", "finally", "for", "from", "global", "if", "import", "in", "is", "lambda", "nonlocal", "not", "or"),
    *("pass", "raise", "return", "try", "while", "with", "yield"),
}
names = names.filter(lambda name: not keywords & set(name.split(".")))
texts = st.text(st.characters() | st.sampled_from("\"'\\\n\r\t\0\x1b\x85\u2028\ufeff{}#天🚜\ud800"), max_size=8)
literals = st.one_of(texts, st.integers(-(2**70), 2**70), st.booleans()).map(Literal)
terms = st.builds(Term, st.sampled_from(SCOPES), names)


def larger_operands(inner):
    some = st.lists(inner, min_size=2, max_size=3)
    return st.one_of(
        st.builds(Apply, st.sampled_from("+*"), inner, inner),
        st.builds(lambda name, args: Apply(name, *args), st.sampled_from(["min", "max"]), some),
        st.builds(lambda a, b: Apply("ceil", a, b), inner, inner),
        st.builds(lambda a: Apply("first", a), inner),
    )


operands = st.recursive(terms | literals, larger_operands, max_leaves=6)
flags = st.recursive(terms, larger_operands, max_leaves=3)  # a constant by itself says nothing
functions = names.filter(lambda name: "." not in name and name not in reserved)
comparisons = st.builds(Test, st.sampled_from(["<", "<=", "==", "!=", ">=", ">"]), operands, operands)
tests = st.one_of(
    st.builds(lambda args: Test("in_", *args), st.lists(operands, min_size=2, max_size=4)),
    st.builds(Test, st.sampled_from(["overlaps", "matches"]), operands, operands),
    st.builds(lambda term: Test("stated", term), terms),
    st.builds(lambda term, word: Test("stated", term, Literal(word)), terms, texts),
    st.builds(lambda term: Test("stated_here", term), terms),
    st.builds(lambda term: Test("all_equal", term), operands),
    st.builds(lambda name, args: Test(name, *args), functions, st.lists(operands, max_size=3)),
)


def larger_sentences(inner):
    counted = st.one_of(
        st.builds(lambda s: Apply("count", s), inner),
        st.builds(lambda a: Apply("total", a), operands),
        st.builds(lambda a, s: Apply("total", a, s), operands, inner),
    )
    return st.one_of(
        st.builds(Test, st.sampled_from("&|"), inner, inner),
        st.builds(lambda s: Test("~", s), inner),
        st.builds(lambda s: Test("any_of", s), inner),
        st.builds(Test, st.sampled_from(["<", "=="]), counted, operands),
        st.builds(lambda flag: Test(HOLDS, flag), counted),
    )


sentences = st.recursive(
    comparisons | tests | st.builds(lambda flag: Test(HOLDS, flag), flags), larger_sentences, max_leaves=8
)


@given(sentences)
def test_what_is_written_is_what_is_read(sentence):
    read = parse(str(sentence))
    assert read == sentence
    assert read.key == sentence.key
    assert str(read) == str(sentence)


def with_names(node, draw, found):
    """The node with names for some of its parts."""
    bare = copy(node)
    bare.args = tuple(with_names(arg, draw, found) for arg in node.args)
    if isinstance(node, Literal) or not draw(st.booleans()):
        return bare
    found.append(define(f"definition_{len(found)}", bare))
    return found[-1]


@given(sentences, st.data())
def test_definitions_are_read_with_the_definitions_of_the_pack(sentence, data):
    found: list[Node] = []
    named = with_names(sentence, data.draw, found)
    assert named == sentence
    assert set(definitions(named)) == {str(each) for each in found}
    read = parse(str(named), definitions(named))
    assert (read.key, str(read)) == (sentence.key, str(named))
    for each in found:
        read_part = parse if isinstance(each, Condition) else parse_value
        assert read_part(each.text(), definitions(named)).key == each.key
    assert str(unfolded(named)) == str(sentence)


def test_a_definition_prints_its_name_and_means_what_it_names():
    resending = define("resending", COPIES * 2 + 1)
    late = define("late", (DELAY > "1s") & (resending > 5))
    assert str(~late | (resending * 2 < 9)) == "~late | (resending * 2 < 9)"
    assert late.text() == '(delay > "1s") & (resending > 5)'
    assert list(definitions(~late)) == ["late", "resending"]
    assert ~late == ~((DELAY > "1s") & (COPIES * 2 + 1 > 5))
    assert str(unfolded(resending * 2)) == "(copies * 2 + 1) * 2"


@pytest.mark.parametrize("name", ["", "Late", "late.again", "not", "2nd", "late again"])
def test_a_name_that_cannot_be_read_back_is_refused(name):
    with pytest.raises(ConditionError, match="names no definition: use snake_case"):
        define(name, DELAY > "1s")


@given(sentences, sentences)
def test_sentences_are_equal_by_what_they_say(one, other):
    assert (one == other) == (str(one) == str(other))
    assert one != "text"


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.code)
def test_the_rules_of_a_pack_have_a_text_form(rule):
    assert parse(str(rule.condition)) == rule.condition


# What the language is not

FOREIGN = [
    ("care.upper() == 'X'", "`care.upper()` is not part of the language", 0),
    ("(lambda: 1) == care", "is not part of the language", 1),
    ("1 < copies < 5", "write two comparisons joined by &", 0),
    ('care == "insured" & copies == 1', "put each comparison beside & or | in parentheses", 0),
    ('copies == 1 | care == "insured" & sealed', "put each comparison beside & or | in parentheses", 0),
    ('care == "insured" & sealed', "put each comparison beside & or | in parentheses", 8),
    ("care == set-free", 'a value stands in quotes: "set-free"', 8),
    ("max-copies > 1", "names have `_` where others have `-`: `max_copies`", 0),
    ("offered(max-copies) > 1", "names have `_` where others have `-`: `max_copies`", 0),
    ("(a > 1) and (b > 2)", "use & and |", 0),
    ("a or b", "use & and |", 0),
    ("not sealed", "use ~(…) instead of `not`", 0),
    ("copies > 1.5", "write whole numbers, and durations as text with a unit", 9),
    ("copies > 1e3", "write whole numbers", 9),
    ("copies > 1j", "`1j` is not part of the language", 9),
    ("stamp == f'{x}'", "is not part of the language", 9),
    ("stamp == b'x'", "is not part of the language", 9),
    ("stamp == None", "`None` is not part of the language", 9),
    ("(a := 1) == b", "`a := 1` is not part of the language", 1),
    ("[a for a in b]", "is not part of the language", 0),
    ("{a: 1}", "is not part of the language", 0),
    ("(a, b) == c", "is not part of the language", 0),
    ("streets[0] == 'Elm'", "`streets[0]` is not part of the language", 0),
    ("a if b else c", "is not part of the language", 0),
    ("a - 1 > b", "`a - 1` is not part of the language", 0),
    ("a / 2 > b", "`a / 2` is not part of the language", 0),
    ("a ** 2 > b", "is not part of the language", 0),
    ("a ^ b", "`a ^ b` is not part of the language", 0),
    ("a << 1 > b", "is not part of the language", 0),
    ("a @ b", "is not part of the language", 0),
    ("a in b", "`a in b` is not part of the language", 0),
    ("a is b", "is not part of the language", 0),
    ("-a > b", "`-a` is not part of the language", 0),
    ("-True == a", "`-True` is not part of the language", 0),
    ("-False == a", "`-False` is not part of the language", 0),
    ("+1 == a", "`+1` is not part of the language", 0),
    ("min(a, b, key=c) > 1", "is not part of the language", 0),
    ("min(*a) > 1", "`min` does not take 1 arguments", 0),
    ("min(a, *b) > 1", "`*b` is not part of the language", 7),
    ("__import__('os').system('x')", "is not part of the language", 0),
    ("first.second(a)", "is not part of the language", 0),
    ("a(1)(2)", "is not part of the language", 0),
    ("'x'.y == a", "expected a policy name", 0),
    ("await a", "is not part of the language", 0),
    ("...", "`...` is not part of the language", 0),
    ("5", "`5` is no condition: compare it with something", 0),
    ('"text"', '`"text"` is no condition', 0),
    ("True & a", "`True` is no condition", 0),
    ("(a & b) > c", "`a & b` is a condition where a value is expected", 1),
    ("(a > b) + 1 > c", "`a > b` is a condition where a value is expected", 1),
    ("min(a > b, c) > d", "`a > b` is a condition where a value is expected", 4),
    ("count(5) > 1", "`5` is no condition", 6),
    ("offered(care, delay) > 1", "`offered` takes one policy name", 0),
    ("offered('care') > 1", "`offered` takes one policy name", 0),
    ("offered(offered(care)) > 1", "`offered` takes one policy name", 0),
    ("ceil(a) > 1", "`ceil` does not take 1 arguments", 0),
    ("first(a, b) == 'x'", "`first` does not take 2 arguments", 0),
    ("in_(a)", "`in_` does not take 1 arguments", 0),
    ("stated()", "`stated` does not take 0 arguments", 0),
    ("overlaps(a, b, c)", "`overlaps` does not take 3 arguments", 0),
]


@pytest.mark.parametrize(("text", "message", "offset"), FOREIGN, ids=[text for text, _, _ in FOREIGN])
def test_everything_else_is_refused_with_its_place(text, message, offset):
    with pytest.raises(ConditionError) as refused:
        parse(text)
    assert message in str(refused.value)
    assert (refused.value.text, refused.value.offset) == (text, offset)


@pytest.mark.parametrize(
    "text", ["", "   ", "a >", "(a", "a)", "a b", "yield a", "a = 1", "a; b", "x = [", "import os", "a\nb"]
)
def test_what_is_no_python_is_no_condition(text):
    with pytest.raises(ConditionError, match="not valid syntax"):
        parse(text)


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("care = 'insured'", "compare with `==`"),
        ("sealed && late", "write `&` and `|` once"),
        ("sealed || late", "write `&` and `|` once"),
        ("delay > 5s", 'a duration stands in quotes, for instance "5s"'),
        ("delay > 1.5h", 'a duration stands in quotes, for instance "5s"'),
        ("delay > 500ms", 'a duration stands in quotes, for instance "5s"'),
    ],
)
def test_syntax_of_other_languages_is_refused_with_advice(text, advice):
    with pytest.raises(ConditionError, match="not valid syntax") as refused:
        parse(text)
    assert advice in str(refused.value)


@pytest.mark.parametrize("text", ["care == '5s' 'b = c' )", "care == '&&' )", 'care == "a || b" )'])
def test_text_in_quotes_asks_for_no_advice(text):
    with pytest.raises(ConditionError) as refused:
        parse(text)
    assert str(refused.value).count("; ") == 0


def test_a_value_that_has_the_name_of_a_definition_asks_for_quotes():
    with pytest.raises(
        ConditionError, match='`late` is a condition where a value is expected; a value stands in quotes: "late"'
    ):
        parse("care == late", {"late": define("late", DELAY > "1s")})


@pytest.mark.parametrize(
    ("text", "points_at"),
    [
        ('(stamp == "天気é") & (b - c)', "b - c"),
        ("   (a > 1) & (b - c)", "b - c"),
        ("(a > 1\n) & (\n  b - c)", "b - c"),
        ('(stamp == "天気é\t") & (\r\n  b - c > "🚜")', "b - c"),
        ("  (a == 'é') & )", ")"),
        ("(a\n & (b\n > ))", "))"),
    ],
)
def test_places_are_counted_in_characters_of_the_text_as_given(text, points_at):
    with pytest.raises(ConditionError) as refused:
        parse(text)
    assert refused.value.text == text
    assert text[refused.value.offset :].startswith(points_at)


TOO_MUCH = {
    "minus": "a - " * 2400 + "a > 1",
    "plus": "a + " * 2400 + "a > 1",
    "and": "a & " * 2400 + "a",
    "parentheses": "(" * 4900 + "a" + ")" * 4900,
    "not": "~" * 9900 + "a",
    "words not": "not " * 2400 + "a",
    "signs": "-" * 9900 + "1",
    "dots": "a" + ".b" * 4900 + " == 1",
    "calls": "min(" * 1600 + "a" + ")" * 1600,
    "called": "a" + "()" * 4900,
    "lists": "[" * 90 + "a" + "]" * 90,
    "open": "[" * 9900,
    "else": "a if a else " * 800 + "a",
    "lambda": "lambda:" * 1400 + "a",
    "powers": "a**" * 3000 + "a",
    "chained": "a<" * 4900 + "a",
    "tuple": "(" + "a," * 4900 + ")",
    "digits": "9" * 9900 + " == a",
    "zeros": "1" + "0" * 4200 + " ** 9 == a",
    "text": '"' + "x" * 9900 + '"',
    "f-string": 'f"' + "{a}" * 3000 + '"',
    "subscripts": "a" + "[0]" * 3000,
    "null": "a\0b",
    "surrogate": "a == '\ud800' + 1 - 2",
}


@pytest.mark.parametrize("text", TOO_MUCH.values(), ids=TOO_MUCH)
def test_no_text_is_too_much(text):
    gc.disable()  # the garbage of all other tests is no work of the parser
    try:
        started = time.process_time()
        with pytest.raises(ConditionError) as refused:
            parse(text)
        assert time.process_time() - started < 1
    finally:
        gc.enable()
    assert len(str(refused.value)) < 2 * MAXIMUM_TEXT + 500


def test_a_long_text_is_not_even_looked_at():
    with pytest.raises(ConditionError, match="a condition has at most 10,000 characters, this one has 10,001"):
        parse("a" * (MAXIMUM_TEXT + 1))


def test_a_sentence_may_be_sixty_levels_deep():
    assert str(parse(" & ".join(["a"] * 60))) == " & ".join(["a"] * 60)
    with pytest.raises(ConditionError, match="nested deeper than 60 levels"):
        parse(" & ".join(["a"] * 62))


@given(st.text(st.sampled_from("ab.()&|~+*<>=!\"' 01,[]{}:-\n\\é\0 ifnotld"), max_size=60) | st.text(max_size=40))
def test_any_text_is_a_sentence_or_a_refusal(text):
    try:
        read = parse(text)
    except ConditionError as error:
        offset = error.offset
    else:
        offset = None
        assert parse(str(read)) == read
    assert offset is None or 0 <= offset <= len(text)


def test_reading_leaves_the_recursion_limit_alone():
    limit = sys.getrecursionlimit()
    with pytest.raises(ConditionError):
        parse("~" * 3000 + "a")
    assert sys.getrecursionlimit() == limit


# Sentences are no truth values, and hold nothing but themselves


@pytest.mark.parametrize(
    "use",
    [
        lambda: bool(CARE >= "plain"),
        lambda: bool(CARE),
        lambda: not (CARE >= "plain"),
        lambda: (CARE >= "plain") and (COPIES > 1),
        lambda: (CARE >= "plain") or (COPIES > 1),
        lambda: 1 < COPIES < 5,
        lambda: [COPIES].count(CARE),
        lambda: 1 if CARE == "plain" else 2,
    ],
    ids=["bool", "bool of a policy", "not", "and", "or", "chained", "count", "if"],
)
def test_a_sentence_has_no_truth_value(use):
    with pytest.raises(ConditionError, match="no truth value of its own"):
        use()


copies: Any = COPIES  # of no type, so that every misuse can be written down
sealed: Any = SEALED
anything: Any = any_of
one_of: Any = in_

MISUSES = {
    "float": lambda: copies > 1.5,
    "none": lambda: copies == None,  # noqa: E711 - `==` is the language's
    "float sum": lambda: copies + 1.5,
    "bytes": lambda: one_of(copies, b"plain"),
    "list": lambda: copies == ["a"],
    "and true": lambda: (copies > 1) & True,
    "or text": lambda: (copies > 1) | "text",
    "and none": lambda: sealed & None,
    "any of text": lambda: anything("text"),
    "min of one": lambda: least(copies),
    "in nothing": lambda: in_(copies),
}


@pytest.mark.parametrize("build", MISUSES.values(), ids=MISUSES)
def test_what_cannot_stand_in_a_sentence_is_refused_when_it_is_built(build):
    with pytest.raises(ConditionError):
        build()


def test_walking_visits_every_part():
    sentence = ~(offered(CARE) >= "signed") & any_of(requested(SEALED))
    assert [node.name for node in sentence.walk()] == [
        *("&", "~", ">=", "care", "constant", "any_of", HOLDS, "sealed"),
    ]
    assert repr(sentence.args[1]) == "<Test any_of(requested(sealed))>"
