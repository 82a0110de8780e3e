"""Plans of changes, as text and as JSON: those of ``cqos repair`` and ``cqos suggest``."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

from cqos_core.formatters.json_report import versioned
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.dataclass import dataclass
from cqos_core.model.excerpt import exact
from cqos_core.model.remarks import plural

if TYPE_CHECKING:
    from cqos_core.analysis.planning.plan import PlannedChange, RepairPlan


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


def plan_as_text(plan: RepairPlan, words: PlanWords, columns: int, *, color: bool, written: bool) -> str:
    """Return a plan for people: each change with its reasons and costs, or what is in conflict."""
    colors, wrapped = paint(color=color), partial(_indented, columns)
    if plan.confirmed and not plan.changes:
        return f"{words.nothing}\n"
    lines: list[str] = []
    conflicts: list[str] = []
    for each in plan.conflicts:
        conflicts += wrapped(colors(words.rest if plan.changes else words.impossible, "title"), "")
        for part in each:
            conflicts += wrapped(f"- {clean(part)}", "  ")
    if conflicts and not plan.changes:
        return "\n".join(conflicts) + "\n"
    if not plan.confirmed:
        return f"no plan was confirmed: a check refused each of {plural(plan.tried, 'plan')}; nothing is written\n"
    at = exact({edit.place for each in plan.changes for edit in each.edits}, plan.edited.before)
    for change in plan.changes:
        lines.append(colors(clean(change.text), "title"))
        lines += wrapped(clean(_about(change)), "  ")
        lines += [f"  --> {clean(str(at[edit.place]))}" for edit in change.edits]
        for reason in change.because:
            lines += wrapped(f"because of {clean(reason)}", "  ")
        for cost in change.costs:
            lines += wrapped(clean(cost), "  ")
        lines.append("")
    lines += [*conflicts, ""] if conflicts else []
    done = "written" if written else "not written: --fix writes them, --diff prints them"
    least = words.tried if plan.cut else words.least
    least = least if plan.proven else f"the time was too short to prove that {least}"
    remarks = [
        *plan.costs,
        *plan.grown,
        *(f"brings {each.severity}[{each.code}] {each.message}" for each in plan.brought),
    ]
    for remark in (*remarks, *plan.cut):
        lines += wrapped(clean(remark), "")
    lines += [""] if remarks or plan.cut else []
    total = f"{plural(len(plan.changes), 'change')} of weight {plan.weight}, {least}; checked again; {done}"
    lines += wrapped(total, "")
    return "\n".join(lines) + "\n"


def _indented(columns: int, text: str, indent: str) -> list[str]:
    return [f"{indent}{line}" for line in wrap(text, columns - len(indent))]


def _about(change: PlannedChange) -> str:
    parts = (
        (True, f"was {change.old}"),
        (change.kind == "needs_code", "a promise that the program must keep"),
        (change.weakens, "weaker than before"),
        (change.shared, "shared by several endpoints" if len(change.members) > 1 else "stands in a shared place"),
        (True, f"weight {change.weight}"),
    )
    return "; ".join(text for holds, text in parts if holds)


def plan_as_json(plan: RepairPlan, *, written: bool) -> str:
    """Return a plan for programs."""
    at = exact({edit.place for each in plan.changes for edit in each.edits}, plan.edited.before)

    def change(each: PlannedChange) -> dict[str, Any]:
        edits = [{**asdict(edit), "place": str(at[edit.place])} for edit in each.edits]
        return {**asdict(each), "edits": edits}

    return versioned(
        {
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
    )
