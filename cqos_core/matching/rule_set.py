"""Rules that are asked together: which of them may report on two profiles, by their compiled conditions.

A rule that reads what is not known, and one that is not compiled for certain, is left to `cqos_core.matching.judge`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.language.compiled import Common, Compiled, Question, compiled
from cqos_core.language.relation import positions
from cqos_core.language.values import ANYTHING, Anything
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.language.compiled import Reporting
    from cqos_core.language.values import Values
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import ProfileFrame, QosProfile

_MOST_REMEMBERED: Final = 200_000
_MOST_FUNCTIONS: Final = 256
_WORTH_A_FUNCTION: Final = 12
_WORTH_COMPILING: Final = 12
"""Times that a set is asked before it is compiled, which costs as much as about 20 of them."""


@dataclass(slots=True, eq=False)
class Surrounding:
    """What many profiles have in common on one side of rules: the values that are not known, and those of options.

    Attributes:
        values: those of one of them.
        at: the positions of what they have in common.
        open: bits of the rules that read what is not known.
        passed: bits of the rules that require what the middleware does not match on.
        options: values of the options that rules read.
        functions: by what stands on the other side, the rules compiled for both.
    """

    values: Values
    at: frozenset[int]
    open: int
    passed: int
    options: Values
    functions: dict[Surrounding, Compiled] = field(default_factory=dict)


Ready: TypeAlias = "tuple[Reporting, int, int]"
"""A function whose bits are of the rules that may report, the bits that count, and those of rules that then report for certain."""
Asking = Callable[["BoundRule", "QosProfile", "QosProfile"], "object | None"]
"""Asks one rule of two profiles; None where it has nothing to say."""


class _RuleSet:
    """Rules of a pack, compiled into one function when they are first asked."""

    one = False
    undecided: frozenset[str] = frozenset({"requires"})
    """Kinds of rules that have something to say where they are not decided."""

    def __init__(
        self,
        pack: RulePack,
        rules: Iterable[BoundRule],
        ask: Asking,
        absent: Callable[[BoundRule], Sequence[int]] = lambda _: (),
    ) -> None:
        """Put rules together; ``ask`` asks those that the function leaves open, ``absent``: what they read in vain."""
        self.pack = pack
        self.rules: Sequence[BoundRule] = tuple(rules)
        self._ask = ask
        self._absent = [frozenset(absent(each)) for each in self.rules]
        self._always = sum(1 << position for position, each in enumerate(self._absent) if each)
        self._functions = 0
        self._few = _WORTH_COMPILING
        self._uses = Counter[tuple[Surrounding, Surrounding]]()
        self._by_frame: tuple[dict[ProfileFrame, Surrounding], ...] = ({}, {})
        self._surroundings: tuple[dict[tuple[object, ...], Surrounding], ...] = ({}, {})
        self._read: dict[int, tuple[tuple[int, ...], tuple[int, ...]]] = {}
        self._answers: dict[tuple[object, ...], int] = {}

    @cached_property
    def compiled(self) -> Compiled:
        """Their conditions, as one function."""
        return compiled([Question(each.bound, each.rule.kind == "forbids") for each in self.rules], alone=self.one)

    @cached_property
    def _reading(self) -> tuple[dict[int, int], dict[int, int]]:
        """By side and position in the values, the bits of the rules that read it there."""
        found: tuple[dict[int, int], dict[int, int]] = ({}, {})
        for position in range(len(self.rules)):
            for second in (False, True):
                for index in self._read_by(position)[second]:
                    found[second][index] = found[second].get(index, 0) | 1 << position
        return found

    def _read_by(self, position: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return what a rule reads of each side."""
        bound = self.rules[position].bound
        return (bound.own, bound.own) if self.one else bound.sides

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
    def by_options(self) -> int:
        """The bits of the rules that read options."""
        return sum(1 << position for position, each in enumerate(self.rules) if each.bound.options)

    def surrounding(self, profile: QosProfile, *, second: bool = False) -> Surrounding:
        """Return what a profile has in common with others, as the rules read it on one side."""
        frame = profile.frame
        found = self._by_frame[second].get(frame)
        if found is None:
            if len(self._by_frame[second]) >= _MOST_REMEMBERED:
                self._by_frame[second].clear()
                self._surroundings[second].clear()
                self._uses.clear()
            found = self._by_frame[second][frame] = self._surrounding(profile, second=second)
        return found

    def _surrounding(self, profile: QosProfile, *, second: bool) -> Surrounding:
        reading, frame = self._reading[second], profile.frame
        opened = {index: value for index, value in frame.open.items() if index in reading}
        bits = passed = 0
        for index in opened:
            bits |= reading[index]
        for index in frame.unmatched:
            passed |= self._requiring.get(index, 0)
        options = tuple([frame.options[index] for index in self._options])
        # Why a value is not known decides nothing.
        unknown = tuple([(at, ANYTHING if isinstance(each, Anything) else each) for at, each in opened.items()])
        found = Surrounding(profile.values, frozenset((*opened, *self._options)), bits, passed, options)
        return self._surroundings[second].setdefault((unknown, passed, options), found)

    def ready(self, first: QosProfile, second: QosProfile, *, at_once: bool = False) -> Ready | None:
        """Return the function for what two profiles have in common with others; None before they are enough for one.

        ``at_once``: they are expected to be.
        """
        here, there = self.surrounding(first), self.surrounding(second, second=not self.one)
        function = here.functions.get(there) or (self._function(here, there) if at_once else None)
        every = (1 << len(self.rules)) - 1
        return function and (function.reporting, every & ~(here.passed | there.passed), function.exact)

    def may_report(self, first: QosProfile, second: QosProfile) -> int:
        """Return as bits the rules that report for certain or have to be asked."""
        certain, asked = self._sorted_out(first, second)
        return certain | asked

    def that_report(self, first: QosProfile, second: QosProfile) -> int:
        """Return as bits the rules that have something to say."""
        certain, asked = self.reporting(first, second)
        return certain | asked

    def _sorted_out(self, first: QosProfile, second: QosProfile) -> tuple[int, int]:
        """Return as bits the rules that report for certain, and those that have to be asked whether they do."""
        here, there = self.surrounding(first), self.surrounding(second, second=not self.one)
        function = here.functions.get(there) or self._counted(here, there)
        if function is None:
            if self._few:  # all are asked
                self._few -= 1
                return 0, ((1 << len(self.rules)) - 1) & ~(here.passed | there.passed)
            reporting, exact = self.compiled
            opened = here.open | there.open | self._always
            if here.options != there.options:
                opened |= self.by_options
            exact &= ~opened
        else:
            reporting, exact = function
            opened = 0
        found = reporting(first.known, second.known) | opened
        if found:
            found &= ~(here.passed | there.passed)
        return found & exact, found & ~exact

    def _counted(self, first: Surrounding, second: Surrounding) -> Compiled | None:
        """Return the function for what many profiles have in common, once they are enough to be worth it."""
        if len(self._uses) >= _MOST_REMEMBERED:
            self._uses.clear()
        self._uses[first, second] += 1
        return None if self._uses[first, second] < _WORTH_A_FUNCTION else self._function(first, second)

    def _function(self, first: Surrounding, second: Surrounding) -> Compiled:
        """Make the function for what many profiles have in common."""
        if self._functions >= _MOST_FUNCTIONS:
            for each in (*self._surroundings[0].values(), *self._surroundings[1].values()):
                each.functions.clear()
            self._functions = 0
            self._uses.clear()
        self._functions += 1
        common = Common(first.values, second.values, (first.at, second.at))
        questions = (self._question(*each, common) for each in zip(self.rules, self._absent, strict=True))
        found = first.functions[second] = compiled(questions, alone=self.one)
        return found

    def _question(self, bound: BoundRule, absent: frozenset[int], common: Common) -> Question:
        if absent:
            here, there, at = common
            here, there = (
                tuple(ANYTHING if at in absent else each for at, each in enumerate(one)) for one in (here, there)
            )
            common = Common(here, there, (at[0] | absent, at[1] | absent))
        undecided = bound.rule.kind in self.undecided and not absent
        return Question(bound.bound, bound.rule.kind == "forbids", undecided, common)

    def reporting(self, first: QosProfile, second: QosProfile) -> tuple[int, int]:
        """Return as bits the rules that report for certain, and those that were asked and have something to say."""
        certain, asked = self._sorted_out(first, second)
        return certain, self._asked(asked, first, second) if asked else 0

    def _asked(self, asked: int, first: QosProfile, second: QosProfile) -> int:
        """Ask some rules; what they say of equal values is known."""
        read = self._read.get(asked)
        if read is None:
            rules = [self._read_by(position) for position in positions(asked)]
            sides = (tuple(dict.fromkeys(at for each in rules for at in each[side])) for side in (0, 1))
            first_read, second_read = sides
            read = self._read[asked] = (first_read, second_read)
        here, there = first.values, second.values
        key = (asked, *[here[at] for at in read[0]], *[there[at] for at in read[1]])
        found = self._answers.get(key)
        if found is None:
            found = 0
            for position in positions(asked):
                if self._ask(self.rules[position], first, second) is not None:
                    found |= 1 << position
            if len(self._answers) >= _MOST_REMEMBERED:
                self._answers.clear()
            self._answers[key] = found
        return found


class PairRules(_RuleSet):
    """Rules over two profiles."""


class MeetingsLeftOpen(PairRules):
    """Meeting conditions, which say something where they are not decided."""

    undecided = frozenset({"meets"})


class EndRules(_RuleSet):
    """Rules over one profile, which stands on both sides and is alone where a rule speaks of all endpoints of a side."""

    one = True

    def of(self, profile: QosProfile) -> tuple[int, int]:
        """Return as bits the rules that report on a profile for certain, and those that were asked and have something to say."""
        return self.reporting(profile, profile)


class TopicRules(EndRules):
    """Rules over topics, asked of a profile; they say nothing where they are not decided."""

    undecided = frozenset()
