"""The parts of a diagram: rows of its signal events, names of its signals, and a tree of everything else.

lxml's parser tells `Parts` of one tag after the other. A signal that has an id and a name and nothing else is kept as these. An event that
throws or catches one signal, and states what it states in attributes, becomes a row. What the attributes of an event mean depends on their
names, and is read once for all that have the same: this module only looks where its texts are.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from lxml import etree

from cqos_core.bpmn.document import BPMN, EVENT_ROLES, EXTENSIONS, PROCESS, ROLES, SIGNAL, SIGNAL_DEFINITION
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.lost import is_lost
from cqos_core.bpmn.names import POLICIES, fold, is_computed, key, number
from cqos_core.bpmn.qos import decimal_text
from cqos_core.bpmn.words import FLAGS, QOS
from cqos_core.importers.xml_source import LONGEST_TEXT, NotBuiltError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from cqos_core.bpmn.event_kinds import EventPlaces
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.rows import Row

_SAYS_NOTHING: Final = frozenset(f"{BPMN}{name}" for name in ("incoming", "outgoing", "documentation"))
_OF_FLOW: Final = frozenset(
    ("attachedToRef", "cancelActivity", "isInterrupting", "parallelMultiple", "isForCompensation", "triggeredByEvent")
)
"""Attributes that say when an event happens: the control flow reads them."""
_EXTERNAL: Final = f"{QOS}external"
_READABLE: Final = frozenset(("", *FLAGS))
# What may stay out of the tree below an element: below the root, in a process, elsewhere, and in what is its owner's alone.
_SIGNALS: Final[Collection[str]] = frozenset((SIGNAL,))
_EVENTS: Final[Collection[str]] = frozenset(EVENT_ROLES)
_NOT_YET: Final[Collection[str]] = frozenset()
_NEVER: Final[Collection[str]] = ()


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
        self.shapes: dict[tuple[str, ...], Shape] = {}


def _texts_of(names: Sequence[str]) -> Callable[[Mapping[str, str]], Sequence[str]]:
    if len(names) > 1:
        return itemgetter(*names)  # which returns no sequence for less
    return lambda stated: [stated[name] for name in names]


class _Texts(dict[str, str]):
    """Texts of settings by what is written, equal ones as one object."""

    def __missing__(self, written: str) -> str:
        self[written] = text = decimal_text(written)
        return text


class Parts:
    """A target of lxml's parser, for one document.

    Attributes:
        root: of the tree, whose elements have no text behind them.
        numbers: of the start tags of its elements in the document, beginning with 0.
        runs: neighbouring events as rows, by the first of them, which is in the tree and stands for all of them.
        places: of the events that are rows.
        signals: names by ids.
        named: ids by names.
        references: by which events name signals that were not there before them.
    """

    root: Element

    def __init__(self, places: EventPlaces, unclear: Collection[str] = (), *, whole: bool = False) -> None:
        """Begin without any.

        Args:
            places: takes where the events are that become rows.
            unclear: references to signals of which something is to be said: their events stay in the tree.
            whole: leave each event in the tree, beside its row.
        """
        self.numbers: dict[Element, int] = {}
        self.runs: dict[Element, list[Row]] = {}
        self.places = places
        self.signals: dict[str, str] = {}
        self.named: dict[str, str] = {}
        self.references: set[str] = set()
        self._unclear = unclear
        self._whole = whole
        self._tree = etree.TreeBuilder()
        self._may_be_held = [_NOT_YET]  # below each element of the tree that is not complete
        self._run: list[Row] | None = None  # to which the next event belongs, if it becomes a row
        self._number = -1  # of the last start tag
        self._letters = 0  # behind the last tag
        self._is_start = False  # the last tag
        self._held: list[tuple[Any, ...]] = []  # calls that put what may stay out of the tree into it
        self._depth = 0  # of the elements that are not complete, in what is held
        self._signal: str | None = None  # the reference of the event that is held
        self._attributes: dict[tuple[str, ...], _Attributes | None] = {}
        self._texts = _Texts()
        self._others: set[str | None] = set()  # ids and names of signals in the tree
        self._called_qos = {""}  # namespaces that have the prefix

    def start(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str, str]) -> None:
        """Take a start tag, and the namespaces that it declares."""
        self._number += 1
        self._letters, self._is_start = 0, True
        if self._held:
            self._held.append((self._open, tag, attributes, namespaces, self._number))
            if tag == SIGNAL_DEFINITION and self._signal is None and not self._depth:
                self._signal = _reference(attributes)
            elif self._depth or tag not in _SAYS_NOTHING:
                self._release()
                return
            self._depth += 1
        elif tag in self._may_be_held[-1]:
            self._held.append((self._open, tag, attributes, namespaces, self._number))
            self._signal = "" if tag == SIGNAL else None
        else:
            self._open(tag, attributes, namespaces, self._number)

    def data(self, text: str) -> None:
        """Take text, or a part of it."""
        self._letters += len(text)
        if self._letters > LONGEST_TEXT:
            raise NotBuiltError
        if self._is_start:
            if self._held:
                self._held.append((self._tree.data, text))
            else:
                self._tree.data(text)

    def end(self, tag: str) -> None:
        """Take an end tag."""
        self._letters, self._is_start = 0, False
        if not self._held:
            self._close(tag)
            return
        self._held.append((self._close, tag))
        if self._depth:
            self._depth -= 1
        elif tag == SIGNAL:
            self._end_signal(self._held[0][2])
        else:
            self._end_event(*self._held[0][1:])

    def close(self) -> None:
        """Take the end of the document."""

    def use(self, root: Element) -> None:
        """Have a tree that holds everything."""
        self.root = root
        self.numbers = {element: number for number, element in enumerate(root.iter("*"))}

    def _open(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str, str], number: int) -> Element:
        """Put an element into the tree."""
        bound = self._declared(namespaces) if namespaces else None
        try:
            element: Element = self._tree.start(tag, attributes, bound)
        except ValueError:  # the parser may know more names than the builder
            raise NotBuiltError from None
        self._run = None
        if tag == SIGNAL:
            self._others.update((attributes.get("id"), fold(attributes.get("name"))))
        below = self._may_be_held[-1]
        if not self.numbers:
            self.root, below = element, _SIGNALS
        elif tag in ROLES or tag == EXTENSIONS:
            below = _NEVER
        elif tag == PROCESS and below is not _NEVER:
            below = _EVENTS
        elif below is _SIGNALS:
            below = _NOT_YET
        self._may_be_held.append(below)
        self.numbers[element] = number
        return element

    def _declared(self, namespaces: Mapping[str, str]) -> dict[str | None, str]:
        """Return namespaces by prefixes as trees have them, and note which are called ``qos``."""
        if namespaces.get("qos", "") not in self._called_qos:
            self._called_qos.add(namespaces["qos"])
            self._attributes.clear()
        return {prefix or None: uri for prefix, uri in namespaces.items()}

    def _close(self, tag: str) -> None:
        """Complete an element of the tree."""
        self._tree.end(tag)
        self._run = None
        self._may_be_held.pop()

    def _release(self) -> Element:
        """Put what is held into the tree, and return the first element of it."""
        ((opening, *given), *others), self._held, self._depth = self._held, [], 0
        element: Element = opening(*given)
        for call, *given in others:
            call(*given)
        return element

    def _end_signal(self, stated: Mapping[str, str]) -> None:
        """Keep a signal that has an id and a name, which no signal before it has, and nothing else; put another one into the tree."""
        identity, name = stated.get("id"), fold(stated.get("name"))
        is_new = identity not in self.signals and name not in self.named and self._others.isdisjoint((identity, name))
        is_plain = len(stated) == len(("id", "name")) and not is_computed(name)
        if not identity or ":" in identity or not name or not is_new or not is_plain:
            self._release()
            return
        self._held.clear()
        self.signals[identity] = name
        self.named[name] = identity

    def _end_event(self, tag: str, stated: Mapping[str, str], namespaces: Mapping[str, str], at: int) -> None:
        """Make a row of an event that throws or catches one signal; put one into the tree of which more has to be said."""
        if namespaces:
            self._declared(namespaces)
        names = tuple(stated)
        try:
            attributes = self._attributes[names]
        except KeyError:
            is_plain = _are_plain(names, self._called_qos)
            attributes = self._attributes[names] = _Attributes(names) if is_plain else None
        signal = self._signal
        if attributes is None or not signal or signal in self._unclear:
            self._release()
            return
        identity, settings = stated["id"], attributes.texts(stated)
        sort = (tag, *[stated[name] for name in attributes.words]) if attributes.words else (tag,)
        shape = attributes.shapes.get(sort)
        if (
            not identity
            or (attributes.may_be_unedited and all(number(text) == 0 for text in settings))
            or (shape is None and stated.get(_EXTERNAL, "").strip() not in _READABLE)
        ):
            self._release()
            return
        run = self._run
        if shape is None or run is None or self._whole:
            first, run = self._release(), []
            if shape is None:
                shape = attributes.shapes[sort] = Shape(first, attributes.settings)
            self.runs[first] = self._run = run
        else:
            self._held.clear()
        places, texts = self.places, self._texts
        run.append((shape, identity, signal, len(places.labels), *[texts[each] for each in settings]))
        places.labels.append(stated.get("name"))
        places.numbers.append(at)
        if signal not in self.signals:
            self.references.add(signal)


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


def _reference(definition: Mapping[str, str]) -> str:
    """Return the reference of a signal definition that states nothing else; empty where it has to be looked at, or looked up there."""
    found = ""
    for name, value in definition.items():
        if name == "signalRef":
            found = value.strip()
        elif name != "id":
            return ""
    return "" if ":" in found else found
