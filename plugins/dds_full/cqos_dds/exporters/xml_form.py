"""The QoS of endpoints as XML forms of DDS write it: enumerations, durations, lengths, bytes."""

from __future__ import annotations

import base64
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from lxml import etree

from cqos_core.files.export import ExportEndpoint, endpoints_of_pack
from cqos_core.packs import ENDPOINT, INFINITE, Choice, Count, Duration, Names, is_plain
from cqos_dds.kinds import Compressions
from cqos_dds.requested_policies import DATA_REPRESENTATION, TYPE, TYPE_CONSISTENCY

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.system import Endpoint, Participant, System, Topic
    from cqos_core.packs import Policy, Value
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved

PROTOCOL: Final = "dds"
_SECOND: Final = 1_000_000_000
_LONGEST: Final = 2**31 - 1
_UNSAYABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_REPRESENTATIONS: Final = {"xcdr1": "XCDR", "xml": "XML", "xcdr2": "XCDR2"}
_LEFT_OPEN: Final = "default"
_MOST_LOST: Final = 5

Stated = dict[str, "str | tuple[str, ...] | int"]
"""Values by the names of their policies: an enumeration's name, names, or a number."""


@dataclass(frozen=True, slots=True)
class Spelling:
    """How a form writes what the forms write differently.

    Attributes:
        infinite: seconds and nanoseconds of an infinite duration.
        unlimited: a length without limit.
        idl: enumerations have the names of the IDL, with the name of the policy.
        element: what holds one name of a list.
        octets: writes bytes.
    """

    infinite: tuple[str, str]
    unlimited: str
    idl: bool
    element: str
    dotted_bytes: bool


def dds_endpoints(
    system: System, context: ExportContext, notes: dict[str, None]
) -> Iterator[tuple[ExportEndpoint, Resolved]]:
    """Yield the endpoints of DDS that the form can express; note what is left out."""
    for each in endpoints_of_pack(PROTOCOL, system, context, notes):
        part = each.whole
        if part is None or not context.wants(each.id):
            continue
        if part.key is None or _UNSAYABLE.search(part.key):
            notes[f"endpoint `{each.id}` has no topic name that XML can hold"] = None
        else:
            yield each, part


def stated(each: ExportEndpoint, part: Resolved, notes: dict[str, None]) -> Stated | None:
    """Return the values that are stated for an endpoint; note those that no form can say.

    None where nothing of what is stated is known: an empty profile would say that all of it is the default.
    """
    found: Stated = {}
    lost: list[str] = []
    for index, policy in enumerate(part.pack.policies):
        if policy.level != ENDPOINT or policy is TYPE or part.role not in policy.roles:
            continue
        layer = next((one for one in part.layers if index in one.settings and one.overlay != "may_hold"), None)
        if layer is None:
            continue
        value = plain(policy, part.profile.values[index])
        word = policy.domain.word(layer.settings[index].text)
        if word == _LEFT_OPEN and word in policy.words:
            continue  # the reader of the file chooses, as here
        if value is not None:
            found[policy.name] = value
        elif word in {"auto", "highest_offered"}:
            found[policy.name] = word
        else:
            lost.append(policy.name)
    if lost and not found:
        notes[f"endpoint `{each.id}` is left out, because no value of it is known"] = None
        return None
    if lost:
        more = f" and {len(lost) - _MOST_LOST} more" if len(lost) > _MOST_LOST else ""
        named = f"{', '.join(lost[:_MOST_LOST])}{more}"
        notes[f"endpoint `{each.id}`: left out, because the value is not known: {named}"] = None
    return found


def complete(values: Stated, part: Resolved, forms: Mapping[str, Mapping[str, Policy]]) -> None:
    """Add to policies that are stated in part what else they have: not every implementation has defaults for fields.

    A field on a path is an extension, which other implementations refuse.
    """
    for form in forms.values():
        if any(policy.name in values for policy in form.values()):
            for policy in (each for field, each in form.items() if "/" not in field):
                value = plain(policy, part.profile.values[part.pack.vocabulary.indices[policy.level, policy.name]])
                if policy.level == ENDPOINT and part.role in policy.roles and value is not None:
                    values.setdefault(policy.name, value)


def plain(policy: Policy, value: Value) -> str | tuple[str, ...] | int | None:
    """Return a value as forms begin with it, None where it is not known."""
    if not is_plain(value):
        return None
    if isinstance(policy.domain, Choice):
        return policy.domain.format(value)  # type: ignore[arg-type]
    return value  # type: ignore[return-value]


