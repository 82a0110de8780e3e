"""A progress bar on a terminal, for work of more than a second."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from typing import TYPE_CHECKING, Final

from cqos_core.cli.console import is_terminal, width

if TYPE_CHECKING:
    from typing_extensions import Self

_PATIENCE: Final = 1.0
_PERIOD: Final = 0.1
_BAR: Final = 24


class Progress:
    """Draws progress on standard error in a thread of its own, and erases it at the end.

    Nothing is drawn where standard error is no terminal, or before a second has passed.
    """

    def __init__(self, label: str = "", *, quiet: bool = False) -> None:
        """Begin with a label such as ``reading``; draw nothing if ``quiet``."""
        self._wanted = not quiet and is_terminal(sys.stderr) and os.environ.get("TERM") != "dumb"
        self._drawn = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.start(label)

    def __enter__(self) -> Self:
        if self._wanted:
            self._thread.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._over.set()
        if self._wanted:
            self._thread.join()
            self._draw("")

    def start(self, label: str) -> None:
        """Begin the next stage, with its label."""
        self._label, self._done, self._all = label, 0, 0

    def step(self, done: int, of: int) -> None:
        """Set how much of the work is done."""
        self._done, self._all = done, of

    def _run(self) -> None:
        started, pause = time.monotonic(), _PATIENCE
        while not self._over.wait(pause):
            self._draw(self._line(time.monotonic() - started))
            pause = _PERIOD

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
