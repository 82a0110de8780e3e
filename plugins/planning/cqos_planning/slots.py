"""What may change: places of files that state a value, the values worth setting there, and how much each change weighs."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.checking.fixes import is_promise, takes
from cqos_core.language.domains import Choice
from cqos_core.language.expression import AGGREGATES
from cqos_core.language.policy import BROKER, ENDPOINT, TOPIC
from cqos_core.language.solutions import may_change, turning_points
from cqos_core.language.values import INFINITE, is_plain
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER
from cqos_core.resolving.setting_edits import edits_of, profile_edit

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain, Values
    from cqos_core.language.vocabulary import Use
    from cqos_core.model.finding import Edit
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_planning.constraints import ChangingEnd, Constraint

LEVELS: Final = (ENDPOINT, "participant", BROKER, TOPIC)
MOST_VALUES: Final = 40
"""So many values of one policy are tried on one topic; of more, the nearest to what is stated."""


# What a change of one endpoint weighs, and what is added to that

_CHANGE: Final = 100
_REQUEST: Final = 1
"""A request rather than an offer: of two equal changes, the publisher's comes first."""
_STEP: Final = 2
"""Each further value between the old and the new one, at most `_FARTHEST` times."""
_FARTHEST: Final = 20
_STRONGEST: Final = 1
"""Of a policy with an order, the strongest value that there is."""
_OTHER_DEFAULT: Final = 5
"""Of values without order, one that the standard does not prefer."""
_SHARED: Final = 150
"""A place that several endpoints share: a profile, a participant, a broker."""
_WEAKER: Final = 1_000
_CODE: Final = 10_000
"""A promise that the program must keep."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One value for a slot.

    Attributes:
        edits: what states it in the files; nothing for the value that is there.
        kind: ``configuration``, or ``needs_code`` for a promise that the program must keep.
    """

    value: Plain | None
    edits: tuple[Edit, ...] = ()
    weight: int = 0
    weakens: bool = False
    kind: str = "configuration"


NO_CHANGE: Final = Candidate(None)


@dataclass(slots=True, eq=False)
class Slot:
    """One place, or one place for each of several equal endpoints, where a value may change.

    Attributes:
        shared: the place decides the value of several endpoints.
        readers: the ends whose value it decides, with the index of that.
        pin: the pattern that keeps it as it is.
        candidates: the first one leaves it as it is.
    """

    policy: Policy
    shared: bool
    endpoints: list[Resolved]
    readers: list[tuple[ChangingEnd, int]] = field(default_factory=list)
    pin: str = ""
    candidates: tuple[Candidate, ...] = (NO_CHANGE,)

    @property
    def role(self) -> str:
        """The role of the endpoints."""
        return self.endpoints[0].role

    @property
    def values(self) -> tuple[Plain | None, ...]:
        """The values of its candidates."""
        return tuple(each.value for each in self.candidates)


def changeable(constraint: Constraint) -> Iterator[tuple[ChangingEnd, Use]]:
    """Yield the ends and terms of a rule whose values a repair may change because of it."""
    bound = constraint.bound
    pack, fixes = constraint.first.profile.pack, bound.rule.fixes
    fixed = _matched_on(pack)
    for use in bound.bound.uses:
        policy = pack.policies[use.index]
        if policy.level not in LEVELS or policy.derived or use.index in fixed:
            continue
        if not may_change(policy.name, use.term.scope, fixes):
            continue
        fact = policy.default is None or policy.level in {BROKER, TOPIC}
        if not fixes and not policy.stronger and fact:
            continue  # a fact, which no rule names as its fix
        both = policy.level in {BROKER, TOPIC}
        for end in (
            {constraint.first, constraint.second} if both else (constraint.second if use.second else constraint.first,)
        ):
            broker = end.first.participant.broker
            if policy.level == BROKER and broker is not None and pack.is_fixed(broker):
                continue
            if policy.level != ENDPOINT or end.first.role in policy.roles:
                yield end, use


