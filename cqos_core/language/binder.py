"""Binds conditions to the policies of a pack: checks every part against them, and compiles it into functions over values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import NoneType
from typing import Any, Final, NamedTuple

from cqos_core.language.bound_condition import NO_SIGNAL, BoundCondition, Judge, Signal
from cqos_core.language.domains import Count, Domain, Duration, Flag, Names, Text
from cqos_core.language.expression import AGGREGATES, COMPARISONS, HOLDS, Apply, Condition, Literal, Node, Term, Test
from cqos_core.language.operations import AGGREGATIONS, OPERATIONS, Operation, both, either, over_known
from cqos_core.language.values import INFINITE, UNREAD, Anything, Range, Values, WrittenValue
from cqos_core.language.vocabulary import SECOND_SCOPES, Use, Vocabulary
from cqos_core.model.caches import keep
from cqos_core.model.problems import ConditionError, InvalidValueError


def bind(condition: Condition, vocabulary: Vocabulary) -> BoundCondition:
    """Check a condition against a pack's policies and compile it.

    Raises:
        ConditionError: an unknown policy or function, values that cannot be compared, a constant that is no value.
    """
    binder = Binder(vocabulary)
    form = binder.condition(condition)
    return BoundCondition(
        condition,
        vocabulary,
        # Where known values may leave the answer open, only the open form can say so.
        form.open if binder.partial else form.plain,
        form.open,
        tuple(binder.uses.values()),
        tuple(binder.aggregate_uses.values()),
        frozenset(binder.asked),
        binder.partial,
    )


def parts(bound: BoundCondition) -> tuple[BoundCondition, ...]:
    """Return the conditions that one joins by ``&`` or ``|``, each bound by itself; none for any other condition."""
    joined = bound.condition.args if bound.condition.name in {"&", "|"} else ()
    return tuple(bind(part, bound.vocabulary) for part in joined if isinstance(part, Condition))


def bind_operands(node: Node, vocabulary: Vocabulary) -> tuple[Judge, ...]:
    """Compile, in the open form, the values that something is applied to: a comparison, a function of the pack, a sum."""
    key = (vocabulary, node.key)
    found = _OPERANDS.get(key)
    if found is None:
        found = keep(_OPERANDS, key, tuple(form.open for form in Binder(vocabulary).operands(node, None)))
    return found


_OPERANDS: Final[dict[tuple[Any, ...], tuple[Judge, ...]]] = {}


class _Judges(NamedTuple):
    """The two functions of a part: for known values only, and for values of which some may be open."""

    plain: Judge
    open: Judge


def _calling(call: Callable[..., Any], judges: Sequence[Judge]) -> Judge:
    match judges:
        case [f]:
            return lambda a, b, s: call(f(a, b, s))
        case [f, g]:
            return lambda a, b, s: call(f(a, b, s), g(a, b, s))
    return lambda a, b, s: call(*[judge(a, b, s) for judge in judges])


def _applied(operation: Operation, forms: Sequence[_Judges]) -> _Judges:
    return _Judges(
        _calling(operation.plain, [form.plain for form in forms]),
        _calling(operation.open, [form.open for form in forms]),
    )


def _joined(op: str, left: _Judges, right: _Judges) -> _Judges:
    """Join two parts by ``&`` or ``|``; the right one is asked only where the left one does not decide."""
    (f, f_open), (g, g_open) = left, right
    if op == "&":
        return _Judges(
            lambda a, b, s: f(a, b, s) and g(a, b, s),
            lambda a, b, s: (known := f_open(a, b, s)) is not False and both(known, g_open(a, b, s)),
        )
    return _Judges(
        lambda a, b, s: f(a, b, s) or g(a, b, s),
        lambda a, b, s: (known := f_open(a, b, s)) is True or either(known, g_open(a, b, s)),
    )


def _looked_up(term: Term, index: int) -> Judge:
    return (lambda a, b, s: b[index]) if term.scope in SECOND_SCOPES else (lambda a, b, s: a[index])


class Binder:
    """Binds one condition, or the argument of an aggregate in it."""

    def __init__(self, vocabulary: Vocabulary, *, within: bool = False) -> None:
        self.vocabulary = vocabulary
        self.within = within
        self.uses: dict[tuple[bool, int], Use] = {}
        self.aggregate_uses: dict[tuple[bool, int], Use] = {}
        self.asked: set[int] = set()
        self.partial = False

    def condition(self, node: Node) -> _Judges:
        """Check and compile what is true or false."""
        match node:
            case Test("&" | "|" as op, (left, right)):
                return _joined(op, self.condition(left), self.condition(right))
            case Test("~", (part,)):
                return _applied(OPERATIONS["~"], [self.condition(part)])
            case Test("stated" | "stated_here"):
                return self.stated(node)
            case Test(name) if name in AGGREGATES:
                return self.aggregate(node)
            case Test(name):
                return _applied(self.operation(name), self.operands(node, None))
        raise ConditionError(f"`{node}` is no condition of the language")

    def operand(self, node: Node, domain: Domain | None) -> _Judges:
        """Compile a value; constants are read as ``domain``."""
        match node:
            case Literal():
                value = self.constant(node, domain)
                return _Judges(lambda a, b, s: value, lambda a, b, s: value)
            case Term():
                return self.term(node)
            case Apply(name) if name in AGGREGATES:
                return self.aggregate(node)
            case Apply(name):
                self.partial |= name in {"ceil", "first"}
                return _applied(OPERATIONS[name], self.operands(node, domain))
        raise ConditionError(f"`{node}` is no value of the language")

    def operation(self, name: str) -> Operation:
        """Return the operation of a name: of the language, or of the pack."""
        if name in OPERATIONS:
            return OPERATIONS[name]
        function = self.vocabulary.functions.get(name)
        if function is None:
            known = ", ".join(sorted(self.vocabulary.functions)) or "none"
            raise ConditionError(f"`{name}` is neither of the language nor a function of the pack (its own: {known})")
        self.partial = True
        return over_known(function.call)

    def stated(self, node: Test) -> _Judges:
        """Ask how a value was written; unknown where that was not understood."""
        term = node.args[0]
        if not isinstance(term, Term):
            raise ConditionError(f"`{node}` takes a policy, not `{term}`")
        index = self.use(term)
        self.asked.add(index)
        self.partial = True
        word = ""
        if len(node.args) > 1:
            literal = node.args[1]
            if not isinstance(literal, Literal) or not isinstance(literal.value, str):
                raise ConditionError(f"`{node}` compares with a word in quotes")
            word = self.vocabulary.policies[index].word(literal.value)
        by_word, here = len(node.args) > 1, node.name == "stated_here"

        def asked(written: WrittenValue | None) -> bool | None:
            if written is None or written is UNREAD:
                return None if written is UNREAD else False
            return written.here if here else not by_word or written.word == word

        judge = _calling(asked, [_looked_up(term, self.vocabulary.size + index)])
        return _Judges(judge, judge)

    def aggregate(self, node: Test | Apply) -> _Judges:
        """Compile an aggregate over all publishers, or all subscribers, of a topic; it is evaluated once for each topic."""
        second = self.side(node)
        if self.within:
            raise ConditionError(f"`{node}` stands inside another aggregate")
        inner = Binder(self.vocabulary, within=True)
        inner.uses, inner.asked = self.aggregate_uses, self.asked
        parts = [
            (inner.condition(arg) if isinstance(arg, Condition) else inner.operand(arg, None)).open for arg in node.args
        ]
        if node.name == "total":
            _check_numbers(node, self.domain(node.args[0]))
        one: Judge = lambda a, b, s: 1  # noqa: E731 - one line says it
        parts = [one, *parts] if node.name == "count" else [*parts, one] if node.name == "total" else parts
        parts, combine, key = parts[:2], AGGREGATIONS[node.name], object()

        def over(s: Signal) -> Any:
            rows = s.subscribers if second else s.publishers
            return combine([(number, *(part(values, values, s) for part in parts)) for values, number in rows])

        judge: Judge = lambda a, b, s: over(s) if s is NO_SIGNAL else s.remembered(key, lambda: over(s))  # noqa: E731
        return _Judges(judge, judge)

    def side(self, node: Node) -> bool:
        """Return whether the terms inside an aggregate are about subscribers (True) or publishers (False)."""
        scopes = {t.scope for t in node.walk() if isinstance(t, Term)}
        sides = {scope in SECOND_SCOPES for scope in scopes - {"topic", "option"}}
        if len(sides) != 1 or "own" in scopes:
            raise ConditionError(f"`{node}` must read either offered or requested values")
        return sides.pop()

    def use(self, term: Term) -> int:
        """Return the index of a policy, and note that it is read."""
        index = self.vocabulary.find(term)
        second = term.scope in SECOND_SCOPES
        self.uses.setdefault((second, index), Use(second, index, term))
        return index

    def term(self, node: Term) -> _Judges:
        """Compile a look-up of a policy's value."""
        index, second, shared = self.use(node), node.scope in SECOND_SCOPES, node.scope == "option"
        domain = self.vocabulary.policies[index].domain
        whole = Range(domain.lowest, domain.highest) if domain.ordered or domain.candidates() else None

        def read(a: Values, b: Values, s: Signal) -> Any:
            value = b[index] if second else a[index]
            if shared and b[index] != value:
                return whole
            return whole if isinstance(value, Anything) else value

        return _Judges(_looked_up(node, index), read)

    def constant(self, node: Literal, domain: Domain | None) -> Any:
        """Read a constant as a value of ``domain``."""
        value = node.value
        if domain is None or isinstance(value, bool):
            return int(value) if isinstance(value, bool) else value
        if isinstance(value, int):
            if isinstance(domain, Duration) and value != 0:
                unit = f'expected a unit after it, for instance "{value}s" or "{value}ms"'
                raise ConditionError(f"`{value}` has no unit; {unit}")
            if domain.kind not in {"count", "duration", "flag"}:
                raise ConditionError(f"`{value}` is no {domain.kind} value; expected {domain.expected()}")
            return value
        try:
            return domain.parse(value)
        except InvalidValueError as problem:
            raise ConditionError(str(problem)) from None

    # Kinds of values

    def operands(self, node: Node, domain: Domain | None) -> list[_Judges]:
        """Compile the operands of an operation; constants are read by the kind of the others."""
        kinds = self.kinds_of_test(node) if isinstance(node, Test) else self.kinds_of_value(node, domain)
        return [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]

    def kinds_of_test(self, node: Test) -> list[Domain | None]:
        """Return the kinds by which the arguments of a test are read."""
        found = [self.domain(arg) for arg in node.args]
        kind: Domain | None = Text()  # for functions of packs
        if node.name == HOLDS:
            if not isinstance(found[0], Flag):
                raise ConditionError(f"`{node.args[0]}` is not a flag: compare it with something")
        elif node.name in COMPARISONS:
            kind = self.compared(node, found)
        elif node.name == "in_":
            kind = self.contained(node, found)
        elif node.name == "overlaps" and not all(isinstance(each, Names) for each in found):
            raise ConditionError(f"`{node}` needs two lists of names")
        elif node.name == "matches" and not all(isinstance(each, (Text, NoneType)) for each in found):
            raise ConditionError(f"`{node}` needs text")
        return [kind] * len(found)

    def compared(self, node: Test, found: Sequence[Domain | None]) -> Domain:
        """Return the kind by which both sides of a comparison are read."""
        left, right = found
        domain = left or right
        if domain is None:
            raise ConditionError(f"`{node}` compares two constants")
        if left is not None and right is not None and not _alike(left, right):
            raise ConditionError(f"`{node}` compares {left.kind} with {right.kind} values that have nothing in common")
        if node.name not in {"==", "!="}:
            _check_ordered(node, domain)
        return domain

    def contained(self, node: Test, found: Sequence[Domain | None]) -> Domain:
        """Return the kind by which the operands of ``in_`` are read."""
        sought, *listed = found
        if isinstance(sought, Names):
            raise ConditionError(f"`{node}` looks for a list; `overlaps` compares lists")
        if len(listed) == 1 and isinstance(listed[0], Names) and isinstance(sought, (Text, NoneType)):
            return Text()
        domain = self.together(node)
        if domain is None:
            raise ConditionError(f"`{node}` compares constants")
        return domain

    def kinds_of_value(self, node: Node, domain: Domain | None) -> list[Domain | None]:
        """Return the kinds by which the operands of an operation are read; its own value is read as ``domain``."""
        kind = self.domain(node) or domain
        if node.name == "first":
            kind = None
        elif node.name == "ceil":
            kind = self.together(node)
            if kind is None:
                raise ConditionError(f"`{node}` computes with constants only")
        elif node.name == "*" and isinstance(kind, Duration):
            # The factor of a duration is a number.
            times = [self.domain(arg) is None and self.is_factor(arg, node) for arg in node.args]
            return [Count(maximum=INFINITE) if factor else kind for factor in times]
        return [kind] * len(node.args)

    def is_factor(self, arg: Node, node: Node) -> bool:
        """Return whether an operand of a product is a plain number beside a value with a unit."""
        number = isinstance(arg, Literal) and isinstance(arg.value, int)
        return number or any(self.domain(other) is not None for other in node.args if other is not arg)

    def domain(self, node: Node) -> Domain | None:
        """Return the kind of an operand; None for a literal, which takes the kind of its surroundings."""
        match node:
            case Literal(value):
                return Flag() if isinstance(value, bool) else None
            case Term():
                return self.vocabulary.policies[self.vocabulary.find(node)].domain
            case Apply("+" | "*", (left, right)):
                return _computed(node, self.domain(left), self.domain(right))
            case Apply("ceil"):
                _check_numbers(node, self.together(node))
                return Count(maximum=INFINITE)
            case Apply("count"):
                return Count(maximum=INFINITE)
            case Apply("first", (names,)):
                if not isinstance(self.domain(names), Names):
                    raise ConditionError(f"`{node}` needs a list of names")
                return Text()
            case Apply("total", (amount, *_)):
                return self.domain(amount)
        domain = self.together(node)
        if domain is not None:
            _check_ordered(node, domain)
        return domain

    def together(self, node: Node) -> Domain | None:
        """Return the common kind of all operands; None if all are literals."""
        found = [domain for arg in node.args if (domain := self.domain(arg)) is not None]
        for other in found[1:]:
            if not _alike(found[0], other):
                raise ConditionError(f"`{node}` puts {found[0].kind} and {other.kind} values together")
        return found[0] if found else None


def _computed(node: Node, left: Domain | None, right: Domain | None) -> Domain | None:
    """Return the kind of a sum or a product."""
    kinds = [domain.kind for domain in (left, right) if domain is not None]
    if not {*kinds} <= {"duration", "count"}:
        raise ConditionError(f"`{node}` computes with values that are no numbers")
    if node.name == "+" and len({*kinds}) > 1:
        raise ConditionError(f"`{node}` adds a duration to a count")
    if node.name == "*" and kinds == ["duration", "duration"]:
        raise ConditionError(f"`{node}` multiplies a duration by a duration")
    return next((d for d in (left, right) if isinstance(d, Duration)), left or right)


def _alike(left: Domain, right: Domain) -> bool:
    """Return whether values of both kinds can be compared."""
    return left.kind == right.kind and getattr(left, "names", None) == getattr(right, "names", None)


def _check_ordered(node: Node, domain: Domain) -> None:
    if not domain.ordered:
        raise ConditionError(f"`{node}` compares by order, but {domain.kind} values here have none")


def _check_numbers(node: Node, domain: Domain | None) -> None:
    if domain is not None and domain.kind not in {"duration", "count"}:
        raise ConditionError(f"`{node}` computes with values that are no numbers")
