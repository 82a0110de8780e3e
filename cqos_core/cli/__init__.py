"""The command ``cqos``."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 130
"""The exit code after Ctrl-C, as shells have it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with ``arguments``, those of the process by default; return its exit code.

    0 is clean, 1 means findings at or above the fail level, 2 that something could not be read or was asked for
    wrongly, 3 an internal error.
    """
    try:
        # Imported here, so that Ctrl-C while Python still imports ends as quietly as later.
        from cqos_core.cli.app import run

        return run(arguments)
    except KeyboardInterrupt:
        return INTERRUPTED
