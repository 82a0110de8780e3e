"""Searches of statements: their parts, their calls, their assignments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.program import (
    Assign,
    Attribute,
    Call,
    Closure,
    Conditional,
    Do,
    Element,
    If,
    Items,
    Loop,
    Name,
    NotFollowed,
    Operation,
    Pairs,
    Reference,
    Return,
    Try,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_ros2_sources.programs.program import Expression, Function, Statement

_INNER: Final[dict[type, tuple[str, ...]]] = {
    Attribute: ("of",),
    Conditional: ("condition", "then", "otherwise"),
    Element: ("of", "key"),
    Items: ("items",),
    NotFollowed: ("parts",),
    Operation: ("operands",),
    Pairs: ("items",),
    Reference: ("bound",),
}
"""Where the parts of an expression stand."""


def inside(statements: Iterable[Statement]) -> Iterator[Statement]:
    """Yield statements, with those of their branches and loops."""
    for each in statements:
        yield each
        if isinstance(each, If):
            yield from inside((*each.then, *each.otherwise))
        elif isinstance(each, Loop):
            yield from inside(each.body)
        elif isinstance(each, Try):
            yield from inside((*each.body, *(one for handler in each.handlers for one in handler)))


def calls_in(statements: tuple[Statement, ...], initializers: tuple[Any, ...] = ()) -> Iterator[Call]:
    """Yield every call in statements."""
    return (each for each in expressions_in(statements, initializers) if isinstance(each, Call))


def expressions_in(statements: tuple[Statement, ...], initializers: tuple[Any, ...] = ()) -> Iterator[Expression]:
    """Yield every expression in statements, with its parts."""
    waiting: list[Expression] = [each for _, arguments, _ in initializers for each in arguments]
    pending: list[Statement] = [*statements]
    while pending:
        each = pending.pop()
        if isinstance(each, Assign):
            waiting.append(each.value)
        elif isinstance(each, Do):
            waiting.append(each.expression)
        elif isinstance(each, If):
            waiting.append(each.condition)
            pending += [*each.then, *each.otherwise]
        elif isinstance(each, Loop):
            pending += each.body
            waiting += [] if each.over is None else [each.over]
        elif isinstance(each, Return) and each.value is not None:
            waiting.append(each.value)
        elif isinstance(each, Try):
            pending += [*each.body, *(one for handler in each.handlers for one in handler)]
    while waiting:
        part = waiting.pop()
        yield part
        if isinstance(part, Call):
            waiting += [part.function, *part.arguments, *(value for _, value in part.keywords)]
        elif isinstance(part, Closure):
            yield from expressions_in(part.function.body)
        else:
            waiting += parts(part)


def mentions(expression: Expression, name: str) -> bool:
    """Whether a name stands in an expression."""
    waiting: list[Any] = [expression]
    while waiting:
        each = waiting.pop()
        if each == Name(name):
            return True
        waiting += [each.function, *each.arguments] if isinstance(each, Call) else parts(each)
    return False


def parts(expression: Expression) -> list[Any]:
    """Return the expressions in an expression that is no call."""
    found: list[Any] = []
    for name in _INNER.get(type(expression), ()):
        value = getattr(expression, name)
        if isinstance(value, tuple):
            found += [each for item in value for each in (item if isinstance(item, tuple) else (item,))]
        else:
            found.append(value)
    return found


def assignments(function: Function) -> Iterator[Assign]:
    """Yield the assignments in a function and its lambdas that are no declarations."""
    waiting: list[Statement] = [*function.body]
    while waiting:
        for each in inside([waiting.pop()]):
            if isinstance(each, Assign):
                if not each.declares:
                    yield each
                waiting += _closures(each.value)
            elif isinstance(each, Do):
                waiting += _closures(each.expression)


def _closures(expression: Expression) -> Iterable[Statement]:
    if isinstance(expression, Closure):
        return expression.function.body
    if isinstance(expression, Call):
        return [each for part in expression.arguments for each in _closures(part)]
    return ()
