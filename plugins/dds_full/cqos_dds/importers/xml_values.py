"""What the XML forms of DDS have in common: elements with places, and values of policies as their elements write them."""

from __future__ import annotations

import base64
import binascii
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode
from cqos_core.importers.xml_source import elements, local, text_of
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Place, Setting
from cqos_core.model.source import VARIABLES
from cqos_core.packs import Choice, Count, Duration, Flag, Names, Text, normalise
from cqos_core.packs.qos_keys import looks_like_qos
from cqos_core.packs.xml_importer import XmlImporter
from cqos_dds.importers.codes import CODES
from cqos_dds.importers.policy_forms import BESIDE_POLICIES
from cqos_dds.importers.unmodelled_elements import DDS_XML, leave_losses_open, leave_unknown
from cqos_dds.requested_policies import DATA_REPRESENTATION

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.importers.tree import Node
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Part, System
    from cqos_core.packs import Policy

PROTOCOL: Final = "dds"
MOST_TAGS: Final = 1_000_000
"""A file of this many tags has about 20 MB, and ten times as much as the largest that people write."""
_INFINITE: Final = re.compile(r"(?:dds_)?(?:duration_)?infinit[ey](?:_n?sec)?", re.IGNORECASE)
_ZERO: Final = re.compile(r"(?:dds_)?duration_zero(?:_n?sec)?", re.IGNORECASE)
_AUTOMATIC: Final = re.compile(r"(?:dds_)?duration_auto(?:_n?sec)?", re.IGNORECASE)
_FIELDS: Final = {"sec": "sec", "seconds": "sec", "nanosec": "nanosec", "nsec": "nanosec", "nanoseconds": "nanosec"}
_NUMBER: Final = re.compile(r"(?:0[xX][0-9a-fA-F]+|[0-9]{1,3})")
_BYTE: Final = 0xFF
_VARIABLE: Final = re.compile(r"\$\(([A-Za-z_]\w*)\)|\$\{([A-Za-z_]\w*)\}")
_MOST_LISTED: Final = 25
_MOST_UNREAD: Final = 1000


