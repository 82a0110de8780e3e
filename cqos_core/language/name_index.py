"""Values filed under shell patterns, found by a name without trying every pattern."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Generic, TypeVar

from cqos_core.model.grouping import grouped
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.wildcards import fits

if TYPE_CHECKING:
    import re
    from collections.abc import Iterable, Iterator

T = TypeVar("T")
_WILD: Final = regular_expression(r"[*?\[\]]")


class NameIndex(Generic[T]):
    """Values under shell patterns (``*``, ``?``, ``[a-z]``), each also under the plain text of its pattern.

    A pattern is filed under the text before its first wildcard, else under that after its last one. So looking up a name
    costs a few dictionary look-ups and one match per pattern that begins or ends like the name.
    """

    def __init__(self, entries: Iterable[tuple[str, T]], wild: re.Pattern[str] = _WILD) -> None:
        """File each value under its pattern; ``wild`` finds the characters that do not stand for themselves."""
        listed = list(entries)
        self._values = [value for _, value in listed]
        self._exact = grouped((pattern, number) for number, (pattern, _) in enumerate(listed))
        numbered = ((number, pattern, wild.split(pattern)) for number, (pattern, _) in enumerate(listed))
        parted = [(parts[0], parts[-1], (number, pattern)) for number, pattern, parts in numbered if len(parts) > 1]
        self._by_head = grouped((head, each) for head, tail, each in parted if head or not tail)
        self._by_tail = grouped((tail, each) for head, tail, each in parted if tail and not head)
        self._heads = sorted({len(head) for head in self._by_head})
        self._tails = sorted({len(tail) for tail in self._by_tail})
        self._begins, self._ends = tuple(self._by_head), tuple(self._by_tail)

    def __bool__(self) -> bool:
        return bool(self._values)

    def __iter__(self) -> Iterator[T]:
        return iter(self._values)

    def may_match(self, name: str) -> bool:
        """Whether a pattern is a name, or begins or ends like it: for most names this is all that has to be looked at."""
        return name in self._exact or name.startswith(self._begins) or name.endswith(self._ends)

    def matching(self, *names: str) -> list[T]:
        """Return the values whose pattern matches any of ``names``, in the order in which they were filed."""
        found: set[int] = set()
        for name in names:
            found.update(self._exact.get(name, ()))
            found.update(number for number, pattern in self._like(name) if fits(name, pattern))
        return [self._values[number] for number in sorted(found)]

    def candidates(self, name: str) -> list[T]:
        """Return the values whose pattern is ``name``, or begins or ends like it up to its first and last wild character."""
        found = {number for number, _ in self._like(name)}.union(self._exact.get(name, ()))
        return [self._values[number] for number in sorted(found)]

    def _like(self, name: str) -> Iterator[tuple[int, str]]:
        for length in self._heads:
            if length <= len(name):
                yield from self._by_head.get(name[:length], ())
        for length in self._tails:
            if length <= len(name):
                yield from self._by_tail.get(name[-length:], ())
