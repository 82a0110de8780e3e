"""What was made of texts before, in any system: a modeler sends much the same again and again."""

from __future__ import annotations

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
