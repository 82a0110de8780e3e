"""A pack whose rules are random conditions: what the language allows, also where no pack writes it."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.binder import bind
from cqos_core.language.domains import Count, Text
from cqos_core.language.expression import (
    Condition,
    all_equal,
    any_of,
    ceil,
    count,
    greatest,
    in_,
    least,
    matches,
    offered,
    option,
    overlaps,
    requested,
    stated,
    stated_here,
)
from cqos_core.language.policy import Policy
from cqos_core.model.problems import ConditionError
from cqos_core.packs.rule import Rule, forbids, requires
from tests.made_up_protocol import CARE, CARRIER, COPIES, DELAY, POLICIES, POST, SEALED, STAMP, STREETS, YEAR

if TYPE_CHECKING:
    from cqos_core.packs.pack import RulePack

FLOOR: Final = Policy("floor", Count(-2, 5), "0", "On which floor they live; cellars are below zero.")
SHELF: Final = Policy("shelf", Count(-3, 5), "1", "On which shelf letters lie.")
SENDER: Final = Policy("sender", Text(), None, "Who stands on the letter.")
_SIDES: Final = (offered, requested)


def any_rules(number: int, seed: int = 0) -> RulePack:
    """Return a pack of the post with this many rules."""
    random = Random(seed)  # noqa: S311 - no secrets
    policies = (*POLICIES, FLOOR, SHELF, SENDER)
    vocabulary = replace(POST, policies=policies, rules=()).vocabulary
    rules: list[Rule] = []
    while len(rules) < number:
        condition = a_condition(random, random.randint(0, 2))
        try:
            bind(condition, vocabulary)
        except ConditionError:  # constants only, for instance
            continue
        kind = random.choice((forbids, requires))
        rules.append(kind(condition, code=f"ANY{100 + len(rules)}", name=f"any-{len(rules)}", because="it is so"))
    return replace(POST, id="any", policies=policies, rules=tuple(rules))


def a_condition(random: Random, depth: int) -> Condition:
    """Return a condition."""
    if not depth:
        return a_test(random)
    left, right = a_condition(random, depth - 1), a_condition(random, depth - 1)
    return random.choice((left & right, left | right, ~left & right, left | ~right))


def a_test(random: Random) -> Condition:
    """Return a condition without operators."""
    side, other = random.choice(_SIDES), random.choice(_SIDES)
    number, text = a_number(random, 1), random.choice((STAMP, SENDER))
    words = [random.choice(("x", "y", other(random.choice((STAMP, SENDER))))) for _ in range(random.randint(2, 3))]
    cares = [random.choice(("plain", "signed", "insured", other(CARE))) for _ in range(random.randint(1, 3))]
    asked = random.choice((CARE, STAMP, FLOOR))
    found: list[Condition] = [
        compared(random, number, a_number(random, 1)),
        compared(random, number, random.randint(-4, 8)),
        compared(random, side(DELAY) * random.randint(1, 3), other(DELAY) + random.choice(("1s", offered(DELAY)))),
        compared(random, side(CARE), other(CARE)),
        in_(a_number(random, 0), *[random.choice((a_number(random, 0), random.randint(0, 5))) for _ in range(3)]),
        in_(side(text), *words),
        in_(side(CARE), *cares),
        in_(side(text), other(STREETS)),
        overlaps(side(STREETS), other(STREETS)),
        matches(side(text), "x*"),
        side(text) == other(text),
        side(STREETS) == other(STREETS),
        side(SEALED) == other(SEALED),
        ~side(SEALED),
        compared(random, ceil(side(COPIES), other(FLOOR)), random.randint(0, 4)),
        stated(side(asked)),
        stated(side(CARE), random.choice(("plain", "usual"))),
        stated_here(side(asked)),
        option(CARRIER) == random.choice(("bike", "ship")),
        option(YEAR) <= "y2000",
        compared(random, count(side(random.choice((FLOOR, COPIES))) > random.randint(0, 2)), random.randint(0, 2)),
        any_of(side(CARE) >= "signed"),
        all_equal(side(CARE)),
    ]
    return random.choice(found)


def compared(random: Random, left: Any, right: Any) -> Any:
    """Return a comparison of two values."""
    return random.choice((left < right, left <= right, left == right, left != right, left >= right, left > right))


def a_number(random: Random, depth: int) -> Any:
    """Return a number."""
    term = random.choice(_SIDES)(random.choice((COPIES, FLOOR, SHELF)))
    if not depth or random.random() < 0.3:
        return term
    other = random.choice((a_number(random, 0), random.randint(-3, 3)))
    return random.choice((term + other, term * other, least(term, other), greatest(term, other)))
