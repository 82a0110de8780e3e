"""Conditions that are evaluated often, over values that have much in common.

An answer is true, false, or None if it is unknown. `BoundCondition.judge` defines the answers.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.condition_compiler import CommonValues, Question, compile_conditions
from cqos_core.language.solutions import turning_points
from cqos_core.language.values import Depends

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.language.bound_condition import BoundCondition
    from cqos_core.language.condition_compiler import Reporting
    from cqos_core.language.values import Value, Values
    from cqos_core.language.vocabulary import Use

WORTH_A_FUNCTION: Final = 12
"""Evaluations of a condition before it is compiled."""
_OPEN: Final = "open"
_SAYS: Final[list[Any]] = [
    True if not bits & 0b1 else False if not bits & 0b10 else None if not bits & 0b1100 else _OPEN for bits in range(16)
]
"""The answer of a condition, by the bits of the compiled function."""


class RepeatedConditions:
    """Evaluates conditions one by one; compiles each after it was evaluated often."""

    def __init__(self, at: tuple[frozenset[int], frozenset[int]]) -> None:
        """Begin without conditions; ``at``: the indices at which all value tuples of either side are equal."""
        self._at = at
        self._uses = Counter[int]()
        self._made: dict[int, tuple[BoundCondition, Reporting]] = {}

    def of(self, condition: BoundCondition, a: Values, b: Values) -> bool | None:
        """Return the answer of a condition; None if it raises an error."""
        # The condition is kept with its entry, so that its id is not reused.
        made = self._made.get(id(condition))
        if made is not None and (says := _SAYS[made[1](a, b)]) is not _OPEN:
            return says  # type: ignore[no-any-return]
        try:
            answer, is_new = condition.recall(a, b)
        except MemoryError:  # which says nothing of the condition
            raise
        except Exception:  # noqa: BLE001 - a pack's own function may raise anything
            return None
        if is_new:
            self._uses[id(condition)] += 1
            if self._uses[id(condition)] == WORTH_A_FUNCTION:
                self._made[id(condition)] = condition, compile_answers([(condition, CommonValues(a, b, self._at))])
        return answer.result


def compile_answers(conditions: Iterable[tuple[BoundCondition, CommonValues]]) -> Reporting:
    """Compile conditions into one function from two value tuples to a number that encodes all answers; see `all_known`."""
    # Four bits: may be other than true; may be other than false; certainly false; certainly true.
    ways = ((False, True), (True, True), (False, False), (True, False))
    return compile_conditions(
        [Question(each, answer, undecided, common) for each, common in conditions for answer, undecided in ways]
    ).reporting


def all_known(answers: int) -> bool:
    """Return whether a number of `compile_answers` encodes certain answers; else ask the conditions one by one."""
    return all(_SAYS[answers >> at & 0b1111] is not _OPEN for at in range(0, answers.bit_length(), 4))


def turning_values(condition: BoundCondition, use: Use, a: Values, b: Values) -> Iterator[Value]:
    """Yield the values of ``use`` at which the answer of a condition may change, under any assumption."""
    yield from turning_points(condition, use, a, b)
    for other in condition.uses:
        value = (b if other.second else a)[other.index]
        if isinstance(value, Depends):
            yield from (case for _, case in value.cases)
