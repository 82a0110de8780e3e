"""Find endpoint pairs of a topic that are connected only over bridges, so that their mismatch loses nothing."""

from __future__ import annotations

from functools import reduce
from operator import and_, or_
from typing import TYPE_CHECKING

from cqos_core.behaviour.components import components
from cqos_core.language.relation import positions

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from cqos_core.matching.topic_groups import MatchedTopic


def connected_over_bridges(topic: MatchedTopic, met: Sequence[int]) -> list[int]:
    """Return for each publisher group, as bits, the subscriber groups that get its samples over bridges.

    A subscriber group also counts if it gets from elsewhere all samples that the publisher, the end of a bridge, repeats.

    Args:
        topic: the topic of the groups.
        met: for each publisher group, as bits, the subscriber groups that match it.
    """
    behind = _behind(topic)
    if not behind:
        return [0] * len(met)
    ends = sum(1 << index for index in behind)
    after = [{publisher for index in positions(mask & ends) for publisher in behind[index]} for mask in met]
    reached = [*met]
    for component in components(range(len(met)), after.__getitem__):
        whole = 0
        for index in component:
            whole = reduce(or_, (reached[each] for each in after[index]), whole | reached[index])
        for index in component:
            reached[index] = whole
    common = _reached_by_all_origins(topic, behind, after, reached)
    return [mask | common.get(index, 0) if met[index] else mask for index, mask in enumerate(reached)]


def _reached_by_all_origins(
    topic: MatchedTopic,
    behind: Mapping[int, Collection[int]],
    after: Sequence[AbstractSet[int]],
    reached: Sequence[int],
) -> dict[int, int]:
    """Return for each publisher group with ends of bridges only, as bits, what all its sources reach."""
    here = {endpoint.bridge for source in behind for endpoint in topic.subscribers[source].endpoints}
    relays = {
        index
        for index, members in enumerate(topic.publishers)
        if all(endpoint.bridge and endpoint.bridge in here for endpoint in members.endpoints)
    }
    before: dict[int, list[int]] = {index: [] for index in relays}
    for index, publishers in enumerate(after):
        for publisher in publishers & relays:
            before[publisher].append(index)
    found: dict[int, int] = {}
    for component in components(relays, lambda index: [each for each in before[index] if each in relays]):
        origins = [
            reached[each] if each not in relays else found[each]
            for index in component
            for each in before[index]
            if each not in relays or each in found
        ]
        if origins:
            found.update(dict.fromkeys(component, reduce(and_, origins)))
    return found


def _behind(topic: MatchedTopic) -> dict[int, set[int]]:
    """Return for each subscriber group with ends of bridges the publisher groups of their other ends."""
    ends = {
        endpoint.bridge: index
        for index, members in enumerate(topic.publishers)
        for endpoint in members.endpoints
        if endpoint.bridge is not None
    }
    met = (
        (index, {ends[endpoint.bridge] for endpoint in members.endpoints if endpoint.bridge in ends})
        for index, members in enumerate(topic.subscribers if ends else ())
    )
    return {index: others for index, others in met if others}
