"""From the outcome of a run back to what C-QoS says of the pair, and the fixes that are tried in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.analysis.run_plan import HERE, named, prepare
from cqos_core.analysis.system_fixes import with_setting
from cqos_core.files.edited_files import apply_edits
from cqos_core.language.domains import Duration
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.settings import Setting
from cqos_core.packs.guarantee import LINK

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.analysis.run_plan import Trial
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Finding, Remedy
    from cqos_core.model.report import PairReport
    from cqos_core.model.system import System
    from cqos_core.packs.prover import Fault, Outcome, Plan

_DURATIONS: Final = ("offline", "max_age", "max_gap", "liveness")
_ROUNDS: Final = 10
"""Fixes that one pair may take."""


def fixed(
    trial: Trial,
    where: CheckContext,
    first: Finding | None = None,
    again: Callable[[Mapping[str, bytes]], System] | None = None,
) -> tuple[Trial, tuple[Remedy, ...]] | None:
    """Apply to a pair the first fix of each error that it has, until it has none.

    Args:
        trial: the pair.
        where: the packs.
        first: the finding whose fix is applied first.
        again: reads the files of the system with new texts, by name. A fix that edits files is then applied to a copy of
            them, which is read back. Other fixes are laid over the endpoints.

    Returns:
        The pair with the fixes, and these; None where it has no fix.
    """
    applied: dict[tuple[object, ...], Remedy] = {}
    current = trial
    for _ in range(_ROUNDS):
        errors = [each for each in current.report.findings if each.severity is Severity.ERROR]
        if first is not None and not applied:
            errors.insert(0, first)
        tried = (
            (fix, changed)
            for each in errors
            for fix in each.remedies
            if _what(fix) not in applied and (changed := _changed(current.system, fix, where, again)) is not None
        )
        remedy, system = next(tried, (None, current.system))
        if remedy is None:
            break
        applied[_what(remedy)] = remedy
        current = prepare(system, trial.publisher, trial.subscriber, where, trial.on, trial.plan.fault)
        if current.report.verdict is not Verdict.INCOMPATIBLE and all(
            each.severity is not Severity.ERROR for each in current.report.findings
        ):
            break
    return (current, tuple(applied.values())) if applied else None


def _what(remedy: Remedy) -> tuple[object, ...]:
    return remedy.members, remedy.policy, remedy.value


def _changed(
    system: System, remedy: Remedy, where: CheckContext, again: Callable[[Mapping[str, bytes]], System] | None
) -> System | None:
    """Return a system with a fix applied; None where it cannot be."""
    if again is None or not remedy.edits:
        known = {each.id for each in system.endpoints}
        return (
            with_setting(system, remedy.members, remedy.policy, Setting(remedy.value, HERE))
            if known.issuperset(remedy.members)
            else None
        )
    edited = apply_edits(system.sources, remedy.edits)
    if edited.left or not edited.texts:
        return None
    return named(again({**system.sources, **edited.texts}), where)


# What reality says


def summary(outcome: Outcome) -> str:
    """Return what happened in one line: ``20 sent, 0 arrived, refused for RELIABILITY``."""
    if outcome.answers:
        kept = [word for word, holds in outcome.answers.items() if holds]
        broken = [word for word, holds in outcome.answers.items() if not holds]
        said = (("all runs keep", kept), ("some run breaks", broken))
        return "; ".join(f"{what} {', '.join(words)}" for what, words in said if words)
    parts = [
        (True, f"{len(outcome.sent)} sent, {len(set(outcome.arrived))} arrived"),
        (outcome.repeated, f"{len(outcome.repeated)} more than once"),
        (not outcome.ordered, "out of order"),
        *((True, f"{role} failed: {why or 'no reason given'}") for role, why in outcome.not_created.items()),
        (outcome.refused, f"refused for {', '.join(each.upper() for each in outcome.refused)}"),
        (not outcome.refused and outcome.matched is False, "never connected"),
    ]
    return ", ".join(text for is_so, text in parts if is_so)


def disagreements(trial: Trial, outcome: Outcome, where: CheckContext) -> list[str]:
    """Return each sentence of the report that the run contradicts; an unknown verdict contradicts nothing."""
    report = trial.report
    connected = outcome.matched is True and not outcome.not_created
    refusing = [each.code for each in report.findings if _refuses(each, where)]
    if report.verdict is Verdict.COMPATIBLE and not refusing and not connected:
        return [f"C-QoS says compatible, {outcome.by} did not connect the two: {summary(outcome)}"]
    if refusing and connected and outcome.arrived:
        codes = ", ".join(dict.fromkeys(refusing))
        return [f"C-QoS says incompatible ({codes}), {outcome.by} connected the two: {summary(outcome)}"]
    return _broken(trial, outcome) if connected else []


def _refuses(finding: Finding, where: CheckContext) -> bool:
    """Whether a finding says that the middleware refuses the pair or an end, rather than that a requirement is not met."""
    rule = where.find_rule(finding.code)
    of_pack = getattr(rule, "kind", "") in {"requires", "forbids"} and not getattr(rule, "guarantee", "")
    return of_pack and finding.severity is Severity.ERROR and finding.verdict is not Verdict.UNKNOWN


def not_seen(trial: Trial, outcome: Outcome, where: CheckContext) -> list[tuple[str, str]]:
    """Return code and message of each error about a pair that a run of it does not show.

    What is not guaranteed need not be lost in a run that is this short.
    """
    if trial.report.verdict is not Verdict.INCOMPATIBLE or not outcome.arrived:
        return []
    wrong = [each for each in trial.report.findings if each.verdict is Verdict.INCOMPATIBLE]
    return [(each.code, each.message) for each in wrong if not _shows(each, trial.plan, outcome, where)]


def _shows(finding: Finding, plan: Plan, outcome: Outcome, where: CheckContext) -> bool:
    """Whether a run breaks the guarantee that a finding says is not given."""
    word = getattr(where.find_rule(finding.code), "guarantee", "")
    whole = str(plan.early) if word == "late_join" else "yes"
    return bool(word) and kept_by(word, whole, plan, outcome) is False


def claims(report: PairReport, fault: Fault | None) -> dict[str, str]:
    """Return by word what C-QoS guarantees under a fault; what it does not know or give is left out.

    A slow reader is no fault of the pair: what is given to connected ends is given to it too.
    """
    column = LINK if fault is None or fault.kind == "slow_reader" else fault.kind
    values = {each.word: cell.value for each in report.guarantees for cell in each.cells if cell.fault == column}
    return {word: value for word, value in values.items() if value not in {"no", "unknown", "none"}}


def _broken(trial: Trial, outcome: Outcome) -> list[str]:
    """Return the guarantees that the run did not keep."""
    after = "" if trial.plan.fault is None else f" with {trial.plan.fault}"
    return [
        f"C-QoS says {word} {value}{after}, the run shows: {summary(outcome)}"
        for word, value in claims(trial.report, trial.plan.fault).items()
        if kept_by(word, value, trial.plan, outcome) is False
    ]


def meets_need(word: str, value: str, needed: int | None) -> bool:
    """Whether what is given meets a need; a word that is no duration is given whole."""
    if word not in _DURATIONS or needed is None:
        return True
    given = Duration().parse(value)
    return given >= needed if word == "offline" else given <= needed


def kept_by(word: str, value: str, plan: Plan, outcome: Outcome) -> bool | None:
    """Return whether a run kept a guarantee; None where a run shows nothing about it, or nothing was guaranteed."""
    if value in {"", "no", "unknown", "none", "0"}:
        return None
    if outcome.answers:
        return outcome.answers.get(word) if meets_need(word, value, plan.needs.get(word)) else None
    early = {number for number in outcome.sent if number < plan.early}
    if word == "late_join":
        return len(early & set(outcome.arrived)) >= min(int(value), len(early)) if value.isdigit() and early else None
    checks: Mapping[str, Callable[[], bool]] = {
        "loss_free": lambda: not set(outcome.lost) - early,
        "duplicate_free": lambda: not outcome.repeated,
        "ordered": lambda: outcome.ordered,
        "latest": lambda: not outcome.sent or outcome.sent[-1] in outcome.arrived,
    }
    return checks[word]() if word in checks else None
