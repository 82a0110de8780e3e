"""Facts on which the distributions agree, for a system that states no distribution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.nodes.endpoint_templates import VERBS, Filled, FilledNode

Key = tuple[str, str, bool, str]
OPEN: Final = "the ROS 2 distribution"
"""The subject of what only the distribution decides."""


def agreed(found: Mapping[str, FilledNode]) -> FilledNode:
    """Return what holds in every distribution; what only some have is a gap."""
    first = next(iter(found.values()))
    if len(found) == 1:
        return first
    every = found.values()
    starts = [node.at_start for node in every]
    at_start = (
        starts[0] if all(each == starts[0] for each in starts) else Unknown("it depends on the ROS 2 distribution")
    )
    result = FilledNode(activates=first.activates, at_start=at_start, lifecycle=all(node.lifecycle for node in every))
    result.notes += dict.fromkeys(each for node in every for each in node.notes)
    sides = {distro: _by_key(node.endpoints) for distro, node in found.items()}
    for key in dict.fromkeys(key for side in sides.values() for key in side):
        there = [distro for distro, side in sides.items() if key in side]
        each = sides[there[0]][key]
        if len(there) < len(found):
            cause = f"whether it {VERBS[each.direction]} `{key[1][:80]}`: only {' and '.join(there)} has it"
            result.gaps.append(Unknown(cause, each.place, OPEN))
        else:
            result.endpoints.append(_common([side[key] for side in sides.values()], list(found)))
    gaps = {(each.cause, each.place): each for node in found.values() for each in node.gaps}
    result.gaps += gaps.values()
    inside = dict.fromkeys(each for node in found.values() for each in node.inside)
    result.inside += [each for each in inside if all(each in node.inside for node in found.values())]
    return result


def _by_key(endpoints: Sequence[Filled]) -> dict[Key, Filled]:
    found: dict[Key, Filled] = {}
    for each in endpoints:
        name = each.name if isinstance(each.name, str) else f"?{each.name}"
        number = 0
        while (key := (each.direction, name, each.own_node, str(number))) in found:
            number += 1
        found[key] = each
    return found


def _common(alike: Sequence[Filled], distros: Sequence[str]) -> Filled:
    """Return one endpoint with what all agree on; other policies are unknown."""
    first = alike[0]
    said = [(each.preset, {name: (s.text, s.unknown) for name, s in each.settings.items()}) for each in alike]
    settings, preset = first.settings, first.preset
    if any(each != said[0] for each in said):
        cause = f"it differs between {' and '.join(distros)}, and the ROS 2 distribution is not stated"
        settings, preset = {EVERY_OTHER: Setting("", first.place, cause)}, ""
    same_type = all(each.type == first.type for each in alike)
    accepted = set.intersection(*(set(each.overridable) for each in alike))
    return replace(
        first,
        settings=settings,
        preset=preset,
        type=first.type if same_type else "",
        overridable=tuple(name for name in first.overridable if name in accepted),
        overridable_unknown=next((each.overridable_unknown for each in alike if each.overridable_unknown), ""),
        optional=any(each.optional for each in alike),
    )
