"""Parameters `qos_overrides` of one node, and which endpoints accept them (rclcpp: qos_parameters.hpp)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.system import Role
    from cqos_ros2_workspace.nodes.endpoint_templates import Filled, Parameter

PREFIX: Final = "qos_overrides."
_ROLES: Final[dict[str, Role]] = {"publisher": PUBLISHER, "subscription": SUBSCRIBER}
_DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")


@dataclass(slots=True)
class Override:
    """One parameter.

    Attributes:
        name: the whole name of the parameter.
        topic: as written in it; names are resolved ones.
        role: None where it names neither side.
        used: an endpoint accepts it.
    """

    name: str
    topic: str
    role: Role | None
    identity: str
    policy: str
    text: str
    place: Place | None
    used: bool = False

    def setting(self, endpoint: Filled, role: Role, full: str) -> Setting | None:
        """Return what it sets on an endpoint with this full name; None where the endpoint does not take it."""
        if endpoint.direction not in {"publishes", "subscribes"} or (self.topic, self.role) != (full, role):
            return None
        if endpoint.overridable_unknown:
            cause = f"whether `{self.name[:120]}` sets it is not known: {endpoint.overridable_unknown}"
            return Setting("", self.place, cause)
        taken = not self.identity and self.policy in endpoint.overridable
        return Setting(self.text, self.place, derived=True) if taken else None


def overrides_of(parameters: Mapping[str, Parameter]) -> list[Override]:
    """Return the overrides among the parameters of a node."""
    found = []
    for name, parameter in parameters.items():
        if not name.startswith(PREFIX):
            continue
        topic, _, rest = name.removeprefix(PREFIX).partition(".")
        side, _, policy = rest.partition(".")
        kind, _, identity = side.partition("_")
        text = _text(parameter.value, policy)
        found.append(Override(name, topic, _ROLES.get(kind), identity, policy, text, parameter.place))
    return found


def _text(value: Any, policy: str) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if policy in _DURATIONS and isinstance(value, int):
        return f"{value}ns"
    return str(value) if isinstance(value, (str, int, float)) else ""