class XmlWriter:
    """Writes the values of policies below elements of one form."""

    def __init__(self, spelling: Spelling, namespace: str, notes: dict[str, None]) -> None:
        self.spelling = spelling
        self.namespace = namespace
        self.notes = notes

    def root(self, tag: str) -> Element:
        """Begin a document."""
        return etree.Element(f"{{{self.namespace}}}{tag}", nsmap={None: self.namespace})

    def below(self, above: Element, tag: str, **attributes: str) -> Element:
        """Add an element."""
        return etree.SubElement(above, f"{{{self.namespace}}}{tag}" if self.namespace else tag, attributes)

    def text(self, root: Element, head: str) -> str:
        """Return the whole document, with a comment before its root."""
        etree.indent(root, "  ")
        body = etree.tostring(root, encoding="unicode")
        comment = _UNSAYABLE.sub("\ufffd", head).replace("--", "- -")
        return f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- {comment} -->\n{body}\n'

    def policies(
        self, above: Element, forms: Mapping[str, Mapping[str, Policy]], values: Stated, whose: str
    ) -> set[str]:
        """Write those of ``values`` that have a place in ``forms``; return their names."""
        written = set()
        for tag, form in forms.items():
            fields = {
                field: policy for field, policy in form.items() if policy.name in values and policy.name not in written
            }
            if fields:
                holder = self.below(above, tag)
                for field, policy in fields.items():
                    element = holder
                    for tag_of_part in field.split("/"):
                        element = self.below(element, tag_of_part)
                    self.value(element, policy, values[policy.name], whose)
                    written.add(policy.name)
        return written

    def value(self, element: Element, policy: Policy, value: str | tuple[str, ...] | int, whose: str) -> None:
        """Write one value."""
        domain, spelling = policy.domain, self.spelling
        if isinstance(domain, Compressions):
            element.text = domain.mask(value)  # type: ignore[arg-type]
        elif isinstance(domain, Names):
            names = (value,) if isinstance(value, str) else value if isinstance(value, tuple) else ()
            for name in names:
                shown = name
                if policy is DATA_REPRESENTATION:
                    shown = f"{_REPRESENTATIONS.get(name, name.upper())}_DATA_REPRESENTATION"
                elif _UNSAYABLE.search(name) or name != name.strip():
                    self.notes[f"endpoint `{whose}`: XML does not keep the name {name!r} of {policy.name} as it is"] = (
                        None
                    )
                    shown = _UNSAYABLE.sub("?", name)
                self.below(element, spelling.element).text = shown
        elif isinstance(domain, Duration):
            self.duration(element, int(value), policy, whose)  # type: ignore[arg-type]
        elif isinstance(domain, Choice):
            element.text = self.enumeration(policy, str(value))
        elif isinstance(domain, Count):
            element.text = spelling.unlimited if value == INFINITE else str(value)
        elif domain.kind == "text":
            element.text = self.octets(str(value))
        else:
            element.text = domain.format(value)

    def enumeration(self, policy: Policy, name: str) -> str:
        """Write ``reliable`` as ``RELIABLE_RELIABILITY_QOS``, or in short."""
        affixes = policy.domain.affixes if isinstance(policy.domain, Choice) else ()
        suffix = next((each for each in affixes if each.startswith("_") and each != "_qos"), "")
        if policy is TYPE_CONSISTENCY or not self.spelling.idl:
            suffix = ""
        return f"{name}{suffix}".upper()

    def duration(self, element: Element, nanoseconds: int, policy: Policy, whose: str) -> None:
        """Write seconds and nanoseconds."""
        seconds, rest = divmod(nanoseconds, _SECOND)
        if nanoseconds < INFINITE and seconds > _LONGEST:
            self.notes[f"endpoint `{whose}`: {policy.name} is longer than 68 years, so it is written as infinite"] = (
                None
            )
        infinite = seconds > _LONGEST or nanoseconds >= INFINITE
        sec, nanosec = self.spelling.infinite if infinite else (str(seconds), str(rest))
        self.below(element, "sec").text = sec
        self.below(element, "nanosec").text = nanosec

    def octets(self, text: str) -> str:
        """Write bytes: those of a hexadecimal number, else those of the text."""
        hexadecimal = re.fullmatch(r"0x((?:[0-9a-fA-F]{2})*)", text)
        data = bytes.fromhex(hexadecimal[1]) if hexadecimal else text.encode("utf-8", "replace")
        if self.spelling.dotted_bytes:
            return ".".join(f"{each:02x}" for each in data)
        return base64.b64encode(data).decode("ascii")


def only_on_some_topics(each: ExportEndpoint, notes: dict[str, None]) -> bool:
    """Whether a profile that is tried out is tried on topics that its filters tell apart, which is noted."""
    name = each.endpoint.profiles[0].name
    if each.endpoint.topic == name:
        return False
    notes[f"profile `{name}`: what it has for some topics only is left out"] = None
    return True


def unsayable(text: str) -> bool:
    """Whether XML cannot hold a text."""
    return _UNSAYABLE.search(text) is not None


def facts_left_out(system: System, notes: dict[str, None]) -> None:
    """Note what is known of a system beside QoS, which no XML form of DDS has a place for."""
    parts: tuple[Topic | Participant | Endpoint, ...] = (
        *system.topics.values(),
        *system.participants.values(),
        *system.endpoints,
    )
    implementations = {
        setting.text
        for settings in (system.options.get(PROTOCOL, {}), *(each.settings for each in system.participants.values()))
        for name, setting in settings.items()
        if name == "implementation"
    }
    rows = (
        (any(set(topic.settings) - {"type"} for topic in system.topics.values()), _OF_TOPICS),
        (any(each.external for each in parts), _PARTNERS),
        (implementations, _IMPLEMENTATION.format(", ".join(sorted(implementations)))),
    )
    notes |= dict.fromkeys(text for applies, text in rows if applies)


_OF_TOPICS: Final = "what is known of topics as such (keys, periods, sizes) has no place in the form"
_PARTNERS: Final = "that some have partners outside of this system has no place in the form"
_IMPLEMENTATION: Final = "the implementation ({}) has no place in the form: state it with --option dds.implementation=…"
