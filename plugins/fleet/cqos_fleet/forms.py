"""Rules in a form for columns: two two-valued parts, where a rule surely reports and where it surely has nothing to say.

Every value has two columns: its least and its largest value. A known value has both alike, and an unknown one has those of its
domain. So what is not known is never NULL: a condition is unknown where neither of its spans is. The same form, over the
extremes of many endpoints, tells what holds of all of them.

`cqos_core.language.spans` makes the forms; `cqos_fleet.writers` writes them for Narwhals, in SQL and in JavaScript.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.language.domains import Names
from cqos_core.language.policy import ENDPOINT, UNMATCHED
from cqos_core.language.spans import (
    FALSE,
    TRUE,
    UNKNOWN_TEXT,
    Bounds,
    SpanNode,
    Spans,
    compared,
    compared_values,
    constant,
    joined,
    may_be_negative,
    negated,
    spans_of,
    value_bounds,
)
from cqos_core.language.values import UNREAD, Anything, Range
from cqos_core.language.vocabulary import SECOND_SCOPES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.language.domains import Domain
    from cqos_core.language.expression import Node, Term
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


class RuleForm(NamedTuple):
    """A rule in a form for columns: where it reports for certain, and where it surely has nothing to say.

    The second also holds for the extremes of several endpoints where it holds for each of them.
    """

    bound: BoundRule
    reports: SpanNode
    quiet: SpanNode

    @property
    def unknown(self) -> SpanNode:
        """Where it cannot be decided and says so."""
        if self.bound.rule.kind != "requires":
            return FALSE
        return joined("and", (negated(self.reports), negated(self.quiet)))

    def columns(self) -> set[Column]:
        """Return the columns that it reads."""
        return {*self.reports.reads(), *self.quiet.reads()}


class NoFormError(Exception):
    """A condition has no form for columns; the text names the part that has none."""


Constants: TypeAlias = "Mapping[Column, Any]"
"""Columns whose value is known: those that all profiles have alike, and values under an assumption."""
_FLAG: Final = (0, 1)


class _Columns:
    """Reads the values of two ends from columns."""

    def __init__(self, vocabulary: Vocabulary, constants: Constants) -> None:
        self.vocabulary = vocabulary
        self.constants = constants

    def spans(self, condition: Node) -> tuple[SpanNode, SpanNode]:
        """Return where a condition surely holds and where it surely fails, as far as columns say so."""
        holds, fails, left_open = spans_of(condition, self.vocabulary, self)
        if left_open:
            raise NoFormError(left_open)
        for each in (holds, fails):
            self.refuse(each)
        return holds, fails

    def refuse(self, form: SpanNode) -> None:
        """Refuse what engines cannot compute."""
        op, args = form
        if op == "read" and args[0].part == "value":
            policy = self.vocabulary.policies[args[0].policy]
            if isinstance(policy.domain, Names):
                raise NoFormError(f"list {policy.name}")
        for arg in args if op not in {"read", "constant"} else ():
            self.refuse(arg)
        if op in {"matches", "*"} and args[1].op != "constant":
            raise NoFormError(f"{op} of two values")
        if op == "+" and may_be_negative(form, self.vocabulary):
            raise NoFormError("+ of negative values")

    def bounds(self, second: bool, index: int, part: str = "value") -> Bounds:  # noqa: FBT001 - the first field of a column
        least, most = (self.column(Column(second, index, part, end)) for end in (False, True))
        return (least, least) if least == most else (least, most)

    def column(self, column: Column) -> SpanNode:
        if column in self.constants:
            return SpanNode("constant", (self.constants[column],))
        return SpanNode("read", (column,))

    def value(self, term: Term, index: int) -> Bounds:
        """Return the columns of a policy; of an option on which both ends differ nothing is known."""
        least, most = here = self.bounds(term.scope in SECOND_SCOPES, index)
        if term.scope != "option":
            return here
        ends = zip(here, self.bounds(True, index), strict=True)
        alike = joined("and", [compared("==", one, other) for one, other in ends])
        lowest, highest = value_bounds(Range(*whole(self.vocabulary.policies[index].domain)))
        if alike in {TRUE, FALSE}:
            return here if alike == TRUE else (lowest, highest)
        return SpanNode("if", (alike, least, lowest)), SpanNode("if", (alike, most, highest))

    def stated(self, second: bool, index: int, name: str, word: str | None) -> Spans:  # noqa: FBT001 - as in `ValueReader`
        if name == "stated_here":
            return compared_values("==", self.bounds(second, index, "here"), constant(1), numbers=True)
        written = self.bounds(second, index, "word")
        return compared_values("!=" if word is None else "==", written, constant(word or ""), numbers=False)


def form_of(bound: BoundRule, constants: Constants = MappingProxyType({})) -> RuleForm:
    """Return a rule of a pair or an endpoint in a form for columns, of which some are constants.

    Raises:
        NoFormError: some part of its condition has none.
    """
    columns = _Columns(bound.bound.vocabulary, constants)
    holds, fails = columns.spans(bound.bound.condition)
    if bound.rule.kind == "forbids":
        return RuleForm(bound, holds, fails)
    unmatched = _unmatched(bound, columns) if bound.scope == "pair" and bound.rule.kind == "requires" else ()
    passed = FALSE if bound.rule.guarantee else joined("or", unmatched)
    return RuleForm(bound, joined("and", (fails, negated(passed))), joined("or", (holds, passed)))


def failing(condition: Node, vocabulary: Vocabulary, constants: Constants) -> SpanNode | None:
    """Return where a condition surely fails; None where it has no form."""
    try:
        return _Columns(vocabulary, constants).spans(condition)[1]
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


def _unmatched(bound: BoundRule, columns: _Columns) -> Iterator[SpanNode]:
    """Yield whether the middleware of either end does not match on a policy that a rule reads."""
    policies = bound.bound.vocabulary.policies
    for index in dict.fromkeys(use.index for use in bound.bound.uses):
        if any(UNMATCHED in treated.values() for treated in policies[index].enforced.values()):
            for second in (False, True):
                yield compared("==", columns.column(Column(second, index, "unmatched")), constant(1)[0])


def cell_of(vocabulary: Vocabulary, values: Values, unmatched: frozenset[int], column: Column) -> int | str | None:
    """Return what stands in a column of an end; None where a value follows from assumptions or peers.

    Args:
        vocabulary: of the pack.
        values: of the end, with how each was written.
        unmatched: the policies that its middleware does not match on, by index.
        column: the one to fill.
    """
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
    """Return the bounds of a value of a domain that is not known."""
    return (domain.lowest, domain.highest) if domain.ordered or domain.candidates() else UNKNOWN_TEXT
