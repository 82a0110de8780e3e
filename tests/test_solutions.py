"""Remedies: the smallest change of one value after which a sentence is what it should be."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cqos_core.language.binder import bind
from cqos_core.language.parser import parse
from cqos_core.language.solutions import solutions
from cqos_core.language.values import INFINITE, Anything, Depends
from tests.made_up_protocol import POLICIES
from tests.random_conditions import DOMAINS, SECOND, WORDS, conditions, known, pair_conditions, values

UNKNOWN = Anything("nobody knows")


def solved(text: str, a: Any, b: Any, *, second: bool = False, want: bool = True, fixes: tuple[str, ...] = ()) -> Any:
    """The changes found, by policy, as text."""
    found = solutions(bind(parse(text), WORDS), values(a), values(b), second=second, want=want, fixes=fixes)
    assert all(change.second is second for change in found)
    return {POLICIES[change.index].name: POLICIES[change.index].domain.format(change.value) for change in found}


# sentence, offered, requested, what the publisher may do, what the subscriber may do
EXAMPLES: list[tuple[str, Any, Any, Any, Any]] = [
    ("offered(care) >= requested(care)", {"care": 0}, {"care": 2}, {"care": "insured"}, {"care": "plain"}),
    ("offered(care) >= requested(care)", {"care": 1}, {"care": 2}, {"care": "insured"}, {"care": "signed"}),
    ("offered(delay) <= requested(delay)", {"delay": 3 * SECOND}, {"delay": SECOND}, {"delay": "1s"}, {"delay": "3s"}),
    (
        "offered(delay) < requested(delay)",
        {"delay": SECOND},
        {"delay": SECOND},
        {"delay": "999999999ns"},
        {"delay": "1000000001ns"},
    ),
    ("offered(delay) <= requested(delay)", {"delay": INFINITE}, {"delay": 1}, {"delay": "1ns"}, {"delay": "infinite"}),
    # A zero would be read as `unspecified`, so it is no remedy.
    ("offered(delay) <= requested(delay)", {"delay": INFINITE}, {"delay": UNKNOWN}, {}, {"delay": "infinite"}),
    ("offered(copies) == requested(copies)", {"copies": 3}, {"copies": 7}, {"copies": "7"}, {"copies": "3"}),
    ("offered(sealed) | ~requested(sealed)", {"sealed": 0}, {"sealed": 1}, {"sealed": "true"}, {"sealed": "false"}),
    (
        "offered(streets) == requested(streets)",
        {"streets": ("a",)},
        {"streets": ("b",)},
        {"streets": "[b]"},
        {"streets": "[a]"},
    ),
    # Nothing beyond the domain is offered: there are 1 to 100 copies, or all of them.
    ("offered(copies) > requested(copies)", {"copies": 5}, {"copies": 100}, {"copies": "all"}, {"copies": "4"}),
    ("offered(copies) < requested(copies)", {"copies": 5}, {"copies": 1}, {}, {"copies": "6"}),
    ("offered(copies) * 2 <= requested(copies)", {"copies": 30}, {"copies": 21}, {"copies": "10"}, {"copies": "60"}),
    ("offered(copies) + 5 <= requested(copies)", {"copies": 30}, {"copies": 21}, {"copies": "16"}, {"copies": "35"}),
    ("max(offered(delay), '5s') <= requested(delay)", {"delay": SECOND}, {"delay": SECOND}, {}, {"delay": "5s"}),
    (
        "ceil(requested(delay), offered(delay)) <= 2",
        {"delay": SECOND},
        {"delay": 5 * SECOND},
        {"delay": "2500ms"},
        {"delay": "2s"},
    ),
    # Several policies, one change each, those alone that suffice.
    (
        "(offered(care) >= requested(care)) | (offered(copies) > 20)",
        *({"care": 0, "copies": 10}, {"care": 1}),
        *({"care": "signed", "copies": "21"}, {"care": "plain"}),
    ),
    ("(offered(care) >= requested(care)) & (offered(copies) > 20)", {"care": 0, "copies": 10}, {"care": 1}, {}, {}),
    # No change sets facts of the topic or options.
    ("topic(urgent) | (option(carrier) == 'ship')", {}, {}, {}, {}),
    ("offered(stamp) == requested(stamp)", {"stamp": "a"}, {"stamp": "b"}, {}, {}),
    # Where the value is not known, the weakest offer or the strongest request that will do.
    ("offered(care) >= requested(care)", {"care": UNKNOWN}, {"care": 1}, {"care": "signed"}, {"care": "plain"}),
    ("offered(care) >= requested(care)", {"care": 1}, {"care": UNKNOWN}, {"care": "insured"}, {"care": "signed"}),
    (
        "offered(care) >= requested(care)",
        *({"care": 1}, {"care": Depends("a", (("x", 1), ("y", 2)))}),
        *({"care": "insured"}, {"care": "signed"}),
    ),
    (
        "offered(delay) <= requested(delay)",
        {"delay": UNKNOWN},
        {"delay": SECOND},
        {"delay": "1s"},
        {"delay": "infinite"},
    ),
]


@pytest.mark.parametrize(("text", "a", "b", "offer", "request_"), EXAMPLES)
def test_the_smallest_change_on_either_side(text, a, b, offer, request_):
    assert solved(text, a, b) == offer
    assert solved(text, a, b, second=True) == request_


def test_what_is_forbidden_is_made_false():
    text = "(offered(copies) > requested(copies)) & topic(urgent)"
    a = {"copies": 9, "urgent": 1}
    assert solved(text, a, {"copies": 5, "urgent": 1}, want=False) == {"copies": "5"}
    assert solved(text, a, {"copies": 5, "urgent": 1}, want=False, second=True) == {"copies": "9"}


def test_a_rule_may_say_which_policies_are_its_remedies():
    text = "(care == 'insured') & ~sealed"
    insured = {"care": 2, "sealed": 0}
    assert solved(text, insured, insured, want=False) == {"care": "signed", "sealed": "true"}
    assert solved(text, insured, insured, want=False, fixes=("sealed",)) == {"sealed": "true"}


def test_a_rule_may_say_whose_policies_are_its_remedies():
    text = "(offered(copies) > requested(copies)) & topic(urgent)"
    a, b = {"copies": 9, "urgent": 1}, {"copies": 5, "urgent": 1}
    assert solved(text, a, b, want=False, fixes=("requested copies",)) == {}
    assert solved(text, a, b, want=False, fixes=("requested copies",), second=True) == {"copies": "9"}


def test_an_endpoint_rule_is_solved_on_the_one_endpoint_it_is_about():
    side = values({"care": 2, "sealed": 0})
    bound = bind(parse("(requested(care) == 'insured') & ~requested(sealed)"), WORDS)
    found = solutions(bound, side, side, second=False, want=False)
    assert [(POLICIES[change.index].name, change.value) for change in found] == [("care", 1), ("sealed", 1)]


def test_stating_a_value_counts_as_stating_it():
    bound = bind(parse("stated(delay, '2s') | (delay == '2s')"), WORDS)
    assert [change.value for change in solutions(bound, values(), values(), second=False, want=True)] == [2 * SECOND]


def holds(sentence, a, b):
    return sentence.value({**a, "interval": SECOND}, {**b, "interval": SECOND})


@given(conditions, known, known, st.booleans(), st.booleans())
def test_every_change_returned_does_what_it_says(sentence, a, b, second, want):
    """The oracle evaluates each change, so no fix is ever offered that does not work."""
    bound = bind(sentence.node, WORDS)
    assume(holds(sentence, a, b) is not want)
    scopes = {use.term.scope for use in bound.uses}
    pair = "requested" in scopes and scopes & {"offered", "own"}
    for change in solutions(bound, values(a), values(b), second=second, want=want):
        policy = POLICIES[change.index]
        assert policy.domain.parse(policy.domain.format(change.value)) == change.value
        if pair and "own" not in scopes:
            assert change.second is second
            left = a if second else {**a, policy.name: change.value}
            right = {**b, policy.name: change.value} if second else b
            assert change.value != (b if second else a)[policy.name]
            assert holds(sentence, left, right) is want


@given(pair_conditions, known, known, st.booleans())
def test_where_there_are_few_values_the_nearest_is_found_if_there_is_one(sentence, a, b, second):
    bound = bind(sentence.node, WORDS)
    want = not holds(sentence, a, b)
    found = {
        POLICIES[change.index].name: change.value
        for change in solutions(bound, values(a), values(b), second=second, want=want)
    }
    for name in ("care", "sealed"):
        if not any(use.second is second and use.term.name == name for use in bound.uses):
            continue
        side = b if second else a
        passing = [
            value
            for value in DOMAINS[name]
            if value != side[name]
            and holds(sentence, *((a, {**b, name: value}) if second else ({**a, name: value}, b))) is want
        ]
        nearest = min((abs(value - side[name]) for value in passing), default=None)
        assert (abs(found[name] - side[name]) if name in found else None) == nearest, name


OPERATORS = {
    "<": lambda x, y: x < y,
    "<=": lambda x, y: x <= y,
    "==": lambda x, y: x == y,
    "!=": lambda x, y: x != y,
    ">=": lambda x, y: x >= y,
    ">": lambda x, y: x > y,
}


@given(
    st.sampled_from(sorted(OPERATORS)),
    st.integers(1, 12),
    st.integers(1, 12),
    st.integers(1, 3),
    st.integers(0, 3),
    st.booleans(),
)
def test_of_many_values_the_nearest_is_found_too(op, x, y, factor, more, second):
    """By brute force, for every comparison of a product or a sum."""
    fits = OPERATORS[op]
    assume(not fits(x * factor + more, y))
    text = f"offered(copies) * {factor} + {more} {op} requested(copies)"
    found = solved(text, {"copies": x}, {"copies": y}, second=second)
    current = y if second else x
    passing = [
        value
        for value in range(1, 101)
        if fits(*((x * factor + more, value) if second else (value * factor + more, y)))
    ]
    passing += [INFINITE] if fits(*((x * factor + more, INFINITE) if second else (INFINITE, y))) else []
    if not passing:
        assert found == {}
        return
    distance = abs((INFINITE if found["copies"] == "all" else int(found["copies"])) - current)
    assert distance == min(abs(value - current) for value in passing)
