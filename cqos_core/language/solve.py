"""Solving a sentence for one side: which single change of a value makes it true (or false)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final

from cqos_core.language.evaluate import NO_SIGNAL, BoundCondition, Signal, Use, Values, Vocabulary, WrittenValue
from cqos_core.language.expression import Apply, Arithmetic, Compare, Literal, Operand, Term
from cqos_core.language.policy import BROKER, ENDPOINT, INFINITE, TOPIC, Anything, Choice, Plain, Policy, normalise
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from cqos_core.language.policy import Domain, Value

_TRIED: Final = 6
"""How many values of one policy are proposed to `may`, the best ones first."""


def may_change(policy: str, scope: str, fixes: Collection[str]) -> bool:
    """Whether a remedy may change what a rule reads of a policy in one scope, by the ``fixes`` of the rule."""
    return not fixes or policy in fixes or f"{scope} {policy}" in fixes


@dataclass(frozen=True, slots=True)
class Change:
    """Setting one policy of one side to ``value``."""

    second: bool
    index: int
    value: Plain


_FOLLOWS: Final = Anything("it follows from what changes")


def changed(values: Values, vocabulary: Vocabulary, index: int, value: Plain) -> Values:
    """Return ``values`` with one policy stated anew; what follows from it is not known then."""
    policy, size = vocabulary.policies[index], vocabulary.size
    for at in vocabulary.follows(policy.name, values):
        values = (*values[:at], _FOLLOWS, *values[at + 1 :])
    written = (
        WrittenValue(normalise(policy.domain.format(value)), here=True) if values[size + index] is not None else None
    )
    return (*values[:index], value, *values[index + 1 : size + index], written, *values[size + index + 1 :])


def solutions(
    bound: BoundCondition,
    a: Values,
    b: Values,
    *,
    second: bool,
    want: bool,
    fixes: tuple[str, ...] = (),
    signal: Signal = NO_SIGNAL,
    pair: bool = False,
    may: Callable[[int, Plain], bool] = lambda _index, _value: True,
    levels: Collection[str] = (ENDPOINT, "participant"),
) -> list[Change]:
    """Find, for each policy of one side, the smallest change after which the sentence is ``want``.

    Args:
        bound: the sentence.
        a: the offering side's values.
        b: the requesting side's values; the same tuple for a sentence over one endpoint.
        second: which side may change (ignored where both are the same tuple).
        want: the truth to reach.
        fixes: which policies may change, of which side; see `Rule`.
        signal: for sentences with aggregates.
        pair: it is one of pairs, even where it reads nothing of one side.
        levels: of the policies that may change.
        may: whether a policy may be set to a value, by its index; asked of the best values only.

    Returns:
        One change per policy that can reach it alone, in the order of the sentence; every one has been tried out.
        Where it can, it weakens nothing.
    """
    # Equal values of both sides are one and the same tuple, so identity says nothing about the sentence.
    scopes = {use.term.scope for use in bound.uses}
    single = not pair and not (scopes & {"offered", "publisher"} and scopes & {"requested", "subscriber"})
    vocabulary = bound.vocabulary
    found = []
    for use in bound.uses:
        policy = vocabulary.policies[use.index]
        if (not single and use.second is not second) or policy.level not in levels:
            continue
        if policy.derived or not may_change(policy.name, use.term.scope, fixes):
            continue
        if not fixes and not policy.stronger and (policy.default is None or policy.level in {BROKER, TOPIC}):
            continue  # a fact, which no rule names as its fix
        current = (b if use.second else a)[use.index]
        passing: list[Plain] = []
        for value in _candidates(bound, use, policy, a, b, second=second):
            side = changed(b if second else a, vocabulary, use.index, value)
            left, right = (side, side) if single else (a, side) if second else (side, b)
            if value != current and bound.judge(left, right, signal).result is want:
                passing.append(value)
        best = islice(_preferred(passing, current, policy, second=second), _TRIED)
        chosen = next((value for value in best if may(use.index, value)), None)
        if chosen is not None:
            found.append(Change(second, use.index, chosen))
    return found


def _preferred(passing: list[Plain], current: Value, policy: Policy, *, second: bool) -> list[Plain]:
    """Sort passing values: none that weakens first, then the next to the current one.

    Where the current one is open, the weakest offer or the strongest request comes first.
    """
    if isinstance(policy.domain, Choice) and not policy.domain.ordered and len(passing) > 1:
        # Nothing makes one of them better than another, unless the standard prefers one.
        default = policy.default_for(SUBSCRIBER if second else PUBLISHER)
        return [value for value in passing if policy.domain.format(value) == default]
    if isinstance(current, int) and all(isinstance(value, int) for value in passing):
        now: int = current
        return sorted(passing, key=lambda value: (policy.weakens(now, value), abs(int(value) - now), value))  # type: ignore[arg-type]
    if policy.domain.candidates() and not isinstance(current, (str, tuple)):
        return sorted(passing, reverse=second)
    # The first candidate is the value at which the comparison just turns.
    return passing


def _candidates(bound: BoundCondition, use: Use, policy: Policy, a: Values, b: Values, *, second: bool) -> list[Plain]:
    """Values worth trying: all of a small domain, else those where a comparison turns."""
    domain = policy.domain
    values = dict.fromkeys(domain.candidates()) or turning_points(bound, use, a, b)
    if domain.ordered and domain.highest == INFINITE:
        values[INFINITE] = None
    default = policy.default_for(SUBSCRIBER if second else PUBLISHER)
    if default is not None and domain.word(default) not in policy.words:
        values[domain.parse(default)] = None
    return [value for value in values if domain.has(value) and policy.spelling(value) is not None]


def turning_points(bound: BoundCondition, use: Use, a: Values, b: Values) -> dict[Plain, None]:
    """Return the values of one term at and around which some comparison of the sentence turns."""
    values: dict[Plain, None] = {}
    for node in bound.sentence.walk():
        if not isinstance(node, Compare):
            continue
        for here, there in ((node.left, node.right), (node.right, node.left)):
            if use.term.key not in {part.key for part in here.walk()}:
                continue
            target = _value(bound, there, here, a, b)
            for value in _isolate(here, use.term, target, bound, a, b):
                values[value] = None
    return values


def _value(bound: BoundCondition, node: Operand, beside: Operand, a: Values, b: Values) -> Plain | None:
    """The plain value of an operand, a constant read as the kind of the operand ``beside`` it; None where it is open."""
    return next(_reckon(node, bound, a, b, _domain(beside, bound, None)), None)


def _domain(node: Operand, bound: BoundCondition, otherwise: Domain | None) -> Domain | None:
    """The kind of the policies within an operand."""
    term = next((part for part in node.walk() if isinstance(part, Term)), None)
    return bound.vocabulary.policies[bound.vocabulary.find(term)].domain if term is not None else otherwise


def _reckon(node: Operand, bound: BoundCondition, a: Values, b: Values, domain: Domain | None) -> Iterator[Plain]:
    """Yield the plain value of an operand over known values, or nothing; text is read as a value of ``domain``."""
    if isinstance(node, Term):
        index = bound.vocabulary.find(node)
        value = (b if node.scope in {"requested", "subscriber"} else a)[index]
        if isinstance(value, (int, str, tuple)):
            yield value
        return
    if isinstance(node, Literal):
        if isinstance(node.value, int):
            yield int(node.value)
        else:
            yield node.value if domain is None else domain.parse(node.value)
        return
    if not isinstance(node, (Arithmetic, Apply)):
        return
    domain = _domain(node, bound, domain)
    parts = [next(_reckon(child, bound, a, b, domain), None) for child in node.children() if isinstance(child, Operand)]
    numbers = [part for part in parts if isinstance(part, int)]
    if len(numbers) != len(parts) or not numbers:
        return
    if isinstance(node, Arithmetic):
        left, right = numbers
        yield min(left + right if node.op == "+" else left * right, INFINITE)
    elif node.name in {"min", "max"}:
        yield (min if node.name == "min" else max)(numbers)
    elif node.name == "ceil" and numbers[1]:
        yield -(-numbers[0] // numbers[1])


def _isolate(
    node: Operand, term: Term, target: Plain | None, bound: BoundCondition, a: Values, b: Values
) -> Iterator[Plain]:
    """Yield values of ``term`` at and around which ``node`` reaches ``target``."""
    if node.key == term.key:
        if isinstance(target, int):
            yield from bound.vocabulary.policies[bound.vocabulary.find(term)].domain.around(target)
        elif target is not None:
            yield target
        return
    if not isinstance(target, int) or not isinstance(node, (Arithmetic, Apply)):
        return
    for child in node.children():
        if not isinstance(child, Operand) or term.key not in {part.key for part in child.walk()}:
            continue
        domain = _domain(node, bound, None)
        others = [
            next(_reckon(o, bound, a, b, domain), None)
            for o in node.children()
            if o is not child and isinstance(o, Operand)
        ]
        other = others[0] if others and isinstance(others[0], int) else None
        for goal in _goals(node, child, target, other):
            yield from _isolate(child, term, goal, bound, a, b)


def _goals(node: Arithmetic | Apply, child: Operand, target: int, other: int | None) -> tuple[int, ...]:
    """What ``child`` must amount to for ``node`` to amount to ``target``, beside the value ``other``."""
    if isinstance(node, Apply) and node.name in {"min", "max"}:
        return (target,)
    if other is None:
        return ()
    if isinstance(node, Arithmetic) and node.op == "+":
        return (target - other,)
    dividend = isinstance(node, Apply) and node.name == "ceil" and node.args[0] is child
    if dividend:
        return (target * other,)
    if isinstance(node, Apply) or other == 0:
        # The divisor for which the rounded-up quotient is the target.
        return (-(-other // target),) if target > 0 and isinstance(node, Apply) else ()
    return (target // other, -(-target // other))
