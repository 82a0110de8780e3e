"""What follows in the control flow of a design: which endpoints throw after a start or a catch, before the next catch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.flow import ControlFlow
    from cqos_core.model.system import System

_CATCHES: Final = ("catch", "start", "boundary")


def followers(system: System) -> Mapping[str, tuple[str, ...]]:
    """Return the endpoints that throw after each endpoint that catches; under the empty text those that throw first."""
    found: dict[str, dict[str, None]] = {}
    for flow in system.flows:
        after = grouped((ends.source, ends.target) for ends in flow.flows)
        for number, node in enumerate(flow.nodes):
            if node.kind not in _CATCHES or (node.kind != "start" and not node.endpoints):
                continue
            thrown = _thrown(number, after, flow)
            for name in node.endpoints or ("",):
                found.setdefault(name, {}).update(dict.fromkeys(thrown))
    return {name: tuple(each) for name, each in found.items()}


def _thrown(start: int, after: Mapping[int, list[int]], flow: ControlFlow) -> list[str]:
    """Return what throws on the ways from a node to the next catches, in the order of the flow."""
    found: list[str] = []
    waiting, seen = [*after.get(start, ())], {start}
    while waiting:
        number = waiting.pop(0)
        if number in seen:
            continue
        seen.add(number)
        node = flow.nodes[number]
        if node.kind in _CATCHES and (node.endpoints or node.triggers):
            continue
        if node.kind in {"throw", "end"}:
            found += node.endpoints
        waiting += after.get(number, ())
    return found
