"""Finds the files that paths name, also below folders."""

from __future__ import annotations

import os
from dataclasses import field
from typing import TYPE_CHECKING

from cqos_core.files.ignore_patterns import IgnoreRules
from cqos_core.files.source_files import STDIN
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import Problem
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.files.ignore_patterns import IgnorePatterns
    from cqos_core.plugins import Plugins


@dataclass(frozen=True, slots=True)
class File:
    """One file to read.

    Attributes:
        folder: the named folder in which it was found; None if its own path was given.
    """

    path: str
    folder: str | None = None

    @property
    def named(self) -> bool:
        """Whether its path was given, rather than found in a folder."""
        return self.folder is None


@dataclass(slots=True)
class FoundFiles:
    """The files that paths name.

    Attributes:
        files: in order, each once.
        skipped: files of other formats in folders.
        not_searched: folders that were skipped: generated, excluded, behind a link that leads elsewhere, or too deep.
        problems: folders that cannot be searched.
    """

    files: list[File] = field(default_factory=list)
    skipped: list[File] = field(default_factory=list)
    not_searched: list[str] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)


def find_files(
    paths: Iterable[str], plugins: Plugins, importer: str | None = None, excluded: Sequence[IgnorePatterns] = ()
) -> FoundFiles:
    """List the files that ``paths`` name, and those below folders whose endings importers name.

    The search skips hidden files, generated folders, and what ``excluded`` or a ``.gitignore`` excludes.
    ``importer`` limits the search to its own endings.
    """
    searched = [plugins.importers[importer]] if importer in plugins.importers else plugins.importers.values()
    suffixes = tuple(suffix for info in searched for suffix in info.suffixes)
    found = FoundFiles()
    files: dict[str, File] = {}
    for path in paths:
        if os.path.isdir(path):  # noqa: PTH112 - Path.is_dir raises where a path is too long
            for each in _files_below(path, suffixes, found, IgnoreRules(path, excluded)):
                files.setdefault(os.path.realpath(each), File(each, path))
        else:
            # The same file named twice is read once; named beats found.
            identity = path if path == STDIN else os.path.realpath(path)
            known = files.get(identity)
            if known is None or not known.named:
                files[identity] = File(path)
    found.files = list(files.values())
    return found


def _files_below(root: str, suffixes: tuple[str, ...], found: FoundFiles, ignored: IgnoreRules) -> Iterator[str]:
    from cqos_core.files.folder_walk import SkippedFolder, walk  # single files need none

    skipped: list[SkippedFolder] = []
    for inner, folders, names in walk(root, skipped):
        ignored.enter(inner)
        kept = [name for name in sorted(folders) if not ignored(inner, name, is_folder=True)]
        found.not_searched += [os.path.join(inner, n) for n in sorted(folders) if n not in kept and n[0] != "."]  # noqa: PTH118
        folders[:] = kept
        for name in sorted(names):
            path = os.path.join(inner, name)  # noqa: PTH118 - a path is shown as the caller began it
            if ignored(inner, name, is_folder=False):
                continue
            # Only regular files: opening a pipe waits for a writer.
            if name.lower().endswith(suffixes) and os.path.isfile(path):  # noqa: PTH113
                yield path
            else:
                found.skipped.append(File(path, root))
    found.not_searched += [each.shown for each in skipped if not each.refused]
    found.problems += [
        Problem("CQ001", f"the folder cannot be searched: {each.cause}", Place(each.path))
        for each in skipped
        if each.refused
    ]
