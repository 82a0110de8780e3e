"""Between which of many values a condition holds, as bits, without judging every combination.

A condition is taken apart into those of one side and those that compare a value of each side. The former are judged once per
value. Of the latter, values are sorted or looked up (`Function.many` for functions of packs). An answer belongs to a first value. It
has the set of second values for which the condition may be true, and the set for which it may be false.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache, reduce
from itertools import accumulate, product
from operator import or_
from typing import Any, Final, NamedTuple

from cqos_core.language.binder import bind, bind_operands
from cqos_core.language.bound_condition import NO_SIGNAL, BoundCondition, Judge, known_value
from cqos_core.language.expression import COMPARISONS, Condition, Node, Term, Test
from cqos_core.language.operations import MIRRORED
from cqos_core.language.values import Values, settled, worlds_of
from cqos_core.language.vocabulary import SECOND_SCOPES, Vocabulary

FEW_COMBINATIONS: Final = 256
"""So many are judged one by one; of more, those whose answer is certain are found at once."""
_FIRST: Final = False
_SECOND: Final = True


class Certain(NamedTuple):
    """Per first value the second values, as bits, for which a condition is certainly true, certainly false, and neither.

    Of the latter ``doubtful`` are those for which it may yet be false, whatever the assumptions.
    """

    true: list[int]
    false: list[int]
    open: list[int]
    doubtful: list[int]


def positions(mask: int) -> Iterator[int]:
    """The positions of the bits that are set."""
    for start, byte in enumerate(mask.to_bytes((mask.bit_length() + 7) // 8, "little")):
        if byte:
            yield from (start * 8 + at for at in _BITS[byte])


_BITS: Final = [[at for at in range(8) if byte >> at & 1] for byte in range(256)]


class _May(NamedTuple):
    """Per first value the second values, as bits, for which a condition may be true, and may be false."""

    true: list[int]
    false: list[int]


class _Sides(NamedTuple):
    """The first values, and the second ones with their bits; ``everything`` has all bits."""

    firsts: Sequence[Values]
    seconds: Sequence[tuple[Values, int]]
    everything: int

    def rows(self, true: int, false: int) -> _May:
        """The same answer for every first value."""
        return _May([true] * len(self.firsts), [false] * len(self.firsts))


def related(bound: BoundCondition, firsts: Sequence[Values], seconds: Sequence[tuple[Values, int]]) -> Certain | None:
    """Return for which combinations the answer of a condition is certain; the others have to be judged.

    Args:
        bound: the condition.
        firsts: the values that ``offered`` looks up.
        seconds: the values that ``requested`` looks up, each with its bits.

    Returns:
        None where the condition cannot be taken apart.
    """
    of_side = firsts, [values for values, _ in seconds]
    worlds = worlds_of(values[use.index] for use in bound.uses for values in of_side[use.second])
    if worlds is None or bound.aggregate_uses or bound.options:
        return None
    everything = reduce(or_, (bits for _, bits in seconds), 0)
    true, false, may_fail = ([everything] * len(firsts) for _ in range(3))
    for world in worlds:
        sides = _Sides(
            [settled(values, world, bound.indices) for values in firsts],
            [(settled(values, world, bound.indices), bits) for values, bits in seconds],
            everything,
        )
        try:
            may = _may(bound.condition, bound.vocabulary, sides)
        except MemoryError:
            raise
        except Exception:  # noqa: BLE001 - a pack's own function may raise anything; judging each pair shows for which values
            return None
        true = [known & holds & ~fails for known, holds, fails in zip(true, *may, strict=True)]
        false = [known & fails & ~holds for known, holds, fails in zip(false, *may, strict=True)]
        may_fail = _both(may_fail, may.false)
    left = [everything & ~one & ~other for one, other in zip(true, false, strict=True)]
    return Certain(true, false, left, _both(left, may_fail))


def _may(node: Condition, vocabulary: Vocabulary, sides: _Sides) -> _May:
    match node:
        case Test("&", (Condition() as left, Condition() as right)):
            one, other = _may(left, vocabulary, sides), _may(right, vocabulary, sides)
            return _May(_both(one.true, other.true), _either(one.false, other.false))
        case Test("|", (Condition() as left, Condition() as right)):
            one, other = _may(left, vocabulary, sides), _may(right, vocabulary, sides)
            return _May(_either(one.true, other.true), _both(one.false, other.false))
        case Test("~", (Condition() as part,)):
            true, false = _may(part, vocabulary, sides)
            return _May(false, true)
    if len(_read(node)) < 2:  # noqa: PLR2004 - sides
        return _of_one_side(_judge(node, vocabulary), sides, second=_SECOND in _read(node))
    first, second, *_ = (_read(arg) for arg in node.args)
    function = vocabulary.functions.get(node.name)
    if len(first) == len(second) == 1 and first != second:
        operands = bind_operands(node, vocabulary)
        if node.name in COMPARISONS:
            straight = first == {_FIRST}
            return _compared(node.name if straight else MIRRORED[node.name], operands[:: 1 if straight else -1], sides)
        if function is not None and function.many is not None and first == {_FIRST}:
            return _called(function.many, node, operands, sides)
    return sides.rows(sides.everything, sides.everything)


def _both(one: Iterable[int], other: Iterable[int]) -> list[int]:
    return [a & b for a, b in zip(one, other, strict=True)]


def _either(one: Iterable[int], other: Iterable[int]) -> list[int]:
    return [a | b for a, b in zip(one, other, strict=True)]


@lru_cache(maxsize=1_000)
def _judge(node: Condition, vocabulary: Vocabulary) -> Judge:
    return bind(node, vocabulary).open


def _read(node: Node) -> set[bool]:
    """On which sides a part of a condition looks."""
    return {term.scope in SECOND_SCOPES for term in node.walk() if isinstance(term, Term)}


def _of_one_side(judge: Judge, sides: _Sides, *, second: bool) -> _May:
    if second:
        true = false = 0
        for values, bits in sides.seconds:
            answer = judge(values, values, NO_SIGNAL)
            true |= 0 if answer is False else bits
            false |= 0 if answer is True else bits
        return sides.rows(true, false)
    answers = [judge(values, values, NO_SIGNAL) for values in sides.firsts]
    return _May(
        [0 if answer is False else sides.everything for answer in answers],
        [0 if answer is True else sides.everything for answer in answers],
    )


def _compared(op: str, operands: Sequence[Judge], sides: _Sides) -> _May:
    one, other = operands
    by_value: dict[Any, int] = {}
    for values, bits in sides.seconds:
        value = known_value(other, values, values)
        by_value[value] = by_value.get(value, 0) | bits
    unknown = by_value.pop(None, 0)
    asked = [known_value(one, values, values) for values in sides.firsts]
    if op in {"==", "!="}:
        holding = [by_value.get(value, 0) for value in asked]
    else:
        ordered = sorted(by_value)
        up_to = [0, *accumulate((by_value[value] for value in ordered), or_)]
        find = bisect_left if op in {"<=", ">"} else bisect_right
        holding = [0 if value is None else up_to[find(ordered, value)] for value in asked]
    if op in {"!=", "<", "<="}:  # the found values are those for which it fails
        holding = [sides.everything & ~bits & ~unknown for bits in holding]
    return _May(
        [sides.everything if value is None else bits | unknown for value, bits in zip(asked, holding, strict=True)],
        [
            sides.everything if value is None else sides.everything & ~bits
            for value, bits in zip(asked, holding, strict=True)
        ],
    )


def _called(many: Callable[..., Sequence[int]], node: Condition, judges: Sequence[Judge], sides: _Sides) -> _May:
    """Ask a pack's function of all values at once, for each combination of its further arguments."""
    second = [_SECOND in _read(arg) for arg in node.args]
    own, others = ([at for at, of_second in enumerate(second) if of_second is side] for side in (_FIRST, _SECOND))
    rows: dict[tuple[Any, ...], dict[Any, list[int]]] = {}
    columns: dict[tuple[Any, ...], dict[Any, int]] = {}
    unknown = 0
    may = _May([0] * len(sides.firsts), [0] * len(sides.firsts))
    for row, values in enumerate(sides.firsts):
        value, *rest = (known_value(judges[at], values, values) for at in own)
        if value is None or None in rest:
            may.true[row] = may.false[row] = sides.everything
        else:
            rows.setdefault(tuple(rest), {}).setdefault(value, []).append(row)
    for values, bits in sides.seconds:
        value, *rest = (known_value(judges[at], values, values) for at in others)
        if value is None or None in rest:
            unknown |= bits
        else:
            same = columns.setdefault(tuple(rest), {})
            same[value] = same.get(value, 0) | bits
    for (of_first, asked), (of_second, among) in product(rows.items(), columns.items()):
        further = dict(zip((*own[1:], *others[1:]), (*of_first, *of_second), strict=True))
        found = many(list(asked), among, *(further[at] for at in sorted(further)))
        whole = reduce(or_, among.values())
        for same_rows, bits in zip(asked.values(), found, strict=True):
            for row in same_rows:
                may.true[row] |= bits | unknown
                may.false[row] |= whole & ~bits | unknown
    return may
