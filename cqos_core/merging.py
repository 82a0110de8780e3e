"""Several systems as one."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, Final

from cqos_core.system import ImportNote, Place, System

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.system import Bridge, Broker, Endpoint, Participant, Route, Settings

_EMPTY: Final = System()
_BROKER: Final = "broker"
"""The setting of a participant that names its broker."""


def merge(systems: Sequence[System]) -> System:
    """Put several systems together as one.

    A participant that several sources state is one participant; profiles, topics, brokers and options that several sources
    state alike are one, and stated differently they stay those of the first source, with a warning. Endpoint ids that two
    sources use are told apart when the system is resolved.
    """
    systems = [system for system in systems if system != _EMPTY] or systems[:1]
    if len(systems) == 1:
        return systems[0]
    _tell_brokers_apart(systems)
    whole = System(name=" + ".join(dict.fromkeys(system.name for system in systems if system.name)))
    for system in systems:
        for participant in system.participants.values():
            _join_participant(whole, participant, system.protocol)
        for endpoint in system.endpoints:
            _join_endpoint(whole, endpoint, system)
        for broker in system.brokers.values():
            _join_broker(whole, broker, system.protocol)
        for bridge in system.bridges.values():
            _join_bridge(whole, bridge)
        for kind in ("profiles", "topics"):
            _join(whole, kind, getattr(system, kind))
        for pack, settings in system.options.items():
            _join_settings(whole, f"option `{pack}.{{}}`", whole.options.setdefault(pack, {}), settings)
        whole.overlays += system.overlays
        whole.checks += system.checks
        whole.accept += system.accept
        for rule, level in system.severities.items():
            if whole.severities.setdefault(rule, level) != level:
                _stated_differently(whole, f"severity of `{rule}`", whole.severities[rule], level, None)
        whole.notes += system.notes
        whole.sources.update(system.sources)
    whole.partial = all(system.partial for system in systems)
    _join_addresses(whole)
    protocols = {system.protocol for system in systems}
    whole.protocol = protocols.pop() if len(protocols) == 1 else None
    return whole


def _tell_brokers_apart(systems: Sequence[System]) -> None:
    """Give brokers ids of their own that several files describe under one name, each with addresses."""
    taken: dict[str, tuple[str, ...]] = {}
    for system in systems:
        for name, broker in list(system.brokers.items()):
            if not broker.addresses or taken.setdefault(name, broker.addresses) == broker.addresses:
                continue
            number = next(number for number in count(2) if f"{name}#{number}" not in taken)
            broker.id = f"{name}#{number}"
            taken[broker.id] = broker.addresses
            system.brokers = {each.id: each for each in system.brokers.values()}
            _rename_broker(system, {name: broker.id})


def _rename_broker(system: System, names: Mapping[str, str]) -> None:
    for participant in system.participants.values():
        stated = participant.settings.get(_BROKER)
        if stated is not None and stated.text in names:
            participant.settings[_BROKER] = replace(stated, text=names[stated.text])


def _join_addresses(whole: System) -> None:
    """Take an address that a client names for the broker that says it is there, where only one does."""
    there: dict[str, set[str]] = {}
    for broker in whole.brokers.values():
        for address in broker.addresses:
            there.setdefault(address, set()).add(broker.id)
    if not there:
        return
    bare = {name for name, each in whole.brokers.items() if not (each.addresses or each.settings or each.profiles)}
    named = {each.settings[_BROKER].text for each in whole.participants.values() if _BROKER in each.settings}
    sources = {name: each.place.source for name, each in whole.brokers.items() if each.place is not None}
    joined = {}
    for name in sorted(bare | (named - whole.brokers.keys())):
        # No file names its own broker by an address.
        others = (
            [each for each in there.get(key, ()) if sources.get(each) != sources.get(name)] for key in _spellings(name)
        )
        found = next((brokers for brokers in others if brokers), [])
        if len(found) == 1:
            joined[name] = found[0]
            whole.brokers.pop(name, None)
    _rename_broker(whole, joined)


def _spellings(address: str) -> Iterator[str]:
    """Yield the addresses under which a broker may be known that a client names by this one, best first."""
    host, _, port = address.rpartition("://")[2].lower().rpartition(":")
    if host and port.isdecimal():
        local = host in {"localhost", "::1"} or host.startswith("127.")
        names = [host] if local or host.replace(".", "").isdecimal() else [host, host.partition(".")[0]]
        yield from (f"{name}:{port}" for name in (*names, *(["localhost"] if local else []), "*"))


def _join_participant(whole: System, participant: Participant, protocol: str | None) -> None:
    participant.protocol = participant.protocol or protocol
    known = whole.participants.setdefault(participant.id, participant)
    if known is participant:
        return
    if known.protocol != participant.protocol:
        first, second = known.protocol or "none", participant.protocol or "none"
        _stated_differently(whole, f"protocol of participant `{known.id}`", first, second, participant.place)
    _join_settings(whole, f"`{{}}` of participant `{known.id}`", known.settings, participant.settings)
    for old, new in participant.remap.items():
        known.remap.setdefault(old, new)
    known.external = known.external and participant.external
    known.starts_after = tuple(dict.fromkeys((*known.starts_after, *participant.starts_after)))
    known.label = known.label or participant.label


def _join_broker(whole: System, broker: Broker, protocol: str | None) -> None:
    broker.protocol = broker.protocol or protocol
    known = whole.brokers.setdefault(broker.id, broker)
    if known is broker:
        return
    if known.protocol != broker.protocol:
        first, second = known.protocol or "none", broker.protocol or "none"
        _stated_differently(whole, f"protocol of broker `{known.id}`", first, second, broker.place)
    _join_settings(whole, f"`{{}}` of broker `{known.id}`", known.settings, broker.settings)
    known.profiles = tuple(dict.fromkeys((*known.profiles, *broker.profiles)))


def _join_bridge(whole: System, bridge: Bridge) -> None:
    known = whole.bridges.setdefault(bridge.id, bridge)
    if known is bridge:
        return
    carried = {_way(route) for route in known.routes}
    known.routes += tuple(route for route in bridge.routes if _way(route) not in carried)
    known.carries = tuple(dict.fromkeys((*known.carries, *bridge.carries)))


def _way(route: Route) -> object:
    """What a route carries, without where that is stated."""
    ends = (
        (end.participant, end.kind, end.topic, *sorted((name, each.text) for name, each in end.settings.items()))
        for end in (route.source, route.target)
    )
    return route.only, route.but, *ends


def _join_settings(whole: System, what: str, known: Settings, stated: Settings) -> None:
    for name, setting in stated.items():
        other = known.setdefault(name, setting)
        if other.text != setting.text:
            _stated_differently(whole, what.format(name), other.text, setting.text, setting.place)


def _stated_differently(whole: System, what: str, first: str, second: str, place: Place | None) -> None:
    message = f"{what} is stated differently, as {first} and as {second}; the first holds"
    whole.notes.append(ImportNote("CQ060", "warning", message, place))


def _join_endpoint(whole: System, endpoint: Endpoint, system: System) -> None:
    endpoint.protocol = endpoint.protocol or system.participants[endpoint.participant].protocol
    whole.endpoints.append(endpoint)


def _join(whole: System, kind: str, stated: Mapping[str, object]) -> None:
    known = getattr(whole, kind)
    for name, value in stated.items():
        other = known.setdefault(name, value)
        if other is not value and _content(other) != _content(value):
            first, second = getattr(other, "place", None), getattr(value, "place", None)
            message = (
                f"{kind.removesuffix('s')} `{name}` is stated differently at {first} and at {second}; the first holds"
            )
            whole.notes.append(ImportNote("CQ060", "warning", message, second))


def _content(value: object) -> object:
    """What is stated, without where."""
    settings = {name: setting.text for name, setting in getattr(value, "settings", {}).items()}
    base = tuple((ref.name, ref.scope) for ref in getattr(value, "base", ()))
    return settings, base, getattr(value, "external", None), getattr(value, "protocol", None)
