"""What sentences mean: the two compiled forms against an oracle, and what is not known against all that it may be."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.language.binder import bind
from cqos_core.language.bound_condition import RuleAnswer, Signal
from cqos_core.language.domains import Text
from cqos_core.language.expression import Condition, publisher, stated
from cqos_core.language.parser import parse
from cqos_core.language.policy import Policy
from cqos_core.language.values import INFINITE, MAXIMUM_WORLDS, Anything, Depends, WrittenValue, in_world
from cqos_core.language.vocabulary import Function, Vocabulary, role_of, scope_of
from cqos_core.model.problems import ConditionError, PackError
from tests.made_up_protocol import CARRIER, DELAY, POLICIES
from tests.random_conditions import DOMAINS, INTERVALS, SECOND, WORDS, conditions, known, values

if TYPE_CHECKING:
    from collections.abc import Callable

UNKNOWN = Anything("nobody knows")


def judged(text: str, a: Any = None, b: Any = None, signal: Signal | None = None) -> RuleAnswer:
    bound = bind(parse(text), WORDS)
    sides = values(a), values(b)
    return bound.judge(*sides) if signal is None else bound.judge(*sides, signal)


def result(text: str, a: Any = None, b: Any = None, signal: Signal | None = None) -> bool | None:
    return judged(text, a, b, signal).result


# The manual

EXAMPLES: list[tuple[str, Any, Any, bool | None]] = [
    ("offered(care) >= requested(care)", {"care": 1}, {"care": 1}, True),
    ("offered(care) >= requested(care)", {"care": 0}, {"care": 1}, False),
    ("care == 'signed'", {"care": 1}, {}, True),
    ("delay < '2s'", {"delay": SECOND}, {}, True),
    ("delay == 'infinite'", {"delay": INFINITE}, {}, True),
    ("copies * 2 + 1 == 21", {"copies": 10}, {}, True),
    ("delay + delay == 'infinite'", {"delay": INFINITE - 1}, {}, True),
    ("2 * delay == 'infinite'", {"delay": INFINITE}, {}, True),
    ("min(copies, 5) + max(copies, 1, 2) == 15", {"copies": 10}, {}, True),
    ("ceil(delay, topic(interval)) == 3", {"delay": 2 * SECOND + 1, "interval": SECOND}, {}, True),
    ("ceil(delay, topic(interval)) == 3", {"delay": 3 * SECOND, "interval": SECOND}, {}, True),
    ("first(streets) == 'Elm'", {"streets": ("Elm", "Oak")}, {}, True),
    ("in_(care, 'plain', 'insured')", {"care": 1}, {}, False),
    ("in_('Oak', streets)", {"streets": ("Elm", "Oak")}, {}, True),
    ("in_(stamp, streets)", {"streets": ("Elm", "Oak"), "stamp": "Ash"}, {}, False),
    ("overlaps(offered(streets), requested(streets))", {"streets": ("a", "b")}, {"streets": ("b",)}, True),
    ("overlaps(offered(streets), requested(streets))", {"streets": ()}, {"streets": ()}, False),
    ("matches(stamp, 'rt/*')", {"stamp": "rt/a/b"}, {}, True),
    ("matches(stamp, 'rt/*')", {"stamp": "RT/a"}, {}, False),
    ("matches(stamp, '[a-c]?')", {"stamp": "b1"}, {}, True),
    ("sealed", {"sealed": 1}, {}, True),
    ("~sealed & (copies > 1)", {"sealed": 0, "copies": 2}, {}, True),
    ("sealed == False", {"sealed": 0}, {}, True),
    ("both_everywhere(offered(streets), requested(streets))", {}, {}, True),
    # Not known
    ("care >= 'plain'", {"care": UNKNOWN}, {}, True),
    ("care < 'plain'", {"care": UNKNOWN}, {}, False),
    ("care >= 'signed'", {"care": UNKNOWN}, {}, None),
    ("in_(care, 'plain', 'signed', 'insured')", {"care": UNKNOWN}, {}, True),
    ("in_(care, 'plain', 'signed')", {"care": UNKNOWN}, {}, None),
    ("matches(stamp, '*')", {"stamp": UNKNOWN}, {}, None),
    ("first(streets) == 'Elm'", {"streets": ()}, {}, None),
    ("first(streets) != 'Elm'", {"streets": ()}, {}, None),
    ("~(first(streets) == 'Elm') | sealed", {"streets": (), "sealed": 1}, {}, True),
    ("ceil(delay, topic(interval)) + 1 > copies", {"interval": 0, "delay": 5}, {}, None),
    ("ceil(delay, topic(interval)) < copies", {"interval": INFINITE, "delay": 5}, {}, None),
    ("sealed & (ceil(delay, topic(interval)) > 1)", {"interval": 0}, {}, False),
    ("(care >= 'signed') | sealed", {"care": UNKNOWN, "sealed": 1}, {}, True),
    ("(care >= 'signed') & sealed", {"care": UNKNOWN, "sealed": 0}, {}, False),
    ("~(care >= 'signed')", {"care": UNKNOWN}, {}, None),
]


@pytest.mark.parametrize(("text", "a", "b", "expected"), EXAMPLES, ids=[f"{t} {e}" for t, _, _, e in EXAMPLES])
def test_what_sentences_mean(text, a, b, expected):
    assert result(text, a, b) is expected


def test_a_stated_value_differs_from_an_equal_default():
    asked = bind(stated(DELAY) & (DELAY == "infinite"), WORDS)
    assert asked.judge(values(), values()).result is False
    assert asked.judge(values(words={"delay": WrittenValue("infinite", here=False)}), values()).result is True
    by_word = bind(stated(DELAY, "Unspecified"), WORDS)
    assert by_word.judge(values(words={"delay": WrittenValue("unspecified", here=True)}), values()).result is True
    assert by_word.judge(values(words={"delay": WrittenValue("0s", here=True)}), values()).result is False
    by_value = bind(stated(DELAY, "1000ms"), WORDS)
    assert by_value.judge(values(words={"delay": WrittenValue("1s", here=True)}), values()).result is True
    here = bind(parse("stated_here(requested(delay))"), WORDS)
    for is_here in (True, False):
        b = values(words={"delay": WrittenValue("1s", here=is_here)})
        assert here.judge(values(), b).result is is_here
        assert here.judge(b, values()).result is False


# An oracle: every generated sentence comes with what it means (`tests.random_conditions`)


@given(conditions, known, known, st.sampled_from(INTERVALS))
def test_both_forms_mean_what_the_oracle_says(sentence, a, b, interval_value):
    a, b = {**a, "interval": interval_value}, {**b, "interval": interval_value}
    bound = bind(sentence.node, WORDS)
    sides = values(a), values(b)
    expected = sentence.value(a, b)
    assert bound.judge(*sides).result is expected
    assert bound.plain(*sides, Signal()) == bound.open(*sides, Signal())


@given(conditions)
def test_a_sentence_read_from_text_means_the_same(sentence):
    for text in ("a", "ab"):
        sides = values({"stamp": text, "care": 1}), values({"copies": 1, "delay": SECOND})
        read = bind(parse(str(sentence.node)), WORDS)
        assert read.judge(*sides) == bind(sentence.node, WORDS).judge(*sides)


def opened(draw, name, domain):
    """A value that may be any of the domain, some of it by assumption, or all that the policy allows."""
    kind = draw(st.sampled_from(["plain", "plain", "anything", "depends", "depends", "nested"]))
    if kind == "plain":
        return draw(st.sampled_from(domain))
    if kind == "anything":
        return UNKNOWN
    cases = draw(st.lists(st.sampled_from(domain), min_size=2, max_size=3))
    assumed = draw(st.sampled_from(["rmw", "order"]))
    if kind == "nested":
        cases[0] = UNKNOWN
    return Depends(assumed, tuple(zip("xyz", cases, strict=False)))


@st.composite
def open_sides(draw):
    return tuple({name: opened(draw, name, domain) for name, domain in DOMAINS.items()} for _ in range(2))


def possibilities(name, value, world):
    """What a value may be in one world, as far as the small domains here tell."""
    if isinstance(value, Depends):
        # A case that an assumption does not list may be any of those it lists.
        cases = dict(value.cases)
        return possibilities(name, cases[world[value.on]], world) if world[value.on] in cases else list(cases.values())
    return DOMAINS[name] if isinstance(value, Anything) else [value]


@given(conditions, open_sides(), st.data())
def test_true_and_false_hold_whatever_the_unknown_turns_out_to_be(sentence, sides, data):
    """Sound: what is open is filled in with anything it may be, and the answer is never another one."""
    a, b = sides
    outcome = bind(sentence.node, WORDS).judge(values(a), values(b))
    by_world = dict(outcome.worlds)
    for world in ({"rmw": x, "order": y} for x, y in product("xyz", "xyz")):
        expected = outcome.result
        if by_world:
            label = ", ".join(f"{name}={world[name]}" for name in sorted(world) if f"{name}=" in next(iter(by_world)))
            if label not in by_world:
                continue
            expected = by_world[label]
        if expected is None:
            continue
        for _ in range(3):
            filled = [
                {
                    **{name: data.draw(st.sampled_from(possibilities(name, v, world))) for name, v in side.items()},
                    "interval": SECOND,
                }
                for side in sides
            ]
            filled = [
                {name: DOMAINS[name][0] if isinstance(v, (Anything, Depends)) else v for name, v in side.items()}
                for side in filled
            ]
            assert sentence.value(*filled) in {expected, None}, (world, filled)


# Worlds


def test_binding_a_sentence_leaves_the_vocabulary_as_it_is():
    """The checks of one system must not change the report on another system."""
    before = dict(vars(WORDS))
    assert bind(parse("stated(copies)"), WORDS).asked == {2}
    assert vars(WORDS) == before


def depends(on, *cases):
    return Depends(on, tuple(zip("xyz", cases, strict=False)))


def test_both_ends_vary_together():
    both = {"care": depends("post.carrier", 0, 1, 2)}
    assert judged("offered(care) >= requested(care)", both, both) == RuleAnswer(True)


def test_where_assumptions_differ_each_has_its_answer():
    outcome = judged("offered(care) >= requested(care)", {"care": depends("post.carrier", 0, 1)}, {"care": 1})
    assert outcome == RuleAnswer(None, (("post.carrier=x", False), ("post.carrier=y", True)))


def test_independent_assumptions_are_crossed():
    outcome = judged("offered(care) >= requested(care)", {"care": depends("a", 0, 1)}, {"care": depends("b", 0, 1)})
    assert outcome.worlds == (("a=x, b=x", True), ("a=x, b=y", False), ("a=y, b=x", True), ("a=y, b=y", True))


def test_an_assumption_that_makes_no_difference_is_not_mentioned():
    assert judged("care >= 'plain'", {"care": depends("a", 0, 1)}) == RuleAnswer(True)
    assert judged("care >= 'signed'", {"care": depends("a", 1, 2)}) == RuleAnswer(True)


def test_a_world_may_leave_its_case_open():
    nested = {"care": depends("a", UNKNOWN, 2)}
    assert judged("care >= 'signed'", nested).worlds == (("a=x", None), ("a=y", True))
    inner = {"care": depends("a", depends("b", 0, 2), 2)}
    assert judged("care >= 'signed'", inner).worlds == (
        *(("a=x, b=x", False), ("a=x, b=y", True), ("a=y, b=x", True), ("a=y, b=y", True)),
    )


def test_beyond_a_handful_of_worlds_values_are_sets():
    """Seven assumptions of two cases are 128 worlds: the answer names no world, and certain answers stay certain."""
    names = ("care", "delay", "copies", "sealed", "interval", "urgent", "year")
    many = {name: depends(name, *((SECOND, 1) if name in {"delay", "interval"} else (1, 0))) for name in names}
    everything = (
        "(care == 'signed') & (delay == '1s') & (copies == 1) & sealed"
        " & (topic(interval) == '1s') & topic(urgent) & (option(year) == 'y2000')"
    )
    assert 2 ** len(names) > MAXIMUM_WORLDS
    assert judged(everything, many, many) == RuleAnswer(None)
    assert judged(f"{everything} & (care == 'insured')", many, many) == RuleAnswer(False)
    assert judged(f"({everything}) | (copies <= 1)", many, many) == RuleAnswer(True)


def test_a_value_in_a_world():
    value = depends("a", depends("b", 1, 2), 3)
    assert in_world(value, {"a": "x", "b": "y"}) == 2
    assert in_world(value, {"a": "y"}) == 3
    assert tuple(in_world(value, {"a": "x"})) == (1, 2)
    assert in_world(depends("a", "s", "t"), {}) == Anything("it depends on a")
    assert in_world(depends("a", "s", "s"), {}) == "s"


# Options


def test_an_option_that_differs_between_the_two_ends_is_neither():
    """An option of a rule over a pair is that of both; where they differ the rule cannot tell."""
    text = "(offered(care) >= requested(care)) | (option(carrier) == 'ship')"
    bike, ship = {"carrier": 0, "care": 0}, {"carrier": 2, "care": 1}
    assert result(text, ship, {**ship, "care": 2}) is True
    assert result(text, bike, ship) is None
    assert result(text, ship, {"carrier": 0, "care": 2}) is None
    assert result(text, {**bike, "care": 2}, ship) is True


def test_the_connection_of_each_end_is_its_own():
    bound = bind(publisher(CARRIER) == "bike", WORDS)
    assert bound.judge(values({"carrier": 0}), values({"carrier": 1})).result is True
    assert result("publisher(carrier) == subscriber(carrier)", {"carrier": 0}, {"carrier": 1}) is False


# Functions of a pack


def test_a_function_may_answer_that_it_does_not_know():
    vocabulary = Vocabulary(POLICIES, [Function("odd", lambda text: None if not text else len(text) % 2 == 1)])
    for text, empty, one in [
        ("odd(stamp)", None, True),
        ("~odd(stamp)", None, False),
        ("odd(stamp) & sealed", False, False),
        ("odd(stamp) | ~sealed", True, True),
        ("~(odd(stamp) & ~sealed)", None, False),
    ]:
        bound = bind(parse(text), vocabulary)
        assert bound.judge(values({"stamp": ""}), values()).result is empty, text
        assert bound.judge(values({"stamp": "a"}), values()).result is one, text


def test_a_function_is_asked_about_known_values_only():
    seen = []

    def see(text):
        seen.append(text)
        return True

    vocabulary = Vocabulary(POLICIES, [Function("seen", see)])
    bound = bind(parse("seen(stamp)"), vocabulary)
    assert bound.judge(values({"stamp": UNKNOWN}), values()).result is None
    assert bound.judge(values({"stamp": "a"}), values()).result is True
    assert seen == ["a"]


# Aggregates, against the endpoints one by one

endpoints = st.lists(
    st.tuples(
        st.fixed_dictionaries(
            {
                "care": st.sampled_from([0, 1, 2, UNKNOWN, depends("a", 0, 2)]),
                "copies": st.sampled_from([1, 3, INFINITE, UNKNOWN, depends("a", 1, 2)]),
            }
        ),
        st.integers(1, 3),
    ),
    max_size=3,
)

AGGREGATES: dict[str, Callable[[list[dict[str, Any]], list[dict[str, Any]]], bool]] = {
    "all_equal(offered(care))": lambda pubs, subs: len({p["care"] for p in pubs}) <= 1,
    "any_of(requested(care) >= 'signed')": lambda pubs, subs: any(s["care"] >= 1 for s in subs),
    "count(offered(care) == 'signed') >= 2": lambda pubs, subs: sum(p["care"] == 1 for p in pubs) >= 2,
    "total(offered(copies)) < 7": lambda pubs, subs: sum(p["copies"] for p in pubs) < 7,
    "total(offered(copies), offered(care) >= 'signed') == 3": lambda pubs, subs: (
        sum(p["copies"] for p in pubs if p["care"] >= 1) == 3
    ),
    "total(requested(copies)) >= total(offered(copies))": lambda pubs, subs: (
        min(sum(s["copies"] for s in subs), INFINITE) >= min(sum(p["copies"] for p in pubs), INFINITE)
    ),
    "~all_equal(offered(copies)) & any_of(offered(care) == 'plain')": lambda pubs, subs: (
        len({p["copies"] for p in pubs}) > 1 and any(p["care"] == 0 for p in pubs)
    ),
}


def expanded(groups, world, fill):
    """Every endpoint of the groups by itself, in one world, with the unknown filled in by ``fill``."""
    found = []
    for each, number in groups:
        for _ in range(number):
            settled = {name: dict(v.cases)[world] if isinstance(v, Depends) else v for name, v in each.items()}
            found.append({name: fill[name] if isinstance(v, Anything) else v for name, v in settled.items()})
    return found


@pytest.mark.parametrize("text", AGGREGATES)
@given(publishers=endpoints, subscribers=endpoints)
def test_aggregates_count_every_endpoint(text, publishers, subscribers):
    signal = Signal(
        tuple((values(each), number) for each, number in publishers),
        tuple((values(each), number) for each, number in subscribers),
    )
    outcome = bind(parse(text), WORDS).judge(values(), values(), signal)
    groups = [each for side in (publishers, subscribers) for each, _ in side]
    certain = not any(isinstance(v, (Anything, Depends)) for each in groups for v in each.values())
    by_world = dict(outcome.worlds) or {"a=x": outcome.result, "a=y": outcome.result}
    for label, answer in by_world.items():
        for fill in ({"care": c, "copies": n} for c in (0, 1, 2) for n in (1, 100)):
            world = label[-1]
            truth = AGGREGATES[text](expanded(publishers, world, fill), expanded(subscribers, world, fill))
            assert answer is truth or (answer is None and not certain), (label, fill)


# What a pack may not say

MISTAKES = {
    "colour == 'red'": "`colour` names no policy at endpoint level; known: care, delay",
    "offered(delay) == infinite": '; a value stands in quotes: "infinite"',
    "offered(interval) < '1s'": "`offered(interval)` names no policy at endpoint level",
    "topic(care) == 'plain'": "`topic(care)` names no policy at topic level; known: interval, urgent",
    "publisher(care) == 'plain'": "names no policy at participant or option level",
    "broker(x) == 1": "known: none",
    "care == 'express'": "`express` is not one of its values; expected plain < signed < insured",
    "care >= 1": "`1` is no choice value",
    "care == True": "compares choice with flag values",
    "copies == 'many'": "`many` is not a whole number",
    "copies > sealed": "compares count with flag values that have nothing in common",
    "care >= option(year)": "compares choice with choice values that have nothing in common",
    "stamp < 'a'": "compares by order, but text values here have none",
    "option(carrier) < 'ship'": "compares by order, but choice values here have none",
    "streets < 'a'": "compares by order, but names values here have none",
    "1 == 1": "`1 == 1` compares two constants",
    "'a' == 'b'": "compares two constants",
    "care": "`care` is not a flag",
    "~copies": "`copies` is not a flag",
    "copies + 1": "`copies + 1` is not a flag",
    # Durations have units in sentences too.
    "delay < 5": "`5` has no unit",
    "delay + 5 < '1s'": "`5` has no unit",
    "min(delay, 5) < '1s'": "`5` has no unit",
    "ceil(delay, 5) < 2": "`5` has no unit",
    "delay < '5'": "`5` has no unit",
    "delay * '2s' < '1s'": "`2s` is not a whole number",
    "delay * topic(interval) < '1s'": "multiplies a duration by a duration",
    "delay + copies < '1s'": "adds a duration to a count",
    "care + 1 > care": "computes with values that are no numbers",
    "sealed * 2 > 2": "computes with values that are no numbers",
    "stamp + 'a' == 'b'": "computes with values that are no numbers",
    # What is put together must be of one kind.
    "min(delay, copies) < '1s'": "`min(delay, copies)` puts duration and count values together",
    "max(care, copies) == 'plain'": "puts choice and count values together",
    "max(care, option(year)) == 'plain'": "puts choice and choice values together",
    "min(stamp, 'a') == 'b'": "compares by order, but text values here have none",
    "ceil(delay, copies) > 1": "puts duration and count values together",
    "ceil(care, care) > 1": "computes with values that are no numbers",
    "in_(copies, care)": "puts count and choice values together",
    "in_(copies, streets)": "puts count and names values together",
    "in_(stamp, streets, streets)": "puts text and names values together",
    "in_(care, 'plain', 'express')": "`express` is not one of its values",
    "in_('a', 'b')": '`in_("a", "b")` compares constants',
    "first(stamp) == 'a'": "`first(stamp)` needs a list of names",
    "matches(copies, '1*')": '`matches(copies, "1*")` needs text',
    "matches(streets, '1*')": "needs text",
    "overlaps(streets, stamp)": "needs two lists of names",
    "in_(streets, 'Elm')": "looks for a list; `overlaps` compares lists",
    "ceil('2s', '1s') > copies": "computes with constants only",
    "total(offered(care)) > total(offered(care))": "computes with values that are no numbers",
    "stated(2)": "takes a policy, not `2`",
    "stated(delay, 5)": "compares with a word in quotes",
    "stated(delay, stamp)": "compares with a word in quotes",
    "all_equal(care)": "must read either offered or requested values",
    "count(offered(care) > requested(care)) > 1": "must read either offered or requested values",
    "any_of(topic(urgent))": "must read either offered or requested values",
    "any_of(any_of(offered(sealed)))": "stands inside another aggregate",
    "near(stamp)": "`near` is neither of the language nor a function of the pack (its own: both_everywhere)",
}


@pytest.mark.parametrize(("text", "message"), MISTAKES.items(), ids=MISTAKES)
def test_a_sentence_that_does_not_fit_the_policies_is_refused_when_it_is_bound(text, message):
    with pytest.raises(ConditionError) as refused:
        bind(parse(text), WORDS)
    assert message in str(refused.value)


def test_two_policies_of_one_name_are_refused():
    with pytest.raises(PackError, match="a policy is declared twice"):
        Vocabulary([Policy("a", Text()), Policy("a", Text())])
    Vocabulary([Policy("a", Text()), Policy("a", Text(), level="topic")])


@pytest.mark.parametrize(
    ("text", "scope", "role"),
    [
        ("offered(care) >= requested(care)", "pair", "publisher"),
        ("publisher(town) == subscriber(town)", "pair", "publisher"),
        ("offered(care) == subscriber(town)", "pair", "publisher"),
        ("care == 'plain'", "endpoint", None),
        ("offered(delay) < topic(interval)", "endpoint", "publisher"),
        ("requested(delay) < topic(interval)", "endpoint", "subscriber"),
        ("publisher(town) == 1", "endpoint", "publisher"),
        ("all_equal(offered(care))", "signal", None),
        ("requested(copies) < total(offered(copies))", "signal", "subscriber"),
        ("topic(urgent)", "signal", None),
        ("participant(town) == 1", "participant", None),
        ("participant(town) == option(town)", "participant", None),
        ("option(town) == 1", "system", None),
    ],
)
def test_the_scope_of_a_rule_follows_from_its_terms(text, scope, role):
    sentence: Condition = parse(text)
    assert (scope_of(sentence), role_of(sentence)) == (scope, role)


@pytest.mark.parametrize("order", [(0, UNKNOWN, 1), (UNKNOWN, 0, 1), (0, 1, UNKNOWN)])
def test_values_that_differ_are_not_equal_wherever_an_unknown_one_stands(order):
    publishers = tuple((values({"care": each}), 1) for each in order)
    outcome = bind(parse("all_equal(offered(care))"), WORDS).judge(values(), values(), Signal(publishers, ()))
    assert outcome.result is False
