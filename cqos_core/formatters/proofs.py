"""Runs of pairs on middleware: timelines as text, and records as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.finding import Severity
from cqos_core.model.problems import CqosError
from cqos_core.packs.prover import Event

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.analysis.run_plan import Trial
    from cqos_core.model.finding import Remedy
    from cqos_core.packs.prover import Outcome


def timeline(events: Iterable[Event]) -> list[str]:
    """Return a line for each event; samples that follow each other are one line."""
    lines: list[tuple[Event, list[int]]] = []
    growing: dict[tuple[str, str, str], list[int]] = {}
    for event in events:
        key = (event.who, event.what, event.text)
        if event.number is None:
            growing.clear()
            lines.append((event, []))
        elif key in growing:
            growing[key].append(event.number)
        else:
            growing[key] = [event.number]
            lines.append((event, growing[key]))
    return [
        f"{'' if event.at is None else f'{event.at:7.3f} s  '}{event.who:<10}  {event.what.replace('_', ' ')}{f' {_ranges(numbers)}' if numbers else ''}"
        f"{f': {event.text}' if event.text else ''}"
        for event, numbers in lines
    ]


def _ranges(numbers: Sequence[int]) -> str:
    """Return ``0 to 4, 6``: numbers in their order, runs of them as ranges."""
    # Numbers of one run have one distance from their places.
    runs = [[number for _, number in run] for _, run in groupby(enumerate(numbers), lambda each: each[1] - each[0])]
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)


def run_record(trial: Trial, outcome: Outcome, fixes: Sequence[Remedy], wrong: Sequence[str]) -> dict[str, Any]:
    """Return the JSON record of a run: the pair, the plan, the events, and disagreements with the verdict."""
    plan = asdict(trial.plan)
    return {
        "publisher": trial.publisher,
        "subscriber": trial.subscriber,
        "topic": trial.topic,
        "protocol": trial.protocol,
        "verdict": trial.report.verdict.value,
        "codes": sorted({each.code for each in trial.report.findings if each.severity is Severity.ERROR}),
        "fixes": [fix.text for fix in fixes],
        "plan": plan,
        "on": outcome.by,
        "matched": outcome.matched,
        "refused": list(outcome.refused),
        "not_created": dict(outcome.not_created),
        "sent": list(outcome.sent),
        "arrived": list(outcome.arrived),
        "agrees": not wrong,
        "disagreements": list(wrong),
        "events": [asdict(each) for each in outcome.events],
    }


_FORM: Final[dict[str, type | tuple[type, ...]]] = {
    **dict.fromkeys(("publisher", "subscriber", "topic", "verdict", "on"), str),
    **dict.fromkeys(("fixes", "sent", "arrived", "disagreements", "events"), list),
    "plan": dict,
    "matched": (bool, type(None)),
    "agrees": bool,
}


def runs_from_json(name: str, data: bytes) -> tuple[dict[str, Any], ...]:
    """Return the runs that ``cqos prove --format json`` wrote.

    Raises:
        CqosError: the file is none of these; the message says what was expected.
    """
    try:
        document = json.loads(data)
        runs = document["runs"]
        for run in runs:
            _check(run)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise CqosError(f"{name} holds no runs of `cqos prove --format json`: {reason[:120]}") from None
    return tuple(runs)


def _check(run: Mapping[str, Any]) -> None:
    """Raise `TypeError` or `KeyError` if a record is no run."""
    wrong = [key for key, kind in _FORM.items() if not isinstance(run[key], kind)]
    fault = run["plan"]["fault"]
    timeline(Event(**each) for each in run["events"])
    if wrong or not (fault is None or (isinstance(fault["kind"], str) and fault["seconds"] >= 0)):
        raise TypeError(", ".join(wrong) or "fault")
