"""Conditions over values that may change, as formulas: which combinations of choices give the answer that is wanted.

A condition is taken apart at ``&``, ``|`` and ``~``. The remaining parts read few values. The checker's own answer for each combination of
these values is a table. There is no second meaning of any operation. A formula allows a combination only if the checker gives the
wanted answer. The exception are values that follow from others in a way that only a check of the whole system shows (`ReadValues.loose`).
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.language.binder import bind
from cqos_core.language.bound_condition import NO_SIGNAL
from cqos_core.language.expression import AGGREGATES, Condition
from cqos_core.language.values import WrittenValue, normalise, settled, worlds_of
from cqos_core.model.caches import keep
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    from cqos_core.language.bound_condition import BoundCondition
    from cqos_core.language.expression import Node
    from cqos_core.language.values import Plain, Values
    from cqos_core.language.vocabulary import Vocabulary

_MOST_ROWS: Final = 20_000
"""A larger table is left to the check."""


class Wanted(NamedTuple):
    """The answer that a rule must give.

    Attributes:
        answer: true or false.
        lenient: unknown is enough.
    """

    answer: bool
    lenient: bool


@dataclass(frozen=True, slots=True)
class Variable:
    """A value with its choices: number 0 leaves it as it is, number n sets it to ``values[n - 1]``.

    Attributes:
        places: the places that decide it, the nearest first; or, with ``any_change``, whether anything of these changes.
        numbers: per place and choice of it, the choice of the variable.
    """

    places: tuple[Hashable, ...]
    values: tuple[Plain, ...] = ()
    numbers: tuple[tuple[int, ...], ...] = ()
    any_change: bool = False

    @property
    def size(self) -> int:
        """The number of choices."""
        return 2 if self.any_change else 1 + len(self.values)


@dataclass(frozen=True, slots=True)
class Table:
    """Choices of variables, and the combinations of their numbers that are excluded."""

    variables: tuple[Variable, ...]
    excluded: frozenset[tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class AllOf:
    """Every part holds."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class AnyOf:
    """At least one part holds."""

    parts: tuple[Formula, ...]


Formula: TypeAlias = "bool | Table | AllOf | AnyOf"


def all_of(parts: Sequence[Formula]) -> Formula:
    """Return the formula that all parts hold, without what is certain."""
    left = tuple(dict.fromkeys(part for part in parts if part is not True))
    if False in left:
        return False
    return True if not left else left[0] if len(left) == 1 else AllOf(left)


def any_of(parts: Sequence[Formula]) -> Formula:
    """Return the formula that any part holds, without what is certain."""
    left = tuple(dict.fromkeys(part for part in parts if part is not False))
    if True in left:
        return True
    return False if not left else left[0] if len(left) == 1 else AnyOf(left)


@dataclass(frozen=True, slots=True)
class ReadValues:
    """The values of one end that a condition reads.

    Attributes:
        values: at the moment.
        variables: by index, those that may change.
        loose: by index, further variables that may change a value in a way that only a check shows.
    """

    values: Values
    variables: Mapping[int, Variable]
    loose: Mapping[int, Variable]


def formula_of(bound: BoundCondition, first: ReadValues, second: ReadValues, wanted: Wanted) -> Formula:
    """Return when a condition certainly gives an answer, or with a lenient wish, when it does not certainly give the other."""
    read = [(second if use.second else first).values[use.index] for use in bound.uses]
    worlds = worlds_of(read) or [{}]
    parts = []
    for world in worlds:
        sides = tuple(
            ReadValues(settled(side.values, world, bound.indices), side.variables, side.loose)
            for side in (first, second)
        )
        parts.append(
            _Translation(bound.vocabulary, sides[0], sides[1], wanted.lenient).of(bound.condition, wanted.answer)
        )
    # An answer that differs between assumptions is unknown.
    return any_of(parts) if wanted.lenient else all_of(parts)


