"""``cqos check --watch``: check again when an input changes, until Ctrl-C."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import Final, TypeAlias

import click

from cqos_core.cli.console import say
from cqos_core.cli.errors import say_cqos_error, say_usage_error
from cqos_core.cli.exit_codes import UNUSABLE
from cqos_core.files.file_search import find_files
from cqos_core.formatters.phrases import listed
from cqos_core.model.problems import CqosError
from cqos_core.plugins import load_plugins

_PAUSE: Final = 0.3  # seconds
_PART: Final = 0.1  # of the time is spent on looking, at most: large folders are looked at less often

_State = dict[str, tuple[int, int, int] | None]
Watched: TypeAlias = "tuple[int, Sequence[str]]"
"""The exit code of one check, and the files on which it depends."""


def watch(paths: Sequence[str], importer: str | None, run: Callable[[], Watched]) -> int:
    """Run at once, and again after each change of a file; return the last exit code.

    Watched files are those below ``paths``, and those that were read. A wrong input or configuration ends only the
    first run: later it may be an unfinished edit.
    """
    before = _state(paths, importer, ())
    code, read = run()
    try:
        while True:
            # Files that other files include are known only now. Any other file that was not there before the run is a new one.
            before = {**{name: _stamp(name) for name in read}, **before}
            changed = _change(paths, importer, read, before)
            say(f"{time.strftime('%H:%M:%S')} {listed(changed)} changed", head="watch:")
            before = _state(paths, importer, read)
            # A file that cannot be read does not tell which files it includes, so the former ones stay watched.
            code, read = _again(run, read)
    except KeyboardInterrupt:
        return code


def _again(run: Callable[[], Watched], files: Sequence[str]) -> Watched:
    try:
        code, now = run()
        return code, [*dict.fromkeys((*now, *files))]
    except CqosError as error:
        say_cqos_error(error)
    except click.ClickException as error:
        say_usage_error(error)
    return UNUSABLE, files


def _change(paths: Sequence[str], importer: str | None, files: Sequence[str], before: _State) -> list[str]:
    """Wait until files change; return their names."""
    while True:
        started = time.perf_counter()
        now = _state(paths, importer, files)
        changed = sorted(name for name in {**before, **now} if before.get(name) != now.get(name))
        if changed:
            return changed
        time.sleep(max(_PAUSE, (time.perf_counter() - started) / _PART))


def _state(paths: Sequence[str], importer: str | None, files: Sequence[str]) -> _State:
    """Return time, size and number of each watched file, which tell whether it was written."""
    found = find_files(paths, load_plugins(), importer).files
    return {name: _stamp(name) for name in {*(file.path for file in found), *files}}


def _stamp(path: str) -> tuple[int, int, int] | None:
    try:
        about = os.stat(path)  # noqa: PTH116 - any text may be given
    except (OSError, ValueError):
        return None
    return about.st_mtime_ns, about.st_size, about.st_ino
