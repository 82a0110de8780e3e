"""Takes signals and signal events out of the tree while a document is parsed, so that it never stands in memory as a whole.

A signal that has an id and a name and nothing else is kept as these. An event that throws or catches one signal, and states what it
states in attributes, becomes a row. What the attributes of an event mean depends on their names, and is read once for all that have
the same: this module only looks where its texts are. All other elements stay in the tree, and so do events that nothing is to be made
of without a note.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.bpmn.document import (
    BPMN,
    EVENT_ROLES,
    EXTENSIONS,
    PROCESS,
    ROLES,
    SIGNAL,
    SIGNAL_DEFINITION,
)
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.lost import is_lost
from cqos_core.bpmn.names import POLICIES, fold, is_computed, key, number
from cqos_core.bpmn.qos import decimal_text
from cqos_core.bpmn.taken import Taken
from cqos_core.bpmn.words import FLAGS, QOS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.rows import Row

TAGS: Final = (*EVENT_ROLES, SIGNAL)
"""Elements that may be taken."""
_SAYS_NOTHING: Final = frozenset(f"{BPMN}{name}" for name in ("incoming", "outgoing", "documentation"))
_OF_FLOW: Final = frozenset(
    ("attachedToRef", "cancelActivity", "isInterrupting", "parallelMultiple", "isForCompensation", "triggeredByEvent")
)
"""Attributes that say when an event happens: the control flow reads them."""


class Shape:
    """Events that differ in ids, names, signals and the texts of settings.

    Attributes:
        example: the first of them, which stays in the tree.
        settings: the names of the settings whose texts stand in a row.
    """

    __slots__ = ("example", "settings")

    def __init__(self, example: Element, settings: Sequence[str]) -> None:
        self.example, self.settings = example, settings


class _Attributes:
    """Where the texts of an event are whose attributes have certain names.

    Attributes:
        id, name: the places of these; that of a name that is not there is None.
        words: those of C-QoS's own words, which all events of a shape share.
        at, settings: those of settings, and their names.
        may_be_unedited: whether they are the eight that modelers write unasked.
        shapes: by the tag, the number of elements, and the words.
    """

    __slots__ = ("_flags", "at", "id", "may_be_unedited", "name", "settings", "shapes", "words")

    def __init__(self, names: Sequence[str]) -> None:
        of_qos = [(at, name[len(QOS) :]) for at, name in enumerate(names) if name.startswith(QOS)]
        self.id = names.index("id")
        self.name = names.index("name") if "name" in names else None
        self.words = [at for at, name in of_qos if name in EVENT.attributes]
        self._flags = [at for at, name in of_qos if name == "external"]
        self.at = [at for at, name in of_qos if name not in EVENT.attributes]
        self.settings = tuple([name for _, name in of_qos if name not in EVENT.attributes])
        self.may_be_unedited = POLICIES <= set(map(key, self.settings))
        self.shapes: dict[tuple[Any, ...], Shape] = {}

    def is_readable(self, values: Sequence[str]) -> bool:
        """Whether nothing is to be said of the words among the values."""
        return all(values[at].strip() in {"", *FLAGS} for at in self._flags)


class _Texts(dict[str, str]):
    """Texts of settings by what is written, equal ones as one object."""

    def __missing__(self, written: str) -> str:
        self[written] = text = decimal_text(written)
        return text


class Taking:
    """Goes through one document."""

    def __init__(self, unclear: Collection[str] = (), *, whole: bool = False) -> None:
        """Begin with nothing taken.

        Args:
            unclear: references to signals of which something is to be said: their events stay in the tree.
            whole: leave each event in the tree, beside its row.
        """
        self.taken = Taken()
        self._events = self.taken.events
        self._unclear = unclear
        self._whole = whole
        self._attributes: dict[tuple[str, ...], _Attributes | None] = {}
        self._texts = _Texts()
        self._others: set[str | None] = set()  # ids and names of signals that stay in the tree
        self._parent: Element | None = None
        self._is_root = self._in_process = False
        self._run: list[Row] = []
        self._first: Element | None = None  # of the run
        self._last: tuple[Element, Element] | None = None  # what is to be removed, below what

    def take(self, elements: Iterable[Element]) -> None:
        """Take what may be taken of elements, which are complete; the last one stays in the tree until the next call."""
        for element in elements:
            parent = element.getparent()
            if parent is not self._parent:
                self._enter(parent)
            if parent is None:
                continue
            if self._in_process:
                self._event(element, parent)
            elif self._is_root and element.tag == SIGNAL and self._is_taken(element):
                self._remove_later(element, parent)

    def end(self) -> None:
        """Remove what is still to be removed; nothing follows it."""
        if self._last is not None:
            element, parent = self._last
            parent.remove(element)
        self._first = self._last = self._parent = None

    def _enter(self, parent: Element | None) -> None:
        """Note what elements below ``parent`` are: whatever extensions hold belongs to their tools."""
        self._parent = parent
        self._is_root = parent is not None and parent.getparent() is None
        self._in_process = False
        while parent is not None:
            if parent.tag == EXTENSIONS or parent.tag in ROLES:
                self._in_process = False
                return
            self._in_process = self._in_process or parent.tag == PROCESS
            parent = parent.getparent()

    def _is_taken(self, signal: Element) -> bool:
        """Take a signal that has an id and a name, which no signal before it has, and nothing else."""
        stated, taken = dict(signal.items()), self.taken
        identity, name = stated.get("id"), fold(stated.get("name"))
        is_new = identity not in taken.signals and name not in taken.named and self._others.isdisjoint((identity, name))
        is_plain = len(stated) == len(("id", "name")) and not len(signal) and not is_computed(name)
        if not identity or ":" in identity or not name or not is_new or not is_plain:
            self._others.update((identity, name))
            return False
        taken.signals[identity] = name
        taken.named[name] = identity
        return True

    def _event(self, event: Element, parent: Element) -> None:
        """Take an event that throws or catches one signal, unless something but its attributes states anything."""
        names = tuple(event.keys())
        try:
            attributes = self._attributes[names]
        except KeyError:
            attributes = self._attributes[names] = _Attributes(names) if _are_plain(event, names) else None
        signal = None if attributes is None else _signal_of(event)
        if attributes is None or not signal or signal in self._unclear:
            return
        values = event.values()
        identity = values[attributes.id]
        if not identity or (attributes.may_be_unedited and _are_zeros([values[at] for at in attributes.at])):
            return
        sort = (event.tag, *[values[at] for at in attributes.words])
        shape = attributes.shapes.get(sort)
        is_first = self._whole
        if shape is None:
            if event.tag not in EVENT_ROLES or not attributes.is_readable(values):
                return
            shape = attributes.shapes[sort] = Shape(event, attributes.settings)
            is_first = True
        taken, events, texts = self.taken, self._events, self._texts
        row = (shape, identity, signal, len(events.labels), *[texts[values[at]] for at in attributes.at])
        events.labels.append(values[attributes.name] if attributes.name is not None else None)
        events.lines.append(event.sourceline or 0)
        size = 1 + len(event)
        events.sizes.append(size)
        if signal not in taken.signals:
            taken.references.add(signal)
        if self._remove_later(event, parent, size, is_first=is_first):
            taken.runs[event] = self._run = [row]
        else:
            self._run.append(row)

    def _remove_later(self, element: Element, parent: Element, size: int = 1, *, is_first: bool = False) -> bool:
        """Remove an element when the next one is complete, as the parser is busy behind it; say whether it stays, as the first of a run."""
        first, before = self._first, self._last
        # Before the second of a run there is the first, which stays.
        follows = first if before is None else before[0]
        goes_on = first is not None and not is_first and element.getprevious() is follows
        if before is not None:
            before[1].remove(before[0])
        if first is not None and goes_on:
            self._last = element, parent
            self.taken.gone[first] += size
            return False
        self._last = None
        self._first = element
        self.taken.gone[element] = 0
        return True


def _are_plain(event: Element, names: Sequence[str]) -> bool:
    """Whether attributes with these names state nothing but QoS, in a way that depends on no value."""
    settings = [
        key(name[len(QOS) :]) for name in names if name.startswith(QOS) and name[len(QOS) :] not in EVENT.attributes
    ]
    return (
        "id" in names
        and _OF_FLOW.isdisjoint(names)
        and len({*settings}) == len(settings)
        and not any(is_lost(event, name) for name in names)
    )


def _are_zeros(texts: Iterable[str]) -> bool:
    return all(number(text) == 0 for text in texts)


def _signal_of(event: Element) -> str | None:
    """Return the reference of the only signal definition of an event; None where it holds anything else that means something."""
    found = None
    # An iterator takes longer than the only child.
    for child in (event[0],) if len(event) == 1 else event:
        tag = child.tag
        if tag == SIGNAL_DEFINITION and found is None:
            found = _reference(child)
        elif tag not in _SAYS_NOTHING:
            return None
        if len(child):
            return None
    return found


def _reference(definition: Element) -> str:
    """Return the reference of a signal definition that states nothing else; empty where it has to be looked at, or looked up there."""
    found = ""
    for name, value in definition.items():
        if name == "signalRef":
            found = value.strip()
        elif name != "id":
            return ""
    return "" if ":" in found else found
