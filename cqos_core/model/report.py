"""Results of a check: verdicts of groups of pairs, findings with their fixes, and coverage.

Leaf types only: formatters, the service and callers read them, `checker` makes them. As plain data they are the JSON report,
version 1, documented in ``docs/json-report.md``.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, field, fields
from typing import TYPE_CHECKING, Any

from cqos_core.model.coverage import Coverage
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Fact, Finding, Severity, Verdict, plural
from cqos_core.model.jupyter import JupyterDisplay

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.model.finding_json import Exact, Json

__all__ = [
    "REPORT_VERSION",
    "Assumption",
    "Group",
    "Guarantee",
    "GuaranteeCell",
    "HopReport",
    "Pair",
    "PairReport",
    "PolicyComparison",
    "Report",
]

REPORT_VERSION = 1
"""Version of the JSON report; a reader must refuse a number that it does not know."""


@dataclass(frozen=True, slots=True)
class Pair:
    """One publisher and one subscriber that match."""

    topic: str
    publisher: str
    subscriber: str
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Group:
    """Publishers and subscribers of one topic whose pairs all have the same result, by the same rules.

    ``internal`` counts the pairs whose two ends belong to one participant; ``codes`` are the rules that reported,
    in the order of their pack.
    """

    topic: str
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    verdict: Verdict
    protocol: str
    internal: int = 0
    codes: tuple[str, ...] = ()

    @property
    def pairs(self) -> int:
        """Number of pairs in the group."""
        return len(self.publishers) * len(self.subscribers)

    def to_dict(self) -> dict[str, Any]:
        """Return the group as plain data with the keys of the JSON report."""
        return {
            "topic": self.topic,
            "protocol": self.protocol,
            "verdict": self.verdict.value,
            "pairs": self.pairs,
            "internal": self.internal,
            "codes": list(self.codes),
            "publishers": list(self.publishers),
            "subscribers": list(self.subscribers),
        }


@dataclass(frozen=True, slots=True)
class Assumption:
    """An option that is not stated, on which a verdict or a finding rests, and the values that are assumed for it.

    Attributes:
        option: with its pack: ``ros2.rmw``.
        values: a known verdict is the same with each of them; none where no single one lets all endpoints exist.
    """

    option: str
    values: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the assumption as plain data with the keys of the JSON report."""
        return {"option": self.option, "values": list(self.values)}


