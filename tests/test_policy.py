"""Values: what is read, what is refused, and that printing and reading are inverse."""

import decimal
from random import Random

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.language import domains
from cqos_core.language.domains import Choice, Count, Duration, Flag, Names, Text, flow
from cqos_core.language.policy import Policy
from cqos_core.language.values import INFINITE, Anything, Depends, FromPeers, is_plain, normalise
from cqos_core.model.problems import InvalidValueError
from tests.growth.linear import assert_linear
from tests.made_up_protocol import CARE, COPIES, DELAY, STAMP, STREETS

SECOND = 1_000_000_000
NEVER = 2**63 - 1  # written out here: it is what other programs store


def refusal(domain, text):
    with pytest.raises(InvalidValueError) as refused:
        domain.parse(text)
    return refused.value


# Durations

DURATIONS = {
    "2s": 2 * SECOND,
    "500ms": SECOND // 2,
    "1.5h": 5400 * SECOND,
    "1 h 30 min": 5400 * SECOND,
    "1h30m": 5400 * SECOND,
    "10 us": 10_000,
    "10µs": 10_000,
    "10μs": 10_000,
    "1ns": 1,
    "0.000000001s": 1,
    "2 Seconds": 2 * SECOND,
    "1d": 86_400 * SECOND,
    "PT2S": 2 * SECOND,
    "pt1h30m": 5400 * SECOND,
    "PT0.5S": SECOND // 2,
    "P1DT1S": 86_401 * SECOND,
    "P2W": 14 * 86_400 * SECOND,
    "{sec: 2, nsec: 5}": 2 * SECOND + 5,
    "{sec: 2}": 2 * SECOND,
    "{nanosec: 7}": 7,
    "{sec: 0, nsec: 2000000000}": 2 * SECOND,
    "0": 0,
    "0s": 0,
    "0.0": 0,
    "infinite": NEVER,
    "Infinity": NEVER,
    ".inf": NEVER,
    "DURATION_INFINITY": NEVER,
    " never ": NEVER,
    # As much as can be represented, and more, is for ever.
    "9223372036854775806ns": NEVER - 1,
    "9223372036854775807ns": NEVER,
    "9223372036.854775807s": NEVER,
    "300 d 1000000 d": NEVER,
    "999999999999999999999999999999d": NEVER,
    "{sec: 99999999999999999999}": NEVER,
}


@pytest.mark.parametrize(("text", "nanoseconds"), DURATIONS.items(), ids=DURATIONS)
def test_durations_are_read_in_every_spelling(text, nanoseconds):
    assert Duration().parse(text) == nanoseconds


NO_DURATIONS = {
    "5": "`5` has no unit; expected a unit after it, for instance 5s or 5ms",
    "1.5": "`1.5` has no unit",
    "1e3": "`1e3` has no unit",
    "+5": "`+5` has no unit",
    "-2s": "`-2s` is negative",
    "- 0.5 s": "`- 0.5 s` is negative",
    "-1": "`-1` is negative",
    "NaN": "`NaN` is not a duration",
    "-inf": "`-inf` is not a duration",
    "0.5ns": "`0.5ns` is finer than a nanosecond; expected whole nanoseconds",
    "0.0000000001s": "is finer than a nanosecond",
    "1.000000000000000000000000000001s": "is finer than a nanosecond",
    "0.1 us 0.1ns": "is finer than a nanosecond",
    "PT0.0000000001S": "is finer than a nanosecond",
    "": "is not a duration",
    "soon": "`soon` is not a duration",
    "2 parsecs": "is not a duration",
    "1month": "is not a duration",
    "2\u017f": "is not a duration",  # a long s
    "s": "is not a duration",
    "1.2.3": "is not a number",
    ".": "is not a number",
    "P": "is not a duration",
    "PT": "is not a duration",
    "P1Y": "is not a duration",
    "{}": "is not a duration",
    "{sec: -1, nsec: 0}": "is no part of a duration",
    "{sec: 1.5}": "is no part of a duration",
    "{sec: [1]}": "is no part of a duration",
    "{sec: {sec: 1}}": "is no part of a duration",
    "{hours: 1}": "`hours: 1` is no part of a duration",
    "{sec: 1": "cannot be read",
    "{[a]: 1}": "cannot be read",
    "{sec: '\ud800'}": "cannot be read",
}


