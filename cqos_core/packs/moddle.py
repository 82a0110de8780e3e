"""The moddle descriptor of a drawing form with the settings of the installed packs; moddle reads and writes XML for bpmn-js."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.packs.presets import Dialect
from cqos_core.packs.property_panel import panel_settings

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.packs.drawing_notation import DrawnForm, DrawnOwner
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.property_panel import SettingSpelling


def drawing_settings(pack: RulePack, form: DrawnForm) -> Iterator[SettingSpelling]:
    """Yield all settings of a pack that a drawing of this form can state."""
    for owner in form.owners:
        yield from _settings(pack, form, owner)


def _settings(pack: RulePack, form: DrawnForm, owner: DrawnOwner) -> Iterator[SettingSpelling]:
    dialect = pack.dialects.get(form.dialect, Dialect())
    for level in owner.levels:
        yield from panel_settings(pack.panel, pack.policies, dialect, level, owner.attributes)


def moddle(form: DrawnForm, packs: Iterable[RulePack]) -> dict[str, Any]:
    """Return the descriptor with which moddle, the reader and writer of bpmn-js, knows the words of a form.

    All attributes are texts; packs define their meaning.
    """
    known = list(packs)
    extended: list[dict[str, Any]] = []
    elements: dict[str, dict[str, None]] = {}
    for owner in form.owners:
        settings = [each.name for pack in known for each in _settings(pack, form, owner)]
        attributes = dict.fromkeys((*owner.attributes, *settings))
        extended.append(
            {"name": f"{owner.kind.capitalize()}Words", "extends": list(owner.types), "properties": _texts(attributes)}
        )
        for word in owner.words:
            if word.element:
                of_settings = (*settings, "type", "value", "id") if word.meaning == "settings" else ()
                names = dict.fromkeys((*(each.name for each in word.attributes), *of_settings))
                elements.setdefault(word.name, {}).update(names)
    return {
        "name": "C-QoS",
        "prefix": form.prefix,
        "uri": form.namespace,
        "xml": {"tagAlias": "lowerCase"},
        "types": [
            *extended,
            *(
                {"name": name[:1].upper() + name[1:], "superClass": ["Element"], "properties": _texts(names)}
                for name, names in elements.items()
            ),
        ],
    }


def _texts(names: Iterable[str]) -> list[dict[str, Any]]:
    return [{"name": name, "type": "String", "isAttr": True} for name in names]
