"""Texts of the page: words and signs of verdicts, counts, sentences in pieces."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from cqos_core.model.finding import Verdict, plural

WORDS: Final[Mapping[Verdict | None, str]] = {
    Verdict.COMPATIBLE: "compatible",
    Verdict.INCOMPATIBLE: "incompatible",
    Verdict.UNKNOWN: "unknown",
    None: "unmatched",
}
_SYMBOLS: Final = {"compatible": "✓", "incompatible": "✕", "unknown": "?", "unmatched": "–"}  # noqa: RUF001
_NAME: Final = re.compile(r"`([^`]+)`")


def symbol(verdict: Verdict | None) -> str:
    """Return the sign of a verdict."""
    return _SYMBOLS[WORDS[verdict]]


def state(*, wrong: bool) -> str:
    """Return the state of an entry for the filter of the page."""
    return "wrong" if wrong else "fine"


def counted(number: int, noun: str) -> str:
    """Return ``1 topic`` or ``1,200 topics``."""
    return plural(number, noun) if number < 1000 else f"{number:,} {noun}s"  # noqa: PLR2004


def text_pieces(text: str) -> list[dict[str, Any]]:
    """Return a sentence as pieces, names in backticks apart."""
    return [{"name": number % 2 == 1, "text": piece} for number, piece in enumerate(_NAME.split(text)) if piece]


def first_names(names: Sequence[str], most: int) -> list[str]:
    """Return the first names, and the number of further ones."""
    return [*names[:most], *([f"and {len(names) - most:,} more"] if len(names) > most else [])]
