"""Compiles many conditions into one Python function over known values, which returns a bit for each condition that may report.

The function is built from the nodes of the conditions, never from text. `BoundCondition` defines the meaning. Parts that the
function cannot decide (aggregates, functions of packs, quotients) count as "may report" and are then evaluated by `BoundCondition`.

A function may also be for tuples that have some values in common, such as unknown ones and those of options. These are its
constants, so most conditions that read them are decided when the function is made.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias, TypedDict

from cqos_core.language.binder import Binder
from cqos_core.language.bound_condition import NO_SIGNAL, BoundCondition
from cqos_core.language.operations import OPERATIONS
from cqos_core.language.spans import (
    FALSE,
    TRUE,
    UNKNOWN,
    Bounds,
    SpanNode,
    Spans,
    certain,
    compared,
    joined,
    negated,
    spans_of,
    under_all,
    value_bounds,
)
from cqos_core.language.values import KNOWN, Range, Values, settled, worlds_of
from cqos_core.language.vocabulary import SECOND_SCOPES

if TYPE_CHECKING:
    from cqos_core.language.expression import Term
    from cqos_core.language.vocabulary import Vocabulary


class CommonValues(NamedTuple):
    """Two tuples of values, and per tuple the positions at which every other one of the same function has the same."""

    first: Values
    second: Values
    at: tuple[frozenset[int], frozenset[int]]


class Question(NamedTuple):
    """A condition, and when it reports: where it has an answer, with ``undecided`` also where that is not known.

    ``common``: the values that all tuples share; if None, all values that it reads are known.
    """

    bound: BoundCondition
    answer: bool
    undecided: bool = False
    common: CommonValues | None = None


Reporting: TypeAlias = "Callable[[Sequence[Any], Sequence[Any]], int]"


class CompiledConditions(NamedTuple):
    """Conditions as one function.

    Attributes:
        reporting: takes two tuples in which every value that a condition reads is known, or in common, and returns a bit for
            each condition that may report.
        exact: the bits of conditions that have the answer at which they report exactly where their bit is set.
    """

    reporting: Reporting
    exact: int


def compile_conditions(questions: Iterable[Question | None], *, alone: bool = False) -> CompiledConditions:
    """Compile conditions, of which None never reports; ``alone``: on no side are there two different endpoints."""
    exact = 0
    body: list[ast.stmt] = [ast.Assign([_MASK_TO], _constant(0), **_AT)]
    for position, question in enumerate(questions):
        if question is None:
            continue
        test, is_exact = _reporting(question, alone=alone)
        if test != FALSE:
            noted = ast.AugAssign(_MASK_TO, ast.BitOr(), _constant(1 << position), **_AT)
            body.append(ast.If(_written(test), [noted], [], **_AT))
        exact |= is_exact << position
    return CompiledConditions(_made([*body, ast.Return(_MASK, **_AT)]), exact)


def _made(body: list[ast.stmt]) -> Reporting:
    module = ast.parse("def reporting(a, b): ...")  # its nodes have what this version of Python needs
    module.body[0].body = body  # type: ignore[attr-defined]
    found: dict[str, Any] = dict(_CALLED)
    exec(compile(module, "<conditions>", "exec"), found)  # noqa: S102 - of nodes that are made here
    function: Reporting = found["reporting"]
    return function


_MOST_WORLDS: Final = 16


def _reporting(question: Question, *, alone: bool = False) -> tuple[SpanNode, bool]:
    """Return where a condition may report, and whether it has its answer exactly there."""
    bound, answer, undecided, common = question
    exact, worlds = True, [common]
    if common is not None:
        first, second, at = common
        shared = [(second if use.second else first)[use.index] for use in bound.uses if use.index in at[use.second]]
        unread = [
            use.index in bound.asked and use.index + bound.vocabulary.size in at[use.second] for use in bound.uses
        ]
        known = all(type(each) in KNOWN for each in shared) and not any(unread)
        exact = known and all(first[option] == second[option] for option in bound.options)
        assumed = worlds_of(shared) or [{}]
        if len(assumed) > _MOST_WORLDS:
            return TRUE, False
        worlds = [
            CommonValues(settled(first, each, bound.indices), settled(second, each, bound.indices), at)
            for each in assumed
        ]
    # An open part counts as "may report".
    open_as = FALSE if undecided else TRUE
    spans = under_all(
        [
            spans_of(bound.condition, bound.vocabulary, _Profiles(bound.vocabulary, each), open_as=open_as, alone=alone)
            for each in worlds
        ]
    )
    surely, surely_not = (spans.holds, spans.fails) if answer else (spans.fails, spans.holds)
    return negated(surely_not) if undecided else surely, exact and not spans.left_open


class _Profiles:
    """Reads the values of two profiles, those that are in common as constants."""

    def __init__(self, vocabulary: Vocabulary, common: CommonValues | None) -> None:
        self.vocabulary = vocabulary
        self.common = common

    def value(self, term: Term, index: int) -> Bounds:
        second = term.scope in SECOND_SCOPES
        if self.common is None or index not in self.common.at[second]:
            read = SpanNode("read", ((second, index),))
            return read, read
        value = Binder(self.vocabulary).term(term).open(self.common.first, self.common.second, NO_SIGNAL)
        return value_bounds(value if type(value) is Range or type(value) in KNOWN else None)

    def stated(self, second: bool, index: int, name: str, word: str | None) -> Spans:  # noqa: FBT001 - as in `ValueReader`
        """Return how a value was written: None, or a `WrittenValue`, which was understood."""
        index += self.vocabulary.size
        if self.common is not None and index in self.common.at[second]:  # only what was not understood is
            return UNKNOWN
        written = SpanNode("read", ((second, index),))
        parts = [SpanNode("stated", (written,))]
        if name == "stated_here":
            parts.append(SpanNode("here", (written,)))
        elif word is not None:
            parts.append(compared("==", SpanNode("word", (written,)), SpanNode("constant", (word,))))
        return certain(joined("and", parts))


# How forms are written in Python


class _Place(TypedDict):
    """The position that every node of Python's syntax tree needs."""

    lineno: int
    col_offset: int


