"""What ``cqos repair`` and ``cqos suggest`` have in common: a plan of changes is made, printed, or written to files."""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from cqos_core.cli.console import colored, emit, say, width
from cqos_core.cli.errors import WrongUsageError, say_error
from cqos_core.cli.exit_codes import CLEAN, FINDINGS, UNUSABLE
from cqos_core.cli.file_output import replace_files
from cqos_core.cli.input_reader import prepare_reader
from cqos_core.cli.parameters import color_option, debug_option, diff_option, fix_option, form_option, show_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.source_files import STDIN
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Verdict, plural
from cqos_planning.plan_text import PlanWords, plan_as_json, plan_as_text

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.analysis.plan import RepairPlan
    from cqos_core.cli.input_reader import InputReader
    from cqos_core.model.system import System

Make: TypeAlias = "Callable[[System, Callable[[Mapping[str, bytes]], System], InputReader], RepairPlan]"
"""Makes the plan of a system, which it may read again with other texts."""


@dataclass(frozen=True, slots=True)
class PlanRun:
    """What the command line says of a plan, beside what the plan is for."""

    paths: tuple[str, ...]
    reading: ReadingOptions
    form: str
    color: str
    fix: bool
    show_diff: bool
    reasons: bool


def plan_command(words: PlanWords) -> Callable[[Callable[..., Make]], Callable[..., None]]:
    """Make a command of a function that says how a plan is made.

    The function gets the options that are its own, and the command has those of reading, writing and printing beside them.
    """

    def decorate(command: Callable[..., Make]) -> Callable[..., None]:
        @functools.wraps(command)
        @click.pass_context
        def run(
            ctx: click.Context,
            /,
            *,
            paths: tuple[str, ...],
            fix: bool,
            show_diff: bool,
            show: tuple[str, ...],
            form: str,
            reading: ReadingOptions,
            color: str,
            **own: Any,
        ) -> None:
            ctx.exit(
                _carry_out(
                    ctx, PlanRun(paths, reading, form, color, fix, show_diff, "reasons" in show), command(**own), words
                )
            )

        options = (
            click.argument("paths", nargs=-1, required=True, metavar="PATH..."),
            *(fix_option, diff_option, show_option("reasons")),
            *(form_option, reading_options, color_option, debug_option),
        )
        return functools.reduce(lambda inner, option: option(inner), reversed(options), run)

    return decorate


def _carry_out(ctx: click.Context, run: PlanRun, make: Make, words: PlanWords) -> int:
    """Read the paths as one system, make the plan, and print or write it; return the exit code."""
    if STDIN in run.paths:
        raise WrongUsageError("a plan changes files, and `-` is none", "write the path of the file", ctx)
    reader = prepare_reader(run.reading, run.paths)
    system, loaded = reader.read_system(run.paths, run.color)
    files = [path for path, _ in loaded.systems]
    with Progress("solving"):
        plan = make(system, lambda texts: reader.reread(files, texts), reader)
    if not plan.before.endpoints:
        unjudged = ("none of its endpoints could be checked", "`cqos check` says why")
        say_error(*(unjudged if system.endpoints else ("there is no endpoint in it", "")), choice=run.color)
        return UNUSABLE
    write = run.fix and not run.show_diff
    if write and plan.confirmed:
        replace_files(plan.edited.texts, plan.edited.before)
    if run.show_diff:
        emit(plan.edited.diff())
    elif run.form == "json":
        emit(plan_as_json(plan, written=write and plan.confirmed))
    else:
        color = colored(run.color, sys.stdout)
        emit(plan_as_text(plan, words, width(), color=color, written=write, reasons=run.reasons))
    for finding in plan.left if plan.confirmed else ():
        say(f"{finding.code} stays: {finding.message}", severity="note", choice=run.color)
    unknown = sum(group.pairs for group in plan.after.groups if group.verdict is Verdict.UNKNOWN)
    if unknown:
        text = f"{plural(unknown, 'pair')} unknown, which stay as they are without --decide"
        say(text, severity="note", choice=run.color)
    reached = plan.confirmed and not plan.left and not plan.conflicts
    return CLEAN if reached and (write or not plan.changes) else FINDINGS
