"""Changes of a session's report by an edit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, Severity, Verdict
from cqos_core.model.grouping import grouped
from cqos_core.model.lazy_tuple import lazy_tuple

if TYPE_CHECKING:
    from cqos_core.model.report import Group, Report

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Counts:
    """Numbers of endpoints, topics, pairs and findings in a report.

    Attributes:
        endpoints, topics, unmatched: as in `Report`.
        pairs: how many pairs have each verdict; none of those that are only tried.
        findings: how many findings of each severity there are, accepted ones not counted.
    """

    endpoints: int = 0
    topics: int = 0
    unmatched: int = 0
    pairs: Mapping[Verdict, int] = field(default_factory=dict, hash=False)
    findings: Mapping[Severity, int] = field(default_factory=dict, hash=False)

    @property
    def verdict(self) -> Verdict:
        """The verdict of the report: the worst of all pairs, or unknown without pairs."""
        return max(self.pairs, key=lambda verdict: verdict.rank, default=Verdict.UNKNOWN)


def counted(report: Report) -> Counts:
    """Count what is in a report."""
    pairs = Counter[Verdict]()
    for group in report.groups:
        pairs[group.verdict] += group.pairs
    severities = Counter(each.severity for each in report.findings if each.accepted is None)
    return Counts(report.endpoints, report.topics, report.unmatched, pairs, severities)


@dataclass(frozen=True, slots=True)
class Changes:
    """The difference between two states of a session's report.

    Findings and groups are compared as wholes: of one that differs in anything, the former is removed and the new one is
    added. They are in no order. They are made when they are read.

    Attributes:
        revision: number of the later state; `Session.changes` takes it as ``since``.
        added, removed: findings.
        added_groups, removed_groups: groups of pairs.
        counts: of the later state.
        before: of the earlier state.
    """

    revision: int
    added: tuple[Finding, ...] = ()
    removed: tuple[Finding, ...] = ()
    added_groups: tuple[Group, ...] = ()
    removed_groups: tuple[Group, ...] = ()
    counts: Counts = Counts()
    before: Counts = Counts()

    def __bool__(self) -> bool:
        """Whether anything differs."""
        found = (self.added, self.removed, self.added_groups, self.removed_groups)
        return self.counts != self.before or any(map(len, found))


class NetChange:
    """Items that were added and removed between two states; later steps are added to it.

    An item that was added in one step and removed in a later one is in neither.
    """

    def __init__(self) -> None:
        """Begin with no change."""
        self._came: dict[int, Any] = {}
        self._gone: dict[int, Any] = {}

    def __bool__(self) -> bool:
        """Whether anything was added or removed, also if equal items replaced each other."""
        return bool(self._came or self._gone)

    def add(self, gone: Iterable[object], came: Iterable[object]) -> None:
        """Add a step."""
        for each in gone:
            if self._came.pop(id(each), None) is None:
                self._gone[id(each)] = each
        for each in came:
            if self._gone.pop(id(each), None) is None:
                self._came[id(each)] = each

    def follow(self, step: NetChange) -> None:
        """Add all steps of another change."""
        self.add(step._gone.values(), step._came.values())

    def read(
        self, prepare: Callable[[Sequence[Any]], Sequence[Any]], of: Callable[[Any], object]
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Return added and removed items without those that are on both sides; ``of`` returns what is compared. Each is prepared when it is read."""
        came, gone = [*self._came.values()], [*self._gone.values()]

        @cache
        def both() -> tuple[list[Any], list[Any]]:
            return _unequal(prepare(came), prepare(gone), of)

        return lazy_tuple(lambda: both()[0]), lazy_tuple(lambda: both()[1])


def _unequal(came: Sequence[_T], gone: Sequence[_T], of: Callable[[_T], object]) -> tuple[list[_T], list[_T]]:
    """Return both lists without items that are on both sides."""
    left = grouped((of(each), each) for each in gone)
    new = []
    for each in came:
        equal = left.get(of(each), [])
        at = next((at for at, other in enumerate(equal) if other == each), None)
        if at is None:
            new.append(each)
        else:
            del equal[at]
    return new, [each for alike in left.values() for each in alike]
