"""Opens files, listings of folders, and files that a client sent, as sources."""

from __future__ import annotations

import os
import posixpath
from typing import TYPE_CHECKING, BinaryIO, Final

from cqos_core.model.problems import InputError, Problem
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place
from cqos_core.model.source import Source, no_files

if TYPE_CHECKING:
    from collections.abc import Iterable


HEAD: Final = 65_536

STDIN: Final = "-"
"""The path that stands for standard input."""

STDIN_NAME: Final = "<stdin>"
"""The name of standard input if the caller gives none; a source with another name may include files."""

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
    # Functions of `os.path` return False for an impossible name; those of `Path` raise.
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
    """Opens files among those that a client sent, by their names, and never from a disk."""

    def __init__(self, sources: Iterable[Source]) -> None:
        """Take the files; of several with one name, the first counts."""
        self._sources: dict[str, Source] = {}
        for source in sources:
            self._sources.setdefault(_spelled(source.name), source)
            self._sources.setdefault(posixpath.normpath(_spelled(source.name)), source)

    def __call__(self, name: str, relative_to: str) -> Source:
        """Return the file ``name``, relative to the one that includes it.

        Raises:
            InputError: the client did not send it.
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
    """Return a path with slashes, whatever system the client has."""
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
    # Read rather than ask for the size: pipes and devices have none.
    data = stream.read(_MAXIMUM_BYTES + 1 if limit is None else limit)
    if len(data) > _MAXIMUM_BYTES:
        message = f"there is more to read than {_MAXIMUM_BYTES // 1024**2} MiB"
        raise InputError([Problem("CQ002", message, Place(name))])
    return Source(name, data)
