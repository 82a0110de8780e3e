"""The rules of packs as columns, for tables of a whole fleet, and as SQL and JavaScript. Here are only the hooks."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, TranslatorInfo, hookimpl


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``audit``."""
    register(CommandInfo("audit", "Check the endpoints of a whole fleet, from a table.", "cqos_fleet.command:audit"))


@hookimpl
def register_translators(register: Callable[[TranslatorInfo], None]) -> None:
    """Register SQL and JavaScript."""
    where = "cqos_fleet.source_text"
    register(TranslatorInfo("sql", "queries over tables of endpoints", f"{where}:as_sql"))
    register(TranslatorInfo("javascript", "functions for a page or Node.js", f"{where}:as_javascript"))
