"""Words for changes of a plan, and for parts of a conflict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.checking.fixes import remedy_text
from cqos_core.language.policy import BROKER, TOPIC
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import plural
from cqos_planning.model import PINNED
from cqos_planning.slots import changeable

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from cqos_core.model.system import Role
    from cqos_planning.constraints import Constraint
    from cqos_planning.model import RepairModel
    from cqos_planning.slots import Slot


def reason_of(constraint: Constraint) -> str:
    """Return the code of a rule with its reason."""
    return f"{constraint.bound.rule.code}: {constraint.bound.rule.because}"


def change_text(slot: Slot, value: str, members: tuple[str, ...]) -> str:
    """Return a change in words: ``offer reliability `reliable` on robot/scan``."""
    role: Role = slot.role  # type: ignore[assignment]
    level, shared = slot.policy.level, ""
    first = slot.endpoints[0]
    if level == BROKER and first.participant.broker is not None:
        shared = f"of broker {first.participant.broker.id}"
    elif level == TOPIC:
        shared = f"of topic {first.shown}"
    elif slot.shared and level == "endpoint":
        more = f" and {plural(len(members) - 1, 'other endpoint')}" if len(members) > 1 else ""
        shared = f"in what {members[0]}{more} share" if more else f"in the profile of {members[0]}"
    return remedy_text(role, slot.policy.name, value, members, level, shared)


@dataclass(frozen=True, slots=True)
class ConflictWords:
    """Puts the parts of a conflicting set into words."""

    model: RepairModel
    refused: Mapping[tuple[str, str], str]

    def of(self, name: Hashable) -> str:
        """Return one part in words."""
        if isinstance(name, tuple) and name[0] == PINNED:
            return f"`--keep {name[1]}` keeps {name[2]} of `{name[3]}` as it is"
        refused: str | None = self.refused.get(name)  # type: ignore[call-overload]
        if refused is not None:
            return refused
        constraint = next(each for each in self.model.constraints if each.label == name)
        rule, (first, second) = constraint.bound.rule, (constraint.first, constraint.second)
        ends = (
            f"`{second.first.id}`" if first is second else f"`{second.first.id}` and its publisher `{first.first.id}`"
        )
        required = f" (needs {rule.guarantee})" if rule.guarantee else ""
        fixed = dict.fromkeys(
            f"{use.term.name} of `{end.first.id}`"
            for end, use in changeable(constraint)
            if use.index not in self.model.variables.get(end, {})
        )
        where = f"; no file has a place to change {', '.join(fixed)}" if fixed else ""
        text = f"{rule.code}{required}: {ends} on `{constraint.topic}`: {rule.because}{where}"
        return f"{text} ({rule.help})" if rule.help else text
