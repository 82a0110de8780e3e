"""The JSON schema of system files, made from the forms that the reader uses and from rule packs.

Structure comes from the forms: what the schema refuses there, the reader refuses too. The schema only suggests what packs
know (settings, values, presets, options, needs): every list of suggestions ends in ``true``, which accepts anything. A pack reads
more spellings than a list should have, and a file may be for a pack that is not installed here.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from cqos_core.importers.tree import ScalarNode, flag, whole_number
from cqos_core.importers.yaml_form import DOCUMENT, VERSION
from cqos_core.language.domains import Names
from cqos_core.language.policy import LEVELS, NEED
from cqos_core.model.grouping import grouped
from cqos_core.resolving.unknown_names import can_be_stated

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack


def system_schema(packs: Sequence[RulePack] = ()) -> dict[str, Any]:
    """Return the schema (draft 2020-12) of a C-QoS system file, as ``cqos schema`` prints it.

    It describes one document without `instances` put in and without merging `include`. What ``packs`` know it suggests
    without ever refusing another setting or value.
    """
    shared: dict[str, Any] = {}
    document = DOCUMENT.definition(shared)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"C-QoS system file, version {VERSION}",
        "description": "Participants, what they publish and subscribe to, and with which quality of service.",
        **document,
        "$defs": {**shared, **_suggestions(packs)},
    }


def _suggestions(packs: Sequence[RulePack]) -> dict[str, Any]:
    """Return the definitions that `cqos_core.importers.document_form.Form.hints` and `Key.hints` refer to."""
    by_level = {f"{level}_settings": _settings([(pack, level) for pack in packs]) for level in LEVELS}
    return {
        **by_level,
        "pack_options": {
            "properties": {
                pack.id: {"description": f"Options of {pack.title}.", **_settings([(pack, "option")])} for pack in packs
            }
        },
        "packs": _any_of({"const": pack.id, "description": pack.summary or pack.title} for pack in packs),
        "endpoint_presets": _presets(packs, "endpoint"),
        "broker_presets": _presets(packs, "broker"),
    }


def _any_of(suggested: Iterable[Any]) -> dict[str, Any]:
    return {"anyOf": [*suggested, True]}


def _presets(packs: Sequence[RulePack], level: str) -> dict[str, Any]:
    """Return the schema of one preset, or of a list of presets."""
    found = grouped(
        (name, f"{pack.title}: {preset.doc or 'a preset.'}")
        for pack in packs
        for name, preset in pack.presets.items()
        if preset.level == level
    )
    named = ({"const": name, "description": "\n".join(docs)} for name, docs in found.items())
    return {**_any_of(named), "items": {"$ref": f"#/$defs/{level}_presets"}}


def _settings(sources: Iterable[tuple[RulePack, str]]) -> dict[str, Any]:
    """Return the schema of settings: each with the description of every pack, and suggested values."""
    said: dict[str, dict[str, list[str]]] = {}
    values: dict[str, dict[object, Any]] = {}
    for pack, level in sources:
        for policy in pack.policies:
            if policy.level == level and can_be_stated(policy) and not policy.derived:
                name = written_name(policy)
                said.setdefault(name, {}).setdefault(_described(policy), []).append(pack.title)
                values.setdefault(name, {}).update((repr(value), value) for value in suggested_values(policy))
    return {
        "properties": {
            name: {
                "description": "\n".join(f"{', '.join(titles)}: {text}" for text, titles in texts.items()),
                **(_any_of([{"enum": [*values[name].values()]}]) if values[name] else {}),
            }
            for name, texts in sorted(said.items())
        }
    }


def written_name(policy: Policy) -> str:
    """Return the name under which a system file states a policy: a need has its word."""
    return policy.aliases[0] if policy.level == NEED and policy.aliases else policy.name


def _described(policy: Policy) -> str:
    default = policy.default if isinstance(policy.default, str) or policy.default is None else _per_role(policy)
    ends = "" if len(policy.roles) != 1 else f" For {policy.roles[0]}s."
    doc = f"{policy.doc.rstrip('.')}. " if policy.doc else ""
    return f"{doc}Takes {policy.expected()}.{f' Default: {default}.' if default else ''}{ends}"


def _per_role(policy: Policy) -> str:
    return ", ".join(f"{text} for {role}s" for role in policy.roles if (text := policy.default_for(role)) is not None)


def suggested_values(policy: Policy) -> list[Any]:
    """Return the values worth suggesting, as JSON has them: all where they are few, else words and defaults."""
    texts = [
        *(text for value in policy.domain.candidates() if (text := policy.spelling(value)) is not None),
        *policy.words,
        *(text for role in policy.roles if (text := policy.default_for(role))),
    ]
    return [_as_json(text, policy) for text in dict.fromkeys(texts)]


def _as_json(text: str, policy: Policy) -> Any:
    """Return the value of JSON that the reader takes for this text."""
    if isinstance(policy.domain, Names) and text not in policy.words:
        return list(policy.domain.parse(text))
    whole = ScalarNode(text, None, None, plain=True)
    value = flag(whole) if flag(whole) is not None else whole_number(whole)
    return value if value is not None and json.dumps(value) == text else text
