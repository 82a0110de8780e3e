"""The nodes of a launch of which not everything is known, each once, as parts of its coverage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.system import Part, numbered
from cqos_ros2_workspace.distro_consensus import OPEN
from cqos_ros2_workspace.launch.launch_output import full_name
from cqos_ros2_workspace.nodes.endpoint_templates import MISSPELT
from cqos_ros2_workspace.nodes.version_fit import ANOTHER

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_ros2_workspace.launch.launch_result import Instance
    from cqos_ros2_workspace.system_join import Join, JoinedNode

NODE: Final = "node"
UNDECIDED: Final = "whether it starts depends on"
"""How the cause begins of a node that is known, and whose start conditions decide."""
_BY_DISTRIBUTION: Final = "some of its endpoints depend on the ROS 2 distribution"


def unread_nodes(found: Join) -> list[Part]:
    """Return the nodes that are not known, then those of which something is."""
    numbers: dict[str, int] = {}
    unknown = [
        *[(each.placed.instance, each.placed.cause) for each in found.nodes if _is_unknown(each)],
        *[(instance, cause.cause) for instance, cause in found.placing.unknown],
        *[(instance, "it starts on an event of the launch") for instance in found.placing.later],
        *[(instance, _condition(instance)) for instance in found.placing.undecided],
    ]
    parts = [Part(NODE, numbered(full_name(each), numbers), cause, each.place) for each, cause in unknown]
    for node in found.nodes:
        causes = [] if _is_unknown(node) else [*dict.fromkeys(_gaps(node))]
        if causes:
            parts.append(Part("partly known node", node.placed.address, "; ".join(causes), node.placed.place))
    return parts


def number_of_nodes(found: Join) -> int:
    """Return how many nodes the launch starts, or may start."""
    placing = found.placing
    return len(found.nodes) + len(placing.unknown) + len(placing.later) + len(placing.undecided)


def _is_unknown(node: JoinedNode) -> bool:
    return node.placed.facts is None and not node.endpoints


def _condition(instance: Instance) -> str:
    subjects = dict.fromkeys(f"`{guard.subject}`" for guard in instance.guards)
    return f"{UNDECIDED} {' and '.join(subjects)}"


def _gaps(node: JoinedNode) -> Iterator[str]:
    for gap in node.filled.gaps:
        if gap.subject == OPEN:
            yield _BY_DISTRIBUTION
        elif gap.subject not in {MISSPELT, ANOTHER}:
            yield gap.cause
    for _, named, _ in node.endpoints:
        if not isinstance(named.full, str):
            yield f"a name is not known: {named.full.cause}"