@lru_cache(maxsize=4096)
def _bound(part: Condition, vocabulary: Vocabulary) -> BoundCondition:
    return bind(part, vocabulary)


_Key: TypeAlias = "tuple[Any, ...]"
_ANSWERS: dict[_Key, frozenset[tuple[int, ...]]] = {}
_MOST_ANSWERS: Final = 50_000


@dataclass(frozen=True, slots=True)
class _Translation:
    vocabulary: Vocabulary
    first: ReadValues
    second: ReadValues
    lenient: bool

    def of(self, node: Node, answer: bool) -> Formula:  # noqa: FBT001 - a truth value
        """Return when a part of the condition amounts to ``answer``."""
        if node.name == "~":
            return self.of(node.args[0], not answer)
        if node.name in {"&", "|"}:
            parts = [self.of(part, answer) for part in node.args]
            return all_of(parts) if (node.name == "&") is answer else any_of(parts)
        if not isinstance(node, Condition) or any(part.name in AGGREGATES for part in node.walk()):
            return True  # over all endpoints of a side: left to the check
        return self.table(_bound(node, self.vocabulary), answer)

    def table(self, part: BoundCondition, answer: bool) -> Formula:  # noqa: FBT001 - a truth value
        """Return the combinations for which a part without operators gives the answer."""
        variables: dict[Variable, list[tuple[bool, int]]] = {}
        loose: dict[Variable, None] = {}
        for use in part.uses:
            for second in (False, True) if use.term.scope == "option" else (use.second,):
                side = self.second if second else self.first
                if use.index in side.variables:
                    variables.setdefault(side.variables[use.index], []).append((second, use.index))
                if use.index in side.loose:
                    loose[side.loose[use.index]] = None
        if prod(each.size for each in (*variables, *loose)) > _MOST_ROWS:
            return True
        excluded = self._excluded(part, variables, answer)
        if not excluded:
            return True
        if not loose:
            full = len(excluded) == prod(each.size for each in variables)
            return False if full else Table(tuple(variables), excluded)
        # Where anything changes that only a check understands, everything is possible.
        unchanged = (0,) * len(loose)
        return Table((*variables, *loose), frozenset((*row, *unchanged) for row in excluded))

    def _excluded(
        self,
        part: BoundCondition,
        variables: Mapping[Variable, Sequence[tuple[bool, int]]],
        answer: bool,  # noqa: FBT001
    ) -> frozenset[tuple[int, ...]]:
        sides = (self.first.values, self.second.values)
        read = tuple(sides[use.second][at] for use in part.uses for at in (use.index, use.index + part.vocabulary.size))
        numbers = {(second, at): number for number, ends in enumerate(variables.values()) for second, at in ends}
        places = tuple(numbers.get((use.second, use.index)) for use in part.uses)
        key = (
            part.condition.key,
            id(part.vocabulary),
            answer,
            self.lenient,
            read,
            places,
            *(each.values for each in variables),
        )
        found = _ANSWERS.get(key)
        if found is None:
            allowed = {answer, None} if self.lenient else {answer}
            rows = product(*(range(each.size) for each in variables))
            excluded = frozenset(row for row in rows if self._answer(part, variables, row) not in allowed)
            found = keep(_ANSWERS, key, excluded, _MOST_ANSWERS)
        return found

    def _answer(
        self, part: BoundCondition, variables: Mapping[Variable, Sequence[tuple[bool, int]]], row: Sequence[int]
    ) -> bool | None:
        sides = [list(self.first.values), list(self.second.values)]
        for (variable, ends), number in zip(variables.items(), row, strict=True):
            for second, at in ends if number else ():
                value = variable.values[number - 1]
                sides[second][at] = value
                domain = self.vocabulary.policies[at].domain
                sides[second][at + self.vocabulary.size] = WrittenValue(normalise(domain.format(value)), here=True)
        if self.first is self.second:
            sides[1] = sides[0]
        answer: bool | None = part.open(tuple(sides[0]), tuple(sides[1]), NO_SIGNAL)
        return answer
