"""``cqos breaking``: find pairs that break while only some participants are updated."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from cqos_core.analysis.version_breaks import find_breaks
from cqos_core.cli.console import colored, emit, say, say_problems, width
from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.exit_codes import CLEAN, FINDINGS, UNUSABLE
from cqos_core.cli.help import usual
from cqos_core.cli.input_choices import input_notes
from cqos_core.cli.input_reader import path_problems, prepare_reader
from cqos_core.cli.parameters import (
    against_option,
    color_option,
    debug_option,
    fail_on_option,
    one_format_option,
    together_option,
)
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.check_units import check_units
from cqos_core.files.revisions import NotThereError, at_same_paths
from cqos_core.files.source_files import STDIN
from cqos_core.formatters.breaking_changes import ComparedVersions, breaks_as_json, breaks_as_markdown, breaks_as_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.analysis.version_breaks import Break
    from cqos_core.cli.input_reader import InputReader
    from cqos_core.files.check_units import CheckUnit
    from cqos_core.files.path_loader import Loaded


@click.command(
    epilog="Exit codes: 0 nothing breaks; 1 a pair breaks; 2 wrong usage, or input that cannot be read; 3 internal error."
)
@usual("--against", "--fail-on", "--launch", "--option", "--format")
@click.argument("paths", nargs=-1, required=True, metavar="PATH...")
@against_option
@together_option
@one_format_option("text", "json", "markdown")
@fail_on_option("error", "warning", default="error")
@reading_options
@color_option
@debug_option
@click.pass_context
def breaking(
    ctx: click.Context,
    *,
    paths: tuple[str, ...],
    old: str,
    together: bool,
    form: str,
    fail_on: str,
    reading: ReadingOptions,
    color: str,
) -> None:
    """Find pairs that get worse while a system is updated, and the order in which to update it.

    Robots are updated one after the other, so old publishers meet new subscribers, and new publishers old ones. C-QoS
    checks each pair in every mix, and reports those that are worse than in the old version. It names the participants that
    have to be updated at once, and an order in which nothing breaks. A pair that certainly breaks is an error, one of which
    that is not known a warning.

    \b
    Examples:
      cqos breaking designs --against .git#ref=main
      cqos breaking new.yaml --against old.yaml --format markdown
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if STDIN in (*paths, old):
        raise WrongUsageError("`-` has no older version to compare with", "write the paths of files or folders", ctx)
    reader = prepare_reader(reading, paths)
    with Progress("reading") as progress:
        loaded = reader.load(paths, progress.step)
        before = _old(reader, at_same_paths(old, paths), color)
        if not _usable(loaded, color, paths) or (before is not None and not _usable(before, color, paths)):
            ctx.exit(UNUSABLE)
        progress.start("comparing")
        compared = list(_compare(reader, loaded, before, color, together=together)) if before is not None else []
    if form == "json":
        emit(breaks_as_json(compared, old))
    elif form == "markdown":
        emit("\n".join(breaks_as_markdown(compared, old)) + "\n")
    else:
        emit("\n".join(breaks_as_text(compared, old, width(), color=colored(color, sys.stdout))) + "\n")
    ctx.exit(FINDINGS if any(_fails(each, fail_on) for one in compared for each in one.found.breaks) else CLEAN)


def _fails(each: Break, fail_on: str) -> bool:
    return each.counts or (fail_on == "warning" and each.finding.accepted is None)


def _old(reader: InputReader, paths: Sequence[str], color: str) -> Loaded | None:
    try:
        return reader.load(paths)
    except NotThereError as error:
        say(f"{error}, so nothing can break", severity="note", choice=color)
        return None


def _usable(loaded: Loaded, color: str, paths: Sequence[str]) -> bool:
    problems = [*loaded.problems, *path_problems(loaded, paths)]
    say_problems(problems, color)
    for note in input_notes(loaded, paths):
        say(note, severity="note", choice=color)
    return not problems


def _compare(
    reader: InputReader, new: Loaded, old: Loaded, color: str, *, together: bool
) -> Iterator[ComparedVersions]:
    """Yield the comparison of each system that both versions have. Single systems are compared whatever their names are."""
    now, before = (check_units(each, "together" if together else "")[0] for each in (new, old))
    known = {_name(unit): unit for unit in before}
    for unit in now:
        was = before[0] if len(now) == len(before) == 1 else known.pop(_name(unit), None)
        if was is None:
            say(f"{unit.path} is new", severity="note", choice=color)
            continue
        here = reader.nearest(unit.path)
        yield ComparedVersions(
            unit.path, find_breaks(here.merged(was.systems), here.merged(unit.systems), here.context)
        )
    if len(now) != 1 or len(before) != 1:
        for name in known:
            say(f"{name} is there no longer", severity="note", choice=color)


def _name(unit: CheckUnit) -> str:
    """Return the path of a system below the folder in which it was found."""
    path = unit.path.rpartition(":")[2]
    folder = unit.folder.rpartition(":")[2]
    return os.path.relpath(path, folder) if folder else os.path.normpath(path)
