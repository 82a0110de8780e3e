"""A progress bar for whoever waits at a terminal longer than a second."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from typing import TYPE_CHECKING, Final

from cqos_core.cli.streams import is_terminal, width

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

_PATIENCE: Final = 1.0
_PERIOD: Final = 0.1
_BAR: Final = 24


class Progress:
    """Draws how far the work is on standard error, from a thread of its own, and wipes it away at the end.

    Nothing is drawn where standard error is no terminal, or before a second has passed.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        """Draw nothing at all if ``quiet``."""
        self._wanted = not quiet and is_terminal(sys.stderr) and os.environ.get("TERM") != "dumb"
        self._label = ""
        self._done = 0
        self._all = 0
        self._drawn = 0
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        if self._wanted:
            self._thread = threading.Thread(target=self._run, daemon=True)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            self._draw("")

    def start(self, label: str) -> None:
        """Begin another kind of work: ``reading``, ``checking``."""
        self._label, self._done, self._all = label, 0, 0

    def step(self, done: int, of: int) -> None:
        """Say how much of the work is done."""
        self._done, self._all = done, of

    def _run(self) -> None:
        started = time.monotonic()
        if self._over.wait(_PATIENCE):
            return
        while True:
            self._draw(self._line(time.monotonic() - started))
            if self._over.wait(_PERIOD):
                return

    def _line(self, seconds: float) -> str:
        done, of = self._done, self._all
        if of > 1:
            filled = _BAR * done // of
            return f"{self._label} [{'#' * filled}{'.' * (_BAR - filled)}] {done}/{of}"
        return f"{self._label} … {seconds:.0f} s"

    def _draw(self, line: str) -> None:
        line = line[: width() - 1]
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.write(f"\r{line}{' ' * (self._drawn - len(line))}" + ("" if line else "\r"))
            sys.stderr.flush()
        self._drawn = len(line)
