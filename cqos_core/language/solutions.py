"""Single changes of a value that make a condition true or false."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.binder import bind_operands
from cqos_core.language.bound_condition import NO_SIGNAL, BoundCondition, Signal, known_value
from cqos_core.language.domains import Choice
from cqos_core.language.expression import AGGREGATES, COMPARISONS
from cqos_core.language.policy import BROKER, ENDPOINT, TOPIC, Policy
from cqos_core.language.values import INFINITE, Anything, Plain, Values, WrittenValue, normalise
from cqos_core.model.caches import keep
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from cqos_core.language.expression import Node, Term
    from cqos_core.language.values import Value
    from cqos_core.language.vocabulary import Use, Vocabulary

_TRIED: Final = 6
"""Values of one policy that are proposed to `may`, the best ones first."""


def may_change(policy: str, scope: str, fixes: Collection[str]) -> bool:
    """Return whether a fix may change a policy that a rule reads in one scope, by the ``fixes`` of the rule."""
    return not fixes or policy in fixes or f"{scope} {policy}" in fixes


@dataclass(frozen=True, slots=True)
class Change:
    """Setting one policy of one side to ``value``."""

    second: bool
    index: int
    value: Plain


_FOLLOWS: Final = Anything("it follows from what changes")


def restated(values: Values, vocabulary: Vocabulary, index: int, value: Plain) -> dict[int, Any]:
    """Return the values that change, by position, when one policy is set; values that follow from it become unknown."""
    policy = vocabulary.policies[index]
    found: dict[int, Any] = dict.fromkeys(vocabulary.follows(policy.name, values), _FOLLOWS)
    found[index] = value
    found[vocabulary.size + index] = WrittenValue(normalise(policy.domain.format(value)), here=True)
    return found


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
    """Find, for each policy of one side, the smallest change after which the condition is ``want``.

    Args:
        bound: the condition.
        a: the offering side's values.
        b: the requesting side's values; the same tuple for a condition over one endpoint.
        second: which side may change (ignored where both are the same tuple).
        want: the truth to reach.
        fixes: the policies that may change, by side; see `Rule`.
        signal: for conditions with aggregates.
        pair: it is one of pairs, even where it reads nothing of one side.
        levels: of the policies that may change.
        may: whether a policy may be set to a value, by its index; asked of the best values only.

    Returns:
        One change per policy that can reach it alone, in the order of the condition; each was tried, and weakens nothing where it can.
    """
    # Equal values of both sides are one and the same tuple, so identity says nothing about the condition.
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
        first, other = bound.sides
        read = (a, first), (b, other), (b if second else a, (*first, *other) if single else ())
        key = (use, second, want, single, *[values[at] for values, places in read for at in places])
        best = None if bound.aggregate_uses else bound.solved.get(key)
        if best is None:
            best = keep(
                bound.solved, key, _best(bound, use, a, b, second=second, single=single, want=want, signal=signal)
            )
        chosen = next((value for value in best if may(use.index, value)), None)
        if chosen is not None:
            found.append(Change(second, use.index, chosen))
    return found


def _best(
    bound: BoundCondition, use: Use, a: Values, b: Values, *, second: bool, single: bool, want: bool, signal: Signal
) -> Sequence[Plain]:
    """Return the values of one term that are worth trying, of those with which the condition is ``want``; see `solutions`."""
    vocabulary, policy = bound.vocabulary, bound.vocabulary.policies[use.index]
    current = (b if use.second else a)[use.index]
    passing: list[Plain] = []
    every = [*(b if second else a)]
    for value in _candidates(bound, use, policy, a, b, second=second):
        for at, each in restated(b if second else a, vocabulary, use.index, value).items():
            every[at] = each
        side = tuple(every)
        left, right = (side, side) if single else (a, side) if second else (side, b)
        if value == current or bound.judge(left, right, signal).result is not want:
            continue
        if policy.spelling(value) is not None:
            passing.append(value)
    return _preferred(passing, current, policy, second=second)[:_TRIED]


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
    """Return values worth trying: all of a small domain, else those at which a comparison changes."""
    domain = policy.domain
    values = dict.fromkeys(domain.candidates()) or turning_points(bound, use, a, b)
    if domain.ordered and domain.highest == INFINITE:
        values[INFINITE] = None
    default = policy.default_for(SUBSCRIBER if second else PUBLISHER)
    if default is not None and domain.word(default) not in policy.words:
        values[domain.parse(default)] = None
    return [value for value in values if domain.has(value)]


def turning_points(bound: BoundCondition, use: Use, a: Values, b: Values) -> dict[Plain, None]:
    """Return the values of one term at and around which some comparison of the condition turns."""
    domain = bound.vocabulary.policies[use.index].domain

    def isolated(node: Node, target: Plain | None) -> Iterator[Plain]:
        """Yield the values of the term at and around which a part of the condition amounts to ``target``."""
        if node.key == use.term.key:
            if target is not None:
                yield from domain.around(target) if isinstance(target, int) else (target,)
            return
        for at, arg in enumerate(node.args):
            if any(part.key == use.term.key for part in arg.walk()):
                for goal in _goals(node.name, at, target, _beside(node, at, bound, a, b)):
                    yield from isolated(arg, goal)

    return dict.fromkeys(value for node in _compared(bound, use.term) for value in isolated(node, None))


def _compared(bound: BoundCondition, term: Term) -> tuple[Node, ...]:
    """Return the comparisons of a condition that read a term."""
    key = (bound.condition.key, term.key)
    found = _COMPARED.get(key)
    if found is None:
        compared = (node for node in bound.condition.walk() if node.name in COMPARISONS)
        reading = tuple(node for node in compared if any(part.key == term.key for part in node.walk()))
        found = keep(_COMPARED, key, reading)
    return found


_COMPARED: Final[dict[tuple[Any, ...], tuple[Node, ...]]] = {}


def _beside(node: Node, at: int, bound: BoundCondition, a: Values, b: Values) -> Plain | None:
    """Return the other operand of an operation, beside operand ``at``; None if it is open."""
    others = [
        known_value(judge, a, b)
        for other, judge in enumerate(bind_operands(node, bound.vocabulary))
        if other != at and not any(part.name in AGGREGATES for part in node.args[other].walk())
    ]
    return others[0] if others else None


def _goals(op: str, at: int, target: Plain | None, other: Plain | None) -> tuple[Plain | None, ...]:
    """Return the values of operand ``at`` for which an operation has the value ``target``, if its other operand is ``other``."""
    if op in COMPARISONS:
        return (other,)
    if not isinstance(target, int):
        return ()
    if op in {"min", "max"}:
        return (target,)
    if not isinstance(other, int):
        return ()
    match op, at:
        case "+", _:
            return (target - other,)
        case "*", _:
            return (target // other, -(-target // other)) if other else ()
        case "ceil", 0:
            return (target * other,)
        case "ceil", _:
            # The divisor for which the rounded-up quotient is the target.
            return (-(-other // target),) if target > 0 else ()
    return ()
