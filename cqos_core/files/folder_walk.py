"""Walks through folders of any depth, and records skipped folders with the cause."""

from __future__ import annotations

import errno
import os
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

_NO_PATH: Final = frozenset((errno.ENAMETOOLONG, errno.ELOOP))
_LONGEST_SHOWN: Final = 120


class SkippedFolder(NamedTuple):
    """A folder that a walk skipped.

    Attributes:
        cause: in words that may follow the path.
        refused: it cannot be read; else it is a link, or its path is too long for the system.
    """

    path: str
    cause: str
    refused: bool = False

    @property
    def shown(self) -> str:
        """The path with its cause."""
        return f"{shortened(self.path)} ({self.cause})"


def shortened(path: str) -> str:
    """Return a path as messages show it; a long one loses its middle."""
    half = _LONGEST_SHOWN // 2
    return path if len(path) <= _LONGEST_SHOWN else f"{path[:half]}…{path[-half:]}"


def walk(root: str, skipped: list[SkippedFolder]) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield each folder below ``root``, itself first, with the names of folders and of other files in it.

    The caller may take folders out of the list, and sort it. Links to folders are not followed.

    Args:
        root: where to begin.
        skipped: gets the folders that cannot be read, and links that lead out of ``root``.
    """
    inside = os.path.realpath(root)
    waiting = [root]
    while waiting:
        folder = waiting.pop()
        folders: list[str] = []
        names: list[str] = []
        links: set[str] = set()
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    if not _is_folder(entry):
                        names.append(entry.name)
                        continue
                    folders.append(entry.name)
                    if entry.is_symlink():
                        links.add(entry.name)
        except OSError as error:
            skipped.append(SkippedFolder(folder, error.strerror or str(error), error.errno not in _NO_PATH))
            continue
        yield folder, folders, names
        for name in reversed(folders):
            path = os.path.join(folder, name)  # noqa: PTH118 - a path is shown as the caller began it
            if name not in links:
                waiting.append(path)
            elif not _leads_into(inside, path):
                skipped.append(SkippedFolder(path, f"a link to {os.path.realpath(path)}"))


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # a link that leads to itself
        return False


def _leads_into(folder: str, path: str) -> bool:
    """Whether a path leads to a folder or into it, so that the walk finds its files without the link."""
    real = os.path.realpath(path)
    return real == folder or real.startswith(folder.rstrip(os.sep) + os.sep)
