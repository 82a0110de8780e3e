"""Who on one topic is connected over bridges, though the two never meet: what keeps them apart is no loss."""

from __future__ import annotations

from functools import reduce
from operator import and_
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from cqos_core.pairing import Topic


def connected(topic: Topic, met: Sequence[int]) -> list[int]:
    """Return per publisher group the subscriber groups that lose nothing by not meeting it, as bits.

    They get over bridges what it publishes, or from elsewhere all that it, as the end of a bridge, publishes anew.

    Args:
        topic: whose groups they are.
        met: per publisher group the subscriber groups that it meets, as bits.
    """
    behind = _behind(topic)
    if not behind:
        return [0] * len(met)
    reached = [_closure(mask, behind, met) for mask in met]
    found = [*reached]
    for index, mask in enumerate(met):
        origins = _origins(index, topic, behind, met) - {index}
        if mask and origins:
            found[index] |= reduce(and_, (reached[origin] for origin in origins))
    return found


def _behind(topic: Topic) -> dict[int, set[int]]:
    """Per subscriber group that ends of bridges are in, the publisher groups that their other ends are in."""
    ends = {
        endpoint.bridge: index
        for index, members in enumerate(topic.publishers)
        for endpoint in members.endpoints
        if endpoint.bridge is not None
    }
    found: dict[int, set[int]] = {}
    for index, members in enumerate(topic.subscribers if ends else ()):
        for endpoint in members.endpoints:
            if endpoint.bridge in ends:
                found.setdefault(index, set()).add(ends[endpoint.bridge])
    return found


def _closure(mask: int, behind: Mapping[int, Iterable[int]], met: Sequence[int]) -> int:
    """The subscriber groups that are reached from those of ``mask``, with these."""
    waiting = [index for index in behind if mask >> index & 1]
    while waiting:
        for publisher in behind[waiting.pop()]:
            new = met[publisher] & ~mask
            waiting += [index for index in behind if new >> index & 1]
            mask |= new
    return mask


def _origins(publisher: int, topic: Topic, behind: Mapping[int, Collection[int]], met: Sequence[int]) -> set[int]:
    """The publisher groups of whom all comes that a group publishes; one is its own where it is more than ends of bridges."""
    here = {endpoint.bridge for source in behind for endpoint in topic.subscribers[source].endpoints}
    found: set[int] = set()
    seen: set[int] = set()
    waiting = [publisher]
    while waiting:
        index = waiting.pop()
        if index in seen:
            continue
        seen.add(index)
        if all(endpoint.bridge and endpoint.bridge in here for endpoint in topic.publishers[index].endpoints):
            sources = sum(1 << source for source, publishers in behind.items() if index in publishers)
            waiting += [before for before, mask in enumerate(met) if mask & sources]
        else:
            found.add(index)
    return found
