"""Reads XML profiles of Fast DDS as what they are to a program of DDS: the QoS of data writers and data readers.

A program names the profile it takes. So each becomes a profile of the system under its name; writers and readers may have
profiles of one name. A profile that names its topic, as those of Fast DDS 1 do, is an endpoint on it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.xml_source import children, elements, local, parse_xml, text_of
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Profile, ProfileRef, Room, Scope, Topic
from cqos_dds.extension_policies import TOPIC_KIND
from cqos_dds.importers.leases import FAST as FAST_LEASE
from cqos_dds.importers.leases import ParticipantProfile, lay_leases, lease_in
from cqos_dds.importers.policy_forms import FAST_ALSO, FAST_QOS, FAST_READ_ONLY, FAST_TOPIC, OF_PROFILES
from cqos_dds.importers.unmodelled_elements import FAST, FAST_PARTICIPANT, FAST_SECTIONS, lay_over_participants
from cqos_dds.importers.xml_values import MOST_TAGS, PROTOCOL, XmlReading, expand, flag, not_set
from cqos_dds.kept_policies import (
    MAX_INSTANCES,
    MAX_PER_INSTANCE,
    MAX_SAMPLES,
    SERVICE_MAX_INSTANCES,
    SERVICE_MAX_PER_INSTANCE,
    SERVICE_MAX_SAMPLES,
)

if TYPE_CHECKING:
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Role, System
    from cqos_core.packs import Policy
    from cqos_core.packs.xml_importer import Undecided

_ROLES: Final[dict[str, tuple[str, Role]]] = {
    "data_writer": ("data_writer", PUBLISHER),
    "publisher": ("data_writer", PUBLISHER),
    "data_reader": ("data_reader", SUBSCRIBER),
    "subscriber": ("data_reader", SUBSCRIBER),
}
_IMPLEMENTATION: Final = "implementation"
_FAST_DDS: Final = "fastdds"
_LIMITS: Final = frozenset(
    policy.name
    for policy in (
        MAX_SAMPLES,
        MAX_INSTANCES,
        MAX_PER_INSTANCE,
        SERVICE_MAX_SAMPLES,
        SERVICE_MAX_INSTANCES,
        SERVICE_MAX_PER_INSTANCE,
    )
)
_KEYS: Final = {"WITH_KEY": "true", "NO_KEY": "false"}
_OF_TOPIC: Final = frozenset(("kind", "name", "dataType"))
_FORMS: Final[dict[str, dict[str, dict[str, Policy]]]] = {
    "qos": FAST_QOS | {other: FAST_QOS[name] for other, name in FAST_ALSO.items()} | FAST_READ_ONLY,
    "topic": FAST_TOPIC,
}


def read(source: Source, context: ReadContext) -> System:
    """Read profiles of writers and readers; what a profile leaves open has the default of Fast DDS.

    Raises:
        InputError: it is no XML, holds no profiles, or a value that Fast DDS refuses; with every problem found.
    """
    with gc_paused():
        root = parse_xml(source, MOST_TAGS)
        expand(root, context)
        return _File(source, context).read(root)


class _File(XmlReading):
    """Reads one file."""

    unmodelled = FAST
    whole_paths = True

    def read(self, root: Element) -> System:
        """Read all profiles."""
        if local(root) not in {"dds", "profiles"}:
            message = f"this is no file of Fast DDS profiles: its first element is {shown(local(root))}"
            self.problem("CQ001", message, root, "expected `dds` or `profiles`")
        self.system.options[PROTOCOL] = {_IMPLEMENTATION: Setting(_FAST_DDS, self.place(root))}
        within = [root, *children(root, "profiles")]
        participants = []
        deciding: list[Undecided] = []
        for element in (child for above in within for child in elements(above)):
            if local(element) == "participant":
                self.pass_over(element, "participant")
                is_default = flag(element.get("is_default_profile"))
                lease = lease_in(element, FAST_LEASE, self)
                participants.append(ParticipantProfile(element.get("profile_name") or "", is_default, lease))
                deciding += FAST_PARTICIPANT.undecided(element, "")
            elif local(element) in _ROLES and element.get("profile_name") is not None:
                self.profile(element)
            elif local(element) not in {"profiles", "types"}:
                self.pass_over(element, local(element))
                deciding += FAST_SECTIONS.undecided(element, local(element))
        lay_leases(participants, (_FAST_DDS,), self)
        self.parts += lay_over_participants(self.system, self.placed(deciding), (_FAST_DDS,))
        return self.finish()

    def profile(self, element: Element) -> None:
        """Read one profile, and the endpoint that it is if it names a topic."""
        name = self.name(element, "profile_name")
        part, role = _ROLES[local(element)]
        settings: Settings = {}
        for child in elements(element):
            forms = _FORMS.get(local(child))
            if forms is None:
                self.pass_over(child, f"{part}/{local(child)}")
                self.not_modelled(child, local(child), settings)
                continue
            if local(child) == "topic":
                for each in [each for each in elements(child) if local(each) in _OF_TOPIC]:
                    if local(each) == "kind":
                        self.value(each, TOPIC_KIND, "topic/kind", settings)
                        # The type of the program decides with it, so no edit of the file alone is a fix.
                        if TOPIC_KIND.name in settings:
                            settings[TOPIC_KIND.name] = replace(settings[TOPIC_KIND.name], derived=True)
                    element.set(local(each), text_of(each))
                    child.remove(each)
            self.policies(child, forms, "", settings)
        place = self.place(element)
        inner = Profile(f"{name}/{part}", settings, (), place, Room(place, OF_PROFILES, restated=True))
        if inner.name in self.system.profiles:
            message = f"{part} profile `{name}` is stated twice, first at {self.system.profiles[inner.name].place}"
            self.problem("CQ012", message, element, "keep one of them")
        self.system.profiles[inner.name] = inner
        outer = self.system.profiles.setdefault(name, Profile(name, {}, (), place))
        outer.base = (*outer.base, ProfileRef(inner.name, place, Scope(role, part=part)))
        if element.get("name"):
            self.endpoint(element, name, role)

    def value(self, element: Element, policy: Policy, path: str, settings: Settings) -> None:
        """Read one value; of limits, a zero is none."""
        if policy.name in _LIMITS and text_of(element) == "0":
            settings[policy.name] = Setting("unlimited", self.place(element))
        else:
            super().value(element, policy, path, settings)

    def endpoint(self, element: Element, profile: str, role: Role) -> None:
        """Make the endpoint of a profile that names its topic."""
        program = PurePath(self.source.name).stem or "program"
        place, topic = self.place(element), (element.get("name") or "").strip()
        self.system.participants.setdefault(program, Participant(program, place=place))
        about = self.system.topics.setdefault(topic, Topic(topic, place=place))
        keyed = _KEYS.get((element.get("kind") or "").strip())
        if keyed is not None:
            about.settings.setdefault("keyed", Setting(keyed, place))
        self.system.endpoints.append(
            Endpoint(
                id=f"{profile}/{role}",
                role=role,
                topic=topic,
                participant=program,
                profiles=(ProfileRef(profile, place),),
                type=(element.get("dataType") or "").strip() or None,
                external=bool(not_set(topic)),
                place=place,
            )
        )
