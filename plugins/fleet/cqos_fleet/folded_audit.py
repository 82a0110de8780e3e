"""The check of a fleet whose participants a pack folds: see `cqos_core.packs.Folding`.

Participants are resolved by their kinds, far topics are matched by an index, distinct topics are judged once. The engine sorts, groups and
joins; what it hands over streams by, so that Python holds distinct things only, and 24 bytes for each subscriber of a far topic.
"""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

import narwhals as nw

from cqos_fleet.audit import Audited, telling
from cqos_fleet.clients import ENDS, Alike, Clients, folded_columns
from cqos_fleet.engines import DOT
from cqos_fleet.filter_matches import HEARD, NEAR, FilterMatches
from cqos_fleet.filter_subscribers import FAR, FarEnds
from cqos_fleet.profiles import settings_of
from cqos_fleet.similar_names import NAMED
from cqos_fleet.topic_frames import FINDING
from cqos_fleet.topic_judge import ALONE, Meetings, remarks_of, write_finding
from cqos_fleet.unmatched import write_unmatched

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.settings import Setting
    from cqos_core.packs.pack import RulePack
    from cqos_fleet.clients import FoldedColumns
    from cqos_fleet.table_store import TableStore

    Frame = nw.LazyFrame[Any]

FOLDED_STAGES: Final = ("reading participants", "matching topics", "adding up", "judging topics", "comparing names")
_TOPIC: Final = ["system", "topic"]
_OWNER: Final = ["system", "participant"]


def audit_folded(
    source: Frame,
    pack: RulePack,
    where: CheckContext,
    options: Mapping[str, Setting],
    severity: str,
    store: TableStore,
    step: Callable[[str], None],
) -> Audited:
    """Check the endpoints of one protocol.

    Args:
        source: a row for each endpoint, all columns as text, those of settings known to the pack.
        pack: has a folding.
        where: the packs.
        options: of the pack.
        severity: the least that is reported.
        store: keeps what each stage found.
        step: called before each of `FOLDED_STAGES`.
    """
    step(FOLDED_STAGES[0])
    clients, ends = _ends(source, pack, where, options, severity, store)
    step(FOLDED_STAGES[1])
    hearing, heard = _heard(clients, ends, store)
    step(FOLDED_STAGES[2])
    far, near = _with_what_they_hear(hearing, ends, heard, store)
    step(FOLDED_STAGES[3])
    with (
        store.spooled("found", FINDING) as found,
        store.spooled("alone", ALONE) as alone,
        store.spooled("names", NAMED) as names,
    ):
        meetings = Meetings(clients, hearing, far, found, alone, names)
        meetings.judge(store.tuples(_meetings(ends, near, heard, store)))
        meetings.judge_far()
        for (system, topic, p), number in sorted(clients.nameless.items()):
            for row in remarks_of(clients, p, number):
                write_finding(found, system, topic, row)
    step(FOLDED_STAGES[4])
    with store.spooled("lonely", FINDING) as out:
        write_unmatched(clients, hearing, store.scan("alone"), store.scan("names"), store, out)
    parts = [store.scan(each) for each in ("found", "lonely")]
    findings = nw.concat(parts, how="vertical").with_columns(nw.lit(pack.id).alias("protocol")).select(*FINDING)
    totals = {"endpoints": 0, "topics": 0, **meetings.totals, "profiles": len(clients.known)}
    totals["endpoints"] += sum(clients.nameless.values())
    return Audited([each.texts for each in clients.known], store.keep("findings", findings), totals)


def _ends(
    source: Frame,
    pack: RulePack,
    where: CheckContext,
    options: Mapping[str, Setting],
    severity: str,
    store: TableStore,
) -> tuple[Clients, Frame]:
    """Return the kinds of participants, and all endpoints with their numbers."""
    columns = folded_columns(pack, source.collect_schema().names())
    keys = [each for each in source.collect_schema().names() if each not in {*_OWNER, "topic", *columns.names}]
    store.keep("kinds", source.group_by(*keys).agg(nw.len().alias("number")).select(*keys).sort(*keys))
    texts = [*store.rows("kinds")]
    found = {key: [text[key] for text in texts] for key in keys}
    enough = telling(found, len(texts))
    kept = {each: ("text", found[each]) for each in enough} | {"t": ("number", [*range(len(texts))])}
    rows = source.join(store.put("numbered", kept), on=enough)
    rows = rows.select("system", "participant", "topic", "t", *columns.names)
    store.keep("rows", rows.sort("system", "participant", "topic", "t"))
    clients = Clients(pack, where, options, severity, texts, columns)
    with store.spooled("ends", ENDS) as out:
        clients.write(store.tuples("rows"), _alike(source, columns, pack, store), out)
    return clients, store.scan("ends")


