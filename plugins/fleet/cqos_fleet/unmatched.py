"""Endpoints without partners: those whose topic has a name like another are compared as in a check, the others are reported as they are."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

import narwhals as nw

from cqos_core.model.codes import CODES
from cqos_core.model.grouping import grouped
from cqos_fleet.filter_matches import by_topic
from cqos_fleet.representatives import StandIns
from cqos_fleet.similar_names import BUSY, OFFERED, REQUESTED, keep_similar
from cqos_fleet.topic_judge import write_finding

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_fleet.clients import Clients
    from cqos_fleet.filter_matches import FilterMatches
    from cqos_fleet.table_store import Spool, TableStore

    Frame = nw.LazyFrame[Any]

_TOPIC: Final = ["system", "topic"]


def write_unmatched(
    clients: Clients, hearing: FilterMatches, alone: Frame, names: Frame, store: TableStore, out: Spool
) -> None:
    """Write the findings about endpoints without partners.

    Args:
        clients: the ends.
        hearing: the far topics.
        alone: see `cqos_fleet.topic_judge.ALONE`.
        names: the topics, and what is on them.
        store: keeps what is in between.
        out: has the columns of findings.
    """
    kinds = {sides: names.filter(nw.col("sides") == sides) for sides in (OFFERED, REQUESTED, BUSY)}
    similar = keep_similar(kinds, clients.pack.topic_matching, store, _reached(clients, hearing, store))
    by_name = alone.join(similar.group_by(*_TOPIC).agg(nw.col("sides").max()), on=_TOPIC, how="left")
    by_name = by_name.with_columns(nw.col("sides").fill_null(0))
    columns = alone.collect_schema().names()
    ordered = by_name.filter(nw.col("sides") == 0).select(*columns).sort(*_TOPIC, "p")
    store.keep("unlike_any", ordered)
    for name, rows in by_topic(store.tuples("unlike_any")):
        for row in _alone(clients, rows):
            write_finding(out, *name, row)
    store.keep("like_others", by_name.filter(nw.col("sides") > 0).select(*columns).sort(*_TOPIC, "p"))
    store.keep("meant", similar.filter(nw.col("sides") == BUSY).select(*_TOPIC).sort(*_TOPIC))
    busy = grouped((system, topic) for system, topic in store.tuples("meant"))
    for system, of_system in groupby(by_topic(store.tuples("like_others")), lambda each: each[0][0]):
        stand_ins = StandIns(clients)
        unmatched = {topic: [_stand_in(stand_ins, topic, *row) for row in rows] for (_, topic), rows in of_system}
        for topic, row in stand_ins.alone(unmatched, busy.get(system, ())):
            write_finding(out, system, topic, row)


def _reached(clients: Clients, hearing: FilterMatches, store: TableStore) -> Iterator[tuple[str, str, int]]:
    """Yield far topics without partner, and published ones, that match when both are folded."""
    far = grouped(
        (system, topic) for system, topic in store.tuples(f"names{REQUESTED}") if (system, topic) in hearing.far
    )
    for _, fold in clients.pack.topic_matching.folds if far else ():
        folded: dict[str, dict[str, list[str]]] = {}
        for system, topics in far.items():
            for topic in topics:
                folded.setdefault(system, {}).setdefault(fold(topic), []).append(topic)
        finders = {system: clients.folding.finder([*topics]) for system, topics in folded.items()}
        reached: set[tuple[str, str]] = set()
        for system, topic in store.tuples(f"names{OFFERED}"):
            matching = [*finders[system](fold(topic))] if system in finders else []
            if matching:
                yield system, topic, OFFERED
                reached.update((system, each) for each in matching)
        yield from ((system, topic, REQUESTED) for system, each in reached for topic in folded[system][each])


def _alone(clients: Clients, rows: Iterable[tuple[Any, ...]]) -> Iterator[dict[str, Any]]:
    """Yield that endpoints of a topic have no partner."""
    for code, end, at in (("CQ401", "subscriber", 2), ("CQ402", "publisher", 1)):
        here = [row for row in rows if row[at] and not clients.known[row[0]].resolved.external]
        severity = str(CODES[code].severity)
        if here and severity in clients.severities:
            yield {end: here[0][0], f"{end}s": sum(row[at] for row in here), "code": code, "severity": severity}


def _stand_in(stand_ins: StandIns, topic: str, p: int, *counted: int) -> Resolved:
    publishers, subscribers, first, last = counted
    # Names of one participant that nearly agree are no mistake, so it counts whether there is only one.
    return stand_ins.add(p, publishers + subscribers, topic, f"owner {first}" if first == last else "")
