"""The command ``cqos``."""

from __future__ import annotations

import gc
from collections.abc import Sequence

_NEW_OBJECTS = 50_000
"""How many new objects the collector waits for. Modules alone are more than its usual 700, and hold no garbage."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with ``arguments``, those of the process by default; return its exit code.

    0 is clean, 1 means findings at or above the fail level, 2 that something could not be read or was asked for
    wrongly, 3 an internal error.
    """
    from cqos_core.cli.exit_codes import (
        INTERRUPTED,  # pytest imports this package for its plugin, and needs no more of it
    )

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
