"""The interface of exporters, and the endpoints of a system with their values for them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.matching.pipeline import CheckContext, Pipeline, resolver_of
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.system import Endpoint, Overlay, System
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved


@dataclass(frozen=True, slots=True)
class ExportEndpoint:
    """An endpoint as it was stated, with its resolved parts.

    Attributes:
        id: unique in the system, unlike the stated one.
        parts: the endpoint itself, or the topics of a service; empty if no pack knows its protocol.
    """

    endpoint: Endpoint
    id: str
    parts: tuple[Resolved, ...]

    @property
    def whole(self) -> Resolved | None:
        """The endpoint itself; None if it stands for several."""
        return self.parts[0] if len(self.parts) == 1 else None


@dataclass(frozen=True, slots=True)
class ExportInput:
    """The endpoints of a system in their order, and the overlays that cover no endpoint."""

    endpoints: tuple[ExportEndpoint, ...]
    idle: tuple[Overlay, ...]


def export_input(system: System, context: ExportContext) -> ExportInput:
    """Return the endpoints of ``system`` with their resolved values."""
    where = CheckContext(context.find_pack, default_protocol=context.default_protocol)
    resolver = resolver_of(Pipeline(replace(system, bridges={}), where))
    found = []
    ids: set[str] = set()
    for endpoint in system.endpoints:
        before = len(resolver.result.endpoints)
        resolver.stated(endpoint)
        parts = tuple(resolver.result.endpoints[before:])
        alone = parts[0].id if len(parts) == 1 else endpoint.id
        found.append(ExportEndpoint(endpoint, unique_name(alone, ids), parts))
    participants = [part.participant for each in found for part in each.parts]
    of_participants = {layer.origin for each in participants for layer in each.layers if layer.overlay != "no"}
    idle = tuple(
        each
        for index, each in enumerate(system.overlays)
        if index not in resolver.overlays.used and each.name not in of_participants
    )
    return ExportInput(tuple(found), idle)


def endpoints_of_pack(
    pack: str, system: System, context: ExportContext, notes: dict[str, None]
) -> Iterator[ExportEndpoint]:
    """Yield all endpoints of a pack; add a note if there are endpoints of other packs."""
    endpoints = export_input(system, context).endpoints
    own = [each for each in endpoints if each.parts and each.parts[0].pack.id == pack]
    yield from own
    others = len(endpoints) - len(own)
    if others and context.changed is None:
        notes[f"{others} endpoint{'s' if others > 1 else ''} of other protocols left out"] = None


def unique_name(wanted: str, taken: set[str]) -> str:
    """Return ``wanted``, with a number if it is taken, and add it to ``taken``."""
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted}~{number}", number + 1
    taken.add(name)
    return name
