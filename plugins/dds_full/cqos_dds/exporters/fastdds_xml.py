"""Writes XML profiles of Fast DDS: one of a data writer or data reader for each endpoint, under the endpoint's id."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.files.export import unique_name
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.export import Exported
from cqos_dds.exporters.xml_form import (
    PROTOCOL,
    Spelling,
    XmlWriter,
    dds_endpoints,
    facts_left_out,
    only_on_some_topics,
    plain,
    stated,
    unsayable,
)
from cqos_dds.extension_policies import TOPIC_KIND
from cqos_dds.importers.policy_forms import FAST_QOS, FAST_TOPIC
from cqos_dds.policies import KEYED
from cqos_dds.requested_policies import DURABILITY

if TYPE_CHECKING:
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_dds.exporters.xml_form import Stated

_NAMESPACE: Final = "http://www.eprosima.com"
SPELLING: Final = Spelling(
    ("DURATION_INFINITY", "DURATION_INFINITY"), "0", idl=False, element="name", dotted_bytes=True
)
_TAGS: Final[dict[str, str]] = {PUBLISHER: "data_writer", SUBSCRIBER: "data_reader"}


def write(system: System, context: ExportContext) -> Exported:
    """Write the QoS of every endpoint.

    With the setting ``topics=named`` each profile names its topic and type, as Fast DDS 1 had it; later versions may refuse
    that, so by default a program tells by the name of the profile which one it takes.
    """
    notes: dict[str, None] = {}
    form = XmlWriter(SPELLING, _NAMESPACE, notes)
    root = form.root("dds")
    profiles = form.below(root, "profiles")
    names: dict[str, set[str]] = {tag: set() for tag in _TAGS.values()}
    count = 0
    alone = not system.endpoints
    for each, part in dds_endpoints(with_profiles_tried(system, PROTOCOL) if alone else system, context, notes):
        if alone and only_on_some_topics(each, notes):
            continue
        values = stated(each, part, notes)
        if values is None:
            continue
        # Writers of Fast DDS have another default than those of the standard.
        durability = plain(DURABILITY, part.profile.values[part.pack.vocabulary.indices["endpoint", DURABILITY.name]])
        if durability is not None:
            values[DURABILITY.name] = durability
        tag = _TAGS[part.role]
        wanted = each.endpoint.profiles[0].name if alone else each.id
        name = unique_name("".join("_" if unsayable(one) else one for one in wanted), names[tag])
        element = form.below(profiles, tag, profile_name=name)
        written = _topic(
            form, element, part, values, each.id, named=not alone and context.settings.get("topics") == "named"
        )
        qos = form.below(element, "qos")
        written |= form.policies(qos, FAST_QOS, values, each.id)
        for policy in part.pack.policies:
            if policy.name in values.keys() - written and not _goes_without_saying(policy.name, values, part):
                notes[f"endpoint `{each.id}`: profiles of Fast DDS have no {policy.name}"] = None
        if not len(qos):
            element.remove(qos)
        count += 1
    if count:
        facts_left_out(system, notes)
        settled = sum("domain" in each.settings for each in system.participants.values())
        said = f"the domains of {settled} participants are chosen by the program, not by these profiles"
        notes |= {said: None} if settled else {}
    whose = f" of {system.name}" if system.name else ""
    return Exported(form.text(root, f"Profiles{whose}, one for each endpoint") if count else "", count, tuple(notes))


def _topic(form: XmlWriter, above: Element, part: Resolved, values: Stated, whose: str, *, named: bool) -> set[str]:
    """Write what stands below ``topic``; return the names of the policies that do."""
    topic = form.below(above, "topic")
    kind = values.get(TOPIC_KIND.name)
    if kind is not None:
        form.below(topic, "kind").text = str(kind).upper()
    if named:
        keyed = part.profile.values[part.pack.vocabulary.indices["topic", KEYED.name]]
        if isinstance(keyed, int) and kind is None:
            form.below(topic, "kind").text = "WITH_KEY" if keyed else "NO_KEY"
        form.below(topic, "name").text = part.key
        if part.endpoint.type and not unsayable(part.endpoint.type):
            form.below(topic, "dataType").text = part.endpoint.type
    written = {TOPIC_KIND.name} | form.policies(topic, FAST_TOPIC, values, whose)
    if not len(topic):
        above.remove(topic)
    return written


def _goes_without_saying(name: str, values: Stated, part: Resolved) -> bool:
    """Whether a value is what there is without it."""
    policy = part.pack.policies[part.pack.vocabulary.indices["endpoint", name]]
    default = policy.default_for(part.role)
    if default is None or default in policy.words:
        return False
    meant = policy.domain.parse(default)
    return values[name] == (policy.domain.format(meant) if policy.domain.kind == "choice" else meant)
