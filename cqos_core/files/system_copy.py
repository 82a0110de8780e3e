"""Copies systems so that the copy shares no mutable object."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import fields, replace
from typing import Final, TypeVar

from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import (
    Acceptance,
    Bridge,
    Broker,
    Endpoint,
    ImportNote,
    Overlay,
    Participant,
    Profile,
    ProfileRef,
    Route,
    System,
    TeamRule,
    Topic,
)

T = TypeVar("T")

_CHANGING: Final[dict[type, tuple[str, ...]]] = {
    System: tuple(each.name for each in fields(System)),
    Endpoint: ("settings", "overlay", "needs"),
    Participant: ("settings", "remap", "groups"),
    Profile: ("settings",),
    Topic: ("settings",),
    Broker: ("settings",),
    Overlay: ("settings",),
    Bridge: ("routes",),
    Route: ("source", "target"),
}

_FIXED: Final = frozenset({Setting, Place, ProfileRef, TeamRule, Acceptance, ImportNote, str, bytes, bool, type(None)})


def copied(value: T) -> T:
    """Return a copy of a system, or of a part, that shares no mutable object with it."""
    kind = type(value)
    if kind in _FIXED:
        return value
    if kind is dict:
        return {name: copied(each) for name, each in value.items()}  # type: ignore[attr-defined, return-value]
    if kind is list or kind is tuple:
        return kind([copied(each) for each in value])  # type: ignore[attr-defined, call-arg]
    parts = _CHANGING.get(Endpoint if isinstance(value, Endpoint) else kind)
    if parts is None:
        return deepcopy(value)
    return replace(value, **{name: copied(getattr(value, name)) for name in parts})  # type: ignore[type-var]
