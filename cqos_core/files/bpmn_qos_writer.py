"""Writes QoS into the BPMN document that states it, as attributes of the published form. The rest of the document stays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.bpmn.names import POLICY_NAMES
from cqos_core.bpmn.rewriting import Diagram
from cqos_core.files.export import ExportEndpoint, export_input
from cqos_core.language.policy import ENDPOINT
from cqos_core.model.encoding import decode
from cqos_core.model.settings import Cases
from cqos_core.packs.export import Exported
from cqos_core.resolving.dialect_spelling import dialect_text
from cqos_core.resolving.reader import spelled

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.bpmn.rewriting import Tag
    from cqos_core.language.policy import Policy
    from cqos_core.model.settings import Setting
    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Dialect

DIALECT: Final = "bpmn"
_A_NUMBER: Final = "9"  # a duration in its manner has no unit
_Values: TypeAlias = "dict[int, str | None]"
"""Text by policy index; None states nothing."""


def write(system: System, context: ExportContext) -> Exported:
    """Return the document with the QoS of its events as attributes in words, or only with what fixes changed."""
    found, notes = diagram_of(system, export_input(system, context).endpoints)
    if found is None:
        return Exported("", 0, tuple(notes))
    diagram, elements = found
    for element, endpoints in elements.items():
        tag = diagram.find(element)
        if tag is None:
            notes[f"the id `{element}` is not unique, so its QoS stays as it is"] = None
            continue
        pack, dialect = _pack(endpoints)
        values = _changed(endpoints, context, notes) if context.changed is not None else _stated(endpoints[0], notes)
        restate(diagram, tag, pack, dialect, values)
    return Exported(diagram.changed(), sum(map(len, elements.values())), tuple(notes))


def diagram_of(
    system: System, endpoints: Iterable[ExportEndpoint]
) -> tuple[tuple[Diagram, dict[str, list[ExportEndpoint]]] | None, dict[str, None]]:
    """Return the one BPMN document of a system with the endpoints of each element, and notes on endpoints that stand elsewhere."""
    notes: dict[str, None] = {}
    by_source: dict[str, dict[str, list[ExportEndpoint]]] = {}
    others = 0
    for each in endpoints:
        place = each.endpoint.place
        if each.endpoint.dialect != DIALECT or place is None or place.element is None or not each.parts:
            others += 1
        else:
            by_source.setdefault(place.source, {}).setdefault(place.element, []).append(each)
    if len(by_source) != 1:
        names = ", ".join(f"`{name}`" for name in list(by_source)[:3])
        notes[f"one BPMN document is needed, not {names or 'none'}"] = None
        return None, notes
    if others:
        notes[
            f"{others} endpoint{'s' if others > 1 else ''} that stand{'' if others > 1 else 's'} elsewhere left out"
        ] = None
    name, elements = by_source.popitem()
    return (Diagram(decode(system.sources[name])), elements), notes


def restate(diagram: Diagram, tag: Tag, pack: RulePack, dialect: Dialect | None, values: _Values) -> None:
    """Set the attributes of an element to ``values``, and remove other statements of the same policies in it."""
    attributes: dict[str, str | None] = {}
    missing = {index: text for index, text in values.items() if text is not None}
    for name, there in tag.attributes.items():
        local = diagram.local("qos", name)
        index = None if local is None else pack.find(ENDPOINT, local, dialect)
        if index in values and index is not None:
            text = missing.pop(index, None)
            attributes[name] = there.text if text and _same(pack.policies[index], there.text, text, dialect) else text
    if missing:
        prefix = diagram.prefix("qos")
        attributes |= {f"{prefix}:{_attribute(pack, dialect, index)}": text for index, text in missing.items()}
    diagram.state(tag, attributes)
    _remove_repetitions(diagram, tag, pack, dialect, values)


def _remove_repetitions(diagram: Diagram, tag: Tag, pack: RulePack, dialect: Dialect | None, values: _Values) -> None:
    """Remove ``qos:policy`` elements and properties that state one of the policies, and elements that become empty."""
    for extension in diagram.children(tag, "bpmn", "extensionElements"):
        gone: set[int] = set()
        for child in extension.children:
            properties = [each for each in child.children if _property_index(diagram, each, pack, dialect) in values]
            inside = {each.start for each in properties}
            if diagram.is_a(child, "qos", "policy"):
                _shorten(diagram, child, pack, dialect, values, gone)
            elif properties and diagram.is_blank(child, inside):
                gone.add(child.start)
            else:
                for each in properties:
                    diagram.remove(each)
        if gone and diagram.is_blank(extension, gone):
            diagram.remove(extension)
        else:
            for child in extension.children:
                if child.start in gone:
                    diagram.remove(child)


def _shorten(
    diagram: Diagram, child: Tag, pack: RulePack, dialect: Dialect | None, values: _Values, gone: set[int]
) -> None:
    stated = {
        name: pack.find(ENDPOINT, diagram.local("qos", name) or name, dialect)
        for name in child.attributes
        if name not in {"type", "value", "id"} and not name.startswith("xmlns")
    }
    if all(index in values for index in stated.values()):
        gone.add(child.start)
    else:
        diagram.state(child, {name: None for name, index in stated.items() if index in values})


def _property_index(diagram: Diagram, tag: Tag, pack: RulePack, dialect: Dialect | None) -> int | None:
    """Return the policy that a property of an engine states; None where it states none."""
    if (
        not any(diagram.is_a(tag, engine, "property") for engine in ("camunda", "zeebe"))
        or "name" not in tag.attributes
    ):
        return None
    return pack.find(ENDPOINT, tag.attributes["name"].text.strip(), dialect)


def _pack(endpoints: list[ExportEndpoint]) -> tuple[RulePack, Dialect | None]:
    pack = endpoints[0].parts[0].pack
    return pack, pack.dialects.get(DIALECT, pack.dialects.get("yaml"))


def _stated(each: ExportEndpoint, notes: dict[str, None]) -> _Values:
    """Return the known values that an element states, by policy."""
    pack, dialect = _pack([each])
    found: _Values = {}
    open_cases = {s.unknown.assumption for s in each.endpoint.settings.values() if isinstance(s.unknown, Cases)}
    if open_cases:
        # Some of its values depend on an assumption about the file.
        notes[f"`{each.id}` stays as it is: it is open {' and '.join(sorted(open_cases))}"] = None
        return {}
    for name, setting in each.endpoint.settings.items():
        index = pack.find(ENDPOINT, name, dialect)
        if index is None:
            continue
        text = None if setting.unknown else _text(pack.policies[index], setting, dialect, dialect)
        if setting.unknown or text == "":
            notes[f"`{each.id}`: {name} stays as it is, because its value is not known"] = None
        else:
            found[index] = text
    return found


def _changed(endpoints: list[ExportEndpoint], context: ExportContext, notes: dict[str, None]) -> _Values:
    """Return the values that fixes changed; endpoints of one element have one value each."""
    pack, dialect = _pack(endpoints)
    found: _Values = {}
    for each in endpoints:
        for name, setting in each.endpoint.overlay.items():
            index = pack.find(ENDPOINT, name)
            if index is None or not context.wants(each.id, pack.policies[index].name):
                continue
            text = _text(pack.policies[index], setting, None, dialect)
            if found.setdefault(index, text) != text:
                notes[f"`{each.id}`: {name} is `{found[index]}`, as for another endpoint of this element"] = None
    return found


def _text(policy: Policy, setting: Setting, read_as: Dialect | None, dialect: Dialect | None) -> str | None:
    """Return a value in the words of a dialect; None for a value that states nothing, an empty text for an invalid one."""
    plain = spelled(policy, setting.text, read_as)
    if plain is None:
        return None
    if policy.domain.word(plain) in policy.words:
        return policy.domain.word(plain)
    value = policy.domain.read(plain)
    return "" if value is None else dialect_text(policy, value, dialect, _A_NUMBER) or ""


def _same(policy: Policy, old: str, new: str, dialect: Dialect | None) -> bool:
    """Whether an attribute states a value in words already."""
    if dialect is not None and old.strip() in dialect.codes.get(policy.name, {}):
        return False
    plain = spelled(policy, old, dialect)
    if plain is None:
        return False
    before, after = (policy.domain.read(text) for text in (plain, spelled(policy, new, dialect) or ""))
    if before is None or after is None:
        return policy.domain.word(plain) == policy.domain.word(new)
    return before == after


def _attribute(pack: RulePack, dialect: Dialect | None, index: int) -> str:
    """Return the attribute of a policy: its name in the published form, else its own name."""
    published = (name for name in POLICY_NAMES if pack.find(ENDPOINT, name, dialect) == index)
    return next(published, pack.policies[index].name)
