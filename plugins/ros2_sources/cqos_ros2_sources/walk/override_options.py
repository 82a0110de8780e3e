"""Policies that `qos_overrides` may set: the options of a call that allow it. Source: rclcpp, qos_overriding_options.hpp."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.walk.expressions import elsewhere
from cqos_ros2_sources.walk.values import MISSING, Instance, Overriding, Word
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.nodes.form import OVERRIDABLE_POLICIES

if TYPE_CHECKING:
    from cqos_ros2_sources.walk.call_tables import Row
    from cqos_ros2_sources.walk.endpoint_calls import Given
    from cqos_ros2_sources.walk.frames import Walk

_MEMBER: Final = "qos_overriding_options"
_DEFAULT: Final = ("history", "depth", "reliability")
_CLASSES: Final = frozenset(("QosOverridingOptions", "QoSOverridingOptions"))
_IDENTITY: Final = Overriding((), "an id of its options names the parameters")
_IDENTITY_AT: Final = 2


def overriding_of(name: str, given: Given) -> Overriding | None:
    """Return what a call of a library opens to overrides; None where it makes nothing of that kind."""
    last = last_part(name)
    values = [*given.arguments]
    if last == "with_default_policies":
        found = Overriding(_DEFAULT)
        values.insert(0, found)
    elif last in _CLASSES:
        first = given.keywords.get("policy_kinds", values[0] if values else [])
        listed = isinstance(first, list)
        found = _of_kinds(first if listed or not values else values)
        values = values if listed else []
    else:
        return None
    identity = given.keywords.get("entity_id", values[_IDENTITY_AT] if len(values) > _IDENTITY_AT else None)
    return found if identity in {None, ""} else _IDENTITY


def _of_kinds(values: Any) -> Overriding:
    """Return what a list of kinds of policies opens."""
    found = []
    for each in values:
        text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", last_part(each.name)).lower() if isinstance(each, Word) else ""
        if text not in OVERRIDABLE_POLICIES:
            return Overriding((), each.cause if isinstance(each, Unknown) else "a kind of policy is not known")
        found.append(text)
    return Overriding(tuple(found))


def stated(row: Row, given: Given, walk: Walk) -> Overriding:
    """Return what `qos_overrides` may set: what the row says, or the options that the call is given."""
    position = row.position("options")
    value = given.at(position)
    if isinstance(value, Instance):
        other = elsewhere(given.expression(position), _MEMBER, walk)
        absent = Unknown("its options are not followed") if value.cls is not None else MISSING
        value = Unknown(other) if other else value.members.get(_MEMBER, value.members.get("*", absent))
    if isinstance(value, list):
        return _of_kinds(value)
    if isinstance(value, Overriding):
        return value
    if value is MISSING or value is None:
        return Overriding(tuple(row.values.get("overridable", ())))
    return Overriding((), value.cause if isinstance(value, Unknown) else "parameters decide about its options")
