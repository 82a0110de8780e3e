"""Endpoints of one protocol on the wire of another: a ROS 2 node and a plain DDS program on one topic.

A pack says by `cqos_core.pack.Wire` what its endpoints are on the wire. Where endpoints of the wire's own protocol are
there too, copies of the carried ones are put beside them; pairs of one of each are then judged by the wire's pack.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.pairing import bucket, introduce
from cqos_core.policy import ENDPOINT, Depends, is_plain
from cqos_core.problems import InvalidValueError
from cqos_core.resolved import Carried
from cqos_core.system import Participant, Setting

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.pack import RulePack, Wire
    from cqos_core.policy import Policy, Value
    from cqos_core.resolve import Resolver
    from cqos_core.resolved import Resolved


def topics(resolver: Resolver) -> dict[tuple[str, str], list[Resolved]]:
    """Sort the resolved endpoints by protocol and topic, with copies beside those that they meet on another one."""
    found = bucket(resolver.result.endpoints)
    introduce(found)
    protocols = {protocol for protocol, _ in found}
    for endpoint in resolver.result.endpoints:
        wire = endpoint.pack.wire
        if wire is None or endpoint.key is None or wire.protocol not in protocols:
            continue
        name = wire.topic(endpoint.key, _plain_texts(endpoint))
        beside = found.get((wire.protocol, name)) if name is not None else None
        if name is not None and beside:
            beside.append(_on_wire(resolver, endpoint, wire, name, beside[0].pack))
    return found


def _plain_texts(endpoint: Resolved) -> dict[str, str]:
    """What is known for certain of an endpoint: texts by policy name."""
    pairs = zip(endpoint.pack.policies, endpoint.profile.values, strict=False)
    return {policy.name: policy.domain.format(value) for policy, value in pairs if is_plain(value)}


def _on_wire(resolver: Resolver, endpoint: Resolved, wire: Wire, name: str, pack: RulePack) -> Resolved:
    own, values, stated = endpoint.pack, endpoint.profile.values, endpoint.endpoint
    settings = {name: Setting(text) for name, text in wire.fixed.items()}
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
        # What its own protocol knows is here; the rest it never sets, whether or not anybody saw it run.
        observed=False,
        protocol=pack.id,
        type=None if stated.type is None else wire.type(stated.type),
    )
    resolved = resolver.resolved(carried, _owner(endpoint, wire), pack, endpoint.id, endpoint.stated_id)
    changes = {**opened, **_open_options(endpoint, wire, pack)}
    return replace(
        resolved,
        profile=resolved.profile.with_values(changes) if changes else resolved.profile,
        carried=Carried(endpoint, own_index),
    )


def _owner(endpoint: Resolved, wire: Wire) -> Participant:
    """The participant as the wire's pack sees it."""
    texts = _plain_texts(endpoint)
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
        index = endpoint.pack.vocabulary.indices["option", own_name]
        wire_index = next(
            (i for level in ("option", "participant") if (i := pack.find(level, wire_name)) is not None), None
        )
        value = endpoint.profile.values[index]
        if wire_index is not None and not is_plain(value):
            found[wire_index] = _translated(value, endpoint.pack.policies[index], pack.policies[wire_index], wire.words)
    return found


def _translated(value: Value, own: Policy, wire: Policy, words: Mapping[str, str]) -> Value:
    """Write a value in the wire policy's terms; what is not known stays so."""
    if isinstance(value, Depends):
        return Depends(value.on, tuple((name, _translated(case, own, wire, words)) for name, case in value.cases))
    if not is_plain(value):
        return value
    text = own.domain.format(value)  # type: ignore[arg-type]
    try:
        return wire.domain.parse(words.get(text, text))
    except InvalidValueError as error:
        message = f"{own.name} {text} has no counterpart on the wire: {error}"
        raise InvalidValueError(message) from None
