"""Finds mistakes in a system that a program built."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from cqos_core.model.flow import positions_missing
from cqos_core.model.problems import Problem
from cqos_core.model.settings import Place, Setting
from cqos_core.model.spelling import KnownNames
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import (
    PUBLISHER,
    SUBSCRIBER,
    Endpoint,
    Participant,
    System,
)


def faults(system: System) -> list[Problem]:
    """Return the mistakes in a system that a program built; importers never make them."""
    known = KnownNames(system.participants)
    found = [problem for endpoint in system.endpoints for problem in faults_of(endpoint, system.participants, known)]
    for name, each in system.participants.items():
        if each.id != name:
            found.append(Problem("CQ011", f"participant `{each.id}` is kept under another id, `{name}`", each.place))
        found += _no_settings(f"participant `{name}`", each.settings, each.place)
    wrong = ((flow.source, positions_missing(flow)) for flow in system.flows)
    found += [Problem("CQ011", f"control flow of `{name}`: {text}") for name, text in wrong if text is not None]
    return found


def faults_of(
    endpoint: Endpoint, participants: Mapping[str, Participant], known: KnownNames | None = None
) -> Iterator[Problem]:
    """Yield the mistakes in an endpoint: a missing participant, an unknown role, or values that are no `Setting`."""
    name, where = f"endpoint `{endpoint.id}`", endpoint.place
    if endpoint.participant not in participants:
        message = f"{name} belongs to participant `{endpoint.participant}`, which is not there"
        yield Problem("CQ011", message, where, suggestion(endpoint.participant, known or KnownNames(participants)))
    if endpoint.role not in {PUBLISHER, SUBSCRIBER}:
        yield Problem("CQ011", f"{name} has the role `{endpoint.role}`", where, f"allowed: {PUBLISHER}, {SUBSCRIBER}")
    for settings in (endpoint.settings, endpoint.overlay, endpoint.needs):
        yield from _no_settings(name, settings, where)


def _no_settings(name: str, settings: Mapping[str, object], where: Place | None) -> Iterator[Problem]:
    for setting, value in settings.items():
        if not isinstance(value, Setting):
            message = f"`{setting}` of {name} is {value!r}, which is no `Setting`"
            yield Problem("CQ009", message, where, "settings hold their text: `Setting('reliable')`")
