"""Recognises keys that look like QoS, so that an importer can warn of keys that it does not use."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from cqos_core.model.spelling import distance, folded

_MOST: Final = 2
_LONG_ENOUGH: Final = 5
_SHORTEST: Final = 3
_LONGEST: Final = 60


def looks_like_qos(key: str, names: Iterable[str]) -> str | None:
    """Return the one of ``names`` that ``key`` is, or is a typing error of; None where it is neither.

    Ask it of keys that stand where the format may hold QoS and that the importer does not use. ``names`` are those that
    may hold QoS in this format: its own keys, and names and aliases of policies. Case and separators do not count. A name
    of five letters or more may have two typing errors, a shorter one a letter too many or two swapped. An equal name is
    one in the wrong place.
    """
    return _looks_like(key, tuple(names)) if len(key) <= _LONGEST else None


@lru_cache(maxsize=4096)
def _looks_like(key: str, names: tuple[str, ...]) -> str | None:
    written = folded(key)
    if len(written) < _SHORTEST:
        return None
    errors = {name: _typing_errors(written, folded(name)) for name in names}
    nearest = min(names, key=errors.__getitem__, default=None)
    return nearest if nearest is not None and errors[nearest] <= _MOST else None


def _typing_errors(written: str, name: str) -> int:
    if written == name:
        return 0
    if len(name) >= _LONG_ENOUGH and len(written) >= _LONG_ENOUGH:
        return distance(written, name, _MOST)
    swapped_or_longer = len(written) > len(name) or (len(written) == len(name) and sorted(written) == sorted(name))
    near = len(name) >= _SHORTEST and swapped_or_longer and distance(written, name, 1) <= 1
    return 1 if near else _MOST + 1
