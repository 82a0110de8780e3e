"""The command ``cqos``."""

from __future__ import annotations

import gc
from collections.abc import Sequence

CLEAN, FINDINGS, UNUSABLE, INTERRUPTED = 0, 1, 2, 130
"""Exit codes: nothing to say; findings, or what else a command looks for; input that cannot be read; Ctrl-C, as shells have it."""
NO_ENDPOINT = "there is no endpoint in it, so nothing was checked"
NO_PAIR = "no pair was compared: no publisher matches a subscriber in what was read"
"""What commands say that check, of one input and of all."""
_NEW_OBJECTS = 50_000
"""How many new objects the collector waits for. Modules alone are more than its usual 700, and hold no garbage."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with ``arguments``, those of the process by default; return its exit code.

    0 is clean, 1 means findings at or above the fail level, 2 that something could not be read or was asked for
    wrongly, 3 an internal error.
    """
    whole_process = arguments is None
    if whole_process:
        gc.set_threshold(_NEW_OBJECTS)
    try:
        # Imported here, so that Ctrl-C while Python still imports ends as quietly as later.
        from cqos_core.cli.app import run

        return run(arguments)
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        if whole_process:
            # The end of the process frees everything: without this, Python looks at each object first (30 ms).
            gc.freeze()
