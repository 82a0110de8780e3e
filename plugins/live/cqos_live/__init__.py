"""Middleware that runs: `cqos prove` runs pairs on it, `cqos snapshot` writes what it does. Here are only the hooks.

`prove` has the command and what a run says of a verdict. `dds` and `mqtt` have what runs pairs and what looks into running systems. A
rule pack names what runs its pairs in its field `provers`.
"""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, hookimpl


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``prove`` and the commands of ``snapshot``."""
    proving = "Run pairs on real middleware, before the fix and after it."
    register(CommandInfo("prove", proving, "cqos_live.prove.command:prove", after="explain"))
    register(CommandInfo("snapshot dds", "Write what runs in a DDS domain.", "cqos_live.dds.snapshot.command:dds"))
    register(CommandInfo("snapshot mqtt", "Write what a broker of MQTT knows.", "cqos_live.mqtt.snapshot.command:mqtt"))
