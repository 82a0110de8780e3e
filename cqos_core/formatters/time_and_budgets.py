"""``cqos explain --chains`` and ``--budgets``, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.behaviour.paths.budgets import budgets_of_system as budgets_of
from cqos_core.behaviour.paths.chains import chain_times
from cqos_core.behaviour.paths.time_ranges import DURATION
from cqos_core.formatters.budgets import budgets_as_json, budgets_as_text
from cqos_core.formatters.json_report import versioned
from cqos_core.formatters.tables import table
from cqos_core.formatters.terminal import clean

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.behaviour.paths.chains import ChainTimes, StepTimes
    from cqos_core.behaviour.paths.time_ranges import TimeRange
    from cqos_core.matching.pipeline import Pipeline

_WORDS: Final[Mapping[bool | None, str]] = {True: "holds", False: "does not hold", None: "is open"}
_JSON_WORDS: Final[Mapping[bool | None, str]] = {True: "yes", False: "no", None: "unknown"}
_STEPS: Final = ("step", "topic", "latency", "waits", "takes", "age after it")


def explain_time(pipeline: Pipeline, form: str, columns: int, *, chains: bool, budgets: bool) -> str:
    """Return the times of chains and the budgets of links, as text or JSON."""
    found = chain_times(pipeline) if chains else None
    spent = budgets_of(pipeline) if budgets else None
    if form == "json":
        parts: dict[str, Any] = {} if found is None else {"chains": [_chain_as_json(each) for each in found]}
        parts |= {} if spent is None else {"budgets": budgets_as_json(spent)}
        return versioned(parts)
    texts = [] if found is None else ["\n".join((*_chain_as_text(each, columns), "")) for each in found]
    if found == []:
        texts = ["there are no chains\n"]
    if spent is not None:
        texts.append("\n".join((*budgets_as_text(spent, columns), "")))
    return "\n".join(texts)


def _chain_as_text(times: ChainTimes, columns: int) -> Iterator[str]:
    yield f"chain {clean(times.chain.name)}"
    for name in times.limits or {}:
        known = "" if times.faults else f": {times.age if name == 'max_age' else _gap(times)}"
        yield f"  {name} {clean(times.chain.settings[name].text)} {_WORDS[times.holds(name)]}{known}"
    for fault in times.faults:
        yield f"  {clean(fault.message)}"
    if times.steps:
        yield ""
        yield from table(_STEPS, [_row(each) for each in times.steps], columns)
    remarks = dict.fromkeys(reason for each in times.steps for reason in (*each.missing, *each.gap_missing))
    promises = dict.fromkeys(promise for each in times.steps for promise in each.assumed)
    lines = [*(f"open: {clean(each)}" for each in remarks), *(f"assumed: {clean(each)}" for each in promises)]
    if lines:
        yield ""
        yield from lines


def _gap(times: ChainTimes) -> str:
    least = f", at least {DURATION.format(times.gap.low)}" if times.gap.low else ""
    return (f"at most {DURATION.format(times.gap.high)}" if times.gap.high is not None else "no upper bound") + least


def _row(step: StepTimes) -> tuple[str, ...]:
    topic = " over ".join((clean(step.topic), *map(clean, step.bridges)))
    if not step.topic:
        return clean(step.at), "", "", "", str(step.takes), str(step.age)
    return clean(step.at), topic, str(step.latency), str(step.waits), str(step.takes), str(step.age)


def _chain_as_json(times: ChainTimes) -> dict[str, Any]:
    return {
        "name": times.chain.name,
        "requirements": [
            {"word": name, "limit": DURATION.format(limit), "holds": _JSON_WORDS[times.holds(name)]}
            for name, limit in (times.limits or {}).items()
        ],
        "age": _bounds(times.age),
        "gap": _bounds(times.gap),
        "faults": [each.message for each in times.faults],
        "steps": [
            {
                "at": each.at,
                "topic": each.topic or None,
                "bridges": [*each.bridges],
                **{name: _bounds(getattr(each, name)) for name in ("latency", "waits", "takes", "age")},
                "missing": [*each.missing, *each.gap_missing],
                "assumed": [*each.assumed],
            }
            for each in times.steps
        ],
    }


def _bounds(known: TimeRange) -> dict[str, str | None]:
    high = None if known.high is None else DURATION.format(known.high)
    return {"at_least": DURATION.format(known.low), "at_most": high}
