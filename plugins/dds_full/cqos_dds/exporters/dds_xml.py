"""Writes DDS-XML 1.0: a library of QoS profiles, one for each topic, and the participants that use them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.files.export import unique_name
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.export import Exported
from cqos_dds.exporters.xml_form import (
    PROTOCOL,
    Spelling,
    XmlWriter,
    complete,
    dds_endpoints,
    facts_left_out,
    only_on_some_topics,
    stated,
    unsayable,
)
from cqos_dds.importers.policy_forms import OMG, PARTS, PUBLISHER_QOS, READER, SUBSCRIBER_QOS, WRITER
from cqos_dds.policies import DOMAIN

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.system import System
    from cqos_core.packs import Policy
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_dds.exporters.xml_form import Stated

_NAMESPACE: Final = "http://www.omg.org/spec/DDS-XML"
SPELLING: Final = Spelling(
    ("DURATION_INFINITE_SEC", "DURATION_INFINITE_NSEC"),
    "LENGTH_UNLIMITED",
    idl=True,
    element="element",
    dotted_bytes=False,
)
_LIBRARY, _DOMAINS, _PARTICIPANTS = "Qos", "Domains", "Participants"
# One spelling of each policy, whatever is read.
_FORMS: Final[Mapping[str, Mapping[str, Policy]]] = {
    tag: form for tag, form in OMG.items() if tag not in {"data_representation", "type_consistency_enforcement"}
}


@dataclass(slots=True)
class _Profile:
    """A profile that is written: the values of each part that is in use."""

    library: str
    name: str
    parts: dict[str, Stated] = field(default_factory=dict)


@dataclass(slots=True)
class _Owner:
    """A participant that is written.

    Attributes:
        topics: topic to its type, None where it has none.
        endpoints: role, topic, name and profile of each endpoint.
    """

    name: str
    domain: str
    topics: dict[str, str | None] = field(default_factory=dict)
    endpoints: list[tuple[str, str, str, _Profile]] = field(default_factory=list)


def write(system: System, context: ExportContext) -> Exported:
    """Write the QoS that is stated; what is not stated has the same default wherever the file is read.

    With the setting ``participants=without`` only the library is written: Cyclone DDS takes no other.
    """
    return _File(system, context).write()


class _File:
    """Writes one system."""

    def __init__(self, system: System, context: ExportContext) -> None:
        self.stated = system
        self.alone = not system.endpoints
        # Unused profiles are written as what writers and readers would get from them.
        self.system = with_profiles_tried(system, PROTOCOL) if self.alone else system
        self.with_participants = not self.alone and context.settings.get("participants") != "without"
        self.context = context
        self.notes: dict[str, None] = {}
        self.form = XmlWriter(SPELLING, _NAMESPACE, self.notes)
        self.profiles: dict[str, list[_Profile]] = {}
        self.names: dict[str, set[str]] = {}
        self.owners: dict[str, _Owner] = {}
        self.taken: set[str] = set()

    def write(self) -> Exported:
        """Put the file together."""
        count = 0
        for each, part in dds_endpoints(self.system, self.context, self.notes):
            if self.alone and only_on_some_topics(each, self.notes):
                continue
            values = stated(each, part, self.notes)
            if values is None:
                continue
            complete(values, part, _FORMS)
            profile = self.profile(part, values, each.id)
            if self.with_participants:
                self.endpoint(part, each.id, profile)
            count += 1
        if count:
            facts_left_out(self.stated, self.notes)
        root = self.form.root("dds")
        self.libraries(root)
        if self.with_participants:
            self.participants(root)
        name = f" of {self.system.name}" if self.system.name else ""
        which = "" if self.alone else ", one for each topic"
        which += ", and the participants that use them" if self.with_participants else ""
        return Exported(self.form.text(root, f"QoS profiles{name}{which}") if count else "", count, tuple(self.notes))

    # What is written

    def profile(self, part: Resolved, values: Stated, whose: str) -> _Profile:
        """Return a profile of the topic that an endpoint with these values can use."""
        wanted = {tag: self.of_part(tag, values) for tag in _TAGS[part.role]}
        written = {name for inner in wanted.values() for name in inner}
        for name in values.keys() - written:
            self.notes[f"endpoint `{whose}`: {name} has no place in DDS-XML"] = None
        topic = part.key or ""
        for known in self.profiles.setdefault(topic, []):
            if all(known.parts.get(tag, inner) == inner for tag, inner in wanted.items()):
                known.parts |= wanted
                return known
        library, _, own = topic.rpartition("::") if self.alone else ("", "", topic)
        library = _name(library) if library else _LIBRARY
        made = _Profile(library, unique_name(_name(own), self.names.setdefault(library, set())), dict(wanted))
        self.profiles[topic].append(made)
        return made

    def of_part(self, tag: str, values: Stated) -> Stated:
        """Return those values that stand in the QoS of one entity."""
        entity, _ = PARTS[tag]
        allowed = {policy.name for form in _FORMS.values() for policy in form.values() if entity in policy.entities}
        if tag in {PUBLISHER_QOS, SUBSCRIBER_QOS}:
            allowed -= {policy.name for form in _FORMS.values() for policy in form.values() if _of_endpoint(policy)}
        return {name: value for name, value in values.items() if name in allowed}

    def endpoint(self, part: Resolved, name: str, profile: _Profile) -> None:
        """Remember an endpoint with its participant."""
        stated_owner = part.participant.participant
        owner = self.owners.get(stated_owner.id)
        if owner is None:
            number = part.participant.values[part.pack.vocabulary.indices["option", DOMAIN.name]]
            if not isinstance(number, int):
                self.notes[f"participant `{stated_owner.id}`: its domain is not known, so domain 0 is written"] = None
                number = 0
            owner = _Owner(unique_name(_name(stated_owner.id), self.taken), str(number))
            self.owners[stated_owner.id] = owner
        topic = part.key or ""
        type_name = part.endpoint.type
        if type_name is not None and unsayable(type_name):
            type_name = None
        known = owner.topics.setdefault(topic, type_name)
        if type_name is not None and known not in {None, type_name}:
            self.notes[f"endpoint `{name}`: `{stated_owner.id}` has `{topic}` with type {known} already"] = None
        owner.topics[topic] = known or type_name
        own = name.removeprefix(f"{stated_owner.id}/").removeprefix(f"{part.role}/")
        owner.endpoints.append((part.role, topic, _name(own), profile))

    # The document

    def libraries(self, root: Element) -> None:
        """Write the libraries of QoS."""
        below = self.form.below
        found: dict[str, Element] = {}
        for profile in (profile for profiles in self.profiles.values() for profile in profiles):
            library = found.get(profile.library)
            if library is None:
                library = found[profile.library] = below(root, "qos_library", name=profile.library)
            element = below(library, "qos_profile", name=profile.name)
            for tag in PARTS:
                if profile.parts.get(tag):
                    self.form.policies(below(element, tag), _FORMS, profile.parts[tag], profile.name)

    def participants(self, root: Element) -> None:
        """Write the participants, and the domains they are in."""
        below = self.form.below
        domains = below(root, "domain_library", name=_DOMAINS)
        for number in dict.fromkeys(owner.domain for owner in self.owners.values()):
            below(domains, "domain", name=f"domain_{number}", domain_id=number)
        participants = below(root, "domain_participant_library", name=_PARTICIPANTS)
        for owner in self.owners.values():
            self.owner(participants, owner)

    def owner(self, above: Element, owner: _Owner) -> None:
        """Write one participant."""
        below = self.form.below
        domain = f"{_DOMAINS}::domain_{owner.domain}"
        element = below(above, "domain_participant", name=owner.name, domain_ref=domain)
        for type_name in dict.fromkeys(filter(None, owner.topics.values())):
            below(element, "register_type", name=type_name, type_ref=type_name)
        for topic, stated_type in owner.topics.items():
            attributes = {"register_type_ref": stated_type} if stated_type else {}
            below(element, "topic", name=topic, **attributes)
        for role, (group, inner) in _ENTITIES.items():
            by_profile = grouped(
                (profile.name, (topic, name, profile))
                for own_role, topic, name, profile in owner.endpoints
                if own_role == role
            )
            names: set[str] = set()
            for number, (profile_name, members) in enumerate(by_profile.items(), 1):
                base = f"{_LIBRARY}::{profile_name}"
                holder = below(element, group, name=f"{group}_{number}")
                below(holder, f"{group}_qos", base_name=base)
                for topic, name, _ in members:
                    made = below(holder, inner, name=unique_name(name, names), topic_ref=topic)
                    below(made, inner.replace("_", "") + "_qos", base_name=base)


_TAGS: Final[dict[str, tuple[str, str]]] = {
    PUBLISHER: (WRITER, PUBLISHER_QOS),
    SUBSCRIBER: (READER, SUBSCRIBER_QOS),
}
_ENTITIES: Final[dict[str, tuple[str, str]]] = {
    PUBLISHER: ("publisher", "data_writer"),
    SUBSCRIBER: ("subscriber", "data_reader"),
}


def _of_endpoint(policy: Policy) -> bool:
    return bool({"writer", "reader"} & set(policy.entities))


def _name(text: str) -> str:
    """Return a text as a name in the form: two colons would separate a library from what is in it."""
    return (
        "".join("_" if unsayable(character) else character for character in text.strip().replace("::", "."))
        or "unnamed"
    )
