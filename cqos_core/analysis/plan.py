"""What a search for changes returns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity

if TYPE_CHECKING:
    from cqos_core.files.edited_files import Edited
    from cqos_core.model.finding import Edit, Finding
    from cqos_core.model.report import Report


@dataclass(frozen=True, slots=True)
class PlannedChange:
    """One change of a plan.

    Attributes:
        text: the change in words.
        members: the endpoints whose value it changes.
        old, new: the values as text.
        weakens: it promises or demands less than before.
        kind: ``configuration``, or ``needs_code`` where the program must keep a stronger promise.
        shared: the place that changes is shared by several endpoints.
        because: the rules that report without this change, each with its code and reason.
        edits: the change as new texts.
        costs: what is known of its cost, one sentence each.
    """

    text: str
    policy: str
    old: str
    new: str
    members: tuple[str, ...]
    weight: int
    weakens: bool
    kind: str
    shared: bool
    because: tuple[str, ...]
    edits: tuple[Edit, ...]
    costs: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RepairPlan:
    """What came of a search for changes.

    Attributes:
        changes: none where nothing has to change, or nothing can.
        weight: of all changes.
        confirmed: a check of the changed texts shows that all is reached that can be reached.
        proven: no other changes reach as much with less weight, among the values that were tried.
        conflicts: what no changes reach: parts that exclude each other; none of them can be left out.
        tried: how many plans were checked.
        edited: the texts.
        before, after: reports of the texts.
        costs: what is known of the cost of the changes.
        grown: what the changes multiply on links, one sentence each.
        cut: policies with more values than were tried, one sentence each.
    """

    changes: tuple[PlannedChange, ...]
    weight: int
    confirmed: bool
    proven: bool
    conflicts: tuple[tuple[str, ...], ...]
    tried: int
    edited: Edited
    before: Report
    after: Report
    costs: tuple[str, ...] = ()
    grown: tuple[str, ...] = ()
    cut: tuple[str, ...] = ()

    @property
    def conflict(self) -> tuple[str, ...]:
        """The first of the conflicts; empty if nothing is in conflict."""
        return self.conflicts[0] if self.conflicts else ()

    @property
    def left(self) -> tuple[Finding, ...]:
        """The errors that are still there: no setting repairs them, or a conflict keeps them."""
        return tuple(each for each in self.after.findings if each.severity is Severity.ERROR and each.accepted is None)

    @property
    def brought(self) -> tuple[Finding, ...]:
        """The warnings that were not there before."""
        known = {(each.code, member) for each in self.before.findings for member in members_of(each)}
        return tuple(
            each
            for each in self.after.findings
            if each.severity is Severity.WARNING and each.accepted is None and not is_known(each, known)
        )


def members_of(finding: Finding) -> list[str]:
    """Return what a finding names on all its sides."""
    return [member for side in finding.sides for member in side.members]


def is_known(finding: Finding, known: set[tuple[str, str]]) -> bool:
    """Whether all that a finding names is among codes with members."""
    return known.issuperset((finding.code, member) for member in members_of(finding))
