"""The form of drawings: attributes and child elements, in one namespace, that state QoS at elements of a drawing.

An importer of drawings has one `DrawnForm`. Its reader takes its words from it, and so do editors.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal, TypeAlias

from cqos_core.model.dataclass import dataclass

Meaning: TypeAlias = Literal[
    "protocol", "preset", "requirement", "exception", "option", "external", "type", "team_rule", "settings"
]
"""The meanings of words, whatever a drawing calls them."""


@dataclass(frozen=True, slots=True)
class DrawnAttribute:
    """An attribute of a child element.

    Attributes:
        required: the element means nothing without it.
        values: the valid ones, where they are few.
    """

    name: str
    doc: str
    required: bool = False
    values: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DrawnWord:
    """An attribute of an element, or a child element with ``attributes``.

    Attributes:
        element: whether it is a child element, which may stand there several times.
        values: of an attribute, the valid ones where they are few.
        foreign: it is what another tool writes, and is read only.
    """

    name: str
    meaning: Meaning
    doc: str
    element: bool = False
    attributes: tuple[DrawnAttribute, ...] = ()
    values: tuple[str, ...] = ()
    foreign: bool = False


@dataclass(frozen=True)
class DrawnOwner:
    """A kind of element of a drawing that can have words and settings.

    Attributes:
        types: its types in the meta-model of the drawing.
        called: the same for people, several of them.
        levels: whose policies are attributes of it.
        words: what else can stand on it.
    """

    kind: Literal["event", "participant", "signal", "model"]
    types: tuple[str, ...]
    called: tuple[str, ...]
    levels: tuple[str, ...]
    words: tuple[DrawnWord, ...]

    @cached_property
    def attributes(self) -> tuple[str, ...]:
        """The names of its attributes that are no settings."""
        return tuple(word.name for word in self.words if not word.element)

    @cached_property
    def elements(self) -> tuple[str, ...]:
        """The names of its child elements."""
        return tuple(word.name for word in self.words if word.element)


@dataclass(frozen=True, slots=True)
class DrawnForm:
    """The words and settings of one kind of drawing.

    Attributes:
        dialect: of the packs, which spells the settings.
    """

    namespace: str
    prefix: str
    dialect: str
    owners: tuple[DrawnOwner, ...]
