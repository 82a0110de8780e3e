"""Finds the endpoint or setting at a place of a file in any format, by the places that importers keep."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from cqos_core.language.policy import BROKER, ENDPOINT, NEED, TOPIC
from cqos_core.model.dataclass import dataclass
from cqos_core.model.excerpt import exact, is_xml, key_of
from cqos_lsp.positions import lines_of, located

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.model.settings import Place, Setting, Settings
    from cqos_core.model.system import Endpoint, Participant, Profile
    from cqos_core.packs.pack import RulePack
    from cqos_lsp.document_checks import Analysis

Owner: TypeAlias = "Endpoint | Participant | Profile | None"
What: TypeAlias = Literal["endpoint", "participant", "profile", "setting"]


@dataclass(frozen=True, slots=True, eq=False)
class PlacedItem:
    """An endpoint, participant, profile or setting with its place.

    Attributes:
        owner: the endpoint, participant or profile itself, or the one that a setting belongs to.
        name: of a setting, as written.
        policies: the policies of that name, one of each pack that has it.
    """

    what: What
    place: Place
    owner: Owner = None
    name: str = ""
    setting: Setting | None = None
    policies: tuple[tuple[RulePack, Policy], ...] = ()


def packs_of(analysis: Analysis) -> Sequence[RulePack]:
    """Return the packs of the protocols that a system has."""
    found = {endpoint.pack.id: endpoint.pack for endpoint in analysis.endpoints}
    return [*found.values()] or analysis.project.all_packs


def items_on_line(analysis: Analysis, source: str, line: int) -> list[PlacedItem]:
    """Return the items on a one-based line of a source."""
    marks = [*items_in_source(analysis, source)]
    places = exact((mark.place for mark in marks), analysis.sources)
    return [replace(mark, place=places[mark.place]) for mark in marks if places[mark.place].line == line]


def items_in_source(analysis: Analysis, source: str) -> Iterator[PlacedItem]:
    """Yield all items of a source, endpoints before their settings."""
    system, packs = analysis.system, packs_of(analysis)
    for end in system.endpoints:
        if end.place is not None and end.place.source == source:
            yield PlacedItem("endpoint", end.place, end)
        yield from _settings(end.settings, source, packs, (ENDPOINT,), end, end.dialect)
        yield from _settings(end.overlay, source, packs, (ENDPOINT,), end, end.dialect)
        yield from _settings(end.needs, source, packs, (NEED,), end)
    for one in system.participants.values():
        if one.place is not None and one.place.source == source:
            yield PlacedItem("participant", one.place, one)
        yield from _settings(one.settings, source, packs, ("participant", "option"), one)
    for profile in system.profiles.values():
        if profile.place is not None and profile.place.source == source:
            yield PlacedItem("profile", profile.place, profile)
        yield from _settings(profile.settings, source, packs, (ENDPOINT, BROKER), profile)
    for topic in system.topics.values():
        yield from _settings(topic.settings, source, packs, (TOPIC,))
    for broker in system.brokers.values():
        yield from _settings(broker.settings, source, packs, (BROKER,))
    for overlay in system.overlays:
        yield from _settings(overlay.settings, source, packs, (ENDPOINT,), None, overlay.dialect)
    for pack_id, options in system.options.items():
        own = [pack for pack in packs if pack.id == pack_id]
        yield from _settings(options, source, own, ("option",))


def _settings(
    settings: Settings,
    source: str,
    packs: Iterable[RulePack],
    levels: tuple[str, ...],
    owner: Owner = None,
    dialect: str = "yaml",
) -> Iterator[PlacedItem]:
    for name, setting in settings.items():
        if setting.place is None or setting.place.source != source or (setting.derived and _at_owner(setting, owner)):
            continue
        found = [
            (pack, pack.policies[index])
            for pack in packs
            for level in levels
            if (index := pack.find(level, name, pack.dialects.get(dialect, pack.dialects.get("yaml")))) is not None
        ]
        if found:
            yield PlacedItem("setting", setting.place, owner, name, setting, tuple(found))


def _at_owner(setting: Setting, owner: Owner) -> bool:
    """Whether a derived setting has only the place of its owner."""
    return owner is None or setting.place == owner.place


def setting_at(analysis: Analysis, marks: Iterable[PlacedItem], line: int, column: int) -> PlacedItem | None:
    """Return the setting whose key or value is at a one-based line and column."""
    sources = analysis.sources
    for mark in marks:
        found = located(mark.place, sources) if mark.what == "setting" else None
        if found is None or found[1] != line:
            continue
        _, _, start, width = found
        key = exact([key], sources)[key] if (key := key_of(mark.place, mark.name)) is not None else None
        if key is not None and key.line == line and key.column is not None:
            start, width = min(start, key.column), start + width - min(start, key.column)
        if start <= column <= start + width:
            return mark
    return None


def owners_at(analysis: Analysis, marks: Iterable[PlacedItem], line: int, column: int) -> list[PlacedItem]:
    """Return the endpoints, participants and profiles whose place is at or nearest before a column of a line."""
    starts = [
        (found[2], mark)
        for mark in marks
        if mark.what != "setting" and (found := located(mark.place, analysis.sources)) is not None and found[1] == line
    ]
    before = [start for start, _ in starts if start <= column]
    nearest = max(before, default=min((start for start, _ in starts), default=0))
    return [mark for start, mark in starts if start == nearest]


_VALUE: Final = re.compile(r"""["']?\s*:\s*(?=[^\s#])""")


def end_of_line(analysis: Analysis, place: Place) -> tuple[int, int] | None:
    """Return line and column behind a place: behind the value of a key on its line, else at the end of the line."""
    found = located(place, analysis.sources)
    if found is None:
        return None
    source, line, column, width = found
    text = lines_of(analysis.sources[source]).line(line)
    value = _VALUE.match(text, column + width - 1)
    if value is None or is_xml(analysis.sources[source]):
        return line, len(text.rstrip()) + 1
    behind = located(replace(place, line=line, column=value.end() + 1, path=None, element=None), analysis.sources)
    return line, len(text) + 1 if behind is None else behind[2] + behind[3]
