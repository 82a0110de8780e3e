"""Makes the parts of a diagram while it is parsed.

lxml's parser tells a target of one tag after the other, and an element goes into the tree when it is complete. A signal that has an id and a
name and nothing else is kept as these. An event that throws or catches one signal, and states what it states in attributes, becomes a row.
What the attributes of an event mean depends on their names, and is read once for all that have the same: this module only looks where its
texts are.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.diagram_rows import Parts
from cqos_core.bpmn.document import BPMN, EVENT_ROLES, EXTENSIONS, PROCESS, ROLES, SIGNAL, SIGNAL_DEFINITION
from cqos_core.bpmn.element import Element
from cqos_core.bpmn.foreign_attributes import is_lost
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.names import POLICIES, fold, is_computed, key, number
from cqos_core.bpmn.qos import decimal_text
from cqos_core.bpmn.qos_namespace import FLAGS, QOS
from cqos_core.importers.xml_source import LONGEST_TEXT, LongTextError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from cqos_core.bpmn.event_kinds import EventPlaces
    from cqos_core.model.endpoint_rows import Row

_SAYS_NOTHING: Final = frozenset(f"{BPMN}{name}" for name in ("incoming", "outgoing", "documentation"))
_OF_FLOW: Final = frozenset(
    ("attachedToRef", "cancelActivity", "isInterrupting", "parallelMultiple", "isForCompensation", "triggeredByEvent")
)
"""Attributes that say when an event happens: the control flow reads them."""
_EXTERNAL: Final = f"{QOS}external"
_READABLE: Final = frozenset(("", *FLAGS))
_PLAIN_DEFINITION: Final = frozenset(("id", "signalRef"))
_OWNERS: Final = frozenset((*ROLES, EXTENSIONS))


class Shape:
    """Events that differ in ids, names, signals and the texts of settings.

    Attributes:
        example: the first of them, which is in the tree.
        settings: the names of the settings whose texts stand in a row.
    """

    __slots__ = ("example", "settings")

    def __init__(self, example: Element, settings: Sequence[str]) -> None:
        self.example, self.settings = example, settings


class _Attributes:
    """What attributes of an event mean that have certain names.

    Attributes:
        words: those of C-QoS's own words, which all events of a shape share.
        settings: those of settings, without their namespace.
        texts: returns their texts, of what an event states.
        may_be_unedited: whether they are the eight that modelers write unasked.
        shapes: by the tag and the texts of words.
    """

    __slots__ = ("may_be_unedited", "settings", "shapes", "texts", "words")

    def __init__(self, names: Iterable[str]) -> None:
        of_qos = [name for name in names if name.startswith(QOS)]
        self.words = [name for name in of_qos if name[len(QOS) :] in EVENT.attributes]
        settings = [name for name in of_qos if name not in self.words]
        self.settings = tuple([name[len(QOS) :] for name in settings])
        self.texts = _texts_of(settings)
        self.may_be_unedited = POLICIES <= set(map(key, self.settings))
        self.shapes: dict[str | tuple[str, ...], Shape] = {}


def _texts_of(names: Sequence[str]) -> Callable[[Mapping[str, str]], Sequence[str]]:
    if len(names) > 1:
        return itemgetter(*names)  # which returns no sequence for less
    return lambda stated: [stated[name] for name in names]


class _Texts(dict[str, str]):
    """Texts of settings by what is written, equal ones as one object."""

    def __missing__(self, written: str) -> str:
        self[written] = text = decimal_text(written)
        return text


class DiagramTarget:
    """A target of lxml's parser, for one document."""

    def __init__(self, places: EventPlaces, unclear: Collection[str] = (), *, whole: bool = False) -> None:
        """Begin without any.

        Args:
            places: takes where the events are that become rows.
            unclear: references to signals of which something is to be said: their events stay in the tree.
            whole: leave each event in the tree, beside its row.
        """
        self._document = Element("", {}, {}, -1)
        self._parts = Parts(self._document, places)
        self._unclear = unclear
        self._whole = whole
        self._open = [self._document]  # each in the one before, until its end tag comes
        self._number = -1  # of the last start tag
        self._is_start = False  # whether it is the last tag
        self._text: list[str] = []  # behind it
        self._letters = 0  # of the text
        self._around: Element | None = None  # what the last event was in
        self._is_process = False  # whether that belongs to a process
        self._first: Element | None = None  # event of the last run
        self._run: list[Row] = []
        self._attributes: dict[tuple[str, ...], _Attributes | None] = {}
        self._texts = _Texts()
        self._others: set[str | None] = set()  # ids and names of signals in the tree
        self._called_qos = {""}  # namespaces that have the prefix

    def parts(self) -> Parts:
        """Return the parts of a document that was parsed to its end."""
        (self._parts.root,) = self._document.children
        return self._parts

    def start(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str, str]) -> None:
        """Take a start tag, and the namespaces that it declares."""
        above = self._open[-1]
        if self._text:
            self._end_text(above)
        self._is_start = True
        self._number += 1
        bound = self._declared(above, namespaces) if namespaces else above.namespaces
        self._open.append(Element(tag, attributes, bound, self._number))

    def data(self, text: str) -> None:
        """Take text, or a part of it."""
        if self._is_start:
            self._text.append(text)
            self._letters += len(text)
            if self._letters > LONGEST_TEXT:
                raise LongTextError

    def end(self, tag: str) -> None:
        """Take an end tag."""
        element = self._open.pop()
        if self._text:
            self._end_text(element)
        self._is_start = False
        above = self._open[-1]
        if tag in EVENT_ROLES:
            is_row = self._is_in_process(above) and self._is_row(element, above)
        else:
            is_row = tag == SIGNAL and self._is_name(element)
        if not is_row:
            above.children.append(element)

    def close(self) -> None:
        """Take the end of the document."""

    def _end_text(self, element: Element) -> None:
        element.text = "".join(self._text)
        self._text.clear()
        self._letters = 0

    def _declared(self, above: Element, namespaces: Mapping[str, str]) -> dict[str, str]:
        """Return what prefixes mean in an element, and note which namespaces are called ``qos``."""
        if namespaces.get("qos", "") not in self._called_qos:
            self._called_qos.add(namespaces["qos"])
            self._attributes.clear()
        return {**above.namespaces, **namespaces}

    def _is_in_process(self, above: Element) -> bool:
        """Whether what is in an element belongs to a process: whatever events, tasks and extensions hold is their own."""
        if above is not self._around:
            tags = [each.tag for each in self._open]
            self._around, self._is_process = above, PROCESS in tags and _OWNERS.isdisjoint(tags)
        return self._is_process

    def _is_name(self, signal: Element) -> bool:
        """Keep a signal that has an id and a name, which no signal before it has, and nothing else; say whether it is one."""
        stated = signal.attrib
        identity, name = stated.get("id"), fold(stated.get("name"))
        parts = self._parts
        is_new = identity not in parts.signals and name not in parts.named and self._others.isdisjoint((identity, name))
        is_plain = len(stated) == len(("id", "name")) and not signal.children and not is_computed(name)
        is_below_root = len(self._open) == len(("document", "root"))
        if not identity or ":" in identity or not name or not (is_new and is_plain and is_below_root):
            self._others.update((identity, name))
            return False
        parts.signals[identity] = name
        parts.named[name] = identity
        return True

    def _is_row(self, event: Element, above: Element) -> bool:
        """Make a row of an event that throws or catches one signal, unless more is to be said of it; say whether the tree can do without."""
        stated = event.attrib
        names = tuple(stated)
        try:
            attributes = self._attributes[names]
        except KeyError:
            is_plain = _are_plain(names, self._called_qos)
            attributes = self._attributes[names] = _Attributes(names) if is_plain else None
        signal = None if attributes is None else _signal_of(event)
        if attributes is None or not signal or signal in self._unclear:
            return False
        identity, settings = stated["id"], attributes.texts(stated)
        sort = (event.tag, *[stated[name] for name in attributes.words]) if attributes.words else event.tag
        shape = attributes.shapes.get(sort)
        if (
            not identity
            or (attributes.may_be_unedited and all(number(text) == 0 for text in settings))
            or (shape is None and stated.get(_EXTERNAL, "").strip() not in _READABLE)
        ):
            return False
        is_first = shape is None or self._whole or not above.children or above.children[-1] is not self._first
        if shape is None:
            shape = attributes.shapes[sort] = Shape(event, attributes.settings)
        if is_first:
            self._first = event
            self._run = self._parts.runs[event] = []
        parts, texts = self._parts, self._texts
        self._run.append((shape, identity, signal, len(parts.places.labels), *[texts[each] for each in settings]))
        parts.places.labels.append(stated.get("name"))
        parts.places.numbers.append(event.number)
        if signal not in parts.signals:
            parts.references.add(signal)
        return not is_first


def _are_plain(names: Sequence[str], called_qos: Collection[str]) -> bool:
    """Whether attributes with these names state nothing but QoS, in a way that depends on no value."""
    settings = [
        key(name[len(QOS) :]) for name in names if name.startswith(QOS) and name[len(QOS) :] not in EVENT.attributes
    ]
    return (
        "id" in names
        and _OF_FLOW.isdisjoint(names)
        and len({*settings}) == len(settings)
        and not any(is_lost(name, called_qos) for name in names)
    )


def _signal_of(event: Element) -> str | None:
    """Return the reference of an event that holds one signal definition with a plain one, and else nothing that means something."""
    found = None
    for child in event.children:
        if child.tag == SIGNAL_DEFINITION and found is None:
            found = child.attrib.get("signalRef", "").strip()
            if ":" in found or not _PLAIN_DEFINITION.issuperset(child.attrib):
                return None
        elif child.tag not in _SAYS_NOTHING:
            return None
        if child.children:
            return None
    return found
