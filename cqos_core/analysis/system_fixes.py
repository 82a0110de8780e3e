"""Applies remedies to a whole system until none of the wanted kind fixes another error."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from cqos_core.checking.checker import check_system
from cqos_core.files.export import export_input
from cqos_core.language.policy import ENDPOINT
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity
from cqos_core.model.settings import Place, Setting
from cqos_core.packs.export import ExportContext

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Finding, Remedy
    from cqos_core.model.system import System

Wanted: TypeAlias = Literal["first", "configuration"]
"""``first`` takes the best remedy of an error, ``configuration`` the best of those that need no change of the program."""

_ROUNDS: Final = 50


@dataclass(frozen=True, slots=True)
class AppliedFix:
    """A remedy that was applied, and the code of the rule it satisfies."""

    code: str
    remedy: Remedy


@dataclass(frozen=True, slots=True)
class FixedSystem:
    """A system with remedies applied.

    Attributes:
        system: with the changes as overlays of its endpoints, whose ids are unique.
        applied: in the order of application.
        left: the errors that are still there.
    """

    system: System
    applied: tuple[AppliedFix, ...]
    left: tuple[Finding, ...]

    @property
    def changed(self) -> frozenset[tuple[str, str]]:
        """Ids of endpoints and policies that have another value now."""
        return frozenset((name, each.remedy.policy) for each in self.applied for name in each.remedy.members)


def fix_system(system: System, context: CheckContext, wanted: Wanted, *, weaken: bool = False) -> FixedSystem:
    """Apply for each error the best remedy of the wanted kind; none that makes another pair worse.

    Without ``weaken``, none asks for less or promises less.

    It checks the system again after each round, so an error that one remedy fixes needs no second one.
    """
    endpoints = export_input(system, ExportContext(context.find_pack, context.default_protocol)).endpoints
    # An endpoint of several topics, such as a service, has one setting for all of them.
    alone = {each.id for each in endpoints if each.whole is not None}
    policies = {
        policy.name
        for each in endpoints
        if each.whole is not None
        for policy in each.whole.pack.policies
        if policy.level == ENDPOINT
    }
    current = replace(system, endpoints=[replace(each.endpoint, id=each.id) for each in endpoints])
    applied: list[AppliedFix] = []
    for _ in range(_ROUNDS):
        findings = check_system(current, context).findings
        errors = [each for each in findings if each.severity is Severity.ERROR and each.accepted is None]
        chosen = _chosen(errors, wanted, alone, policies, applied, weaken=weaken)
        if not chosen:
            break
        applied += chosen
        current = _with(current, chosen)
    return FixedSystem(current, tuple(applied), tuple(errors))


def _chosen(
    errors: Iterable[Finding],
    wanted: Wanted,
    alone: set[str],
    policies: set[str],
    applied: Iterable[AppliedFix],
    *,
    weaken: bool,
) -> list[AppliedFix]:
    """Choose a remedy for each error, unless another one of this round sets the same value otherwise."""
    before = {each.remedy for each in applied}
    taken: dict[tuple[str, str], str] = {}
    chosen = []
    for error in errors:
        # The smallest change may weaken the design; an export for programs prefers fixes that do not.
        for remedy in sorted(error.remedies, key=lambda each: (each.weakens, each.kind == "needs_code")):
            if (wanted == "configuration" and remedy.kind != "configuration") or remedy.breaks or remedy in before:
                continue
            if remedy.weakens and not weaken:
                continue
            if remedy.policy not in policies or not alone.issuperset(remedy.members):
                continue
            values = {taken.get((name, remedy.policy), remedy.value) for name in remedy.members}
            if values == {remedy.value}:
                taken.update({(name, remedy.policy): remedy.value for name in remedy.members})
                chosen.append(AppliedFix(error.code, remedy))
            break
    return chosen


def _with(system: System, chosen: Iterable[AppliedFix]) -> System:
    for each in chosen:
        setting = Setting(each.remedy.value, Place(f"a remedy of {each.code}"))
        system = with_setting(system, each.remedy.members, each.remedy.policy, setting)
    return system


def with_setting(system: System, members: Collection[str], policy: str, setting: Setting) -> System:
    """Return a system with one value laid over some of its endpoints."""
    endpoints = [
        replace(each, overlay={**each.overlay, policy: setting}) if each.id in members else each
        for each in system.endpoints
    ]
    return replace(system, endpoints=endpoints)