def _heard(clients: Clients, ends: Frame, store: TableStore) -> tuple[FilterMatches, Frame]:
    """Return which subscribers hear which topics, and the published topics with the others that match them."""
    far = ends.filter(nw.col("far") == 1).group_by(*_TOPIC).agg(nw.len().alias("number"))
    store.keep("far", far.select(*_TOPIC).sort(*_TOPIC))
    hearing = FilterMatches(clients, store.tuples("far"))
    published = ends.filter(nw.col("second") == 0).group_by(*_TOPIC, "p").agg(nw.len().cast(nw.Int64).alias("number"))
    store.keep("published", published.select(*_TOPIC, "p", "number").sort(*_TOPIC, "p"))
    with store.spooled("heard", HEARD) as out:
        hearing.write_topics(store.tuples("published"), out)
    return hearing, store.scan("heard")


def _with_what_they_hear(hearing: FilterMatches, ends: Frame, heard: Frame, store: TableStore) -> tuple[FarEnds, Frame]:
    """Return the subscribers with the values that follow: those of far topics, and the others."""
    subscribers = ends.filter(nw.col("second") == 1).join(heard.drop("met"), on=_TOPIC, how="left")
    listed = subscribers.select(*_TOPIC, "p", "owner", "own", "far", nw.col("publishers").fill_null(0))
    store.keep("subscribers", listed.sort("owner", "topic", "p"))
    with store.spooled("near", NEAR) as near, store.spooled("far_ends", FAR) as far:
        hearing.write_subscribers(store.tuples("subscribers"), near, far)
    store.keep("far_in_order", store.scan("far_ends").sort("far", "owner", "p"))
    return FarEnds(len(hearing.far), store.batches("far_in_order")), store.scan("near")


def _meetings(ends: Frame, near: Frame, heard: Frame, store: TableStore) -> str:
    """Return the name of the table with the groups of endpoints of all topics, in order."""
    publishers = ends.filter(nw.col("second") == 0).select(*NEAR)
    groups = nw.concat([publishers, near.select(*NEAR)], how="vertical").group_by(*_TOPIC, "p", "own")
    counted = groups.agg(
        nw.len().cast(nw.Int64).alias("number"),
        nw.col("owner").min().alias("first"),
        nw.col("owner").max().alias("last"),
    )
    met = counted.join(heard.drop("publishers"), on=_TOPIC, how="left")
    met = met.select(*_TOPIC, "p", "own", "number", nw.col("met").fill_null(0), "first", "last")
    store.keep("meetings", met.sort(*_TOPIC, "p", "own"))
    return "meetings"


def _alike(source: Frame, columns: FoldedColumns, pack: RulePack, store: TableStore) -> dict[tuple[str, str], Alike]:
    """Return the participants with a text that others have, too, and what is known of these."""
    found: dict[tuple[str, str], Alike] = {}
    names = [each for each in source.collect_schema().names() if each.startswith(DOT) and each not in columns.names]
    for column, setting in columns.shared.items():
        stated = source.filter(nw.col(column) != "").group_by(*_OWNER).agg(nw.col(column).max().alias("shared"))
        several = stated.group_by("system", "shared").agg(nw.len().alias("number")).filter(nw.col("number") > 1)
        owners = stated.join(several.select("system", "shared"), on=["system", "shared"])
        owners = store.keep(f"shared_{column}", owners.select(*_OWNER, "shared"))
        of_owner = (
            source.join(owners, on=_OWNER).group_by(*_OWNER, "shared").agg(*[nw.col(each).max() for each in names])
        )
        store.keep(f"sharing_{column}", of_owner.sort("system", "shared", "participant"))
        rows = store.rows(f"sharing_{column}")
        for _, group in groupby(rows, lambda row: (row["system"], row["shared"])):
            for owner, others in _others(group, names, pack):
                found[owner] = (*found.get(owner, ()), *((setting, each) for each in others))
    return found


def _others(
    group: Iterator[Mapping[str, str]], names: list[str], pack: RulePack
) -> Iterator[tuple[tuple[str, str], list[tuple[tuple[str, str], ...]]]]:
    """Yield participants that share a text, each with the distinct settings of all others."""
    owned = {
        (row["system"], row["participant"]): tuple(
            sorted(settings_of(pack, {each: row[each] for each in names}, owned=True).items())
        )
        for row in group
    }
    numbers = Counter(owned.values())
    for owner, own in owned.items():
        yield owner, sorted(each for each, number in numbers.items() if each != own or number > 1)