_AT: Final = _Place(lineno=1, col_offset=0)
_MASK: Final = ast.Name("mask", ast.Load(), **_AT)
_MASK_TO: Final = ast.Name("mask", ast.Store(), **_AT)
_FIRST: Final = ast.Name("a", ast.Load(), **_AT)
_SECOND: Final = ast.Name("b", ast.Load(), **_AT)


def _written(form: SpanNode) -> ast.expr:
    """Write a form in Python."""
    op, args = form
    if op == "read":
        second, index = args[0]
        return ast.Subscript(_SECOND if second else _FIRST, _constant(index), ast.Load(), **_AT)
    if op == "constant":
        return _constant(args[0])
    return _WRITERS[op]([_written(arg) for arg in args])


def _constant(value: Any) -> ast.expr:
    return ast.Constant(value, **_AT)


def _compared(op: ast.cmpop, parts: list[ast.expr]) -> ast.expr:
    return ast.Compare(parts[0], [op], parts[1:], **_AT)


def _called(name: str, parts: list[ast.expr]) -> ast.expr:
    return ast.Call(ast.Name(name, ast.Load(), **_AT), parts, [], **_AT)


def _overlapping(parts: list[ast.expr]) -> ast.expr:
    """Write ``overlaps`` inline: a call of the function in `operations` costs more than its work."""
    one, other = (ast.Set([ast.Starred(names, ast.Load(), **_AT)], **_AT) for names in parts)
    return ast.BinOp(one, ast.BitAnd(), other, **_AT)


_NAMES: Final = {"+": "add", "*": "multiply", "min": "min", "max": "max", "matches": "matches"}
_CALLED: Final = {name: OPERATIONS[operation].plain for operation, name in _NAMES.items()}
_WRITERS: Final[dict[str, Callable[[list[ast.expr]], ast.expr]]] = {
    "and": lambda parts: ast.BoolOp(ast.And(), parts, **_AT),
    "or": lambda parts: ast.BoolOp(ast.Or(), parts, **_AT),
    "not": lambda parts: ast.UnaryOp(ast.Not(), parts[0], **_AT),
    "<": partial(_compared, ast.Lt()),
    "<=": partial(_compared, ast.LtE()),
    "==": partial(_compared, ast.Eq()),
    "in_": lambda parts: _compared(ast.In(), [parts[0], ast.Tuple(parts[1:], ast.Load(), **_AT)]),
    "among": partial(_compared, ast.In()),
    "overlaps": _overlapping,
    "stated": lambda parts: _compared(ast.IsNot(), [*parts, _constant(None)]),
    "here": lambda parts: ast.Attribute(parts[0], "here", ast.Load(), **_AT),
    "word": lambda parts: ast.Attribute(parts[0], "word", ast.Load(), **_AT),
    **{op: partial(_called, name) for op, name in _NAMES.items()},
}
"""The writer of each operation."""
