"""Signals: which topic a signal event throws to or catches from, and what is stated about topics."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.bpmn.document import ITEM_DEFINITION, SIGNAL, identity, nth, split
from cqos_core.bpmn.endpoints import EventTopic
from cqos_core.bpmn.form import SIGNAL as FORM
from cqos_core.bpmn.names import POLICIES, fold, is_computed, key, same_value, shown
from cqos_core.bpmn.qos_namespace import acceptances, extension_children, flag, qos_children, qos_settings
from cqos_core.model.system import Topic

if TYPE_CHECKING:
    from cqos_core.bpmn.document import Document
    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.foreign_attributes import Unknown
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.settings import Place, Settings

_INSTANCE_SCOPES = {"processInstance"}


class Signals:
    """Tells for every signal event what its topic is.

    Attributes:
        lost: QoS that stands on signals, where nothing reads it: by their names, by policy.
    """

    def __init__(self, reading: DiagramReading, lost: dict[str, dict[str, Unknown]]) -> None:
        """Use the signals of the document that is being read, and what is ``foreign_attributes`` on them."""
        self._reading = reading
        self.lost = {name: unknown for name, unknown in lost.items() if unknown}
        self._topics: dict[str, EventTopic] = {}

    def topic(self, reference: str) -> EventTopic:
        """Return where events meet others by a signal that has a fixed name and stayed in the tree, wherever they stand."""
        if reference not in self._topics:
            document = self._reading.document
            signal = document.find(SIGNAL, reference, document.root)
            self._topics[reference] = self._topic(fold(None if signal is None else signal.get("name")), signal)
        return self._topics[reference]

    def _topic(self, name: str, signal: Element | None) -> EventTopic:
        """Return a topic; ``signal`` states more than its name."""
        stated = None if signal is None else self._type(signal)
        return EventTopic(name, type=stated, lost=tuple(self.lost.get(name, {}).values()))

    def meeting(self, event: Element, definition: Element) -> EventTopic | None:
        """Return where ``event`` meets others by one of its signal definitions.

        The topic is the signal's name, else the event's own, else none. None is returned where the signal never
        leaves the process instance, so that the event is no endpoint at all.
        """
        reference = (definition.get("signalRef") or "").strip()
        if not reference:
            if expression := _engine_attribute(definition, "signalExpression"):
                return self._computed(event, expression)
            return self._guess(event, "names no signal")
        document = self._reading.document
        signal = document.find(SIGNAL, reference, definition)
        name = None if signal is not None else document.look_up(document.parts.signals, reference, definition)
        if name is not None:
            return self._topic(name, None)
        if signal is None:
            message = f"`signalRef` names `{shown(reference)}`, which is no signal in this file"
            place = self._reference_place(event, definition)
            advice = "add the signal, or choose one that is there; other files are not searched for it"
            self._reading.note("CQ032", message, place, advice=advice, endpoint=identity(event))
            return self._guess(event, "names a signal that is not there")
        if _stays_inside(signal):
            message = f"the signal `{shown(signal.get('name') or reference)}` stays inside its process instance"
            self._note(event, "CQ037", f"{message}, so this event is no endpoint")
            return None
        name = fold(signal.get("name"))
        if not name:
            return self._guess(event, f"refers to `{shown(reference)}`, a signal without a name")
        if is_computed(name):
            return self._computed(event, name)
        return self._topic(name, signal)

    def _guess(self, event: Element, why: str) -> EventTopic:
        name = fold(event.get("name"))
        if not name:
            message = f"the event {why} and has no name itself, so it has no topic and is not paired"
            self._note(event, "CQ033", message, "choose a signal for the event, and give the signal a name")
            return EventTopic(None)
        if is_computed(name):
            return self._computed(event, name)
        message = f"the event {why}; its own name `{shown(name)}` is taken for the topic"
        self._note(event, "CQ034", message, "choose a signal for the event")
        return EventTopic(name, is_guess=True)

    def _computed(self, event: Element, expression: str) -> EventTopic:
        message = f"the topic `{shown(expression)}` is known at run time only, so the event is not paired"
        self._note(event, "CQ036", message, "choose a signal with a fixed name")
        return EventTopic(None)

    def _type(self, signal: Element) -> str | None:
        definition = self._reading.document.find(ITEM_DEFINITION, signal.get("structureRef") or "", signal)
        return None if definition is None else (definition.get("structureRef") or "").strip() or None

    def _reference_place(self, event: Element, definition: Element) -> Place:
        document = self._reading.document
        if definition not in event.children:
            return document.place(event)
        return document.place(definition, f"bpmn:signalEventDefinition[{nth(definition, event)}]/@signalRef", event)

    def _note(self, event: Element, code: str, message: str, advice: str | None = None) -> None:
        place = self._reading.document.place(event)
        self._reading.note(code, message, place, advice=advice, endpoint=identity(event))


def unclear_signals(document: Document) -> set[str]:
    """Return the references to signals by which something has to be said of events that are rows: they have no topic for sure."""
    parts = document.parts
    return {each for each in parts.references - parts.signals.keys() if not _is_clear(document, each)}


def _is_clear(document: Document, reference: str) -> bool:
    signal = document.find(SIGNAL, reference, document.root)
    name = "" if signal is None or _stays_inside(signal) else fold(signal.get("name"))
    return bool(name) and not is_computed(name)


def _stays_inside(signal: Element) -> bool:
    return _engine_attribute(signal, "scope") in _INSTANCE_SCOPES


def read_signals(reading: DiagramReading) -> Signals:
    """Add to the system what is stated on signals, and report signals that are one although they look like two."""
    parts = reading.document.parts
    by_name: dict[str, str] = {}
    ids: set[str] = set()
    lost: dict[str, dict[str, Unknown]] = {}
    for signal in reading.document.all(SIGNAL):
        place = reading.document.place(signal)
        identifier, name = identity(signal), fold(signal.get("name"))
        if identifier in ids or identifier in parts.signals:
            message = f"the id `{shown(identifier or '')}` is used twice; references mean the first signal"
            reading.note("CQ031", message, place)
        elif name in by_name or name in parts.named:
            other = shown(by_name.get(name) or parts.named.get(name) or "without id")
            message = f"two signals are called `{shown(name)}`, this one and `{other}`: they are one topic"
            reading.note("CQ035", message, place)
        elif name:
            by_name[name] = identifier or ""
        if identifier:
            ids.add(identifier)
        lost.setdefault(name, {}).update({key(each[0]): each for each in _read_topic(reading, signal, name)})
    return Signals(reading, lost)


def _read_topic(reading: DiagramReading, signal: Element, name: str) -> list[Unknown]:
    """Add the facts and acceptances that a signal states, and return the QoS on it, which is not read there."""
    place = reading.document.place(signal)
    stated = qos_settings(reading, signal, FORM.attributes)
    facts = {word: setting for word, setting in stated.items() if key(word) not in POLICIES}
    misplaced = {word: setting for word, setting in stated.items() if word not in facts}
    cause = "QoS on a signal is not read; it belongs on the events that throw or catch the signal"
    extensions = extension_children(signal)
    lost = [
        *reading.lost.children(extensions, FORM.elements),
        *reading.lost.settings(signal),
        *reading.lost.misplaced(misplaced, cause),
    ]
    external = flag(reading, signal, "external")
    children = qos_children(reading, signal, FORM.elements, extensions)
    if not (facts or children or external is not None):
        return lost
    if not name:
        message = "what is stated about this signal is lost, because the signal has no name"
        reading.note("CQ040", message, place, advice="give the signal a name")
        return lost
    topic = reading.system.topics.setdefault(name, Topic(name, place=place))
    topic.external = topic.external or bool(external)
    _merge(reading, topic.settings, facts, place)
    reading.system.accept += [replace(found, topic=name) for found in acceptances(reading, children)]
    return lost


def _merge(reading: DiagramReading, settings: Settings, facts: Settings, place: Place) -> None:
    for name, setting in facts.items():
        before = settings.setdefault(name, setting)
        if not same_value(before.text, setting.text):
            message = (
                f"`{shown(name)}` of this topic is `{shown(before.text)}` already; `{shown(setting.text)}` is taken"
            )
            reading.note("CQ039", message, setting.place or place)
        settings[name] = setting


def _engine_attribute(element: Element, local: str) -> str | None:
    """Return an attribute that process engines add, in the namespace of any of them."""
    found = (value for name, value in element.items() if split(name)[1] == local and name != local)
    return next(found, None)
