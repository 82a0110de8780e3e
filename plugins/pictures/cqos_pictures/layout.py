"""Places of the nodes of a graph: in layers from left to right, with few crossings; after Sugiyama, Tagawa and Toda (1981)."""

from __future__ import annotations

import itertools
from bisect import bisect_left, insort
from collections.abc import Iterable, Mapping, Sequence
from graphlib import TopologicalSorter
from typing import Final, NamedTuple

from cqos_core.model.grouping import grouped

_SWEEPS: Final = 16
_NUDGES: Final = 12

Edge = tuple[int, int]


class Layout(NamedTuple):
    """Where nodes are: the layer of each from the left, its height (centre), and the heights of each edge in the layers between its ends."""

    layers: Sequence[int]
    heights: Sequence[float]
    bends: Mapping[Edge, Sequence[float]]


def layered(rooms: Sequence[float], edges: Iterable[Edge]) -> Layout:
    """Return places of nodes, which are numbers from 0; ``rooms`` has the height that each needs in its layer.

    Parts of the graph that nothing connects stand below each other, the largest first.
    """
    stated = list(dict.fromkeys(edge for edge in edges if edge[0] != edge[1]))
    layers, heights, bends = [0] * len(rooms), [0.0] * len(rooms), {}
    top = 0.0
    for part in _parts(len(rooms), stated):
        number = {node: index for index, node in enumerate(part)}
        own = {edge: (number[edge[0]], number[edge[1]]) for edge in stated if edge[0] in number}
        placed = _placed([rooms[node] for node in part], list(own.values()))
        spots = [(height, rooms[node] / 2) for node, height in zip(part, placed.heights, strict=True)]
        spots += [(height, 0.0) for inner in own.values() for height in placed.bends[inner]]
        down = top - min(height - room for height, room in spots)
        for node, index in number.items():
            layers[node], heights[node] = placed.layers[index], placed.heights[index] + down
        for edge, inner in own.items():
            bends[edge] = [height + down for height in placed.bends[inner]]
        top = down + max(height + room for height, room in spots)
    return Layout(layers, heights, bends)


def _parts(count: int, edges: Sequence[Edge]) -> list[list[int]]:
    """Return the nodes of each connected part."""
    root = list(range(count))

    def find(node: int) -> int:
        while root[node] != node:
            root[node] = node = root[root[node]]
        return node

    for source, target in edges:
        root[find(source)] = find(target)
    parts = grouped((find(node), node) for node in range(count))
    return sorted(parts.values(), key=lambda part: (-len(part), part))


def _placed(rooms: Sequence[float], stated: Sequence[Edge]) -> Layout:
    """Return places of the nodes of one connected part."""
    count, thin = len(rooms), min(rooms, default=0.0) / 3
    forward = _forward(count, stated)
    layers = _layers(count, forward.values())
    # An edge over several layers has a node without a size in each of them.
    chains: dict[Edge, list[int]] = {}
    rows: list[list[int]] = [[] for _ in range(max(layers, default=-1) + 1)]
    for node, layer in enumerate(layers):
        rows[layer].append(node)
    size = count
    for edge in stated:
        source, target = forward[edge]
        between = range(layers[source] + 1, layers[target])
        chains[edge] = [source, *range(size, size + len(between)), target]
        for number, layer in enumerate(between, size):
            rows[layer].append(number)
        size += len(between)
    links = [link for chain in chains.values() for link in itertools.pairwise(chain)]
    before, after = _neighbours(size, links)
    rows = _ordered(rows, before, after)
    heights = _heights(rows, before, after, [*rooms, *[thin] * (size - count)])
    bends = {
        edge: [heights[node] for node in (chain if forward[edge] == edge else chain[::-1])[1:-1]]
        for edge, chain in chains.items()
    }
    return Layout(layers, heights[:count], bends)


def _forward(count: int, edges: Sequence[Edge]) -> dict[Edge, Edge]:
    """Return each edge, turned round where the graph would have a cycle otherwise (Eades, Lin and Smyth 1993)."""
    before, after = ([set(each) for each in side] for side in _neighbours(count, edges))
    left, right, rest = [], [], set(range(count))
    while rest:
        chosen = min((each for each in rest if not after[each]), default=None)
        if chosen is not None:
            right.append(chosen)
        else:
            # A source has nothing before it, so it is the best of all.
            chosen = max(rest, key=lambda each: (not before[each], len(after[each]) - len(before[each]), -each))
            left.append(chosen)
        rest.discard(chosen)
        for each in after[chosen]:
            before[each].discard(chosen)
        for each in before[chosen]:
            after[each].discard(chosen)
    place = {node: number for number, node in enumerate([*left, *reversed(right)])}
    return {edge: edge if place[edge[0]] < place[edge[1]] else edge[::-1] for edge in edges}


