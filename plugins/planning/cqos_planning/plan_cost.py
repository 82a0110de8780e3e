"""The cost of the changes of a plan: memory, traffic, and what pairs lose for it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.paths.budgets import budgets_of_system
from cqos_core.behaviour.paths.growth import LEAST_FACTOR, growth_in_words, memory_of, traffic_of
from cqos_core.behaviour.paths.link_facts import rate_text, size_text
from cqos_core.checking.topic_check import settled
from cqos_core.language.solutions import restated
from cqos_core.language.values import is_plain
from cqos_core.matching.judge import failed_match_conditions
from cqos_core.matching.pair_guarantees import guarantees_of
from cqos_core.model.finding import plural
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from cqos_core.analysis.plan import PlannedChange, RepairPlan
    from cqos_core.language.values import Value
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic, TopicKey
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_planning.checked_system import CheckedSystem

_MOST_PAIRS: Final = 20
"""Bounds are listed for so many pairs, and compared for so many pairs of groups of one change."""


def priced(plan: RepairPlan, before: CheckedSystem, after: CheckedSystem, *, everything: bool) -> RepairPlan:
    """Return a plan with what its changes cost, as far as facts are stated.

    Args:
        plan: what was confirmed.
        before: the system without the changes.
        after: the system with them.
        everything: all costs of each change, and the bounds of each changed pair; else only what a change multiplies.
    """
    prices = _Prices(before, after)
    changes = tuple(replace(each, costs=tuple(prices.of(each, everything=everything))) for each in plan.changes)
    costs = tuple(prices.bounds(plan)) if everything else ()
    return replace(plan, changes=changes, costs=costs, grown=tuple(_grown_links(before, after)))


class _Prices:
    """Compares values with those that would be there without one change."""

    def __init__(self, before: CheckedSystem, after: CheckedSystem) -> None:
        self._old = {each.id: each for each in before.pipeline.endpoints}
        self._topics = after.pipeline.topics
        self._keys = grouped((each.id, key) for key, endpoints in self._topics.items() for each in endpoints)
        self._settled: dict[TopicKey, MatchedTopic] = {}

    def _topic(self, key: TopicKey) -> MatchedTopic:
        if key not in self._settled:
            self._settled[key] = settled(self._topics[key])
        return self._settled[key]

    def of(self, change: PlannedChange, *, everything: bool) -> Iterator[str]:
        """Yield what one change costs, topic by topic."""
        members = frozenset(change.members)
        for key in dict.fromkeys(key for member in change.members for key in self._keys.get(member, ())):
            topic, changing = _parted(self._topic(key), members)
            without = {id(each): self._without(each, change.policy) for each in changing}
            if not everything:
                yield from growth_in_words(topic, changing, without, {})
                continue
            memory, less = memory_of(changing, {}), memory_of(changing, without)
            if memory is not None and less is not None and memory.size != less.size:
                yield f"memory: {_most(memory.size)}, {_most(less.size)} without it"
            traffic, before = traffic_of(topic, {}), traffic_of(topic, without)
            if traffic is not None and before is not None and traffic != before:
                yield f"traffic of `{topic.shown}`: {rate_text(traffic.most)}, {rate_text(before.most)} without it"
            yield from dict.fromkeys(_bounds_changed(topic, without))

    def _without(self, group: EndpointGroup, policy: str) -> QosProfile:
        """Return the values of a group with that of one policy as before."""
        profile = group.profile
        old = self._old.get(group.first.id)
        values: dict[int, Value] = {}
        for index, each in enumerate(profile.pack.policies):
            if each.name == policy and old is not None and old.pack is profile.pack:
                value = old.profile.values[index]
                known = restated(profile.values, profile.pack.vocabulary, index, value) if is_plain(value) else None
                values |= {index: value} if known is None else known
        return profile.with_values(values)

    def bounds(self, plan: RepairPlan) -> Iterator[str]:
        """Yield what pairs of changed endpoints give."""
        members = {member for each in plan.changes for member in each.members}
        found: dict[tuple[str, str], str] = {}
        for key in dict.fromkeys(key for member in sorted(members) for key in self._keys.get(member, ())):
            topic = self._topic(key)
            for p, s in _pairs(topic):
                given = [
                    f"{each.word.name} {each.word.text(each.value)}"
                    for each in guarantees_of(p.profile, s.profile)
                    if each.value is not None and not each.nothing and each.word.kind != "holds"
                ]
                for one, other in ((a, b) for a in p.endpoints for b in s.endpoints):
                    if given and not members.isdisjoint((one.id, other.id)):
                        found[one.id, other.id] = f"from {one.id} to {other.id}: {', '.join(given)}"
        yield from [*found.values()][:_MOST_PAIRS]
        if len(found) > _MOST_PAIRS:
            yield f"and bounds of {plural(len(found) - _MOST_PAIRS, 'further pair')}"


def _most(size: int | None) -> str:
    return "no limit" if size is None else f"at most {size_text(size)}"


def _parted(topic: MatchedTopic, members: Collection[str]) -> tuple[MatchedTopic, list[EndpointGroup]]:
    """Return a topic in whose groups all endpoints are members or none, and the groups of members."""

    def parts(groups: list[EndpointGroup]) -> list[EndpointGroup]:
        return [
            group.only(part)
            for group in groups
            for wanted in (True, False)
            if (part := [each for each in group.endpoints if (each.id in members) is wanted])
        ]

    parted = replace(topic, publishers=parts(topic.publishers), subscribers=parts(topic.subscribers))
    groups = (*parted.publishers, *parted.subscribers)
    return parted, [each for each in groups if each.first.id in members]


def _pairs(topic: MatchedTopic) -> Iterator[tuple[EndpointGroup, EndpointGroup]]:
    for publisher in topic.publishers:
        for subscriber in topic.subscribers:
            if not failed_match_conditions(publisher.profile, subscriber.profile):
                yield publisher, subscriber


def _bounds_changed(topic: MatchedTopic, without: Mapping[int, QosProfile]) -> Iterator[str]:
    """Yield the bounds of guarantees that pairs have because of a change."""
    compared = 0
    for p, s in _pairs(topic):
        if id(p) not in without and id(s) not in without:
            continue
        compared += 1
        if compared > _MOST_PAIRS:
            return
        now = guarantees_of(p.profile, s.profile)
        then = guarantees_of(without.get(id(p), p.profile), without.get(id(s), s.profile))
        for each, was in zip(now, then, strict=True):
            if each.value not in {None, was.value} and each.word.kind != "holds":
                name, text = each.word.name, each.word.text
                yield f"{name}: {text(each.value)}, {text(was.value)} without it"


def _grown_links(before: CheckedSystem, after: CheckedSystem) -> Iterator[str]:
    """Yield the links whose load the changes multiply."""
    if not before.pipeline.system.links:
        return
    old = {(each.link.name, each.inward): each for each in budgets_of_system(before.pipeline).loads}
    for load in budgets_of_system(after.pipeline).loads:
        was = old.get((load.link.name, load.inward))
        now, then = load.certain, 0.0 if was is None else was.certain
        if now >= LEAST_FACTOR * then and now > 0:
            earlier = f"{rate_text(then)} before, {now / then:.3g} times as much" if then else "nothing before"
            where = f"{'to' if load.inward else 'from'} {', '.join(load.link.participants)}"
            yield f"link `{load.link.name}` {where}: {rate_text(now)} with the changes, {earlier}"
