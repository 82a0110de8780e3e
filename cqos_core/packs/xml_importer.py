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

    A pattern is a path below some element, perhaps with the text of the last one in lower case: ``batch/enable=false``. A property
    goes by its ``<name>``. An element in neither table may prevent a match.

    Attributes:
        cannot_matter: patterns of elements that decide nothing, each with the reason; they cover all that stands in them.
        may_decide: patterns of all others. One of them wins over one of `cannot_matter`, unless that states a text.
        any_case: the owner of the format compares names without regard to case; patterns are in lower case.
    """

    cannot_matter: Mapping[str, str] = field(hash=False)
    may_decide: Mapping[str, Effect] = field(hash=False)
    any_case: bool = False

    def find(self, path: str, text: str = "") -> Effect | Literal["none"] | None:
        """Return what an element of a path and text may decide; None where no pattern is about it."""
        path = path.lower() if self.any_case else path
        stated = f"{path}={text.strip().lower()}"
        if any("=" in pattern and _fits(stated, pattern) for pattern in self.cannot_matter):
            return "none"
        for pattern, effect in self.may_decide.items():
            if _fits(stated if "=" in pattern else path, pattern):
                return effect
        return "none" if any(_fits(path, pattern) for pattern in self.cannot_matter) else None

    def undecided(self, element: Element, path: str) -> Iterator[Undecided]:
        """Yield an element, or those in it, that may decide: path, element and what it may decide."""
        effect = self.find(path, text_of(element))
        if effect == "none":
            return
        inner = [*elements(element)]
        if effect is not None or not self._leads_on(path) or (not inner and text_of(element)):
            yield path, element, effect or "match"
            return
        for child in inner:
            named = children(child, "name") if local(child) in _NAMED else ()
            name = text_of(named[0]) if named else local(child)
            yield from self.undecided(child, f"{path}/{name}" if path else name)

    def _leads_on(self, path: str) -> bool:
        """Whether a pattern is about something in an element of a path."""
        steps = (path.lower() if self.any_case else path).split("/") if path else []
        for pattern in (*self.cannot_matter, *self.may_decide):
            stated = pattern.partition("=")[0].split("/")
            if len(stated) > len(steps) and all(map(_fits, steps, stated)):
                return True
        return False


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
