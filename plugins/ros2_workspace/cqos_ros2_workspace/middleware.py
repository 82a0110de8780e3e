"""Variables of the environment by which a launch configures the middleware, and what these may decide."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.importers.source_reading import listed
from cqos_core.model.finding import plural
from cqos_ros2.importers.workspace_codes import note
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.system import ImportNote
    from cqos_ros2_workspace.system_join import Join, JoinedNode


class _Configured(NamedTuple):
    """What a variable configures: names of `RMW_IMPLEMENTATION` begin with ``middleware``; empty for all."""

    middleware: str
    decides: str


_ZENOH: Final = _Configured(
    "rmw_zenoh",
    "mode, endpoints and scouting decide who connects; namespace, access_control, downsampling, low_pass_filter and qos decide what arrives",
)
_FAST: Final = _Configured(
    "rmw_fastrtps", "transports and discovery decide who connects; profiles decide the quality of service of topics"
)
_WHO: Final = _Configured("", "it decides who discovers whom")
VARIABLES: Final = {
    "ZENOH_SESSION_CONFIG_URI": _ZENOH,
    "ZENOH_CONFIG_OVERRIDE": _ZENOH,
    "CYCLONEDDS_URI": _Configured("rmw_cyclonedds", "interfaces, peers and discovery decide who connects"),
    "FASTRTPS_DEFAULT_PROFILES_FILE": _FAST,
    "FASTDDS_DEFAULT_PROFILES_FILE": _FAST,
    "NDDS_QOS_PROFILES": _Configured("rmw_connext", "profiles decide the quality of service and who connects"),
    "ROS_DISCOVERY_SERVER": _Configured("rmw_fastrtps", _WHO.decides),
    "ROS_AUTOMATIC_DISCOVERY_RANGE": _WHO,
    "ROS_STATIC_PEERS": _WHO,
    "ROS_LOCALHOST_ONLY": _WHO,
}
_CHOICE: Final = "RMW_IMPLEMENTATION"
_NAMED: Final = 3


def unread_configurations(found: Join) -> Iterator[ImportNote]:
    """Yield each value of such a variable with the nodes that have it: the join reads none of them."""
    nodes: dict[tuple[str, str | None], list[JoinedNode]] = {}
    for node in found.nodes:
        environment = node.placed.instance.environment
        chosen = environment.get(_CHOICE)
        for name, configured in VARIABLES.items():
            value = environment.get(name)
            elsewhere = isinstance(chosen, str) and not chosen.startswith(configured.middleware)
            if value and not elsewhere:
                nodes.setdefault((name, None if isinstance(value, Unknown) else str(value)), []).append(node)
    for (name, text), having in nodes.items():
        names = [f"`{each.placed.address}`" for each in having[:_NAMED]]
        more = [plural(len(having) - _NAMED, "more node")] if len(having) > _NAMED else []
        value_said = "to a value that is not known" if text is None else f"to `{text}`"
        message = (
            f"the launch sets `{name}` {value_said} for {listed([*names, *more], 'and')}, and C-QoS does not read it: "
            f"{VARIABLES[name].decides}"
        )
        yield note("ROS982", message, having[0].placed.place)
