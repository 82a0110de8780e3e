"""Many conditions as one Python function over known values: a bit for each condition that may report.

The function is built from the nodes of the conditions, never from text. `BoundCondition` stays the meaning. What the function
cannot say for certain (aggregates, functions of packs, quotients) counts as "may report", and is then evaluated there.

A function may also be for tuples that have some values in common, such as those that are not known and those of options. These
are constants of it, so most conditions that read them are decided when the function is made.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Sequence
from operator import itemgetter
from typing import Any, Final, NamedTuple, TypeAlias

from cqos_core.language.binding import Binder
from cqos_core.language.domains import Domain, Names
from cqos_core.language.evaluate import NO_SIGNAL, BoundCondition
from cqos_core.language.expression import AGGREGATES, COMPARISONS, HOLDS, Literal, Node, Term, Test
from cqos_core.language.operations import OPERATIONS
from cqos_core.language.values import KNOWN, Range, Values, settled, worlds_of
from cqos_core.language.vocabulary import SECOND_SCOPES


class Common(NamedTuple):
    """Two tuples of values, and per tuple the positions at which every other one of the same function has the same."""

    first: Values
    second: Values
    at: tuple[frozenset[int], frozenset[int]]


class Question(NamedTuple):
    """A condition, and when it reports: where it has an answer, with ``undecided`` also where that is not known.

    ``common``: what all tuples have in common that it is asked of; where it is None, all that is read of them is known.
    """

    bound: BoundCondition
    answer: bool
    undecided: bool = False
    common: Common | None = None


Reporting: TypeAlias = "Callable[[Sequence[Any], Sequence[Any]], int]"


class Compiled(NamedTuple):
    """Conditions as one function.

    Attributes:
        reporting: takes two tuples in which every value that a condition reads is known, or in common, and returns a bit for
            each condition that may report.
        exact: the bits of conditions that have the answer at which they report exactly where their bit is set.
    """

    reporting: Reporting
    exact: int


def compiled(questions: Iterable[Question], *, alone: bool = False) -> Compiled:
    """Compile conditions; ``alone``: on no side are there two different endpoints."""
    exact = 0
    body: list[ast.stmt] = [ast.Assign([_MASK_TO], ast.Constant(0))]
    for position, question in enumerate(questions):
        writer = _Writer(question, alone=alone)
        test = writer.written()
        if test is not _FALSE:
            body.append(ast.If(test, [ast.AugAssign(_MASK_TO, ast.BitOr(), ast.Constant(1 << position))], []))
        exact |= writer.exact << position
    body.append(ast.Return(ast.Name("mask", ast.Load())))
    return Compiled(_made(body), exact)


def ranked(questions: Iterable[tuple[Question, int]], inexact: int) -> Reporting:
    """Compile conditions over known values as a function that returns the largest number of one that reports, else 0.

    ``inexact`` is the number of those that may report and have to be asked; it has to be larger than all others.
    """
    ranks: list[tuple[int, ast.expr]] = []
    for question, rank in questions:
        writer = _Writer(question, alone=False)
        test = writer.written()
        ranks.append((rank if writer.exact else inexact, test))
    ordered = sorted(ranks, key=itemgetter(0), reverse=True)
    body: list[ast.stmt] = [ast.If(test, [ast.Return(ast.Constant(rank))], []) for rank, test in ordered if rank]
    return _made([*body, ast.Return(ast.Constant(0))])


def _made(body: list[ast.stmt]) -> Reporting:
    module = ast.parse("def reporting(a, b): ...")  # its nodes have what this version of Python needs
    module.body[0].body = body  # type: ignore[attr-defined]
    found: dict[str, Any] = dict(_CALLED)
    exec(compile(ast.fix_missing_locations(module), "<conditions>", "exec"), found)  # noqa: S102 - of nodes that are made here
    function: Reporting = found["reporting"]
    return function


_MASK_TO: Final = ast.Name("mask", ast.Store())
_OPERATORS: Final = {
    "<": ast.Lt(),
    "<=": ast.LtE(),
    "==": ast.Eq(),
    "!=": ast.NotEq(),
    ">=": ast.GtE(),
    ">": ast.Gt(),
}
_NAMES: Final = {"+": "add", "*": "multiply", "min": "min", "max": "max", "matches": "matches"}
_CALLED: Final = {name: OPERATIONS[operation].plain for operation, name in _NAMES.items()}


_TRUE: Final = ast.Constant(value=True)
_FALSE: Final = ast.Constant(value=False)
_MOST_WORLDS: Final = 16
_Span = tuple[ast.expr, ast.expr]
"""The least and the largest that a value may be; the same node twice for one that is known."""


class _OpenError(Exception):
    """A part has no answer for certain, even of known values."""


class _UnknownError(Exception):
    """A part rests on what is not known, so it is unknown."""


class _Writer:
    """Writes one condition; ``exact`` as long as nothing of it is left open."""

    def __init__(self, question: Question, *, alone: bool) -> None:
        self.bound, self.answer, self.undecided, self.common = question
        self.binder = Binder(self.bound.vocabulary)
        self.exact = True
        self.alone = alone

    def written(self) -> ast.expr:
        """Write whether the condition may report: under every assumption, or under any if it also reports the unknown."""
        if self.common is None:
            return self.may_be(self.bound.condition, answer=self.answer)
        first, second, at = self.common
        shared = [(second if use.second else first)[use.index] for use in self.bound.uses if self.fixed(use.term)]
        known = all(type(each) in KNOWN for each in shared)
        self.exact = known and all(first[option] == second[option] for option in self.bound.options)
        worlds = worlds_of(shared) or [{}]
        if len(worlds) > _MOST_WORLDS:
            return self.left_open()
        found = {}
        for world in worlds:
            here, there = (settled(each, world, self.bound.indices) for each in (first, second))
            self.common = Common(here, there, at)
            part = self.may_be(self.bound.condition, answer=self.answer)
            found[ast.dump(part) if len(worlds) > 1 else ""] = part
        return _joined(found.values(), both=not self.undecided)

    def fixed(self, term: Term, beyond: int = 0) -> bool:
        """Whether what a term reads is in common."""
        index = self.binder.vocabulary.find(term) + beyond
        return self.common is not None and index in self.common.at[term.scope in SECOND_SCOPES]

    def may_be(self, node: Node, *, answer: bool) -> ast.expr:
        """Write whether a condition may have an answer."""
        assert isinstance(node, Test)  # noqa: S101 - binding refuses others
        match node:
            case Test("~", (part,)):
                return self.may_be(part, answer=not answer)
            case Test("&" | "|" as op, (left, right)):
                both = (op == "&") is answer
                if both and self.runs_code(left):
                    # Its failure is reported, so it has to run, also where the other part decides.
                    return self.left_open()
                return _joined([self.may_be(part, answer=answer) for part in (left, right)], both=both)
        try:
            holds, fails = self.decided(node) or self.test(node)
        except _UnknownError:
            self.exact = False
            return _TRUE if self.undecided else _FALSE
        except _OpenError:
            return self.left_open()
        surely, surely_not = (holds, fails) if answer else (fails, holds)
        return _not(surely_not) if self.undecided else surely

    def decided(self, node: Test) -> tuple[ast.expr, ast.expr] | None:
        """Return a test as constants, where all its terms are in common."""
        terms = [each for each in node.walk() if isinstance(each, Term)]
        if self.common is None or node.name not in OPERATIONS or not all(map(self.fixed, terms)):
            return None
        answer = self.binder.condition(node).open(self.common.first, self.common.second, NO_SIGNAL)
        if answer is None:
            raise _UnknownError
        return (_TRUE, _FALSE) if answer else (_FALSE, _TRUE)

    def left_open(self) -> ast.expr:
        self.exact = False
        return _TRUE

    def runs_code(self, node: Node) -> bool:
        """Whether a function of the pack stands in a condition."""
        return any(isinstance(part, Test) and part.name in self.binder.vocabulary.functions for part in node.walk())

    def test(self, node: Test) -> tuple[ast.expr, ast.expr]:
        """Write whether a test is surely true, and whether it is surely false."""
        name = node.name
        if name == "all_equal" and self.alone:
            return _TRUE, _FALSE
        if name in AGGREGATES:
            raise _OpenError
        if name in {"stated", "stated_here"}:
            return _known(self.stated(node))
        kinds = self.binder.kinds_of_test(node) if name in OPERATIONS else ()
        operands = self.operands(node, kinds)
        if name == HOLDS and not _is_known(operands):
            return _compared("==", operands[0], (_TRUE, _TRUE))
        if name in COMPARISONS:
            return _compared(name, *operands)
        if not _is_known(operands):
            raise _OpenError if name == "in_" else _UnknownError
        values = [least for least, _ in operands]
        if name == HOLDS:
            return _known(values[0])
        if name == "overlaps":  # `operations` has it as a function, whose call costs more than its work
            return _known(ast.BinOp(_set_of(values[0]), ast.BitAnd(), _set_of(values[1])))
        return _known(self.contained(node, values) if name == "in_" else _called(name, values))

    def contained(self, node: Test, values: list[ast.expr]) -> ast.expr:
        sought, *listed = values
        named = len(listed) == 1 and isinstance(self.binder.domain(node.args[1]), Names)
        return ast.Compare(sought, [ast.In()], listed if named else [ast.Tuple(listed, ast.Load())])

    def stated(self, node: Test) -> ast.expr:
        """Write how a value was written: None, or a `WrittenValue`, which was understood."""
        term, *words = node.args
        assert isinstance(term, Term)  # noqa: S101 - binding refuses others
        vocabulary = self.binder.vocabulary
        if self.fixed(term, vocabulary.size):  # only what was not understood is
            raise _UnknownError
        index = vocabulary.find(term)
        written = _looked_up(term, vocabulary.size + index)
        there: ast.expr = ast.Compare(written, [ast.IsNot()], [ast.Constant(None)])
        if node.name == "stated_here":
            there = ast.BoolOp(ast.And(), [there, ast.Attribute(written, "here", ast.Load())])
        elif words:
            word = ast.Constant(vocabulary.policies[index].word(words[0].value))  # type: ignore[attr-defined]
            same = ast.Compare(ast.Attribute(written, "word", ast.Load()), [ast.Eq()], [word])
            there = ast.BoolOp(ast.And(), [there, same])
        return there

    def operands(self, node: Node, kinds: Sequence[Domain | None]) -> list[_Span]:
        if len(kinds) != len(node.args):  # a function of the pack
            raise _OpenError
        return [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]

    def operand(self, node: Node, domain: Domain | None) -> _Span:
        """Write a value; constants are read as ``domain``."""
        if isinstance(node, Literal):
            return (written := ast.Constant(self.binder.constant(node, domain))), written
        if isinstance(node, Term):
            return self.looked_up(node)
        if node.name == "ceil" and not self.divides(node.args[1]):
            raise _UnknownError
        if node.name not in _NAMES:
            raise _OpenError
        spans = self.operands(node, self.binder.kinds_of_value(node, domain))
        least = _called(node.name, [each for each, _ in spans])
        return least, least if _is_known(spans) else _called(node.name, [each for _, each in spans])

    def divides(self, node: Node) -> bool:
        """Whether something may be divided by a value that is in common."""
        found = self.looked_up(node) if isinstance(node, Term) else ()
        return all(
            OPERATIONS["ceil"].plain(1, each.value) is not None for each in found if isinstance(each, ast.Constant)
        )

    def looked_up(self, term: Term) -> _Span:
        """Write the value of a policy, that in common as a constant."""
        if self.common is None or not self.fixed(term):
            return (written := _looked_up(term, self.binder.vocabulary.find(term))), written
        value = self.binder.term(term).open(self.common.first, self.common.second, NO_SIGNAL)
        if type(value) is Range:
            return ast.Constant(value.lo), ast.Constant(value.hi)
        if type(value) not in KNOWN:
            raise _UnknownError
        return (written := ast.Constant(value)), written


def _joined(parts: Iterable[ast.expr], *, both: bool) -> ast.expr:
    """Write whether all parts hold, or any."""
    decides, rest = (_FALSE, _TRUE) if both else (_TRUE, _FALSE)
    left = [each for each in parts if each is not rest]
    if decides in left or len(left) < 2:  # noqa: PLR2004 - nothing to join
        return decides if decides in left else left[0] if left else rest
    return ast.BoolOp(ast.And() if both else ast.Or(), left)


def _not(test: ast.expr) -> ast.expr:
    return _FALSE if test is _TRUE else _TRUE if test is _FALSE else ast.UnaryOp(ast.Not(), test)


def _is_known(spans: Sequence[_Span]) -> bool:
    return all(least is most for least, most in spans)


def _known(test: ast.expr) -> tuple[ast.expr, ast.expr]:
    return test, _not(test)


def _compared(op: str, left: _Span, right: _Span) -> tuple[ast.expr, ast.expr]:
    """Write whether values surely compare, and whether they surely do not; `compare_open` is what it means."""

    def compare(one: ast.expr, op: str, other: ast.expr) -> ast.expr:
        return ast.Compare(one, [_OPERATORS[op]], [other])

    if _is_known([left, right]):
        return _known(compare(left[0], op, right[0]))
    (low, high), (least, most) = left, right
    if op in {"<", "<="}:
        return compare(high, op, least), _not(compare(low, op, most))
    if op in {">", ">="}:
        return compare(low, op, most), _not(compare(high, op, least))
    same = ast.BoolOp(ast.And(), [compare(low, "==", most), compare(high, "==", least)])
    apart = ast.BoolOp(ast.Or(), [compare(high, "<", least), compare(most, "<", low)])
    return (same, apart) if op == "==" else (apart, same)


def _looked_up(term: Term, index: int) -> ast.expr:
    side = ast.Name("b" if term.scope in SECOND_SCOPES else "a", ast.Load())
    return ast.Subscript(side, ast.Constant(index), ast.Load())


def _set_of(names: ast.expr) -> ast.expr:
    return ast.Set([ast.Starred(names, ast.Load())])


def _called(name: str, operands: list[ast.expr]) -> ast.expr:
    if name not in _NAMES:
        raise _OpenError
    return ast.Call(ast.Name(_NAMES[name], ast.Load()), operands, [])
