"""Merges several systems into one."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, count
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.grouping import grouped
from cqos_core.model.lazy_tuple import lazy_tuple
from cqos_core.model.settings import EVERY_OTHER, Place, Setting
from cqos_core.model.suggestions import listed
from cqos_core.model.system import ImportNote, Profile, System

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Bridge, Broker, Endpoint, Participant, ProfileRef, Route, Topic

_EMPTY: Final = System()
_BROKER: Final = "broker"
"""The setting of a participant that names its broker."""


def merge(systems: Sequence[System]) -> System:
    """Merge several systems into one.

    A participant, topic or broker that several sources state is one. A setting that they state differently is unknown, with
    a warning. A source keeps its own profiles and options if others state them differently. Endpoint ids that two sources
    use become different when the system is resolved.
    """
    systems = [system for system in systems if system != _EMPTY] or systems[:1]
    if len(systems) == 1:
        return systems[0]
    _tell_brokers_apart(systems)
    systems = _with_callers(_with_own_options(systems))
    systems, ambiguous = _with_own_profiles(systems)
    whole = System(name=" + ".join(dict.fromkeys(system.name for system in systems if system.name)))
    for system in systems:
        for endpoint in system.endpoints:
            endpoint.protocol = endpoint.protocol or system.participants[endpoint.participant].protocol
        whole.endpoints += system.endpoints
        for kind, join in _JOINED.items():
            for name, stated in getattr(system, kind).items():
                known = getattr(whole, kind).setdefault(name, stated)
                if known is not stated:
                    join(whole, known, stated)
        whole.profiles.update(system.profiles)
        _join_plans(whole, system)
        for pack, settings in system.options.items():
            whole.options.setdefault(pack, {}).update(settings)
        whole.overlays += system.overlays
        whole.checks += system.checks
        whole.accept += system.accept
        for rule, level in system.severities.items():
            if whole.severities.setdefault(rule, level) != level:
                what = f"severity of `{rule}`"
                _stated_differently(whole, what, whole.severities[rule], level, None, "the first holds")
        _join_assumed(whole, system)
        whole.notes += system.notes
        whole.sources.update(system.sources)
    whole.flows = lazy_tuple(lambda: chain.from_iterable(system.flows for system in systems))
    for profile in ambiguous:
        whole.profiles[profile.name] = profile
        message = f"profile `{profile.name}` is {profile.settings[EVERY_OTHER].unknown}; {_OPEN}"
        whole.notes.append(ImportNote("CQ060", "warning", message, profile.place))
    whole.partial = all(system.partial for system in systems)
    join_addresses(whole)
    protocols = {system.protocol for system in systems}
    whole.protocol = protocols.pop() if len(protocols) == 1 else None
    if whole.protocol is None:
        _keep_protocols_of_profiles(whole, systems)
    return whole


def _join_assumed(whole: System, system: System) -> None:
    """Keep the assumed values on which all systems with assumptions agree."""
    for name, values in system.assumed.items():
        whole.assumed[name] = tuple(each for each in whole.assumed.get(name, values) if each in values)


def _keep_protocols_of_profiles(whole: System, systems: Sequence[System]) -> None:
    """Set the protocol of each profile to that of its file."""
    for name, protocol in ((name, each.protocol) for each in systems for name in each.profiles):
        whole.profiles[name] = replace(whole.profiles[name], protocol=protocol)


def _with_callers(systems: list[System]) -> list[System]:
    """Return ``systems`` with calls between files resolved, and with the protocol of each participant set."""
    if any(system.processes for system in systems):
        from cqos_core.bpmn.calls import run_by_callers

        systems = run_by_callers(systems)
    for system in systems:
        owners: list[Participant | Broker] = [*system.participants.values(), *system.brokers.values()]
        for each in owners:
            each.protocol = each.protocol or system.protocol
    return systems


def _join_plans(whole: System, system: System) -> None:
    """Merge chains and links; the first one of a name wins."""
    for what in ("chain", "link"):
        known = getattr(whole, f"{what}s")
        for name, each in getattr(system, f"{what}s").items():
            if replace(known.setdefault(name, each), place=None) != replace(each, place=None):
                message = f"{what} `{name}` is stated differently in two files; the first holds"
                whole.notes.append(ImportNote("CQ060", "warning", message, each.place))


def _tell_brokers_apart(systems: Sequence[System]) -> None:
    """Rename brokers that several files describe under one name with different addresses."""
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


def join_addresses(whole: System) -> None:
    """Replace the address that a client names by the broker with that address, if it is the only one."""
    there = grouped((address, broker.id) for broker in whole.brokers.values() for address in {*broker.addresses})
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
    """Yield the spellings of a broker address that mean the same, the most exact first."""
    host, _, port = address.rpartition("://")[2].lower().rpartition(":")
    if host and port.isdecimal():
        local = host in {"localhost", "::1"} or host.startswith("127.")
        names = [host] if local or host.replace(".", "").isdecimal() else [host, host.partition(".")[0]]
        yield from (f"{name}:{port}" for name in (*names, *(["localhost"] if local else []), "*"))


def _join_protocol(whole: System, what: str, known: Participant | Broker, other: Participant | Broker) -> None:
    if known.protocol != other.protocol:
        first, second = known.protocol or "none", other.protocol or "none"
        _stated_differently(whole, f"protocol of {what} `{known.id}`", first, second, other.place, "the first holds")


def _join_participant(whole: System, known: Participant, participant: Participant) -> None:
    _join_protocol(whole, "participant", known, participant)
    _join_settings(whole, f"`{{}}` of participant `{known.id}`", known.settings, participant.settings)
    for old, new in participant.remap.items():
        known.remap.setdefault(old, new)
    known.external = known.external and participant.external
    known.starts_after = tuple(dict.fromkeys((*known.starts_after, *participant.starts_after)))
    known.label = known.label or participant.label
    known.groups = participant.groups | known.groups


def _join_broker(whole: System, known: Broker, broker: Broker) -> None:
    _join_protocol(whole, "broker", known, broker)
    _join_settings(whole, f"`{{}}` of broker `{known.id}`", known.settings, broker.settings)
    known.profiles = tuple(dict.fromkeys((*known.profiles, *broker.profiles)))


def _join_bridge(whole: System, known: Bridge, bridge: Bridge) -> None:  # noqa: ARG001 - the signature of all
    carried = {_way(route) for route in known.routes}
    known.routes += tuple(route for route in bridge.routes if _way(route) not in carried)
    known.carries = tuple(dict.fromkeys((*known.carries, *bridge.carries)))


def _way(route: Route) -> object:
    """Return what a route carries, without its place."""
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
            known[name] = replace(
                other, unknown=f"it is stated as {other.text} and as {setting.text}", reported="CQ060"
            )


_OPEN: Final = "which of them holds is not known"


def _stated_differently(
    whole: System, what: str, first: str, second: str, place: Place | None, effect: str = _OPEN
) -> None:
    message = f"{what} is stated differently, as {first} and as {second}; {effect}"
    whole.notes.append(ImportNote("CQ060", "warning", message, place))


def _join_topic(whole: System, known: Topic, topic: Topic) -> None:
    _join_settings(whole, f"`{{}}` of topic `{known.name}`", known.settings, topic.settings)
    known.external = known.external and topic.external
    known.protocol = known.protocol if known.protocol == topic.protocol else None


_JOINED: Final[dict[str, Callable[[System, Any, Any], None]]] = {
    "participants": _join_participant,
    "brokers": _join_broker,
    "bridges": _join_bridge,
    "topics": _join_topic,
}


def _with_own_options(systems: Sequence[System]) -> list[System]:
    """Return ``systems``; options that they state differently move to the participants."""
    stated = grouped(
        ((pack, name), setting.text)
        for system in systems
        for pack, settings in system.options.items()
        for name, setting in settings.items()
    )
    several = {key for key, texts in stated.items() if len({*texts}) > 1}
    return [_with_options_at_participants(system, several) for system in systems] if several else [*systems]


def _with_options_at_participants(system: System, names: Collection[tuple[str, str]]) -> System:
    options: dict[str, Settings] = {}
    participants = dict(system.participants)
    for pack, settings in system.options.items():
        options[pack] = {name: setting for name, setting in settings.items() if (pack, name) not in names}
        moved = {name: setting for name, setting in settings.items() if (pack, name) in names}
        for each in participants.values() if moved else ():
            if (each.protocol or system.protocol) == pack:
                participants[each.id] = replace(each, settings=moved | each.settings)
    return replace(system, options=options, participants=participants)


def _with_own_profiles(systems: Sequence[System]) -> tuple[list[System], list[Profile]]:
    """Return ``systems`` with renamed profiles where they define one name differently, and profiles for ambiguous references.

    A renamed profile has its file in the name: ``fast (robot.xml)``. A file that does not define the name uses the profile of
    the one file in its folder that does.
    """
    defined = grouped((name, profile) for system in systems for name, profile in system.profiles.items())
    several = {name: each for name, each in defined.items() if len({_content(profile) for profile in each}) > 1}
    if not several:
        return [*systems], []
    taken = set(defined)
    called = [
        {name: _called(system.profiles[name], system, taken) for name in system.profiles if name in several}
        for system in systems
    ]
    near = grouped(
        ((_folder(system), name), own)
        for system, names in zip(systems, called, strict=True)
        for name, own in names.items()
    )
    own = []
    for system, names in zip(systems, called, strict=True):
        foreign = {ref.name for ref in _references(system)} & several.keys() - names.keys()
        found = {name: near.get((_folder(system), name), ()) for name in foreign}
        beside = {name: each[0] for name, each in found.items() if len(each) == 1}
        own.append(_with_profiles_called(system, names | beside))
    asked = {ref.name for system in own for ref in _references(system)}
    return own, [_ambiguous(name, each) for name, each in sorted(several.items()) if name in asked]


def _folder(system: System) -> str | None:
    """Return the folder of a system's own file; None if it has none."""
    source = next(iter(system.sources), None)
    return None if source is None else source.rpartition("/")[0]


