"""The order of start that a system states."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from cqos_core.model.core_findings import core_finding
from cqos_core.model.endpoint_rows import kinds_of
from cqos_core.model.suggestions import suggestion

if TYPE_CHECKING:
    from cqos_core.model.finding import Finding
    from cqos_core.model.system import Endpoint, Participant, System


class StartOrder:
    """The order of start that a system states of some of its participants and endpoints."""

    def __init__(self, system: System) -> None:
        """Note what each of them states."""
        self._system = system
        self._stated: dict[str, list[str]] | None = None
        self._known: dict[tuple[str, ...], frozenset[str]] = {}

    def before(self, names: tuple[str, ...]) -> frozenset[str]:
        """Return everything that is up before something that starts after ``names``."""
        if names not in self._known:
            stated, found, left = self._by_name(), set[str](), [*names]
            while left:
                name = left.pop()
                if name not in found:
                    found.add(name)
                    left += stated.get(name, ())
            self._known[names] = frozenset(found)
        return self._known[names]

    def _by_name(self) -> dict[str, list[str]]:
        """Return the names after which each participant and endpoint starts; with a participant all its endpoints are up."""
        if self._stated is None:
            participants = self._system.participants
            self._stated = {name: [*each.starts_after] for name, each in participants.items()}
            for each in self._system.endpoints:
                own = participants[each.participant].starts_after
                self._stated[each.participant] += each.starts_after
                self._stated.setdefault(each.id, []).extend((*each.starts_after, *own))
        return self._stated


def unknown_starts(system: System) -> list[Finding]:
    """Report names in `starts_after` of neither a participant nor an endpoint."""
    starting = (each.starts_after for each in kinds_of(system.endpoints))
    if not any(chain((each.starts_after for each in system.participants.values()), starting)):
        return []
    everybody: list[Participant | Endpoint] = [*system.participants.values(), *system.endpoints]
    stating = [each for each in everybody if each.starts_after]
    from cqos_core.model.spelling import KnownNames

    known = {each.id for each in everybody}
    names = KnownNames(known)
    findings = []
    for stated in stating:
        for name in stated.starts_after:
            if name not in known:
                message = f"`{stated.id}` starts after `{name}`, which is neither a participant nor an endpoint"
                findings.append(core_finding("CQ213", message, place=stated.place, help=suggestion(name, names)))
    return findings
