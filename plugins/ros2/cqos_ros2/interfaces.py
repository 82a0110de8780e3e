"""Services and actions are made of topics; here they are taken apart, so that the rules see topics only."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

from cqos_core.model.settings import Setting
from cqos_core.model.system import Endpoint, ProfileRef, Role
from cqos_ros2.types import full_type_name


class Part(NamedTuple):
    """One topic of a service or an action.

    Attributes:
        name: what is added to the endpoint's id, and its kind.
        server: what the server does on this topic; the client does the opposite.
        preset: the profile ROS 2 gives it.
        type: its message type, ``{}`` being that of the service or action.
        key: its name on the wire, ``{}`` being the full name of the service or action.
        shown: its name in messages.
        speaks: represents the whole in findings about all parts: an illegal name, or a missing partner.
        interface: ``service``, or ``action`` for the plain topics of an action.
    """

    name: str
    server: Role
    preset: str
    type: str
    key: str
    shown: str
    speaks: bool = False
    interface: str = "service"


def _service(step: str, type_name: str, path: str = "") -> tuple[Part, Part]:
    """Return the request and the response of a service, which may be one ``step`` of an action."""
    prefix, label = (f"{step}_", f"{step} ") if step else ("", "")
    return (
        Part(
            f"{prefix}request",
            "subscriber",
            "services_default",
            f"{type_name}_Request",
            f"rq{{}}{path}Request",
            f"{{}} ({label}request)",
        ),
        Part(
            f"{prefix}response",
            "publisher",
            "services_default",
            f"{type_name}_Response",
            f"rr{{}}{path}Reply",
            f"{{}} ({label}response)",
            speaks=step in {"", "send_goal"},
        ),
    )


# The parts of both, from the server's point of view (design.ros2.org, topic and service names; actions).
SERVICE: Final = _service("", "{}")
ACTION: Final = (
    *_service("send_goal", "{}_SendGoal", "/_action/send_goal"),
    *_service("cancel_goal", "action_msgs/srv/CancelGoal", "/_action/cancel_goal"),
    *_service("get_result", "{}_GetResult", "/_action/get_result"),
    Part(
        "feedback",
        "publisher",
        "default",
        "{}_FeedbackMessage",
        "{}/_action/feedback",
        "{}/_action/feedback",
        interface="action",
    ),
    Part(
        "status",
        "publisher",
        "action_status_default",
        "action_msgs/msg/GoalStatusArray",
        "{}/_action/status",
        "{}/_action/status",
        interface="action",
    ),
)
WIRE: Final = {part.name: part for part in (*SERVICE, *ACTION)}

_MADE_OF: Final = {
    "service_server": SERVICE,
    "service_client": SERVICE,
    "action_server": ACTION,
    "action_client": ACTION,
}
_OPPOSITE: Final[dict[Role, Role]] = {"publisher": "subscriber", "subscriber": "publisher"}


def expand(endpoint: Endpoint) -> tuple[Endpoint, ...]:
    """Return what an endpoint stands for: itself, or the endpoints of its service or action."""
    parts = _MADE_OF.get(endpoint.kind)
    if parts is None:
        return (endpoint,)
    family, _, side = endpoint.kind.partition("_")
    stated = None if endpoint.type is None else full_type_name(endpoint.type, "srv" if family == "service" else family)
    return tuple(_part(endpoint, part, side, stated) for part in parts)


def _part(endpoint: Endpoint, part: Part, side: str, stated: str | None) -> Endpoint:
    return replace(
        endpoint,
        id=f"{endpoint.id}/{part.name}",
        role=part.server if side == "server" else _OPPOSITE[part.server],
        kind=part.name,
        profiles=(ProfileRef(part.preset, endpoint.place), *endpoint.profiles),
        settings={**endpoint.settings, "interface": Setting(part.interface, endpoint.place, derived=True)},
        type=None if stated is None else part.type.format(stated),
        # A missing partner is one finding, not eight.
        external=endpoint.external or not part.speaks,
    )