def _ambiguous(name: str, stated: Sequence[Profile]) -> Profile:
    places = dict.fromkeys(str(each.place) for each in stated if each.place is not None)
    cause = f"stated differently{' at ' if places else ''}{listed([*places], 5)}"
    setting = Setting("", stated[0].place, unknown=cause, reported="CQ060")
    return Profile(name, {EVERY_OTHER: setting}, place=stated[-1].place)


def _called(profile: Profile, system: System, taken: set[str]) -> str:
    source = profile.place.source if profile.place is not None else system.name
    wanted = f"{profile.name} ({source})"
    name = next(name for number in count(1) if (name := wanted if number == 1 else f"{wanted}#{number}") not in taken)
    taken.add(name)
    return name


def _with_profiles_called(system: System, names: Mapping[str, str]) -> System:
    if not names:
        return system

    def renamed(refs: tuple[ProfileRef, ...]) -> tuple[ProfileRef, ...]:
        return tuple(replace(ref, name=names.get(ref.name, ref.name)) for ref in refs)

    def ends(route: Route) -> Route:
        source, target = (replace(end, profiles=renamed(end.profiles)) for end in (route.source, route.target))
        return replace(route, source=source, target=target)

    profiles = [
        replace(each, name=names.get(name, name), base=renamed(each.base)) for name, each in system.profiles.items()
    ]
    return replace(
        system,
        profiles={each.name: each for each in profiles},
        endpoints=[replace(each, profiles=renamed(each.profiles)) for each in system.endpoints],
        brokers={name: replace(each, profiles=renamed(each.profiles)) for name, each in system.brokers.items()},
        bridges={
            name: replace(each, routes=tuple(ends(route) for route in each.routes))
            for name, each in system.bridges.items()
        },
    )


def _references(system: System) -> Iterator[ProfileRef]:
    routes = [route for bridge in system.bridges.values() for route in bridge.routes]
    users: list[Endpoint | Broker] = [*system.endpoints, *system.brokers.values()]
    users += [end for route in routes for end in (route.source, route.target)]
    yield from (ref for profile in system.profiles.values() for ref in profile.base)
    yield from (ref for each in users for ref in each.profiles)


def _content(profile: Profile) -> object:
    """Return what a profile states, without its place."""
    settings = sorted((name, each.text, str(each.unknown)) for name, each in profile.settings.items())
    return tuple(settings), tuple((ref.name, ref.scope) for ref in profile.base)
