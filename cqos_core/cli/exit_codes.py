"""Exit codes of the commands, and why nothing was checked."""

from __future__ import annotations

from typing import Final

CLEAN: Final = 0
"""There is nothing to report."""
FINDINGS: Final = 1
"""Findings, or what else a command looks for."""
UNUSABLE: Final = 2
"""The input cannot be read, or the command was used wrongly."""
INTERNAL: Final = 3
"""An internal error."""
INTERRUPTED: Final = 130
"""Ctrl-C, as shells report it."""
BROKEN_PIPE: Final = 141
"""Nobody reads the output any more, as shells report it."""

NO_ENDPOINT: Final = "there is no endpoint in it, so nothing was checked"
"""What a command says of one input."""
NO_PAIR: Final = "no pair was compared: no publisher matches a subscriber in what was read"
"""What a command says of all inputs."""
