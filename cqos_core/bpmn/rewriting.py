"""A BPMN document as text with the places of its tags, for changes after which everything else stays as it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from html import escape, unescape
from typing import Final, NamedTuple

from cqos_core.model.dataclass import dataclass
from cqos_core.model.excerpt import NAMESPACES
from cqos_core.model.regular_expressions import re
from cqos_core.model.source import Replacement

_TOKEN: Final = re.compile(
    r"""<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"""
    r"""|</(?P<closed>[^\s>]++)\s*+>|<(?P<name>[^\s<>/!?=]++)(?P<attributes>(?:[^<>"']++|"[^"]*+"|'[^']*+')*+)>""",
    re.DOTALL,
)
_ATTRIBUTE: Final = re.compile(r"""\s++(?P<name>[^\s=/<>"']++)\s*+=\s*+(?P<value>"[^"]*+"|'[^']*+')""")
_EMPTY: Final = re.compile(r"\s*+\Z")
_DECLARED: Final = re.compile(r"""\A(<\?xml[^>]*?\sencoding\s*=\s*)(["'])[^"']*\2""")


class Attribute(NamedTuple):
    """An attribute: where it begins, with the blanks before it, where its value begins and ends, and the value."""

    start: int
    value_start: int
    value_end: int
    text: str


@dataclass(slots=True, eq=False)
class Tag:
    """An element as it is written.

    Attributes:
        name: with its prefix.
        start, inside: of its start tag, and behind that.
        inside_end, end: of its end tag, and behind that; for an empty element the same as `inside`.
        attributes: by their names with prefixes.
    """

    name: str
    start: int
    inside: int
    inside_end: int
    end: int
    attributes: dict[str, Attribute]
    children: list[Tag] = field(default_factory=list)

    @property
    def id(self) -> str | None:
        """Its id."""
        return self.attributes["id"].text if "id" in self.attributes else None

    def walk(self) -> Iterator[Tag]:
        """Yield it and everything below it, in the order of the document."""
        waiting = [self]
        while waiting:
            tag = waiting.pop()
            yield tag
            waiting += reversed(tag.children)


class Diagram:
    """The text of a well-formed BPMN document, and the changes to it that are collected.

    Attributes:
        text: in UTF-8, as its declaration says.
        root: the ``definitions``.
    """

    def __init__(self, text: str) -> None:
        """Find the tags of ``text``, which an XML parser accepts."""
        self.text = _DECLARED.sub(r"\1\2UTF-8\2", text)
        self.root = _tree(self.text)
        self._prefixes: dict[str, dict[str, None]] = {}
        self._by_id: dict[str, list[Tag]] = {}
        self._changes: list[Replacement] = []
        self._removed: set[Tag] = set()
        for tag in self.root.walk():
            if tag.id is not None:
                self._by_id.setdefault(tag.id, []).append(tag)
            for name, attribute in tag.attributes.items():
                if name == "xmlns" or name.startswith("xmlns:"):
                    self._prefixes.setdefault(attribute.text, {})[name.partition(":")[2]] = None

    def find(self, identity: str) -> Tag | None:
        """Return the element with an id; None if no element has it, or several do."""
        found = self._by_id.get(identity, [])
        return found[0] if len(found) == 1 else None

    def local(self, prefix: str, name: str) -> str | None:
        """Return a written name without its prefix, None unless it is in the namespace that ``prefix`` of `NAMESPACES` means."""
        written, colon, local = name.rpartition(":")
        return local if written in self._prefixes.get(NAMESPACES[prefix], {}) and (colon or prefix == "bpmn") else None

    def is_a(self, tag: Tag, prefix: str, word: str) -> bool:
        """Whether an element has a name, whose first letter some tools write as a capital."""
        local = self.local(prefix, tag.name)
        return local is not None and local[:1].lower() + local[1:] == word

    def prefix(self, wanted: str) -> str:
        """Return the prefix for a namespace of `NAMESPACES`; the changes bind it, where the document does not."""
        known = next((each for each in self._prefixes.get(NAMESPACES[wanted], {}) if each), None)
        if known is not None:
            return known
        taken = {each for prefixes in self._prefixes.values() for each in prefixes}
        chosen = next(each for each in (wanted, *(f"{wanted}{n}" for n in range(len(taken) + 1))) if each not in taken)
        self._prefixes.setdefault(NAMESPACES[wanted], {})[chosen] = None
        at = self._after_name(self.root)
        self._changes.append(Replacement(at, at, f' xmlns:{chosen}="{NAMESPACES[wanted]}"'))
        return chosen

    def state(self, tag: Tag, values: Mapping[str, str | None]) -> None:
        """Give attributes, by their names with prefixes, values; None removes one. What is there already stays in its place."""
        added = ""
        for name, value in values.items():
            there = tag.attributes.get(name)
            if there is None:
                added += "" if value is None else f' {name}="{escape(value)}"'
            elif value is None:
                self._changes.append(Replacement(there.start, there.value_end + 1, ""))
            elif value != there.text:
                self._changes.append(Replacement(there.value_start, there.value_end, escape(value)))
        if added:
            at = max((each.value_end + 1 for each in tag.attributes.values()), default=self._after_name(tag))
            self._changes.append(Replacement(at, at, added))

    def remove(self, tag: Tag) -> None:
        """Remove an element with the blanks before it."""
        start = len(self.text[: tag.start].rstrip()) if self.text[: tag.start].rstrip().endswith(">") else tag.start
        self._changes.append(Replacement(start, tag.end, ""))
        self._removed.add(tag)

    def children(self, tag: Tag, prefix: str, word: str) -> list[Tag]:
        """Return the children of a name that the changes leave."""
        return [child for child in tag.children if child not in self._removed and self.is_a(child, prefix, word)]

    def add(self, tag: Tag, text: str, after: Tag | None = None) -> None:
        """Add a child as the first one, or behind another one, on a line of its own where the others have one."""
        first = tag.children[0].start if tag.children else tag.inside_end
        blanks = self.text[tag.inside : first] if tag.inside <= first else ""
        blanks = blanks if not blanks.strip() else ""
        if tag.inside == tag.end:  # an empty element, which ends with "/>"
            slash = self.text.rindex("/", tag.start, tag.end)
            self._changes.append(Replacement(slash, tag.end, f">{text}</{tag.name}>"))
            return
        at = tag.inside if after is None else after.end
        self._changes.append(Replacement(at, at, f"{blanks if tag.children else ''}{text}"))

    def changed(self) -> str:
        """Return the document with all changes."""
        text = self.text
        for change in sorted(self._changes, key=lambda each: (each.start, each.end), reverse=True):
            text = text[: change.start] + change.text + text[change.end :]
        return text

    def is_blank(self, tag: Tag, without: set[int]) -> bool:
        """Whether nothing stands in an element but children that ``without`` has, by their starts."""
        rest, at = "", tag.inside
        for child in tag.children:
            if child.start not in without:
                return False
            rest, at = rest + self.text[at : child.start], child.end
        return _EMPTY.match(rest + self.text[at : tag.inside_end]) is not None

    @staticmethod
    def _after_name(tag: Tag) -> int:
        return tag.start + 1 + len(tag.name)


def _tree(text: str) -> Tag:
    top = Tag("", 0, 0, len(text), len(text), {})
    opened = [top]
    for match in _TOKEN.finditer(text):
        if match["closed"] is not None:
            tag = opened.pop()
            tag.inside_end, tag.end = match.start(), match.end()
        elif match["name"] is not None:
            tag = Tag(match["name"], match.start(), match.end(), match.end(), match.end(), _attributes(match))
            opened[-1].children.append(tag)
            if not match["attributes"].endswith("/"):
                opened.append(tag)
    return top.children[0]


def _attributes(match: re.Match[str]) -> dict[str, Attribute]:
    first = match.start("attributes")
    return {
        each["name"]: Attribute(
            first + each.start(),
            first + each.start("value") + 1,
            first + each.end("value") - 1,
            unescape(re.sub(r"[\t\r\n]", " ", each["value"][1:-1])),
        )
        for each in _ATTRIBUTE.finditer(match["attributes"])
    }
