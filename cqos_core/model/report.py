"""What a check returns: verdicts of groups of pairs, findings with their remedies, and what was not looked at.

Leaf types only: formatters, the service and callers read them, `checker` makes them. All values are text in the
spelling of the YAML form, so nothing here needs a rule pack to be understood.
"""

from __future__ import annotations

from dataclasses import field, fields
from enum import Enum
from typing import TYPE_CHECKING, Any

from cqos_core.model.dataclass import dataclass
from cqos_core.model.notebook import InNotebooks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cqos_core.model.system import Place, Role


def plural(count: int, noun: str) -> str:
    """Return ``1 pair``, ``2 pairs``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


class TextEnum(str, Enum):
    """A closed set of texts: `enum.StrEnum`, which Python 3.10 does not have."""

    def __str__(self) -> str:
        return str(self.value)

    def __format__(self, spec: str) -> str:
        return format(self.value, spec)


class Verdict(TextEnum):
    """The answer for one pair, and for a report the worst of its pairs."""

    COMPATIBLE = "compatible"
    UNKNOWN = "unknown"
    INCOMPATIBLE = "incompatible"

    @property
    def rank(self) -> int:
        """0 compatible, 1 unknown, 2 incompatible: larger is worse."""
        return _VERDICTS.index(self)


_VERDICTS = (Verdict.COMPATIBLE, Verdict.UNKNOWN, Verdict.INCOMPATIBLE)


class Severity(TextEnum):
    """How loud a finding speaks (DESIGN 7)."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        """0 error, 1 warning, 2 note: smaller is louder."""
        return _SEVERITIES.index(self)


_SEVERITIES = (Severity.ERROR, Severity.WARNING, Severity.NOTE)


@dataclass(frozen=True, slots=True)
class Fact:
    """One value a finding speaks of.

    Attributes:
        policy: canonical name.
        value: text in YAML spelling; for an undetermined value what it depends on, for instance
            ``system_default (best_effort with fastdds, reliable with cyclonedds)``; for one that is not known ``unknown``, or
            what stands in its place and is no value, for instance ``$(DEPTH)``.
        origin: ``explicit``, ``profile NAME``, ``preset NAME``, ``default``, ``option NAME``, ``overlay``, ``settled``.
        place: its place, or that of the endpoint if it is not stated.
    """

    policy: str
    value: str
    origin: str
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Side:
    """One side of a finding: the endpoints (or participants) concerned, which all have these values.

    Attributes:
        role: ``publisher``, ``subscriber``, ``participant``, ``broker``, ``topic`` or ``system``.
        members: endpoint ids in a stable order; `count` of them (ids listed once, never truncated).
        label: what an excerpt writes under the value: ``offered here``, ``requested here``, ``set here``.
        facts: the values the rule looked at; their places are those of the first member.
        place: of the first member.
        templates: what the members are instances of, where any is one: each template once, and the members that are of none.
    """

    role: str
    members: tuple[str, ...]
    label: str = ""
    facts: tuple[Fact, ...] = ()
    place: Place | None = None
    templates: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The first member, and how many more there are: ``robot/scan`` or ``robot/scan and 3 more``."""
        if not self.members:
            return ""
        more = len(self.members) - 1
        return self.members[0] if not more else f"{self.members[0]} and {more} more"


@dataclass(frozen=True, slots=True)
class Edit:
    """One change of a file or of an element of a model; `cqos_core.apply` makes new texts of edits.

    Attributes:
        place: of the value that is replaced; of what the setting is added to, where it is not stated yet.
        attribute: the name that the value is stated under; for a setting that is added, the name of its policy.
        old: the text that is replaced, as written; None where the setting is added.
        new: the text that takes its place, in the spelling of its file.
    """

    place: Place
    attribute: str
    old: str | None
    new: str


@dataclass(frozen=True, slots=True)
class Remedy:
    """A change of one policy on one side that makes the rule pass; verified by judging it.

    Attributes:
        role: whose change it is; `members` are the endpoints that change.
        policy, value: what to set, as text.
        kind: ``configuration``, or ``needs_code`` where a stronger promise has to be kept by the program.
        mends: how many pairs it turns from worse to better, and `breaks` from better to worse, on the whole
            topic; None where there are too many to count.
        text: the change in words: ``offer `reliable` on drone/req_weather``.
        weakens: it promises or demands less than the design does now; applied only where the caller allows that.
        edits: the change as new texts; none where no file states the endpoints, or its format has no place for it.
        costs: memory and traffic that it multiplies, one sentence each.
    """

    role: Role
    members: tuple[str, ...]
    policy: str
    value: str
    kind: str
    text: str
    mends: int | None = 0
    breaks: int | None = 0
    weakens: bool = False
    edits: tuple[Edit, ...] = ()
    costs: tuple[str, ...] = ()

    @property
    def is_automatic(self) -> bool:
        """Whether ``cqos check --fix`` may apply it: it edits files, makes nothing weaker or worse, and needs no other program."""
        return bool(self.edits) and not (self.weakens or self.breaks or self.kind == "needs_code")


