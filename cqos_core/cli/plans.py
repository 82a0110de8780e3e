"""What ``cqos repair`` and ``cqos suggest`` have in common: a plan of changes is made, printed, or written to files."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import click

from cqos_core.cli.progress import Progress
from cqos_core.cli.reading import UNUSABLE, ReadingOptions, prepare, usable
from cqos_core.cli.streams import colored, emit, say, width, write_bytes
from cqos_core.files.opening import STDIN
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.dataclass import dataclass
from cqos_core.model.excerpt import exact
from cqos_core.model.remarks import plural
from cqos_core.model.report import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.analysis.planning.plan import PlannedChange, RepairPlan
    from cqos_core.cli.reading import InputReader
    from cqos_core.model.system import System

_DONE, _OPEN = 0, 1
_VERSION: Final = 1


@dataclass(frozen=True, slots=True)
class PlanRun:
    """What the command line says of a plan, beside what the plan is for."""

    paths: tuple[str, ...]
    reading: ReadingOptions
    form: str
    color: str
    fix: bool
    show_diff: bool


@dataclass(frozen=True, slots=True)
class PlanWords:
    """What a command says.

    Attributes:
        nothing: where nothing has to change.
        impossible, rest: of a conflict, where nothing can be reached, and where all else is.
        least: of a plan that is proven; `tried`: that only among some values.
    """

    nothing: str
    impossible: str
    rest: str
    least: str
    tried: str


def carry_out(
    ctx: click.Context,
    run: PlanRun,
    make: Callable[[System, Callable[[Mapping[str, bytes]], System], InputReader], RepairPlan],
    words: PlanWords,
) -> int:
    """Read the paths as one system, make the plan, and print or write it; return the exit code.

    Args:
        ctx: of the command.
        run: what the command line says.
        make: makes the plan of a system, which it may read again with other texts.
        words: of the command.
    """
    if STDIN in run.paths:
        raise click.UsageError("a plan changes files, and `-` is none.", ctx)
    reader = prepare(run.reading, run.paths)
    with Progress("reading") as progress:
        loaded = reader.load(run.paths, progress.step)
    if not usable(loaded, run.color):
        return UNUSABLE
    files = [path for path, _ in loaded.systems]
    system = reader.whole([each for _, each in loaded.systems])
    with Progress("solving"):
        plan = make(system, lambda texts: reader.again(files, texts), reader)
    if not plan.before.endpoints:
        text = "none of its endpoints could be checked, see the findings of `cqos check`"
        say(text if system.endpoints else "there is no endpoint in it", severity="error", choice=run.color)
        return UNUSABLE
    if run.fix and plan.confirmed:
        for name, data in plan.edited.texts.items():
            write_bytes(name, data)
    if run.show_diff:
        emit(plan.edited.diff())
    elif run.form == "json":
        emit(_as_json(plan, written=run.fix and plan.confirmed))
    else:
        emit(_as_text(plan, run, words))
    for finding in plan.left if plan.confirmed else ():
        say(f"{finding.code} stays: {finding.message}", severity="note", choice=run.color)
    unknown = sum(group.pairs for group in plan.after.groups if group.verdict is Verdict.UNKNOWN)
    if unknown:
        say(
            f"{plural(unknown, 'pair')} unknown, which stay as they are without --decide",
            severity="note",
            choice=run.color,
        )
    reached = plan.confirmed and not plan.left and not plan.conflicts
    return _DONE if reached and (run.fix or not plan.changes) else _OPEN


def _as_text(plan: RepairPlan, run: PlanRun, words: PlanWords) -> str:
    colors = paint(color=colored(run.color, sys.stdout))
    if plan.confirmed and not plan.changes:
        return f"{words.nothing}\n"
    lines: list[str] = []
    conflicts: list[str] = []
    for each in plan.conflicts:
        conflicts += _wrapped(colors(words.rest if plan.changes else words.impossible, "title"), "")
        for part in each:
            conflicts += _wrapped(f"- {clean(part)}", "  ")
    if conflicts and not plan.changes:
        return "\n".join(conflicts) + "\n"
    if not plan.confirmed:
        return f"no plan was confirmed: a check refused each of {plural(plan.tried, 'plan')}; nothing is written\n"
    at = exact({edit.place for each in plan.changes for edit in each.edits}, plan.edited.before)
    for change in plan.changes:
        lines.append(colors(clean(change.text), "title"))
        lines += _wrapped(clean(_about(change)), "  ")
        lines += [f"  --> {clean(str(at[edit.place]))}" for edit in change.edits]
        for reason in change.because:
            lines += _wrapped(f"because of {clean(reason)}", "  ")
        for cost in change.costs:
            lines += _wrapped(clean(cost), "  ")
        lines.append("")
    lines += [*conflicts, ""] if conflicts else []
    done = "written" if run.fix else "not written: --fix writes them, --diff prints them"
    least = words.tried if plan.cut else words.least
    least = least if plan.proven else f"the time was too short to prove that {least}"
    remarks = [
        *plan.costs,
        *plan.grown,
        *(f"brings {each.severity}[{each.code}] {each.message}" for each in plan.brought),
    ]
    for remark in (*remarks, *plan.cut):
        lines += _wrapped(clean(remark), "")
    lines += [""] if remarks or plan.cut else []
    total = f"{plural(len(plan.changes), 'change')} of weight {plan.weight}, {least}; checked again; {done}"
    lines += _wrapped(total, "")
    return "\n".join(lines) + "\n"


def _wrapped(text: str, indent: str) -> list[str]:
    return [f"{indent}{line}" for line in wrap(text, width() - len(indent))]


def _about(change: PlannedChange) -> str:
    parts = [f"was {change.old}"]
    if change.kind == "needs_code":
        parts.append("a promise that the program must keep")
    if change.weakens:
        parts.append("weaker than before")
    if change.shared:
        parts.append("shared by several endpoints" if len(change.members) > 1 else "stands in a shared place")
    return "; ".join([*parts, f"weight {change.weight}"])


def _as_json(plan: RepairPlan, *, written: bool) -> str:
    at = exact({edit.place for each in plan.changes for edit in each.edits}, plan.edited.before)

    def change(each: PlannedChange) -> dict[str, Any]:
        edits = [{**asdict(edit), "place": str(at[edit.place])} for edit in each.edits]
        return {**asdict(each), "edits": edits}

    document = {
        "version": _VERSION,
        "confirmed": plan.confirmed,
        "proven": plan.proven,
        "weight": plan.weight,
        "written": written,
        "changes": [change(each) for each in plan.changes],
        "conflict": list(plan.conflict),
        "conflicts": [list(each) for each in plan.conflicts],
        "costs": list(plan.costs),
        "grown": list(plan.grown),
        "cut": list(plan.cut),
        "brought": [{"code": each.code, "message": each.message} for each in plan.brought],
        "left": [{"code": each.code, "message": each.message} for each in plan.left] if plan.confirmed else [],
    }
    return json.dumps(document, indent=2) + "\n"
