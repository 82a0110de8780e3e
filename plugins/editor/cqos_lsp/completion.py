"""Completion of words of the schema, and of names of the system."""

from __future__ import annotations

import re
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Final

from lsprotocol.types import (
    CompletionItem,
    CompletionItemKind,
    CompletionList,
    MarkupContent,
    MarkupKind,
    Position,
    Range,
    TextEdit,
)

from cqos_core.config import SHARED_NAME
from cqos_core.importers.tree import ScalarNode, quoted_where_needed
from cqos_core.language.policy import ENDPOINT
from cqos_core.model.system import MESSAGE
from cqos_lsp.cursor import toml_cursor, yaml_cursor
from cqos_lsp.names import kind_of_key, kind_of_value, names_of
from cqos_lsp.projects import is_configuration, is_pack
from cqos_lsp.schema_words import (
    Word,
    keys_at,
    schema_of_configurations,
    schema_of_packs,
    schema_of_systems,
    values_at,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.packs.pack import RulePack
    from cqos_lsp.cursor import Cursor
    from cqos_lsp.document_checks import Analysis
    from cqos_lsp.names import Kind
    from cqos_lsp.positions import Units
    from cqos_lsp.projects import Project
    from cqos_lsp.schema_words import Schema

_TABLE: Final = ("tool", "cqos")
_PROTOCOL: Final = re.compile(r"""^["']?protocol["']?\s*[:=]\s*["']?([\w-]+)""", re.MULTILINE)
_ROLES: Final = {
    "publishes": "publisher",
    "subscribes": "subscriber",
    "publishers": "publisher",
    "subscribers": "subscriber",
}
_KINDS: Final[Mapping[Kind, CompletionItemKind]] = {
    "profile": CompletionItemKind.Struct,
    "topic": CompletionItemKind.Event,
    "service": CompletionItemKind.Event,
    "action": CompletionItemKind.Event,
    "participant": CompletionItemKind.Module,
    "broker": CompletionItemKind.Module,
    "rule": CompletionItemKind.Constant,
}


def cursor_in(path: str, text: str, line: int, column: int) -> Cursor | None:
    """Return the cursor at a zero-based line and column; None if nothing can be completed there."""
    if is_configuration(path):
        return toml_cursor(text, line, column, _TABLE if FilePath(path).name == SHARED_NAME else ())
    return yaml_cursor(text, line, column)


def load_schemas(projects: Iterable[Project]) -> None:
    """Load the packs and schemas ahead of the first completion."""
    for project in projects:
        schema_of_systems(project.all_packs)
        for pack in project.all_packs:
            schema_of_systems((pack,))


def schema_at(path: str, text: str, at: Cursor, project: Project) -> Schema | None:
    """Return the schema at a cursor, with the packs of its protocol; None if the document has no schema."""
    if is_configuration(path):
        return schema_of_configurations(project.all_packs)
    if is_pack(text.encode("utf-8", "replace")):
        return schema_of_packs()
    if not re.search(r"""^\s*\{?\s*["']?cqos["']?\s*:""", text, re.MULTILINE):
        return None
    return schema_of_systems(packs_at(text, at, project))


def packs_at(text: str, at: Cursor, project: Project) -> tuple[RulePack, ...]:
    """Return the packs of the protocol at a cursor; all packs if none is stated."""
    stated = [at.scalars.get((*at.path[:length], "protocol")) for length in range(len(at.path), 0, -1)]
    found = _PROTOCOL.search(text)
    stated += [found[1] if found else None, project.config.protocol]
    protocol = next((each for each in stated if each is not None), None)
    mine = tuple(pack for pack in project.all_packs if pack.id == protocol)
    # The protocol itself is chosen among all, and options are by pack.
    everything = not mine or not at.path or at.path[0] == "options" or at.path[-1] == "protocol"
    return project.all_packs if everything else mine


def complete(
    path: str, text: str, position: Position, units: Units, project: Project, analysis: Analysis | None
) -> CompletionList | None:
    """Return the completions at a position."""
    lines = text.split("\n")
    line = lines[position.line] if position.line < len(lines) else ""
    at = cursor_in(path, text, position.line, units.characters(line, position.character))
    schema = None if at is None else schema_at(path, text, at, project)
    if at is None or schema is None:
        return None
    start, end = (units.count(line[:column]) for column in (at.start, at.end))
    extent = Range(Position(position.line, start), Position(position.line, end))
    found: dict[str, CompletionItem] = {}
    packs = packs_at(text, at, project)
    for word, kind in _words(schema, at, packs, analysis):
        if word.text not in found and not (word.text in at.keys and not word.value):
            found[word.text] = _item(word, kind, at, extent, toml=is_configuration(path))
    return CompletionList(is_incomplete=False, items=[*found.values()])


def _words(
    schema: Schema, at: Cursor, packs: Sequence[RulePack], analysis: Analysis | None
) -> Iterator[tuple[Word, CompletionItemKind]]:
    """Yield the names of the system, then the words of the schema."""
    if at.at_value:
        if kind := kind_of_value(at.path):
            ids = analysis is not None and at.path[-1] == "endpoint"
            names = [end.id for end in analysis.system.endpoints] if analysis and ids else _names(kind, analysis, packs)
            for name in names:
                yield Word(name, f"{kind} of this system", value=True), _KINDS[kind]
        for word in values_at(schema, at.path):
            yield word, CompletionItemKind.EnumMember
    if at.at_key:
        if kind := kind_of_key(at.path):
            for name in _names(kind, analysis, packs):
                yield Word(name, f"{kind} of this system"), _KINDS[kind]
        for word in keys_at(schema, at.path):
            if _counts(word, at, packs):
                yield word, CompletionItemKind.Property


def _counts(word: Word, at: Cursor, packs: Sequence[RulePack]) -> bool:
    """Whether a policy may have an effect for the role at the cursor."""
    role = next((_ROLES[part] for part in reversed(at.path) if part in _ROLES), None)
    if role is None or at.path[-1] == "needs":
        return True
    indices = [(pack, pack.find(ENDPOINT, word.text)) for pack in packs]
    roles = {each for pack, index in indices if index is not None for each in pack.policies[index].roles}
    return not roles or role in roles


def _names(kind: Kind, analysis: Analysis | None, packs: Sequence[RulePack]) -> list[str]:
    if kind == "rule":
        return sorted({rule.code for pack in packs for rule in pack.rules})
    if analysis is None:
        return []
    system = analysis.system
    stated: dict[Kind, Mapping[str, object]] = {
        "profile": system.profiles,
        "participant": system.participants,
        "broker": system.brokers,
    }
    if kind in stated:
        return sorted(stated[kind])
    named = {name.text for name in names_of(analysis.sources) if name.kind == kind}
    topics = {end.topic for end in system.endpoints if end.topic is not None and end.kind == MESSAGE}
    return sorted(named | topics if kind == "topic" else named)


def _item(word: Word, kind: CompletionItemKind, at: Cursor, extent: Range, *, toml: bool) -> CompletionItem:
    text = word.text
    if toml and word.value:
        text = text if text in {"true", "false"} or text.isdigit() else f'"{text}"'
    elif at.quoted:
        text = f'"{text}"'
    else:
        text = quoted_where_needed(ScalarNode(text, None, None, plain=True))
    if not word.value and not at.followed:
        text += " = " if toml else ": "
    documentation = MarkupContent(MarkupKind.Markdown, word.doc) if word.doc else None
    return CompletionItem(
        label=word.text,
        kind=kind,
        documentation=documentation,
        filter_text=text if at.quoted else word.text,
        text_edit=TextEdit(extent, text),
    )
