"""Tries profiles that no endpoint uses: each as a publisher and a subscriber that match.

A library of profiles has no endpoints, so there would be nothing to check. Its authors want to know two things: endpoints with
its profiles can be created, and both ends of a topic with the same profile are compatible.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Final

from cqos_core.model.system import (
    PUBLISHER,
    SUBSCRIBER,
    Endpoint,
    ImportNote,
    Participant,
    Profile,
    ProfileRef,
    Role,
    Scope,
    System,
    Topic,
)

_ANY: Final = "*"


def with_profiles_tried(system: System, protocol: str | None = None) -> System:
    """Return a system in which every profile is used, if ``system`` has profiles and no endpoint that could use them.

    Each profile becomes one publisher and one subscriber, as far as it says something about them, on a topic of its own.
    ``protocol`` judges where the system states none; without any, nothing is tried.
    """
    if system.endpoints or system.bridges or not system.profiles or (system.protocol or protocol) is None:
        return system
    made = replace(
        system, topics=dict(system.topics), participants=dict(system.participants), endpoints=[], hypothetical=True
    )
    tried: list[Profile] = []
    # People name whole profiles, not those that are a part of one only.
    parts = {ref.name for each in system.profiles.values() for ref in each.base if ref.scope.part is not None}
    for profile in (each for name, each in system.profiles.items() if name not in parts):
        before = len(made.endpoints)
        for pattern in _patterns(profile.name, system):
            _try(profile, pattern, made)
        if len(made.endpoints) > before:
            tried.append(profile)
    if not tried:
        return system
    count = "1 profile, which is" if len(tried) == 1 else f"{len(tried)} profiles, each"
    message = f"there are no endpoints here but {count} tried as a publisher and a subscriber that meet each other"
    advice = "check it together with the system that uses it to see what its endpoints really get"
    made.notes = [*system.notes, ImportNote("CQ061", "note", message, tried[0].place, advice)]
    return made


def unused_profiles(system: System, protocol: str | None = None) -> System | None:
    """Return a hypothetical system that tries the profiles which no endpoint of ``system`` uses; None where there are none.

    A profile that only publishers use is tried as a subscriber only if it has settings for subscribers alone.
    """
    if system.hypothetical or not system.profiles or not (system.endpoints or system.bridges):
        return None
    used = _used(system)
    parts = {ref.name for each in system.profiles.values() for ref in each.base if ref.scope.part is not None}
    somewhere = {name for name, _ in used}
    open_roles = {
        name: [
            role
            for role in (PUBLISHER, SUBSCRIBER)
            if (name, role) not in used and (name not in somewhere or any(ref.scope.role == role for ref in each.base))
        ]
        for name, each in system.profiles.items()
        if name not in parts and (each.protocol or system.protocol or protocol) is not None
    }
    if not any(open_roles.values()):
        return None
    made = replace(
        system,
        topics={},
        participants={},
        endpoints=[],
        overlays=[],
        bridges={},
        notes=[],
        flows=(),
        processes={},
        chains={},
        links={},
        hypothetical=True,
    )
    for name, roles in open_roles.items():
        for pattern in _patterns(name, system) if roles else ():
            _try(system.profiles[name], pattern, made, roles)
    return made if made.endpoints else None


def _used(system: System) -> set[tuple[str, Role]]:
    """Return the profiles that endpoints take values from, each with the role in which they do."""
    named = {(ref.name, each.role) for each in system.endpoints for ref in each.profiles}
    both: list[ProfileRef] = [ref for broker in system.brokers.values() for ref in broker.profiles]
    for bridge in system.bridges.values():
        both += [ref for route in bridge.routes for end in (route.source, route.target) for ref in end.profiles]
    named |= {(ref.name, role) for ref in both for role in (PUBLISHER, SUBSCRIBER)}
    return named | {(ref.name, role) for name, role in named for ref in _bases(name, system)}


def _try(profile: Profile, pattern: str, system: System, among: Sequence[Role] = (PUBLISHER, SUBSCRIBER)) -> None:
    topic = _topic(pattern, profile.name)
    if topic in system.topics:
        return  # another profile is tried on this topic
    roles = [role for role in among if _says_something(profile, role, topic, system)]
    if not roles:
        return
    system.topics[topic] = Topic(topic, external=len(roles) == 1, place=profile.place)
    where = "" if pattern == _ANY else f" on {pattern}"
    for role in roles:
        used = (ProfileRef(profile.name, profile.place),)
        name = f"{profile.name}/{role}{where}"
        system.participants[name] = Participant(name, profile.protocol, place=profile.place)
        system.endpoints.append(
            Endpoint(id=name, role=role, topic=topic, participant=name, profiles=used, place=profile.place)
        )


def _says_something(profile: Profile, role: Role, topic: str, system: System) -> bool:
    """Whether a profile, or one it is based on, has settings for endpoints of a role, or a mistake to report."""
    refs = _bases(profile.name, system, lambda scope: scope.covers(role, topic))
    # A profile that is based on itself, a preset or an unknown profile is reported.
    return bool(profile.settings) or any(
        ref.name == profile.name or ref.name not in system.profiles or system.profiles[ref.name].settings
        for ref in refs
    )


def _patterns(name: str, system: System) -> dict[str, None]:
    """The patterns of topics that a profile tells apart, ``*`` first."""
    return dict.fromkeys([_ANY, *(ref.scope.topic for ref in _bases(name, system))])


def _bases(name: str, system: System, counts: Callable[[Scope], bool] = lambda _scope: True) -> Iterator[ProfileRef]:
    """Yield the bases of a profile, and of each that it is based on, if the scope counts."""
    seen, waiting = {name}, [name]
    while waiting:
        profile = system.profiles.get(waiting.pop())
        for ref in profile.base if profile is not None else ():
            if counts(ref.scope):
                yield ref
                if ref.name not in seen:
                    seen.add(ref.name)
                    waiting.append(ref.name)


def _topic(pattern: str, profile: str) -> str:
    """Return a topic of its own for a profile, which matches a pattern if possible."""
    name = pattern.replace(_ANY, profile, 1).replace(_ANY, "").replace("?", "x")
    return name if fnmatchcase(name, pattern) else pattern
