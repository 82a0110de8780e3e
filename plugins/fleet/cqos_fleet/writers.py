"""Forms of conditions, written for engines: as expressions of Narwhals, in SQL, and in JavaScript."""

from __future__ import annotations

import json
import operator
import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from cqos_core.language.values import INFINITE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import narwhals as nw

    from cqos_core.language.spans import SpanNode
    from cqos_core.language.vocabulary import Vocabulary
    from cqos_fleet.forms import Column


class Spelling(NamedTuple):
    """How a language of text writes forms.

    Attributes:
        column: writes a column.
        constant: writes a constant.
        operators: the words for ``and``, ``or``, ``not`` and ``==``.
        chosen: writes one of two values, by a condition.
        least, greatest: functions of several values.
        matches: writes whether a text matches a regular expression from its begin to its end.
    """

    column: Callable[[Column], str]
    constant: Callable[[bool | int | str], str]
    operators: Mapping[str, str]
    chosen: Callable[[str, str, str], str]
    least: Callable[[list[str]], str]
    greatest: Callable[[list[str]], str]
    matches: Callable[[str, str], str]


def written(form: SpanNode, spelling: Spelling) -> str:
    """Return a form in a language of text."""
    op, args = form
    if op == "read":
        return spelling.column(args[0])
    if op == "constant":
        return spelling.constant(args[0])
    parts = [written(arg, spelling) for arg in args]
    word = spelling.operators.get(op, op)
    if op == "matches":
        return spelling.matches(parts[0], pattern_of(args[1].args[0]))
    if op in {"and", "or"}:
        return f"({f' {word} '.join(parts)})"
    if op == "not":
        return f"{word} {parts[0]}"
    if op == "if":
        return spelling.chosen(*parts)
    if op in {"min", "max"}:
        return (spelling.least if op == "min" else spelling.greatest)(parts)
    together = f"({parts[0]} {word} {parts[1]})"
    if op in {"<", "<=", "=="}:
        return together
    infinite = spelling.constant(INFINITE)
    room = f"({infinite} - {parts[1]})" if op == "+" else spelling.constant(_quotient(args[1]))
    return spelling.chosen(f"({parts[0]} > {room})", infinite, together)


def expression(form: SpanNode, column: Callable[[Column], nw.Expr]) -> nw.Expr:
    """Return a form as an expression of Narwhals; ``column`` gives that of a column."""
    import narwhals as nw

    op, args = form
    if op == "read":
        return column(args[0])
    if op == "constant":
        return nw.lit(args[0])
    if op == "matches":
        return expression(args[0], column).str.contains(rf"(?s)\A{pattern_of(args[1].args[0])}\z")
    parts: list[Any] = [expression(arg, column) for arg in args]
    match op:
        case "and":
            return nw.all_horizontal(*parts, ignore_nulls=False)
        case "or":
            return nw.any_horizontal(*parts, ignore_nulls=False)
        case "not":
            return cast("nw.Expr", ~parts[0])
        case "if":
            return nw.when(parts[0]).then(parts[1]).otherwise(parts[2])
        case "min" | "max":
            return nw.min_horizontal(*parts) if op == "min" else nw.max_horizontal(*parts)
        case "<" | "<=" | "==":
            compare = {"<": operator.lt, "<=": operator.le, "==": operator.eq}[op]
            return cast("nw.Expr", compare(*parts))
    left, right = parts
    infinite: Any = nw.lit(INFINITE)
    room, together = (infinite - right, left + right) if op == "+" else (nw.lit(_quotient(args[1])), left * right)
    return nw.when(left > room).then(infinite).otherwise(together)


def _quotient(factor: SpanNode) -> int:
    """Return how often a constant factor goes into infinite."""
    return INFINITE // factor.args[0] if factor.args[0] else INFINITE


def pattern_of(pattern: str) -> str:
    """Return a shell pattern as a regular expression that RE2, Java, Rust, JavaScript and Python read alike."""
    found = []
    for part in _PARTS.findall(pattern):
        if part in "*?":
            found.append(".*" if part == "*" else ".")
        elif len(part) > 1:
            inner = part[1:-1].replace("\\", "\\\\").replace("[", "\\[")
            found.append(f"[{'^' + inner[1:] if inner.startswith('!') else inner}]")
        else:
            found.append(re.sub(r"[\\^$.|?*+(){}\[\]/]", r"\\\g<0>", part))
    return "".join(found)


_PARTS: Final = re.compile(r"\[!?\]?[^\]]*\]|.", re.DOTALL)


def sql(vocabulary: Vocabulary, ends: tuple[str, str] = ("offered", "requested")) -> Spelling:
    """Return how SQL is written, as DuckDB reads it, with columns of two tables."""

    def constant(value: bool | int | str) -> str:  # noqa: FBT001 - one of the constants
        if isinstance(value, bool):
            return "TRUE" if value else "FALSE"
        if isinstance(value, int):
            return f"{value}::BIGINT"
        return "'" + value.replace("'", "''") + "'"

    def matches(text: str, pattern: str) -> str:
        whole = constant(rf"(?s)\A{pattern}\z")
        return f"regexp_matches({text}, {whole})"

    return Spelling(
        lambda at: f'{ends[at.second]}."{at.name(vocabulary)}"',
        constant,
        {"and": "AND", "or": "OR", "not": "NOT", "==": "="},
        lambda condition, then, otherwise: f"CASE WHEN {condition} THEN {then} ELSE {otherwise} END",
        lambda parts: f"least({', '.join(parts)})",
        lambda parts: f"greatest({', '.join(parts)})",
        matches,
    )


def javascript(vocabulary: Vocabulary) -> Spelling:
    """Return how JavaScript is written: whole numbers are BigInt, columns are properties of two objects."""

    def constant(value: bool | int | str) -> str:  # noqa: FBT001 - one of the constants
        return f"{value}n" if type(value) is int else json.dumps(value)

    return Spelling(
        lambda at: f"{'requested' if at.second else 'offered'}[{json.dumps(at.name(vocabulary))}]",
        constant,
        {"and": "&&", "or": "||", "not": "!", "==": "==="},
        lambda condition, then, otherwise: f"({condition} ? {then} : {otherwise})",
        lambda parts: f"least({', '.join(parts)})",
        lambda parts: f"greatest({', '.join(parts)})",
        lambda text, pattern: f"/^{pattern}$/su.test({text})",
    )
