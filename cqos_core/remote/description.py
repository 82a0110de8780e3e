"""What C-QoS understands of a system: where its endpoints stand, and their values with the origin of each."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.language.policy import ENDPOINT, NEED
from cqos_core.language.values import normalise
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.resolving.finding_facts import fact

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Fact
    from cqos_core.model.settings import Place
    from cqos_core.model.system import Broker, Endpoint, Participant, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved


@dataclass(frozen=True, slots=True)
class DescribedEndpoint:
    """One endpoint.

    Attributes:
        id: as in reports.
        stated: id of the stated endpoint that it is, or is a part of.
        topic: as messages print it; None where it has none.
        topic_written: as stated.
        protocol: id of the rule pack; empty where none is stated or found, so that the endpoint is not judged.
        settings: each value that an endpoint of its role has.
        needs: each stated requirement, under the word for it.
    """

    id: str
    stated: str
    role: str
    place: Place | None = None
    topic: str | None = None
    topic_written: str = ""
    topic_is_guess: bool = False
    participant: str = ""
    label: str = ""
    protocol: str = ""
    type: str = ""
    kind: str = ""
    external: bool = False
    settings: tuple[Fact, ...] = ()
    needs: tuple[Fact, ...] = ()


@dataclass(frozen=True, slots=True)
class DescribedParticipant:
    """One participant; ``protocol`` is empty where none is stated or found."""

    id: str
    place: Place | None = None
    label: str = ""
    protocol: str = ""
    external: bool = False


@dataclass(frozen=True, slots=True)
class Description:
    """A system.

    Attributes:
        system: its name.
    """

    system: str
    endpoints: tuple[DescribedEndpoint, ...]
    participants: tuple[DescribedParticipant, ...]


def describe(system: System, where: CheckContext) -> Description:
    """Describe a system: all its endpoints, those of bridges and those that no rule pack judges too."""
    pipeline = Pipeline(system, where)
    found = grouped((each.stated_id, each) for each in pipeline.endpoints if not each.is_copy)
    endpoints = [
        each for stated in pipeline.system.endpoints for each in described_endpoints(stated, found.get(stated.id, ()))
    ]
    participants = (_participant(each, system, where) for each in system.participants.values())
    return Description(system.name, tuple(endpoints), tuple(participants))


def _participant(participant: Participant, system: System, where: CheckContext) -> DescribedParticipant:
    protocol = participant.protocol or system.protocol or where.default_protocol
    known = protocol is not None and where.find_pack(protocol) is not None
    return DescribedParticipant(
        participant.id,
        participant.place,
        participant.label or "",
        protocol if protocol and known else "",
        participant.external,
    )


def described_endpoints(stated: Endpoint, resolved: Iterable[Resolved]) -> Iterator[DescribedEndpoint]:
    """Describe a stated endpoint: what it amounts to, or itself where no rule pack judges it."""
    plain = DescribedEndpoint(
        stated.id,
        stated.id,
        stated.role,
        stated.place,
        topic_written=stated.topic or "",
        topic_is_guess=stated.topic_is_guess,
        participant=stated.participant,
        label=stated.label or "",
        type=stated.type or "",
        kind=stated.kind,
        external=stated.external,
    )
    judged = [
        replace(
            plain,
            id=each.id,
            topic=each.shown if each.key is not None else None,
            protocol=each.pack.id,
            external=each.external,
            settings=tuple(_facts(each, _indices(each.pack, ENDPOINT, each.role))),
            needs=tuple(_needs(each)),
        )
        for each in resolved
    ]
    yield from judged or [plain]


_KNOWN: Final[dict[tuple[int, str, str], tuple[RulePack, tuple[int, ...]]]] = {}


def _indices(pack: RulePack, level: str, role: str) -> tuple[int, ...]:
    """Return the policies of a level that an endpoint of a role can state."""
    found = _KNOWN.get((id(pack), level, role))
    if found is None or found[0] is not pack:
        indices = (
            index
            for index, policy in enumerate(pack.policies)
            if policy.level == level and role in policy.roles and not policy.derived
        )
        found = _KNOWN[id(pack), level, role] = pack, tuple(indices)
    return found[1]


def _facts(resolved: Resolved, indices: Iterable[int]) -> Iterator[Fact]:
    """Yield values, with the places of those that are stated; a fact that nothing states has no value."""
    for index in indices:
        policy = resolved.pack.policies[index]
        if policy.default_for(resolved.role) is not None or resolved.written(index) is not None:
            found = fact(resolved, resolved.profile, index)
            yield found if found.place != resolved.endpoint.place else replace(found, place=None)


def _needs(resolved: Resolved) -> Iterator[Fact]:
    for index in _indices(resolved.pack, NEED, resolved.role):
        policy = resolved.pack.policies[index]
        if policy.aliases and resolved.written(index) is not None:
            # Endpoints of one file that need the same share what was made of it, each in its own place.
            stated = (each for name, each in resolved.endpoint.needs.items() if normalise(name) in policy.spellings)
            place = next((each.place for each in stated), None)
            yield replace(fact(resolved, resolved.profile, index), policy=policy.aliases[0], place=place)


def elements_of(system: System) -> dict[str, str]:
    """Return the ids of elements, by the id of what stands there, where it is another one."""
    parts: tuple[Endpoint | Participant | Broker, ...] = (
        *system.endpoints,
        *system.participants.values(),
        *system.brokers.values(),
    )
    found = ((each.id, each.place.element) for each in parts if each.place is not None)
    return {name: element for name, element in found if element is not None and element != name}
