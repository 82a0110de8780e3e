"""What an exporter is given and what it returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from cqos_core.resolving.resolve import Resolver

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.model.system import Endpoint, Overlay, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved import Resolved


@dataclass(frozen=True, slots=True)
class ExportContext:
    """What a writer may use beside the system.

    Attributes:
        find_pack: returns the rule pack of an id, or None.
        default_protocol: judges endpoints for which the system states none.
        settings: of the exporter, by name; each has a value that the exporter allows.
        changed: ids of endpoints and policies that were changed to mend the system, which has the changes already; an
            exporter of settings writes nothing else then. None: everything is to be written.
    """

    find_pack: Callable[[str], RulePack | None]
    default_protocol: str | None = None
    settings: Mapping[str, str] = field(default_factory=dict)
    changed: frozenset[tuple[str, str]] | None = None

    def wants(self, endpoint_id: str, policy: str | None = None) -> bool:
        """Whether an endpoint, or one policy of it, is to be written."""
        if self.changed is None:
            return True
        return any(endpoint == endpoint_id and policy in {None, name} for endpoint, name in self.changed)


@dataclass(frozen=True, slots=True)
class Exported:
    """What a writer wrote.

    Attributes:
        text: the whole file.
        expressed: how many endpoints, or topics, are in it; 0: nothing of the system could be expressed.
        notes: what the form cannot say and was left out, one sentence each.
    """

    text: str
    expressed: int
    notes: tuple[str, ...] = ()


class Writer(Protocol):
    """Writes a system down in one form."""

    def __call__(self, system: System, context: ExportContext) -> Exported:
        """Return the file; neither ``system`` nor anything in it is changed."""


@dataclass(frozen=True, slots=True)
class Judged:
    """An endpoint as it was stated, with what its pack makes of it.

    Attributes:
        id: unique in the system, unlike the stated one.
        parts: itself, or what it stands for (the topics of a service); empty where no pack judges it.
    """

    endpoint: Endpoint
    id: str
    parts: tuple[Resolved, ...]

    @property
    def whole(self) -> Resolved | None:
        """The endpoint itself, where it does not stand for several."""
        return self.parts[0] if len(self.parts) == 1 else None


@dataclass(frozen=True, slots=True)
class Judgement:
    """The endpoints of a system in their order, and the overlays that cover none of them."""

    endpoints: tuple[Judged, ...]
    idle: tuple[Overlay, ...]


def judged(system: System, context: ExportContext) -> Judgement:
    """Return the endpoints of ``system``, each with the values that its pack sees."""
    resolver = Resolver(system, context.find_pack, context.default_protocol)
    found = []
    ids: set[str] = set()
    for endpoint in system.endpoints:
        before = len(resolver.result.endpoints)
        resolver.stated(endpoint)
        parts = tuple(resolver.result.endpoints[before:])
        alone = parts[0].id if len(parts) == 1 else endpoint.id
        found.append(Judged(endpoint, unique(alone, ids), parts))
    idle = tuple(each for index, each in enumerate(system.overlays) if index not in resolver.overlays.used)
    return Judgement(tuple(found), idle)


def unique(wanted: str, taken: set[str]) -> str:
    """Return ``wanted``, with a number where it is taken, and take it."""
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted}~{number}", number + 1
    taken.add(name)
    return name
