"""Endpoints of one protocol on the wire of another: a ROS 2 node and a plain DDS program on one topic.

A pack says by `cqos_core.packs.Wire` what its endpoints are on the wire. Where endpoints of the wire's own protocol are
there too, copies of the carried ones are put beside them; pairs of one of each are then judged by the wire's pack. What is
known of a topic holds there for both, for any source.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.matching.judge import refusals
from cqos_core.matching.topic_groups import add_visiting_copies, endpoints_by_topic
from cqos_core.model.settings import Setting
from cqos_core.resolving.layers import Layer, Stated
from cqos_core.resolving.wire_copies import FACTS, certain_texts, is_stated, wire_copy

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.language.values import Value
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_core.resolving.resolver import Resolver


def topics(resolver: Resolver) -> dict[tuple[str, str], list[Resolved]]:
    """Sort the resolved endpoints by protocol and topic, with copies on topics of the wire."""
    found = endpoints_by_topic(resolver.result.endpoints)
    add_visiting_copies(found)
    protocols = {protocol for protocol, _ in found}
    mixed: dict[tuple[str, str], None] = {}
    for endpoint in resolver.result.endpoints:
        wire = endpoint.pack.wire
        if wire is None or endpoint.key is None or wire.protocol not in protocols:
            continue
        name = wire.topic(endpoint.key, certain_texts(endpoint))
        beside = found.get((wire.protocol, name)) if name is not None else None
        if name is not None and beside:
            refused = refusals(endpoint.profile, endpoint.role, endpoint.endpoint.observed)
            beside.append(wire_copy(resolver, endpoint, wire, name, beside[0].pack, refused))
            mixed[wire.protocol, name] = None
    for key in mixed:
        _share_facts(found[key])
    return found


def meet_by_name(packs: Mapping[str, RulePack]) -> bool:
    """Whether endpoints of some packs meet on the topic that they name, and nowhere else."""
    return not any(
        each.topic_matching.match is not None or (each.wire is not None and each.wire.protocol in packs)
        for each in packs.values()
    )


def _share_facts(endpoints: list[Resolved]) -> None:
    """Let endpoints of the wire's own know what all carried ones of the topic agree on, where they state nothing."""
    known: dict[int, dict[Value, Resolved]] = {}
    for endpoint in sorted(endpoints, key=lambda each: each.id):
        for index in endpoint.wire_origin.own_index if endpoint.wire_origin is not None else ():
            if endpoint.pack.policies[index].level in FACTS:
                known.setdefault(index, {}).setdefault(endpoint.profile.values[index], endpoint)
    agreed = {index: next(iter(by_value.items())) for index, by_value in known.items() if len(by_value) == 1}
    for position, endpoint in enumerate(endpoints):
        new = {
            index: fact
            for index, fact in agreed.items()
            if endpoint.profile.values[index] != fact[0] and not is_stated(endpoint, index)
        }
        if endpoint.wire_origin is None and new:
            endpoints[position] = replace(
                endpoint,
                profile=endpoint.profile.with_values({index: value for index, (value, _) in new.items()}),
                layers=(*endpoint.layers, *(_layer(index, *fact) for index, fact in new.items())),
            )


def _layer(index: int, value: Value, carried: Resolved) -> Layer:
    """Return the layer of a fact that a carried endpoint knows."""
    origin, place = carried.origin(index)
    text = carried.pack.policies[index].domain.format(value)  # type: ignore[arg-type]
    return Layer(origin, {index: Stated(text, Setting(text, place))})
