"""What one reading of a BPMN file has found so far: the system, the notes in it, and the problems."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.document import COLLABORATION
from cqos_core.bpmn.foreign_attributes import LostWords
from cqos_core.bpmn.names import fold
from cqos_core.model.codes import CODES
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.system import ImportNote, System

if TYPE_CHECKING:
    from collections.abc import Collection

    from cqos_core.bpmn.document import Document
    from cqos_core.bpmn.element import Element
    from cqos_core.model.settings import Place

MOST_COPIES: Final = 100_000
"""How often altogether an event or process may count again for a further participant."""

_ENDING = re.compile(r"(\.bpmn20)?\.(bpmn2?|xml)$", re.IGNORECASE)


class DiagramReading:
    """The system under construction and everything there is to say about its source."""

    def __init__(self, document: Document) -> None:
        """Begin with an empty system, named by the model or else by its file."""
        self.document = document
        self.system = System(name=_name(document))
        self.lost = LostWords(document)
        self._copies = 0

    def note(
        self,
        code: str,
        message: str,
        place: Place,
        *,
        advice: str | None = None,
        endpoint: str | None = None,
    ) -> None:
        """Say something that is no reason to stop; its severity is that of the code."""
        self.system.notes.append(ImportNote(code, CODES[code].severity, message, place, advice, endpoint))

    def count_copies(self, number: int, element: Element) -> None:
        """Count what stands in the model once and in the system several times.

        Raises:
            InputError: when that is more than a system may hold.
        """
        self._copies += number
        if self._copies > MOST_COPIES:
            message = f"processes that several participants run would make more than {MOST_COPIES} copies"
            advice = "fewer participants that share a process show the same mistakes"
            raise InputError([Problem("CQ016", message, self.document.place(element), advice)])


def _name(document: Document) -> str:
    candidates = [document.root, *document.all(COLLABORATION)]
    stated = next((name for element in candidates if (name := fold(element.get("name")))), None)
    return stated or _ENDING.sub("", re.split(r"[\\/]", document.name)[-1])


class Unique:
    """Hands out ids; one that is taken becomes ``id#2``, then ``id#3``."""

    def __init__(self) -> None:
        """Begin with nothing taken."""
        self._taken: set[str] = set()
        self._next: dict[str, int] = {}

    def is_taken(self, name: str) -> bool:
        """Say whether an id is in use."""
        return name in self._taken

    def take(self, names: Collection[str]) -> bool:
        """Take ids as they are, if none of them is in use and all differ; say whether that is so."""
        new = set(names)
        if len(new) < len(names) or not self._taken.isdisjoint(new):
            return False
        self._taken |= new
        return True

    def __call__(self, wanted: str) -> str:
        """Return ``wanted`` or the first free id like it."""
        found = wanted
        if found not in self._taken:
            self._taken.add(found)
            return found
        number = self._next.get(wanted, 2)
        while found in self._taken:
            found = f"{wanted}#{number}"
            number += 1
        self._next[wanted] = number
        self._taken.add(found)
        return found
