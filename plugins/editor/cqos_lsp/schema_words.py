"""The words that a document may have at a path, from the JSON schema of its form.

`cqos schema` prints the schema, which is made of the forms of readers and of the installed packs. So an editor with the schema alone
completes the same words.
"""

from __future__ import annotations

import json
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from cqos_core.config import CONFIG
from cqos_core.files.schema import system_schema
from cqos_core.model.dataclass import dataclass
from cqos_core.packs.pack_yaml import PackModel

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.packs.pack import RulePack
    from cqos_lsp.cursor import Path

Schema = dict[str, Any]
_DEEPEST: Final = 32


@dataclass(frozen=True, slots=True)
class Word:
    """A key or value with its description."""

    text: str
    doc: str = ""
    value: bool = False


@lru_cache(maxsize=32)
def schema_of_systems(packs: tuple[RulePack, ...]) -> Schema:
    """Return the schema of system files with what some packs suggest."""
    return system_schema(packs)


@lru_cache(maxsize=8)
def schema_of_configurations(packs: tuple[RulePack, ...]) -> Schema:
    """Return the schema of `cqos.toml` with what some packs suggest."""
    shared: Schema = {}
    return {**CONFIG.definition(shared), "$defs": {**system_schema(packs)["$defs"], **shared}}


@lru_cache(maxsize=1)
def schema_of_packs() -> Schema:
    """Return the schema of rule pack files."""
    return PackModel.model_json_schema()


def _parts(schema: Schema, node: Any, depth: int = 0) -> Iterator[Schema]:
    """Yield a schema with all schemas that it refers to or combines."""
    if not isinstance(node, dict) or depth > _DEEPEST:
        return
    yield node
    if "$ref" in node:
        yield from _parts(schema, schema["$defs"].get(node["$ref"].rpartition("/")[2]), depth + 1)
    for name in ("allOf", "anyOf", "oneOf"):
        for each in node.get(name, ()):
            yield from _parts(schema, each, depth + 1)


def _below(schema: Schema, node: Any, part: str | int) -> Iterator[Any]:
    for each in _parts(schema, node):
        if isinstance(part, int):
            yield each.get("items")
        elif part in each.get("properties", {}):
            yield each["properties"][part]
        else:
            yield each.get("additionalProperties")


def at(schema: Schema, path: Path) -> list[Any]:
    """Return the schemas of the value at a path."""
    found: list[Any] = [schema]
    for part in path:
        found = [below for node in found for below in _below(schema, node, part) if isinstance(below, dict)]
    return found


def _joined(found: Iterable[Word]) -> list[Word]:
    """Return each word once, with all its descriptions."""
    docs: dict[tuple[str, bool], dict[str, None]] = {}
    for each in found:
        docs.setdefault((each.text, each.value), {}).update({each.doc: None} if each.doc else {})
    return [Word(text, "\n\n".join(said), value) for (text, value), said in docs.items()]


def keys_at(schema: Schema, path: Path) -> list[Word]:
    """Return the keys that the map at a path may have."""
    return _joined(
        Word(name, str(about.get("description", "")))
        for node in at(schema, path)
        for part in _parts(schema, node)
        for name, about in part.get("properties", {}).items()
        if isinstance(about, dict)
    )


def values_at(schema: Schema, path: Path) -> list[Word]:
    """Return the words that are possible values at a path."""
    return _joined(word for node in at(schema, path) for part in _parts(schema, node) for word in _values(part))


def _values(part: Schema) -> Iterator[Word]:
    doc = str(part.get("description", ""))
    if "const" in part:
        yield Word(_text(part["const"]), doc, value=True)
    for value in part.get("enum", ()):
        yield Word(_text(value), "", value=True)
    if part.get("type") in ("boolean", ["boolean", "null"]):
        yield from (Word(text, "", value=True) for text in ("true", "false"))


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def doc_at(schema: Schema, path: Path) -> str:
    """Return the description of the key at the end of a path."""
    if not path:
        return ""
    name = path[-1]
    return next((word.doc for word in keys_at(schema, path[:-1]) if word.text == name), "")
