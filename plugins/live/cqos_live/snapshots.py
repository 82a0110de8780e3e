"""What commands share that write a running system: `cqos snapshot …` of packs."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, TypeVar

import click

from cqos_core.cli.console import emit
from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.file_output import write_file
from cqos_core.cli.outputs import check_output_paths
from cqos_core.cli.parameters import output_option, watch_option
from cqos_core.files.yaml_writer import write
from cqos_core.matching.pipeline import context
from cqos_core.packs.export import ExportContext

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.model.system import System

F = TypeVar("F", bound="Callable[..., Any]")


SECONDS = click.FloatRange(0, 3600, min_open=True)
"""How long a command looks, or waits."""


def snapshot_options(every: float) -> Callable[[F], F]:
    """Return the options `--watch`, `--every`, whose default is given, and `--output`."""
    text = "The time between two looks, with --watch."
    options = (
        watch_option,
        click.option("--every", type=SECONDS, default=every, show_default=True, metavar="SECONDS", help=text),
        output_option(),
    )
    return lambda command: functools.reduce(lambda inner, option: option(inner), reversed(options), command)


def check_snapshot(output: str | None, inputs: Iterable[str], *, watch: bool) -> None:
    """Refuse an output that cannot be written, or that a watch does not have."""
    check_output_paths("--output", [] if output is None else [output], inputs)
    if watch and output is not None:
        raise WrongUsageError(
            "--watch prints changes, so there is nothing to write with --output", "leave one of them out"
        )


def write_snapshot(system: System, head: str, output: str | None) -> None:
    """Write a system with a comment above it, to a file or to standard output."""
    where = context()
    exported = write(system, ExportContext(where.find_pack, settings={"profiles": "shared"}, find_rule=where.find_rule))
    text = f"{head}{exported.text}"
    if output is None:
        emit(text)
    else:
        write_file(output, text)