@pytest.mark.parametrize(("text", "message"), NO_DURATIONS.items(), ids=[ascii(text) for text in NO_DURATIONS])
def test_what_is_no_duration_is_refused_with_what_was_expected(text, message):
    error = refusal(Duration(), text)
    assert message in str(error)
    assert error.expected


@pytest.mark.parametrize(
    ("text", "nanoseconds"),
    {
        "5": 5 * SECOND,
        "1.5": 1_500_000_000,
        ".5": SECOND // 2,
        "1e-3": 1_000_000,
        "1e400": NEVER,
        "2ms": 2_000_000,
    }.items(),
)
def test_a_format_may_fix_the_unit_of_bare_numbers(text, nanoseconds):
    assert Duration(bare_unit="s").parse(text) == nanoseconds


@pytest.mark.parametrize(
    "text", ["1e-10", "1e-400", "1e-9999999", "0.0000000001", "0." + "1" * 5000, "1" * 5 + "." + "0" * 5000 + "1"]
)
def test_a_bare_number_finer_than_a_nanosecond_is_refused_too(text):
    assert "finer than a nanosecond" in str(refusal(Duration(bare_unit="s"), text))


def test_a_dialect_adds_its_unit_to_bare_numbers_only():
    assert [Duration().with_unit(text, "s") for text in ("5", "1.5", "5ms", "infinite", "{sec: 1}")] == [
        *("5s", "1.5s", "5ms", "infinite", "{sec: 1}"),
    ]
    assert Duration().with_unit("5", None) == "5"


def test_vendors_have_other_numbers_for_infinite():
    assert Duration(infinities=(2**31 * SECOND,)).parse("{sec: 2147483648, nsec: 0}") == NEVER
    assert Duration().parse("{sec: 2147483648, nsec: 0}") == 2**31 * SECOND


@given(st.integers(0, NEVER) | st.integers(0, 10**6).map(lambda seconds: seconds * SECOND))
def test_durations_are_printed_as_they_are_read(nanoseconds):
    printed = Duration().format(nanoseconds)
    assert Duration().parse(printed) == nanoseconds
    assert printed == "infinite" or len(printed) <= 21


@given(st.integers(0, 2**70), st.integers(0, 2**70), st.sampled_from(["ns", "us", "ms", "s", "min", "h", "d"]))
def test_durations_are_exact_or_infinite(whole, fraction, unit):
    """No float is in between: the oracle is a fraction."""
    from fractions import Fraction

    factor = {
        "ns": 1,
        "us": 10**3,
        "ms": 10**6,
        "s": SECOND,
        "min": 60 * SECOND,
        "h": 3600 * SECOND,
        "d": 86400 * SECOND,
    }
    text = f"{whole}.{fraction}{unit}"
    exact = Fraction(f"{whole}.{fraction}") * factor[unit]
    if exact.denominator != 1:
        assert "finer" in str(refusal(Duration(), text))
    else:
        assert Duration().parse(text) == min(exact, NEVER)


def test_the_decimal_settings_of_a_program_change_nothing():
    with decimal.localcontext() as context:
        context.prec = 3
        context.traps[decimal.Inexact] = True
        assert Duration().parse("1.23456789s") == 1_234_567_890
        assert Duration(bare_unit="s").parse("1.23456789") == 1_234_567_890


