"""The model of a repair: the constraints of some topics, the slots that may change, and both as a task for the solver."""

from __future__ import annotations

from collections import Counter
from dataclasses import field, replace
from fnmatch import fnmatchcase
from pathlib import PurePath
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.checking.topic_check import settled
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import FromPeers
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_planning.constraints import ChangingEnd, constraints_of, ends_of
from cqos_planning.formulas import ReadValues, Variable, formula_of
from cqos_planning.slots import (
    Slot,
    changeable,
    followed,
    numeric,
    spellable,
    statements,
    usual,
    values_in_play,
    weighed,
)
from cqos_planning.solver import Task

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

    from cqos_core.language.values import Plain
    from cqos_core.matching.hops import Topics
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.finding import Edit
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_planning.constraints import Constraint, Goals
    from cqos_planning.slots import Statement

PINNED: Final = "pinned"


class GoalPart(NamedTuple):
    """A part of the goal: a topic with two ends, one end twice for what is asked of it alone, or without ends as a whole."""

    topic: str
    first: ChangingEnd | None = None
    second: ChangingEnd | None = None


def unit_of(constraint: Constraint) -> GoalPart:
    """Return the part of the goal that a broken rule belongs to."""
    return GoalPart(constraint.topic, constraint.first, constraint.second)


@dataclass(frozen=True, slots=True)
class Refusals:
    """What checks objected to.

    Attributes:
        cuts: combinations of choices, each with a name: code and topic.
        words: of each name.
        open: names that only say that a pair stays as it is.
    """

    cuts: list[tuple[tuple[str, str], Mapping[Hashable, int]]] = field(default_factory=list)
    words: dict[tuple[str, str], str] = field(default_factory=dict)
    open: set[tuple[str, str]] = field(default_factory=set)


def pin_of(endpoint: Resolved, patterns: Sequence[str]) -> str:
    """Return the first pattern that names an endpoint or its participant; nothing if none does."""
    return _named((endpoint.id, endpoint.stated_id, endpoint.participant.participant.id), patterns)


def _pin_of_file(edits: Iterable[Edit], patterns: Sequence[str]) -> str:
    """Return the first pattern that names a file in which edits are."""
    sources = {each.place.source for each in edits}
    return _named([name for source in sources for name in (source, PurePath(source).name)], patterns)


def _named(names: Sequence[str], patterns: Sequence[str]) -> str:
    return next((each for each in patterns if any(fnmatchcase(name, each) for name in names)), "")


