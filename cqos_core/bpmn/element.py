"""Elements of a diagram: what is read of them, and no more."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import ItemsView, Iterator, Mapping


class Element:
    """An element and what is in it; compared by identity. It does not know what it is in, so that a tree makes no cycles.

    Attributes:
        tag: its name, as ``{namespace}name``.
        attrib: values of its attributes, by such names.
        namespaces: those that prefixes mean here; the prefix of names without one is empty.
        number: that of its start tag in the document, of which the first has 0.
        children: the elements in it.
        text: what stands before the first of them.
    """

    __slots__ = ("attrib", "children", "namespaces", "number", "tag", "text")

    def __init__(self, tag: str, attrib: Mapping[str, str], namespaces: Mapping[str, str], number: int) -> None:
        """Begin with nothing in it."""
        self.tag = tag
        self.attrib = attrib
        self.namespaces = namespaces
        self.number = number
        self.children: list[Element] = []
        self.text = ""

    def get(self, name: str) -> str | None:
        """Return the value of an attribute."""
        return self.attrib.get(name)

    def items(self) -> ItemsView[str, str]:
        """Return names and values of the attributes."""
        return self.attrib.items()

    def having(self, *tags: str) -> Iterator[Element]:
        """Yield the elements directly in it that have one of some tags."""
        return (child for child in self.children if child.tag in tags)

    def walk(self) -> Iterator[Element]:
        """Yield it and everything in it, in the order of the document."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)
