"""Names that differ by a typing error: one bounded edit distance, and the nearest of several names."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property, lru_cache
from typing import Final

from cqos_core.model.grouping import grouped
from cqos_core.model.regular_expressions import regular_expression

_LONGEST: Final = 60
"""Characters of the longest name that is compared: longer ones are no typing errors of a known name."""


def distance(one: str, other: str, most: int) -> int:
    """Count the letters to insert, delete, replace or swap with their neighbour; ``most + 1`` where that is more than ``most``.

    Costs about ``most`` times the length of the names.
    """
    if one == other:
        return 0
    if abs(len(one) - len(other)) > most:
        return most + 1
    one, other = _differing(one, other)
    far = most + 1
    if len(one) < 2 or len(other) < 2:  # noqa: PLR2004 - no two letters to swap
        shorter, longer = sorted((one, other), key=len)
        return min(len(longer) - (bool(shorter) and shorter in longer), far)
    if most < 2:  # noqa: PLR2004 - only a swap is near
        return 1 if most and len(one) == len(other) == 2 and one == other[::-1] else far  # noqa: PLR2004
    band = 2 * most + 1  # of each row of the table only what is near its diagonal: column = row + index - most
    before = [far] * (band + 1)
    last = [far] * most + [min(column, far) for column in range(most + 2)]
    for row, letter in enumerate(one, 1):
        this = [far] * (band + 1)
        for index in range(max(0, most - row), min(band, len(other) - row + most + 1)):
            column = row + index - most
            cost = min(last[index + 1], this[index - 1] if index else far) + 1
            if column:
                cost = min(cost, last[index] + (letter != other[column - 1]))
                if row > 1 < column and letter == other[column - 2] and one[row - 2] == other[column - 1]:
                    cost = min(cost, before[index] + 1)
            this[index] = min(cost, far)
        if min(this) == far:
            return far
        before, last = last, this
    return last[len(other) - len(one) + most]


def _differing(one: str, other: str) -> tuple[str, str]:
    """Return both without their common beginning and end."""
    shorter = min(len(one), len(other))
    start = 0
    while start < shorter and one[start] == other[start]:
        start += 1
    end = 0
    while end < shorter - start and one[-1 - end] == other[-1 - end]:
        end += 1
    return one[start : len(one) - end], other[start : len(other) - end]


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the one of ``known`` that ``word`` was probably meant to be, None where none is near.

    Case, blanks and hyphens do not count. Every third letter may be wrong; a name that ``word`` begins, or that begins
    ``word``, is near too. A number of three digits or more at the end of a name is meant: ``ROS102`` is not near ``ROS101``.
    """
    return _nearest(word, tuple(known)) if len(word) <= _LONGEST else None


@lru_cache(maxsize=256)
def _nearest(word: str, known: tuple[str, ...]) -> str | None:
    meant = folded(word)
    names = [(name, letters) for name in known if not _of_another_number(meant, letters := folded(name))]
    best, found = len(meant) // 3, None
    for name, letters in names:
        apart = distance(meant, letters, best)
        if apart <= best and (found is None or apart < best):
            best, found = apart, name
    if len(meant) >= _SHORTEST_START and (found is None or best > _TYPED_WRONG):
        found = next((name for name, letters in names if letters.startswith(meant)), found)
    return found


def _of_another_number(word: str, name: str) -> bool:
    """Return whether ``name`` ends with a long number, and ``word`` is letters and another one; a digit too many or too few is an error."""
    number, own = _LONG_NUMBER.search(name), _NUMBERED.fullmatch(word)
    if number is None or own is None or own[1] == number[0]:
        return False
    return len(own[1]) == len(number[0]) or distance(own[1], number[0], 1) > 1


_NUMBERED: Final = regular_expression(r"\D+(\d+)")
_LONG_NUMBER: Final = regular_expression(r"\d{3,}$")
_SHORTEST_START: Final = 3
_TYPED_WRONG: Final = 2
"""Wrong letters of a typing error; a name that begins with the written text is nearer than one with more wrong letters."""


