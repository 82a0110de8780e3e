"""``cqos diff``: what two systems say differently."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from cqos_core.analysis.differences import compare
from cqos_core.cli import CLEAN, FINDINGS, UNUSABLE
from cqos_core.cli.parameters import color_option, debug_option, form_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading import ReadingOptions, prepare, reading_options, usable
from cqos_core.cli.streams import colored, emit, say, width
from cqos_core.files.opening import STDIN
from cqos_core.files.revisions import at_same_paths
from cqos_core.formatters.differences import diff_as_json, diff_as_text

if TYPE_CHECKING:
    from cqos_core.model.difference import Diff


@click.command(
    epilog="Exit codes: 0 no difference that counts; 1 differences; 2 wrong usage, input that cannot be read, or no endpoint "
    "in one of the two; 3 internal error."
)
@click.argument("a", metavar="A")
@click.argument("b", metavar="B", required=False)
@click.option("--against", metavar="DESIGN", help="Compare with this; it is A then, and what is named is B.")
@click.option("--topic", "topics", metavar="PATTERN", multiple=True, help="Compare these topics only. Can be repeated.")
@click.option("--ignore", "ignored", metavar="PATTERN", multiple=True, help="Leave these topics out. Can be repeated.")
@form_option
@click.option(
    "--fail-on",
    type=click.Choice(["any", "values", "endpoints", "never"]),
    default="any",
    show_default=True,
    help="Which differences make the exit code 1: any, those in values only, or endpoints that only one of them has.",
)
@reading_options
@color_option
@debug_option
@click.pass_context
def diff(
    ctx: click.Context,
    *,
    a: str,
    b: str | None,
    against: str | None,
    topics: tuple[str, ...],
    ignored: tuple[str, ...],
    form: str,
    fail_on: str,
    reading: ReadingOptions,
    color: str,
) -> None:
    """List the differences of two systems on the same topics and endpoints.

    A and B are files of any format, or folders, each as one system: two versions of a design, a design and a snapshot, a
    design and a recording. PATH#ref=NAME is a path in a git revision, and .git#ref=NAME the path of the other side in it. C-QoS compares only what both can know. For an observed system, values that discovery does not
    report are no differences, nor are topics outside of the snapshot.

    \b
    Examples:
      cqos diff design.yaml snapshot.txt
      cqos diff mosquitto.log --against design.yaml
      cqos diff old.yaml new.yaml --format json
      cqos diff .git#ref=main design.yaml
      cqos diff design.yaml bag/ --ignore '/rosout' --fail-on values
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    named = [each for each in (against, a, b) if each is not None]
    if len(named) != 2:  # noqa: PLR2004 - A and B
        raise click.UsageError("name two systems, or one and the other with --against.", ctx)
    path_a, path_b = named
    if path_a == path_b == STDIN:
        raise click.UsageError("only one of the two can be standard input.", ctx)
    reader = prepare(reading, (path_a, path_b))
    with Progress("reading"):
        loaded = [reader.load(at_same_paths(path, [other])) for path, other in ((path_a, path_b), (path_b, path_a))]
        paths = path_a, path_b
        if not all([usable(each, color, path, named=paths) for each, path in zip(loaded, paths, strict=True)]):  # noqa: C419 - say all
            ctx.exit(UNUSABLE)
        one, other = (reader.whole([system for _, system in each.systems]) for each in loaded)
        found = compare(one, other, reader.context, topics, ignored)
    empty = [path for path, system in ((path_a, one), (path_b, other)) if not system.endpoints]
    for path in empty:
        say(f"{path}: there is no endpoint in it, so nothing was compared", severity="error", choice=color)
    sources = {**one.sources, **other.sources}
    if form == "json":
        emit(diff_as_json(found, path_a, path_b, sources))
    elif not empty:
        emit(diff_as_text(found, path_a, path_b, sources, width(), color=colored(color, sys.stdout)))
    ctx.exit(UNUSABLE if empty else FINDINGS if _counts(found, fail_on) else CLEAN)


def _counts(found: Diff, fail_on: str) -> bool:
    values, endpoints = bool(found.different), bool(found.missing)
    return {"any": values or endpoints, "values": values, "endpoints": endpoints, "never": False}[fail_on]
