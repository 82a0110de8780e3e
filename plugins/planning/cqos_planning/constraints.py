"""What a repair has to reach: rules over ends of a topic, each with the answer that it must give afterwards."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.relation import positions
from cqos_core.matching.judge import ask, passed_over, values_of_role
from cqos_core.matching.topic_outcomes import judge_shape
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_planning.formulas import Wanted

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from cqos_core.language.values import Values
    from cqos_core.matching.topic_groups import MatchedTopic
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved


@dataclass(slots=True, eq=False)
class ChangingEnd:
    """Endpoints of one topic that have the same values and change together.

    Attributes:
        profile: their values, with those from peers settled.
        endpoints: at least one.
    """

    profile: QosProfile
    observed: bool
    endpoints: list[Resolved]

    @property
    def first(self) -> Resolved:
        """The endpoint that stands for all."""
        return self.endpoints[0]


@dataclass(frozen=True, slots=True, eq=False)
class Constraint:
    """One rule over a pair of ends, or over one end, which then stands on both sides.

    Attributes:
        topic: as messages print it.
        broken: the rule reports at the moment, so the repair has to change something.
        refuses: it certainly reports, so a pair is incompatible already.
    """

    bound: BoundRule
    topic: str
    first: ChangingEnd
    second: ChangingEnd
    wanted: Wanted
    broken: bool
    refuses: bool = False

    @property
    def label(self) -> tuple[str, str, str, str]:
        """What names it in a conflicting set: its code, its topic and its ends."""
        return (self.bound.rule.code, self.topic, self.first.first.id, self.second.first.id)

    @property
    def values(self) -> tuple[Values, Values]:
        """What the rule reads of both ends at the moment."""
        return tuple(values_of_role(self.bound, each.profile, each.first.role) for each in (self.first, self.second))  # type: ignore[return-value]


@dataclass(frozen=True, slots=True)
class Goals:
    """What a repair is for.

    Attributes:
        decide: pairs that are unknown have to become compatible.
        severities: of the ``forbids`` rules that must be silent.
        quiet: further severities; rules of these must stay silent where they are silent now.
        excused: codes with members of findings that the system accepts.
    """

    decide: bool = False
    severities: frozenset[str] = frozenset({"error"})
    quiet: frozenset[str] = frozenset()
    excused: Collection[tuple[str, str]] = frozenset()

    @property
    def heard(self) -> frozenset[str]:
        """All severities that a change must not bring."""
        return self.severities | self.quiet


def constraints_of(topic: MatchedTopic, goals: Goals) -> Iterator[Constraint]:
    """Yield the constraints of one settled topic, whose groups are its ends."""
    pack = topic.pack
    offering, requesting = (
        [ChangingEnd(each.profile, each.observed, each.endpoints) for each in side]
        for side in (topic.publishers, topic.subscribers)
    )
    for end in (*offering, *requesting):
        for bound in (*pack.by_scope.get("endpoint", ()), *pack.participant_rules):
            if _asked_of(bound, end, goals) and (found := _constraint(bound, topic, end, end, goals)) is not None:
                yield found
    met = judge_shape(topic.shape).met if offering and requesting else ()
    for first, mask in zip(offering, met, strict=False):
        for second in (requesting[at] for at in positions(mask)):
            for bound in _rules_of_pair(first.profile, second.profile, goals):
                if (found := _constraint(bound, topic, first, second, goals)) is not None:
                    yield found


def _asked_of(bound: BoundRule, end: ChangingEnd, goals: Goals) -> bool:
    if bound.rule.severity not in goals.heard or (bound.rule.creation and end.observed):
        return False
    return bound.role in {None, end.first.role} and end.first.wire_origin is None


def _rules_of_pair(publisher: QosProfile, subscriber: QosProfile, goals: Goals) -> Iterator[BoundRule]:
    """Yield the rules that decide the verdict of a pair and the requirements on it."""
    for bound in publisher.pack.by_scope.get("pair", ()):
        rule = bound.rule
        if rule.kind == "forbids" and rule.severity not in goals.heard:
            continue
        if not passed_over(bound, publisher, subscriber):
            yield bound


def _constraint(
    bound: BoundRule, topic: MatchedTopic, first: ChangingEnd, second: ChangingEnd, goals: Goals
) -> Constraint | None:
    """Return the constraint of one rule; None where it is left as it is."""
    found = Constraint(bound, topic.shown, first, second, Wanted(bound.rule.kind != "forbids", lenient=False), False)
    answer = ask(bound, *found.values)
    if answer is not None and answer.failed is not None:
        return None
    result = found.wanted.answer if answer is None else answer.outcome.result
    if bound.rule.kind == "forbids" and answer is None:
        # Silent rules of this kind may be false or unknown, and only one that is certainly false has to stay so.
        result = bound.bound.judge(*found.values).result
    certain = goals.decide and bound.scope == "pair" and bound.rule.kind == "requires"
    absent = any(bound.absent[end.first.role] for end in (first, second)) and bound.scope == "endpoint"
    if (result is None and not certain) or absent:
        lenient = Wanted(found.wanted.answer, lenient=True)
    elif bound.rule.doubt and result is False and not certain:
        return None
    else:
        lenient = found.wanted
    broken = (result is not None and result is not found.wanted.answer) or (result is None and certain)
    is_advice = bound.rule.severity not in goals.severities and (
        bound.rule.kind == "forbids" or bound.scope == "endpoint"
    )
    if broken and (is_advice or _is_excused(bound, (first, second), goals)):
        return None
    return Constraint(bound, topic.shown, first, second, lenient, broken, broken and result is not None)


def _is_excused(bound: BoundRule, ends: tuple[ChangingEnd, ChangingEnd], goals: Goals) -> bool:
    code = bound.rule.code
    return any((code, endpoint.id) in goals.excused for end in ends for endpoint in end.endpoints)


def ends_of(constraint: Constraint) -> tuple[tuple[str, ChangingEnd], ...]:
    """Return the roles of a constraint with their ends, each end once."""
    if constraint.first is constraint.second:
        return ((constraint.first.first.role, constraint.first),)
    return ((PUBLISHER, constraint.first), (SUBSCRIBER, constraint.second))
