"""What ROS 2 users agree on about well-known topics, in any namespace (REP 2003, tf2, rcl)."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Convention
from cqos_ros2.interfaces import WIRE

LATCHED: Final = {"latched": "true"}

# What nodes have without stating it, by the last part of its name.
PARAMETERS: Final = (
    "get_parameters",
    "set_parameters",
    "set_parameters_atomically",
    "list_parameters",
    "describe_parameters",
    "get_parameter_types",
)
LIFECYCLE: Final = (
    "change_state",
    "get_state",
    "get_available_states",
    "get_available_transitions",
    "get_transition_graph",
)


def served(name: str) -> str:
    """The pattern of the responses of a service, as they are called on the wire, of any node."""
    return WIRE["response"].key.format(f"/*/{name}")


CONVENTIONS: Final = (
    Convention("*/tf", doc="Moving transforms: keep_last 100, reliable, volatile on both sides."),
    Convention(
        "*/tf_static",
        {"latched": "true", "accumulated": "true"},
        doc="Fixed transforms: every broadcaster writes once, every listener needs them all.",
    ),
    Convention("*/map", LATCHED, doc="Maps are published and read reliable and transient_local."),
    Convention("*/map_metadata", LATCHED, doc="Published with the map."),
    Convention("*/costmap", LATCHED, doc="The full costmap; updates come on another topic."),
    Convention("*/robot_description", LATCHED, doc="The robot's model, written once at start."),
    Convention("/clock", external=True, doc="Comes from a simulator or a recording."),
    Convention("/rosout", external=True, doc="Every node's log, read by tools."),
    Convention("*/parameter_events", external=True, doc="Every node's parameter changes, read by tools."),
    Convention("*/diagnostics", external=True, doc="Read by an aggregator or by tools."),
    Convention("*/diagnostics_agg", external=True, doc="Read by tools."),
    Convention("*/initialpose", external=True, doc="Sent by a person from RViz."),
    Convention("*/goal_pose", external=True, doc="Sent by a person from RViz."),
    Convention("*/clicked_point", external=True, doc="Sent by a person from RViz."),
    Convention("*/transition_event", external=True, doc="Sent by every lifecycle node."),
    *(Convention(served(name), external=True, doc="Every node serves its parameters.") for name in PARAMETERS),
    *(Convention(served(name), external=True, doc="Every lifecycle node serves its state.") for name in LIFECYCLE),
)
