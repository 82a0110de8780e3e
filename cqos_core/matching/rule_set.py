"""Sets of rules: returns those that report on two profiles, by their compiled conditions.

A rule that reads unknown values, or is not compiled exactly, is asked by itself.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from cqos_core.language.condition_compiler import CommonValues, CompiledConditions, Question, compile_conditions
from cqos_core.language.relation import positions
from cqos_core.language.values import ANYTHING, Anything, Depends
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.values import Values
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.resolving.qos_profile import ProfileFrame, QosProfile

_MOST_REMEMBERED: Final = 200_000
_MOST_FUNCTIONS: Final = 256
_WORTH_A_FUNCTION: Final = 12
_WORTH_COMPILING: Final = 12
"""Evaluations of a set before it is compiled; compilation costs about 20 evaluations."""
EVERY: Final = -1
"""The bits of all rules."""

_Asking: TypeAlias = "Callable[[BoundRule, QosProfile, QosProfile], object | None]"


class RuleQuestion(NamedTuple):
    """A rule as a set asks it.

    Attributes:
        bound: the rule.
        by_itself: asks it of two profiles where a function does not tell; returns None where it has nothing to say.
        undecided: whether it has something to say where it is not decided; a matching condition only where that rests on assumptions.
        absent: positions of policies that it reads and its ends do not have.
    """

    bound: BoundRule
    by_itself: _Asking
    undecided: bool
    absent: frozenset[int] = frozenset()


@dataclass(slots=True, eq=False)
class SharedValues:
    """The values that many profiles share on one side of rules: unknown ones, and those of options.

    Attributes:
        values: those, at their places in the values of a profile.
        at: these places.
        open: bits of the rules that read unknown values.
        passed: bits of the rules over policies that the middleware does not match on.
        options: values of the options that rules read.
        functions: by the shared values of the other side, the rules compiled for both.
    """

    values: Values
    at: frozenset[int]
    open: int
    passed: int
    options: Values
    functions: dict[SharedValues, CompiledConditions] = field(default_factory=dict)


class RuleSet:
    """Rules of a pack, compiled for profiles with the same shared values after enough evaluations.

    Attributes:
        rules: in order; a rule has the bit of its place.
        bits: of the rules of each part.
        one: whether they are about one profile, which is on both sides and alone in aggregates.
    """

    def __init__(self, parts: Mapping[str, Iterable[RuleQuestion]], *, one: bool = False) -> None:
        """Put the rules of several parts together."""
        self.one = one
        self.bits: dict[str, int] = {}
        every: list[RuleQuestion] = []
        for name, asked in parts.items():
            before = len(every)
            every += asked
            self.bits[name] = (1 << len(every)) - (1 << before)
        self._each = tuple(every)
        self.rules: Sequence[BoundRule] = tuple([each.bound for each in self._each])
        self._always = sum(1 << position for position, each in enumerate(self._each) if each.absent)
        self._functions = 0
        self._few = _WORTH_COMPILING
        self._uses = Counter[tuple[SharedValues, SharedValues]]()
        self._by_frame: tuple[dict[ProfileFrame, SharedValues], ...] = ({}, {})
        self._surroundings: tuple[dict[tuple[object, ...], SharedValues], ...] = ({}, {})

    @cached_property
    def compiled(self) -> CompiledConditions:
        """Their conditions, as one function of values that are all known."""
        return compile_conditions(
            [Question(each.bound, each.rule.kind == "forbids") for each in self.rules], alone=self.one
        )

    @cached_property
    def _reading(self) -> tuple[dict[int, int], dict[int, int]]:
        """By side and position in the values, the bits of the rules that read it there."""
        found: tuple[dict[int, int], dict[int, int]] = ({}, {})
        for position, each in enumerate(self.rules):
            for second in (False, True):
                for index in each.bound.own if self.one else each.bound.sides[second]:
                    found[second][index] = found[second].get(index, 0) | 1 << position
        return found

    @cached_property
    def _requiring(self) -> dict[int, int]:
        """By policy, the bits of the rules that require anything of it."""
        found: dict[int, int] = {}
        for position, each in enumerate(self.rules):
            for use in each.bound.uses if each.rule.kind == "requires" and not self.one else ():
                found[use.index] = found.get(use.index, 0) | 1 << position
        return found

    @cached_property
    def _options(self) -> tuple[int, ...]:
        return tuple(dict.fromkeys(index for each in self.rules for index in each.bound.options))

    @cached_property
    def _by_options(self) -> int:
        """The bits of the rules that read options."""
        return sum(1 << position for position, each in enumerate(self.rules) if each.bound.options)

    def _surrounding(self, profile: QosProfile, *, second: bool) -> SharedValues:
        """Return the values that a profile shares with others, as the rules read them on one side."""
        frame = profile.frame
        found = self._by_frame[second].get(frame)
        if found is None:
            if len(self._by_frame[second]) >= _MOST_REMEMBERED:
                self._by_frame[second].clear()
                self._surroundings[second].clear()
                self._uses.clear()
            found = self._by_frame[second][frame] = self._in_common(frame, len(profile.known), second=second)
        return found

    def _in_common(self, frame: ProfileFrame, size: int, *, second: bool) -> SharedValues:
        reading = self._reading[second]
        opened = {index: value for index, value in frame.open.items() if index in reading}
        bits = passed = 0
        for index in opened:
            bits |= reading[index]
        for index in frame.unmatched:
            passed |= self._requiring.get(index, 0)
        options = tuple([frame.options[index] for index in self._options])
        # Why a value is not known decides nothing.
        unknown = tuple([(at, ANYTHING if isinstance(each, Anything) else each) for at, each in opened.items()])
        known = {**frame.options, **opened}
        values = tuple([known.get(at) for at in range(size)])
        found = SharedValues(values, frozenset((*opened, *self._options)), bits, passed, options)
        return self._surroundings[second].setdefault((unknown, passed, options), found)

    def _surroundings_of(self, first: QosProfile, second: QosProfile) -> tuple[SharedValues, SharedValues]:
        return self._surrounding(first, second=False), self._surrounding(second, second=not self.one)

    def function(self, first: QosProfile, second: QosProfile, *, at_once: bool = False) -> CompiledConditions | None:
        """Return the function for what two profiles have in common with others; None before they are enough for one.

        ``at_once``: they are expected to be.
        """
        here, there = self._surroundings_of(first, second)
        return here.functions.get(there) or (self._function(here, there) if at_once else None)

    def that_report(self, first: QosProfile, second: QosProfile, among: int = EVERY) -> int:
        """Return as bits the rules that have something to say."""
        certain, asked = self.reporting(first, second, among)
        return certain | asked

    def reporting(self, first: QosProfile, second: QosProfile, among: int = EVERY) -> tuple[int, int]:
        """Return as bits the rules that report for certain, and those that were asked by themselves and have something to say."""
        certain, left = self._sorted_out(first, second)
        left &= among
        return certain & among, self._asked(left, first, second) if left else 0

    def _asked(self, left: int, first: QosProfile, second: QosProfile) -> int:
        found = 0
        for position in positions(left):
            if self.ask(position, first, second) is not None:
                found |= 1 << position
        return found

    def ask(self, position: int, first: QosProfile, second: QosProfile) -> object | None:
        """Ask one rule by itself; None where it has nothing to say."""
        each = self._each[position]
        return each.by_itself(each.bound, first, second)

    def _sorted_out(self, first: QosProfile, second: QosProfile) -> tuple[int, int]:
        """Return as bits the rules that certainly report, and those that have to be evaluated."""
        here, there = self._surroundings_of(first, second)
        function = here.functions.get(there) or self._counted(here, there)
        if function is not None:
            reporting, exact = function
            found = reporting(first.known, second.known)
            return found & exact, found & ~exact
        counted = ((1 << len(self.rules)) - 1) & ~(here.passed | there.passed)
        if self._few:  # all are asked
            self._few -= 1
            return 0, counted
        reporting, exact = self.compiled
        opened = here.open | there.open | self._always
        if here.options != there.options:
            opened |= self._by_options
        exact &= ~opened
        found = (reporting(first.known, second.known) | opened) & counted
        return found & exact, found & ~exact

    def _counted(self, first: SharedValues, second: SharedValues) -> CompiledConditions | None:
        """Return the function for what many profiles have in common, once they are enough to be worth it."""
        if len(self._uses) >= _MOST_REMEMBERED:
            self._uses.clear()
        self._uses[first, second] += 1
        return None if self._uses[first, second] < _WORTH_A_FUNCTION else self._function(first, second)

    def _function(self, first: SharedValues, second: SharedValues) -> CompiledConditions:
        """Make the function for what many profiles have in common."""
        if self._functions >= _MOST_FUNCTIONS:
            for each in (*self._surroundings[0].values(), *self._surroundings[1].values()):
                each.functions.clear()
            self._functions = 0
            self._uses.clear()
        self._functions += 1
        passed, common = first.passed | second.passed, CommonValues(first.values, second.values, (first.at, second.at))
        questions = [
            None if passed >> position & 1 else self._question(each, common) for position, each in enumerate(self._each)
        ]
        found = first.functions[second] = compile_conditions(questions, alone=self.one)
        return found

    def _question(self, asked: RuleQuestion, common: CommonValues) -> Question:
        bound, _, undecided, absent = asked
        if bound.rule.kind == "meets" and undecided:
            undecided = any(
                isinstance(values[at], Depends)
                for values, read in zip(common[:2], bound.bound.sides, strict=True)
                for at in read
            )
        if absent:
            here, there, at = common
            here, there = (
                tuple([ANYTHING if at in absent else each for at, each in enumerate(one)]) for one in (here, there)
            )
            common = CommonValues(here, there, (at[0] | absent, at[1] | absent))
        return Question(bound.bound, bound.rule.kind == "forbids", undecided and not absent, common)
