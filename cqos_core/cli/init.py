"""``cqos init``: write a commented configuration for a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from cqos_core import config
from cqos_core.cli.console import emit, say
from cqos_core.cli.file_output import write_new_file
from cqos_core.cli.parameters import debug_option
from cqos_core.cli.progress import Progress
from cqos_core.files.importer_choice import protocols_of
from cqos_core.files.path_loader import Loaded, load_paths
from cqos_core.formatters.configuration import configuration
from cqos_core.model.finding import plural
from cqos_core.model.problems import CqosError
from cqos_core.plugins import load_plugins


@click.command(
    epilog="Exit codes: 0 written; 2 wrong usage, a configuration is there already, or the file cannot be written; "
    "3 internal error."
)
@click.argument("folder", metavar="[DIR]", default=".", type=click.Path(exists=True, file_okay=False))
@debug_option
def init(folder: str) -> None:
    """Write a commented cqos.toml for what lies in a folder.

    Looks for designs in DIR (the working directory if none is given) and below it. States the protocol that they have in
    common, and lists what else a configuration may state, in comments. An existing configuration is never changed.

    \b
    Examples:
      cqos init
      cqos init robots/beta
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    target = Path(folder) / config.NAME
    there = config.find_config(folder)
    if there is not None and there.absolute().parent == target.absolute().parent:
        raise CqosError(f"{there} is there already; C-QoS does not overwrite it", f"change {there}, or remove it first")
    with Progress("reading") as progress:
        loaded = load_paths([folder], step=progress.step)
    seen = sorted(protocols_of(system for _, system in loaded.systems))
    write_new_file(str(target), configuration(_found(loaded, seen), seen, {*load_plugins().packs}))
    emit(f"{target} is written: {_found(loaded, seen)}\n")
    if loaded.problems:
        say(
            f"{plural(len(loaded.problems), 'problem')} of files that cannot be read; see `cqos check {folder}`",
            severity="warning",
        )
    if there is not None:
        say(f'{there} no longer counts here; to keep it, write `extends = ["…"]`', severity="note")


def _found(loaded: Loaded, protocols: Sequence[str]) -> str:
    wholes = sum(not system.partial for _, system in loaded.systems)
    parts = len(loaded.systems) - wholes
    counts = [plural(wholes, "whole system"), plural(parts, "file") + " with a part of one"]
    what = " and ".join(count for count, number in zip(counts, (wholes, parts), strict=True) if number)
    of = f", of {', '.join(protocols)}" if protocols else ""
    return f"{what or 'no design'} found{of}"