@dataclass(slots=True, eq=False)
class RepairModel:
    """What the solver is asked about.

    Attributes:
        slots: by place.
        variables: by end and index.
        loose: by end and index what else may change a value, in a way that only a check shows.
        topics: by topic as messages print it, the places that its ends read.
        cut: by topic and policy, how many values were tried and how many there are, where not all were tried.
    """

    constraints: list[Constraint]
    slots: dict[Hashable, Slot] = field(default_factory=dict)
    variables: dict[ChangingEnd, dict[int, Variable]] = field(default_factory=dict)
    loose: dict[ChangingEnd, dict[int, Variable]] = field(default_factory=dict)
    topics: dict[str, set[Hashable]] = field(default_factory=dict)
    cut: dict[tuple[str, str], tuple[int, int]] = field(default_factory=dict)

    def task(self, refusals: Refusals, most: int | None = None) -> Task:
        """Return the task for the solver.

        Args:
            refusals: what checks objected to.
            most: the greatest weight; None: any.
        """
        formulas = []
        for each in self.constraints:
            first, second = self._source(each, each.first, 0), self._source(each, each.second, 1)
            formula = formula_of(each.bound.bound, first, first if each.first is each.second else second, each.wanted)
            if formula is not True:
                formulas.append((each.label, formula))
        weights = {place: [each.weight for each in slot.candidates] for place, slot in self.slots.items()}
        pins = {
            place: (PINNED, slot.pin, slot.policy.name, slot.endpoints[0].id)
            for place, slot in self.slots.items()
            if slot.pin
        }
        broken = {each.label: each for each in self.constraints if each.broken}
        # What else holds of a pair that is incompatible anyway is given up with it.
        refused = {unit_of(each) for each in broken.values() if each.refuses}
        units: dict[Hashable, tuple[Hashable, ...]] = {}
        for each in self.constraints:
            own = unit_of(each)
            ends = (GoalPart(each.topic, each.first, each.first), GoalPart(each.topic, each.second, each.second))
            pair = () if each.first is each.second else (own, *ends)
            units[each.label] = (own,) if each.broken else tuple(unit for unit in pair if unit in refused)
        worth: dict[Hashable, int] = {
            unit_of(each): len(each.first.endpoints) * len(each.second.endpoints) for each in broken.values()
        }
        rests_on = [
            (unit, end)
            for unit, each in ((unit_of(each), each) for each in broken.values())
            for end in (GoalPart(each.topic, each.first, each.first), GoalPart(each.topic, each.second, each.second))
            if end in worth and end != unit
        ]
        for name in sorted(refusals.open):
            units[name] = (GoalPart(name[1]),)
            worth[GoalPart(name[1])] = 1
        return Task(weights, formulas, pins, refusals.cuts, units, worth, rests_on, most)

    def _source(self, constraint: Constraint, end: ChangingEnd, side: int) -> ReadValues:
        return ReadValues(constraint.values[side], self.variables.get(end, {}), self.loose.get(end, {}))

    def value(self, end: ChangingEnd, index: int, chosen: Mapping[Hashable, int]) -> Plain | None:
        """Return what choices set a value to; None where they leave it as it is."""
        variable = self.variables.get(end, {}).get(index)
        for place in variable.places if variable is not None else ():
            if place in chosen:
                return self.slots[place].candidates[chosen[place]].value
        return None


def build(
    topics: Topics,
    active: Iterable[TopicKey],
    goals: Goals,
    keep: Sequence[str] = (),
    may: Callable[[Resolved, int], bool] = lambda _endpoint, _index: True,
) -> RepairModel:
    """Build the model of some topics.

    Args:
        topics: all endpoints by protocol and topic.
        active: the topics to take into the model.
        goals: what the repair is for.
        keep: patterns of what stays as it is.
        may: whether a policy of an endpoint may change, by its index.
    """
    drafts = _relevant([each for key in active for each in constraints_of(settled(topics[key]), goals)])
    pools = _pools(drafts)
    stated = _Places(topics, pools, keep, may)
    parts: dict[ChangingEnd, list[ChangingEnd]] = {}
    for end in dict.fromkeys(end for each in drafts for _, end in ends_of(each)):
        parts[end] = stated.parts(end)
    constraints = [
        replace(each, first=first, second=second)
        for each in drafts
        for first in parts[each.first]
        for second in ([first] if each.first is each.second else parts[each.second])
    ]
    model = RepairModel(constraints, cut=stated.cut)
    _fill(model, stated)
    _loosen(model)
    for each in constraints:
        places = model.topics.setdefault(each.topic, set())
        for _, end in ends_of(each):
            places.update(place for variable in model.variables.get(end, {}).values() for place in variable.places)
            places.update(place for variable in model.loose.get(end, {}).values() for place in variable.places)
    return model


Pools = dict[tuple[str, str, int], set["Plain"]]
"""By protocol, topic and policy the values in play."""


def _relevant(drafts: Sequence[Constraint]) -> list[Constraint]:
    """Return the constraints that changes may touch: they share changeable policies with broken ones, directly or in turn."""
    reading = [({(end.profile.pack.id, use.index) for end, use in changeable(each)}, each) for each in drafts]
    found: set[tuple[str, int]] = set()
    waiting = [policies for policies, each in reading if each.broken]
    while waiting:
        new = set().union(*waiting) - found
        found |= new
        waiting = [policies for policies, _ in reading if not new.isdisjoint(policies) and not policies <= found]
    return [each for policies, each in reading if each.broken or not found.isdisjoint(policies)]


