"""Random conditions over the policies of `tests.made_up_protocol`, each with a Python function that computes its value: an oracle."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from hypothesis import strategies as st

from cqos_core.language.expression import (
    Literal,
    Term,
    Test,
    ceil,
    first,
    greatest,
    in_,
    least,
    matches,
    offered,
    overlaps,
    requested,
    topic,
)
from cqos_core.language.values import INFINITE
from cqos_core.language.vocabulary import Vocabulary
from tests.made_up_protocol import CARE, COPIES, DELAY, INTERVAL, POLICIES, POST, SEALED, STAMP, STREETS

if TYPE_CHECKING:
    from collections.abc import Callable

SECOND: Final = 1_000_000_000
WORDS: Final = Vocabulary(POLICIES, POST.functions)
INDEX: Final = {policy.name: index for index, policy in enumerate(POLICIES)}


def values(given_values: dict[str, Any] | None = None, words: dict[str, Any] | None = None) -> tuple[Any, ...]:
    """Return a tuple as `judge` takes it: every policy's value, then how it was written."""
    plain: list[Any] = [0, INFINITE, 10, 0, (), "", 0, SECOND, 0, 0, 0, 0]
    written: list[Any] = [None] * WORDS.size
    for name, value in (given_values or {}).items():
        plain[INDEX[name]] = value
    for name, word in (words or {}).items():
        written[INDEX[name]] = word
    return (*plain, *written)


class Part(NamedTuple):
    """A part of a condition, and its value for two endpoints; None for unknown."""

    node: Any
    value: Callable[[dict[str, Any], dict[str, Any]], Any]

    def __repr__(self) -> str:
        return str(self.node)


def joined(combine, *parts):
    """Return a function for the value of a combination, unknown where a part is."""

    def value(a, b):
        found = [part.value(a, b) for part in parts]
        return None if None in found else combine(*found)

    return value


def constant(value, text=None):
    """Return a literal, written as a text where one is given."""
    return Part(Literal(value if text is None else text), lambda a, b: value)


def one_of_terms(policy):
    """Return a strategy for a policy of the publisher, of the subscriber, or of the endpoint itself."""
    return st.sampled_from(
        [
            Part(offered(policy), lambda a, b: a[policy.name]),
            Part(requested(policy), lambda a, b: b[policy.name]),
            Part(policy, lambda a, b: a[policy.name]),
        ]
    )


def clamped(number):
    """Return a number that is at most infinite."""
    return min(number, INFINITE)


