"""Which files and folders a search passes over, by patterns in the syntax of ``.gitignore``."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.model.encoding import decode

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

GENERATED: Final = frozenset({"build", "install", "log", "node_modules", "__pycache__"})
"""Folders that tools generate."""
_FILE: Final = ".gitignore"
_REPOSITORY: Final = ".git"


class Patterns(NamedTuple):
    """Patterns that are relative to one folder.

    Attributes:
        folder: absolute path.
        rules: in order: the expression over a relative path, whether it excludes, whether it is about folders only.
    """

    folder: str
    rules: tuple[tuple[re.Pattern[str], bool, bool], ...]

    def decide(self, path: str, *, is_folder: bool) -> bool | None:
        """Whether an absolute path is excluded; None where no pattern matches. The last one that matches wins."""
        if not path.startswith(self.folder.rstrip(os.sep) + os.sep):
            return None
        relative = path[len(self.folder.rstrip(os.sep)) + 1 :].replace(os.sep, "/")
        for expression, excludes, folders_only in reversed(self.rules):
            if (is_folder or not folders_only) and expression.fullmatch(relative):
                return excludes
        return None


def patterns(lines: Iterable[str], folder: str) -> Patterns:
    """Read patterns that are relative to ``folder``; one that is no pattern matches nothing."""
    rules = []
    for line in lines:
        text = re.sub(r"(?<!\\)[ \t\r]+$", "", line.rstrip("\n"))
        if not text or text.startswith("#"):
            continue
        excludes = not text.startswith("!")
        text = text.removeprefix("!")
        folders_only = text.endswith("/")
        text = text.rstrip("/")
        anchored = "/" in text
        text = text.removeprefix("/")
        try:
            rules.append((re.compile(("" if anchored else "(?:.*/)?") + _expression(text)), excludes, folders_only))
        except re.error:
            continue
    return Patterns(os.path.abspath(folder), tuple(rules))  # noqa: PTH100 - links stay as they are written


_PIECE: Final = re.compile(
    r"(?P<start>^\*\*/)|(?P<middle>/\*\*/)|(?P<end>/\*\*$)|\*+|\?|\[!?\]?[^\]]*\]|\\.|.", re.DOTALL
)


def _expression(pattern: str) -> str:
    return "".join(map(_piece, _PIECE.finditer(pattern)))


def _piece(found: re.Match[str]) -> str:
    text = found[0]
    if found["start"] is not None:
        return "(?:.*/)?"
    if found["middle"] is not None:
        return "/(?:.*/)?"
    if found["end"] is not None:
        return "/.*"
    if text.startswith("*"):
        return "[^/]*"
    if text == "?":
        return "[^/]"
    if text.startswith("[") and len(text) > 1:
        inner = text[1:-1].replace("\\", "\\\\")
        return f"[^/{inner[1:]}]" if inner.startswith("!") else f"[{inner}]"
    return re.escape(text[1:] if text.startswith("\\") and len(text) > 1 else text)


class Ignored:
    """Answers for one search which files and folders it passes over."""

    def __init__(self, folder: str, excluded: Sequence[Patterns] = ()) -> None:
        """Begin in ``folder``; what the files ``.gitignore`` above it say holds too, as far up as the repository goes."""
        self._excluded = excluded
        self._by_folder: dict[str, tuple[Patterns, ...]] = {}
        start = os.path.abspath(folder)  # noqa: PTH100 - links stay as they are written
        above = [start, *map(str, Path(start).parents)]
        root = next((at for at, each in enumerate(above) if Path(each, _REPOSITORY).exists()), 0)
        self._start = start
        known: tuple[Patterns, ...] = ()
        for each in reversed(above[: root + 1]):
            known = (*known, *_read(each))
        self._by_folder[start] = known

    def enter(self, folder: str) -> None:
        """Take in what stands in ``folder``, after the one that it is in was entered."""
        inner = os.path.abspath(folder)  # noqa: PTH100
        if inner not in self._by_folder:
            self._by_folder[inner] = (*self._by_folder.get(os.path.dirname(inner), ()), *_read(inner))  # noqa: PTH120

    def __call__(self, folder: str, name: str, *, is_folder: bool) -> bool:
        """Whether the search passes over ``name``, which stands in ``folder``."""
        if name.startswith(".") or (is_folder and name in GENERATED):
            return True
        inner = os.path.abspath(folder)  # noqa: PTH100
        path = os.path.join(inner, name)  # noqa: PTH118
        if any(each.decide(path, is_folder=is_folder) for each in self._excluded):
            return True
        for each in reversed(self._by_folder.get(inner, ())):
            decided = each.decide(path, is_folder=is_folder)
            if decided is not None:
                return decided
        return False


def _read(folder: str) -> tuple[Patterns, ...]:
    file = Path(folder, _FILE)
    try:
        text = decode(file.read_bytes()) if file.is_file() else ""
    except OSError:
        return ()
    return (patterns(text.split("\n"), folder),) if text.strip() else ()
