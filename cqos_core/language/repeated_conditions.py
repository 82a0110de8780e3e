"""What conditions answer that are asked again and again, of values that have much in common.

An answer is true, false, or None where it is not known. `BoundCondition.judge` is what it means.
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
"""How often something is asked before it is compiled."""
_OPEN: Final = "open"
_SAYS: Final[list[Any]] = [
    True if not bits & 0b1 else False if not bits & 0b10 else None if not bits & 0b1100 else _OPEN for bits in range(16)
]
"""By what a function may report, what a condition answers."""


class RepeatedConditions:
    """Conditions asked one by one: each is compiled once it was asked often."""

    def __init__(self, at: tuple[frozenset[int], frozenset[int]]) -> None:
        """Begin without any; ``at``: where the values of either side are those of all others."""
        self._at = at
        self._uses = Counter[int]()
        self._made: dict[int, tuple[BoundCondition, Reporting]] = {}

    def of(self, condition: BoundCondition, a: Values, b: Values) -> bool | None:
        """Ask a condition; of one that fails nothing is known."""
        # The condition is kept with what is remembered of it, so that no other one gets its identity.
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
    """Compile conditions into a function from two sides to a number that stands for all answers; see `all_known`."""
    # Whether it may be other than true, other than false, false for certain, and true for certain.
    ways = ((False, True), (True, True), (False, False), (True, False))
    return compile_conditions(
        [Question(each, answer, undecided, common) for each, common in conditions for answer, undecided in ways]
    ).reporting


def all_known(answers: int) -> bool:
    """Whether all conditions have the answers for which a number stands; else they have to be asked one by one."""
    return all(_SAYS[answers >> at & 0b1111] is not _OPEN for at in range(0, answers.bit_length(), 4))


def turning_values(condition: BoundCondition, use: Use, a: Values, b: Values) -> Iterator[Value]:
    """Yield values of ``use`` at which a condition may turn, also by values that depend on an assumption."""
    yield from turning_points(condition, use, a, b)
    for other in condition.uses:
        value = (b if other.second else a)[other.index]
        if isinstance(value, Depends):
            yield from (case for _, case in value.cases)