@dataclass(frozen=True, slots=True, repr=False)
class Report(JupyterDisplay):
    """The result of one check, in an order that depends on nothing but its content.

    Attributes:
        partial: what was checked is a part of a system; partners of its endpoints are in other files.
        unmatched: how many endpoints of a part have no partner in it; each of them in a whole system is a finding.
        hypothetical: how many pairs of profiles that no endpoint uses were tried; they are in no group and set no verdict.
        parts: where separate systems were checked in one run, the report of each, for formats that keep them apart.
        assumed: options that are not stated, where a verdict, an error or a warning rests on them.
        coverage: how much of its inputs it was made from.
    """

    verdict: Verdict
    groups: tuple[Group, ...] = ()
    findings: tuple[Finding, ...] = ()
    not_checked: tuple[str, ...] = ()
    system: str = ""
    sources: tuple[str, ...] = ()
    endpoints: int = 0
    topics: int = 0
    partial: bool = False
    unmatched: int = 0
    hypothetical: int = 0
    parts: tuple[Report, ...] = field(default=(), compare=False, repr=False)
    assumed: tuple[Assumption, ...] = ()
    coverage: Coverage = Coverage()

    def __str__(self) -> str:
        """Give the verdict, how many pairs were judged, and each finding on a line of its own."""
        head = f"{self.system}: {self.verdict_words}" if self.system else self.verdict_words
        errors = self.count(Severity.ERROR)
        if errors and self.verdict is Verdict.COMPATIBLE:
            head += f", {plural(errors, 'error')}"
        return "\n".join([f"{head}, {plural(self.pair_count, 'pair')} judged", *map(str, self.findings)])

    def __repr__(self) -> str:
        counts = [plural(self.pair_count, "pair"), *(plural(self.count(each), each.value) for each in Severity)]
        name = f" {self.system!r}" if self.system else ""
        return f"<Report{name}: {self.verdict_words}, {', '.join(counts)}>"

    @property
    def verdict_words(self) -> str:
        """The verdict; of one that is ``compatible`` although something was not read that may decide: ``compatible as far as read``."""
        is_open = self.verdict is Verdict.COMPATIBLE and self.coverage.unread
        return f"{self.verdict} as far as read" if is_open else str(self.verdict)

    def to_dict(self, tool_version: str = "", exact: Exact | None = None) -> dict[str, Any]:
        """Return the report as plain data with the keys of the JSON report; ``exact`` fills in what places leave open."""
        from cqos_core.model.finding_json import finding_json, place_as_stated

        return {
            **self.summary(tool_version),
            "groups": [each.to_dict() for each in self.groups],
            "findings": [finding_json(each, exact or place_as_stated) for each in self.findings],
            "not_checked": list(self.not_checked),
        }

    def summary(self, tool_version: str = "") -> dict[str, Any]:
        """Return what the JSON report states once: verdict, counts and sources."""
        return {
            "version": REPORT_VERSION,
            "tool": {"name": "cqos", "version": tool_version},
            "system": self.system,
            "verdict": self.verdict.value,
            "partial": self.partial,
            "counts": self._counts(),
            "sources": list(self.sources),
            "assumed": [each.to_dict() for each in self.assumed],
            "coverage": self.coverage.to_dict(),
        }

    def _counts(self) -> Json:
        pairs: Counter[Verdict] = Counter()
        for group in self.groups:
            pairs[group.verdict] += group.pairs
        return {
            "topics": self.topics,
            "endpoints": self.endpoints,
            "pairs": self.pair_count,
            **{verdict.value: pairs[verdict] for verdict in Verdict},
            **{f"{severity.value}s": self.count(severity) for severity in Severity},
            "accepted": sum(finding.accepted is not None for finding in self.findings),
            "unmatched": self.unmatched,
            "hypothetical": self.hypothetical,
        }

    def rows(self) -> list[dict[str, Any]]:
        """Return a flat dictionary for each finding, as data frames take them: ``pandas.DataFrame(report.rows())``."""
        from cqos_core.model.finding_json import finding_row

        return [finding_row(each) for each in self.findings]

    @property
    def pairs(self) -> Iterator[Pair]:
        """Every pair, lazily, expanded from the groups."""
        for group in self.groups:
            for publisher in group.publishers:
                for subscriber in group.subscribers:
                    yield Pair(group.topic, publisher, subscriber, group.verdict)

    @property
    def pair_count(self) -> int:
        """Return the number of judged pairs."""
        return sum(group.pairs for group in self.groups)

    def count(self, severity: Severity) -> int:
        """Return the number of findings of one severity; accepted ones do not count."""
        return sum(1 for finding in self.findings if finding.severity is severity and finding.accepted is None)

    @property
    def ok(self) -> bool:
        """Whether `cqos check` would end with 0: no error stands, and of a whole system at least one pair was compared."""
        return not self.fails() and not (self.misses_pairs and self.pair_count == 0)

    @property
    def misses_pairs(self) -> bool:
        """Whether the report of a whole system warns that nothing was compared."""
        return any(
            finding.code == "CQ404" and finding.accepted is None and finding.severity is not Severity.NOTE
            for finding in self.findings
        )

    def fails(self, level: Severity = Severity.ERROR) -> bool:
        """Whether a finding at or above ``level`` is not accepted."""
        return any(f.severity.rank <= level.rank and f.accepted is None for f in self.findings)


class _Unmade:
    """A report with a verdict; the rest is made when any other part is first read."""

    __slots__ = ("_make",)


