"""QoS of one element in its three dialects: attributes, FaMe's ``qos:policy``, Camunda's properties."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.bpmn.document import identity
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.names import POLICIES, key, number, same_value, shown
from cqos_core.bpmn.qos_namespace import QOS, qos_settings
from cqos_core.model.settings import Cases, Setting

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.extensions import Child
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.settings import Settings

_ZEROS = Cases("what eight zeros mean", (("they were chosen", "0"), ("they were never edited", "")))
_CODED = frozenset({"reliability", "durability"})
"""Policies whose zero is the code of a value other than the default."""
_EXPONENT = re.compile(r"\d+(?:\.\d*)?[eE][+-]?\d{1,3}")
_MOST_DIGITS = 30
_ENGINES = ("camunda", "zeebe")


def read_qos(reading: DiagramReading, element: Element, extensions: list[Child]) -> Settings:
    """Return the QoS stated on ``element``, each value as text under the name it was written with.

    Attributes win over ``qos:policy``, and that over Camunda properties. Values that disagree are reported.

    Args:
        reading: takes the notes.
        element: an event or a task.
        extensions: its `extension_children`.
    """
    merged: dict[str, tuple[str, Setting, str]] = {}
    for source, statements in (
        ("Camunda properties", _property_settings(reading, extensions)),
        ("`qos:policy`", _policy_settings(reading, extensions)),
        ("an attribute", qos_settings(reading, element, EVENT.attributes).items()),
    ):
        for name, setting in statements:
            folded = key(name)
            before = merged.get(folded)
            # FaMe writes one more `qos:policy` for each edit, so an older value among them is no contradiction.
            if before is not None and not (before[2] == source == "`qos:policy`"):
                _compare(reading, name, before, setting, source)
            merged[folded] = name, setting, source
    settings = {name: _without_exponent(setting) for name, setting, _ in merged.values()}
    if all(name in merged and number(merged[name][1].text) == 0 for name in POLICIES):
        message = "all eight QoS attributes are 0, which modelers write unasked: are these values chosen?"
        reading.note("CQ038", message, reading.document.place(element), endpoint=identity(element))
        settings |= {name: replace(settings[name], unknown=_ZEROS) for name in settings if key(name) in _CODED}
    return settings


def _without_exponent(setting: Setting) -> Setting:
    text = decimal_text(setting.text)
    return setting if text == setting.text else replace(setting, text=text)


def decimal_text(text: str) -> str:
    """Return a number without an exponent: JavaScript writes ``1e-7`` for 0.0000001."""
    found = number(text) if _EXPONENT.fullmatch(text.strip()) else None
    return text if found is None or abs(found.adjusted()) > _MOST_DIGITS else f"{found:f}"


def message_type(element: Element, extensions: list[Child]) -> str | None:
    """Return the message type stated on ``element``: ``qos:type``, ``ros:message``, a property ``type``."""
    stated = [element.get(f"{QOS}type")]
    stated += [c.element.get("type") for c in extensions if (c.prefix, c.word) == ("ros", "message")]
    stated += [value for name, value, _ in _properties(extensions) if name == "type"]
    return next((text.strip() for text in stated if text and text.strip()), None)


def _compare(
    reading: DiagramReading, name: str, before: tuple[str, Setting, str], setting: Setting, source: str
) -> None:
    _, other, other_source = before
    if setting.place is not None and not same_value(other.text, setting.text):
        message = (
            f"`{shown(name)}` is `{shown(other.text)}` in {other_source} and `{shown(setting.text)}` in {source}; "
            f"`{shown(setting.text)}` is taken"
        )
        reading.note("CQ039", message, setting.place, endpoint=setting.place.element)


def _policy_settings(reading: DiagramReading, extensions: list[Child]) -> Iterator[tuple[str, Setting]]:
    """Yield what FaMe writes: attributes without a namespace; its ``type`` and ``value`` repeat one of them."""
    for child in extensions:
        if not child.is_word("policy"):
            continue
        for written, value in child.element.items():
            name = written.removeprefix(QOS)
            if name.startswith("{") or name in {"type", "value", "id"}:
                continue
            path = f"qos:{name}" if written.startswith(QOS) else name
            yield name, Setting(value, child.place(reading.document, path))


def _property_settings(reading: DiagramReading, extensions: list[Child]) -> Iterator[tuple[str, Setting]]:
    for name, value, child in _properties(extensions):
        if key(name) in POLICIES:
            yield name, Setting(value, child.place(reading.document, "value"))


def _properties(extensions: list[Child]) -> Iterator[tuple[str, str, Child]]:
    for child in extensions:
        name, value = child.element.get("name"), child.element.get("value")
        if child.prefix in _ENGINES and child.word == "property" and name is not None and value is not None:
            yield name.strip(), value, child
