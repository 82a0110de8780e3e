"""``cqos diff``: list the differences of two systems."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from cqos_core.analysis.differences import compare
from cqos_core.cli.console import colored, emit, width
from cqos_core.cli.errors import WrongUsageError, say_error
from cqos_core.cli.exit_codes import CLEAN, FINDINGS, UNUSABLE
from cqos_core.cli.help import usual
from cqos_core.cli.input_reader import is_usable, prepare_reader
from cqos_core.cli.parameters import against_option, color_option, debug_option, fail_on_option, form_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.revisions import at_same_paths
from cqos_core.files.source_files import STDIN
from cqos_core.formatters.differences import diff_as_json, diff_as_text

if TYPE_CHECKING:
    from cqos_core.model.system_diff import Diff


@click.command(
    epilog="Exit codes: 0 no difference that counts; 1 differences; 2 wrong usage, input that cannot be read, or no endpoint "
    "in one of the two; 3 internal error."
)
@usual("--against", "--topic", "--exclude-topic", "--fail-on", "--launch", "--option", "--format")
@click.argument("paths", nargs=-1, required=True, metavar="PATH...")
@against_option
@click.option("--topic", "topics", metavar="PATTERN", multiple=True, help="Compare these topics only. Can be repeated.")
@click.option(
    "--exclude-topic", "ignored", metavar="PATTERN", multiple=True, help="Leave these topics out. Can be repeated."
)
@form_option
@fail_on_option("any", "values", "endpoints", "never", default="any")
@reading_options
@color_option
@debug_option
@click.pass_context
def diff(
    ctx: click.Context,
    *,
    paths: tuple[str, ...],
    old: str,
    topics: tuple[str, ...],
    ignored: tuple[str, ...],
    form: str,
    fail_on: str,
    reading: ReadingOptions,
    color: str,
) -> None:
    """List the differences of two systems on the same topics and endpoints.

    The paths are one system, and what they are compared with is another: two versions of a design, a snapshot or a recording
    and a design. In the output, A is what --against names, and B the paths. PATH#ref=NAME is a path in a git revision. C-QoS
    compares only what both can know. For an observed system, values that discovery does not report are no differences, nor
    are topics outside of the snapshot. Kinds of differences are those in values, and endpoints that only one of the two has.

    \b
    Examples:
      cqos diff snapshot.txt --against design.yaml
      cqos diff new.yaml --against old.yaml --format json
      cqos diff design.yaml --against .git#ref=main
      cqos diff bag/ --against design.yaml --exclude-topic '/rosout' --fail-on values
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    path_a, path_b = old, " ".join(paths)
    if STDIN in paths and old == STDIN:
        raise WrongUsageError("both systems are standard input", "write the path of one of them", ctx)
    reader = prepare_reader(reading, (old, *paths))
    with Progress("reading"):
        loaded = [reader.load(each) for each in (at_same_paths(old, paths), paths)]
        named = (old, *paths)
        pairs = zip(loaded, (path_a, path_b), strict=True)
        if not all([is_usable(each, color, path, named=named) for each, path in pairs]):  # noqa: C419 - say all
            ctx.exit(UNUSABLE)
        one, other = (reader.merged([system for _, system in each.systems]) for each in loaded)
        found = compare(one, other, reader.context, topics, ignored)
    empty = [path for path, system in ((path_a, one), (path_b, other)) if not system.endpoints]
    for path in empty:
        say_error(f"{path}: there is no endpoint in it, so nothing was compared", choice=color)
    sources = {**one.sources, **other.sources}
    if form == "json":
        emit(diff_as_json(found, path_a, path_b, sources))
    elif not empty:
        emit(diff_as_text(found, path_a, path_b, sources, width(), color=colored(color, sys.stdout)))
    ctx.exit(UNUSABLE if empty else FINDINGS if _counts(found, fail_on) else CLEAN)


def _counts(found: Diff, fail_on: str) -> bool:
    values, endpoints = bool(found.different), bool(found.missing)
    return {"any": values or endpoints, "values": values, "endpoints": endpoints, "never": False}[fail_on]
