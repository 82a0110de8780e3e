"""The namespace ``http://qos``: attributes of an element and children of its ``extensionElements``.

Beside the eight QoS attributes it has words of C-QoS's own, which `cqos_core.bpmn.form` lists. Which of them mean something depends
on the element; the rest is reported, never dropped silently.
"""

from __future__ import annotations

from datetime import date
from typing import TYPE_CHECKING, Any, Final

from cqos_core.bpmn.document import COLLABORATION, EXTENSIONS, identity, split
from cqos_core.bpmn.extensions import Child
from cqos_core.bpmn.form import BOUNDS, FORM, MODEL, ROLES, SEVERITIES, WHERE
from cqos_core.bpmn.names import shown
from cqos_core.importers.source_reading import listed
from cqos_core.model.excerpt import NAMESPACES
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import Acceptance, Bound, TeamRule

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator

    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.settings import Settings

QOS = f"{{{NAMESPACES['qos']}}}"
_PREFIXES = {uri: prefix for prefix, uri in NAMESPACES.items()}
FLAGS: Final = {"true": True, "1": True, "false": False, "0": False}


def extension_children(owner: Element) -> list[Child]:
    """Return what ``extensionElements`` of ``owner`` hold in one of the `NAMESPACES`.

    Of ``camunda:properties`` and its like the single properties are returned.
    """
    found: list[Child] = []
    counts: dict[str, int] = {}
    for extensions in owner.having(EXTENSIONS):
        for element in extensions.children:
            namespace, local = split(element.tag)
            prefix = _PREFIXES.get(namespace)
            if prefix is None:
                continue
            inner = [element] if local != "properties" else element.having(f"{{{namespace}}}property")
            for child in inner:
                name = split(child.tag)[1]
                tag = f"{prefix}:{name}"
                counts[tag] = counts.get(tag, 0) + 1
                word = name[:1].lower() + name[1:]
                found.append(Child(child, owner, prefix, word, f"{tag}[{counts[tag]}]"))
    return found


def required(reading: DiagramReading, child: Child, *names: str) -> list[str] | None:
    """Return the values of attributes; None, and a note for each that is missing, unless all are there."""
    values = [(child.element.get(name) or "").strip() for name in names]
    for name, value in zip(names, values, strict=True):
        if not value:
            message = f"`qos:{child.word}` has no `{name}`, which it needs"
            reading.note("CQ042", message, child.place(reading.document, name), endpoint=identity(child.owner))
    return values if all(values) else None


def _home(word: str) -> str | None:
    """Say where a ``qos:`` child is read; None where it is not known."""
    homes = [each for owner in FORM.owners if word in owner.elements for each in owner.called]
    return f"on {listed(homes, 'and')}" if homes else None


def qos_children(
    reading: DiagramReading, owner: Element, words: Iterable[str], children: Iterable[Child] | None = None
) -> list[Child]:
    """Return the ``qos:`` children of ``owner`` that are one of ``qos_namespace``; report the others.

    ``children`` are its `extension_children`, if the caller has them already.
    """
    known = []
    for child in extension_children(owner) if children is None else children:
        if child.prefix != "qos":
            continue
        if child.word in words:
            known.append(child)
            continue
        home = _home(child.word)
        message = f"`qos:{shown(child.word)}` is not known" if home is None else f"`qos:{child.word}` is read {home}"
        local = split(owner.tag)[1]
        advice = f"expected {', '.join(f'`qos:{word}`' for word in sorted(words))} here"
        reading.note(
            "CQ041", f"{message}, so it is skipped on this `{local}`", child.place(reading.document), advice=advice
        )
    return known


def qos_attributes(element: Element) -> dict[str, str]:
    """Return the attributes in the namespace ``http://qos``, by local name, as written."""
    return {name[len(QOS) :]: value for name, value in element.items() if name.startswith(QOS)}


def qos_settings(reading: DiagramReading, element: Element, own: Container[str]) -> Settings:
    """Return the attributes in the namespace ``http://qos`` that are none of C-QoS's ``own`` words here."""
    at = reading.document.place(element)
    return {
        name: Setting(value, Place(at.source, at.line, None, at.element, f"@qos:{name}"))
        for name, value in qos_attributes(element).items()
        if name not in own
    }


def word(element: Element, name: str) -> str | None:
    """Return an attribute that is one of C-QoS's own words; blank means not stated."""
    return (element.get(f"{QOS}{name}") or "").strip() or None


