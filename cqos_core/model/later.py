"""Parts of a report that are made when they are first read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar, cast

_T = TypeVar("_T")


class _Later(Sequence[_T]):
    """Items that are computed when they are first read; equal to the tuple of them, and pickled as that."""

    __slots__ = ("_compute", "_items")

    def __init__(self, compute: Callable[[], Iterable[_T]]) -> None:
        self._compute: Callable[[], Iterable[_T]] | None = compute
        self._items: tuple[_T, ...] = ()

    def _all(self) -> tuple[_T, ...]:
        if self._compute is not None:
            self._items = tuple(self._compute())
            self._compute = None
        return self._items

    def __getitem__(self, index: Any) -> Any:
        return self._all()[index]

    def __len__(self) -> int:
        return len(self._all())

    def __eq__(self, other: object) -> bool:
        return self._all() == (other._all() if isinstance(other, _Later) else other)

    def __hash__(self) -> int:
        return hash(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[type, tuple[tuple[_T, ...]]]:
        return tuple, (self._all(),)


def later(compute: Callable[[], Iterable[_T]]) -> tuple[_T, ...]:
    """Return the items that ``compute`` makes, which is called when they are first read; it must be pure."""
    return cast("tuple[_T, ...]", _Later(compute))
