"""Conditions in a form for columns: two two-valued parts, where a condition surely holds and where it surely fails.

Every value is a span: its least and its largest value. A known value has both alike, and an unknown one has those of its
domain. So what is not known is never NULL: a condition is unknown where neither part is true. The same form, over the
extremes of many endpoints, tells what holds of all of them. `BoundCondition.open` stays the meaning.

`cqos_bulk.writers` writes a form for Narwhals, in SQL and in JavaScript.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.binding import Binder
from cqos_core.language.domains import Count, Duration, Names
from cqos_core.language.expression import COMPARISONS, HOLDS, Literal, Node, Term, Test
from cqos_core.language.policy import ENDPOINT, UNMATCHED
from cqos_core.language.values import UNREAD, Anything
from cqos_core.language.vocabulary import SECOND_SCOPES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.language.domains import Domain
    from cqos_core.language.values import Values
    from cqos_core.language.vocabulary import Vocabulary
    from cqos_core.packs.bound_rule import BoundRule


class Column(NamedTuple):
    """The least or the largest value of a policy, at one end.

    Attributes:
        second: it is of the subscriber of a pair.
        policy: its index.
        part: ``value``; ``word`` or ``here`` of how it was written; ``unmatched``, whether the middleware never refuses a pair for it.
        most: it has the largest value.
    """

    second: bool
    policy: int
    part: str = "value"
    most: bool = False

    def name(self, vocabulary: Vocabulary) -> str:
        """Return the name of the column, such as ``reliability.least``."""
        policy = vocabulary.policies[self.policy]
        level = "" if policy.level == ENDPOINT else f"{policy.level}."
        part = "" if self.part == "value" else f"{self.part}."
        return f"{level}{policy.name}.{part}{'most' if self.most else 'least'}"


class ColumnForm(NamedTuple):
    """A part of a form: what is applied, to which parts.

    ``op`` is ``column`` or ``constant`` with what it holds, a comparison, ``and``, ``or``, ``not``, ``if``, ``+``, ``*``, ``min``,
    ``max``, or ``matches``, whose second part is a shell pattern. Sums and products end at infinite; a product is one with a constant.
    """

    op: str
    args: tuple[Any, ...]

    def columns(self) -> Iterator[Column]:
        """Yield the columns that it reads."""
        if self.op == "column":
            yield self.args[0]
        for arg in self.args if self.op not in {"column", "constant"} else ():
            yield from arg.columns()


class Answer(NamedTuple):
    """Where a condition surely holds, and where it surely fails."""

    holds: ColumnForm
    fails: ColumnForm


class RuleForm(NamedTuple):
    """A rule in a form for columns: where it reports for certain, and where it surely has nothing to say.

    The second also holds for the extremes of several endpoints where it holds for each of them.
    """

    bound: BoundRule
    reports: ColumnForm
    quiet: ColumnForm

    @property
    def unknown(self) -> ColumnForm:
        """Where it cannot be decided and says so."""
        if self.bound.rule.kind != "requires":
            return FALSE
        return joined("and", (negated(self.reports), negated(self.quiet)))

    def columns(self) -> set[Column]:
        """Return the columns that it reads."""
        return {*self.reports.columns(), *self.quiet.columns()}


class NoFormError(Exception):
    """A condition has no form for columns; the text names the part that has none."""


TRUE: Final = ColumnForm("constant", (True,))
FALSE: Final = ColumnForm("constant", (False,))
UNKNOWN_TEXT: Final = ("", "?")
"""The span of a text that is not known; only its ends being different counts."""
_FLAG: Final = (0, 1)
_Span = tuple[ColumnForm, ColumnForm]


def joined(op: str, parts: Iterable[ColumnForm]) -> ColumnForm:
    """Return whether all parts hold (``and``), or any (``or``)."""
    decides, rest = (FALSE, TRUE) if op == "and" else (TRUE, FALSE)
    left = list(dict.fromkeys(part for part in parts if part != rest))
    if decides in left or not left:
        return decides if decides in left else rest
    return left[0] if len(left) == 1 else ColumnForm(op, tuple(left))


def negated(part: ColumnForm) -> ColumnForm:
    """Return whether a part does not hold."""
    if part in {TRUE, FALSE}:
        return FALSE if part == TRUE else TRUE
    return part.args[0] if part.op == "not" else ColumnForm("not", (part,))


def form_of(bound: BoundRule) -> RuleForm:
    """Return a rule of a pair or an endpoint in a form for columns.

    Raises:
        NoFormError: some part of its condition has none.
    """
    holds, fails = _Columns(bound.bound.vocabulary).condition(bound.bound.condition)
    if bound.rule.kind == "forbids":
        return RuleForm(bound, holds, fails)
    unmatched = _unmatched(bound) if bound.scope == "pair" and bound.rule.kind == "requires" else ()
    passed = FALSE if bound.rule.guarantee else joined("or", unmatched)
    return RuleForm(bound, joined("and", (fails, negated(passed))), joined("or", (holds, passed)))


def answer_of(condition: Node, vocabulary: Vocabulary) -> Answer | None:
    """Return where a condition surely holds and where it surely fails; None where it has no form."""
    try:
        return _Columns(vocabulary).condition(condition)
    except NoFormError:
        return None


def forms_of(rules: Iterable[BoundRule]) -> tuple[list[RuleForm], list[tuple[BoundRule, str]]]:
    """Return the rules that have a form, and the others, each with the part that has none."""
    found, others = [], []
    for bound in rules:
        try:
            found.append(form_of(bound))
        except NoFormError as reason:
            others.append((bound, str(reason)))
    return found, others


def _unmatched(bound: BoundRule) -> Iterator[ColumnForm]:
    """Yield whether the middleware of either end does not match on a policy that a rule reads."""
    policies = bound.bound.vocabulary.policies
    for index in dict.fromkeys(use.index for use in bound.bound.uses):
        if any(UNMATCHED in treated.values() for treated in policies[index].enforced.values()):
            for second in (False, True):
                yield compared(
                    "==", ColumnForm("column", (Column(second, index, "unmatched"),)), ColumnForm("constant", (1,))
                )


def spans(
    vocabulary: Vocabulary, values: Values, unmatched: frozenset[int], columns: Iterable[Column]
) -> list[int | str | None]:
    """Return what stands in some columns of an end; None where a value follows from assumptions or peers.

    Args:
        vocabulary: of the pack.
        values: of the end, with how each was written.
        unmatched: the policies that its middleware does not match on, by index.
        columns: those to fill.
    """
    return [_cell(vocabulary, values, unmatched, column) for column in columns]


def _cell(vocabulary: Vocabulary, values: Values, unmatched: frozenset[int], column: Column) -> int | str | None:
    if column.part == "unmatched":
        return int(column.policy in unmatched)
    value = values[column.policy]
    if column.part == "value":
        if isinstance(value, (int, str)):
            return int(value) if isinstance(value, int) else value
        return whole(vocabulary.policies[column.policy].domain)[column.most] if isinstance(value, Anything) else None
    written = values[vocabulary.size + column.policy]
    if written is UNREAD:
        return (UNKNOWN_TEXT if column.part == "word" else _FLAG)[column.most]
    if column.part == "word":
        return "" if written is None else str(written.word)
    return int(written is not None and written.here)


def whole(domain: Domain) -> tuple[int, int] | tuple[str, str]:
    """Return the span of a value of a domain that is not known."""
    return (domain.lowest, domain.highest) if domain.ordered or domain.candidates() else UNKNOWN_TEXT


def compared(op: str, left: ColumnForm, right: ColumnForm) -> ColumnForm:
    """Return a comparison of two values: ``<``, ``<=`` or ``==``."""
    if left.op == right.op == "constant":
        (one,), (other,) = left.args, right.args
        return TRUE if {"<": one < other, "<=": one <= other, "==": one == other}[op] else FALSE
    return ColumnForm(op, (left, right))


def _compared(op: str, left: _Span, right: _Span, *, numbers: bool) -> Answer:
    """Compare two spans, as `cqos_core.language.operations.compare_open` does."""
    (low, high), (least, most) = left, right
    if op in {">", ">="}:
        return _compared("<" if op == ">" else "<=", right, left, numbers=numbers)
    if op in {"<", "<="}:
        return Answer(compared(op, high, least), negated(compared(op, low, most)))
    if numbers:
        same = joined("and", (compared("==", low, most), compared("==", high, least)))
        apart = joined("or", (compared("<", high, least), compared("<", most, low)))
    else:
        known = [compared("==", *span) for span in (left, right)]
        equal = compared("==", low, least)
        same, apart = joined("and", (*known, equal)), joined("and", (*known, negated(equal)))
    return Answer(same, apart) if op == "==" else Answer(apart, same)


class _Columns:
    """Writes the form of one condition."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        self.binder = Binder(vocabulary)
        self.vocabulary = vocabulary

    def condition(self, node: Node) -> Answer:
        """Write where a condition surely holds, and where it surely fails."""
        match node:
            case Test("&" | "|" as op, (left, right)):
                one, other = self.condition(left), self.condition(right)
                both, either = ("and", "or") if op == "&" else ("or", "and")
                return Answer(joined(both, (one.holds, other.holds)), joined(either, (one.fails, other.fails)))
            case Test("~", (part,)):
                holds, fails = self.condition(part)
                return Answer(fails, holds)
            case Test("stated" | "stated_here"):
                return self.stated(node)
            case Test("matches", (text, Literal(str(pattern)))):
                return self.matches(text, pattern)
            case Test("in_"):
                return self.contained(node)
            case Test(name) if name == HOLDS or name in COMPARISONS:
                kinds = self.binder.kinds_of_test(node)
                operands = [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]
                if name == HOLDS:
                    return _compared("==", operands[0], _constant(1), numbers=True)
                return _compared(name, operands[0], operands[1], numbers=_is_number(kinds[0]))
        raise NoFormError(str(node.name))

    def stated(self, node: Test) -> Answer:
        """Write how a value was written."""
        term, *words = node.args
        assert isinstance(term, Term)  # noqa: S101 - binding refuses others
        index, second = self.vocabulary.find(term), term.scope in SECOND_SCOPES
        if node.name == "stated_here":
            return _compared("==", _columns(second, index, "here"), _constant(1), numbers=True)
        written = _columns(second, index, "word")
        if not words:
            return _compared("!=", written, _constant(""), numbers=False)
        word = self.vocabulary.policies[index].word(words[0].value)  # type: ignore[attr-defined]
        return _compared("==", written, _constant(word), numbers=False)

    def matches(self, text: Node, pattern: str) -> Answer:
        """Write whether a text matches a shell pattern."""
        least, most = self.operand(text, None)
        known, found = compared("==", least, most), ColumnForm("matches", (least, ColumnForm("constant", (pattern,))))
        return Answer(joined("and", (known, found)), joined("and", (known, negated(found))))

    def contained(self, node: Test) -> Answer:
        """Write whether a value is one of those listed: all that it may be, or nothing of it."""
        kind = self.binder.kinds_of_test(node)[0]
        sought, *listed = [self.operand(arg, kind) for arg in node.args]
        numbers = _is_number(kind)
        each = [_compared("==", sought, other, numbers=numbers) for other in listed]
        found = [holds for holds, _ in each]
        if numbers and all(least.op == "constant" for least, _ in listed):
            runs = _runs(sorted({least.args[0] for least, _ in listed}))
            found = [
                joined(
                    "and", (compared("<=", _constant(low)[0], sought[0]), compared("<=", sought[1], _constant(high)[0]))
                )
                for low, high in runs
            ]
        return Answer(joined("or", found), joined("and", (fails for _, fails in each)))

    def operand(self, node: Node, domain: Domain | None) -> _Span:
        """Write a value; constants are read as ``domain``."""
        if isinstance(node, Literal):
            value: int | str = self.binder.constant(node, domain)
            return _constant(value)
        if isinstance(node, Term):
            return self.term(node)
        if node.name not in {"+", "*", "min", "max"}:
            raise NoFormError(str(node.name))
        kinds = self.binder.kinds_of_value(node, domain)
        parts = [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]
        if node.name in {"+", "*"} and any(isinstance(k, (Count, Duration)) and k.lowest < 0 for k in kinds):
            raise NoFormError(f"{node.name} of negative values")
        if node.name == "*":
            parts.sort(key=lambda each: each[0].op == "constant")
            if parts[1][0].op != "constant":
                raise NoFormError("* of two values")
        return ColumnForm(node.name, tuple(low for low, _ in parts)), ColumnForm(
            node.name, tuple(high for _, high in parts)
        )

    def term(self, term: Term) -> _Span:
        """Write the value of a policy; of an option on which both ends differ nothing is known."""
        index, second = self.vocabulary.find(term), term.scope in SECOND_SCOPES
        domain = self.vocabulary.policies[index].domain
        if isinstance(domain, Names):
            raise NoFormError(f"list {term.name}")
        least, most = _columns(second, index)
        if term.scope == "option":
            ends = zip((least, most), _columns(True, index), strict=True)
            alike = joined("and", (compared("==", one, other) for one, other in ends))
            least, most = (
                ColumnForm("if", (alike, end, ColumnForm("constant", (bound,))))
                for end, bound in zip((least, most), whole(domain), strict=True)
            )
        return least, most


def _columns(second: bool, index: int, part: str = "value") -> _Span:  # noqa: FBT001 - the first field of a column
    return (
        ColumnForm("column", (Column(second, index, part),)),
        ColumnForm("column", (Column(second, index, part, most=True),)),
    )


def _constant(value: int | str) -> _Span:
    written = ColumnForm("constant", (value,))
    return written, written


def _is_number(domain: Domain | None) -> bool:
    return domain is not None and (domain.ordered or bool(domain.candidates()))


def _runs(values: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield the first and last of all runs of numbers without a gap."""
    start = 0
    for at, value in enumerate(values):
        if at + 1 == len(values) or values[at + 1] != value + 1:
            yield values[start], value
            start = at + 1
