"""Findings about chains: requirements that fail or stay open, and steps that no data reaches."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.paths.chains import chain_times
from cqos_core.behaviour.paths.time_ranges import DURATION
from cqos_core.model.chains import CHAIN_LIMITS
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.behaviour.paths.chains import ChainFault, ChainTimes, StepTimes
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.model.finding import Finding

_EXCEEDED: Final = {"max_age": "CQ803", "max_gap": "CQ804"}


def chain_findings(pipeline: Pipeline) -> list[Finding]:
    """Return a finding for each requirement of a chain that does not certainly hold. Verdicts of pairs do not change."""
    return [finding for times in chain_times(pipeline) for finding in _of_chain(times)]


def _of_chain(times: ChainTimes) -> Iterator[Finding]:
    if times.faults:
        yield from (_fault(each) for each in times.faults if not each.reported)
        return
    held = {name: times.holds(name) for name in CHAIN_LIMITS if name in (times.limits or {})}
    yield from (_exceeded(times, name) for name, holds in held.items() if holds is False)
    if open_ones := [name for name, holds in held.items() if holds is None]:
        yield _open(times, open_ones)


def _fault(fault: ChainFault) -> Finding:
    severity = Severity.WARNING if fault.apart and not fault.broken else None
    code = "CQ802" if fault.apart else "CQ801"
    return core_finding(code, fault.message, place=fault.place, help=fault.help, severity=severity)


def _exceeded(times: ChainTimes, name: str) -> Finding:
    chain, last = times.chain, times.chain.steps[-1].at
    limit = chain.settings[name].text
    if name == "max_age":
        message = f"chain `{chain.name}`: data at `{last}` is at least {DURATION.format(times.age.low)} old, and `max_age` is {limit}"
    else:
        message = f"chain `{chain.name}`: samples reach `{last}` every {DURATION.format(times.gap.low)}, and `max_gap` is {limit}"
    return _with_hops(core_finding(_EXCEEDED[name], message, place=chain.settings[name].place), times.steps)


def _open(times: ChainTimes, names: Sequence[str]) -> Finding:
    """Return one finding for all open requirements of a chain, because they mostly have one cause."""
    chain, last = times.chain, times.chain.steps[-1].at
    says = {"max_age": f"data at `{last}` is at most {{}} old", "max_gap": f"samples reach `{last}` within {{}}"}
    what = " and whether ".join(says[name].format(chain.settings[name].text) for name in names)
    missing = list(dict.fromkeys(reason for name in names for reason in times.missing(name)))
    message, advice = f"chain `{chain.name}`: whether {what} is not known", None
    if missing:
        message += f": {missing[0]}"
        if missing[1:]:
            advice = f"give each of {len(missing)} times a bound; `cqos explain --chains` lists them"
    else:
        known = " and ".join(f"{times.known(name)} ({name})" for name in names)
        message = f"chain `{chain.name}`: whether {what} is not certain: it is {known}"
        advice = "shorten the longest of the times, or state narrower ranges"
    return _with_hops(core_finding("CQ805", message, place=chain.settings[names[0]].place, help=advice), times.steps)


def _with_hops(finding: Finding, steps: Sequence[StepTimes]) -> Finding:
    return replace(finding, notes=tuple(step_lines(steps)))


def step_lines(steps: Sequence[StepTimes]) -> Iterator[str]:
    """Yield a line for each step: its times, and the age of the data after it."""
    for number, step in enumerate(steps, 1):
        over = f" over {' and '.join(f'`{each}`' for each in step.bridges)}" if step.bridges else ""
        way = (
            f" on `{step.topic}`{over}: latency {step.latency}, waits {step.waits}, takes" if step.topic else ": takes"
        )
        yield f"{number}. `{step.at}`{way} {step.takes}; age {step.age}"
