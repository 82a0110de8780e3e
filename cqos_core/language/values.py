"""Values: plain ones, uncertain ones, and their values under an assumption.

A plain value is an integer (the rank of a choice, nanoseconds, a count, a flag), a text, or a tuple of texts; so every
comparison of the language is a comparison of plain Python values, and of column values too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from itertools import product
from math import prod
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from cqos_core.model.caches import LONGEST_REMEMBERED
from cqos_core.model.dataclass import dataclass

INFINITE: Final = 2**63 - 1
"""An infinite duration in nanoseconds, and an unlimited count."""
START_ORDER: Final = "start order"
"""The assumption of values that depend on the order in which endpoints start."""
MAXIMUM_WORLDS: Final = 64


@dataclass(frozen=True, slots=True)
class Anything:
    """Any value of the policy's domain; ``cause`` says why it is not known.

    ``code``: of the finding that reports the cause, so that consequences need no finding of their own.
    """

    cause: str
    code: str = ""

    @property
    def reported(self) -> bool:
        """Whether the cause is a finding of its own."""
        return bool(self.code)


@dataclass(frozen=True, slots=True)
class Depends:
    """A value that depends on an assumption: ``on`` names it (``ros2.rmw``), ``cases`` give the value under each."""

    on: str
    cases: tuple[tuple[str, Value], ...]


@dataclass(frozen=True, slots=True)
class FromPeers:
    """A value taken from the other side when the endpoint is created; `settle` turns it into a plain one or `Depends`.

    A bridge may also copy from endpoints on its other side: its publication takes values of publishers there.

    Attributes:
        alone: the value without any peer, as text.
        peers: how the peers' values are put together: ``largest``, ``largest_stated``, ``smallest_stated``,
            ``strongest_if_all``, ``strongest_if_any``, ``any`` (that of the first one found) or ``constant`` (always
            ``alone``).
        waits: the endpoint is created only when a peer is there, so ``alone`` counts only where peers differ.
        side: the endpoints that are copied: its ``peers``; the ``publishers`` or the ``subscribers``, over a bridge where it is one of them
            itself; or of both sides those that are there ``first``.
    """

    alone: str
    peers: str
    waits: bool = False
    side: Literal["peers", "publishers", "subscribers", "first"] = "peers"


@dataclass(frozen=True, slots=True)
class OneOf:
    """A word of an option that leaves open which of several values it has: a vendor's name without its version."""

    values: tuple[str, ...]


class Range(NamedTuple):
    """Every value from ``lo`` to ``hi``, inclusive."""

    lo: Any
    hi: Any


class WrittenValue(NamedTuple):
    """The text of a value as it was written: the normalised word, and whether it stands at the endpoint itself, not in a profile."""

    word: str
    here: bool


UNREAD: Final = WrittenValue("", here=False)
"""The `WrittenValue` of a value that was not understood."""
COMBINATIONS: Final = (
    "any",
    "constant",
    "largest",
    "largest_stated",
    "smallest_stated",
    "strongest_if_all",
    "strongest_if_any",
)
"""The possible values of `FromPeers.peers`."""

Plain: TypeAlias = int | str | tuple[str, ...]
Value: TypeAlias = Plain | Anything | Depends | FromPeers
Values: TypeAlias = tuple[Any, ...]
"""A value per policy of a vocabulary, then per policy a `WrittenValue` or None."""
Assumptions: TypeAlias = dict[str, tuple[str, ...]]
"""Assumptions that values depend on, each with its cases."""

ANYTHING: Final = Anything("its value is not known")
KNOWN: Final = frozenset({int, str, tuple, bool})


def is_plain(value: Value) -> bool:
    """Whether the value is known for certain."""
    return isinstance(value, (int, str, tuple))


def normalise(text: str) -> str:
    """``Keep Last`` → ``keep_last``: lower case, blanks and hyphens as underscores."""
    return _remembered(text) if len(text) <= LONGEST_REMEMBERED else _normalised(text)


def _normalised(text: str) -> str:
    return text.lower() if text.isalnum() else re.sub(r"[\s\-]+", "_", text.strip()).lower()


_remembered = lru_cache(maxsize=16_384)(_normalised)


def collect_variables(value: Any, found: Assumptions) -> None:
    """Add the assumptions that ``value`` depends on, with their cases, to ``found``."""
    if isinstance(value, Depends):
        names = (*found.get(value.on, ()), *(name for name, _ in value.cases))
        found[value.on] = tuple(dict.fromkeys(names))
        for _, case in value.cases:
            collect_variables(case, found)


def worlds_of(values: Iterable[Any]) -> list[dict[str, str]] | None:
    """Return every assignment of the assumptions that ``values`` depend on; None where there are too many."""
    found: Assumptions = {}
    for value in values:
        collect_variables(value, found)
    if prod(map(len, found.values())) > MAXIMUM_WORLDS:
        return None
    names = sorted(found)
    return [dict(zip(names, chosen, strict=True)) for chosen in product(*(found[name] for name in names))]


def in_world(value: Any, world: Mapping[str, str]) -> Any:
    """Return ``value`` under the assumptions of ``world``; what they leave open stays `Anything` or a `Range`."""
    while isinstance(value, Depends):
        cases = dict(value.cases)
        case = world.get(value.on)
        if case is None or case not in cases:
            inner = [in_world(v, world) for v in cases.values()]
            if all(isinstance(v, int) for v in inner):
                return Range(min(inner), max(inner))
            return inner[0] if len(set(inner)) == 1 else Anything(f"it depends on {value.on}")
        value = cases[case]
    return Anything("it is taken from peers") if isinstance(value, FromPeers) else value


def settled(values: Values, world: Mapping[str, str], indices: Iterable[int]) -> Values:
    """Return ``values`` with what a condition reads, at ``indices``, under the assumptions of ``world``."""
    opened = [index for index in indices if isinstance(values[index], (Depends, FromPeers))]
    if not opened:
        return values
    known = list(values)
    for index in opened:
        known[index] = in_world(values[index], world)
    return tuple(known)