def flag(reading: DiagramReading, element: Element, name: str) -> bool | None:
    """Return an attribute that is true or false, None where it is not stated."""
    text = word(element, name)
    if text is None:
        return None
    if text not in FLAGS:
        message = f"`qos:{name}` is `{shown(text)}`, it can be `true` or `false`"
        reading.note("CQ043", message, reading.document.place(element, f"@qos:{name}"))
    return FLAGS.get(text)


def acceptances(reading: DiagramReading, children: Iterable[Child]) -> Iterator[Acceptance]:
    """Yield the ``qos:accept`` among ``children``; whom they concern is the caller's to say."""
    for child in children:
        values = required(reading, child, "rule", "because") if child.word == "accept" else None
        until = (child.element.get("until") or "").strip() or None
        if values is not None and _is_date(reading, child, until):
            yield Acceptance(values[0], values[1], until=until, place=child.place(reading.document, "rule"))


def _is_date(reading: DiagramReading, child: Child, until: str | None) -> bool:
    try:
        if until is not None:
            date.fromisoformat(until)
    except ValueError:
        message = f"`until` is `{shown(until or '')}`, expected a date such as `2027-01-31`"
        reading.note("CQ043", message, child.place(reading.document, "until"))
        return False
    return True


def team_rules(reading: DiagramReading, children: Iterable[Child]) -> Iterator[TeamRule]:
    """Yield the ``qos:check`` among ``children``; one that says less than it must, or the impossible, is reported instead."""
    for child in children:
        values = required(reading, child, "name", "because") if child.word == "check" else None
        if values is None:
            continue
        stated = {name: value.strip() for name, value in child.element.items() if value.strip()}
        bounds = tuple(
            Bound(stated["policy"], relation, (stated[relation],), child.place(reading.document, relation))
            for relation in BOUNDS
            if "policy" in stated and relation in stated
        )
        sentence = stated.get("sentence")
        if not bounds and sentence is None:
            missing = "policy" if "policy" not in stated else "exactly"
            required(reading, child, missing)
        elif all(
            [
                _is_one_of(reading, child, stated, "severity", SEVERITIES),
                _is_one_of(reading, child, stated, "role", ROLES),
            ]
        ):
            where = tuple((name, stated[name]) for name in WHERE if name in stated)
            severity: Any = stated.get("severity", "error")
            yield TeamRule(
                values[0], where, bounds, values[1], sentence, severity, child.place(reading.document, "name")
            )


def _is_one_of(
    reading: DiagramReading, child: Child, stated: dict[str, str], name: str, allowed: tuple[str, ...]
) -> bool:
    if stated.get(name, allowed[0]) in allowed:
        return True
    message = f"`{name}` is `{shown(stated[name])}`, it can be {listed([f'`{each}`' for each in allowed])}"
    reading.note("CQ043", message, child.place(reading.document, name))
    return False


def options(
    reading: DiagramReading, children: Iterable[Child], protocol: str | None
) -> Iterator[tuple[str, str, Setting]]:
    """Yield protocol, name and value of each ``qos:option``; where it names no protocol, ``protocol`` is meant."""
    for child in children:
        if child.word != "option":
            continue
        whose = (child.element.get("protocol") or "").strip() or protocol
        if whose is None:
            required(reading, child, "protocol", "name", "value")
        elif values := required(reading, child, "name", "value"):
            yield whose, values[0], Setting(values[1], child.place(reading.document, "value"))


def read_system_words(reading: DiagramReading) -> None:
    """Read what is stated on ``definitions`` and collaborations: the protocol, options, acceptances."""
    document, system = reading.document, reading.system
    system.protocol = word(document.root, "protocol")
    for name in qos_attributes(document.root):
        if name not in MODEL.attributes:
            message = f"`qos:{shown(name)}` is not known on `definitions`"
            reading.note(
                "CQ041",
                message,
                document.place(document.root, f"@qos:{name}"),
                advice="expected `qos:protocol`",
            )
    for element in (document.root, *document.all(COLLABORATION)):
        children = qos_children(reading, element, MODEL.elements)
        for protocol, name, setting in options(reading, children, system.protocol):
            system.options.setdefault(protocol, {})[name] = setting
        system.accept += acceptances(reading, children)
        system.checks += team_rules(reading, children)
