"""Edits that set a policy of endpoints: at the place of its value, or where it can be added."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.language.policy import BROKER, ENDPOINT, NEED, TOPIC
from cqos_core.model.finding import Edit
from cqos_core.resolving.dialect_spelling import dialect_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain
    from cqos_core.model.settings import Setting
    from cqos_core.model.system import Broker, Endpoint, Participant, Room
    from cqos_core.packs.presets import Dialect
    from cqos_core.resolving.layers import Layer, Stated
    from cqos_core.resolving.resolved_endpoint import Resolved


def edits_of(endpoints: Iterable[Resolved], index: int, value: Plain) -> tuple[Edit, ...]:
    """Return the edits after which each endpoint has a value; nothing where one of them cannot be edited."""
    found: dict[Edit, None] = {}
    for endpoint in endpoints:
        edit = _edit(endpoint, index, value)
        if edit is None:
            return ()
        found[edit] = None
    return tuple(found)


def profile_edit(endpoint: Resolved, index: int, value: Plain) -> Edit | None:
    """Return the edit of the profile that an endpoint takes a value from; None where it takes it from elsewhere."""
    policy = endpoint.pack.policies[index]
    if endpoint.endpoint.observed or endpoint.wire_origin is not None or policy.level != ENDPOINT:
        return None
    layer = next((each for each in endpoint.layers if index in each.settings), None)
    if layer is None or not layer.origin.startswith("profile "):
        return None
    return _replacing(endpoint, policy, layer, layer.settings[index], value)


def _edit(endpoint: Resolved, index: int, value: Plain) -> Edit | None:
    """Return the edit of one endpoint.

    Observed endpoints are no design, and copies on a wire are edited under the names of their own protocol.
    """
    policy = endpoint.pack.policies[index]
    if (endpoint.endpoint.observed and policy.level != BROKER) or endpoint.wire_origin is not None:
        return None
    layers = endpoint.layers if policy.level in {ENDPOINT, NEED, TOPIC} else endpoint.participant.layers
    at = next((number for number, each in enumerate(layers) if index in each.settings), len(layers))
    layer = layers[at] if at < len(layers) else None
    if policy.level == NEED:
        if layer is None:
            return None
        needed = layer.settings[index]
        return _changed(policy, needed.name, _own(endpoint, layer, needed) or needed.setting, None, value)
    if (edit := _restated(endpoint, policy, layers[: at + 1], value)) is not None:
        return edit
    if layer is not None and (
        layer.here or layer.overlay != "no" or (policy.level != ENDPOINT and layer.origin in {"explicit", "topic"})
    ):
        stated = layer.settings[index]
        edit = _replacing(endpoint, policy, layer, stated, value)
        if edit is not None or not stated.setting.derived:
            return edit
    edit = _added(endpoint, policy, index, layers[: at + 1], value)
    if edit is None and layer is not None and layer.origin.startswith("profile "):
        # Where the endpoint has no room, its profile states the value for it.
        edit = _replacing(endpoint, policy, layer, layer.settings[index], value)
    return edit


def _owner(endpoint: Resolved, policy: Policy) -> Endpoint | Participant | Broker | None:
    """Return the owner of a policy; None for topics, which several files describe."""
    if policy.level == TOPIC:
        return None
    if policy.level == BROKER:
        return endpoint.participant.broker
    return endpoint.endpoint if policy.level == ENDPOINT else endpoint.participant.participant


def _restated(endpoint: Resolved, policy: Policy, layers: Sequence[Layer], value: Plain) -> Edit | None:
    """Return the edit that states a value in a room whose inserter replaces too, the nearest one."""
    owner = _owner(endpoint, policy)
    rooms = (None if owner is None else owner.room, *(layer.room for layer in layers))
    text = policy.spelling(value)
    for room in rooms:
        if room is not None and room.restated and room.takes(policy.name) and text is not None:
            return Edit(room.place, policy.name, None, text)
    return None


def _added(endpoint: Resolved, policy: Policy, index: int, layers: Sequence[Layer], value: Plain) -> Edit | None:
    owner = _owner(endpoint, policy)
    if owner is not None:
        dialect = _dialect(endpoint, endpoint.endpoint.dialect if policy.level == ENDPOINT else "yaml")
        # A value that counts as not stated, such as a zero, may stand there all the same.
        for name, setting in owner.settings.items():
            if not setting.derived and endpoint.pack.find(policy.level, name, dialect) == index:
                return _changed(policy, name, setting, dialect, value)
        if (edit := _within(owner.room, policy, dialect, value)) is not None:
            return edit
    for layer in layers:
        room = None if layer.overlay == "may_hold" else layer.room
        if (edit := _within(room, policy, _dialect(endpoint, layer.dialect), value)) is not None:
            return edit
    return None


def _within(room: Room | None, policy: Policy, dialect: Dialect | None, value: Plain) -> Edit | None:
    """Return the edit that adds a value to a room; None where it takes none."""
    if room is None or not room.takes(policy.name):
        return None
    new = dialect_text(policy, value, dialect, None)
    return None if new is None else Edit(room.place, policy.name, None, new)


def _replacing(endpoint: Resolved, policy: Policy, layer: Layer, stated: Stated, value: Plain) -> Edit | None:
    if layer.overlay == "may_hold":
        return None
    name = f"{stated.name}.{stated.field}" if stated.field else stated.name
    if not layer.here:
        return _changed(policy, name, stated.setting, _dialect(endpoint, layer.dialect), value)
    setting = _own(endpoint, layer, stated)
    if setting is None:
        return None  # the type, which an endpoint names apart from its settings
    text = replace(setting, text=stated.setting.text)
    return _changed(policy, name, text, _dialect(endpoint, endpoint.endpoint.dialect), value)


def _own(endpoint: Resolved, layer: Layer, stated: Stated) -> Setting | None:
    """Return the endpoint's own setting behind a layer's value."""
    return getattr(endpoint.endpoint, layer.here).get(stated.name) if layer.here else None


def _dialect(endpoint: Resolved, name: str) -> Dialect | None:
    dialects = endpoint.pack.dialects
    return dialects.get(name, dialects.get("yaml"))


def _changed(policy: Policy, name: str, setting: Setting, dialect: Dialect | None, value: Plain) -> Edit | None:
    if setting.place is None or setting.derived or setting.unknown:
        return None
    new = dialect_text(policy, value, dialect, setting.text)
    return None if new is None else Edit(setting.place, name, setting.text, new)
