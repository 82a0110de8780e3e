"""Rules: a condition with a permanent code, a name, a reason and a clause. Rules are values; nothing here judges."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final, Literal

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import PackError
from cqos_core.model.regular_expressions import regular_expression

if TYPE_CHECKING:
    from cqos_core.language.expression import Condition
    from cqos_core.language.policy import ByOption

Kind = Literal["requires", "forbids", "meets"]
SeverityName = Literal["error", "warning", "note"]
SEVERITIES: Final = ("error", "warning", "note")

_CODE: Final = regular_expression(r"[A-Z]{2,8}\d{3}")
_NAME: Final = regular_expression(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule of a pack.

    Attributes:
        condition: what is required or forbidden; the rule's scope follows from its terms.
        kind: ``requires`` reports when the condition is false, and is unknown when the condition is; ``forbids`` reports only when
            it is certainly true, but as an error over pairs it is unknown too; ``meets`` is a condition for two endpoints to match.
        code: permanent, pack prefix and three digits.
        name: the bad pattern in kebab case, so that "allow *name*" reads well.
        because: why it matters, a clause that can follow a colon; without a final stop.
        clause: where the standard (or the source of the practice) says so.
        severity: of its findings; an unknown ``requires`` is at most a warning. Where it depends on an option,
            ``by_option("strictness", lax="note", strict="error")``: for values not listed the rule is not checked.
        says: the headline, with ``{publisher}``, ``{subscriber}``, ``{endpoint}``, ``{topic}`` and policy names (``{durability}``,
            ``{offered depth}``) replaced; empty: derived from the values and ``because``.
        role: limits an endpoint rule to ``publisher`` or ``subscriber``; empty: as the terms say.
        doubt: a false ``requires`` makes the pair unknown rather than incompatible.
        creation: about creating an endpoint, so not asked of observed ones.
        always: a ``meets`` rule that reports every pair that it keeps from matching, not only endpoints without partner.
        fixes: policies offered as remedies, ``requested depth`` where only the subscriber's is; empty: every endpoint policy
            of the condition.
        help: advice if no fix can be computed.
        aliases: former codes and names.
        guarantee: the word whose guarantee rests on it (`cqos_core.packs.guarantee`); it then reports on compatible pairs, and only
            where that is needed.
        survives: the fault that the guarantee then survives, in a word of `cqos_core.packs.guarantee.faults_of`.
    """

    condition: Condition
    kind: Kind
    code: str
    name: str
    because: str
    clause: str = ""
    severity: SeverityName | ByOption = "error"
    says: str = ""
    role: str = ""
    doubt: bool = False
    creation: bool = False
    always: bool = False
    fixes: tuple[str, ...] = ()
    help: str = ""
    aliases: tuple[str, ...] = ()
    guarantee: str = ""
    survives: str = "link"

    def __post_init__(self) -> None:
        """Refuse malformed metadata where it is written, not where it is shown."""
        if not _CODE.fullmatch(self.code):
            raise PackError(f"rule code `{self.code}` must be 2 to 8 capitals and three digits, for instance ROS101")
        if not _NAME.fullmatch(self.name):
            raise PackError(f"rule {self.code}: name `{self.name}` must be the bad pattern in kebab case")
        if not self.because or self.because.endswith("."):
            raise PackError(f"rule {self.code}: `because` must be a reason without a final stop")
        if isinstance(self.severity, str) and self.severity not in SEVERITIES:
            raise PackError(f"rule {self.code}: severity `{self.severity}` must be error, warning or note")

    @property
    def sentence(self) -> Condition:
        """The condition, by its former name."""
        return self.condition


requires: Final = partial(Rule, kind="requires")
"""Makes a rule that reports when its condition is false; see `Rule` for the parts."""

forbids: Final = partial(Rule, kind="forbids", severity="warning")
"""Makes a rule that reports when its condition is certainly true; see `Rule` for the parts."""

matched_if: Final = partial(Rule, kind="meets", severity="warning")
"""Makes a condition for matching: where it is false two endpoints on one topic form no pair."""

meets: Final = matched_if  # the former name
