"""Plans of ``cqos repair`` and ``cqos suggest``, as text and JSON."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

from cqos_core.formatters.json_report import versioned
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.dataclass import dataclass
from cqos_core.model.excerpt import exact
from cqos_core.model.finding import plural

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.analysis.plan import PlannedChange, RepairPlan


@dataclass(frozen=True, slots=True)
class PlanWords:
    """The sentences of a command.

    Attributes:
        nothing: nothing has to change.
        impossible: a conflict excludes every plan.
        rest: a conflict remains, and all else is repaired.
        least: the plan is proven minimal.
        tried: the plan is proven minimal among some values.
    """

    nothing: str
    impossible: str
    rest: str
    least: str
    tried: str


def plan_as_text(
    plan: RepairPlan, words: PlanWords, columns: int, *, color: bool, written: bool, reasons: bool = False
) -> str:
    """Return a plan as text: each change in two lines, or with ``reasons`` and costs; or its conflicts."""
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
        places = [clean(str(at[edit.place])) for edit in change.edits]
        if not reasons:
            lines.append(f"  --> {'; '.join([*_few(places), clean(_in_short(change))])}")
            continue
        lines += wrapped(clean(_about(change)), "  ")
        lines += [f"  --> {place}" for place in places]
        for reason in change.because:
            lines += wrapped(f"because of {clean(reason)}", "  ")
        for cost in change.costs:
            lines += wrapped(clean(cost), "  ")
        lines.append("")
    lines += [] if reasons else [""]
    lines += [*conflicts, ""] if conflicts else []
    done = "written" if written else "not written"
    least = words.tried if plan.cut else words.least
    least = least if plan.proven else f"the time was too short to prove that {least}"
    remarks = [
        *(plan.costs if reasons else ()),
        *(plan.grown if reasons else ()),
        *(f"brings {each.severity}[{each.code}] {each.message}" for each in plan.brought),
    ]
    for remark in (*remarks, *plan.cut):
        lines += wrapped(clean(remark), "")
    lines += [""] if remarks or plan.cut else []
    total = f"{plural(len(plan.changes), 'change')} of weight {plan.weight}, {least}; checked again; {done}"
    lines += wrapped(total, "")
    more = [] if written else ["--fix writes the changes", "--diff prints them"]
    more += [] if reasons else ["--show reasons explains them"]
    lines += wrapped(f"more: {', '.join(more)}", "") if more else []
    return "\n".join(lines) + "\n"


def _few(places: Sequence[str]) -> list[str]:
    """Return the first place, and the number of further ones."""
    return [*places[:1], *([f"and {plural(len(places) - 1, 'more place')}"] if len(places) > 1 else [])]


def _in_short(change: PlannedChange) -> str:
    """Return old value, remarks and rules of a change on one line."""
    rules = list(dict.fromkeys(reason.partition(":")[0] for reason in change.because))
    because = [f"because of {', '.join(rules)}"] if rules else []
    return "; ".join([*_remarks(change), *because])


def _indented(columns: int, text: str, indent: str) -> list[str]:
    return [f"{indent}{line}" for line in wrap(text, columns - len(indent))]


def _about(change: PlannedChange) -> str:
    return "; ".join([*_remarks(change), f"weight {change.weight}"])


def _remarks(change: PlannedChange) -> list[str]:
    parts = (
        (True, f"was {change.old}"),
        (change.kind == "needs_code", "a promise that the program must keep"),
        (change.weakens, "weaker than before"),
        (change.shared, "shared by several endpoints" if len(change.members) > 1 else "stands in a shared place"),
    )
    return [text for holds, text in parts if holds]


def plan_as_json(plan: RepairPlan, *, written: bool) -> str:
    """Return a plan as JSON."""
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