def followed(constraint: Constraint) -> Iterator[tuple[ChangingEnd, int, set[Plain]]]:
    """Yield limits from which a derived value of a rule follows: the end, the policy's index, and values worth setting.

    A queue that fills six times too early gets six times the room. Only a check shows whether that is enough.
    """
    bound, (a, b) = constraint.bound.bound, constraint.values
    for use in bound.uses:
        end = constraint.second if use.second else constraint.first
        policies, values = end.profile.pack.policies, end.profile.values
        derived = values[use.index]
        if not policies[use.index].derived or not isinstance(derived, int):
            continue
        wanted = [
            each for each in turning_points(bound, use, a, b) if isinstance(each, int) and derived < each < INFINITE
        ]
        for index, policy in enumerate(policies):
            limit = values[index]
            if (
                policy.name not in policies[use.index].follows
                or policy.level not in LEVELS
                or policy.stronger != "higher"
            ):
                continue
            if isinstance(limit, int) and 0 < limit < INFINITE and not policy.domain.candidates():
                scaled = {-(-limit * each // derived) for each in wanted} if derived > 0 else set()
                yield end, index, {*scaled, *(each + 1 for each in scaled), *usual(policy, end.first.role)}


def _matched_on(pack: RulePack) -> frozenset[int]:
    """The policies that decide who matches whom, which a repair leaves as they are."""
    return frozenset(use.index for bound in pack.by_scope["meets"] for use in bound.bound.uses)


def values_in_play(constraint: Constraint, use: Use, others: Sequence[tuple[Use, Iterable[Plain]]] = ()) -> set[Plain]:
    """Return the values at which a rule turns for one of its terms, also beside other ``values`` of further terms."""
    domain = constraint.first.profile.pack.policies[use.index].domain
    if candidates := domain.candidates():
        return {*candidates}
    a, b = constraint.values
    found = _turning(constraint, use, a, b)
    for other, values in others:
        for value in values:
            sides = (a, _with(b, other.index, value)) if other.second else (_with(a, other.index, value), b)
            found |= _turning(constraint, use, *sides)
    return found


def _turning(constraint: Constraint, use: Use, a: Values, b: Values) -> set[Plain]:
    """Return the values at which a rule turns, and those next to them where the rule is satisfied only there."""
    bound, wanted = constraint.bound.bound, constraint.wanted.answer
    values = [*turning_points(bound, use, a, b)]
    if not all(isinstance(each, int) for each in values):
        return {*values}

    def satisfied(value: Plain) -> bool:
        changed = _with(b if use.second else a, use.index, value)
        first, second = (a, changed) if use.second else (changed, b)
        if constraint.first is constraint.second:
            first = second = changed
        return bound.judge(first, second).result is wanted

    domain, listed = constraint.first.profile.pack.policies[use.index].domain, {*values}
    middle = [each for each in values if isinstance(each, int) and listed.issuperset(domain.around(each))]
    strict = [each for each in values if each not in middle and satisfied(each)]
    beside = [each for each in strict if not any(satisfied(other) for other in middle)]
    return {*middle, *beside}


def _with(values: Values, index: int, value: Plain) -> Values:
    return (*values[:index], value, *values[index + 1 :])


def numeric(constraint: Constraint) -> list[Use]:
    """Return the terms of a rule whose values are too many to try all, and which are compared with others."""
    pack = constraint.first.profile.pack
    aggregated = any(part.name in AGGREGATES for part in constraint.bound.bound.condition.walk())
    return (
        []
        if aggregated
        else [use for use in constraint.bound.bound.uses if not pack.policies[use.index].domain.candidates()]
    )


def usual(policy: Policy, role: str) -> set[Plain]:
    """Return the default of a policy and its largest value, where that is no limit."""
    found: set[Plain] = set()
    default = policy.default_for(role)
    if default is not None and policy.domain.word(default) not in policy.words:
        found.add(policy.domain.parse(default))
    if policy.domain.ordered and policy.domain.highest == INFINITE:
        found.add(INFINITE)
    return found


def spellable(policy: Policy, values: Iterable[Plain], current: Iterable[object]) -> tuple[list[Plain], int]:
    """Return the values that files can state, in order, and their number; of many those nearest to the current ones."""
    known = sorted(each for each in values if policy.domain.has(each) and policy.spelling(each) is not None)
    count, numbers = len(known), [each for each in current if isinstance(each, int)]
    if len(known) > MOST_VALUES and numbers and all(isinstance(each, int) for each in known):
        known = sorted(sorted(known, key=lambda each: min(abs(each - other) for other in numbers))[:MOST_VALUES])  # type: ignore[operator]
    return known, count


class Statement(NamedTuple):
    """How a value of an endpoint may be stated: at the endpoint itself, or in the profile it is from."""

    place: Hashable
    edits: dict[Plain, Edit]
    of_profile: bool


def statements(endpoint: Resolved, index: int, values: Sequence[Plain]) -> list[Statement]:
    """Return where and how each of some values may be stated for an endpoint, the nearest place first."""
    if not takes(endpoint, index):
        return []
    own = {value: made[0] for value in values if (made := edits_of([endpoint], index, value))}
    shared = {value: edit for value in values if (edit := profile_edit(endpoint, index, value)) is not None}
    found: dict[Hashable, Statement] = {}
    for edits, of_profile in ((own, False), (shared, True)):
        if edits:
            first = next(iter(edits.values()))
            place = (first.place, first.attribute, index)
            found[place] = Statement(place, edits, of_profile)
    return [*found.values()]


def weighed(slot: Slot, edits: dict[Plain, tuple[Edit, ...]]) -> tuple[Candidate, ...]:
    """Return the candidates of a slot, each with its weight; a value that all readers have is none."""
    current = [end.profile.values[index] for end, index in slot.readers]
    found = [NO_CHANGE]
    for value, made in edits.items():
        if all(is_plain(each) and each == value for each in current):
            continue
        weakens = any(slot.policy.weakens(each, value) for each in current)
        if weakens and slot.policy.level in {BROKER, TOPIC}:
            continue  # others may rest on what a broker promises
        code = any(is_promise(slot.policy, each, value, slot.role) for each in current)
        weight = _CHANGE + _WEAKER * weakens + _CODE * code + _SHARED * slot.shared
        weight += _REQUEST * (slot.role != PUBLISHER) + _distance(slot, current, value, [*edits])
        times = 1 if slot.shared else len(slot.endpoints)
        found.append(Candidate(value, made, weight * times, weakens, "needs_code" if code else "configuration"))
    return tuple(found)


def _distance(slot: Slot, current: Sequence[object], value: Plain, values: Sequence[Plain]) -> int:
    """Return what the way from the current values to another one weighs."""
    domain = slot.policy.domain
    if isinstance(domain, Choice) and not domain.ordered:
        return 0 if domain.format(value) == slot.policy.default_for(slot.role) else _OTHER_DEFAULT
    if not isinstance(value, int):
        return 0
    between = [
        sum(min(value, other) < each < max(value, other) for each in values if isinstance(each, int))
        for other in current
        if isinstance(other, int)
    ]
    strongest = bool(slot.policy.stronger) and value == (
        domain.highest if slot.policy.stronger == "higher" else domain.lowest
    )
    return _STEP * min(max(between, default=0), _FARTHEST) + _STRONGEST * strongest
