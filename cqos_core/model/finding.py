"""A finding with its severity, values, places and fixes.

All values are text in the spelling of the YAML form, so nothing here needs a rule pack to be understood.
"""

from __future__ import annotations

from dataclasses import field
from enum import Enum
from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.system import Role


_HISSING: Final = ("s", "x", "ch", "sh")


def plural(count: int, noun: str) -> str:
    """Return ``1 pair``, ``2 pairs``, ``2 processes``."""
    if count == 1:
        return f"{count} {noun}"
    return f"{count} {noun}{'es' if noun.endswith(_HISSING) else 's'}"


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
    """Severity of a finding."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        """0 error, 1 warning, 2 note: smaller is more severe."""
        return _SEVERITIES.index(self)


_SEVERITIES = (Severity.ERROR, Severity.WARNING, Severity.NOTE)


@dataclass(frozen=True, slots=True)
class Fact:
    """A value that a finding names.

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
        templates: if any member is an instance: the templates of all members, each once, and the members without one.
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
        place: of the value that is replaced; of the element that a new setting is added to.
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
    """A rule that reports, with the endpoints concerned.

    Attributes:
        code, name: of the rule, permanent; `source` names the pack or plugin it comes from.
        severity: after overrides.
        message: one sentence that makes sense alone, with both endpoints and both values.
        topic: the signal's topic, or None.
        verdict: the verdict of its pairs: ``incompatible``, ``unknown``, or None where it does not touch the verdict.
        sides: primary first (the requesting side); the other sides are context.
        remedies: alternatives, may be empty; those that make other pairs worse come last, else the fewest endpoints first. They
            are computed when they are first read.
        notes: short further sentences: the order of the values, what the verdict depends on, worlds.
        because: the rule's reason. `clause`: where the standard says so.
        pairs: the number of pairs concerned (0 for endpoint findings).
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
