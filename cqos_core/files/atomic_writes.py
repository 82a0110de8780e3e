"""Writes files atomically, and replaces a file only if it still holds what was read."""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from time import monotonic, sleep
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import BinaryIO

_MOST_WAITED: Final = 1.0
_BETWEEN: Final = 0.001
"""Seconds to wait for a program that opened the file just before it was replaced, and between two looks."""
_MODES: Final = stat.S_IRWXU | stat.S_IRWXG | stat.S_IRWXO
"""The permission bits that a new file takes over; no set-user-ID bit."""


class ChangedFileError(OSError):
    """Another program changed a file after it was read, so it was not written."""

    def __init__(self, path: str, how: str) -> None:
        """Take the path, and ``how`` the file changed."""
        super().__init__(errno.EBUSY, f"{how}; the file is left as it is, so run the command again", path)


def is_same_file(one: str, other: str) -> bool:
    """Whether two paths lead to one file, over links or other spellings; both may name files that are not there yet."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return os.path.samefile(one, other)  # noqa: PTH121 - any text may be a path
    except (OSError, ValueError):
        return False


def write_whole(path: str, data: bytes) -> None:
    """Write a file so that it holds all of ``data``, or what it held before.

    Raises:
        OSError: it cannot be written; nothing is left behind.
    """
    target = _target(path)
    if target.exists() and not target.is_file():
        # A pipe or a device cannot be replaced by a file.
        target.write_bytes(data)
        return
    draft = _draft(target, data)
    try:
        draft.replace(target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def write_new(path: str, data: bytes) -> None:
    """Write a file that is not there yet, whole or not at all.

    Raises:
        OSError: it is there, or it cannot be written; nothing is left behind.
    """
    target = _target(path)
    if target.exists():
        raise ChangedFileError(path, "the file is there already")
    draft = _draft(target, data)
    try:
        try:
            os.link(draft, target)  # unlike renaming, this never replaces a file
        except FileExistsError:
            raise ChangedFileError(path, "another program wrote the file at the same time") from None
        except OSError:  # a file system without hard links
            with target.open("xb") as file:
                file.write(data)
    finally:
        draft.unlink(missing_ok=True)


def replace_whole(path: str, data: bytes, before: bytes) -> None:
    """Write a file like `write_whole`, if it still holds what was read.

    The file is compared last, just before it is replaced. Lines that another program appends meanwhile go to the new file.

    Args:
        path: of the file.
        data: the new content.
        before: the content that was read.

    Raises:
        ChangedFileError: it holds something else, or another program has it open for writing; it is left as it is.
        OSError: it cannot be written; it holds what it held before.
    """
    target = _target(path)
    _refuse_changed(path, target, before)
    draft = _draft(target, data)
    try:
        with target.open("rb") as old:
            _refuse_open(path, old, before)
            draft.replace(target)
            _sync(target.parent)
            _copy_late_appends(old.fileno(), before, target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def replace_all(texts: Mapping[str, bytes], before: Mapping[str, bytes]) -> None:
    """Replace several files like `replace_whole`; none is replaced if one has changed.

    Raises:
        ChangedFileError: one of them holds something else.
        OSError: one of them cannot be written; it holds what it held before.
    """
    for name in texts:
        _refuse_changed(name, _target(name), before[name])
    for name, data in texts.items():
        try:
            replace_whole(name, data, before[name])
        except OSError as error:
            error.filename = name  # rather than that of the draft
            raise


def _target(path: str) -> Path:
    """Return the file behind links, so that a link stays a link."""
    from pathlib import Path

    return Path(os.path.realpath(path))


def _refuse_changed(path: str, target: Path, before: bytes) -> None:
    try:
        if target.read_bytes() != before:
            raise ChangedFileError(path, "another program changed the file after it was read")
    except FileNotFoundError:
        raise ChangedFileError(path, "another program removed the file after it was read") from None


def _refuse_open(path: str, file: BinaryIO, before: bytes) -> None:
    if _is_being_written(file.fileno()):
        raise ChangedFileError(path, "another program has the file open for writing")
    if file.read() != before:
        raise ChangedFileError(path, "another program changed the file after it was read")


def _draft(target: Path, data: bytes) -> Path:
    """Write a file beside the target, with its permissions and its owner."""
    if target.exists() and not os.access(target, os.W_OK):
        # The folder allows replacing the file, but the file itself is write-protected.
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    draft = target.with_name(f".{target.name[:100]}.{os.urandom(8).hex()}.tmp")
    try:
        with draft.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            known = target.stat()
            if (known.st_uid, known.st_gid) != (draft.stat().st_uid, draft.stat().st_gid):
                with suppress(PermissionError):  # only root gives files away; the one who writes may own the new one
                    os.chown(draft, known.st_uid, known.st_gid)
            draft.chmod(known.st_mode & _MODES)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    return draft


def _is_being_written(descriptor: int) -> bool:
    """Whether a program has the file open for writing, if the system tells: its next line would go to the old file."""
    try:
        import fcntl
        import signal

        fcntl.fcntl(descriptor, fcntl.F_SETSIG, signal.SIGURG)  # which does nothing, unlike the usual one
        fcntl.fcntl(descriptor, fcntl.F_SETLEASE, fcntl.F_RDLCK)
        fcntl.fcntl(descriptor, fcntl.F_SETLEASE, fcntl.F_UNLCK)
    except (ImportError, AttributeError):  # only Linux has leases
        return False
    except OSError as error:  # others are of file systems without leases, and of files of others
        return error.errno == errno.EAGAIN
    return False


def _sync(folder: Path) -> None:
    """Flush the new name to the disk, if folders can be opened."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _copy_late_appends(old: int, before: bytes, target: Path) -> None:
    """Append to the new file what a program still appends to the old one, which it opened just before the replacement."""
    end = monotonic() + _MOST_WAITED
    while _is_being_written(old) and monotonic() < end:
        sleep(_BETWEEN)
    size = os.fstat(old).st_size
    if size > len(before):
        with target.open("ab") as file:
            file.write(os.pread(old, size - len(before), len(before)))
