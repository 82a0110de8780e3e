"""Writes files whole or not at all, and turns errors of the system into messages."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping

from cqos_core.model.problems import CqosError


def replace_files(texts: Mapping[str, bytes], before: Mapping[str, bytes]) -> None:
    """Replace the contents of files; none is replaced if one of them changed since it was read.

    Args:
        texts: the new contents by path.
        before: what was read.

    Raises:
        CqosError: a file changed, or it cannot be written; it holds what it held before.
    """
    from cqos_core.files.atomic_writes import replace_all  # few runs write files

    with _named_errors():
        replace_all(texts, before)


def write_new_file(path: str, text: str) -> None:
    """Write a file that is not there yet, so that it holds all of ``text``.

    Raises:
        CqosError: it is there, or it cannot be written; nothing is left behind.
    """
    from cqos_core.files.atomic_writes import write_new

    with _named_errors(path):
        write_new(path, text.encode("utf-8", "backslashreplace"))


def write_file(path: str, text: str) -> None:
    """Write a file so that it holds all of ``text``, or what it held before.

    Raises:
        CqosError: it cannot be written; nothing is left behind.
    """
    from cqos_core.files.atomic_writes import write_whole

    with _named_errors(path):
        write_whole(path, text.encode("utf-8", "backslashreplace"))


@contextlib.contextmanager
def _named_errors(path: str = "") -> Iterator[None]:
    """Turn errors of the system into errors that name the file; ``path`` is as the user wrote it."""
    from cqos_core.files.atomic_writes import ChangedFileError

    try:
        yield
    except ChangedFileError as error:
        raise CqosError(f"{path or error.filename} is not written: {error.strerror}") from None
    except OSError as error:
        raise CqosError(f"cannot write {path or error.filename}: {error.strerror}") from None
