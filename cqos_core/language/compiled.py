"""Many conditions as one Python function over known values: a bit for each condition that may report.

The function is built from the nodes of the conditions, never from text. `BoundCondition` stays the meaning. What the function
cannot say for certain (aggregates, functions of packs, quotients) counts as "may report", and is then evaluated there.
"""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.binding import Binder
from cqos_core.language.domains import Names
from cqos_core.language.expression import AGGREGATES, COMPARISONS, HOLDS, Literal, Node, Term, Test
from cqos_core.language.operations import OPERATIONS
from cqos_core.language.vocabulary import SECOND_SCOPES

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cqos_core.language.domains import Domain
    from cqos_core.language.evaluate import BoundCondition
    from cqos_core.language.values import Values


class Compiled(NamedTuple):
    """Conditions as one function.

    Attributes:
        reporting: takes two tuples in which every value that a condition reads is known, and returns a bit for each condition
            that may report.
        exact: the bits of conditions that report exactly where their bit is set.
    """

    reporting: Callable[[Values, Values], int]
    exact: int


def compiled(conditions: Sequence[tuple[BoundCondition, bool]], *, alone: bool = False) -> Compiled:
    """Compile conditions, each with the answer at which it reports; ``alone``: on no side are there two different endpoints."""
    exact = 0
    body: list[ast.stmt] = [ast.Assign([_MASK_TO], ast.Constant(0))]
    for position, (bound, answer) in enumerate(conditions):
        writer = _Writer(bound, alone=alone)
        test = writer.may_be(bound.condition, answer=answer)
        body.append(ast.If(test, [ast.AugAssign(_MASK_TO, ast.BitOr(), ast.Constant(1 << position))], []))
        exact |= writer.exact << position
    body.append(ast.Return(ast.Name("mask", ast.Load())))
    module = ast.parse("def reporting(a, b): ...")  # its nodes have what this version of Python needs
    module.body[0].body = body  # type: ignore[attr-defined]
    found: dict[str, Any] = dict(_CALLED)
    exec(compile(ast.fix_missing_locations(module), "<conditions>", "exec"), found)  # noqa: S102 - of nodes that are made here
    return Compiled(found["reporting"], exact)


_MASK_TO: Final = ast.Name("mask", ast.Store())
_OPERATORS: Final = {
    "<": ast.Lt(),
    "<=": ast.LtE(),
    "==": ast.Eq(),
    "!=": ast.NotEq(),
    ">=": ast.GtE(),
    ">": ast.Gt(),
}
_NAMES: Final = {"+": "add", "*": "multiply", "min": "min", "max": "max", "overlaps": "overlaps", "matches": "matches"}
_CALLED: Final = {name: OPERATIONS[operation].plain for operation, name in _NAMES.items()}


class _OpenError(Exception):
    """A part has no answer for certain, even of known values."""


class _Writer:
    """Writes one condition; ``exact`` as long as nothing of it is left open."""

    def __init__(self, bound: BoundCondition, *, alone: bool) -> None:
        self.binder = Binder(bound.vocabulary)
        self.exact = True
        self.alone = alone

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
                parts = [self.may_be(part, answer=answer) for part in (left, right)]
                return ast.BoolOp(ast.And() if both else ast.Or(), parts)
        try:
            written = self.test(node)
        except _OpenError:
            return self.left_open()
        return written if answer else ast.UnaryOp(ast.Not(), written)

    def left_open(self) -> ast.expr:
        self.exact = False
        return ast.Constant(value=True)

    def runs_code(self, node: Node) -> bool:
        """Whether a function of the pack stands in a condition."""
        return any(isinstance(part, Test) and part.name in self.binder.vocabulary.functions for part in node.walk())

    def test(self, node: Test) -> ast.expr:
        """Write what is true or false."""
        name = node.name
        if name == "all_equal" and self.alone:
            return ast.Constant(value=True)
        if name in AGGREGATES:
            raise _OpenError
        if name in {"stated", "stated_here"}:
            return self.stated(node)
        if name == "in_":
            return self.contained(node)
        operands = self.operands(node, self.binder.kinds_of_test(node) if name in OPERATIONS else ())
        if name == HOLDS:
            return operands[0]
        if name in COMPARISONS:
            return ast.Compare(operands[0], [_OPERATORS[name]], operands[1:])
        return _called(name, operands)

    def contained(self, node: Test) -> ast.expr:
        kinds = self.binder.kinds_of_test(node)
        sought, *listed = self.operands(node, kinds)
        named = len(listed) == 1 and isinstance(self.binder.domain(node.args[1]), Names)
        return ast.Compare(sought, [ast.In()], listed if named else [ast.Tuple(listed, ast.Load())])

    def stated(self, node: Test) -> ast.expr:
        """Write how a value was written: None, or a `WrittenValue`, which was understood."""
        term, *words = node.args
        assert isinstance(term, Term)  # noqa: S101 - binding refuses others
        vocabulary = self.binder.vocabulary
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

    def operands(self, node: Node, kinds: Sequence[Domain | None]) -> list[ast.expr]:
        if len(kinds) != len(node.args):  # a function of the pack
            raise _OpenError
        return [self.operand(arg, kind) for arg, kind in zip(node.args, kinds, strict=True)]

    def operand(self, node: Node, domain: Domain | None) -> ast.expr:
        """Write a value; constants are read as ``domain``."""
        match node:
            case Literal():
                return ast.Constant(self.binder.constant(node, domain))
            case Term():
                return _looked_up(node, self.binder.vocabulary.find(node))
        if node.name not in _NAMES:
            raise _OpenError
        return _called(node.name, self.operands(node, self.binder.kinds_of_value(node, domain)))


def _looked_up(term: Term, index: int) -> ast.expr:
    side = ast.Name("b" if term.scope in SECOND_SCOPES else "a", ast.Load())
    return ast.Subscript(side, ast.Constant(index), ast.Load())


def _called(name: str, operands: list[ast.expr]) -> ast.expr:
    if name not in _NAMES:
        raise _OpenError
    return ast.Call(ast.Name(_NAMES[name], ast.Load()), operands, [])