def same_start(word: str, known: Iterable[str]) -> str | None:
    """Return the only name that begins with the first half of ``word``, of four letters at least; None where none or several do."""
    half = folded(word)[: max(_SAME_START, (len(folded(word)) + 1) // 2)]
    alike = [name for name in known if len(half) >= _SAME_START and folded(name).startswith(half)]
    return alike[0] if len(alike) == 1 else None


_SAME_START: Final = 4


class KnownNames:
    """Names that exist; made once where many others are looked up in them.

    Attributes:
        names: each once, sorted.
    """

    def __init__(self, names: Iterable[str]) -> None:
        """Keep ``names``."""
        self.names = tuple(sorted(set(names)))

    def nearest(self, word: str) -> str | None:
        """Return the name that ``word`` was probably meant to be; of many names only those that differ by one letter or two swapped."""
        if len(self.names) <= _FEW:
            return nearest(word, self.names)
        shortened = _shortened(word)
        return nearest(word, sorted({name for each in shortened for name in self._by_stub.get(each, ())[:_CROWD]}))

    @cached_property
    def _by_stub(self) -> dict[str, list[str]]:
        return grouped((stub, name) for name in self.names for stub in _shortened(name))


_FEW: Final = 200
"""Names that are all compared."""


def _shortened(name: str) -> set[str]:
    """Return the folded name, whole and without each one of its letters: two that share one of them differ by a typing error."""
    word = folded(name) if len(name) <= _LONGEST else ""
    return {word, *(word[:at] + word[at + 1 :] for at in range(len(word)))}


def typing_errors(names: Iterable[str], others: Iterable[str]) -> dict[str, list[str]]:
    """Return for each of ``names`` the ``others`` that differ from it by a typing error, the nearest first.

    A typing error is a letter too many, too few or wrong, or two that are swapped; in a word of eight letters or more
    also one that moved. It is in one word of the name, of four letters or more. Other separators between the same words are one too
    (``imu/data`` and ``imu_data``). Digits never differ: numbered names are meant to. The cost grows with the length of
    all names, not with their pairs.
    """
    by_stub = grouped((stub, other) for other in dict.fromkeys(others) for stub in stubs_of(other))
    found = {}
    for name in dict.fromkeys(names):
        candidates = dict.fromkeys(other for stub in stubs_of(name) for other in by_stub.get(stub, ())[:_CROWD])
        near = sorted((apart, other) for other in candidates if (apart := _mistyped(name, other)))
        if near:
            found[name] = [other for _, other in near]
    return found


def _sorted_letters(name: str) -> tuple[str, str]:
    """Return the letters without separators in alphabetical order, and the digits in their order."""
    letters = sorted(letter for letter in name if not letter.isdigit() and letter not in _SEPARATORS)
    return "".join(letters), "".join(filter(str.isdigit, name))


_SEPARATORS: Final = frozenset("/_-.")
_SEPARATOR: Final = regular_expression(r"(?<!\d)[-/_.]|[-/_.](?!\d)")
"""One that does not keep two numbers apart."""
_CROWD: Final = 8
"""The most names that are compared if they become equal without one letter: among more, none is a typing error."""
_SHORTEST_WORD: Final = 4
_LONG_WORD: Final = 8
_WORD: Final = regular_expression(r"[^\W\d]+(?:[-.]?[^\W\d]+)*")


def stubs_of(name: str) -> set[str]:
    """Return the letters of ``name`` in alphabetical order, all and without each one of them; its digits as they stand, no separators.

    Two names that share one of them differ by one letter, or by one and by the order of letters.
    """
    if len(name) > _LONGEST:
        return set()
    letters, digits = _sorted_letters(name)
    return {letters + digits, *(letters.replace(letter, "", 1) + digits for letter in set(letters))}


def _mistyped(one: str, other: str) -> int:
    """Return the number of wrong letters of a typing error; 0 if it is none."""
    if abs(len(one) - len(other)) <= 1 and one != other and _SEPARATOR.sub("", one) == _SEPARATOR.sub("", other):
        return 1
    if _WORD.split(one) != _WORD.split(other):
        return 0
    words = [pair for pair in zip(_WORD.findall(one), _WORD.findall(other), strict=True) if pair[0] != pair[1]]
    if len(words) != 1:
        return 0
    longest = max(map(len, words[0]))
    most = 0 if longest < _SHORTEST_WORD else 1 if longest < _LONG_WORD else 2
    apart = distance(*words[0], most)
    return apart if apart <= most else 0


def folded(name: str) -> str:
    """Return the letters and digits of ``name`` in lower case: ``History-Depth`` and ``history.depth`` are one."""
    return "".join(letter for letter in name.lower() if letter.isalnum())
