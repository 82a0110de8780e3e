"""Tuples whose items are computed when they are first read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final, TypeVar, cast

_T = TypeVar("_T")


class _Items(tuple[_T, ...]):
    """Computed items; a type of its own tells them from the input."""

    __slots__ = ()


class _Later(Sequence[_T]):
    """Items that are computed when they are first read; equal to the tuple of them, and pickled as that."""

    __slots__ = ("_compute", "_state")

    def __init__(self, compute: Callable[..., Iterable[_T]], given: Any) -> None:
        self._compute: Callable[..., Iterable[_T]] | None = compute
        # The input, then the items: a large report has hundreds of thousands of these. Threads may read at once.
        self._state = given

    def _all(self) -> tuple[_T, ...]:
        given, compute = self._state, self._compute
        if compute is not None and type(given) is not _Items:
            self._state = _Items(compute() if given is _NOTHING else compute(given))
            self._compute = None
        return cast("tuple[_T, ...]", self._state)

    def __getitem__(self, index: Any) -> Any:
        return self._all()[index]

    def __iter__(self) -> Iterator[_T]:
        return iter(self._all())  # the one of `Sequence` asks for each item by its index

    def __len__(self) -> int:
        return len(self._all())

    def __add__(self, other: Iterable[_T]) -> tuple[_T, ...]:
        return (*self._all(), *other)

    def __radd__(self, other: Any) -> Any:
        return (
            (*other, *self._all()) if isinstance(other, tuple) else NotImplemented
        )  # lists take it as they take a tuple

    def __eq__(self, other: object) -> bool:
        return self._all() == (other._all() if isinstance(other, _Later) else other)

    def __hash__(self) -> int:
        return hash(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[type, tuple[tuple[_T, ...]]]:
        return tuple, ((*self._all(),),)


_NOTHING: Final = object()


def lazy_tuple(compute: Callable[..., Iterable[_T]], given: object = _NOTHING) -> tuple[_T, ...]:
    """Return a tuple that calls ``compute`` with ``given``, or nothing, when it is first read; ``compute`` must be pure."""
    return cast("tuple[_T, ...]", _Later(compute, given))
