"""The verdict of two profiles that are alone on their topic and need no guarantee, by compiled rules.

`cqos_core.matching.judge.verdict_alone` is what it means.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.compiled import Question, ranked
from cqos_core.language.relation import positions
from cqos_core.matching.judge import (
    ask,
    meeting_rules,
    of_end,
    of_one,
    pair_rules,
    refuses_topic,
    refusing_rules,
    undecided_meeting,
    verdict_by,
    verdict_of,
)
from cqos_core.matching.rule_set import PairRules
from cqos_core.model.memory import keep
from cqos_core.model.report import Verdict
from cqos_core.model.system import SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cqos_core.language.compiled import Reporting
    from cqos_core.language.values import Values
    from cqos_core.matching.judge import Violation
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved import ProfileFrame, QosProfile, Unmade

_COMPATIBLE, _UNKNOWN, _INCOMPATIBLE, _APART, _ASK = range(5)
_VERDICTS: Final = (Verdict.COMPATIBLE, Verdict.UNKNOWN, Verdict.INCOMPATIBLE, Verdict.UNKNOWN)
_MOST_ANSWERS: Final = 200_000
_MOST_BESIDE: Final = 1_000
_MOST_RANKS: Final = 10_000


class PairEnd:
    """One end of a pair.

    Attributes:
        like: its profile, or where it has a draft of that one with the same frame and codes.
        values: those of its profile that are known.
        open: as that of `Surrounding`.
        beside: what else decides; equal ones are one object.
        draft: of its profile, where that is not made yet.
        parts: numbers of values, by the rules that read them.
    """

    __slots__ = ("beside", "draft", "like", "open", "parts", "values")

    def __init__(self, like: QosProfile, kind: _EndKind, draft: Unmade | None) -> None:
        """Take what it has in common with other ends."""
        self.like = like
        self.values: Sequence[Any] = like.known if draft is None else draft.known
        self.open = kind.open
        self.beside = kind.beside
        self.draft = draft
        self.parts: dict[int, int] = {}

    @property
    def profile(self) -> QosProfile:
        """Its profile; most verdicts need none."""
        return self.like if self.draft is None else self.draft.made()[0]


class _Weight(NamedTuple):
    """What decides beside the values of an end.

    Attributes:
        passed, options: those of `Surrounding`.
        rank: of the verdict that any pair of it has at best.
        plain: none of these says anything.
    """

    passed: int
    options: Values
    rank: int
    plain: bool


class _EndKind(NamedTuple):
    """What ends have in common whose profiles differ in known values only.

    Attributes:
        open: that of each of them.
        beside: that of those that no rule about one endpoint reports.
        tests: functions that tell which of these rules may report on values, each with the bits that count; None where more decides.
    """

    open: int
    beside: _Weight
    tests: Sequence[tuple[Reporting, int]] | None


class Short(NamedTuple):
    """The short way to verdicts of ends that are like two others in all but values that rules compare.

    Attributes:
        rank: takes the values of a publisher and a subscriber, and returns the position of their verdict.
        verdicts: these; None where the pair has to be judged as any other.
        ends: the two others.
        asked: the rules that they leave open, as bits.
    """

    rank: Reporting
    verdicts: tuple[Verdict | None, ...]
    ends: tuple[PairEnd, PairEnd]
    asked: int


class _Ranks(dict[int, int]):
    """The rank of what rules certainly report, by their bits; worked out once for the same ones."""

    def __init__(self, rank: Callable[[int], int]) -> None:
        super().__init__()
        self._rank = rank

    def __missing__(self, reported: int) -> int:
        if len(self) >= _MOST_RANKS:
            self.clear()
        rank = self[reported] = self._rank(reported)
        return rank


class Verdicts:
    """Gives verdicts of pairs of one pack."""

    def __init__(self, pack: RulePack) -> None:
        """Compile the rules of pairs and meetings, without those of guarantees."""
        meets, pair = meeting_rules(pack).rules, pair_rules(pack).rules
        self._rules = PairRules(pack, (*meets, *pair), _ask_pair)
        self._signals = [each for each in pack.by_scope.get("signal", ()) if each.rule.severity == "error"]
        self._apart = (1 << len(meets)) - 1
        by_verdict = dict.fromkeys(Verdict, 0)
        for position, each in enumerate(pair, len(meets)):
            by_verdict[verdict_by(each.rule, unknown=False)] |= 1 << position
        self._incompatible, self._unknown = by_verdict[Verdict.INCOMPATIBLE], by_verdict[Verdict.UNKNOWN]
        # A bit beyond those of the rules stands for the rules over topics.
        self._always = 1 << len(self._rules.rules) if self._signals else 0
        self._kinds: dict[tuple[object, ...], _EndKind] = {}
        self._read: dict[tuple[int, bool, ProfileFrame], tuple[int, tuple[int, ...]]] = {}
        self._next = count(1)
        self._numbers: dict[tuple[object, ...], int] = {}
        self._answers: dict[tuple[int, int], int] = {}
        self._beside: dict[_Weight, _Weight] = {}

    def end(self, like: QosProfile, role: str, draft: Unmade | None = None) -> PairEnd:
        """Return a profile, or the draft of one that is like it, as an end of pairs."""
        key = (like.frame, like.refused, like.unread, role)
        kind = self._kinds.get(key) or self._kind(key, like, role, at_once=draft is not None)
        end = PairEnd(like, kind, draft)
        values = end.values
        if kind.tests is None or any(reporting(values, values) & counted for reporting, counted in kind.tests):
            rank = max((each.rank for each, _ in of_end(end.profile, role, False, False)), default=_COMPATIBLE)
            end.beside = self._weight(kind.beside.passed, kind.beside.options, rank)
        return end

    def _kind(self, key: tuple[object, ...], like: QosProfile, role: str, *, at_once: bool) -> _EndKind:
        """Return what ends like a profile have in common; ``at_once``: many of them are expected."""
        around = self._rules.surrounding(like, second=role == SUBSCRIBER)
        beside = self._weight(around.passed, around.options, _COMPATIBLE)
        asked = of_one(like.pack, role, False), refusing_rules(like.pack, False)
        found = [rules.ready(like, like, at_once=at_once) for rules in asked]
        decided = None if like.refused or like.unread or None in found else [each[:2] for each in found if each]
        kind = _EndKind(around.open | self._always, beside, decided)
        if None not in found:
            keep(self._kinds, key, kind)
        return kind

    def _weight(self, passed: int, options: Values, rank: int) -> _Weight:
        """Return the one object of what decides beside values."""
        if len(self._beside) >= _MOST_BESIDE:
            self._beside.clear()
        beside = _Weight(passed, options, rank, not (passed or rank))
        return self._beside.setdefault(beside, beside)

    @cached_property
    def verdict(self) -> Callable[[PairEnd, PairEnd], Verdict]:
        """Return what gives the verdict of a publisher and a subscriber: one function, whose look-ups are done before."""
        reporting, exact = self._rules.compiled
        inexact, by_options = ~exact, self._rules.by_options
        answers, verdicts, ask_open = self._answers, _VERDICTS, self._asked
        ranks = _Ranks(self._certain)

        def verdict(offering: PairEnd, requesting: PairEnd) -> Verdict:
            found = reporting(offering.values, requesting.values)
            asked = offering.open | requesting.open | found & inexact
            here, there = offering.beside, requesting.beside
            if here is there and here.plain:
                rank = ranks[found & ~asked]
            else:
                if here.options != there.options:
                    asked |= by_options
                counted = ~(here.passed | there.passed)
                asked &= counted
                rank = max(ranks[found & ~asked & counted], here.rank, there.rank)
            if asked:
                try:
                    said = answers[offering.parts[asked], requesting.parts[asked]]
                except KeyError:
                    said = ask_open(asked, offering, requesting)
                rank = max(rank, said)
            return verdicts[rank]

        return verdict

    def short(self, offering: PairEnd, requesting: PairEnd) -> Short | None:
        """Return the short way for ends like these two; None where they differ in options, as it needs equal ones."""
        here, there = offering.beside, requesting.beside
        if here.options != there.options:
            return None
        passed = here.passed | there.passed
        asked = (offering.open | requesting.open) & ~passed
        questions = [
            (Question(each.bound, each.rule.kind == "forbids"), self._certain(1 << position))
            for position, each in enumerate(self._rules.rules)
            if not (asked | passed) >> position & 1
        ]
        least = max(here.rank, there.rank, self._asked(asked, offering, requesting) if asked else _COMPATIBLE)
        verdicts = (*[_VERDICTS[max(rank, least)] for rank in range(_ASK)], None)
        return Short(ranked(questions, _ASK), verdicts, (offering, requesting), asked)

    def is_short(self, way: Short, end: PairEnd, role: str) -> bool:
        """Whether an end may go the short way."""
        second = role == SUBSCRIBER
        like, asked = way.ends[second], way.asked
        if end.open != like.open or end.beside is not like.beside:
            return False
        return not asked or self._part(asked, end, second=second) == self._part(asked, like, second=second)

    def _certain(self, reported: int) -> int:
        """Return the rank of what rules certainly report."""
        if reported & self._apart:
            return _APART
        return _INCOMPATIBLE if reported & self._incompatible else _UNKNOWN if reported & self._unknown else _COMPATIBLE

    def _part(self, asked: int, end: PairEnd, *, second: bool) -> int:
        """Return the number of the values that some rules, and those over topics, read of an end; none is 0."""
        key = (asked, second, end.like.frame)
        opened, read = self._read.get(key) or self._reading(key)
        values = end.values
        number = end.parts[asked] = self._number((opened, *[values[at] for at in read]))
        return number

    def _reading(self, key: tuple[int, bool, ProfileFrame]) -> tuple[int, tuple[int, ...]]:
        """Return what some rules, and those over topics, read of ends: a number for what is not known, and where the rest stands."""
        asked, second, frame = key
        rules = [self._rules.rules[position] for position in positions(asked & ~self._always)]
        found = [at for each in rules for at in each.bound.sides[second]]
        found += [at for each in self._signals for at in (*each.bound.own, *each.bound.aggregated)]
        # A value that depends on an assumption leaves a meeting condition open on either side.
        found += [at for each in rules if each.rule.kind == "meets" for at in each.bound.indices]
        opened = [(at, frame.open[at]) for at in dict.fromkeys(found) if at in frame.open]
        read = tuple(at for at in dict.fromkeys(found) if at not in frame.open)
        reading = self._number((asked, second, *opened)), read
        keep(self._read, key, reading)
        return reading

    def _number(self, key: tuple[object, ...]) -> int:
        """Return a number that stands for values; one that was forgotten gets another."""
        if len(self._numbers) >= _MOST_ANSWERS:
            self._numbers.clear()
        return self._numbers.setdefault(key, next(self._next))

    def _asked(self, asked: int, offering: PairEnd, requesting: PairEnd) -> int:
        """Return the rank of what the rules say that their function leaves open, and those over topics."""
        first = offering.parts.get(asked) or self._part(asked, offering, second=False)
        second = requesting.parts.get(asked) or self._part(asked, requesting, second=True)
        said = self._answers.get((first, second))
        return self._ask((first, second), asked, offering.profile, requesting.profile) if said is None else said

    def _ask(self, key: tuple[int, int], asked: int, offering: QosProfile, requesting: QosProfile) -> int:
        """Ask these rules."""
        rank = _COMPATIBLE
        for position in positions(asked & ~self._always):
            rank = max(rank, _rank(self._rules.rules[position], offering, requesting))
        if any(refuses_topic(each, offering, requesting) for each in self._signals):
            rank = max(rank, _INCOMPATIBLE)
        if len(self._answers) >= _MOST_ANSWERS:
            self._answers.clear()
        self._answers[key] = rank
        return rank


@lru_cache
def verdicts_of(pack: RulePack) -> Verdicts:
    """Return what gives verdicts of a pack's pairs."""
    return Verdicts(pack)


def _rank(bound: BoundRule, offering: QosProfile, requesting: QosProfile) -> int:
    if bound.rule.kind == "meets":
        if bound.bound.judge(offering.values, requesting.values).result is False:
            return _APART
        return _UNKNOWN if undecided_meeting(bound, offering, requesting) else _COMPATIBLE
    spoken = _ask_pair(bound, offering, requesting)
    return _COMPATIBLE if spoken is None else verdict_of(spoken).rank


def _ask_pair(bound: BoundRule, offering: QosProfile, requesting: QosProfile) -> Violation | None:
    return ask(bound, offering.values, requesting.values)
