"""Three-valued evaluation of conditions over values that may be open.

A profile's values are a tuple in the order of a `Vocabulary`; behind them stand the words they were written with,
as far as a rule asks for those (``stated``). A bound condition judges two such tuples: the first holds what
``offered``, ``publisher`` and the neutral scopes look up, the second what ``requested`` and ``subscriber`` look up.
For conditions over one endpoint both are the same tuple.

`cqos_core.language.binder` makes two forms of every condition. The plain form is for values that are all known, as most are.
The open form computes with ranges and answers None if the answer depends on an unknown value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core.language.values import KNOWN, Depends, Range, Values, settled, worlds_of
from cqos_core.model.caches import keep
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from cqos_core.language.expression import Condition
    from cqos_core.language.vocabulary import Use, Vocabulary


@dataclass(frozen=True, slots=True)
class Signal:
    """The endpoints an aggregate runs over: distinct value tuples with how many endpoints have them.

    ``memory`` caches results that depend on these endpoints only: a rule over one end is asked about each end of a topic.
    """

    publishers: tuple[tuple[Values, int], ...] = ()
    subscribers: tuple[tuple[Values, int], ...] = ()
    memory: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)

    def remembered(self, key: object, compute: Callable[[], Any]) -> Any:
        """Return the first result of ``compute`` under this key."""
        if key not in self.memory:
            self.memory[key] = compute()
        return self.memory[key]

    def under(self, world: Mapping[str, str], indices: tuple[int, ...]) -> Signal:
        """Return the same under the assumptions of ``world``, as far as a condition reads it at ``indices``."""
        publishers, subscribers = (
            tuple((settled(values, world, indices), number) for values, number in side)
            for side in (self.publishers, self.subscribers)
        )
        return Signal(publishers, subscribers)


NO_SIGNAL: Final = Signal()
Judge: TypeAlias = Callable[[Values, Values, Signal], Any]


def known_value(judge: Judge, a: Values, b: Values) -> Any:
    """Return the one known value of an operand; None where it is not known."""
    value = judge(a, b, NO_SIGNAL)
    if type(value) is Range and value.lo == value.hi:
        return value.lo
    return value if type(value) in KNOWN else None


_MOST_ANSWERS: Final = 2_000
"""Cached answers of each condition."""
_PLAIN: Final = KNOWN | {type(None)}


@dataclass(frozen=True, slots=True)
class RuleAnswer:
    """The answer of a condition: True, False or None; and its answer under each assumption that it depends on."""

    result: bool | None
    worlds: tuple[tuple[str, bool | None], ...] = ()


@dataclass(frozen=True)
class BoundCondition:
    """A condition bound to a vocabulary.

    Attributes:
        plain: judges two tuples whose used values are all known.
        open: judges any two tuples without `Depends`, answers None for unknown.
        uses: the terms outside aggregates; `aggregate_uses` those within.
        asked: indices of the policies whose spelling it asks for.
        memory: by the values that it reads, its answers where it is asked of them again and again.
        solved: what `cqos_core.language.solutions` found for values that it reads.
        partial: whether it may be unknown even of known values (a quotient by zero, a pack's own function, how a value was written).
    """

    condition: Condition
    vocabulary: Vocabulary
    plain: Judge = field(repr=False)
    open: Judge = field(repr=False)
    uses: tuple[Use, ...] = ()
    aggregate_uses: tuple[Use, ...] = ()
    asked: frozenset[int] = frozenset()
    partial: bool = False
    memory: dict[Values, RuleAnswer] = field(init=False, repr=False, compare=False, default_factory=dict)
    solved: dict[tuple[Any, ...], Sequence[Any]] = field(init=False, repr=False, compare=False, default_factory=dict)

    @cached_property
    def options(self) -> tuple[int, ...]:
        """The indices of options that it reads. They may differ between participants, so it reads them on both sides."""
        return tuple(use.index for use in self.uses if use.term.scope == "option")

    @cached_property
    def indices(self) -> tuple[int, ...]:
        """The indices of policies that it reads, on any side."""
        return tuple(dict.fromkeys(use.index for use in (*self.uses, *self.aggregate_uses)))

    @cached_property
    def sides(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The positions that it reads in the first and in the second tuple: values, and how they were written."""
        shared = {*self.options}
        first, second = (
            [use for use in self.uses if use.second is side or use.index in shared] for side in (False, True)
        )
        return self._read_by(first), self._read_by(second)

    @cached_property
    def own(self) -> tuple[int, ...]:
        """The positions that it reads outside aggregates, in either tuple."""
        return self._read_by(self.uses)

    @cached_property
    def aggregated(self) -> tuple[int, ...]:
        """The positions that it reads within aggregates."""
        return self._read_by(self.aggregate_uses)

    def _read_by(self, uses: Iterable[Use]) -> tuple[int, ...]:
        """Return the positions that terms read: values, and how they were written if the condition asks for that."""
        indices = dict.fromkeys(use.index for use in uses)
        return (*indices, *(index + self.vocabulary.size for index in indices if index in self.asked))

    @property
    def infallible(self) -> bool:
        """Whether judging known values cannot raise and leaves nothing open, whichever two endpoints have them."""
        return not (self.partial or self.aggregate_uses or self.options)

    def is_plain(self, values: Values) -> bool:
        """Whether everything the condition may read of ``values`` is known."""
        return all(type(values[use.index]) in _PLAIN for use in self.uses)

    def judge(self, a: Values, b: Values, signal: Signal = NO_SIGNAL) -> RuleAnswer:
        """Judge two value tuples by ranges of values; if that leaves the answer open, judge them in each of at most 64 worlds."""
        if self.aggregate_uses:
            return self._over_worlds(a, b, signal)
        # Many endpoints leave the same open, such as an option that is not set.
        return RuleAnswer(self.plain(a, b, NO_SIGNAL)) if self._are_plain(a, b) else self.recall(a, b)[0]

    def recall(self, a: Values, b: Values) -> tuple[RuleAnswer, bool]:
        """Judge two value tuples, with a cache by the values that it reads; return the answer, and whether it is new.

        A condition with aggregates is not asked so.
        """
        first, second = self.sides
        key = (*[a[index] for index in first], *[b[index] for index in second])
        answer = self.memory.get(key)
        if answer is not None:
            return answer, False
        plain = self._are_plain(a, b)
        answer = RuleAnswer(self.plain(a, b, NO_SIGNAL)) if plain else self._over_worlds(a, b, NO_SIGNAL)
        return keep(self.memory, key, answer, _MOST_ANSWERS), True

    def _are_plain(self, a: Values, b: Values) -> bool:
        """Whether everything that it may read of two tuples is known, and options are the same."""
        known = all(type(b[use.index] if use.second else a[use.index]) in _PLAIN for use in self.uses)
        return known and (a is b or all(a[index] == b[index] for index in self.options))

    def _over_worlds(self, a: Values, b: Values, signal: Signal) -> RuleAnswer:
        read = [(b if use.second else a)[use.index] for use in self.uses]
        if self.aggregate_uses:
            read += signal.remembered(id(self), lambda: self._assuming(signal))
        together = self._under({}, a, b, signal)
        worlds = worlds_of(read) if together is None else None
        if worlds is None or worlds == [{}]:
            return RuleAnswer(together)  # the answer in every world; or there are too many, or no assumption
        answers = [self._under(world, a, b, signal) for world in worlds]
        if len({*answers}) == 1:
            return RuleAnswer(answers[0])
        labels = [", ".join(f"{name}={case}" for name, case in world.items()) for world in worlds]
        return RuleAnswer(None, tuple(zip(labels, answers, strict=True)))

    def _under(self, world: Mapping[str, str], a: Values, b: Values, signal: Signal) -> bool | None:
        """Judge under the assumptions of ``world``."""
        first = settled(a, world, self.indices)
        second = first if b is a else settled(b, world, self.indices)
        if signal is not NO_SIGNAL:
            under = partial(signal.under, world, self.indices)
            signal = signal.remembered((self.indices, *world.items()), under)
        answer: bool | None = self.open(first, second, signal)
        return answer

    def _assuming(self, signal: Signal) -> tuple[Depends, ...]:
        """The values within aggregates that depend on assumptions, each once."""
        read = (
            values[use.index]
            for use in self.aggregate_uses
            for values, _ in (signal.subscribers if use.second else signal.publishers)
        )
        return tuple(dict.fromkeys(value for value in read if isinstance(value, Depends)))
