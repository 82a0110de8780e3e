"""Names as people give them to BPMN elements, and what makes two of them the same."""

from __future__ import annotations

import re
from decimal import Decimal, InvalidOperation
from functools import lru_cache

# Marks of zero width and of writing direction are invisible: two names that differ in them look the same.
_INVISIBLE = re.compile("[\u061c\u200b-\u200f\u202a-\u202e\u2060-\u2064\u2066-\u2069\ufeff]")
_AT_RUN_TIME = re.compile(r"[$#]\{|^=")
_NOT_COUNTED = re.compile(r"[-_\s]")
_WHOLE_NUMBER = re.compile(r"0*[1-9]\d{0,5}", re.ASCII)
_SHOWN = 60
_LONGEST_NUMBER = 100


def fold(name: str | None) -> str:
    """Return ``name`` in one line, without blanks around it and without invisible marks; perhaps empty."""
    name = name or ""
    return " ".join((name if name.isascii() else _INVISIBLE.sub("", name)).split())


def shown(name: str) -> str:
    """Return ``name`` as it goes into a message: in one line, not too long, nothing that moves a terminal's cursor."""
    name = fold(name)
    name = name if len(name) <= _SHOWN else f"{name[: _SHOWN - 1]}…"
    return "".join(character if character.isprintable() else "\ufffd" for character in name)


def is_computed(name: str) -> bool:
    """Say whether an engine computes the name: ``${…}`` and ``#{…}`` of Java engines, a leading ``=`` of Zeebe."""
    return _AT_RUN_TIME.search(name) is not None


def key(word: str) -> str:
    """Return what is left of a name or word when case, ``_``, ``-`` and blanks do not count."""
    return _key(word) if len(word) <= _SHOWN else _NOT_COUNTED.sub("", word).lower()


@lru_cache(maxsize=1024)
def _key(word: str) -> str:
    return _NOT_COUNTED.sub("", word).lower()


def number(text: str) -> Decimal | None:
    """Return the finite number that ``text`` writes, None if it is none."""
    try:
        found = Decimal(text.strip()[:_LONGEST_NUMBER])
    except InvalidOperation:
        return None
    return found if found.is_finite() else None


def whole_number(text: str | None) -> int | None:
    """Return the whole number from 1 to 999,999 that a text writes, None where it writes none."""
    found = _WHOLE_NUMBER.fullmatch((text or "").strip())
    return int(found[0]) if found else None


def same_value(one: str, other: str) -> bool:
    """Say whether two texts of a setting mean the same: equal numbers or equal words."""
    if key(one) == key(other):
        return True
    first = number(one)
    return first is not None and first == number(other)


POLICY_NAMES = (
    *("history", "depth", "reliability", "durability"),
    *("deadline", "lifespan", "liveliness", "leaseDuration"),
)
"""The eight policies of the paper."""
POLICIES = frozenset(key(name) for name in POLICY_NAMES)
"""Their names as `key` folds them."""