@dataclass(frozen=True, slots=True)
class Finding:
    """One rule that spoke.

    Attributes:
        code, name: of the rule, permanent; `source` names the pack or plugin it comes from.
        severity: after overrides.
        message: one sentence that makes sense alone, with both endpoints and both values.
        topic: the signal's topic, or None.
        verdict: what it does to its pairs: ``incompatible``, ``unknown``, or None where it does not touch the verdict.
        sides: primary first (the requesting side); the other sides are context.
        remedies: alternatives, may be empty; those that make other pairs worse come last, else the fewest endpoints first. They
            are computed when they are first read.
        notes: short further sentences: the order of the values, what the verdict depends on, worlds.
        because: the rule's reason. `clause`: where the standard says so.
        pairs: how many pairs this finding speaks of (0 for endpoint findings).
        worlds: for an undetermined verdict: assumption such as ``ros2.rmw=fastdds`` to verdict.
        more_topics: further topics on which the same was found: one unknown cause, or instances of one template.
        more_codes: further rules that the same missing fact leaves undecided.
        accepted: the reason given in ``accept:``; an accepted finding no longer counts for the exit code.
    """

    code: str
    name: str
    severity: Severity
    message: str
    source: str = "cqos"
    topic: str | None = None
    verdict: Verdict | None = None
    sides: tuple[Side, ...] = ()
    remedies: tuple[Remedy, ...] = ()
    notes: tuple[str, ...] = ()
    because: str = ""
    clause: str = ""
    help: str | None = None
    pairs: int = 0
    worlds: Mapping[str, Verdict] = field(default_factory=dict, hash=False)
    more_topics: tuple[str, ...] = ()
    accepted: str | None = None
    more_codes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """``file:line:column: error[ROS101] message``, one line."""
        where = f"{self.place}: " if self.place is not None else ""
        return f"{where}{self.severity}[{self.code}] {self.message}"

    @property
    def place(self) -> Place | None:
        """The best place to send a person to: where the primary side states a value itself, else the side."""
        for side in self.sides:
            for fact in side.facts:
                if fact.place is not None and fact.origin in {"explicit", "overlay"}:
                    return fact.place
            if side.place is not None:
                return side.place
        return None

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Ids of all endpoints concerned, primary side first."""
        return tuple(
            member for side in self.sides if side.role in {"publisher", "subscriber"} for member in side.members
        )


@dataclass(frozen=True, slots=True)
class Pair:
    """One publisher and one subscriber that meet."""

    topic: str
    publisher: str
    subscriber: str
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Group:
    """Publishers and subscribers of one topic whose pairs all have the same result, by the same rules.

    ``internal`` counts the pairs whose two ends belong to one participant; ``codes`` are the rules that spoke.
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


@dataclass(frozen=True, slots=True)
class Assumption:
    """An option that is not stated, on which a verdict or a finding rests, and the values that are assumed for it.

    Attributes:
        option: with its pack: ``ros2.rmw``.
        values: a known verdict is the same with each of them; none where no single one lets all endpoints exist.
    """

    option: str
    values: tuple[str, ...]


@dataclass(frozen=True, slots=True, repr=False)
class Report(InNotebooks):
    """The result of one check, in an order that depends on nothing but its content.

    Attributes:
        partial: what was checked is a part of a system; partners of its endpoints are in other files.
        unmatched: how many endpoints of a part have no partner in it; each of them in a whole system is a finding.
        hypothetical: how many pairs of profiles that no endpoint uses were tried; they are in no group and set no verdict.
        parts: where separate systems were checked in one run, the report of each, for formats that keep them apart.
        assumed: options that are not stated, where a verdict, an error or a warning rests on them.
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

    def __str__(self) -> str:
        """Give the verdict, how many pairs were judged, and each finding on a line of its own."""
        head = f"{self.system}: {self.verdict}" if self.system else str(self.verdict)
        errors = self.count(Severity.ERROR)
        if errors and self.verdict is Verdict.COMPATIBLE:
            head += f", {plural(errors, 'error')}"
        return "\n".join([f"{head}, {plural(self.pair_count, 'pair')} judged", *map(str, self.findings)])

    def __repr__(self) -> str:
        counts = [plural(self.pair_count, "pair"), *(plural(self.count(each), each.value) for each in Severity)]
        name = f" {self.system!r}" if self.system else ""
        return f"<Report{name}: {self.verdict}, {', '.join(counts)}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain data with the keys of the JSON report."""
        from cqos_core.model.report_form import document

        return document(self)

    def rows(self) -> list[dict[str, Any]]:
        """Return a flat dictionary for each finding, as data frames take them: ``pandas.DataFrame(report.rows())``."""
        from cqos_core.model.report_form import row

        return [row(each) for each in self.findings]

    @property
    def pairs(self) -> Iterator[Pair]:
        """Every pair, lazily, expanded from the groups."""
        for group in self.groups:
            for publisher in group.publishers:
                for subscriber in group.subscribers:
                    yield Pair(group.topic, publisher, subscriber, group.verdict)

    @property
    def pair_count(self) -> int:
        """How many pairs were judged."""
        return sum(group.pairs for group in self.groups)

    def count(self, severity: Severity) -> int:
        """How many findings of one severity there are, accepted ones not counted."""
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
    """A report with a verdict; the rest of it is made when any part of that is first read."""

    __slots__ = ("_make",)


@dataclass(frozen=True, slots=True, repr=False)
class PairReport(InNotebooks, _Unmade):
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
        from cqos_core.model.report_form import pair

        return pair(self)


@dataclass(frozen=True, slots=True)
class GuaranteeCell:
    """What a subscriber gets of one guarantee under one fault.

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
    """What a subscriber gets, in one of the words of `cqos_core.packs.guarantee`.

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