@pytest.mark.parametrize(
    ("start", "piece", "end"),
    [
        ("", "1", ""),
        ("", "1s", "!"),
        ("", "1 ", ""),
        ("", "a", ""),
        ("P", "1", ""),
        ("", "{", ""),
        ("", "[", ""),
        ("", "{a: ", ""),
    ],
    ids=["digits", "parts", "spaces", "letters", "iso", "braces", "brackets", "maps"],
)
def test_a_long_text_is_refused_in_linear_time(start, piece, end):
    def refuse(size: int) -> None:
        for domain in (Duration(), Count(), Flag(), Choice("a", "b")):
            refusal(domain, start + piece * size + end)

    assert_linear(refuse, 250_000 // len(piece))


@given(st.text(max_size=20) | st.text("0123456789.eE+-:{}[], nsecPTHMDWinfµ", max_size=20))
def test_any_text_is_a_value_or_is_refused(text):
    for domain in (Duration(), Duration(bare_unit="ms"), Count(0, 9), Flag(), Choice("a", "b"), Names(), Text()):
        try:
            value = domain.parse(text)
        except InvalidValueError:
            continue
        assert domain.parse(domain.format(value)) == value


# Choices

LADDER = Choice(
    "none", "sign", "sign_and_encrypt", affixes=("mode_", "_qos"), synonyms={"both": "sign_and_encrypt", "off": "none"}
)


@pytest.mark.parametrize(
    ("text", "name"),
    {
        "none": "none",
        "Sign": "sign",
        " SIGN_AND_ENCRYPT ": "sign_and_encrypt",
        "Sign and Encrypt": "sign_and_encrypt",
        "sign-and-encrypt": "sign_and_encrypt",
        "MODE_SIGN": "sign",
        "SIGN_QOS": "sign",
        "mode_sign_qos": "sign",
        "both": "sign_and_encrypt",
        "MODE_OFF": "none",
    }.items(),
)
def test_choices_are_read_in_every_spelling(text, name):
    assert LADDER.format(LADDER.parse(text)) == name


@pytest.mark.parametrize(("text", "near"), {"singn": "sign", "MODE_NOEN": "none", "encrypted": "", "x": ""}.items())
def test_a_misspelt_choice_is_refused_with_the_nearest_name(text, near):
    refused = refusal(LADDER, text)
    assert refused.near == near
    assert refused.advice().startswith(f"did you mean `{near}`? expected none <" if near else "expected none <")


def test_a_choice_says_what_there_is_in_its_order():
    assert refusal(LADDER, "encrypt").expected == "none < sign < sign_and_encrypt"
    assert Choice("a", "b", ordered=False).expected() == "a, b"
    assert [LADDER.parse(name) for name in ("none", "sign", "both")] == [0, 1, 2]


@given(st.lists(st.from_regex(r"[a-z][a-z0-9_]{0,9}", fullmatch=True), min_size=1, max_size=6, unique=True))
def test_choices_are_printed_as_they_are_read(values):
    domain = Choice(*values)
    assert [domain.parse(domain.format(rank)) for rank in domain.candidates()] == list(domain.candidates())


# Counts, flags, names, text


@given(st.integers(-5, 20))
def test_counts_are_bounded(number):
    domain = Count(0, 9)
    if 0 <= number <= 9:
        assert domain.parse(domain.format(number)) == number
    else:
        assert str(refusal(domain, str(number))) == f"`{number}` is out of range; expected a whole number from 0 to 9"


@pytest.mark.parametrize("text", ["", "1.0", "1e3", "1_000", "ten", "0x10", "--1", "9" * 21, "1 2"])
def test_what_is_no_whole_number_is_refused(text):
    assert "is not a whole number" in str(refusal(Count(), text))


def test_a_count_may_have_words_for_no_limit():
    domain = Count(1, 100, unlimited=("unlimited", "-1", "LENGTH_UNLIMITED"))
    assert [domain.parse(text) for text in ("unlimited", "Unlimited", "-1", "LENGTH_UNLIMITED", "+7")] == [
        *([NEVER] * 4),
        7,
    ]
    assert domain.format(NEVER) == "unlimited"
    assert domain.expected() == "a whole number from 1 to 100, or unlimited"


@pytest.mark.parametrize(
    ("text", "value"),
    {"true": 1, "True": 1, "yes": 1, "ON": 1, "1": 1, "false": 0, "no": 0, "off": 0, "0": 0}.items(),
)
def test_flags(text, value):
    assert Flag().parse(text) == value
    assert Flag().parse(Flag().format(value)) == value


@pytest.mark.parametrize("text", ["", "maybe", "2", "t", "truee"])
def test_what_is_no_flag_is_refused(text):
    assert str(refusal(Flag(), text)) == f"`{text}` is neither true nor false; expected true or false"


@pytest.mark.parametrize(
    ("text", "value"),
    {
        "": (),
        "[]": (),
        "Elm": ("Elm",),
        "a, b": ("a, b",),
        "[Elm, Oak]": ("Elm", "Oak"),
        '["Elm Street", no, 1, ~]': ("Elm Street", "no", "1", "~"),
        "[Oak, Elm, Oak]": ("Oak", "Elm", "Oak"),
    }.items(),
)
def test_names(text, value):
    assert Names().parse(text) == value


@pytest.mark.parametrize("text", ["[a", "[a, [b]]", "[a, {b: c}]", "[*a]", "[&a a, *b]", "[\x00]", "[\ud800]"])
def test_what_is_no_list_of_names_is_refused(text):
    refusal(Names(), text)


@given(st.lists(st.text(st.characters(exclude_categories=["Cs"])), max_size=4).map(tuple))
def test_names_are_printed_as_they_are_read(names):
    printed = Names().format(names)
    assert Names().parse(printed) == names
    assert flow(printed) == list(names)


def test_a_bomb_of_aliases_is_a_list_of_no_names():
    bomb = (
        "[&a [x, x], "
        + ", ".join(f"&{b} [*{a}, *{a}]" for a, b in zip("abcdefghijkl", "bcdefghijklm", strict=True))
        + "]"
    )
    refusal(Names(), bomb)


# Policies


def test_a_policy_prints_what_is_not_known_as_what_it_depends_on():
    depends = Depends("post.carrier", (("bike", 0), ("train", Anything("who knows"))))
    assert CARE.format(depends) == "undetermined (plain with carrier=bike, unknown (who knows) with carrier=train)"
    assert CARE.format(FromPeers("insured", "strongest_if_all")) == "taken from peers"
    assert [CARE.format(1), DELAY.format(NEVER), COPIES.format(INFINITE), STREETS.format(("a", "b c"))] == [
        *("signed", "infinite", "all", '[a, "b c"]'),
    ]
    assert [is_plain(value) for value in (1, "a", ("a",), depends, Anything("x"))] == [True, True, True, False, False]


def test_a_policy_says_what_may_be_written():
    assert CARE.expected() == "plain < signed < insured, or usual, best, unknown"
    assert STAMP.expected() == "text"


def test_policies_differ_by_name_and_level():
    assert {CARE: 1, DELAY: 2}[CARE] == 1
    assert hash(CARE) == hash(Policy("care", Flag()))
    assert hash(CARE) != hash(Policy("care", Flag(), level="topic"))


def test_a_policy_may_have_a_default_per_role():
    policy = Policy("sent", Flag(), {"publisher": "true"})
    assert (policy.default_for("publisher"), policy.default_for("subscriber")) == ("true", None)


@pytest.mark.parametrize(
    ("text", "word"),
    {
        "Keep Last": "keep_last",
        "  keep-last ": "keep_last",
        "KEEP \t LAST": "keep_last",
        "keep__last": "keep__last",
    }.items(),
)
def test_spellings_are_normalised(text, word):
    assert normalise(text) == word


def test_short_flow_texts_are_read_as_yaml_reads_them():
    words = ("sec", "nsec", "1", "_", "0x1", "null", "true", "1_000", "=", "<<", "-", "a b", "é")
    draw, read = Random(1), 0  # noqa: S311 - no secrets
    for _ in range(2000):
        texts = [draw.choice(words) for _ in range(draw.randrange(4))]
        text = "[" + ", ".join(texts) + "]"
        if draw.random() < 1 / 2:
            text = "{" + ", ".join(f"{each}: {draw.choice(words)}" for each in texts) + "}"
        if domains._LIST.fullmatch(text) or domains._MAP.fullmatch(text):
            read += 1
            assert flow(text) == yaml.load(text, Loader=yaml.CBaseLoader), text  # noqa: S506 - makes text only
    assert read > 500
