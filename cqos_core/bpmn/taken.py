"""What was taken out of the tree of a document while it was parsed, and the lines of what is left and of what is gone."""

from __future__ import annotations

from array import array
from dataclasses import field
from typing import TYPE_CHECKING

from cqos_core.importers.xml_source import MOST_LINES
from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import Place

if TYPE_CHECKING:
    from cqos_core.importers.xml_source import Element, StartTags
    from cqos_core.model.rows import Row


@dataclass(slots=True)
class TakenEvents:
    """Where the events that were taken stand, by their numbers in the document.

    Attributes:
        labels: their names as they are written.
        lines: where their start tags end, as far as the parser counts.
        sizes: of how many elements each of them is.
        numbers: of their start tags; of a long document only.
    """

    labels: list[str | None] = field(default_factory=list)
    lines: array[int] = field(default_factory=lambda: array("L"))
    sizes: array[int] = field(default_factory=lambda: array("I"))
    numbers: array[int] = field(default_factory=lambda: array("L"))

    def line(self, at: int, tags: StartTags) -> int:
        """Return the one-based line of one."""
        line = self.lines[at]
        return line if line < MOST_LINES else tags.line(self.numbers[at])


@dataclass(slots=True)
class Taken:
    """What was taken out of a document.

    Of each run of neighbours the first element stays in the tree, and stands for all of them.

    Attributes:
        runs: by their first element, the events of a run as rows, in which their number in the document says where they stand.
        events: where they stand.
        signals: names by ids.
        named: ids by names.
        references: by which events name signals that were not taken before them.
        gone: by the first element of a run, how many elements left the tree behind it.
    """

    runs: dict[Element, list[Row]] = field(default_factory=dict)
    events: TakenEvents = field(default_factory=TakenEvents)
    signals: dict[str, str] = field(default_factory=dict)
    named: dict[str, str] = field(default_factory=dict)
    references: set[str] = field(default_factory=set)
    gone: dict[Element, int] = field(default_factory=dict)

    def numbered(self, root: Element) -> dict[Element, int]:
        """Return the numbers of the start tags of a tree that were in its document, and note those of what was taken out of it."""
        numbers: dict[Element, int] = {}
        number, behind, left = 0, 0, 0  # elements that left the tree, and those of the tree before them
        self.events.numbers = array("L", bytes(array("L").itemsize * len(self.events.lines)))
        for element in root.iter("*"):
            if not left:
                number += behind
                behind = 0
            left -= 1
            numbers[element] = number
            if element in self.gone:
                behind, left = self.gone[element], sum(1 for _ in element.iterdescendants("*"))
                of_row = number
                for row in self.runs.get(element, ()):
                    self.events.numbers[row[3]] = of_row
                    of_row += self.events.sizes[row[3]]
            number += 1
        return numbers


class Lines:
    """Tells the line where a start tag of a document ends; the parser's own count ends at 65,535."""

    def __init__(self, root: Element, tags: StartTags, taken: Taken) -> None:
        """Take what is left of a tree, and what tells the lines of start tags by their numbers."""
        self._tags, self._events = tags, taken.events
        self._numbers = taken.numbered(root) if tags.are_many_lines() else {}

    def of(self, element: Element) -> int | None:
        """Return the one-based line of an element."""
        line = element.sourceline
        if line is None or line < MOST_LINES or element not in self._numbers:
            return line
        return self._tags.line(self._numbers[element])


class RowPlaces:
    """Tells where events stand that were taken; it keeps nothing of the tree.

    Attributes:
        events: the events.
    """

    def __init__(self, source: str, events: TakenEvents, tags: StartTags | None) -> None:
        """Take the name of the document, and its start tags; None: its places have no lines."""
        self.events = events
        self._source, self._tags = source, tags

    def place(self, row: Row) -> Place:
        """Return the place of one."""
        return Place(self._source, None if self._tags is None else self.events.line(row[3], self._tags), None, row[1])
