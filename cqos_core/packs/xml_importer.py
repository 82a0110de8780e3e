"""Base of importers of XML: places of elements, and problems at them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from fnmatch import translate
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from lxml import etree

from cqos_core.importers.xml_source import ElementLines, children, elements, local, text_of, written
from cqos_core.model.excerpt import exact
from cqos_core.model.settings import Place
from cqos_core.packs.file_importer import FileImporter

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.importers.tree import Node
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Part, System


Effect = Literal["match", "discovery", "delivery"]
"""What an element may decide: whether two ends match, whether participants find each other, or which samples arrive."""

EFFECTS: Final[Mapping[Effect, str]] = {
    "match": "it may prevent a match",
    "discovery": "it may keep participants from finding each other",
    "delivery": "it may lose samples",
}

Undecided: TypeAlias = "tuple[str, Element, Effect]"
"""The path of an element that may decide, the element, and what it may decide."""
Placed: TypeAlias = "tuple[str, Place, Effect]"
"""The same with the place of the element."""
_PATTERNS: Final = 2048  # more than all tables have; `fnmatch` itself keeps 256


@lru_cache(maxsize=_PATTERNS)
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(translate(pattern))


def _fits(text: str, pattern: str) -> bool:
    return _compiled(pattern).match(text) is not None


_NAMED: Final = frozenset(("element", "property"))


@dataclass(frozen=True, slots=True)
class ElementTable:
    """Elements of a format that no policy models, sorted by what they can decide.

    A pattern is a path below some element, perhaps with the text of the last one in lower case: ``batch/enable=false``. It has no
    text where it is empty: ``discovery/peers=``. A property goes by its ``<name>``. Of several patterns about an element the most
    specific one wins: one with a text, then the one with most letters, and of two equal ones that of `may_decide`. An element that
    no pattern is about is sorted as the one that it stands in. An element in neither table may prevent a match.

    Attributes:
        cannot_matter: patterns of elements that decide nothing, each with the reason; they cover all that stands in them.
        may_decide: patterns of all others.
        any_case: the owner of the format compares names without regard to case; patterns are in lower case.
    """

    cannot_matter: Mapping[str, str] = field(hash=False)
    may_decide: Mapping[str, Effect] = field(hash=False)
    any_case: bool = False

    def find(self, path: str, text: str | None = None) -> Effect | Literal["none"] | None:
        """Return what an element of a path and text may decide; None where no pattern is about it.

        An element that holds others has no text.
        """
        path = path.lower() if self.any_case else path
        stated = None if text is None else f"{path}={text.strip().lower()}"
        effects: dict[str, Effect | Literal["none"]] = {**dict.fromkeys(self.cannot_matter, "none"), **self.may_decide}
        about = [
            pattern
            for pattern in effects
            if (_fits(path, pattern) if "=" not in pattern else stated is not None and _fits(stated, pattern))
        ]
        return effects[max(reversed(about), key=_letters)] if about else None

    def undecided(self, element: Element, path: str, around: Effect | None = None) -> Iterator[Undecided]:
        """Yield an element, or those in it, that may decide: path, element and what it may decide.

        Args:
            element: the element.
            path: its path.
            around: what the element that it stands in may decide.
        """
        inner = [*elements(element)]
        text = text_of(element)
        filled = bool(inner) or (not text and bool(path) and bool(element.attrib))
        effect = self.find(path, None if filled else text)
        if effect == "none":
            return
        effect = effect or around
        if not self._leads_on(path) or (not inner and (text or filled)):
            yield path, element, effect or "match"
            return
        for child in inner:
            named = children(child, "name") if local(child) in _NAMED else ()
            name = text_of(named[0]) if named else local(child)
            yield from self.undecided(child, f"{path}/{name}" if path else name, effect)

    def _leads_on(self, path: str) -> bool:
        """Whether a pattern is about something in an element of a path."""
        steps = (path.lower() if self.any_case else path).split("/") if path else []
        for pattern in (*self.cannot_matter, *self.may_decide):
            stated = pattern.partition("=")[0].split("/")
            if len(stated) > len(steps) and all(map(_fits, steps, stated)):
                return True
        return False


def _letters(pattern: str) -> tuple[bool, int]:
    """Return how much a pattern says."""
    return "=" in pattern, len(pattern) - pattern.count("*") - pattern.count("?")


class XmlImporter(FileImporter):
    """Reads one XML file of another program.

    Attributes:
        unread: paths of elements that nothing reads, each with its first place.
    """

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.unread: dict[str, Place] = {}
        self._lines = ElementLines(source)

    def place(self, node: Node | Place | Element) -> Place:
        """Return where an element is; its name tells it from others on the line when the column is looked for."""
        if isinstance(node, Place):
            return node
        if not isinstance(node, etree._Element):  # noqa: SLF001
            return super().place(node)
        return Place(self.source.name, self._lines.line(node) or 1, path=f"{written(node)}[1]")

    def placed(self, found: Iterable[Undecided]) -> list[Placed]:
        """Return where elements that may decide are."""
        return [(path, self.place(element), effect) for path, element, effect in found]

    def problem(self, code: str, message: str, where: Node | Place | Element, advice: str | None = None) -> None:
        """Collect a problem."""
        super().problem(code, message, self.place(where), advice)

    def note(
        self,
        code: str,
        message: str,
        where: Node | Place | Element,
        advice: str | None = None,
        unread: Iterable[Part] = (),
    ) -> None:
        """Report something that is no reason to stop, with the severity of its code, and what is not read for it."""
        super().note(code, message, self.place(where), advice, unread)

    def finish(self) -> System:
        """Return the system.

        Raises:
            InputError: there were problems; with all of them, each with its column, for which the source is read again.
        """
        places = exact([each.place for each in self.problems if each.place is not None], self.system.sources)
        self.problems[:] = [
            replace(each, place=places.get(each.place)) if each.place else each for each in self.problems
        ]
        return super().finish()