@dataclass(frozen=True, slots=True, repr=False)
class PairReport(JupyterDisplay, _Unmade):
    """The result of judging one offer against one request (`cqos_core.check_pair`).

    Attributes:
        guarantees: what the subscriber gets, over all hops.
        hops: of two endpoints that meet over bridges only: the pairs on the way, from the publisher on; else empty.
        derived: values of the pair that no end states, by name: ``("arrives with QoS", "1")``.
        assumed: as that of `Report`.
    """

    verdict: Verdict
    findings: tuple[Finding, ...] = ()
    policies: tuple[PolicyComparison, ...] = ()
    guarantees: tuple[Guarantee, ...] = ()
    hops: tuple[HopReport, ...] = ()
    derived: tuple[tuple[str, str], ...] = ()
    assumed: tuple[Assumption, ...] = ()

    @classmethod
    def unmade(cls, verdict: Verdict, make: Callable[[], PairReport]) -> PairReport:
        """Return the report that ``make`` makes, which is called when more than its verdict is read; it must be pure."""
        report = cls.__new__(cls)
        object.__setattr__(report, "verdict", verdict)
        object.__setattr__(report, "_make", make)
        return report

    if not TYPE_CHECKING:  # which knows the fields

        def __getattr__(self, name: str) -> object:
            """Make the rest of an unmade report."""
            if name not in self.__dataclass_fields__:
                raise AttributeError(f"{type(self).__name__} has no `{name}`", name=name, obj=self)
            whole = self._make()
            for each in fields(whole):
                object.__setattr__(self, each.name, getattr(whole, each.name))
            return object.__getattribute__(self, name)

    def __str__(self) -> str:
        """Give the verdict, and each finding on a line of its own."""
        return "\n".join([str(self.verdict), *map(str, self.findings)])

    def __repr__(self) -> str:
        return f"<PairReport: {self.verdict}, {plural(len(self.findings), 'finding')}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the pair as plain data with the keys of ``cqos explain --format json``."""
        from cqos_core.model.finding_json import finding_json

        policies, guarantees, hops = (
            [asdict(each, dict_factory=_fields) for each in parts]
            for parts in (self.policies, self.guarantees, self.hops)
        )
        return {
            "verdict": self.verdict.value,
            "policies": policies,
            "derived": dict(self.derived),
            "assumed": [each.to_dict() for each in self.assumed],
            "guarantees": guarantees,
            "hops": hops,
            "findings": [finding_json(each) for each in self.findings],
        }


def _fields(stated: list[tuple[str, Any]]) -> Json:
    """Return the fields of a value as JSON has them: reasons as objects, and no policy in a fact, which stands beside it."""
    found = {name: list(value) if isinstance(value, tuple) else value for name, value in stated}
    if "lost" in found:
        found["lost"] = [{"code": code, "because": because} for code, because in found["lost"]]
    if "origin" in found:
        del found["policy"]
    return found


@dataclass(frozen=True, slots=True)
class GuaranteeCell:
    """One guarantee of a subscriber under one fault.

    Attributes:
        fault: of `cqos_core.packs.guarantee.FAULTS`, or ``link`` for ends that stay connected.
        value: as in `Guarantee`.
        lost: for each rule that takes it away or leaves it open, its code and reason.
        proven: where this was seen on running middleware, as name and version.
        derived: implementations of this pair on which it was not seen; they are expected to do the same.
    """

    fault: str
    value: str
    lost: tuple[tuple[str, str], ...] = ()
    proven: tuple[str, ...] = ()
    derived: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Guarantee:
    """One guarantee of a subscriber, in the words of `cqos_core.packs.guarantee`.

    Attributes:
        word: ``loss_free``.
        value: ``yes``, ``no``, ``unknown``, ``none``, or a number in the spelling of needs.
        survives: the faults under which as much is given.
        lost: for each rule that takes it away or leaves it open, its code and reason.
        cells: the same for connected ends and under each fault.
    """

    word: str
    value: str
    survives: tuple[str, ...] = ()
    lost: tuple[tuple[str, str], ...] = ()
    cells: tuple[GuaranteeCell, ...] = ()


@dataclass(frozen=True, slots=True)
class HopReport:
    """One pair on the way over bridges; ``bridge`` leads from its subscriber to the next publisher."""

    publisher: str
    subscriber: str
    topic: str
    protocol: str
    verdict: Verdict
    guarantees: tuple[Guarantee, ...] = ()
    bridge: str | None = None


@dataclass(frozen=True, slots=True)
class PolicyComparison:
    """One line of ``cqos explain``: a policy with both values, and what the rules over it say."""

    policy: str
    offered: Fact | None
    requested: Fact | None
    verdict: Verdict | None
    rules: tuple[str, ...] = ()
