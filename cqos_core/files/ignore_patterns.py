"""Patterns in the syntax of ``.gitignore``, by which a search skips files and folders."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.model.encoding import decode

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pathspec import GitIgnoreSpec

GENERATED_FOLDERS: Final = frozenset({"build", "install", "log", "node_modules", "__pycache__"})
"""Names of folders that tools generate."""
_FILE: Final = ".gitignore"
_REPOSITORY: Final = ".git"


class IgnorePatterns(NamedTuple):
    """Patterns that are relative to one folder, given by its absolute path."""

    folder: str
    spec: GitIgnoreSpec

    def decide(self, path: str, *, is_folder: bool) -> bool | None:
        """Whether an absolute path is excluded; None where no pattern matches. The last one that matches wins."""
        folder = self.folder.rstrip(os.sep) + os.sep
        if not path.startswith(folder):
            return None
        relative = path[len(folder) :].replace(os.sep, "/")
        return self.spec.check_file(f"{relative}/" if is_folder else relative).include


def read_ignore_patterns(lines: Iterable[str], folder: str) -> IgnorePatterns:
    """Read patterns that are relative to ``folder``; one that is no pattern matches nothing."""
    from pathspec import GitIgnoreSpec

    read: list[str] = []
    for line in lines:
        with suppress(ValueError):
            GitIgnoreSpec.from_lines([line.rstrip("\r\n")])
            read.append(line.rstrip("\r\n"))
    return IgnorePatterns(os.path.abspath(folder), GitIgnoreSpec.from_lines(read, backend="simple"))  # noqa: PTH100 - links stay


class IgnoreRules:
    """Decides for one search which files and folders it skips."""

    def __init__(self, folder: str, excluded: Sequence[IgnorePatterns] = ()) -> None:
        """Begin in ``folder``, with the ``.gitignore`` files above it up to the root of the repository."""
        self._excluded = excluded
        self._by_folder: dict[str, tuple[IgnorePatterns, ...]] = {}
        from pathlib import Path

        start = os.path.abspath(folder)  # noqa: PTH100 - links stay as they are written
        above = [start, *map(str, Path(start).parents)]
        root = next((at for at, each in enumerate(above) if Path(each, _REPOSITORY).exists()), 0)
        self._start = start
        known: tuple[IgnorePatterns, ...] = ()
        for each in reversed(above[: root + 1]):
            known = (*known, *_read(each))
        self._by_folder[start] = known

    def enter(self, folder: str) -> None:
        """Read the ``.gitignore`` of ``folder``; its parent has been entered before."""
        inner = os.path.abspath(folder)  # noqa: PTH100
        if inner not in self._by_folder:
            self._by_folder[inner] = (*self._by_folder.get(os.path.dirname(inner), ()), *_read(inner))  # noqa: PTH120

    def __call__(self, folder: str, name: str, *, is_folder: bool) -> bool:
        """Whether the search skips ``name`` in ``folder``."""
        if name.startswith(".") or (is_folder and name in GENERATED_FOLDERS):
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


def _read(folder: str) -> tuple[IgnorePatterns, ...]:
    from pathlib import Path

    file = Path(folder, _FILE)
    try:
        text = decode(file.read_bytes()) if file.is_file() else ""
    except OSError:
        return ()
    return (read_ignore_patterns(text.split("\n"), folder),) if text.strip() else ()
