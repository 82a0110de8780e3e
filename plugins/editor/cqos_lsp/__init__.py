"""The language server of C-QoS. This module only has the hook; the rest is imported when the server starts."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, hookimpl


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``lsp``."""
    register(
        CommandInfo("lsp", "Serve editors: findings, completion and fixes while you type.", "cqos_lsp.command:lsp")
    )
