"""Values with numbers, which represent them in tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable

_Value = TypeVar("_Value")


class Numbered(list[_Value]):
    """Values in the order in which their keys came; the number of one is its position."""

    def __init__(self, first: Iterable[_Value] = ()) -> None:
        """Begin with values that are their own keys."""
        super().__init__(first)
        self._numbers: dict[Hashable, int] = {key: at for at, key in enumerate(self)}

    def number(self, key: Hashable, value: _Value) -> int:
        """Return the number of a key; that of a new one is the number of its value."""
        number = self._numbers.setdefault(key, len(self))
        if number == len(self):
            self.append(value)
        return number