class XmlReading(XmlImporter):
    """One XML file being read: problems and notes with places, and elements that are not read.

    Attributes:
        files: by their first element the names of other files whose elements are used.
        unmodelled: elements that no policy models, in the QoS of endpoints.
        whole_paths: its paths begin with the element above the QoS.
        parts: of the file that are not read and may keep pairs apart.
    """

    protocol = PROTOCOL
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table
    unmodelled = DDS_XML
    whole_paths = False

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.files: dict[Element, str] = {}
        self.parts: list[Part] = []

    def finish(self) -> System:
        """Return the system, with a note about what is not read.

        Raises:
            InputError: there were problems.
        """
        self.parts = [*dict.fromkeys(self.parts)]  # several participants may have one base
        for part in self.parts:
            if part.place is not None:
                self.unread.setdefault(part.name, part.place)
        if self.unread:
            paths = sorted(self.unread)
            more = f" and {len(paths) - _MOST_LISTED} more" if len(paths) > _MOST_LISTED else ""
            paths = paths[:_MOST_LISTED]
            named = ", ".join(map(shown, paths)) + more if more else listed(map(shown, paths), "and")
            first = min(self.unread.values(), key=lambda place: place.line or 0)
            self.note("DDS901", f"elements that are no policy of the standard: {named}", first, unread=self.parts)
        self.notes.sort(key=lambda each: (each.place.line or 0) if each.place is not None else 0)
        return super().finish()

    # Places

    def place(self, node: Node | Place | Element) -> Place:
        """Return where an element is, in whichever file it stands."""
        found = super().place(node)
        if not self.files or isinstance(node, (Place, ScalarNode, SequenceNode, MappingNode)):
            return found
        return replace(found, source=self.files.get(node.getroottree().getroot(), found.source))

    def pass_over(self, element: Element, path: str) -> None:
        """Remember an unread element, up to a limit."""
        if path not in self.unread and len(self.unread) < _MOST_UNREAD:
            self.unread[path] = self.place(element)

    def name(self, element: Element, attribute: str = "name") -> str:
        """Return the name of an element that needs one; tell if it has none."""
        found = (element.get(attribute) or "").strip()
        if not found:
            self.problem("CQ010", f"`{local(element)}` needs a `{attribute}`", element)
        return found

    # Policies

    def policies(
        self, above: Element, forms: Mapping[str, Mapping[str, Policy]], entity: str, settings: Settings
    ) -> None:
        """Read the policies below the QoS of an entity.

        Args:
            above: the element of the QoS.
            forms: element of a policy to its fields.
            entity: what the QoS is of, as the policies' `entities` name it; empty: of anything.
            settings: where the values go.
        """
        for element in elements(above):
            form = forms.get(local(element))
            path = f"{local(above)}/{local(element)}"
            if form is None:
                near = self.unknown(element, path, forms)
                self.not_read(element, forms[near] if near else {}, entity, settings)
                if near is None:
                    self.not_modelled(element, path, settings)
                continue
            fitting = [policy for policy in form.values() if not entity or entity in policy.entities]
            if not fitting and (local(element), entity) not in _ALSO_ELSEWHERE:
                owners = listed(dict.fromkeys(each for policy in form.values() for each in policy.entities), "and")
                message = f"`{local(element)}` stands in `{local(above)}`, but is set on {owners} only"
                self.note("DDS903", message, element)
            elif fitting:
                self.fields(element, form, path, settings)
            else:
                self.pass_over(element, path)

    def unknown(self, element: Element, path: str, names: Iterable[str]) -> str | None:
        """Remember an element that is none of ``names``; report one that is misspelt, with its probable meaning."""
        known = path in self.unread or len(self.unread) >= _MOST_UNREAD or local(element) in BESIDE_POLICIES
        near = None if known else looks_like_qos(local(element), names)
        if near:
            message = f"{shown(local(element))} is no policy; did you mean `{near}`?"
            self.note("DDS902", message, element, f"write <{near}>")
        else:
            self.pass_over(element, path)
        return near

    def not_read(self, element: Element, form: Mapping[str, Policy], entity: str, settings: Settings) -> None:
        """Leave unknown what a misspelt element may set."""
        cause = f"{shown(local(element))} is no policy"
        for policy in form.values():
            if not entity or entity in policy.entities:
                settings.setdefault(policy.name, Setting("", self.place(element), unknown=cause, reported="DDS902"))

    def not_modelled(self, element: Element, path: str, settings: Settings) -> None:
        """Leave unknown what an element that no policy models may decide."""
        found = [*self.unmodelled.undecided(element, path if self.whole_paths else path.partition("/")[2])]
        refusing = [inner for inner, _, effect in found if effect == "match"]
        if refusing:
            leave_unknown(settings, refusing, self.place(element))
        elif found:
            leave_losses_open(settings, self.place(element))

    def fields(self, above: Element, form: Mapping[str, Policy], path: str, settings: Settings) -> None:
        """Read the fields of one policy; the text of an element that has no fields is its one field."""
        first, *others = form.values()
        if not others and not any(local(each) in form for each in elements(above)):
            policy = first
            if text_of(above) or (isinstance(policy.domain, Duration) and fields_of_duration(above)):
                self.value(above, policy, path, settings)
                return
        for element in elements(above):
            field = form.get(local(element))
            inner = f"{path}/{local(element)}"
            deeper = {
                name.partition("/")[2]: each
                for name, each in form.items()
                if name.partition("/")[0] == local(element) and "/" in name
            }
            if deeper:
                self.fields(element, deeper, inner, settings)
            elif field is None:
                near = self.unknown(element, inner, form)
                self.not_read(element, {near: form[near]} if near else {}, "", settings)
                if near is None:
                    self.not_modelled(element, inner, settings)
            else:
                self.value(element, field, inner, settings)

    def value(self, element: Element, policy: Policy, path: str, settings: Settings) -> None:
        """Read one value into ``settings``, in the spelling of system files."""
        whole = "".join(element.itertext()).strip()
        if cause := not_set(whole):
            settings[policy.name] = Setting(whole, self.place(element), unknown=cause)
            return
        try:
            written = self.written(element, policy, path)
            if written is None:
                return
            word = policy.domain.word(written)
            spelt = word if word in policy.words else policy.domain.format(policy.domain.parse(written))
        except InvalidValueError as error:
            said = error.message if text_of(element) or len(element) else "nothing is stated"
            self.problem("CQ011", f"`{path}`: {said}", element, f"expected {error.expected}")
            return
        settings[policy.name] = Setting(spelt, self.place(element))

    def written(self, element: Element, policy: Policy, path: str) -> str | None:
        """Return the text of a value as policies read it, None where an implementation is to choose it.

        Raises:
            InvalidValueError: it is none.
        """
        domain = policy.domain
        if isinstance(domain, Duration):
            return self.duration(element, path)
        if isinstance(domain, Names):
            names = tuple(text_of(each) for each in elements(element)) or tuple(filter(None, [text_of(element)]))
            if policy is DATA_REPRESENTATION and [normalise(name).removeprefix("dds_") for name in names] == [_AUTO]:
                return "auto"
            return Names().format(names)
        if isinstance(domain, Text):
            return octets(text_of(element))
        if isinstance(domain, (Choice, Flag, Count)):
            return text_of(element)
        raise AssertionError(policy.name)

    def duration(self, element: Element, path: str) -> str | None:
        """Read seconds and nanoseconds, each perhaps infinite, or one word for the whole.

        Raises:
            InvalidValueError: it is no duration.
        """
        fields: dict[str, str] = {}
        for part in elements(element):
            field = _FIELDS.get(local(part))
            if field is None:
                raise InvalidValueError(f"`{local(part)}` is no part of a duration", "<sec> and <nanosec>")
            fields[field] = text_of(part)
        words = [*fields.values()] or [text_of(element)]
        if any(_AUTOMATIC.fullmatch(word) for word in words):
            self.pass_over(element, f"{path} = {words[0]}")
            return None
        if _INFINITE.fullmatch(fields.get("sec", words[0])):
            return "infinite"
        if not fields and not _ZERO.fullmatch(words[0]):
            raise InvalidValueError(f"{shown(words[0])} is no duration", "<sec> and <nanosec>, or DURATION_INFINITY")
        return _in_fields({name: "0" if _ZERO.fullmatch(word) else word for name, word in fields.items()})


