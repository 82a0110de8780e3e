"""What stands in the ``extensionElements`` of a BPMN element."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from cqos_core.bpmn.document import Document
    from cqos_core.bpmn.element import Element
    from cqos_core.model.settings import Place


@dataclass(frozen=True, slots=True)
class Child:
    """An element in the ``extensionElements`` of its owner.

    Attributes:
        prefix: the one that `NAMESPACES` has for its namespace.
        word: its name, for comparing.
        path: how places name it, seen from the owner.
    """

    element: Element
    owner: Element
    prefix: str
    word: str
    path: str

    def is_word(self, word: str) -> bool:
        """Say whether it is ``word`` in the namespace ``http://qos``."""
        return self.prefix == "qos" and self.word == word

    def place(self, document: Document, attribute: str | None = None) -> Place:
        """Return where the element or one of its attributes stands."""
        return document.place(self.element, f"{self.path}/@{attribute}" if attribute else self.path, self.owner)
