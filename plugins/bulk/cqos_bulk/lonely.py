"""Endpoints without partners: those whose topic has a name like another are compared as in a check, the others are reported as they are."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import narwhals as nw

from cqos_bulk.hearing import by_topic
from cqos_bulk.meetings import NAMED
from cqos_bulk.similar_names import BUSY, OFFERED, REQUESTED, similar_topics
from cqos_bulk.slow_topics import row_of
from cqos_bulk.spool import spooled
from cqos_bulk.topic_frames import FINDING
from cqos_core.checking.partners import BusyTopics, reported_alone
from cqos_core.model.codes import CODES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_bulk.clients import Clients
    from cqos_bulk.engines import TableStore
    from cqos_bulk.hearing import Hearing
    from cqos_bulk.spool import Spool
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.resolving.resolved import Resolved

    Frame = nw.LazyFrame[Any]

_TOPIC: Final = ["system", "topic"]


def write_lonely(clients: Clients, hearing: Hearing, alone: Frame, names: Frame, store: TableStore, out: Spool) -> None:
    """Write the findings about endpoints without partners.

    Args:
        clients: the ends.
        hearing: the far topics.
        alone: see `cqos_bulk.meetings.ALONE`.
        names: the topics, and what is on them.
        store: keeps what is in between.
        out: has the columns of findings.
    """
    kinds = (OFFERED, REQUESTED, BUSY)
    for sides in kinds:
        store.keep(f"names{sides}", names.filter(nw.col("sides") == sides).select(*_TOPIC))
    batches = {sides: partial(store.batches, f"names{sides}") for sides in kinds}
    with spooled(store, "similar", NAMED) as spool:
        for row in similar_topics(batches, clients.pack.meeting):
            spool.add(*row)
        for row in _reached(clients, hearing, store):
            spool.add(*row)
    similar = store.engine.scan(store.path("similar"))
    by_name = alone.join(similar.group_by(*_TOPIC).agg(nw.col("sides").max()), on=_TOPIC, how="left")
    by_name = by_name.with_columns(nw.col("sides").fill_null(0))
    columns = alone.collect_schema().names()
    ordered = by_name.filter(nw.col("sides") == 0).select(*columns).sort(*_TOPIC, "p")
    store.keep("unlike_any", ordered)
    for (system, topic), rows in by_topic(store.batches("unlike_any")):
        _write_alone(clients, system, topic, rows, out)
    store.keep("like_others", by_name.filter(nw.col("sides") > 0).select(*columns).sort(*_TOPIC, "p"))
    store.keep("meant", similar.filter(nw.col("sides") == BUSY).select(*_TOPIC).sort(*_TOPIC))
    busy: dict[str, list[str]] = {}
    for batch in store.batches("meant"):
        for system, topic in zip(*batch, strict=True):
            busy.setdefault(system, []).append(topic)
    for system, of_system in groupby(by_topic(store.batches("like_others")), lambda each: each[0][0]):
        _write_similar(clients, system, [(topic, rows) for (_, topic), rows in of_system], busy.get(system, ()), out)


def _reached(clients: Clients, hearing: Hearing, store: TableStore) -> Iterator[tuple[str, str, int]]:
    """Yield far topics without partner, and published ones, that match when both are folded."""
    far: dict[str, list[str]] = {}
    for batch in store.batches(f"names{REQUESTED}"):
        for system, topic in zip(*batch, strict=True):
            if (system, topic) in hearing.far:
                far.setdefault(system, []).append(topic)
    for _, fold in clients.pack.meeting.folds if far else ():
        folded: dict[str, dict[str, list[str]]] = {}
        for system, topics in far.items():
            for topic in topics:
                folded.setdefault(system, {}).setdefault(fold(topic), []).append(topic)
        finders = {system: clients.folding.finder([*topics]) for system, topics in folded.items()}
        reached: set[tuple[str, str]] = set()
        for batch in store.batches(f"names{OFFERED}"):
            for system, topic in zip(*batch, strict=True):
                matching = [*finders[system](fold(topic))] if system in finders else []
                if matching:
                    yield system, topic, OFFERED
                    reached.update((system, each) for each in matching)
        yield from ((system, topic, REQUESTED) for system, each in reached for topic in folded[system][each])


def _write_alone(clients: Clients, system: str, topic: str, rows: Iterable[tuple[Any, ...]], out: Spool) -> None:
    """Write that endpoints of a topic have no partner."""
    for code, end, at in (("CQ401", "subscriber", 2), ("CQ402", "publisher", 1)):
        here = [row for row in rows if row[at] and not clients.known[row[0]].resolved.external]
        severity = str(CODES[code].severity)
        if here and severity in clients.severities:
            counts = {"publishers": 0, "subscribers": 0, f"{end}s": sum(row[at] for row in here)}
            row = {"publisher": -1, "subscriber": -1, end: here[0][0], **counts, "code": code, "severity": severity}
            _write(row, system, topic, out)


def _write(row: dict[str, Any], system: str, topic: str, out: Spool) -> None:
    every = {"verdict": "", "help": "", "pairs": 0, **row, "system": system, "topic": topic, "protocol": ""}
    out.add(*[every[each] for each in FINDING])


class _Stands(NamedTuple):
    """Whom the endpoints of a comparison stand for, by id: how many, and which end."""

    counts: dict[str, int]
    numbers: dict[str, int]


def _write_similar(
    clients: Clients,
    system: str,
    topics: Iterable[tuple[str, list[tuple[Any, ...]]]],
    busy: Iterable[str],
    out: Spool,
) -> None:
    """Compare the names of topics of one system, and write what follows."""
    pack = clients.pack
    meant = BusyTopics({pack.id: pack})
    for topic in busy:
        meant.put((pack.id, topic), topic)
    stands = _Stands({}, {})
    lonely: dict[TopicKey, list[Resolved]] = {
        (pack.id, topic): [_end(clients, topic, row, stands) for row in rows] for topic, rows in topics
    }
    found = reported_alone(lonely, {pack.id: pack}, {}, lambda _: meant.meant, partial=False)
    for (_, topic), findings in found.items():
        for finding in findings:
            if finding.severity.value in clients.severities:
                row = row_of(finding, *stands, lambda member: clients.known[stands.numbers[member]].resolved.role)
                _write(row, system, topic, out)


def _end(clients: Clients, topic: str, row: tuple[Any, ...], stands: _Stands) -> Resolved:
    p, publishers, subscribers, first, last = row
    resolved = clients.known[p].resolved
    identifier = str(len(stands.counts))
    stands.counts[identifier] = publishers + subscribers
    stands.numbers[identifier] = p
    # Names of one participant that nearly agree are no mistake, so it counts whether there is only one.
    owner = f"{first}" if first == last else f"several {identifier}"
    endpoint = replace(resolved.endpoint, participant=owner)
    end: Resolved = replace(resolved, id=identifier, key=topic, shown=topic, endpoint=endpoint)
    return end
