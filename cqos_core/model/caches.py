"""Bounded caches, shared by all systems of the process: a modeler sends much the same again and again."""

from __future__ import annotations

from itertools import count
from typing import Any, Final, TypeVar

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

MAXIMUM_REMEMBERED: Final = 20_000
MOST_LETTERS: Final = 4_096
LONGEST_REMEMBERED: Final = 64
"""The longest text, in characters, that is cached; longer ones seldom come again."""


def remember(memory: dict[tuple[Any, ...], Any], key: tuple[Any, ...], value: Any) -> None:
    """Add an entry to a cache, unless its key has more text than people write. A full cache is emptied first."""
    if letters(key) <= MOST_LETTERS:
        keep(memory, key, value)


def keep(memory: dict[_Key, _Value], key: _Key, value: _Value, most: int = MAXIMUM_REMEMBERED) -> _Value:
    """Add an entry with a short key to a cache, and return its value. A full cache is emptied first."""
    if len(memory) >= most:
        memory.clear()
    memory[key] = value
    return value


def number_of(key: tuple[Any, ...]) -> int:
    """Return a number to use in other keys in place of a short key; after the cache was emptied it is another one."""
    number = _NUMBERED.get(key)
    if number is None:
        number = keep(_NUMBERED, key, next(_NUMBERS))
    return number


def new_number() -> int:
    """Return a number that was never returned before."""
    return next(_NUMBERS)


_NUMBERED: Final[dict[tuple[Any, ...], int]] = {}
_NUMBERS: Final = count()


def letters(key: object) -> int:
    """Return the number of characters in a key."""
    if isinstance(key, str):
        return len(key)
    return sum([letters(each) for each in key if isinstance(each, (str, tuple))]) if isinstance(key, tuple) else 0