def quotient(dividend, divisor):
    """Return a quotient rounded up, unknown where it is not defined."""
    if divisor in {0, INFINITE}:
        return None
    return INFINITE if dividend == INFINITE else -(-dividend // divisor)


def arithmetic(inner, factors):
    """Return a strategy for sums, products, least and greatest of numbers."""
    return st.one_of(
        st.builds(lambda x, y: Part(x.node + y.node, joined(lambda i, j: clamped(i + j), x, y)), inner, inner),
        st.builds(lambda x, y: Part(x.node * y.node, joined(lambda i, j: clamped(i * j), x, y)), factors, inner),
        st.builds(lambda x, y: Part(least(x.node, y.node), joined(min, x, y)), inner, inner),
        st.builds(lambda x, y: Part(greatest(x.node, y.node), joined(max, x, y)), inner, inner),
    )


care = one_of_terms(CARE)
care_constants = st.sampled_from([constant(rank, name) for rank, name in enumerate(("plain", "signed", "insured"))])
numbers = st.integers(0, 12).map(constant)
spans = st.sampled_from(
    [
        constant(0, "0s"),
        constant(1, "1ns"),
        constant(SECOND, "1s"),
        constant(2 * SECOND, "2s"),
        constant(INFINITE, "infinite"),
    ]
)
interval = st.just(Part(topic(INTERVAL), lambda a, b: a["interval"]))
delays = st.recursive(one_of_terms(DELAY) | interval | spans, lambda inner: arithmetic(inner, numbers), max_leaves=4)
quotients = st.builds(lambda x, y: Part(ceil(x.node, y.node), joined(quotient, x, y)), one_of_terms(DELAY), delays)
counts = st.recursive(one_of_terms(COPIES) | numbers | quotients, lambda inner: arithmetic(inner, inner), max_leaves=4)
flags = one_of_terms(SEALED)
lists = one_of_terms(STREETS)
text_constants = st.sampled_from([constant(text) for text in ("", "a", "b", "ab")])
word = st.one_of(
    one_of_terms(STAMP), st.builds(lambda x: Part(first(x.node), lambda a, b: (x.value(a, b) or [None])[0]), lists)
)

ORDERS = {
    "<": lambda x, y: x < y,
    "<=": lambda x, y: x <= y,
    "==": lambda x, y: x == y,
    "!=": lambda x, y: x != y,
    ">=": lambda x, y: x >= y,
    ">": lambda x, y: x > y,
}


def has_term(part):
    """Return whether a part reads any policy."""
    return any(isinstance(node, Term) for node in part.node.walk())


def comparing(left, right, operators):
    """Return a strategy for comparisons that read a policy."""
    return st.builds(
        lambda op, x, y: Part(Test(op, x.node, y.node), joined(ORDERS[op], x, y)),
        st.sampled_from(operators),
        left,
        right,
    ).filter(has_term)


def contained(x, ys):
    """Return the value of `in`: true as soon as one item is equal, unknown while an item is."""

    def value(a, b):
        sought, found = x.value(a, b), [y.value(a, b) for y in ys]
        if sought is not None and sought in found:
            return True
        return None if sought is None or None in found else False

    return value


def kleene_and(x, y):
    """Return the value of a conjunction: false as soon as one side is."""

    def value(a, b):
        found = {x.value(a, b), y.value(a, b)}
        return False if False in found else None if None in found else True

    return value


def kleene_not(x):
    """Return the value of a negation, unknown where its part is."""
    return lambda a, b: None if x.value(a, b) is None else not x.value(a, b)


def negated(part):
    """Return a part and its value, both negated."""
    return Part(~part.node, kleene_not(part))


def either(x, y):
    """Return the disjunction of two parts."""
    return Part(x.node | y.node, kleene_not(Part(None, kleene_and(negated(x), negated(y)))))


simple = st.one_of(
    comparing(care, care | care_constants, list(ORDERS)),
    comparing(delays, delays, list(ORDERS)),
    comparing(counts, counts, list(ORDERS)),
    comparing(flags, flags, list(ORDERS)),
    comparing(word, word | text_constants, ["==", "!="]),
    comparing(lists, lists, ["==", "!="]),
    st.builds(
        lambda x, ys: Part(in_(x.node, *[y.node for y in ys]), contained(x, ys)),
        care,
        st.lists(care | care_constants, min_size=1, max_size=3),
    ),
    st.builds(
        lambda x, ys: Part(in_(x.node, ys.node), joined(lambda i, j: i in j, x, ys)), word | text_constants, lists
    ),
    st.builds(lambda x, y: Part(overlaps(x.node, y.node), joined(lambda i, j: bool({*i} & {*j}), x, y)), lists, lists),
    st.builds(
        lambda x, pattern: Part(matches(x.node, pattern), joined(lambda text: fnmatchcase(text, pattern), x)),
        word,
        st.sampled_from(["*", "a", "a*", "?", "[ab]", ""]),
    ),
    flags.map(lambda x: Part(x.node & x.node, lambda a, b: bool(x.value(a, b)))),
)


def larger(inner):
    """Return a strategy for combinations of conditions."""
    return st.one_of(
        st.builds(lambda x, y: Part(x.node & y.node, kleene_and(x, y)), inner, inner),
        st.builds(either, inner, inner),
        inner.map(negated),
    )


def pair_of(policy, operators):
    """Return a strategy for comparisons of both ends in one policy."""
    return st.builds(
        lambda op: Part(
            Test(op, offered(policy), requested(policy)), lambda a, b: ORDERS[op](a[policy.name], b[policy.name])
        ),
        st.sampled_from(operators),
    )


conditions = st.recursive(simple, larger, max_leaves=4)
pair_conditions = st.recursive(
    st.sampled_from([CARE, SEALED, DELAY, COPIES]).flatmap(lambda policy: pair_of(policy, list(ORDERS))),
    larger,
    max_leaves=3,
)

DOMAINS: dict[str, list[Any]] = {
    "care": [0, 1, 2],
    "delay": [0, 1, SECOND, 2 * SECOND, INFINITE],
    "copies": [1, 2, 5, 100, INFINITE],
    "sealed": [0, 1],
    "streets": [(), ("a",), ("b", "a")],
    "stamp": ["", "a", "ab"],
}
INTERVALS: list[Any] = [0, 1, SECOND, INFINITE]
known = st.fixed_dictionaries({name: st.sampled_from(domain) for name, domain in DOMAINS.items()})
