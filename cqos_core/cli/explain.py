"""``cqos explain``: explain the verdict of one pair, and what to change."""

from __future__ import annotations

import os
import sys
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING

import click

from cqos_core.analysis.explanation import endpoints_of, explain_pair
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.cli.console import colored, emit, say, width
from cqos_core.cli.errors import WrongUsageError, say_error
from cqos_core.cli.exit_codes import CLEAN, FINDINGS, UNUSABLE
from cqos_core.cli.help import usual
from cqos_core.cli.input_reader import prepare_reader
from cqos_core.cli.parameters import color_option, debug_option, form_option, log_option, show_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.source_files import STDIN
from cqos_core.formatters.pair import SECTIONS, endpoints_as_json, endpoints_as_text, pair_as_json, pair_as_text
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.finding import Severity
from cqos_core.model.report import Group, Report
from cqos_core.model.style import Style
from cqos_core.resolving.pair_names import pair_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.report import PairReport
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved

_SCREEN = 24  # endpoints that are listed below an error


@click.command(
    epilog="Exit codes are those of `cqos check`, for this pair: 0 clean, 1 an error found, 2 wrong usage or input that "
    "cannot be read, 3 internal error."
)
@usual("--show", "--log", "--chains", "--budgets", "--launch", "--option", "--format")
@click.argument("arguments", nargs=-1, metavar="PATH... [PUBLISHER SUBSCRIBER]")
@log_option
@show_option(*SECTIONS, "all")
@click.option("--chains", is_flag=True, help="Show how old data is at each step of the chains of the system.")
@click.option("--budgets", is_flag=True, help="Show how much goes over links, and how much histories keep.")
@reading_options
@form_option
@color_option
@debug_option
@click.pass_context
def explain(
    ctx: click.Context,
    *,
    arguments: tuple[str, ...],
    log: str | None,
    show: tuple[str, ...],
    chains: bool,
    budgets: bool,
    reading: ReadingOptions,
    form: str,
    color: str,
) -> None:
    """Explain one publisher and one subscriber: whether they fit, why, and what to write.

    The last two arguments are the ids of the endpoints. All arguments before them are paths, which are one system. In
    place of an id, the name of a participant is enough if only one pair remains. Without ids, C-QoS lists the endpoints
    topic by topic.

    --show prints all policies, what the subscriber gets under each fault, or all findings with their reasons, instead of the short
    answer.

    With --log, C-QoS explains the lines of a log, with paths by the pairs of that system. The exit code is 1 if there is any
    such line.

    \b
    Examples:
      cqos explain system.yaml                               which endpoints are there?
      cqos explain system.yaml lidar/publisher/scan nav/subscriber/scan
      cqos explain model.bpmn Drone_ThrowReq Station_CatchReq --option ros2.rmw=zenoh
      cqos explain system.yaml --log node.log                what do the programs complain of?
      cqos explain system.yaml --chains --budgets            how old is data, and how much is it?
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if show and (log is not None or chains or budgets):
        what = "--show is about a pair, and goes with neither --log, --chains nor --budgets"
        raise WrongUsageError(what, "leave --show out", ctx)
    if log is not None:
        from cqos_core.cli.explain_log import explain_log

        explain_log(ctx, log=log, paths=arguments, reading=reading, form=form, color=color)
    if not arguments:
        raise WrongUsageError("PATH... is missing", ctx=ctx)
    paths, ids = (arguments, ()) if chains or budgets else _split(arguments)
    reader = prepare_reader(reading, paths)
    system, loaded = reader.read_system(paths, color, partly=True)
    system = with_profiles_tried(system, reader.protocol)
    if chains or budgets:
        from cqos_core.formatters.time_and_budgets import explain_time

        pipeline = Pipeline(system, reader.context)
        emit(explain_time(pipeline, form, width(), chains=chains, budgets=budgets))
        ctx.exit(UNUSABLE if loaded.problems else CLEAN)
    with Progress("resolving"):
        endpoints = endpoints_of(system, reader.context)
    listed = partial(endpoints_as_text, columns=width(), color=colored(color, sys.stdout))
    if not ids:
        emit(endpoints_as_json(endpoints) if form == "json" else listed(endpoints))
        ctx.exit(UNUSABLE if loaded.problems else CLEAN)
    ends = ends_of(ids, endpoints)
    if ends is None:
        near = _near(ids, endpoints)
        if near or not endpoints:
            say(listed(near).rstrip(), choice=color, lines=True)
        if len(near) < len(endpoints):
            say(f"`cqos explain {' '.join(paths)}` lists all {len(endpoints)} endpoints", choice=color)
        ctx.exit(UNUSABLE)
    with Progress("explaining"):
        pair = explain_pair(system, ends[0].id, ends[1].id, reader.context)
    style, report = _style(system, color, reader.options.importer), _report(pair, *ends)
    emit(pair_as_json(pair, report, ends, style) if form == "json" else pair_as_text(pair, report, ends, style, show))
    ctx.exit(UNUSABLE if loaded.problems else FINDINGS if report.fails() else CLEAN)


def _style(system: System, color: str, importer: str | None) -> Style:
    from cqos_core.files.edited_files import replacements_of

    return Style(
        show=Severity.NOTE,
        color=colored(color, sys.stdout),
        width=width(),
        sources=system.sources,
        tool_version=version("cqos-core"),
        replaced=lambda edits: replacements_of(system.sources, edits, importer),
    )


def _split(arguments: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Split arguments into paths and two ids. Without ids, all arguments are paths."""
    if len(arguments) == 1 or all(each == STDIN or os.path.exists(each) for each in arguments):  # noqa: PTH110
        return arguments, ()
    if len(arguments) == 2:  # noqa: PLR2004 - a path and half of the ids
        what = f"`{arguments[1]}` is no path, and two ids are needed: a publisher's and a subscriber's"
        raise WrongUsageError(what, f"`cqos explain {arguments[0]}` lists them")
    return arguments[:-2], arguments[-2:]


def ends_of(ids: Sequence[str], endpoints: Sequence[Resolved]) -> tuple[Resolved, Resolved] | None:
    """Return publisher and subscriber, in whichever order they are named; print errors and return None if one is not found."""
    found = pair_named(ids, endpoints)
    for error in found if isinstance(found, list) else ():
        say_error(error.what, error.help)
    return None if isinstance(found, list) else found


def _near(ids: Sequence[str], endpoints: Sequence[Resolved]) -> Sequence[Resolved]:
    """Return the endpoints to list below an error: all, or if they fill more than a screen, those on topics with a similar id."""
    if len(endpoints) <= _SCREEN:
        return endpoints
    from difflib import get_close_matches

    known = [endpoint.id for endpoint in endpoints]
    meant = {near for name in ids for near in get_close_matches(name, known, 1)}
    topics = {endpoint.shown for endpoint in endpoints if endpoint.id in meant}
    return [endpoint for endpoint in endpoints if endpoint.shown in topics][:_SCREEN]


def _report(pair: PairReport, publisher: Resolved, subscriber: Resolved) -> Report:
    """Return a report of the pair alone."""
    group = Group(publisher.shown, (publisher.id,), (subscriber.id,), pair.verdict, publisher.pack.id)
    return Report(pair.verdict, (group,), pair.findings, endpoints=2, topics=1, assumed=pair.assumed)
