"""Filters of topic names, as lists of shell patterns; what two of them let through together is again such a list."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_Ranges = tuple[tuple[int, int], ...]
Pattern = tuple[_Ranges, ...]
"""The characters of a pattern, each as the ranges of what it may be; no ranges stand for ``*``."""
_LAST: Final = 0x10FFFF
_MANY: Final[_Ranges] = ()
_ANY: Final[_Ranges] = ((0, _LAST),)
_MOST_STEPS: Final = 200_000
_MOST_PATTERNS: Final = 100


def patterns(filters: str) -> list[Pattern]:
    """Read patterns with commas between them."""
    return [tuple(_characters(each.strip())) for each in filters.split(",") if each.strip()]


def in_both(first: Sequence[Pattern], second: Sequence[Pattern]) -> list[Pattern] | None:
    """Return patterns of the names that both filters let through; None where that takes too many of them."""
    if first == second:
        return [*first]
    if sum(map(len, first)) * sum(map(len, second)) > _MOST_STEPS:
        return None
    found: dict[Pattern, None] = {}
    for one in first:
        for other in second:
            common = _common(one, other)
            if common is None:
                return None
            found |= dict.fromkeys(sorted(common))
    return [*found]


def expressions(filters: Iterable[Pattern]) -> tuple[str, ...]:
    """Return a regular expression of RE2 for each pattern."""
    return tuple(dict.fromkeys("".join(map(_expression, pattern)) for pattern in filters))


def _characters(pattern: str) -> Iterator[_Ranges]:
    at, before = 0, ""
    while at < len(pattern):
        character = pattern[at]
        end = pattern.find("]", at + (3 if pattern[at + 1 : at + 2] == "!" else 2)) if character == "[" else -1
        if end > 0:
            yield _class(pattern[at + 1 : end])
            at = end
        elif character == "?":
            yield _ANY
        elif character != "*":
            yield ((ord(character), ord(character)),)
        elif before != "*":
            yield _MANY
        before, at = character, at + 1


def _class(inner: str) -> _Ranges:
    """Return the characters of a class, of which ``!`` at its begin takes all others."""
    listed = inner.removeprefix("!")
    ranges, at = [], 0
    while at < len(listed):
        last = at + 2 if listed[at + 1 : at + 2] == "-" and at + 2 < len(listed) else at
        if listed[at] <= listed[last]:
            ranges.append((ord(listed[at]), ord(listed[last])))
        at = last + 1
    return _others(ranges) if inner.startswith("!") else _joined(ranges)


def _joined(ranges: Iterable[tuple[int, int]]) -> _Ranges:
    found: list[tuple[int, int]] = []
    for low, high in sorted(ranges):
        if found and low <= found[-1][1] + 1:
            found[-1] = (found[-1][0], max(high, found[-1][1]))
        else:
            found.append((low, high))
    return tuple(found) or _NOTHING


def _others(ranges: Iterable[tuple[int, int]]) -> _Ranges:
    found, begin = [], 0
    for low, high in sorted(ranges):
        if begin < low:
            found.append((begin, low - 1))
        begin = max(begin, high + 1)
    return (*found, (begin, _LAST)) if begin <= _LAST else tuple(found) or _NOTHING


_NOTHING: Final[_Ranges] = ((1, 0),)
"""The range of no character."""


def _common(one: Pattern, other: Pattern) -> frozenset[Pattern] | None:
    """Return patterns of all texts that match both; None where there are too many of them.

    From the end, for each two endings: a ``*`` of either ends, or takes one more character of the other.
    """
    nothing: frozenset[Pattern] = frozenset()
    below: list[frozenset[Pattern]] = []
    for at in range(len(one), -1, -1):
        row = [nothing] * (len(other) + 1)
        first = one[at] if at < len(one) else None
        for beside in range(len(other), -1, -1):
            second = other[beside] if beside < len(other) else None
            if first is None and second is None:
                row[beside] = frozenset([()])
            elif first == _MANY and second == _MANY:
                row[beside] = _before(_MANY, below[beside] | row[beside + 1])
            elif first == _MANY:
                row[beside] = below[beside] | (nothing if second is None else _before(second, row[beside + 1]))
            elif second == _MANY:
                row[beside] = row[beside + 1] | (nothing if first is None else _before(first, below[beside]))
            elif first is not None and second is not None and (shared := _shared(first, second)):
                row[beside] = _before(shared, below[beside + 1])
            if len(row[beside]) > _MOST_PATTERNS:
                return None
        below = row
    return below[0]


def _before(character: _Ranges, rests: Iterable[Pattern]) -> frozenset[Pattern]:
    return frozenset(rest if character == _MANY and rest[:1] == (_MANY,) else (character, *rest) for rest in rests)


def _shared(first: _Ranges, second: _Ranges) -> _Ranges:
    """Return the characters in both ranges; empty if there are none."""
    both = ((max(a, c), min(b, d)) for a, b in first for c, d in second)
    return tuple((low, high) for low, high in both if low <= high)


def _expression(character: _Ranges) -> str:
    if character in {_MANY, _ANY}:
        return ".*" if character == _MANY else "."
    if character == _NOTHING:
        return r"[^\x00-\x{10ffff}]"
    texts = [re.escape(chr(low)) + (f"-{re.escape(chr(high))}" if high > low else "") for low, high in character]
    return texts[0] if character[0][0] == character[-1][1] else f"[{''.join(texts)}]"
