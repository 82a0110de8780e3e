"""Operators, and whether a value counts as true. Nothing here asks where a walk is."""

from __future__ import annotations

import operator
import re
from typing import Any, Final

from cqos_ros2_sources.programs.program import CASE, JOIN
from cqos_ros2_sources.walk.values import (
    Code,
    Condition,
    Counted,
    Either,
    Instance,
    Perhaps,
    Qos,
    Template,
    Test,
    Word,
    flipped,
    joined,
)
from cqos_ros2_workspace.launch.values import Unknown

_PLACES: Final = re.compile("%[sd]")
_BINARY: Final = 2
_ARITHMETIC: Final = {"*": operator.mul, "+": operator.add, "-": operator.sub}
_ORDER: Final = {"<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge}


def operation(sign: str, values: list[Any]) -> Any:
    """Return the value of an operator with its operands."""
    if sign == JOIN or (sign == "+" and all(isinstance(each, (str, Template, Either)) for each in values)):
        return joined(values)
    if sign == "%" and isinstance(values[0], str):
        return _formatted(values[0], values[1] if isinstance(values[1], list) else [values[1]])
    if sign == CASE and isinstance(values[0], Word) and isinstance(values[1], Word) and values[0].name in values[2]:
        return values[0] == values[1]
    if sign in {"==", "!=", CASE}:
        return _equal(values[:_BINARY], negated=sign == "!=")
    if sign == "not":
        decided = truth(values[0])
        if isinstance(decided, Condition):
            negated = flipped(decided.tests)
            return Unknown("the opposite of several conditions") if negated is None else Condition(negated)
        return not decided if isinstance(decided, bool) else decided
    if sign in {"and", "or"}:
        return _both(truth(values[0]), truth(values[1]), sign)
    numbers = all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in values)
    if numbers and sign in _ARITHMETIC and len(values) == _BINARY:
        return _ARITHMETIC[sign](values[0], values[1])
    if numbers and sign in _ORDER and len(values) == _BINARY:
        return _ORDER[sign](values[0], values[1])
    unknown = next((each for each in values if isinstance(each, Unknown)), None)
    return unknown or Unknown(f"`{sign}` is not followed")


def _formatted(text: str, values: list[Any]) -> Any:
    """Return a text of Python with values in place of `%s` and `%d`."""
    parts = _PLACES.split(text)
    if "%" in "".join(parts) or len(parts) != len(values) + 1:
        return Unknown("a formatted text")
    return joined([parts[0], *(each for pair in zip(values, parts[1:], strict=True) for each in pair)])


def _equal(values: list[Any], *, negated: bool) -> Any:
    one, other = values
    if isinstance(other, Template):
        one, other = other, one
    if isinstance(one, Template) and one.parameter and isinstance(other, (str, int, bool)):
        text = str(other).lower() if isinstance(other, bool) else str(other)
        return Condition((Test(one.parameter, (text,), negated),))
    if isinstance(one, Word) and isinstance(other, Word) and "::" in one.name:
        (scope, _, _), (others, _, _) = one.name.rpartition("::"), other.name.rpartition("::")
        return (one == other) is not negated if scope == others else Unknown("two values are compared")
    if one is None:
        one, other = other, one
    if other is None and isinstance(one, Perhaps):
        return one.there if negated else operation("not", [one.there])
    if other is None and isinstance(one, (Instance, Code, str, list, Qos)):
        return negated
    if (one is None or isinstance(one, (str, int))) and (other is None or isinstance(other, (str, int))):
        return (one == other) is not negated
    return next((each for each in values if isinstance(each, Unknown)), None) or Unknown("two values are compared")


def _both(one: Any, other: Any, sign: str) -> Any:
    stop = sign == "or"
    for first, second in ((one, other), (other, one)):
        if first is stop:
            return stop
        if first is (not stop):
            return second
    if sign == "and" and isinstance(one, Condition) and isinstance(other, Condition):
        return Condition((*one.tests, *other.tests))
    return next((each for each in (one, other) if isinstance(each, Unknown)), None) or Unknown(
        "one of several conditions"
    )


def truth(value: Any) -> Any:
    """Return whether a value counts as true: a flag, a condition over parameters, or not known."""
    if isinstance(value, (bool, Condition, Unknown)):
        return value
    if value is None:
        return False
    if isinstance(value, (Instance, Code)):
        return True
    if isinstance(value, Perhaps):
        return value.there
    if isinstance(value, Template):
        return (
            Condition((Test(value.parameter, ("true",)),)) if value.parameter else Unknown("a text is taken for a flag")
        )
    if isinstance(value, Either) and all(isinstance(each, bool) for _, each in value.cases):
        held = [tests for tests, each in value.cases if each]
        if len(held) == 1 and value.cases[0][1] is True:
            return Condition(held[0])
    if isinstance(value, (str, int, float, list, dict)):
        return bool(value)
    return Unknown("a condition that is not followed")


def element(of: Any, key: Any) -> Any:
    """Return an element of a list or dictionary, or why it is not known."""
    if isinstance(key, Counted) and key.name and of == key.of:
        return Template(f"${{{key.name}}}")
    if isinstance(of, (list, str)) and isinstance(key, int) and -len(of) <= key < len(of):
        return of[key]
    if isinstance(of, dict) and isinstance(key, (str, int)) and key in of:
        return of[key]
    return of if isinstance(of, Word) else Unknown("an element of a list that is not known")
