"""The DDS rule pack of C-QoS. Here are only the hooks; everything else is imported when a check needs it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.plugins import CommandInfo, RulePackInfo, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """Register ``dds``."""
    summary = "every QoS policy of DDS 1.4 and DDS-XTypes 1.3, as the standard and as implementations judge them"
    register(RulePackInfo("dds", summary, "cqos_dds.pack:PACK"))


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``cqos snapshot``."""
    register(CommandInfo("snapshot", "Write what runs as a system file.", "cqos_dds.snapshot.command:snapshot"))
