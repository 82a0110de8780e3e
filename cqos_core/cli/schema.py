"""``cqos schema``: print the JSON schema of system files."""

from __future__ import annotations

import json

import click

from cqos_core.cli.console import emit
from cqos_core.cli.parameters import debug_option


@click.command(epilog="Exit codes: 0 printed; 2 wrong usage; 3 internal error.")
@debug_option
def schema() -> None:
    """Print the JSON schema of the YAML system file.

    Editors use it to complete keys, settings, values and presets of the installed rule packs, and to mark mistakes while you type.

    \b
    Example:
      cqos schema > cqos.schema.json
      # then, as the first line of system.yaml:
      # yaml-language-server: $schema=cqos.schema.json
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_core.files.schema import system_schema
    from cqos_core.plugins import load_plugins

    plugins = load_plugins()
    packs = [pack for pack_id in sorted(plugins.packs) if (pack := plugins.pack(pack_id)) is not None]
    emit(json.dumps(system_schema(packs), indent=2, ensure_ascii=False) + "\n")
