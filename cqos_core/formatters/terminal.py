"""Text for terminals: control characters are spelled, and widths are counted in cells."""

from __future__ import annotations

from collections.abc import Callable

# They shape emoji and Persian words, have no width of their own and reorder nothing.
_JOINERS = "\u200c\u200d"
_NARROWEST = 30  # below this, wrapped text is a column of single words
_COLORS = {
    "error": "1;31",
    "warning": "1;33",
    "note": "1;36",
    "incompatible": "1;31",
    "unknown": "1;33",
    "compatible": "1;32",
    "help": "1;32",
    "title": "1",
    "frame": "34",
    "quiet": "2",
}

Paint = Callable[[str, str], str]
"""Colours a text (first) for its role (second): a severity, a verdict, or ``title``, ``frame``, ``help``, ``quiet``."""


def paint(*, color: bool) -> Paint:
    """Return a function that colours text, or one that leaves it unchanged."""
    # Eight escape sequences: rich would cost more than all else that a short report needs at start-up.
    if not color:
        return lambda text, _role: text
    return lambda text, role: f"\x1b[{_COLORS[role]}m{text}\x1b[0m" if text else text


def clean(text: str) -> str:
    r"""Return ``text`` as one line, with invisible and control characters spelled: ``\x1b``, ``\n``."""
    return text if text.isprintable() else "".join(map(clean_character, text))


def clean_character(character: str) -> str:
    """Return a character, spelled if it does not print."""
    if character.isprintable() or character in _JOINERS:
        return character
    # Surrogates, too, end up here: no stream could encode them.
    return character.encode("unicode_escape").decode("ascii")


def cells(text: str) -> int:
    """Return how many columns of a terminal clean ``text`` takes."""
    return len(text) if text.isascii() else sum(map(_width, text))


def _width(character: str) -> int:
    from unicodedata import category, east_asian_width

    if character in _JOINERS or category(character) in {"Mn", "Me"}:
        return 0
    return 2 if east_asian_width(character) in {"W", "F"} else 1


def hanging(columns: int, text: str, indent: int) -> list[str]:
    """Wrap ``text``, cleaned, behind ``indent`` blanks; further lines stand two blanks deeper."""
    first, *rest = wrap(clean(text), columns - indent - 2)
    return [f"{' ' * indent}{first}", *(f"{' ' * (indent + 2)}{line}" for line in rest)]


def wrap(text: str, width: int) -> list[str]:
    """Break clean ``text`` at spaces into lines of at most ``width`` cells; a longer word has a line of its own."""
    width = max(width, _NARROWEST)
    lines: list[str] = []
    room = 0
    for word in text.split():
        needed = cells(word)
        if lines and needed < room:
            lines[-1] += f" {word}"
            room -= needed + 1
        else:
            lines.append(word)
            room = width - needed
    return lines or [""]