def _layers(count: int, edges: Iterable[Edge]) -> list[int]:
    """Put each node behind all before it, and what nothing leads to directly before what it leads to."""
    before, after = _neighbours(count, edges)
    layers = [0] * count
    for node in TopologicalSorter(dict(enumerate(before))).static_order():
        layers[node] = max((layers[source] + 1 for source in before[node]), default=0)
    for node in range(count):
        if not before[node]:
            layers[node] = min((layers[target] for target in after[node]), default=1) - 1
    return layers


def _neighbours(count: int, edges: Iterable[Edge]) -> tuple[list[list[int]], list[list[int]]]:
    """Return by node those before it and those after it."""
    before: list[list[int]] = [[] for _ in range(count)]
    after: list[list[int]] = [[] for _ in range(count)]
    for source, target in edges:
        before[target].append(source)
        after[source].append(target)
    return before, after


def _ordered(rows: list[list[int]], before: Sequence[list[int]], after: Sequence[list[int]]) -> list[list[int]]:
    """Order each row by the middle of the neighbours, there and back, and return the order with the fewest crossings."""
    best, fewest = [list(row) for row in rows], _crossings(rows, after)
    for sweep in range(_SWEEPS):
        if not fewest:
            break
        down = sweep % 2 == 0
        neighbours = before if down else after
        for row in rows if down else reversed(rows):
            place = {node: number for other in rows for number, node in enumerate(other)}
            middle = {
                node: sum(place[each] for each in neighbours[node]) / len(neighbours[node])
                if neighbours[node]
                else place[node]
                for node in row
            }
            row.sort(key=middle.__getitem__)
        crossings = _crossings(rows, after)
        if crossings < fewest:
            best, fewest = [list(row) for row in rows], crossings
    return best


def _crossings(rows: Sequence[Sequence[int]], after: Sequence[Sequence[int]]) -> int:
    found = 0
    for row, following in itertools.pairwise(rows):
        place = {node: number for number, node in enumerate(following)}
        ends: list[int] = []
        for node in row:
            targets = sorted(place[each] for each in after[node])
            found += sum(len(ends) - bisect_left(ends, target + 1) for target in targets)
            for target in targets:
                insort(ends, target)
    return found


def _heights(
    rows: Sequence[Sequence[int]], before: Sequence[list[int]], after: Sequence[list[int]], room: Sequence[float]
) -> list[float]:
    """Move nodes towards the middle of their neighbours, as far as those beside them in their row let them."""
    heights = [0.0] * len(room)
    for row in rows:
        _spread(row, [0.0] * len(row), room, heights)
    for nudge in range(_NUDGES):
        for row in rows if nudge % 2 == 0 else reversed(rows):
            wanted = []
            for node in row:
                beside = [heights[each] for each in (*before[node], *after[node])]
                wanted.append(sum(beside) / len(beside) if beside else heights[node])
            _spread(row, wanted, room, heights)
    lowest = min((heights[node] for row in rows for node in row), default=0.0)
    return [each - lowest for each in heights]


def _spread(row: Sequence[int], wanted: Sequence[float], room: Sequence[float], heights: list[float]) -> None:
    """Place a row as near to the wanted heights as the distances allow: least squares, by pooling neighbours that collide."""
    offsets = [0.0]
    for one, other in itertools.pairwise(row):
        offsets.append(offsets[-1] + (room[one] + room[other]) / 2)
    pools: list[tuple[float, int]] = []  # sum and number of what is at one place
    for want, offset in zip(wanted, offsets, strict=False):
        pools.append((want - offset, 1))
        while len(pools) > 1 and pools[-2][0] / pools[-2][1] > pools[-1][0] / pools[-1][1]:
            last, (total, number) = pools.pop(), pools.pop()
            pools.append((total + last[0], number + last[1]))
    placed = [total / number for total, number in pools for _ in range(number)]
    for node, place, offset in zip(row, placed, offsets, strict=False):
        heights[node] = place + offset