def _in_fields(fields: Mapping[str, str]) -> str:
    for field, written in fields.items():
        if not re.fullmatch(r"\+?[0-9]{1,20}", written) and not _INFINITE.fullmatch(written):
            raise InvalidValueError(f"`{field}` is {shown(written)}", "whole numbers, or DURATION_INFINITY")
    largest = str(2**31 - 1)
    seconds, nanoseconds = (
        largest if _INFINITE.fullmatch(fields.get(name, "0")) else fields.get(name, "0").lstrip("+")
        for name in ("sec", "nanosec")
    )
    return f"{{sec: {seconds}, nanosec: {nanoseconds}}}"


_AUTO: Final = "auto_data_representation"
# What an implementation adds to entities that do not have it by the standard.
_ALSO_ELSEWHERE: Final = frozenset(
    (
        ("transport_priority", "reader"),
        ("transport_priority", "publisher"),
        ("transport_priority", "subscriber"),
        ("transport_priority", "participant"),
        ("resource_limits", "participant"),
    )
)


def expand(root: Element, context: ReadContext) -> None:
    """Write the values of variables that are set in place of ``$(NAME)`` and ``${NAME}``, in texts and attributes."""
    values = context.options.get(VARIABLES, {})

    def value(found: re.Match[str]) -> str:
        return values.get(found[1] or found[2], found[0])

    for element in elements_within(root) if values else ():
        if element.text and "$" in element.text:
            element.text = _VARIABLE.sub(value, element.text)
        for name, written in element.attrib.items():
            if "$" in written:
                element.set(name, _VARIABLE.sub(value, written))


def not_set(written: str) -> str:
    """Say which variable in a text is not set; empty where there is no variable."""
    found = _VARIABLE.search(written) if "$" in written else None
    return f"variable `{found[1] or found[2]}` is not set" if found else ""


def octets(written: str) -> str:
    """Read bytes in any of the three notations, as one hexadecimal number.

    Numbers with commas between them (RTI, OpenDDS), hexadecimal numbers with dots between them (Fast DDS), or base64
    (OMG, Cyclone DDS).

    Raises:
        InvalidValueError: it is none of them.
    """
    plain = "".join(written.split())
    if not plain:
        return ""
    parts = plain.split(",")
    if all(_NUMBER.fullmatch(part) for part in parts):
        numbers = [int(part, 16 if part[:2].lower() == "0x" else 10) for part in parts]
        if max(numbers) <= _BYTE:
            return f"0x{bytes(numbers).hex()}"
    if re.fullmatch(r"[0-9a-fA-F]{1,2}(?:\.[0-9a-fA-F]{1,2})+", plain):
        return f"0x{bytes(int(part, 16) for part in plain.split('.')).hex()}"
    try:
        return f"0x{base64.b64decode(plain, validate=True).hex()}"
    except (binascii.Error, ValueError):
        expected = "bytes such as 1,0x2f,255 or 01.2f.ff, or base64"
        raise InvalidValueError(f"{shown(written)} are no bytes", expected) from None


def fields_of_duration(element: Element) -> bool:
    """Whether an element holds the fields of a duration."""
    return any(local(each) in _FIELDS for each in elements(element))


def elements_within(root: Element) -> Iterator[Element]:
    """Yield an element and all below it."""
    return (each for each in root.iter() if isinstance(each.tag, str))


def flag(written: str | None) -> bool:
    """Whether an attribute says yes."""
    return (written or "").strip().lower() in {"true", "1"}
