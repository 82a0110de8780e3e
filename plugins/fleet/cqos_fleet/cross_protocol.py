"""Finds topics on which endpoints of one protocol match those of the protocol that carries it."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import narwhals as nw

from cqos_core.resolving.wire_copies import certain_texts
from cqos_fleet.profiles import NO_SETTINGS, FleetProfiles, pack_knows

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.settings import Setting
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.wire import Wire
    from cqos_fleet.table_store import TableStore

    Frame = nw.LazyFrame[Any]

_Written = dict[tuple[str, "str | None"], set[str]]
"""By system and the name that endpoints match on, the names as written."""
_BATCH: Final = 20_000
_KINDS: Final = {"protocol": "text", "system": "text", "topic": "text"}


def crossing_topics(
    source: Frame,
    packs: Mapping[str, RulePack],
    options: Mapping[str, Mapping[str, Setting]],
    where: CheckContext,
    store: TableStore,
) -> Frame | None:
    """Return protocol, system and name of the topics on which endpoints of two protocols of a table match; None where no topic is.

    Each distinct row of the carried protocol is resolved, so this takes longer than columns.
    """
    rows: list[tuple[str, str, str]] = []
    for name, pack in packs.items():
        wire = pack.wire
        if wire is None or wire.protocol not in packs:
            continue
        below: _Written = {}
        for system, topic, key, _ in _named(source, packs[wire.protocol], options, where, store, None):
            below.setdefault((system, key), set()).add(topic)
        own: _Written = {}
        crossing: dict[tuple[str, str | None], set[str | None]] = {}
        for system, topic, key, on_wire in _named(source, pack, options, where, store, wire):
            own.setdefault((system, key), set()).add(topic)
            if on_wire is not None and (system, on_wire) in below:
                crossing.setdefault((system, key), set()).add(on_wire)
        for (system, key), names in crossing.items():
            rows += [(name, system, topic) for topic in own[system, key]]
            rows += [(wire.protocol, system, topic) for on_wire in names for topic in below[system, on_wire]]
    if not rows:
        return None
    found = ({"protocol": p, "system": s, "topic": t} for p, s, t in dict.fromkeys(rows))
    return store.fill("crossing", _KINDS, found)


def _named(
    source: Frame,
    pack: RulePack,
    options: Mapping[str, Mapping[str, Setting]],
    where: CheckContext,
    store: TableStore,
    wire: Wire | None,
) -> Iterator[tuple[str, str, str | None, str | None]]:
    """Yield system, written name, the name that endpoints match on, and that on the wire, of distinct rows of a protocol."""
    keys = [name for name in source.collect_schema().names() if name not in {"id", "protocol"}]
    kept = f"names_of_{pack.id}"
    store.keep(kept, source.filter(nw.col("protocol") == pack.id).group_by(*keys).agg(nw.len().alias("number")))
    known = {key for key in keys if key in NO_SETTINGS or pack_knows(pack, key)}
    profiles = FleetProfiles(pack, where, "error", options.get(pack.id, {}))
    waiting = store.rows(kept)
    while batch := [*islice(waiting, _BATCH)]:
        stated = [{key: row[key] for key in known} for row in batch]
        for row, (number, key) in zip(batch, profiles.add(stated), strict=True):
            on_wire = None
            if wire is not None and key is not None:
                on_wire = wire.topic(key, certain_texts(profiles.known[number].resolved))
            yield row["system"], row["topic"], key, on_wire
