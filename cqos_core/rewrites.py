"""Which edits set a policy of endpoints: where the value stands, or may be added, and its text there."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.policy import ENDPOINT, NEED
from cqos_core.reading import respelled
from cqos_core.report import Edit

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.pack import Dialect
    from cqos_core.policy import Plain, Policy
    from cqos_core.resolved import Layer, Resolved, Stated
    from cqos_core.system import Endpoint, Participant, Setting


def edits_of(endpoints: Iterable[Resolved], index: int, value: Plain) -> tuple[Edit, ...]:
    """Return the edits after which each endpoint has a value; nothing where one of them cannot be edited."""
    found: dict[Edit, None] = {}
    for endpoint in endpoints:
        edit = _edit(endpoint, index, value)
        if edit is None:
            return ()
        found[edit] = None
    return tuple(found)


def _edit(endpoint: Resolved, index: int, value: Plain) -> Edit | None:
    """What was observed is no design, and an endpoint of another protocol is edited under that one's names."""
    if endpoint.endpoint.observed or endpoint.carried is not None:
        return None
    policy = endpoint.pack.policies[index]
    own = policy.level in {ENDPOINT, NEED}
    layers = endpoint.layers if own else endpoint.participant.layers
    layer = next((each for each in layers if index in each.settings), None)
    if policy.level == NEED:
        needed = None if layer is None else layer.settings[index]
        return None if needed is None else _changed(policy, needed.name, needed.setting, None, value)
    if layer is not None and (layer.here or layer.overlay != "no" or not own):
        return _replacing(endpoint, policy, layer, layer.settings[index], value)
    owner: Endpoint | Participant = endpoint.endpoint if own else endpoint.participant.participant
    dialect = _dialect(endpoint, endpoint.endpoint.dialect if own else "yaml")
    # A value that counts as not stated, such as a zero, may stand there all the same.
    for name, setting in owner.settings.items():
        if endpoint.pack.find(policy.level, name, dialect) == index:
            return _changed(policy, name, setting, dialect, value)
    new = respelled(policy, value, dialect, None)
    if not owner.extendable or owner.place is None or new is None:
        return None
    return Edit(owner.place, policy.name, None, new)


def _replacing(endpoint: Resolved, policy: Policy, layer: Layer, stated: Stated, value: Plain) -> Edit | None:
    if layer.overlay == "may_hold" or (policy.level != ENDPOINT and layer.origin != "explicit"):
        return None
    name = f"{stated.name}.{stated.field}" if stated.field else stated.name
    if not layer.here:
        return _changed(policy, name, stated.setting, _dialect(endpoint, layer.dialect), value)
    own = endpoint.endpoint.overlay if layer.origin == "overlay" else endpoint.endpoint.settings
    setting = own.get(stated.name)
    if setting is None:
        return None  # the type, which an endpoint names apart from its settings
    text = replace(setting, text=stated.setting.text)
    return _changed(policy, name, text, _dialect(endpoint, endpoint.endpoint.dialect), value)


def _dialect(endpoint: Resolved, name: str) -> Dialect | None:
    dialects = endpoint.pack.dialects
    return dialects.get(name, dialects.get("yaml"))


def _changed(policy: Policy, name: str, setting: Setting, dialect: Dialect | None, value: Plain) -> Edit | None:
    new = respelled(policy, value, dialect, setting.text)
    if setting.place is None or setting.derived or setting.unknown or new is None:
        return None
    return Edit(setting.place, name, setting.text, new)
