"""What was made of texts before, in any system: a modeler sends much the same again and again."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any, Final, TypeVar

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

MAXIMUM_REMEMBERED: Final = 20_000
MOST_LETTERS: Final = 4_096
LONGEST_REMEMBERED: Final = 64
"""Characters of the longest text that is worth remembering: longer ones seldom come again."""


def remember(memory: dict[tuple[Any, ...], Any], key: tuple[Any, ...], value: Any) -> None:
    """Add to a memory, unless the key has more text than people write; a full one forgets all."""
    if letters(key) <= MOST_LETTERS:
        keep(memory, key, value)


def keep(memory: dict[_Key, _Value], key: _Key, value: _Value, most: int = MAXIMUM_REMEMBERED) -> _Value:
    """Add to a memory what is known to be short, and return it; a full one forgets all."""
    if len(memory) >= most:
        memory.clear()
    memory[key] = value
    return value


def number_of(key: tuple[Any, ...]) -> int:
    """Return a number that stands for a key with little text in other keys; one that was forgotten gets another."""
    number = _NUMBERED.get(key)
    if number is None:
        number = keep(_NUMBERED, key, next(_NUMBERS))
    return number


def new_number() -> int:
    """Return a number that stands for nothing else."""
    return next(_NUMBERS)


_NUMBERED: Final[dict[tuple[Any, ...], int]] = {}
_NUMBERS: Final = count()


def letters(key: object) -> int:
    """How much text a key has."""
    if isinstance(key, str):
        return len(key)
    return sum([letters(each) for each in key if isinstance(each, (str, tuple))]) if isinstance(key, tuple) else 0


_WORTH_IT: Final = 1_000
_MANY: Final = 10_000


@contextmanager
def uncollected(size: int = _WORTH_IT) -> Iterator[None]:
    """Keep the garbage collector away while what stays is built; below ``size`` 1,000 that is not worth it.

    It would look at all of that again and again, which takes longer than the building. What was built makes no cycles:
    many objects are put among the old ones unseen. Threads may do this at the same time: who found the collector running
    switches it on again.
    """
    collecting = gc.isenabled() and size >= _WORTH_IT
    if collecting:
        gc.disable()
    try:
        yield
    finally:
        if collecting:
            if gc.get_count()[0] > _MANY and not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


_NEW_OBJECTS: Final = 2_000
_SELDOM: Final = 1_000


def collect_new_objects_only() -> None:
    """Keep the garbage collector away from all that is loaded now, and for long from what is remembered later.

    For a process that answers calls. With the memories of some thousand pairs, a look at all of them stops it for 0.2 s; a
    look at the new objects takes 0.5 ms. Cycles that outlive one such look stay until 1,000 times as much came.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(_NEW_OBJECTS, _SELDOM)
