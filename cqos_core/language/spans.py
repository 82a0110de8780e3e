"""A condition as two spans of values: it certainly holds in one, and certainly fails in the other. Between them it is unknown.

A value has bounds, the least and the largest that it may be; those of a known value are equal. A condition is walked once, here. A
`ValueReader` returns the bounds of its values. `cqos_core.language.condition_compiler` writes spans as functions over profiles, `cqos_fleet` writes them for
columns. `BoundCondition.open` stays the meaning.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, TypeAlias

from cqos_core.language.binder import Binder
from cqos_core.language.domains import Names
from cqos_core.language.expression import COMPARISONS, HOLDS, Literal, Term, Test
from cqos_core.language.operations import OPERATIONS
from cqos_core.language.values import Range
from cqos_core.language.vocabulary import SECOND_SCOPES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.language.domains import Domain
    from cqos_core.language.expression import Node
    from cqos_core.language.vocabulary import Vocabulary


class SpanNode(NamedTuple):
    """A value or a truth value: an operation and its operands.

    ``op`` is ``constant`` with its value; ``read`` with the side, the index of the policy, and what else a `ValueReader` needs; ``<``, ``<=``,
    ``==``, ``and``, ``or``, ``not``, ``+``, ``*``, ``min``, ``max``, ``matches`` or ``overlaps``; ``in_`` with a value and those of which
    it is one, ``among`` with a value and a list of names; or one that a `ValueReader` uses. Sums and products end at infinite; the constant
    of a product stands last.
    """

    op: str
    args: tuple[Any, ...]

    def reads(self) -> Iterator[Any]:
        """Yield what it reads."""
        if self.op == "read":
            yield self.args[0]
        for arg in self.args if self.op not in {"read", "constant"} else ():
            yield from arg.reads()


class Spans(NamedTuple):
    """The two spans of a condition: where it certainly holds, and where it certainly fails.

    ``left_open`` names a part that only `BoundCondition` can evaluate.
    """

    holds: SpanNode
    fails: SpanNode
    left_open: str = ""

    @property
    def negated(self) -> Spans:
        """The spans of the negated condition."""
        return Spans(self.fails, self.holds, self.left_open)


Bounds: TypeAlias = tuple[SpanNode, SpanNode]
"""The least and the largest that a value may be; the same form twice for one that is known."""

TRUE: Final = SpanNode("constant", (True,))
FALSE: Final = SpanNode("constant", (False,))
UNKNOWN: Final = Spans(FALSE, FALSE)
UNKNOWN_TEXT: Final = ("", "?")
"""The bounds of a text that is not known; only that they differ counts."""
NOT_KNOWN: Final[Bounds] = (SpanNode("constant", UNKNOWN_TEXT[:1]), SpanNode("constant", UNKNOWN_TEXT[1:]))
"""The bounds of a value of which nothing is known, such as a text or a list."""


class ValueReader(Protocol):
    """Returns the bounds of the values that a condition reads."""

    def value(self, term: Term, index: int) -> Bounds:
        """Return the bounds of a policy's value."""

    def stated(self, second: bool, index: int, name: str, word: str | None) -> Spans:  # noqa: FBT001 - as in `Use`
        """Return whether a policy is ``stated`` or ``stated_here``, and as this word where one is given."""


def constant(value: Any) -> Bounds:
    """Return the bounds of a known value."""
    form = SpanNode("constant", (value,))
    return form, form


def value_bounds(value: Any) -> Bounds:
    """Return the bounds of a value as conditions compute with it: one that is known, a `Range`, or None."""
    if type(value) is Range:
        return SpanNode("constant", (value.lo,)), SpanNode("constant", (value.hi,))
    return NOT_KNOWN if value is None else constant(value)


def joined(op: str, parts: Iterable[SpanNode]) -> SpanNode:
    """Return whether all parts hold (``and``), or any (``or``)."""
    decides, rest = (FALSE, TRUE) if op == "and" else (TRUE, FALSE)
    left = list(dict.fromkeys(part for part in parts if part != rest))
    if decides in left or not left:
        return decides if decides in left else rest
    return left[0] if len(left) == 1 else SpanNode(op, tuple(left))


def negated(part: SpanNode) -> SpanNode:
    """Return whether a part does not hold."""
    if part.op == "constant":
        return FALSE if part.args[0] else TRUE
    return part.args[0] if part.op == "not" else SpanNode("not", (part,))


