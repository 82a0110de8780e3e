"""Writes blocks of lines that differ in the numbers of their names and places as one block: a system of a thousand endpoints is a page.

``/line{0..570/30}`` stands for the names with 0, 30, … 570; ``{3,5 +8 x20}`` for 3, 5, 11, 13, … twenty times; ``{5*12, 7..9*2}`` for
twelve times 5, and then 7, 7, 8, 8, 9, 9. All braces of a block go through the same blocks in the same order. So only the order among blocks of different forms is
not written.
"""

from __future__ import annotations

import re
from itertools import groupby
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_FEWEST: Final = 3
"""So many blocks of one form are written as one; so many numbers are a progression."""
_LONGEST_PERIOD: Final = 12
_DIGITS: Final = re.compile(r"[0-9]+")
_MARK: Final = "\x1f"
_NUMBER: Final = re.compile(f"{_MARK}([0-9]+)")


def variable(name: str) -> str:
    """Return a name or a place whose numbers may differ among blocks that are written as one."""
    return _DIGITS.sub(lambda found: _MARK + found[0], name)


def plain(line: str) -> str:
    """Return a line without the marks of what is variable."""
    return line.replace(_MARK, "")


def folded(blocks: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of blocks; those that differ in variable numbers only are one block, in the place of the first."""
    alike: dict[str, list[str]] = {}
    for block in blocks:
        text = "\n".join(block)
        alike.setdefault(_NUMBER.sub(_MARK, text), []).append(text)
    return [line for form, texts in alike.items() for text in _as_one(form, texts) for line in text.split("\n")]


def listed(names: Sequence[str]) -> str:
    """Return names in one line; many that differ in numbers only are one, whose numbers are no longer variable."""
    return ", ".join(folded([variable(name)] for name in names))


def _as_one(form: str, texts: Sequence[str]) -> Sequence[str]:
    if len(texts) < _FEWEST:
        return texts
    if len({*texts}) == 1:
        return [f"{len(texts)} x {texts[0]}"]
    numbers = [_numbers(values) for values in zip(*map(_NUMBER.findall, texts), strict=True)]
    first, *others = form.split(_MARK)
    return [first + "".join(f"{number}{text}" for number, text in zip(numbers, others, strict=True))]


def _numbers(values: Sequence[str]) -> str:
    """Return the numbers that stand in one place of several texts, one after the other."""
    if len({*values}) == 1:
        return values[0]
    for others in range(min(_LONGEST_PERIOD, len(values) - 1)):
        first, last = _periodic(values[others:]), _periodic(values[: len(values) - others])
        if first or last:
            before, after = (values[:others], ()) if first else ((), values[len(values) - others :])
            return f"{{{', '.join((*_runs(before), first or last, *_runs(after)))}}}"
    return f"{{{', '.join(_runs(values))}}}"


def _periodic(values: Sequence[str]) -> str:
    """Return numbers that are some numbers and then these again and again, each time as much larger; empty where they are not."""
    numbers = [*map(int, values)]
    for period in range(1, min(_LONGEST_PERIOD, len(numbers) // _FEWEST) + 1):
        steps = {later - each for each, later in zip(numbers, numbers[period:], strict=False)}
        if len(steps) == 1 and len(numbers) % period == 0:
            (step,) = steps
            if period > 1:
                return f"{','.join(_runs(values[:period]))} +{step} x{len(numbers) // period}"
            return f"{values[0]}..{values[-1]}{'' if step == 1 else f'/{step}'}" if step else ""
    return ""


def _runs(values: Sequence[str]) -> Iterator[str]:
    """Yield numbers, those that follow each other as one."""
    counted = [(value, len([*same])) for value, same in groupby(values)]
    at = 0
    while at < len(counted):
        (first, times), end = counted[at], at + 1
        while end < len(counted) and counted[end] == (str(int(first) + end - at), times):
            end += 1
        short = end - at < _FEWEST
        yield (first if short else f"{first}..{counted[end - 1][0]}") + (f"*{times}" if times > 1 else "")
        at = at + 1 if short else end
