"""Operations on values, each in two forms: over plain values, and over values that may be open.

Open values are a `Range`, or None for what is not known. An answer that they leave open is None.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable
from functools import partial
from itertools import combinations, product
from typing import Any, Final, NamedTuple

from cqos_core.language.values import INFINITE, KNOWN, Range
from cqos_core.model.wildcards import fits

Answer = bool | None

_ORDERS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">=": operator.ge,
    ">": operator.gt,
}
_COMPARISONS: Final = _ORDERS | {"==": operator.eq, "!=": operator.ne}
MIRRORED: Final = {"<": ">", "<=": ">=", "==": "==", "!=": "!=", ">=": "<=", ">": "<"}


def as_range(value: Any) -> Range | None:
    """Return the range of a number; None for anything else."""
    if isinstance(value, Range):
        return value
    return Range(value, value) if isinstance(value, int) else None


def compare_open(op: str, left: Any, right: Any) -> Answer:
    """Compare two values; each may be a `Range` or unknown (`Anything`, None)."""
    if type(left) in KNOWN and type(right) in KNOWN:
        return bool(_COMPARISONS[op](left, right))
    x, y = as_range(left), as_range(right)
    if x is None or y is None:
        return None
    if op in _ORDERS:
        answers = {_ORDERS[op](x.lo, y.hi), _ORDERS[op](x.hi, y.lo)}
        return answers.pop() if len(answers) == 1 else None
    apart, same = x.hi < y.lo or y.hi < x.lo, x.lo == y.hi and x.hi == y.lo
    return same is (op == "==") if apart or same else None


def both(*parts: Answer) -> Answer:
    """Return whether all parts hold."""
    return False if False in parts else None if None in parts else True


def either(*parts: Answer) -> Answer:
    """Return whether any part holds."""
    return True if True in parts else None if None in parts else False


def _negated(part: Answer) -> Answer:
    return None if part is None else not part


def _add(left: int, right: int) -> int:
    return min(left + right, INFINITE)


def _multiply(left: int, right: int) -> int:
    return min(left * right, INFINITE)


def _ceil(dividend: int, divisor: int) -> int | None:
    if divisor == 0 or divisor >= INFINITE:
        return None
    return INFINITE if dividend >= INFINITE else -(-dividend // divisor)


def _over_ranges(call: Callable[..., Any], *operands: Any) -> Any:
    """Compute over all that operands may be. Every operation is monotone in each of them, so the ends decide."""
    if {*map(type, operands)} == {int}:
        return call(*operands)
    ranges = [as_range(each) for each in operands]
    if None in ranges:
        return None
    ends = [call(*each) for each in product(*ranges)]  # type: ignore[arg-type]
    return None if None in ends else Range(min(ends), max(ends))


def _over_known(call: Callable[..., Any], *operands: Any) -> Any:
    return call(*operands) if all(type(each) in KNOWN for each in operands) else None


def _among(value: Any, *values: Any) -> bool:
    named = len(values) == 1 and type(values[0]) is tuple  # a `Range` is no list of names
    return value in (values[0] if named else values)


def _open_among(value: Any, *values: Any) -> Answer:
    if all(type(each) in KNOWN for each in (value, *values)):
        return _among(value, *values)
    if len(values) == 1 and type(values[0]) is tuple:
        return None
    found, listed = as_range(value), {each for each in values if isinstance(each, int)}
    if found is not None and found.hi - found.lo < len(values) and {*range(found.lo, found.hi + 1)} <= listed:
        return True
    return either(*[compare_open("==", value, other) for other in values])


def _overlap(left: tuple[str, ...], right: tuple[str, ...]) -> bool:
    return not set(left).isdisjoint(right)


def _first(names: tuple[str, ...]) -> str | None:
    return names[0] if names else None


def _is_set(flag: Any) -> Answer:
    return compare_open("==", flag, 1)


class Operation(NamedTuple):
    """An operation in both forms: over plain values, and over open ones."""

    plain: Callable[..., Any]
    open: Callable[..., Any]


def over_known(call: Callable[..., Any]) -> Operation:
    """Return an operation that answers only for known values."""
    return Operation(call, partial(_over_known, call))


OPERATIONS: Final = {
    **{op: Operation(call, partial(compare_open, op)) for op, call in _COMPARISONS.items()},
    **{
        name: Operation(call, partial(_over_ranges, call))
        for name, call in (("+", _add), ("*", _multiply), ("min", min), ("max", max), ("ceil", _ceil))
    },
    "~": Operation(operator.not_, _negated),
    "": Operation(bool, _is_set),
    "in_": Operation(_among, _open_among),
    "overlaps": over_known(_overlap),
    "matches": over_known(fits),
    "first": over_known(_first),
}
"""By the name of an operator or function of the language."""


# Aggregates: of each row how many endpoints it stands for, then the value or condition for them


def _any_of(rows: Iterable[tuple[int, Answer]]) -> Answer:
    return either(*[holds for _, holds in rows])


def _all_equal(rows: Iterable[tuple[int, Any]]) -> Answer:
    found = [value for _, value in rows]
    alike = both(*[compare_open("==", found[0], value) for value in found[1:]])
    # The first may be unknown, and two others differ for certain.
    if alike is None and any(compare_open("==", *pair) is False for pair in combinations(found[1:], 2)):
        return False
    return alike


def _total(rows: Iterable[tuple[Any, ...]]) -> Any:
    lo = hi = 0
    for number, amount, chosen in rows:
        if chosen is not False:
            part = as_range(amount) or Range(0, INFINITE)
            lo = _add(lo, _multiply(part.lo, number) if chosen else 0)
            hi = _add(hi, _multiply(part.hi, number))
    return lo if lo == hi else Range(lo, hi)


AGGREGATIONS: Final[dict[str, Callable[[Iterable[Any]], Any]]] = {
    "any_of": _any_of,
    "all_equal": _all_equal,
    "count": _total,
    "total": _total,
}
"""The operations over all endpoints of a side."""