def _pools(drafts: Sequence[Constraint]) -> Pools:
    """Collect the values that may be set: those at which a rule turns, beside what is stated and beside each other."""
    pools: Pools = {}

    def pool(constraint: Constraint, index: int) -> set[Plain]:
        return pools.setdefault((constraint.first.profile.pack.id, constraint.topic, index), set())

    for each in drafts:
        for _, use in changeable(each):
            pool(each, use.index).update(values_in_play(each, use))
        if each.broken:
            for end, index, values in followed(each):
                pools.setdefault((end.profile.pack.id, each.topic, index), set()).update(values)
    stated = {key: sorted(values, key=_in_order) for key, values in pools.items()}
    for each in drafts:
        uses = numeric(each)
        for end, use in changeable(each):
            beside = [(other, stated.get((end.profile.pack.id, each.topic, other.index), [])) for other in uses]
            if use in uses and _computes(each):
                others = [(other, values) for other, values in beside if values and other.index != use.index]
                pool(each, use.index).update(values_in_play(each, use, others))
            pool(each, use.index).update(usual(end.profile.pack.policies[use.index], end.first.role))
    return pools


def _in_order(value: object) -> tuple[bool, object]:
    return (isinstance(value, (str, tuple)), value)


def _computes(constraint: Constraint) -> bool:
    """Whether a rule compares more than one policy of each side: then values of some turn beside changed ones of others."""
    return len({use.index for use in numeric(constraint)}) > 1


