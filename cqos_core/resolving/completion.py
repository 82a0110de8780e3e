"""Values that follow from a whole system: the entities that a pack sees, and the values that it gives to endpoints."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from cqos_core.language.policy import ENDPOINT
from cqos_core.model.settings import Setting
from cqos_core.packs.completion import KnownEntity
from cqos_core.resolving.layers import Layer, Stated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value
    from cqos_core.model.settings import Place
    from cqos_core.model.system import Broker, Endpoint, Participant
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.participants import Participants
    from cqos_core.resolving.resolved_endpoint import Resolved


def known_participant(participant: Participant, pack: RulePack, participants: Participants) -> KnownEntity:
    """Return a participant with its values, read when they are asked for."""

    def read(policy: Policy) -> tuple[Value, Place | None] | None:
        resolved = participants.resolved(participant, pack)
        index = pack.vocabulary.indices[policy.level, policy.name]
        stated = next((layer.settings[index] for layer in resolved.layers if index in layer.settings), None)
        return None if stated is None else (resolved.values[index], stated.setting.place)

    place, template = participant.place, participant.template
    return KnownEntity(participant.id, read, place=place, template=template, external=participant.external)


def known_endpoint(endpoint: Endpoint, pack: RulePack, resolve: Callable[[], Resolved]) -> KnownEntity:
    """Return an endpoint with its values, read when they are asked for."""
    resolved = cache(resolve)

    def read(policy: Policy) -> tuple[Value, Place | None] | None:
        index = pack.vocabulary.indices[policy.level, policy.name]
        if resolved().written(index) is None:
            return None
        return resolved().profile.values[index], resolved().origin(index)[1]

    return KnownEntity(
        endpoint.id,
        read,
        lambda: resolved().profile.needs,
        endpoint.place,
        endpoint.template,
        endpoint.external,
        endpoint.role,
        endpoint.topic,
        endpoint.participant,
        endpoint.kind,
    )


def known_broker(broker: Broker, pack: RulePack, participants: Participants) -> KnownEntity:
    """Return a broker with its values, read when they are asked for."""

    def read(policy: Policy) -> tuple[Value, Place | None] | None:
        return participants.stated_of_broker(broker, pack, pack.vocabulary.indices["broker", policy.name])

    return KnownEntity(broker.id, read, place=broker.place)


def sum_up(pack: RulePack, endpoints: Iterable[Resolved]) -> None:
    """Set the values of endpoints that follow from the values of all endpoints."""
    own = [each for each in endpoints if each.pack is pack]
    for each in own:
        if each.like.needs:
            each.participant.requiring.add(each.key)
    layers: dict[tuple[tuple[int, Value], ...], Layer] = {}
    for position, values in pack.sum_up(own).items():
        found = tuple((pack.vocabulary.indices[ENDPOINT, name], value) for name, value in values.items())
        if found not in layers:
            texts = {index: pack.policies[index].format(value) for index, value in found}
            settings = {index: Stated(text, Setting(text, derived=True)) for index, text in texts.items()}
            layers[found] = Layer("settled by all endpoints", settings, counts_as_stated=False)
        endpoint = own[position]
        endpoint.profile = endpoint.profile.with_values(dict(found))
        endpoint.layers = (layers[found], *endpoint.layers)
