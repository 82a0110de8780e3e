"""Base of importers of XML: places of elements, and problems at them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lxml import etree

from cqos_core.importers.xml_source import ElementLines, written
from cqos_core.model.excerpt import exact
from cqos_core.model.settings import Place
from cqos_core.packs.file_importer import FileImporter

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.importers.tree import Node
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Part, System


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
