"""What sentences mean: binding them to policies and judging them, three-valued, over values that may be open.

A profile's values are a tuple in the order of a `Vocabulary`; behind them stand the words they were written with,
as far as a rule asks for those (``stated``). A bound sentence judges two such tuples: the first holds what
``offered``, ``publisher`` and the neutral scopes look up, the second what ``requested`` and ``subscriber`` look up.
For sentences over one endpoint both are the same tuple.

Every sentence is compiled twice: a plain form for values that are all known, which is most of them, and an open
form that reckons with ranges and answers None where the answer depends on what is not known.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from itertools import product
from math import prod
from types import NoneType
from typing import Any, Final, NamedTuple, TypeAlias

from cqos_core.language.expression import (
    AGGREGATES,
    SCOPES,
    And,
    Apply,
    Arithmetic,
    Compare,
    Holds,
    Literal,
    Node,
    Not,
    Operand,
    Or,
    Sentence,
    Term,
    Test,
)
from cqos_core.language.policy import (
    ENDPOINT,
    INFINITE,
    NEED,
    Anything,
    Count,
    Depends,
    Domain,
    Duration,
    Flag,
    FromPeers,
    Names,
    Policy,
    Text,
    Value,
)
from cqos_core.model.problems import InvalidValueError, PackError, SentenceError

MAXIMUM_WORLDS: Final = 64


class Range(NamedTuple):
    """Every value from ``lo`` to ``hi``, inclusive."""

    lo: Any
    hi: Any


class WrittenValue(NamedTuple):
    """How a value was written: the normalised word, and whether it stands at the endpoint itself, not in a profile."""

    word: str
    here: bool


UNREAD: Final = WrittenValue("", here=False)
"""How a value was written that was not understood: perhaps not at all."""


Values: TypeAlias = tuple[Any, ...]
"""A value per policy of a vocabulary, then per policy a `WrittenValue` or None."""


@dataclass(frozen=True, slots=True)
class Signal:
    """The endpoints an aggregate runs over: distinct value tuples with how many endpoints have them.

    ``memory`` holds what follows from them alone, as a rule over one end is asked about each end of a topic.
    """

    publishers: tuple[tuple[Values, int], ...] = ()
    subscribers: tuple[tuple[Values, int], ...] = ()
    memory: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)

    def remembered(self, key: object, compute: Callable[[], Any]) -> Any:
        """Return what ``compute`` returned first under this key."""
        if key not in self.memory:
            self.memory[key] = compute()
        return self.memory[key]


NO_SIGNAL: Final = Signal()
Judge: TypeAlias = Callable[[Values, Values, Signal], Any]


@dataclass(frozen=True, slots=True)
class Function:
    """A named function of a pack, for what the language cannot say.

    Attributes:
        call: takes plain values, returns True, False or None for unknown.
        doc: one sentence.
        column: whether it also works on columns, for engines of columns; C-QoS has none yet. ``cqos packs`` lists those that do not.
        many: where ``call`` compares a value of the publisher, its first argument, with one of the subscriber, its second, and
            never answers None: the same for many at once. It takes the distinct first values, the distinct second ones, each
            with a set of bits, and the further arguments. It returns per first value the bits of all second ones for which
            ``call`` is True. Without it every combination is asked about.
    """

    name: str
    call: Callable[..., bool | None]
    doc: str = ""
    column: bool = False
    many: Callable[..., Sequence[int]] | None = None


_LEVELS: Final = {
    "own": (ENDPOINT,),
    "offered": (ENDPOINT, NEED),
    "requested": (ENDPOINT, NEED),
    "topic": ("topic",),
    "publisher": ("participant", "option"),
    "subscriber": ("participant", "option"),
    "participant": ("participant", "option"),
    "broker": ("broker",),
    "option": ("option",),
}
SECOND_SCOPES: Final = frozenset({"requested", "subscriber"})
"""What looks up values of the second tuple."""


class Vocabulary:
    """The policies of a pack, each with its index in a values tuple, and the functions its sentences may use."""

    def __init__(self, policies: Iterable[Policy], functions: Iterable[Function] = ()) -> None:
        """Number the policies in the order given."""
        self.policies = tuple(policies)
        self.functions = {function.name: function for function in functions}
        self.size = len(self.policies)
        self.indices = {(policy.level, policy.name): index for index, policy in enumerate(self.policies)}
        self.following: dict[str, tuple[int, ...]] = {}
        for index, policy in enumerate(self.policies):
            for name in policy.follows:
                self.following[name] = (*self.following.get(name, ()), index)
        if len(self.indices) != self.size:
            message = "a policy is declared twice: " + ", ".join(p.name for p in self.policies)
            raise PackError(message)

    @cached_property
    def _unbounded(self) -> Mapping[int, tuple[Value, ...]]:
        return {at: self.policies[at].unbounded for found in self.following.values() for at in found}

    def follows(self, name: str, values: Values) -> list[int]:
        """Return where values follow from a policy, unless they bound nothing."""
        return [at for at in self.following.get(name, ()) if values[at] not in self._unbounded[at]]

    def find(self, term: Term) -> int:
        """Return the index of a term's policy.

        Raises:
            SentenceError: naming the known policies.
        """
        for level in _LEVELS[term.scope]:
            index = self.indices.get((level, term.name))
            if index is not None:
                return index
        levels = [level for level in _LEVELS[term.scope] if level != NEED]
        known = ", ".join(name for level, name in self.indices if level in levels) or "none"
        message = f"`{term}` names no policy at {' or '.join(levels)} level; known: {known}"
        raise SentenceError(message)


@dataclass(frozen=True, slots=True)
class Use:
    """A term of a bound sentence: which tuple it reads, at which index."""

    second: bool
    index: int
    term: Term


@dataclass(frozen=True, slots=True)
class RuleAnswer:
    """What a sentence amounts to: True, False or None, and under which assumption what, where it depends on any."""

    result: bool | None
    worlds: tuple[tuple[str, bool | None], ...] = ()


@dataclass(frozen=True, slots=True)
class BoundCondition:
    """A sentence bound to a vocabulary.

    Attributes:
        plain: judges two tuples whose used values are all known.
        open: judges any two tuples without `Depends`, answers None for unknown.
        uses: the terms outside aggregates; `aggregate_uses` those within.
        asked: indices of the policies of which it asks how they were written.
        partial: whether it may be unknown even of known values (a quotient by zero, a pack's own function).
        sides: where it looks in the first and in the second tuple, at values and at how they were written.
        own: where it looks outside aggregates, in whichever tuple; `aggregated` where within.
    """

    sentence: Sentence
    vocabulary: Vocabulary
    plain: Judge = field(repr=False)
    open: Judge = field(repr=False)
    uses: tuple[Use, ...] = ()
    aggregate_uses: tuple[Use, ...] = ()
    asked: frozenset[int] = frozenset()
    partial: bool = False
    reads: tuple[tuple[Use, int], ...] = field(init=False, repr=False, default=())
    options: tuple[int, ...] = field(init=False, repr=False, default=())
    indices: tuple[int, ...] = field(init=False, repr=False, default=())
    sides: tuple[tuple[int, ...], tuple[int, ...]] = field(init=False, repr=False, default=((), ()))
    own: tuple[int, ...] = field(init=False, repr=False, default=())
    aggregated: tuple[int, ...] = field(init=False, repr=False, default=())
    memory: dict[Values, RuleAnswer] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Number everything the sentence reads: values and how they were written, options on both sides."""
        size = self.vocabulary.size
        both = [Use(True, use.index, use.term) for use in self.uses if use.term.scope == "option"]
        reads = [(use, use.index) for use in (*self.uses, *both)]
        reads += [(use, index + size) for use, index in reads if index in self.asked]
        object.__setattr__(self, "reads", tuple(reads))
        object.__setattr__(self, "options", tuple(use.index for use in both))
        every = (*self.uses, *both, *self.aggregate_uses)
        object.__setattr__(self, "indices", tuple(dict.fromkeys(use.index for use in every)))
        # An option may differ between participants, so a sentence over one reads it on both sides.
        sides = (
            self._read_by(use for use in self.uses if use.second is second or use.term.scope == "option")
            for second in (False, True)
        )
        object.__setattr__(self, "sides", tuple(sides))
        object.__setattr__(self, "own", self._read_by(self.uses))
        object.__setattr__(self, "aggregated", self._read_by(self.aggregate_uses))

    def _read_by(self, uses: Iterable[Use]) -> tuple[int, ...]:
        """Where terms look: at values, and at how they were written where the sentence asks for that."""
        indices = dict.fromkeys(use.index for use in uses)
        return (*indices, *(index + self.vocabulary.size for index in indices if index in self.asked))

    @property
    def infallible(self) -> bool:
        """Whether judging known values cannot raise and leaves nothing open, whichever two endpoints have them."""
        return not (self.partial or self.aggregate_uses or self.options)

    def is_plain(self, values: Values) -> bool:
        """Whether everything the sentence may read of ``values`` is known."""
        return all(type(values[use.index]) in _PLAIN for use in self.uses)

    def judge(self, a: Values, b: Values, signal: Signal = NO_SIGNAL) -> RuleAnswer:
        """Judge two value tuples, each assumption in play taken apart (at most 64 worlds, set reasoning beyond)."""
        if (
            not self.aggregate_uses
            and all(type(b[use.index] if use.second else a[use.index]) in _PLAIN for use in self.uses)
            and (a is b or all(a[index] == b[index] for index in self.options))
        ):
            return RuleAnswer(self.plain(a, b, NO_SIGNAL))
        if self.aggregate_uses:
            return self._over_worlds(a, b, signal)
        # What is open is open alike for many endpoints (an option that nobody set), so answers are remembered.
        key = tuple((b if use.second else a)[at] for use, at in self.reads)
        outcome = self.memory.get(key)
        if outcome is None:
            if len(self.memory) >= _MEMORY:
                self.memory.clear()
            outcome = self.memory[key] = self._over_worlds(a, b, signal)
        return outcome

    def _over_worlds(self, a: Values, b: Values, signal: Signal) -> RuleAnswer:
        variables = self._variables(a, b, signal)
        worlds = 1
        for cases in variables.values():
            worlds *= len(cases)
        if worlds == 1 or worlds > MAXIMUM_WORLDS:
            return RuleAnswer(self.open(*_settle_all(a, b, signal, {}, self.indices)))
        results = []
        for chosen in product(*variables.values()):
            world = dict(zip(variables, chosen, strict=True))
            label = ", ".join(f"{name}={case}" for name, case in world.items())
            results.append((label, self.open(*_settle_all(a, b, signal, world, self.indices))))
        distinct = {result for _, result in results}
        return RuleAnswer(distinct.pop()) if len(distinct) == 1 else RuleAnswer(None, tuple(results))

    def _variables(self, a: Values, b: Values, signal: Signal) -> dict[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        for use in self.uses:
            collect_variables((b if use.second else a)[use.index], found)
        if self.aggregate_uses:
            for _, value in signal.remembered(id(self), lambda: self._assuming(signal)):
                collect_variables(value, found)
        return dict(sorted(found.items()))

    def _assuming(self, signal: Signal) -> list[tuple[Use, Depends]]:
        """The values within aggregates that depend on assumptions, each once."""
        found: dict[tuple[Use, Depends], None] = {}
        for use in self.aggregate_uses:
            for values, _ in signal.subscribers if use.second else signal.publishers:
                value = values[use.index]
                if isinstance(value, Depends):
                    found[use, value] = None
        return list(found)

    def worlds(self, firsts: Sequence[Values], seconds: Sequence[Values]) -> Iterator[dict[str, str]] | None:
        """Yield every assignment of the assumptions in play among many values; None where there are too many."""
        found: dict[str, tuple[str, ...]] = {}
        for use in self.uses:
            for values in seconds if use.second else firsts:
                collect_variables(values[use.index], found)
        if prod(map(len, found.values())) > MAXIMUM_WORLDS:
            return None
        return (dict(zip(found, chosen, strict=True)) for chosen in product(*found.values()))


_PLAIN: Final = frozenset({int, str, tuple, bool, type(None)})
_MEMORY: Final = 10_000


def collect_variables(value: Any, found: dict[str, tuple[str, ...]]) -> None:
    """Add the assumptions that ``value`` depends on, with their cases, to ``found``."""
    if isinstance(value, Depends):
        names = tuple(name for name, _ in value.cases)
        known = found.get(value.on)
        found[value.on] = names if known is None else tuple(dict.fromkeys((*known, *names)))
        for _, case in value.cases:
            collect_variables(case, found)


def in_world(value: Any, world: Mapping[str, str]) -> Any:
    """Return ``value`` under the assumptions of ``world``; what they leave open stays `Anything` or a `Range`."""
    while isinstance(value, Depends):
        cases = dict(value.cases)
        case = world.get(value.on)
        if case is None or case not in cases:
            inner = [in_world(v, world) for v in cases.values()]
            if all(isinstance(v, int) for v in inner):
                return Range(min(inner), max(inner))
            return inner[0] if len(set(inner)) == 1 else Anything(f"it depends on {value.on}")
        value = cases[case]
    return Anything("it is taken from peers") if isinstance(value, FromPeers) else value


def settled(values: Values, world: Mapping[str, str], indices: Iterable[int]) -> Values:
    """Return ``values`` with what a sentence reads, at ``indices``, under the assumptions of ``world``."""
    opened = [index for index in indices if isinstance(values[index], (Depends, FromPeers))]
    if not opened:
        return values
    known = list(values)
    for index in opened:
        known[index] = in_world(values[index], world)
    return tuple(known)


def _settle_all(
    a: Values, b: Values, signal: Signal, world: Mapping[str, str], indices: tuple[int, ...]
) -> tuple[Values, Values, Signal]:
    first = settled(a, world, indices)
    second = first if b is a else settled(b, world, indices)
    if signal is NO_SIGNAL:
        return first, second, signal

    def under() -> Signal:
        return Signal(
            tuple((settled(values, world, indices), n) for values, n in signal.publishers),
            tuple((settled(values, world, indices), n) for values, n in signal.subscribers),
        )

    return first, second, signal.remembered((indices, *world.items()), under)


_OPERATORS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "<": operator.lt,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">=": operator.ge,
    ">": operator.gt,
}
MIRRORED: Final = {"<": ">", "<=": ">=", "==": "==", "!=": "!=", ">=": "<=", ">": "<"}


def _range(value: Any) -> Range | None:
    if isinstance(value, Range):
        return value
    return Range(value, value) if isinstance(value, int) else None


def compare_open(op: str, left: Any, right: Any) -> bool | None:
    """Compare two values of which either may be a `Range` or unknown (`Anything`, None)."""
    if type(left) in KNOWN and type(right) in KNOWN:
        return bool(_OPERATORS[op](left, right))
    x, y = _range(left), _range(right)
    if x is None or y is None:
        return None
    if op in {">", ">="}:
        return compare_open(MIRRORED[op], y, x)
    if op == "<":
        return True if x.hi < y.lo else False if x.lo >= y.hi else None
    if op == "<=":
        return True if x.hi <= y.lo else False if x.lo > y.hi else None
    apart = x.hi < y.lo or y.hi < x.lo
    same = x.lo == x.hi == y.lo == y.hi
    equal = False if apart else True if same else None
    return equal if op == "==" or equal is None else not equal


KNOWN: Final = frozenset({int, str, tuple, bool})


def _and(left: bool | None, right: bool | None) -> bool | None:
    if left is False or right is False:
        return False
    return None if left is None or right is None else True


def _or(left: bool | None, right: bool | None) -> bool | None:
    if left is True or right is True:
        return True
    return None if left is None or right is None else False


def _not(part: bool | None) -> bool | None:
    return None if part is None else not part


def _clamp(number: int) -> int:
    return min(number, INFINITE)


def _add(left: int, right: int) -> int:
    return _clamp(left + right)


def _multiply(left: int, right: int) -> int:
    return _clamp(left * right)


def _open_arithmetic(combine: Callable[[int, int], int]) -> Callable[[Any, Any], Any]:
    def apply(left: Any, right: Any) -> Any:
        x, y = _range(left), _range(right)
        if x is None or y is None:
            return None
        # Both operations are monotone, values are never negative.
        # ... save for a negative constant, which turns the ends round.
        ends = [combine(i, j) for i in x for j in y]
        return Range(min(ends), max(ends))

    return apply


def _ceil(dividend: int, divisor: int) -> int | None:
    if divisor == 0 or divisor >= INFINITE:
        return None
    return INFINITE if dividend >= INFINITE else -(-dividend // divisor)


def _open_ceil(left: Any, right: Any) -> Any:
    x, y = _range(left), _range(right)
    if x is None or y is None or y.lo == 0 or y.hi >= INFINITE:
        return None
    return Range(_ceil(x.lo, y.hi), _ceil(x.hi, y.lo))


def _open_extreme(choose: Callable[..., Any]) -> Callable[..., Any]:
    def apply(*operands: Any) -> Any:
        ranges = [_range(o) for o in operands]
        known = [r for r in ranges if r is not None]
        if len(known) < len(ranges):
            return None
        return Range(choose(r.lo for r in known), choose(r.hi for r in known))

    return apply


def _in(value: Any, *values: Any) -> bool:
    if len(values) == 1 and type(values[0]) is tuple:  # a `Range` is no list of names
        return value in values[0]
    return value in values


def _open_in(value: Any, *values: Any) -> bool | None:
    if len(values) == 1 and type(values[0]) is tuple:  # a `Range` is no list of names
        return value in values[0] if type(value) in KNOWN else None
    answers = [compare_open("==", value, other) for other in values]
    if any(answer is True for answer in answers):
        return True
    rng = _range(value)
    listed = {v for v in values if isinstance(v, int)}
    if rng is not None and rng.hi - rng.lo < len(values) and set(range(rng.lo, rng.hi + 1)) <= listed:
        return True
    return None if any(answer is None for answer in answers) else False


def _overlaps(left: tuple[str, ...], right: tuple[str, ...]) -> bool:
    return not set(left).isdisjoint(right)


_MAXIMUM_RANK: Final = 1_000


def _how(second: bool, at: int, asked: Callable[[WrittenValue | None], bool]) -> Judge:
    """Ask how a value was written; unknown where that was not understood."""

    def judge(a: Values, b: Values, s: Signal) -> bool | None:
        written = (b if second else a)[at]
        return None if written is UNREAD else asked(written)

    return judge


def _once(aggregate: Judge) -> Judge:
    """Return an aggregate, which looks at its signal alone, as one that does so once."""
    key = object()
    return lambda a, b, s: aggregate(a, b, s) if s is NO_SIGNAL else s.remembered(key, lambda: aggregate(a, b, s))


class _Binder:
    """Compiles one sentence; ``open_form`` chooses which of the two forms."""

    def __init__(self, vocabulary: Vocabulary, *, open_form: bool) -> None:
        self.vocabulary = vocabulary
        self.open_form = open_form
        self.uses: dict[tuple[bool, int], Use] = {}
        self.aggregate_uses: dict[tuple[bool, int], Use] = {}
        self.asked: set[int] = set()
        self.partial = False
        self.aggregating = False

    # Sentences

    def sentence(self, node: Sentence) -> Judge:
        match node:
            case Compare():
                return self.compare(node)
            case And(left=left, right=right):
                f, g = self.sentence(left), self.sentence(right)
                if self.open_form:
                    return lambda a, b, s: (left := f(a, b, s)) is not False and _and(left, g(a, b, s))
                return lambda a, b, s: f(a, b, s) and g(a, b, s)
            case Or(left=left, right=right):
                f, g = self.sentence(left), self.sentence(right)
                if self.open_form:
                    return lambda a, b, s: (left := f(a, b, s)) is True or _or(left, g(a, b, s))
                return lambda a, b, s: f(a, b, s) or g(a, b, s)
            case Not(part=part):
                f = self.sentence(part)
                return (lambda a, b, s: _not(f(a, b, s))) if self.open_form else (lambda a, b, s: not f(a, b, s))
            case Holds(operand=operand):
                if not isinstance(self.domain(operand), Flag):
                    message = f"`{operand}` is not a flag: compare it with something"
                    raise SentenceError(message)
                f = self.operand(operand)
                if self.open_form:
                    return lambda a, b, s: compare_open("==", f(a, b, s), 1)
                return lambda a, b, s: bool(f(a, b, s))
            case Test():
                return self.test(node)
        message = f"`{node}` is no sentence of the language"
        raise SentenceError(message)

    def compare(self, node: Compare) -> Judge:
        left_domain, right_domain = self.domain(node.left), self.domain(node.right)
        domain = left_domain or right_domain
        if domain is None:
            message = f"`{node}` compares two constants"
            raise SentenceError(message)
        self.check_comparable(node, left_domain, right_domain, domain)
        f, g = self.operand(node.left, domain), self.operand(node.right, domain)
        op = node.op
        if self.open_form:
            return lambda a, b, s: compare_open(op, f(a, b, s), g(a, b, s))
        compare = _OPERATORS[op]
        if isinstance(node.left, Term) and isinstance(node.right, Term) and node.left.scope == "offered":
            i, j = self.vocabulary.find(node.left), self.vocabulary.find(node.right)
            if node.right.scope == "requested":
                return lambda a, b, s: compare(a[i], b[j])
        return lambda a, b, s: compare(f(a, b, s), g(a, b, s))

    def check_comparable(self, node: Compare, left: Domain | None, right: Domain | None, domain: Domain) -> None:
        if left is not None and right is not None and not _alike(left, right):
            message = f"`{node}` compares {left.kind} with {right.kind} values that have nothing in common"
            raise SentenceError(message)
        if node.op not in {"==", "!="}:
            _check_ordered(node, domain)

    def test(self, node: Test) -> Judge:
        name = node.name
        if name in {"stated", "stated_here"}:
            return self.stated(node)
        if name in AGGREGATES:
            return self.aggregate_test(node)
        if name == "in_":
            return self.contained(node)
        if name == "overlaps":
            for arg in node.args:
                if not isinstance(self.domain(arg), Names):  # type: ignore[arg-type]
                    message = f"`{node}` needs two lists of names"
                    raise SentenceError(message)
            return self.applied(_overlaps, [self.operand(arg) for arg in node.args])  # type: ignore[arg-type]
        if name == "matches":
            for arg in node.args:
                if not isinstance(self.domain(arg), (Text, NoneType)):  # type: ignore[arg-type]
                    raise SentenceError(f"`{node}` needs text")
            return self.applied(fnmatchcase, [self.operand(arg, Text()) for arg in node.args])  # type: ignore[arg-type]
        function = self.vocabulary.functions.get(name)
        if function is None:
            known = ", ".join(sorted(self.vocabulary.functions)) or "none"
            message = f"`{name}` is neither of the language nor a function of the pack (its own: {known})"
            raise SentenceError(message)
        self.partial = True
        return self.applied(function.call, [self.operand(arg, Text()) for arg in node.args])  # type: ignore[arg-type]

    def contained(self, node: Test) -> Judge:
        """Whether a value is one of those listed, or one of a list of names."""
        operand, *listed = (arg for arg in node.args if isinstance(arg, Operand))
        sought = self.domain(operand)
        if isinstance(sought, Names):
            raise SentenceError(f"`{node}` looks for a list; `overlaps` compares lists")
        if len(listed) == 1 and isinstance(self.domain(listed[0]), Names) and isinstance(sought, (Text, NoneType)):
            judges = [self.operand(arg, Text()) for arg in (operand, *listed)]
        else:
            domain = self.together(node, [operand, *listed])
            if domain is None:
                raise SentenceError(f"`{node}` compares constants")
            judges = [self.operand(arg, domain) for arg in (operand, *listed)]
        return self.applied(_open_in if self.open_form else _in, judges, opens=True)

    def applied(self, call: Callable[..., Any], judges: Sequence[Judge], *, opens: bool = False) -> Judge:
        """Apply ``call`` to operands; in the open form an operand that is not known makes the answer None."""
        if not self.open_form or opens:
            return lambda a, b, s: call(*[judge(a, b, s) for judge in judges])

        def known_only(a: Values, b: Values, s: Signal) -> Any:
            args = [judge(a, b, s) for judge in judges]
            return call(*args) if all(type(arg) in KNOWN for arg in args) else None

        return known_only

    def stated(self, node: Test) -> Judge:
        term = node.args[0]
        if not isinstance(term, Term):
            message = f"`{node}` asks for a policy, not for `{term}`"
            raise SentenceError(message)
        index = self.use(term)
        self.asked.add(index)
        second, at = term.scope in SECOND_SCOPES, self.vocabulary.size + index
        if node.name == "stated_here":
            return _how(second, at, lambda written: written is not None and written.here)
        if len(node.args) == 1:
            return _how(second, at, lambda written: written is not None)
        literal = node.args[1]
        if not isinstance(literal, Literal) or not isinstance(literal.value, str):
            message = f"`{node}` compares with a word in quotes"
            raise SentenceError(message)
        word = self.vocabulary.policies[index].word(literal.value)

        return _how(second, at, lambda written: written is not None and written.word == word)

    # Aggregates

    def side(self, node: Node) -> bool:
        """Whether the terms inside an aggregate speak of subscribers (True) or publishers (False)."""
        sides = {
            t.scope in SECOND_SCOPES for t in node.walk() if isinstance(t, Term) and t.scope not in {"topic", "option"}
        }
        if len(sides) != 1 or any(isinstance(t, Term) and t.scope == "own" for t in node.walk()):
            message = f"`{node}` must speak of offered or of requested values, and only of one of them"
            raise SentenceError(message)
        return sides.pop()

    def within(self, build: Callable[[], Judge], node: Node) -> Judge:
        if self.aggregating:
            message = f"`{node}` stands inside another aggregate"
            raise SentenceError(message)
        self.aggregating = True
        try:
            return build()
        finally:
            self.aggregating = False

    def aggregate_test(self, node: Test) -> Judge:
        second = self.side(node)
        inner = node.args[0]
        if node.name == "any_of":
            f = self.within(lambda: self.sentence(inner), node)  # type: ignore[arg-type]

            def any_of(a: Values, b: Values, s: Signal) -> bool | None:
                result: bool | None = False
                for values, _ in s.subscribers if second else s.publishers:
                    result = _or(result, f(values, values, s))
                return result

            return _once(any_of)
        g = self.within(lambda: self.operand(inner), node)  # type: ignore[arg-type]

        def all_equal(a: Values, b: Values, s: Signal) -> bool | None:
            found = [g(values, values, s) for values, _ in (s.subscribers if second else s.publishers)]
            result: bool | None = True
            for value in found[1:]:
                result = _and(result, compare_open("==", found[0], value))
            return result

        return _once(all_equal)

    def aggregate_operand(self, node: Apply) -> Judge:
        second = self.side(node)
        if node.name == "count":
            where = self.within(lambda: self.sentence(node.args[0]), node)  # type: ignore[arg-type]
            amount: Judge = lambda a, b, s: 1  # noqa: E731 - one line says it
        else:
            amount = self.within(lambda: self.operand(node.args[0]), node)  # type: ignore[arg-type]
            _check_numbers(node, self.domain(node.args[0]))  # type: ignore[arg-type]
            where = (
                self.within(lambda: self.sentence(node.args[1]), node)  # type: ignore[arg-type]
                if len(node.args) > 1
                else lambda a, b, s: True
            )

        def added(a: Values, b: Values, s: Signal) -> Any:
            lo = hi = 0
            for values, n in s.subscribers if second else s.publishers:
                chosen = where(values, values, s)
                if chosen is False:
                    continue
                part = _range(amount(values, values, s))
                lo = _add(lo, 0 if chosen is None or part is None else _multiply(part.lo, n))
                hi = INFINITE if part is None else _add(hi, _multiply(part.hi, n))
            return lo if lo == hi else Range(lo, hi)

        return _once(added)

    # Operands

    def use(self, term: Term) -> int:
        index = self.vocabulary.find(term)
        second = term.scope in SECOND_SCOPES
        uses = self.aggregate_uses if self.aggregating else self.uses
        uses.setdefault((second, index), Use(second, index, term))
        return index

    def operand(self, node: Operand, domain: Domain | None = None) -> Judge:
        match node:
            case Literal():
                value = self.constant(node, domain)
                return lambda a, b, s: value
            case Term():
                return self.term(node)
            case Arithmetic(op=op, left=left, right=right):
                own = self.domain(node) or domain
                f, g = self.term_of(op, left, right, own), self.term_of(op, right, left, own)
                combine: Callable[..., Any] = _add if op == "+" else _multiply
                if self.open_form:
                    combine = _open_arithmetic(combine)
                return lambda a, b, s: combine(f(a, b, s), g(a, b, s))
            case Apply(name=name) if name in AGGREGATES:
                return self.aggregate_operand(node)
            case Apply(name="ceil"):
                self.domain(node)
                self.partial = True
                shared = self.together(node, node.args)
                if shared is None:
                    raise SentenceError(f"`{node}` reckons with constants only")
                judges = [self.operand(arg, shared) for arg in node.args]  # type: ignore[arg-type]
                return self.applied(_open_ceil if self.open_form else _ceil, judges, opens=True)
            case Apply(name="first"):
                self.partial = True
                return self.applied(_first, [self.operand(node.args[0])])  # type: ignore[arg-type]
            case Apply(name=name):
                own = self.domain(node) or domain
                choose = min if name == "min" else max
                judges = [self.operand(arg, own) for arg in node.args]  # type: ignore[arg-type]
                return self.applied(_open_extreme(choose) if self.open_form else choose, judges, opens=True)
        message = f"`{node}` is no value of the language"
        raise SentenceError(message)

    def term_of(self, op: str, node: Operand, other: Operand, domain: Domain | None) -> Judge:
        """One of the two operands of a sum or a product, read as ``domain``; what a duration is multiplied by is a number."""
        if op == "*" and isinstance(domain, Duration) and self.domain(node) is None:
            number = isinstance(node, Literal) and isinstance(node.value, int)
            if number or self.domain(other) is not None:
                domain = Count(maximum=INFINITE)
        return self.operand(node, domain)

    def term(self, node: Term) -> Judge:
        index = self.use(node)
        if not self.open_form:
            if node.scope in SECOND_SCOPES:
                return lambda a, b, s: b[index]
            return lambda a, b, s: a[index]
        domain = self.vocabulary.policies[index].domain
        whole = Range(domain.lowest, domain.highest) if domain.ordered or domain.candidates() else None
        second, shared = node.scope in SECOND_SCOPES, node.scope == "option"

        def read(a: Values, b: Values, s: Signal) -> Any:
            value = b[index] if second else a[index]
            if shared and b[index] != value:
                return whole
            return whole if isinstance(value, Anything) else value

        return read

    def constant(self, node: Literal, domain: Domain | None) -> Any:
        value = node.value
        if domain is None or isinstance(value, bool):
            return int(value) if isinstance(value, bool) else value
        if isinstance(value, int):
            if isinstance(domain, Duration) and value != 0:
                message = f'`{value}` has no unit; expected a unit after it, for instance "{value}s" or "{value}ms"'
                raise SentenceError(message)
            if domain.kind not in {"count", "duration", "flag"}:
                message = f"`{value}` is no {domain.kind} value; expected {domain.expected()}"
                raise SentenceError(message)
            return value
        try:
            return domain.parse(value)
        except InvalidValueError as problem:
            raise SentenceError(str(problem)) from None

    def domain(self, node: Operand) -> Domain | None:
        """The kind of value an operand has; None for a literal, which takes that of its surroundings."""
        match node:
            case Literal(value=bool()):
                return Flag()
            case Literal():
                return None
            case Term():
                return self.vocabulary.policies[self.vocabulary.find(node)].domain
            case Arithmetic(left=left, right=right):
                return self.arithmetic_domain(node, self.domain(left), self.domain(right))
            case Apply(name="count"):
                return Count(maximum=INFINITE)
            case Apply(name="ceil", args=args):
                _check_numbers(node, self.together(node, args))
                return Count(maximum=INFINITE)
            case Apply(name="first", args=(names,)):
                if not isinstance(self.domain(names), Names):  # type: ignore[arg-type]
                    raise SentenceError(f"`{node}` needs a list of names")
                return Text()
            case Apply(name="total", args=(amount, *_)):
                return self.domain(amount)  # type: ignore[arg-type]
            case Apply(args=args):
                domain = self.together(node, args)
                if domain is not None:
                    _check_ordered(node, domain)
                return domain
        return None

    def together(self, node: Node, parts: Sequence[Node]) -> Domain | None:
        """The kind of value that all of ``parts`` have; None for nothing but literals."""
        found = [domain for part in parts if isinstance(part, Operand) and (domain := self.domain(part)) is not None]
        for other in found[1:]:
            if not _alike(found[0], other):
                raise SentenceError(f"`{node}` puts {found[0].kind} and {other.kind} values together")
        return found[0] if found else None

    def arithmetic_domain(self, node: Arithmetic, left: Domain | None, right: Domain | None) -> Domain | None:
        kinds = {domain.kind for domain in (left, right) if domain is not None}
        if not kinds <= {"duration", "count"}:
            message = f"`{node}` reckons with values that are no numbers"
            raise SentenceError(message)
        if node.op == "+" and len(kinds) > 1:
            message = f"`{node}` adds a duration to a count"
            raise SentenceError(message)
        if node.op == "*" and isinstance(left, Duration) and isinstance(right, Duration):
            raise SentenceError(f"`{node}` multiplies a duration by a duration")
        return next((d for d in (left, right) if d is not None and d.kind == "duration"), left or right)


def _alike(left: Domain, right: Domain) -> bool:
    """Whether values of both can be compared."""
    return left.kind == right.kind and getattr(left, "names", None) == getattr(right, "names", None)


def _check_ordered(node: Node, domain: Domain) -> None:
    if not domain.ordered:
        raise SentenceError(f"`{node}` compares by order, but {domain.kind} values here have none")


def _check_numbers(node: Node, domain: Domain | None) -> None:
    if domain is not None and domain.kind not in {"duration", "count"}:
        raise SentenceError(f"`{node}` reckons with values that are no numbers")


def _first(names: tuple[str, ...]) -> str | None:
    return names[0] if names else None


def bind(sentence: Sentence, vocabulary: Vocabulary) -> BoundCondition:
    """Check a sentence against a pack's policies and compile it.

    Raises:
        SentenceError: an unknown policy or function, values that cannot be compared, a constant that is no value.
    """
    plain = _Binder(vocabulary, open_form=False)
    opened = _Binder(vocabulary, open_form=True)
    plain_form, open_form = plain.sentence(sentence), opened.sentence(sentence)
    return BoundCondition(
        sentence,
        vocabulary,
        # Where known values may leave the answer open, only the open form can say so.
        open_form if plain.partial else plain_form,
        open_form,
        tuple(plain.uses.values()),
        tuple(plain.aggregate_uses.values()),
        frozenset(plain.asked),
        plain.partial,
    )


def bind_operands(node: Compare | Test, vocabulary: Vocabulary) -> tuple[Judge, ...]:
    """Compile, in the open form, what a comparison compares or what a pack's function is asked about."""
    binder = _Binder(vocabulary, open_form=True)
    if isinstance(node, Compare):
        domain = binder.domain(node.left) or binder.domain(node.right)
        return binder.operand(node.left, domain), binder.operand(node.right, domain)
    return tuple(binder.operand(arg, Text()) for arg in node.args)  # type: ignore[arg-type]


def terms(sentence: Sentence) -> Iterator[tuple[Term, bool]]:
    """Yield every term of a sentence, and whether it stands inside an aggregate."""

    def visit(node: Node, within: bool) -> Iterator[tuple[Term, bool]]:
        if isinstance(node, Term):
            yield node, within
        inside = within or (isinstance(node, (Apply, Test)) and node.name in AGGREGATES)
        for child in node.children():
            yield from visit(child, inside)

    yield from visit(sentence, within=False)


def scope_of(sentence: Sentence) -> str:
    """Return the scope of a rule, which follows from its terms: pair, endpoint, participant, broker, signal or system."""
    outside = {term.scope for term, within in terms(sentence) if not within}
    if any(within for _, within in terms(sentence)):
        return "signal"
    if outside & {"offered", "publisher"} and outside & {"requested", "subscriber"}:
        return "pair"
    if outside & {"own", "offered", "requested", "publisher", "subscriber"}:
        return ENDPOINT
    for scope in ("participant", "broker", "topic"):
        if scope in outside:
            return "signal" if scope == "topic" else scope
    return "system"


def role_of(sentence: Sentence) -> str | None:
    """The role an endpoint or signal rule is about when its terms say so (``offered`` → publisher), else None."""
    outside = {term.scope for term, within in terms(sentence) if not within}
    if outside & {"offered", "publisher"}:
        return "publisher"
    return "subscriber" if outside & {"requested", "subscriber"} else None


assert set(_LEVELS) == set(SCOPES)  # noqa: S101 - the two tables are read side by side
__all__ = [
    "KNOWN",
    "MIRRORED",
    "SECOND_SCOPES",
    "BoundCondition",
    "Function",
    "Judge",
    "Range",
    "RuleAnswer",
    "Signal",
    "Use",
    "Value",
    "Values",
    "Vocabulary",
    "bind",
    "bind_operands",
    "collect_variables",
    "compare_open",
    "in_world",
    "role_of",
    "scope_of",
    "settled",
    "terms",
]
