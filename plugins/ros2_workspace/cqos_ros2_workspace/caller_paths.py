"""Paths in a system as the caller spells the folder of the workspace."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.source import Opener
    from cqos_core.model.system import System

    Spelled = Callable[[Place | None], Place | None]


def opened(root: str, folder: str, opener: Opener) -> Callable[[str], bytes]:
    """Return what opens a file below ``root`` under the name that it has below ``folder``; see `spell`."""
    inside = root.rstrip(os.sep) + os.sep

    def content(path: str) -> bytes:
        below = path if path.startswith(inside) else os.path.realpath(path)
        return opener(os.path.join(folder, below.removeprefix(inside)), "").data  # noqa: PTH118 - text

    return content


def spell(system: System, root: str, folder: str) -> None:
    """Write every path below ``root``, a real path, as one below ``folder``, as the caller names it."""
    inside = root.rstrip(os.sep) + os.sep
    known: dict[Place, Place] = {}

    def path(name: str) -> str:
        return os.path.join(folder, name.removeprefix(inside)) if name.startswith(inside) else name  # noqa: PTH118 - text

    def spelled(place: Place | None) -> Place | None:
        if place is None or not place.source.startswith(inside):
            return place
        if place not in known:
            known[place] = replace(place, source=path(place.source))
        return known[place]

    system.sources = {path(name): data for name, data in system.sources.items()}
    system.notes = [
        replace(
            each,
            place=spelled(each.place),
            parts=tuple(replace(part, place=spelled(part.place)) for part in each.parts),
        )
        for each in system.notes
    ]
    for participant in system.participants.values():
        participant.place = spelled(participant.place)
        _settings(participant.settings, spelled)
    for endpoint in system.endpoints:
        endpoint.place = spelled(endpoint.place)
        if endpoint.room is not None:
            endpoint.room = replace(endpoint.room, place=spelled(endpoint.room.place) or endpoint.room.place)
        endpoint.profiles = tuple(replace(each, place=spelled(each.place)) for each in endpoint.profiles)
        _settings(endpoint.settings, spelled)
        _settings(endpoint.overlay, spelled)


def _settings(settings: Settings, spelled: Spelled) -> None:
    for name, each in settings.items():
        settings[name] = replace(each, place=spelled(each.place))
