"""Which lifecycle nodes of a launch are activated: by a lifecycle manager, by an event of the launch, or by nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from cqos_ros2.names import expand
from cqos_ros2_workspace.node_places import started

if TYPE_CHECKING:
    from cqos_ros2_workspace.system_join import Join, JoinedNode


class Activation(NamedTuple):
    """What activates the lifecycle nodes of a launch.

    Attributes:
        managers: nodes that activate others, by the full names of these.
        lists_known: whether it is known which nodes they activate.
        others: whether something else of the launch may activate nodes: an event, or what is not known of it.
    """

    managers: list[tuple[JoinedNode, dict[str, str]]]
    lists_known: bool
    others: bool

    @property
    def managed(self) -> set[str]:
        """The full names of the nodes that managers activate."""
        return {address for _, names in self.managers for address in names}

    def leaves_out(self, node: JoinedNode) -> bool:
        """Whether nothing activates a lifecycle node; a node that a program brings may also activate itself."""
        placed = node.placed
        if placed.depth or not node.filled.lifecycle or placed.address in self.managed or not self.lists_known:
            return False
        return not self.others and placed.file is not None and not placed.file.sources


def activation(found: Join) -> Activation:
    """Return what activates the lifecycle nodes of a launch."""
    managers = []
    lists_known = True
    for node in found.nodes:
        activates, placed = node.filled.activates, node.placed
        if activates is None:
            continue
        names = activates.value if isinstance(activates.value, (list, tuple)) else None
        lists_known = lists_known and names is not None
        managers.append((node, {expand(str(name), placed.namespace, placed.name): str(name) for name in names or ()}))
    launched = found.launched
    placing = found.placing
    unknown = placing.unknown or placing.undecided or placing.later or any(node.opaque for node in found.nodes)
    processes = any(started(each) is None for each in launched.instances)
    return Activation(managers, lists_known, bool(launched.emits or launched.remarks or unknown or processes))
