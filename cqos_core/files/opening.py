"""Which files paths stand for, and their bytes."""

from __future__ import annotations

import os
import posixpath
from dataclasses import field
from typing import TYPE_CHECKING, BinaryIO, Final

from cqos_core.files.ignoring import Ignored
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place
from cqos_core.model.source import Source, no_files

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.files.ignoring import Patterns
    from cqos_core.plugins import Plugins

HEAD: Final = 65_536
STDIN: Final = "-"
"""The path that stands for standard input."""
STDIN_NAME: Final = "<stdin>"
"""The name of standard input where the caller gives none; a source of another name may include files beside it."""
_MAXIMUM_BYTES: Final = 512 * 1024 * 1024
_DRIVE: Final = regular_expression("[A-Za-z]:/")


def open_file(name: str, relative_to: str) -> Source:
    """Open the file ``name`` that ``relative_to`` includes, or list the folder that a ``name`` with a slash at its end names.

    Raises:
        InputError: as `read_path`, and where it is a pipe or a device, which might never end: people name those themselves.
    """
    from pathlib import Path

    path = str(Path(relative_to).parent / name)
    if name.endswith("/"):
        return _listed(path)
    # These of `os.path` answer False for a name that no file system takes; those of `Path` raise.
    if os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path)):  # noqa: PTH110, PTH112, PTH113
        raise InputError([Problem("CQ001", "cannot be read: it is no regular file", Place(path))])
    return read_path(path)


def _listed(folder: str) -> Source:
    try:
        names = sorted(os.listdir(folder))  # noqa: PTH208 - names that are no text stay as they are
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError([Problem("CQ001", f"cannot be read: {reason}", Place(folder))]) from None
    return Source(f"{folder}/", "\n".join(names).encode(errors="surrogateescape"))


class SentFiles:
    """Opens files among those that were sent along, by the names that they were sent under, and never from a disk."""

    def __init__(self, sources: Iterable[Source]) -> None:
        """Open no others than these; of several with one name, the first."""
        self._sources: dict[str, Source] = {}
        for source in sources:
            self._sources.setdefault(_spelled(source.name), source)
            self._sources.setdefault(posixpath.normpath(_spelled(source.name)), source)

    def __call__(self, name: str, relative_to: str) -> Source:
        """Return the file ``name`` as it is seen from the one that includes it.

        Raises:
            InputError: it was not sent along.
        """
        if relative_to.startswith("<"):  # it was sent without a name
            return no_files(name, relative_to)
        path = _spelled(name)
        if not _DRIVE.match(path):
            path = posixpath.join(posixpath.dirname(_spelled(relative_to)), path)
        found = self._sources.get(path) or self._sources.get(posixpath.normpath(path))
        if found is None:
            message = f"cannot include `{name}`: no file of this name was sent along with {relative_to}"
            raise InputError([Problem("CQ007", message, Place(relative_to))])
        return found


def _spelled(path: str) -> str:
    """One spelling of a path, of whatever system the sender has."""
    return path.replace("\\", "/")


def read_path(path: str, limit: int | None = None) -> Source:
    """Read a file, whole or its first ``limit`` bytes.

    Raises:
        InputError: it is missing, a directory, not readable, or larger than 512 MiB.
    """
    try:
        with open(path, "rb") as file:  # noqa: PTH123 - `pathlib` takes 3 ms to import
            return read_stream(path, file, limit)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError([Problem("CQ001", f"cannot be read: {reason}", Place(path))]) from None


def read_stream(name: str, stream: BinaryIO, limit: int | None = None) -> Source:
    """Read an open file, whole or its first ``limit`` bytes, as the source ``name``.

    Raises:
        InputError: it holds more than 512 MiB.
    """
    # Not the size it says it has: a pipe and a device say nothing.
    data = stream.read(_MAXIMUM_BYTES + 1 if limit is None else limit)
    if len(data) > _MAXIMUM_BYTES:
        message = f"there is more to read than {_MAXIMUM_BYTES // 1024**2} MiB"
        raise InputError([Problem("CQ002", message, Place(name))])
    return Source(name, data)


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
class Found:
    """What some paths stand for.

    Attributes:
        files: in order, each once.
        skipped: foreign files that were passed over in folders.
        not_searched: folders that were passed over: generated, excluded, behind a link that leads elsewhere, or too deep.
        problems: folders that cannot be searched.
    """

    files: list[File] = field(default_factory=list)
    skipped: list[File] = field(default_factory=list)
    not_searched: list[str] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)


def find_files(
    paths: Iterable[str], plugins: Plugins, importer: str | None = None, excluded: Sequence[Patterns] = ()
) -> Found:
    """List the files that ``paths`` name, and those below folders whose endings importers name.

    Of folders, hidden files, generated folders, and what ``excluded`` or a ``.gitignore`` excludes are passed over.
    ``importer`` limits the search to its own endings.
    """
    searched = [plugins.importers[importer]] if importer in plugins.importers else plugins.importers.values()
    suffixes = tuple(suffix for info in searched for suffix in info.suffixes)
    found = Found()
    files: dict[str, File] = {}
    for path in paths:
        if os.path.isdir(path):  # noqa: PTH112 - Path.is_dir raises where a path is too long
            for each in _files_below(path, suffixes, found, Ignored(path, excluded)):
                files.setdefault(os.path.realpath(each), File(each, path))
        else:
            # The same file named twice is read once; named beats found.
            identity = path if path == STDIN else os.path.realpath(path)
            known = files.get(identity)
            if known is None or not known.named:
                files[identity] = File(path)
    found.files = list(files.values())
    return found


def _files_below(root: str, suffixes: tuple[str, ...], found: Found, ignored: Ignored) -> Iterator[str]:
    from cqos_core.files.walking import Skipped, walk  # single files need none

    skipped: list[Skipped] = []
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