def compared(op: str, left: SpanNode, right: SpanNode) -> SpanNode:
    """Return a comparison of two forms: ``<``, ``<=`` or ``==``."""
    if left is right:
        return FALSE if op == "<" else TRUE
    if left.op == right.op == "constant":
        return TRUE if OPERATIONS[op].plain(left.args[0], right.args[0]) else FALSE
    return SpanNode(op, (left, right))


def certain(form: SpanNode) -> Spans:
    """Return the spans of a form that is never unknown."""
    return Spans(form, negated(form))


def compared_values(op: str, left: Bounds, right: Bounds, *, numbers: bool) -> Spans:
    """Return the spans of a comparison of two values, by order only of ``numbers``."""
    if NOT_KNOWN in (left, right):
        return UNKNOWN
    (low, high), (least, most) = left, right
    if op in {">", ">="}:
        return compared_values("<" if op == ">" else "<=", right, left, numbers=numbers)
    if op in {"<", "<="}:
        return Spans(compared(op, high, least), negated(compared(op, low, most)))
    if op == "!=":
        return compared_values("==", left, right, numbers=numbers).negated
    if numbers and not _are_known((left, right)):
        same = joined("and", (compared("==", low, most), compared("==", high, least)))
        return Spans(same, joined("or", (compared("<", high, least), compared("<", most, low))))
    return _over_known(compared("==", low, least), (left, right))


def under_all(worlds: Sequence[Spans]) -> Spans:
    """Return the spans of a condition from those under each assumption; a difference between assumptions is unknown."""
    holds, fails = (joined("and", [each[at] for each in worlds]) for at in (0, 1))  # type: ignore[misc]
    return Spans(holds, fails, next((each.left_open for each in worlds if each.left_open), ""))


def spans_of(
    condition: Node, vocabulary: Vocabulary, reading: ValueReader, *, open_as: SpanNode = FALSE, alone: bool = False
) -> Spans:
    """Return the spans of a condition.

    Args:
        condition: is bound to the vocabulary.
        vocabulary: that of the pack.
        reading: tells where the values stand.
        open_as: what both spans are of a part that is left open; `TRUE` makes both too large, `FALSE` both too small.
        alone: on no side are there two different endpoints.
    """
    return _Walk(vocabulary, reading, open_as, alone=alone).condition(condition)


class _LeftOpenError(Exception):
    """Only `BoundCondition` can evaluate a part; the text names it."""


