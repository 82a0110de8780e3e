"""Reads QoS libraries of DDS-XML: profiles that inherit, with QoS of writers, readers, publishers and subscribers.

A profile of the file becomes a profile of the system under its full name, ``Library::Profile``. Its QoS of each entity is a part
of it (``Library::Profile/datawriter_qos``). Endpoints take a part if they have such an entity and their topic passes the filter.
So a base, which may stand in another file, is named once, as in the file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.xml_source import children, elements, local, text_of
from cqos_core.model.settings import Setting
from cqos_core.model.system import EVERYBODY, ImportNote, Profile, ProfileRef, Room, Scope
from cqos_core.packs import normalise
from cqos_dds.importers.leases import CONNEXT, ParticipantProfile, lay_leases, lease_in
from cqos_dds.importers.policy_forms import (
    OF_ENTITIES,
    OMG,
    OTHER_ENTITIES,
    PARTICIPANT,
    PARTS,
    READER,
    SPELLINGS,
    WRITER,
)
from cqos_dds.importers.unmodelled_elements import DDS_XML_PARTICIPANT, lay_extensions, lay_over_participants
from cqos_dds.importers.xml_values import flag, not_set
from cqos_dds.policies import POLICIES
from cqos_dds.presets import PRESETS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Place, Settings
    from cqos_dds.importers.xml_values import XmlReading

SEPARATOR: Final = "::"
_BUILT_IN: Final = re.compile(r"BuiltinQos\w*::.*")
# Those of participants, transports and tools, which by their names set no policy of writers and readers.
_BESIDE: Final = re.compile(
    r"BuiltinQos\w*::(?:Generic\.(?:Participant|Monitoring)|Feature|Transport|Optimization\.(?:Discovery|Transport))\..*"
)
_KNOWN: Final = frozenset(normalise(name) for each, preset in PRESETS.items() for name in (each, *preset.aliases))
_ANY: Final = "*"
_BASE_PATHS: Final = frozenset(("base_name", "base_name/element"))
_MOST_FILTERS: Final = 1000


@dataclass(slots=True)
class _Stated:
    """A profile as the file states it, or a QoS with a name of its own.

    Attributes:
        base: what it is based on, first what counts least.
        parts: the QoS of each entity, by the element's canonical name.
        lost: parts whose values are not known, because their elements are misspelt.
    """

    name: str
    library: str
    place: Place
    base: list[ProfileRef] = field(default_factory=list)
    parts: dict[str, list[Element]] = field(default_factory=dict)
    lost: list[ProfileRef] = field(default_factory=list)


class QosLibraries:
    """Reads the QoS libraries of one file into profiles of the system.

    Attributes:
        default: name of the profile that counts where an entity of the file names none.
        leases: the leases of participants, by the profile that states them.
        others: the names of QoS of participants and topics that stand in a library by themselves.
        based: what may state a base of the QoS of participants, with its library and the pattern of participants that take it.
    """

    def __init__(self, reading: XmlReading) -> None:
        self.reading = reading
        self.stated: dict[str, _Stated] = {}
        self.default: str | None = None
        self.leases: dict[str, Setting] = {}
        self.others: set[str] = set()
        self.based: list[tuple[Element, str, str]] = []

    def library(self, element: Element) -> None:
        """Read one ``qos_library``."""
        name = self.reading.name(element)
        for child in elements(element):
            if local(child) == "qos_profile":
                self.profile(child, name)
            elif part_of(child) in PARTS or part_of(child) in OTHER_ENTITIES:
                self.single(child, name)
            else:
                self.reading.pass_over(child, f"qos_library/{local(child)}")

    def profile(self, element: Element, library: str = "") -> None:
        """Read one ``qos_profile``, which may stand outside of any library."""
        name = _full(self.reading.name(element), library)
        stated = self.new(name, library, element)
        stated.base += self.bases(element, library)
        if flag(element.get("is_default_qos")):
            self.default = name
        for child in elements(element):
            part = part_of(child)
            if part in PARTS:
                stated.parts.setdefault(part, []).append(child)
            elif part in OTHER_ENTITIES:
                self.other(child, part, library=library)
                self.lease(child, name)
                if part == PARTICIPANT:
                    self.based.append((element, library, _ANY))
            elif local(child) != "base_name":
                self.not_read(child, stated)

    def not_read(self, element: Element, stated: _Stated) -> None:
        """Leave unknown what a misspelt element of a profile may set."""
        near = self.reading.unknown(element, f"qos_profile/{local(element)}", PARTS)
        if near is not None:
            cause = f"{shown(local(element))} is no element of a profile"
            place, number = self.reading.place(element), len(stated.lost) + 1
            stated.lost.append(self.unknown_part(f"{stated.name}/{near}?{number}", near, place, cause, "DDS902"))

    def single(self, element: Element, library: str) -> None:
        """Read the QoS of an entity that stands in a library by itself."""
        part = part_of(element)
        if part in OTHER_ENTITIES:
            name = _full((element.get("name") or "").strip(), library)
            self.others.add(name)
            self.other(element, part, library=library)
            self.lease(element, name)
            return
        name = _full(self.reading.name(element), library)
        known = self.stated.get(name)
        if known is None or part in known.parts:
            known = self.new(name, library, element)
        known.parts[part] = [element]

    def new(self, name: str, library: str, element: Element) -> _Stated:
        """Take a name; tell where it is taken."""
        stated = _Stated(name, library, self.reading.place(element))
        first = self.stated.setdefault(name, stated)
        if first is not stated:
            message = f"profile `{name}` is stated twice, first at {first.place}"
            self.reading.problem("CQ012", message, element, "keep one of them")
        return stated

    def other(self, element: Element, part: str, participant: str = _ANY, library: str = "") -> None:
        """Read what no endpoint takes values from, for what is wrong with it, and for what it may decide of participants."""
        self.reading.policies(element, OMG, OTHER_ENTITIES[part], {})
        if part == PARTICIPANT:
            self.based.append((element, library, participant))
            found = [each for each in DDS_XML_PARTICIPANT.undecided(element, "") if each[0] not in _BASE_PATHS]
            reading = self.reading
            reading.parts += lay_over_participants(
                reading.system, reading.placed(found), ("connext", "standard"), participant=participant
            )

    def lease(self, element: Element, profile: str) -> None:
        """Remember the lease that the QoS of participants in a profile states."""
        lease = lease_in(element, CONNEXT, self.reading) if part_of(element) == PARTICIPANT else None
        if lease is not None:
            self.leases[profile] = lease

    def lease_of(self, profile: str, seen: frozenset[str] = frozenset()) -> Setting | None:
        """Return the lease of participants that a profile or one of its bases states."""
        if profile in self.leases or profile in seen or profile not in self.stated:
            return self.leases.get(profile)
        bases = reversed(self.stated[profile].base)
        found = (self.lease_of(ref.name, seen | {profile}) for ref in bases)
        return next((lease for lease in found if lease is not None), None)

    def lay_leases(self) -> None:
        """Lay the lease of the default profile over the participants."""
        named = dict.fromkeys((*self.leases, *([self.default] if self.default is not None else ())))
        profiles = [ParticipantProfile(name, name == self.default, self.lease_of(name)) for name in named]
        lay_leases(profiles, ("connext", "standard"), self.reading)

    def bases(self, element: Element, library: str) -> list[ProfileRef]:
        """Return what a profile, or a single QoS, is based on; a later one wins over an earlier one."""
        found = []
        for full, where in _named_bases(element, library):
            if _BESIDE.fullmatch(full):
                continue
            place = self.reading.place(where)
            if cause := self.not_known(full, where):
                found += self.unknown_base(full, place, *cause)
            else:
                found += [ProfileRef(full, place, scope) for scope in _scopes(full)]
        return found

    def leave_participants_open(self, defined: Callable[[str], bool]) -> None:
        """Leave unknown what participants take from a base that is not ``defined`` in any file."""
        notes: dict[tuple[str, Place], ImportNote] = {}
        for element, library, participant in self.based:
            for name, where in _named_bases(element, library):
                if _BUILT_IN.fullmatch(name) or defined(name):
                    continue
                place, open_text = self.reading.place(where), not_set(name)
                why = f"not known: {open_text}" if open_text else "in none of the files"
                cause = f"the base {shown(name)} of the QoS of participants is {why}"
                # The base of a whole profile is reported by what else takes it; several participants may have one base.
                if not open_text and part_of(element) == PARTICIPANT:
                    advice = "check the file that defines it together with this one"
                    notes.setdefault((name, place), ImportNote("CQ204", "error", cause, place, advice))
                unknown = Setting(name, place, unknown=cause, reported="" if open_text else "CQ204")
                lay_extensions(self.reading.system, unknown, ("connext", "standard"), participant)
        self.reading.system.notes += notes.values()

    def not_known(self, name: str, where: Element) -> tuple[str, str] | None:
        """Why a base cannot be looked up, and the code under which that is reported; None where it can be."""
        if cause := not_set(name):
            return f"the base {shown(name)} is not known: {cause}", ""
        if not _BUILT_IN.fullmatch(name) or normalise(name) in _KNOWN:
            return None
        message = f"the base `{name}` is built into RTI Connext, and what it sets is not known here"
        self.reading.note("DDS904", message, where)
        return message, "DDS904"

    def unknown_base(self, name: str, place: Place, cause: str, reported: str) -> list[ProfileRef]:
        """Take a base whose values are not known as one part for each entity, in which every policy is unknown."""
        return [self.unknown_part(f"{name}/{part}", part, place, cause, reported) for part in PARTS]

    def unknown_part(self, name: str, part: str, place: Place, cause: str, reported: str) -> ProfileRef:
        """Make a part in which every policy of its entity is unknown."""
        entity, role = PARTS[part]
        unknown = Setting("", place, unknown=cause, reported=reported)
        self.add(Profile(name, {each.name: unknown for each in POLICIES if entity in each.entities}, (), place))
        return ProfileRef(name, place, Scope(role, part=part))

    # Profiles of the system

    def make(self) -> None:
        """Put every profile, and each part of it, among the profiles of the system."""
        for stated in self.stated.values():
            refs = [ref for part, each in stated.parts.items() for ref in self.parts(stated, part, each)]
            self.add(Profile(stated.name, {}, (*stated.base, *refs, *stated.lost), stated.place))
        self.lay_leases()

    def parts(self, stated: _Stated, part: str, qos: list[Element]) -> list[ProfileRef]:
        """Make the parts of one profile for one entity; filters come first, in order, then what has none."""
        _, role = PARTS[part]
        filtered = [(each.get("topic_filter") or "").strip() or _ANY for each in qos]
        patterns = [pattern for pattern in filtered if pattern != _ANY]
        if len(qos) > _MOST_FILTERS:
            message = f"there are more than {_MOST_FILTERS} `{part}` in profile `{stated.name}`, which is refused"
            self.reading.problem("CQ002", message, qos[_MOST_FILTERS])
            return []
        refs = []
        for number, (element, pattern) in enumerate(zip(qos, filtered, strict=True), 1):
            name = f"{stated.name}/{part}" if len(qos) == 1 else f"{stated.name}/{part}[{number}]"
            self.add(self.part(name, element, part, stated.library))
            taken_before = patterns if pattern == _ANY else patterns[: patterns.index(pattern)]
            scope = Scope(role, pattern, tuple(taken_before), part)
            if pattern != _ANY or _ANY not in filtered[: number - 1]:
                refs.append(ProfileRef(name, self.reading.place(element), scope))
            own = (element.get("name") or "").strip()
            alias = f"{stated.name}{SEPARATOR}{own}"
            if own and alias != stated.name and not stated.name.endswith(f"{SEPARATOR}{own}"):
                only = ProfileRef(name, self.reading.place(element), Scope(role, part=part))
                self.add(Profile(alias, {}, (only,), self.reading.place(element)))
        return refs

    def part(self, name: str, element: Element, part: str, library: str) -> Profile:
        """Read the QoS of one entity as a profile."""
        settings: Settings = {}
        entity, _ = PARTS[part]
        base = tuple(self.bases(element, library))
        for listing in children(element, "base_name"):
            element.remove(listing)
        self.reading.policies(element, OMG, entity, settings)
        place = self.reading.place(element)
        return Profile(name, settings, base, place, Room(place, OF_ENTITIES[part], restated=True))

    def add(self, profile: Profile) -> None:
        """Put a profile among those of the system."""
        self.reading.system.profiles.setdefault(profile.name, profile)


def _scopes(base: str) -> tuple[Scope, ...]:
    """What is taken of a base: all, and of one that is built in what it sets of writers and readers."""
    if not _BUILT_IN.fullmatch(base):
        return (EVERYBODY,)
    return tuple(Scope(PARTS[part][1], part=part) for part in (WRITER, READER))


def _named_bases(element: Element, library: str) -> Iterator[tuple[str, Element]]:
    """Yield the full name of each base that an element states, and where; a later one wins over an earlier one."""
    named = [(element.get("base_name") or "", element)]
    for listing in children(element, "base_name"):
        named += [(text_of(each), each) for each in elements(listing)] or [(text_of(listing), listing)]
    for name, where in named:
        if name.strip():
            yield name.strip() if SEPARATOR in name else _full(name.strip(), library), where


def part_of(element: Element) -> str:
    """The canonical name of an element that holds the QoS of an entity."""
    name = local(element)
    return SPELLINGS.get(name, name)


def _full(name: str, library: str) -> str:
    return f"{library}{SEPARATOR}{name}" if library else name