@dataclass(eq=False)
class _Places:
    """Where the values of endpoints may be stated; equal endpoints of a topic are parts of one end."""

    topics: Topics
    pools: Pools
    keep: Sequence[str]
    may: Callable[[Resolved, int], bool]
    found: dict[tuple[str, int], list[Statement]] = field(default_factory=dict)
    owners: dict[Hashable, set[str]] = field(default_factory=dict)
    cut: dict[tuple[str, str], tuple[int, int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Count the topics of each endpoint, and find the endpoints that share a place."""
        self.times = Counter(each.id for endpoints in self.topics.values() for each in endpoints)
        self.indices = grouped(((pack, topic), index) for pack, topic, index in self.pools)
        for endpoints in self.topics.values():
            for endpoint in endpoints:
                if endpoint.wire_origin is None:
                    self._note(endpoint)

    def _note(self, endpoint: Resolved) -> None:
        for index in self.indices_of(endpoint):
            policy = endpoint.pack.policies[index]
            absent = policy.level == ENDPOINT and endpoint.role not in policy.roles
            if absent or not self.may(endpoint, index):
                continue
            values = self.pools[endpoint.pack.id, endpoint.shown, index]
            known, all_known = spellable(policy, values, [endpoint.profile.values[index]])
            if len(known) < all_known:
                self.cut[endpoint.shown, policy.name] = (len(known), all_known)
            stated = self.found.setdefault((endpoint.id, index), [])
            for each in statements(endpoint, index, known):
                same = next((other for other in stated if other.place == each.place), None)
                if same is None:
                    stated.append(each)
                else:
                    same.edits.update(each.edits)
                self.owners.setdefault(each.place, set()).add(endpoint.id)

    def indices_of(self, endpoint: Resolved) -> list[int]:
        """Return the policies of an endpoint that may change."""
        return self.indices.get((endpoint.pack.id, endpoint.shown), [])

    def is_shared(self, statement: Statement, endpoint: Resolved, index: int) -> bool:
        """Whether a place may state a value for more than one endpoint."""
        if statement.of_profile or endpoint.pack.policies[index].level != ENDPOINT:
            return True
        return len(self.owners[statement.place]) > 1

    def parts(self, end: ChangingEnd) -> list[ChangingEnd]:
        """Return the parts of an end: what shares other places than the rest, or is kept, is a part of its own."""
        by: dict[Hashable, list[Resolved]] = {}
        for each in end.endpoints:
            shared = tuple(
                tuple(one.place for one in self.found.get((each.id, index), ()) if self.is_shared(one, each, index))
                or len(self.found.get((each.id, index), ()))
                for index in self.indices_of(each)
            )
            alone = each.id if self.times[each.id] > 1 else ""
            by.setdefault((shared, alone, pin_of(each, self.keep)), []).append(each)
        return [ChangingEnd(end.profile, end.observed, members) for members in by.values()]

    def places(self, end: ChangingEnd, index: int) -> list[tuple[Hashable, bool, dict[Plain, tuple[Edit, ...]]]]:
        """Return the places that state a value for an end, the nearest first: each with its edits by value."""
        found: list[tuple[Hashable, bool, dict[Plain, tuple[Edit, ...]]]] = []
        for depth, first in enumerate(self.found.get((end.first.id, index), ())):
            if self.is_shared(first, end.first, index):
                found.append((first.place, True, {value: (edit,) for value, edit in first.edits.items()}))
                continue
            each = [self.found[one.id, index][depth].edits for one in end.endpoints]
            values = [value for value in first.edits if all(value in one for one in each)]
            edits = {value: tuple(one[value] for one in each) for value in values}
            found.append(((index, depth, *sorted(one.id for one in end.endpoints)), False, edits))
        return found


def _fill(model: RepairModel, stated: _Places) -> None:
    """Make the slots and variables of a model."""
    edits: dict[Hashable, dict[Plain, tuple[Edit, ...]]] = {}
    read: dict[ChangingEnd, dict[int, list[Hashable]]] = {}
    for end in dict.fromkeys(end for each in model.constraints for _, end in ends_of(each)):
        for index in stated.indices_of(end.first):
            for place, shared, by_value in stated.places(end, index):
                policy = end.profile.pack.policies[index]
                slot = model.slots.setdefault(place, Slot(policy, shared, []))
                slot.endpoints += [each for each in end.endpoints if each.id not in {one.id for one in slot.endpoints}]
                slot.readers.append((end, index))
                slot.pin = slot.pin or next((pin for each in end.endpoints if (pin := pin_of(each, stated.keep))), "")
                slot.pin = slot.pin or _pin_of_file((edit for made in by_value.values() for edit in made), stated.keep)
                for value, made in by_value.items():
                    edits.setdefault(place, {}).setdefault(value, made)
                read.setdefault(end, {}).setdefault(index, []).append(place)
    for place, slot in model.slots.items():
        ordered = sorted(edits[place].items(), key=lambda each: _in_order(each[0]))
        slot.candidates = weighed(slot, dict(ordered))
    for end, by_index in read.items():
        for index, places in by_index.items():
            model.variables.setdefault(end, {})[index] = _variable(places, [model.slots[place] for place in places])


def _variable(places: Sequence[Hashable], slots: Sequence[Slot]) -> Variable:
    values = [*dict.fromkeys(value for slot in slots for value in slot.values[1:] if value is not None)]
    numbers = tuple((0, *(1 + values.index(value) for value in slot.values[1:] if value is not None)) for slot in slots)
    return Variable(tuple(places), tuple(values), numbers)


def _loosen(model: RepairModel) -> None:
    """Note what else may change values: those that are copied from others, and those that follow from several."""
    everything = tuple(model.slots)
    by_policy = grouped((slot.policy.name, place) for place, slot in model.slots.items())
    by_endpoint = grouped((each.id, place) for place, slot in model.slots.items() for each in slot.endpoints)
    for end in dict.fromkeys(end for each in model.constraints for _, end in ends_of(each)):
        found: dict[int, tuple[Hashable, ...]] = {}
        pack, carried = end.profile.pack, end.first.wire_origin
        for index, policy in enumerate(pack.policies):
            if carried is not None and index in carried.own_index:
                found[index] = tuple(by_endpoint.get(carried.endpoint.id, ()))
            elif isinstance(policy.words.get(policy.domain.word(end.first.written(index) or "")), FromPeers):
                own = model.variables.get(end, {}).get(index)
                others = everything if end.first.bridge is not None else by_policy.get(policy.name, ())
                found[index] = tuple(place for place in others if own is None or place not in own.places)
            elif policy.follows and end.profile.values[index] not in policy.unbounded:
                near = by_endpoint.get(end.first.id, ())
                places = (place for name in policy.follows for place in by_policy.get(name, ()))
                found[index] = tuple(place for place in places if policy.together or place in near)
        model.loose[end] = {index: Variable(places, any_change=True) for index, places in found.items() if places}