class _Walk:
    """Makes the spans of one condition."""

    def __init__(self, vocabulary: Vocabulary, reading: ValueReader, open_as: SpanNode, *, alone: bool) -> None:
        self.vocabulary = vocabulary
        self.binder = Binder(vocabulary)
        self.reading = reading
        self.open_as = open_as
        self.alone = alone

    def condition(self, node: Node) -> Spans:
        match node:
            case Test("~", (part,)):
                return self.condition(part).negated
            case Test("&", (first, second)):
                return self.both(first, self.condition(first), self.condition(second))
            case Test("|", (first, second)):
                return self.both(first, self.condition(first).negated, self.condition(second).negated).negated
        assert isinstance(node, Test)  # noqa: S101 - binding refuses others
        try:
            return self.test(node)
        except _LeftOpenError as part:
            return Spans(self.open_as, self.open_as, str(part))

    def both(self, first: Node, one: Spans, other: Spans) -> Spans:
        """Join the spans of two parts, the first of which is asked first."""
        holds = joined("and", (one.holds, other.holds))
        fails = joined("or", (one.fails, other.fails))
        if one.left_open and self.runs_code(first):
            # Its failure is reported, so it has to run, also where the other part decides.
            holds, fails = (TRUE, fails) if self.open_as == TRUE else (holds, FALSE)
        return Spans(holds, fails, one.left_open or other.left_open)

    def runs_code(self, node: Node) -> bool:
        """Whether a function of the pack stands in a condition."""
        return any(isinstance(part, Test) and part.name in self.vocabulary.functions for part in node.walk())

    def test(self, node: Test) -> Spans:
        name = node.name
        if name in {"stated", "stated_here"}:
            return self.stated(node)
        if name == "all_equal" and self.alone:
            return Spans(TRUE, FALSE)
        if name not in OPERATIONS:
            raise _LeftOpenError(name)
        kinds = self.binder.kinds_of_test(node)
        values = [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]
        if _are_constant(values):
            answer = OPERATIONS[name].open(*map(_constant_of, values))
            return UNKNOWN if answer is None else certain(TRUE if answer else FALSE)
        numbers = _is_number(kinds[0])
        if name == HOLDS:
            (least, most) = values[0]
            return certain(least) if least is most else compared_values("==", values[0], constant(1), numbers=True)
        if name in COMPARISONS:
            return compared_values(name, *values, numbers=numbers)
        if name == "in_":
            return self.contained(node, values, numbers=numbers)
        return _over_known(SpanNode(name, tuple(least for least, _ in values)), values)

    def stated(self, node: Test) -> Spans:
        term, *words = node.args
        assert isinstance(term, Term)  # noqa: S101 - binding refuses others
        index = self.vocabulary.find(term)
        word = self.vocabulary.policies[index].word(words[0].value) if words else None  # type: ignore[attr-defined]
        return self.reading.stated(term.scope in SECOND_SCOPES, index, node.name, word)

    def contained(self, node: Test, values: list[Bounds], *, numbers: bool) -> Spans:
        """Whether a value is one of those listed: all that it may be, or nothing of it."""
        sought, *listed = values
        if sought is NOT_KNOWN:
            return UNKNOWN
        if len(listed) == 1 and isinstance(self.binder.domain(node.args[1]), Names):
            return _over_known(SpanNode("among", (sought[0], listed[0][0])), values)
        if _are_known(values):
            return certain(SpanNode("in_", tuple(least for least, _ in values)))
        each = [compared_values("==", sought, other, numbers=numbers) for other in listed]
        found = [one.holds for one in each]
        if numbers and not _are_known((sought,)):
            if not _are_constant(listed):  # together they may be all that it may be
                raise _LeftOpenError(node.name)
            runs = _runs(sorted({least.args[0] for least, most in listed if least is most}))
            found = [
                joined(
                    "and", (compared("<=", constant(low)[0], sought[0]), compared("<=", sought[1], constant(high)[0]))
                )
                for low, high in runs
            ]
        return Spans(joined("or", found), joined("and", [one.fails for one in each]))

    def operand(self, node: Node, domain: Domain | None) -> Bounds:
        """Return the bounds of a value; constants are read as ``domain``."""
        if isinstance(node, Literal):
            return constant(self.binder.constant(node, domain))
        if isinstance(node, Term):
            return self.reading.value(node, self.vocabulary.find(node))
        if node.name not in OPERATIONS:
            raise _LeftOpenError(node.name)
        kinds = self.binder.kinds_of_value(node, domain)
        values = [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]
        if _are_constant(values):
            value = OPERATIONS[node.name].open(*map(_constant_of, values))
            if value is None and _are_known(values):  # a quotient by zero
                raise _LeftOpenError(node.name)
            return value_bounds(value)
        if node.name not in {"+", "*", "min", "max"}:
            raise _LeftOpenError(node.name)
        if NOT_KNOWN in values:
            return NOT_KNOWN
        if node.name == "*":
            values.sort(key=lambda each: each[0].op == "constant")
        if _are_known(values):
            form = SpanNode(node.name, tuple(least for least, _ in values))
            return form, form
        least, most = (SpanNode(node.name, ends) for ends in zip(*values, strict=True))
        if node.name == "*" and may_be_negative(least, self.vocabulary):
            raise _LeftOpenError("* of negative values")
        return least, most


def may_be_negative(form: SpanNode, vocabulary: Vocabulary) -> bool:
    """Whether a number, or anything that it is computed from, may be below zero."""
    op, args = form
    if op == "read":
        return bool(vocabulary.policies[args[0][1]].domain.lowest < 0)
    if op == "constant":
        return bool(args[0] < 0)
    return any(may_be_negative(arg, vocabulary) for arg in args)


def _over_known(form: SpanNode, values: Iterable[Bounds]) -> Spans:
    """Return the spans of a form that is unknown unless all values are known."""
    known = [compared("==", *each) for each in values]
    return Spans(joined("and", (*known, form)), joined("and", (*known, negated(form))))


def _are_known(values: Iterable[Bounds]) -> bool:
    return all(least is most for least, most in values)


def _are_constant(values: Iterable[Bounds]) -> bool:
    return all(least.op == most.op == "constant" for least, most in values)


def _constant_of(bounds: Bounds) -> Any:
    """Return a constant as conditions compute with it."""
    (least,), (most,) = bounds[0].args, bounds[1].args
    if bounds[0] is bounds[1]:
        return least
    return None if isinstance(least, str) else Range(least, most)


def _is_number(domain: Domain | None) -> bool:
    return domain is not None and not isinstance(domain, Names) and (domain.ordered or bool(domain.candidates()))


def _runs(values: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield the first and last of all runs of numbers without a gap."""
    start = 0
    for at, value in enumerate(values):
        if at + 1 == len(values) or values[at + 1] != value + 1:
            yield values[start], value
            start = at + 1
