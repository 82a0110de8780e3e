"""Definitions, references and renaming of profiles, topics and participants; the outline of a document."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from lsprotocol.types import DocumentSymbol, Location, Position, Range, SymbolKind, TextEdit, WorkspaceEdit

from cqos_core.checking.checker import check_system
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.files.source_reader import read_texts
from cqos_core.files.system_merge import merge
from cqos_core.files.yaml_edits import is_json, scalar
from cqos_core.model.problems import CqosError, InputError
from cqos_core.model.system import endpoint_id
from cqos_lsp.diagnostics import uri_of
from cqos_lsp.names import Name, name_at, names_of
from cqos_lsp.positions import encoded, lines_of, located

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place
    from cqos_core.model.system import Bridge, Broker, Profile, Topic
    from cqos_lsp.document_checks import Analysis
    from cqos_lsp.positions import Units


def definition(analysis: Analysis, source: str, line: int, column: int, units: Units) -> list[Location]:
    """Return the definition of the name at a one-based line and column.

    A topic without an entry of its own is defined by its publishers.
    """
    names = names_of(analysis.sources)
    name = name_at(names, analysis.sources, source, line, column)
    if name is None:
        return []
    alike = [each for each in names if each.kind == name.kind and each.text == name.text]
    defining = [each.place for each in alike if each.defines]
    if not defining and name.kind == "profile" and name.text in analysis.system.profiles:
        place = analysis.system.profiles[name.text].place  # in a file of another format
        defining = [] if place is None else [place]
    if not defining and name.kind in {"topic", "service", "action"}:
        defining = [each.place for each in alike if _publishes(each)] or _partners(name, analysis)
    return _locations(defining, analysis, units)


def _publishes(name: Name) -> bool:
    return any(part in {"publishes", "serves", "action_servers"} for part in name.path)


def _partners(name: Name, analysis: Analysis) -> list[Place]:
    """Return the places of publishers that match endpoints on a topic, in files of any format."""
    mine = {end.id for end in analysis.endpoints if end.endpoint.topic == name.text}
    others = {pub for group in analysis.report.groups if mine & {*group.subscribers} for pub in group.publishers}
    return [end.endpoint.place for end in analysis.endpoints if end.id in others and end.endpoint.place is not None]


def references(analysis: Analysis, source: str, line: int, column: int, units: Units) -> list[Location]:
    """Return all occurrences of the name at a place, and endpoints on the topic in files of other formats."""
    names = names_of(analysis.sources)
    name = name_at(names, analysis.sources, source, line, column)
    if name is None:
        return []
    places = [each.place for each in names if each.kind == name.kind and each.text == name.text]
    named = {each.place.source for each in names}
    if name.kind == "topic":
        others = (end.endpoint for end in analysis.endpoints if end.endpoint.topic == name.text)
        places += [end.place for end in others if end.place is not None and end.place.source not in named]
    return _locations(places, analysis, units)


def _locations(places: Iterable[Place], analysis: Analysis, units: Units) -> list[Location]:
    return [
        Location(uri_of(place.source), units.of(place, analysis.sources))
        for place in dict.fromkeys(places)
        if place.source in analysis.sources
    ]


def renamable(analysis: Analysis, source: str, line: int, column: int, units: Units) -> Range | None:
    """Return the range of the name at a place; None if it cannot be renamed."""
    name = name_at(names_of(analysis.sources), analysis.sources, source, line, column)
    if name is None or name.kind not in {"profile", "topic", "service", "action", "participant", "broker"}:
        return None
    known = analysis.system.profiles
    return None if name.kind == "profile" and name.text not in known else units.of(name.place, analysis.sources)


def rename(
    analysis: Analysis, source: str, line: int, column: int, new: str, units: Units, uris: Mapping[str, str]
) -> WorkspaceEdit:
    """Return the changes that rename the name at a place in all files of the system.

    Raises:
        CqosError: pairs or findings would change, or the files could not be read.
    """
    names = names_of(analysis.sources)
    name = name_at(names, analysis.sources, source, line, column)
    if name is None or renamable(analysis, source, line, column, units) is None:
        raise CqosError("there is no name here that can be changed")
    changes: dict[str, list[tuple[Place, int, str]]] = {}
    for each in names:
        text = _renamed(each, name, new, analysis)
        found = located(each.place, analysis.sources)
        if text is not None and found is not None:
            written = lines_of(analysis.sources[found[0]]).line(found[1])[found[2] - 1 :][: found[3]]
            in_json = is_json(lines_of(analysis.sources[found[0]]).text)
            changes.setdefault(found[0], []).append((each.place, found[3], scalar(text, like=written, in_json=in_json)))
    _refuse_others(analysis, {file: _with(analysis.sources[file], own) for file, own in changes.items()}, name, new)
    return WorkspaceEdit(
        changes={
            uri_of(file, uris): [TextEdit(units.of(place, analysis.sources), text) for place, _, text in own]
            for file, own in changes.items()
        }
    )


def _renamed(each: Name, name: Name, new: str, analysis: Analysis) -> str | None:
    """Return the new text of an occurrence; None if it does not change."""
    if each.kind == name.kind and each.text == name.text:
        return new
    if each.kind != "participant" or name.kind not in {"topic", "participant"}:
        return None
    # The id of an endpoint that states none has the names of its participant and its topic in it.
    for end in analysis.system.endpoints:
        if (
            end.id == each.text
            and end.topic is not None
            and each.text == endpoint_id(end.participant, end.role, end.topic)
        ):
            participant = new if name.kind == "participant" and end.participant == name.text else end.participant
            topic = new if name.kind == "topic" and end.topic == name.text else end.topic
            changed = endpoint_id(participant, end.role, topic)
            return changed if changed != each.text else None
    return None


def _with(data: bytes, changes: Iterable[tuple[Place, int, str]]) -> bytes:
    lines = lines_of(data)
    text = lines.text
    for place, width, new in sorted(changes, key=lambda each: (each[0].line or 0, each[0].column or 0), reverse=True):
        start = (lines.start(place.line or 1) or 0) + (place.column or 1) - 1
        text = text[:start] + new + text[start + width :]
    return encoded(text)


def _refuse_others(analysis: Analysis, texts: Mapping[str, bytes], name: Name, new: str) -> None:
    """Check the new texts, and refuse them if pairs or findings change."""
    project = analysis.project
    sources = {**analysis.sources, **texts}
    try:
        systems = read_texts(analysis.files, sources, protocol=project.config.protocol)
    except InputError as error:
        raise CqosError(f"with the name `{new}` the files cannot be read: {error.problems[0].message}") from None
    merged = merge(systems)
    system = with_profiles_tried(project.config.apply_to(merged), project.config.protocol)
    before, after = _shape(analysis.report), _shape(check_system(system, project.where))
    if before != after:
        what = f"`{name.text}` cannot become `{new}`"
        raise CqosError(
            f"{what}: pairs or findings would change, because another thing has or needs one of these names"
        )


def _shape(report: Report) -> tuple[object, ...]:
    """Return the counts of a report that renaming must not change."""
    pairs = Counter[tuple[str, int]]()
    for group in report.groups:
        pairs[str(group.verdict), len(group.codes)] += group.pairs
    return pairs, Counter((finding.code, str(finding.severity)) for finding in report.findings), report.endpoints


def symbols(analysis: Analysis, source: str, units: Units) -> list[DocumentSymbol]:
    """Return the outline of a document: participants with their endpoints, profiles, topics, brokers, bridges."""
    system, found = analysis.system, []
    names = names_of({source: analysis.sources[source]})
    named: dict[tuple[str, str], Place] = {(each.kind, each.text): each.place for each in names if each.defines}
    for one in system.participants.values():
        ends = [
            _symbol(f"{end.topic or end.id}", end.role, SymbolKind.Event, end.place, source, analysis, units)
            for end in system.endpoints
            if end.participant == one.id
        ]
        place = named.get(("participant", one.id), one.place)
        whole = _symbol(one.id, "participant", SymbolKind.Module, place, source, analysis, units)
        inside = [each for each in ends if each is not None]
        if whole is not None:
            whole.children = inside
            last = max([whole.range.end, *(each.range.end for each in inside)])
            whole.range = Range(whole.range.start, last)
            found.append(whole)
        else:
            found += inside
    others: dict[str, Mapping[str, Profile | Topic | Broker | Bridge]] = {
        "profile": system.profiles,
        "topic": system.topics,
        "broker": system.brokers,
        "bridge": system.bridges,
    }
    for kind, things in others.items():
        for name, thing in things.items():
            place = named.get((kind, name), thing.place)
            symbol = _symbol(name, kind, SymbolKind.Struct, place, source, analysis, units)
            found += [] if symbol is None else [symbol]
    return sorted(found, key=lambda each: each.range.start)


def _symbol(
    name: str, detail: str, kind: SymbolKind, place: Place | None, source: str, analysis: Analysis, units: Units
) -> DocumentSymbol | None:
    if place is None or place.source != source or place.line is None:
        return None
    shown = units.of(place, analysis.sources)
    return DocumentSymbol(
        name or "(no name)",
        kind,
        shown,
        Range(Position(shown.start.line, shown.start.character), shown.end),
        detail=detail,
    )
