"""States policies in XML files of DDS: in the QoS of an entity or in a profile of Fast DDS; comments and layout stay.

An element of a policy comes before those that follow it in the form (DDS-XML 1.0, 7.3.2; Fast DDS: XML profiles).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from lxml import etree

from cqos_core.files.yaml_edits import difference
from cqos_core.model.encoding import Lines
from cqos_core.model.excerpt import exact
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.regular_expressions import re
from cqos_core.packs import Choice
from cqos_dds.exporters.dds_xml import SPELLING as OMG_SPELLING
from cqos_dds.exporters.fastdds_xml import SPELLING as FAST_SPELLING
from cqos_dds.exporters.xml_form import XmlWriter
from cqos_dds.importers.policy_forms import FAST_ALSO, FAST_QOS, FAST_TOPIC, OMG, READER, SPELLINGS, WRITER
from cqos_dds.policies import POLICIES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.source import Replacement
    from cqos_core.packs import Policy
    from cqos_dds.exporters.xml_form import Spelling

_TOKEN: Final = re.compile(
    r"""<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"""
    r"""|<(?P<end>/)?(?P<name>[^\s<>/!?=]++)(?P<attributes>(?:[^<>"'/]++|"[^"]*+"|'[^']*+'|/(?!>))*+)(?P<empty>/)?>""",
    re.DOTALL,
)
_PROFILE: Final = re.compile(r"\sprofile_name\s*=")
_POLICIES: Final = {policy.name: policy for policy in POLICIES}
_PARTS_OF: Final = {"data_writer": WRITER, "data_reader": READER}


@dataclass(slots=True)
class _Element:
    """An element by offsets: its start tag, its content, its end tag."""

    name: str
    attributes: str
    start: int
    content: int
    close: int = 0
    end: int = 0
    children: list[_Element] = field(default_factory=list)

    @property
    def local(self) -> str:
        """Its name without a prefix."""
        return self.name.rpartition(":")[2]

    @property
    def prefix(self) -> str:
        """Its prefix, with the colon."""
        return self.name[: len(self.name) - len(self.local)]


class _XmlForm(NamedTuple):
    """Which elements hold policies, and how their values are written."""

    elements: Mapping[str, Mapping[str, Policy]]
    spelling: Spelling


_OMG: Final = _XmlForm(OMG, OMG_SPELLING)
_FAST: Final = {
    "qos": _XmlForm(FAST_QOS | {other: FAST_QOS[name] for other, name in FAST_ALSO.items()}, FAST_SPELLING),
    "topic": _XmlForm(FAST_TOPIC, FAST_SPELLING),
}


def insert(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """State policies, in the words of system files, in the element at ``place``."""
    found = exact([place], {place.source: text.encode()})[place]
    above = Lines(text).start(found.line) if found.line is not None and found.column is not None else None
    if above is None:
        return None
    start, changed = above + (found.column or 1) - 1, text
    for name, value in settings.items():
        element = _elements(changed).get(start)
        made = None if element is None else _stated(changed, element, _POLICIES[name], value)
        if made is None:
            return None
        changed = made
    return difference(text, changed)


def _elements(text: str) -> dict[int, _Element]:
    """Return all elements by the offset of their start tags."""
    found: dict[int, _Element] = {}
    inside: list[_Element] = []
    for token in _TOKEN.finditer(text):
        if token["name"] is None:
            continue
        if token["end"]:
            if inside and inside[-1].name == token["name"]:
                inside[-1].close, inside[-1].end = token.span()
                inside.pop()
            continue
        element = _Element(token["name"], token["attributes"], token.start(), token.end())
        found[element.start] = element
        if inside:
            inside[-1].children.append(element)
        if token["empty"]:
            element.close = element.end = token.end()
        else:
            inside.append(element)
    return found


def _stated(text: str, element: _Element, policy: Policy, value: str) -> str | None:
    """Return the text with one policy stated in an element."""
    holder, form = _holder(element, policy)
    tag, fields = next(((tag, each) for tag, each in form.elements.items() if _has(each, policy)), ("", {}))
    name = next((name for name, each in fields.items() if each is policy), "")
    written = _written(tag, form, policy, value)
    if not tag or written is None:
        return None
    made, inner = f"{element.prefix}{tag}", _prefixed(written, element.prefix)
    if isinstance(holder, str):
        content = f"<{made}>{inner}</{made}>"
        return _put(text, element, f"<{element.prefix}{holder}>{content}</{element.prefix}{holder}>", [])
    same = [each for each in holder.children if _has(form.elements.get(each.local, {}), policy)]
    if not same:
        return _put(text, holder, f"<{made}>{inner}</{made}>", _behind(tag, [*form.elements]))
    known = form.elements[same[-1].local]
    first = name.partition("/")[0]
    if first != name and any(each.local == first for each in same[-1].children):
        return None  # a path that begins in an element that is there already
    there = [each for each in same[-1].children if known.get(each.local) is policy]
    if there:
        return text[: there[-1].start] + inner + text[there[-1].end :]
    if not same[-1].children and text[same[-1].content : same[-1].close].strip():
        return text[: same[-1].content] + inner + text[same[-1].close :]
    return _put(text, same[-1], inner, _behind(name, [*known]))


def _holder(element: _Element, policy: Policy) -> tuple[_Element | str, _XmlForm]:
    """Return what holds a policy below an element, or the name of what has to be made for that."""
    if _PROFILE.search(element.attributes):
        name = "topic" if any(_has(fields, policy) for fields in FAST_TOPIC.values()) else "qos"
        return next((each for each in element.children if each.local == name), name), _FAST[name]
    part = _PARTS_OF.get(element.local)
    if part is None:
        return element, _OMG
    return next((each for each in element.children if SPELLINGS.get(each.local, each.local) == part), part), _OMG


def _has(fields: Mapping[str, Policy], policy: Policy) -> bool:
    # Policies are terms, so that `==` and `in` build conditions.
    return any(each is policy for each in fields.values())


def _behind(name: str, order: list[str]) -> list[str]:
    """Return the names that come after one."""
    return order[order.index(name) + 1 :]


def _put(text: str, above: _Element, new: str, behind: list[str]) -> str:
    """Put an element before the first of those that have to come behind it, else at the end."""
    if above.content == above.end:
        head = text[above.start : above.content].removesuffix("/>").rstrip()
        return f"{text[: above.start]}{head}>{new}</{above.name}>{text[above.end :]}"
    follows = next((each for each in above.children if each.local in behind), None)
    if follows is not None:
        return f"{text[: follows.start]}{new}{_gap(text, follows.start)}{text[follows.start :]}"
    if above.children:
        last = above.children[-1]
        return f"{text[: last.end]}{_gap(text, last.start)}{new}{text[last.end :]}"
    return f"{text[: above.content]}{new}{text[above.content :]}"


def _gap(text: str, start: int) -> str:
    """Return the line break and the blanks that stand before an element."""
    line = text.rfind("\n", 0, start) + 1
    if not line or text[line:start].strip():
        return ""
    return ("\r\n" if text[line - 2 : line] == "\r\n" else "\n") + text[line:start]


def _written(tag: str, form: _XmlForm, policy: Policy, value: str) -> str | None:
    """Return the element of a policy's field as the form writes it."""
    try:
        read = policy.domain.parse(value)
    except InvalidValueError:
        return None
    notes: dict[str, None] = {}
    stated = policy.domain.format(read) if isinstance(policy.domain, Choice) else read
    writer = XmlWriter(form.spelling, "", notes)
    root = etree.Element("root")
    writer.policies(root, {tag: form.elements[tag]}, {policy.name: stated}, "")
    return None if notes else etree.tostring(root[0][0], encoding="unicode")


def _prefixed(element: str, prefix: str) -> str:
    return re.sub(r"<(/?)(?=[^/])", rf"<\1{prefix}", element) if prefix else element
