"""Copies of endpoints in the terms of the protocol on whose wire they are."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import Depends, is_plain
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Setting
from cqos_core.model.system import Participant
from cqos_core.resolving.resolved_endpoint import WireOrigin

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.wire import Wire
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_core.resolving.resolver import Resolver

FACTS: Final = ("topic", "option")
"""Levels of policies that are facts rather than settings."""


def certain_texts(endpoint: Resolved) -> dict[str, str]:
    """Return the certain values of an endpoint: texts by policy name."""
    pairs = zip(endpoint.pack.policies, endpoint.profile.values, strict=False)
    return {policy.name: policy.domain.format(value) for policy, value in pairs if is_plain(value)}


def wire_copy(
    resolver: Resolver, endpoint: Resolved, wire: Wire, name: str, pack: RulePack, refused: Sequence[str] = ()
) -> Resolved:
    """Return a copy of an endpoint as it is on topic ``name`` of the wire, with the values of the wire's ``pack``.

    No pair of it works for the codes ``refused``.
    """
    own, values, stated = endpoint.pack, endpoint.profile.values, endpoint.endpoint
    settings = {
        name: Setting(text)
        for name, text in wire.fixed.items()
        if (at := pack.find(ENDPOINT, name)) is not None and stated.role in pack.policies[at].roles
    }
    opened: dict[int, Value] = {}
    own_index: dict[int, int] = {}
    for own_name, wire_name in wire.translations():
        index = own.vocabulary.indices[ENDPOINT, own_name]
        wire_index = pack.find(ENDPOINT, wire_name)
        if wire_index is None or stated.role not in pack.policies[wire_index].roles:
            continue
        own_index[wire_index] = index
        value = _translated(values[index], own.policies[index], pack.policies[wire_index], wire.words)
        if is_plain(value):
            text = pack.policies[wire_index].domain.format(value)  # type: ignore[arg-type]
            settings[wire_name] = Setting(text, endpoint.origin(index)[1])
        else:
            opened[wire_index] = value
    carried = replace(
        stated,
        topic=name,
        settings=settings,
        profiles=(),
        overlay={},
        dialect="yaml",
        # These are the policies that its own protocol has; it never sets the rest, observed or not.
        observed=False,
        protocol=pack.id,
        type=None if stated.type is None else wire.type(stated.type),
    )
    resolved = resolver.resolved(carried, _owner(endpoint, wire), pack, endpoint.id, endpoint.stated_id)
    changes = {**opened, **_open_options(endpoint, wire, pack)}
    for own_name, wire_name in wire.facts.items():
        level = next(level for level in FACTS if (level, own_name) in own.vocabulary.indices)
        index, wire_index = own.vocabulary.indices[level, own_name], pack.find(level, wire_name)
        if wire_index is not None and is_plain(values[index]) and not is_stated(resolved, wire_index):
            changes[wire_index] = _translated(values[index], own.policies[index], pack.policies[wire_index], wire.words)
            own_index[wire_index] = index
    return replace(
        resolved,
        profile=resolved.profile.with_values(changes, endpoint.profile.unread, refused),
        wire_origin=WireOrigin(endpoint, own_index),
    )


def is_stated(endpoint: Resolved, index: int) -> bool:
    """Return whether a value is stated, rather than a default or missing."""
    return any(index in layer.settings for layer in (*endpoint.layers, *endpoint.participant.layers))


def _owner(endpoint: Resolved, wire: Wire) -> Participant:
    """The participant as the wire's pack sees it."""
    texts = certain_texts(endpoint)
    settings = {
        wire_name: Setting(wire.words.get(texts[own], texts[own]))
        for own, wire_name in wire.options.items()
        if own in texts
    }
    participant = endpoint.participant.participant
    return Participant(
        f"{participant.id} on {wire.protocol}",
        wire.protocol,
        settings,
        external=participant.external,
        label=participant.label or participant.id,
        place=participant.place,
    )


def _open_options(endpoint: Resolved, wire: Wire, pack: RulePack) -> dict[int, Value]:
    """Options that depend on something, in the wire's terms, so that both ends vary together."""
    found: dict[int, Value] = {}
    for own_name, wire_name in wire.options.items():
        index, wire_index = _of_participant(endpoint.pack, own_name), _of_participant(pack, wire_name)
        if index is None or wire_index is None:
            continue
        value = endpoint.profile.values[index]
        if not is_plain(value):
            found[wire_index] = _translated(value, endpoint.pack.policies[index], pack.policies[wire_index], wire.words)
    return found


def _of_participant(pack: RulePack, name: str) -> int | None:
    """Index of an option or a participant's setting."""
    return next((i for level in ("option", "participant") if (i := pack.find(level, name)) is not None), None)


def _translated(value: Value, own: Policy, wire: Policy, words: Mapping[str, str]) -> Value:
    """Return a value in the terms of the wire's policy; an unknown one stays unknown."""
    if isinstance(value, Depends):
        return Depends(value.on, tuple((name, _translated(case, own, wire, words)) for name, case in value.cases))
    if not is_plain(value):
        return value
    text = own.domain.format(value)  # type: ignore[arg-type]
    try:
        return wire.domain.parse(words.get(text, text))
    except InvalidValueError as error:
        raise InvalidValueError(f"{own.name} {text} has no counterpart on the wire: {error}") from None
