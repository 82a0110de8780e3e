"""Parses conditions: Python's own parser makes a syntax tree, which is translated node by node and never evaluated."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from cqos_core.language.expression import (
    SCOPES,
    VALUE_FUNCTIONS,
    Apply,
    Condition,
    Literal,
    Node,
    Operand,
    Term,
    Test,
    as_condition,
    refuse_number,
    signature,
)
from cqos_core.model.problems import ConditionError
from cqos_core.model.regular_expressions import regular_expression

MAXIMUM_TEXT: Final = 10_000
_MAXIMUM_DEPTH: Final = 60
_LONGEST_EXCERPT: Final = 60
_LINE_END: Final = regular_expression(r"\r\n|\r|\n")
_SIGNS: Final[dict[type[ast.AST], str]] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.GtE: ">=",
    ast.Gt: ">",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.Add: "+",
    ast.Mult: "*",
}
_VALUES: Final = frozenset({*VALUE_FUNCTIONS, "+", "*"})
_PARENTHESES: Final = "put each comparison beside & or | in parentheses"
_HYPHENS: Final = regular_expression(r"[A-Za-z_][\w.]*(?:-[A-Za-z_][\w.]*)+")
_QUOTED: Final = regular_expression(r"'[^']*'|\"[^\"]*\"")
_MISWRITTEN: Final = (
    (regular_expression(r"&&|\|\|"), "write `&` and `|` once"),
    (regular_expression(r"(?<![=<>!])=(?!=)"), "compare with `==`"),
    (regular_expression(r"\b\d[\d.]*[A-Za-z]"), 'a duration stands in quotes, for instance "5s"'),
)
"""Operators of other languages that Python refuses to parse, each with the text to write instead."""


def parse(text: str, definitions: Mapping[str, Node] = MappingProxyType({})) -> Condition:
    """Read the text form of a condition, which may use ``definitions`` by name.

    Raises:
        ConditionError: with the offset of the fault; the text is at most 10,000 characters and 60 levels deep.
    """
    return _Reader(text, definitions).condition(_tree(text))


def parse_value(text: str, definitions: Mapping[str, Node] = MappingProxyType({})) -> Condition | Operand:
    """Read the text form of a condition, or of a value such as ``offered(deadline)``.

    Raises:
        ConditionError: as `parse` does.
    """
    read = _Reader(text, definitions).node(_tree(text))
    return read if isinstance(read, Operand) else as_condition(read)


class _Reader:
    """Translates Python's syntax tree into nodes."""

    def __init__(self, text: str, definitions: Mapping[str, Node]) -> None:
        self.text = text
        self.definitions = definitions
        self.depth = 0

    def fail(self, message: str, node: ast.expr) -> ConditionError:
        return ConditionError(message, self.text, self.offset(node.lineno, node.col_offset))

    def foreign(self, node: ast.expr) -> ConditionError:
        written = self.written(node)
        shown = written if len(written) <= _LONGEST_EXCERPT else f"{written[:_LONGEST_EXCERPT]}…"
        quotes = f'; a value stands in quotes: "{written}"' if _HYPHENS.fullmatch(written) else ""
        message = (
            _hint(node) or f"`{shown}` is not part of the language of conditions{quotes}{_with_underscores(written)}"
        )
        return self.fail(message, node)

    def written(self, node: ast.expr) -> str:
        """Return the text of a part."""
        return self.text[self.offset(node.lineno, node.col_offset) : self.offset(node.end_lineno, node.end_col_offset)]

    def offset(self, line: int | None, column: int | None) -> int:
        """The offset of a place that the syntax tree gives as a line and a number of UTF-8 bytes."""
        start = _line_start(self.text, line)
        return start + len(self.text[start:].encode(errors="replace")[: column or 0].decode(errors="ignore"))

    def condition(self, node: ast.expr, part_of: str = "") -> Condition:
        read = self.node(node)
        if isinstance(read, Literal):
            hint = f"; {_PARENTHESES}" if part_of in {"&", "|"} else ""
            raise self.fail(f"`{read}` is no condition: compare it with something{hint}", node)
        return as_condition(read)

    def operand(self, node: ast.expr) -> Operand:
        read = self.node(node)
        if not isinstance(read, Operand):
            name = node.id if isinstance(node, ast.Name) else ""
            hint = f"; {_PARENTHESES}" if _joins(node) else f'; a value stands in quotes: "{name}"' if name else ""
            raise self.fail(f"`{read}` is a condition where a value is expected{hint}", node)
        return read

    def node(self, node: ast.expr) -> Node:
        self.depth += 1
        if self.depth > _MAXIMUM_DEPTH:
            raise self.fail(f"the condition is nested deeper than {_MAXIMUM_DEPTH} levels", node)
        try:
            return self._node(node)
        finally:
            self.depth -= 1

    def _node(self, node: ast.expr) -> Node:
        match node:
            case ast.Constant(value=bool() | int() | str() as value):
                return Literal(value)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() as value)) if not isinstance(value, bool):
                return Literal(-value)
            case ast.Name(id=name) if name in self.definitions:
                return self.definitions[name]
            case ast.Name() | ast.Attribute():
                return Term("own", self.name(node))
            case ast.UnaryOp(op=ast.Invert(), operand=inner):
                return self.applied("~", [inner])
            case ast.BinOp(left=left, op=op, right=right) | ast.Compare(left=left, ops=[op], comparators=[right]) if (
                sign := _SIGNS.get(type(op))
            ):
                return self.applied(sign, [left, right])
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                return self.call(name, args, node)
        raise self.foreign(node)

    def name(self, node: ast.expr) -> str:
        parts: list[str] = []
        inner = node
        while isinstance(inner, ast.Attribute) and len(parts) < _MAXIMUM_DEPTH:
            parts.append(inner.attr)
            inner = inner.value
        if not isinstance(inner, ast.Name):
            raise self.fail("expected a policy name", node)
        return ".".join([inner.id, *reversed(parts)])

    def call(self, name: str, args: list[ast.expr], node: ast.expr) -> Node:
        if name in SCOPES:
            if len(args) != 1 or not isinstance(args[0], (ast.Name, ast.Attribute)):
                raise self.fail(f"`{name}` takes one policy name{_with_underscores(*map(self.written, args))}", node)
            return Term(name, self.name(args[0]))
        try:
            refuse_number(name, len(args))
        except ConditionError as error:
            raise self.fail(str(error), node) from None
        return self.applied(name, args)

    def applied(self, name: str, args: Sequence[ast.expr]) -> Node:
        conditions = signature(name).conditions
        read = [self.condition(arg, name) if at in conditions else self.operand(arg) for at, arg in enumerate(args)]
        return Apply(name, *read) if name in _VALUES else Test(name, *read)


