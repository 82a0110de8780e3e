"""Strongly connected components of a graph, and the least time of a turn through each node of one."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Final

from cqos_core.behaviour.least_wait_times import shortest_times

_DEEPEST: Final = 12
"""The most nested loops in one node; deeper ones count as unknown."""


def components(nodes: Iterable[int], depends: Callable[[int], Iterable[int]]) -> list[list[int]]:
    """Return the strongly connected components, each after all that it depends on (Tarjan 1972, without recursion)."""
    number: dict[int, int] = {}
    low: dict[int, int] = {}
    on_stack: set[int] = set()
    stack: list[int] = []
    found: list[list[int]] = []
    for root in nodes:
        if root in number:
            continue
        work: list[tuple[int, Iterator[int]]] = [(root, iter(depends(root)))]
        number[root] = low[root] = len(number)
        stack.append(root)
        on_stack.add(root)
        while work:
            at, rest = work[-1]
            for other in rest:
                if other not in number:
                    number[other] = low[other] = len(number)
                    stack.append(other)
                    on_stack.add(other)
                    work.append((other, iter(depends(other))))
                    break
                if other in on_stack:
                    low[at] = min(low[at], number[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[at])
                if low[at] == number[at]:
                    group = _cut(stack, at)
                    on_stack.difference_update(group)
                    found.append(group)
    return found


def _cut(stack: list[int], at: int) -> list[int]:
    """Take everything from ``at`` on off the stack."""
    group = []
    while True:
        group.append(stack.pop())
        if group[-1] == at:
            return group


def turns(group: Collection[int], steps: Callable[[int], Iterable[tuple[int, int]]]) -> dict[int, int]:
    """Return for each node of a component the least time from it back to it; 0 where that is not known.

    A turn through a node goes through some other one, the hub, or stays in the part of the component without it.
    """
    found: dict[int, int] = {}
    parts = [(frozenset(group), 0)]
    while parts:
        part, depth = parts.pop()
        if depth > _DEEPEST:
            found.update(dict.fromkeys(part, 0))
            continue
        inside = {at: [step for step in steps(at) if step[0] in part] for at in part}
        hub = max(sorted(part), key=lambda at: len(inside[at]))
        for at, time in _through(hub, inside).items():
            found[at] = min(time, found.get(at, time))
        del inside[hub]
        rest = {at: [each for each, _ in inside[at] if each != hub] for at in inside}
        inner = components(rest, rest.__getitem__)
        parts += [(frozenset(each), depth + 1) for each in inner if len(each) > 1 or each[0] in rest[each[0]]]
    return found


def _through(hub: int, steps: Mapping[int, Sequence[tuple[int, int]]]) -> dict[int, int]:
    """Return the least time of a turn through a hub and each node."""
    reverse: dict[int, list[tuple[int, int]]] = {at: [] for at in steps}
    for at, following in steps.items():
        for other, time in following:
            reverse[other].append((at, time))
    there, back = shortest_times([hub], steps.__getitem__), shortest_times([hub], reverse.__getitem__)
    turn = min((there[at] + time for at, time in reverse[hub] if at in there), default=0)
    # Other nodes depend on the hub without a token going round: their time is unknown.
    both = {at: there[at] + back[at] if at in there and at in back else 0 for at in steps}
    return both | {hub: turn}