def _hint(node: ast.expr) -> str | None:
    """Return the text to write instead of a common mistake."""
    match node:
        case ast.BoolOp():
            return "use & and | instead of `and` and `or`, each side in parentheses"
        case ast.UnaryOp(op=ast.Not()):
            return "use ~(…) instead of `not`"
        case ast.Compare(left=left, ops=[_, _, *_], comparators=others) if any(map(_joins, (left, *others))):
            return _PARENTHESES
        case ast.Compare(ops=[_, _, *_]):
            return "write two comparisons joined by & instead of a chained one"
        case ast.Constant(value=float()):
            return 'write whole numbers, and durations as text with a unit, for instance "1.5s"'
    return None


def _joins(node: ast.expr) -> bool:
    """Whether it is ``… & …`` or ``… | …``, which bind tighter than comparisons."""
    return isinstance(node, ast.BinOp) and isinstance(node.op, (ast.BitAnd, ast.BitOr))


def _with_underscores(*written: str) -> str:
    """Return advice for a name with hyphens, which reads as a subtraction; empty for anything else."""
    names = [text.replace("-", "_") for text in written if _HYPHENS.fullmatch(text)]
    return f"; names have `_` where others have `-`: `{names[0]}`" if names else ""


def _line_start(text: str, line: int | None) -> int:
    """The offset at which a line begins, after the blanks that `parse` takes away."""
    blanks = len(text) - len(text.lstrip())
    starts = [blanks, *(end.end() for end in _LINE_END.finditer(text, blanks))]
    return starts[min(line or 1, len(starts)) - 1]


def _tree(text: str) -> ast.expr:
    if len(text) > MAXIMUM_TEXT:
        raise ConditionError(f"a condition has at most {MAXIMUM_TEXT:,} characters, this one has {len(text):,}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        offset = _line_start(text, error.lineno) + max((error.offset or 1) - 1, 0)
        unquoted = _QUOTED.sub("", text)
        hint = next((f"; {advice}" for pattern, advice in _MISWRITTEN if pattern.search(unquoted)), "")
        raise ConditionError(f"not valid syntax: {error.msg}{hint}", text, min(offset, len(text))) from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise ConditionError(f"not valid syntax: {str(error) or 'nested too deeply'}", text[:80]) from None
