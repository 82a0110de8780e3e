"""The check of a fleet: a first pass finds topics on which a rule may report, a second one confirms, with exact counts.

All tables are Narwhals frames, so an engine needs nothing of its own but reading and writing. The first pass asks every rule about the
extremes of all endpoints of a topic. The second asks it about each two profiles of the topics that are left. Topics on which more
decides than the rules of pairs are judged in Python, once for each combination of profiles.
"""

from __future__ import annotations

import re
from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import narwhals as nw

from cqos_core.model.codes import CODES
from cqos_core.model.finding import Verdict
from cqos_fleet.rule_evaluation import Judge, judge_of
from cqos_fleet.similar_names import BUSY, OFFERED, REQUESTED, keep_similar
from cqos_fleet.slow_topics import ALONE, COLUMNS, PYTHON, SPECIAL, SlowTopics
from cqos_fleet.topic_frames import (
    COUNTS,
    FINDING,
    TOPIC,
    confirmed,
    finding_columns,
    literals,
    of_pairs,
    routed_topics,
    rows_of,
    summed,
    verdicts_of,
)
from cqos_fleet.writers import pattern_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_fleet.profiles import FleetProfiles
    from cqos_fleet.table_store import TableStore

    Frame = nw.LazyFrame[Any]

_NOT_RESOLVED: Final = ("system", "participant", "topic")
STAGES: Final = ("reading profiles", "finding candidates", "comparing names", "counting pairs", "judging the rest")


class Audited(NamedTuple):
    """What an audit of one protocol found.

    Attributes:
        texts: what each profile states, by column.
        findings: table with the columns `FINDING`.
        totals: numbers of endpoints, topics and profiles, and of pairs by verdict.
    """

    texts: Sequence[Mapping[str, str]]
    findings: Frame
    totals: Mapping[str, int]


class _Topics(NamedTuple):
    """The topics of one protocol with their routes; ``ends`` gives groups of endpoints of one topic and profile, of some topics or profiles."""

    topics: Frame
    ends: Callable[[Frame | None, Frame | None], Frame]
    table: Frame
    judge: Judge


def audit(
    source: Frame,
    texts: Frame,
    profiles: FleetProfiles,
    store: TableStore,
    step: Callable[[str], None],
    *,
    one_system: bool,
) -> Audited:
    """Check the endpoints of one protocol.

    Args:
        source: a row for each endpoint, all columns as text.
        texts: the distinct rows of all columns that decide values.
        profiles: empty; it is filled.
        store: keeps what each stage found.
        step: called before each of `STAGES`.
        one_system: all rows are of one system.
    """
    step(STAGES[0])
    keys = [name for name in source.collect_schema().names() if name not in _NOT_RESOLVED]
    # In order, so that each run numbers the profiles alike.
    store.keep("texts", texts.select(*keys).sort(*keys))
    plain = _numbered(keys, profiles, store)
    step(STAGES[1])
    found = _candidates(source, plain, keys, profiles, store, one_system)
    step(STAGES[2])
    similar = _similar(found.topics, profiles, store)
    step(STAGES[3])
    alone = nw.col("route") == ALONE
    wanted = nw.concat(
        [
            found.topics.filter((nw.col("route") == COLUMNS) | (nw.col("route") == PYTHON)).select(*TOPIC, "route"),
            found.topics.filter(alone).join(similar, on=["system", "topic"], how="semi").select(*TOPIC, "route"),
        ],
        how="vertical",
    )
    wanted = store.keep("wanted", wanted)
    groups = store.keep("groups", _grouped(found, wanted))
    said = store.keep("said", confirmed(groups.filter(nw.col("route") == COLUMNS), found.table, found.judge))
    step(STAGES[4])
    rest = SlowTopics(profiles)
    store.keep("slow", groups.filter(nw.col("route") >= PYTHON).sort("system", "topic", "part", "p"))
    busy = store.rows("similar")
    slow = store.fill("rest", FINDING, rest.judge(store.rows("slow"), (row for row in busy if row["sides"] == BUSY)))
    parts = [*of_pairs(said, found.judge), slow]
    parts += _of_one_side(found.topics.filter(alone).join(wanted, on=TOPIC, how="anti"), profiles)
    remarked = [at for at, each in enumerate(profiles.known) if each.remarks]
    if remarked:
        parts.append(_of_ends(found, profiles, store, remarked))
    protocol = nw.lit(profiles.pack.id).alias("protocol")
    listed = [each.with_columns(protocol).select(*finding_columns()) for each in parts]
    findings = store.keep("findings", nw.concat(listed, how="vertical"))
    stated = [each.texts for each in profiles.known]
    return Audited(stated, findings, _totals(found, said, rest.verdicts, len(stated)))


_PLAIN_TOPICS: Final = ("/topic", "topic")
_BATCH: Final = 20_000


def _numbered(keys: Sequence[str], profiles: FleetProfiles, store: TableStore) -> Frame:
    """Resolve distinct rows of texts, as endpoints of a topic whose name means nothing; return them with their profiles."""
    plain = next((each for each in _PLAIN_TOPICS if re.fullmatch(profiles.pack.topic_matching.plain, each)), "topic")
    found: dict[str, list[Any]] = {each: [] for each in (*keys, "p")}
    for row, number, _ in _resolved(store.rows("texts"), profiles, topic=plain, participant="participant"):
        for each in keys:
            found[each].append(row[each])
        found["p"].append(number)
    numbers = found.pop("p")
    enough = telling(found, len(numbers))
    return store.put("profiles", {each: ("text", found[each]) for each in enough} | {"p": ("number", numbers)})


_MOST_COMPARED: Final = 50_000


def telling(found: Mapping[str, Sequence[Any]], number: int) -> list[str]:
    """Return columns of texts that are enough to tell ``number`` rows apart, as few as one after the other can be left out."""
    left = [*found]
    for each in [*left] if 0 < number <= _MOST_COMPARED else ():
        fewer = [other for other in left if other != each]
        if len(set(zip(*(found[other] for other in fewer), strict=True))) == number:
            left = fewer
    return left


def _resolved(
    rows: Iterator[dict[str, Any]], profiles: FleetProfiles, **stated: str
) -> Iterator[tuple[dict[str, Any], int, str | None]]:
    """Yield rows of texts with the number of their profile, and the name on which their topic matches."""
    while batch := [*islice(rows, _BATCH)]:
        yield from _added(batch, profiles, stated)


def _added(
    batch: Sequence[dict[str, Any]], profiles: FleetProfiles, stated: Mapping[str, str]
) -> Iterator[tuple[dict[str, Any], int, str | None]]:
    whole = [{**{name: text for name, text in row.items() if name != "number"}, **stated} for row in batch]
    for row, (number, key) in zip(batch, profiles.add(whole), strict=True):
        yield row, number, key


def _candidates(
    source: Frame,
    plain: Frame,
    keys: Sequence[str],
    profiles: FleetProfiles,
    store: TableStore,
    one_system: bool,  # noqa: FBT001 - of the table, as all before it
) -> _Topics:
    """Return all topics with their routes."""
    judge = judge_of(profiles)
    table = store.put("values", judge.table)
    name = ["topic"] if one_system else _NAME
    telling = [each for each in plain.collect_schema().names() if each != "p"]

    def ends(topics: Frame | None = None, only: Frame | None = None) -> Frame:
        rows = source if topics is None else source.join(topics.select(*name), on=name, how="semi")
        some = plain if only is None else plain.join(only, on="p", how="semi")
        found = rows.join(some, on=telling).group_by(*name, "p").agg(nw.len().cast(nw.Int64).alias("number"))
        return found.with_columns(nw.lit("").alias("system")) if one_system else found

    # One grouping of the rows themselves: a table of groups in between would cost more than it saves.
    valued = source.join(store.keep("valued", plain.join(table, on="p")), on=telling)
    routed = routed_topics(valued, judge, one_system=one_system)
    is_special = _is_special(profiles)
    if is_special is not None:
        routed = routed.with_columns(nw.when(is_special).then(SPECIAL).otherwise(nw.col("route")).alias("route"))
    topics = store.keep("topics", routed)
    special = topics.filter(nw.col("route") == SPECIAL).group_by("topic").agg(nw.len().alias("number"))
    if is_special is None or not rows_of(special.head(1)):
        return _Topics(_split(topics, judge, profiles, store), lambda *some: _counted(ends(*some), table), table, judge)
    named = _named(source.join(special, on="topic", how="semi"), keys, profiles, store)
    judge = judge_of(profiles)
    table = store.put("all_values", judge.table)
    known = named.group_by(*_NAME).agg(nw.len().alias("endpoints"))
    few = [ends(known).join(special, on="topic", how="anti"), named]
    few_ends = store.keep("named", nw.concat([each.select(*_GROUP) for each in few], how="vertical"))
    again = routed_topics(_counted(few_ends, table), judge, weighted=True)
    rest = topics.filter(nw.col("route") != SPECIAL).join(known, on=_NAME, how="anti")

    def every(some: Frame | None = None, only: Frame | None = None) -> Frame:
        others = ends(some, only).join(special, on="topic", how="anti").join(known, on=_NAME, how="anti")
        here = few_ends if some is None else few_ends.join(some, on=_NAME, how="semi")
        here = here if only is None else here.join(only, on="p", how="semi")
        return _counted(nw.concat([others.select(*_GROUP), here], how="vertical"), table)

    topics = nw.concat([rest, again.select(*rest.collect_schema().names())], how="vertical")
    return _Topics(_split(store.keep("all_topics", topics), judge, profiles, store), every, table, judge)


_NAME: Final = ["system", "topic"]
_GROUP: Final = [*_NAME, "p", "number"]


def _counted(groups: Frame, table: Frame) -> Frame:
    """Return groups of endpoints of one profile with the columns of it, and how many publishers and subscribers they are."""
    counts = [nw.col(each).cast(nw.Int64) * nw.col("number") for each in COUNTS]
    return groups.join(table, on="p").with_columns(*counts)


def _is_special(profiles: FleetProfiles) -> nw.Expr | None:
    """Return whether the name of a topic has to be resolved, or the pack has conventions about it; None: never."""
    plain = profiles.pack.topic_matching.plain
    if not plain:
        return None
    known = "|".join(pattern_of(each.pattern) for each in profiles.pack.conventions)
    name = nw.col("topic")
    unclear = ~name.str.contains(rf"(?s)\A(?:{plain})\z")
    if profiles.pack.topic_matching.longest is not None:
        unclear = unclear | (name.str.len_chars() > profiles.pack.topic_matching.longest)
    return unclear | name.str.contains(rf"(?s)\A(?:{known})\z") if known else unclear


def _named(rows: Frame, keys: Sequence[str], profiles: FleetProfiles, store: TableStore) -> Frame:
    """Resolve endpoints together with the names of their topics; return groups of them by the names that they match on."""
    plain = nw.col("topic").str.contains(rf"(?s)\A(?:{profiles.pack.topic_matching.plain})\z")
    owner = nw.when(plain).then(nw.lit("participant")).otherwise(nw.col("participant"))
    columns = ["system", *keys, "topic", "participant"]
    distinct = rows.with_columns(owner.alias("participant")).group_by(*columns).agg(nw.len().alias("number"))
    store.keep("named_texts", distinct.sort(*columns))
    found = Counter[tuple[str, str, int]]()
    for row, number, key in _resolved(store.rows("named_texts"), profiles):
        if key is not None:
            found[row["system"], key, number] += row["number"]
    return store.put(
        "named_profiles",
        {
            "system": ("text", [each[0] for each in found]),
            "topic": ("text", [each[1] for each in found]),
            "p": ("number", [each[2] for each in found]),
            "number": ("number", [*found.values()]),
        },
    )


def _split(topics: Frame, judge: Judge, profiles: FleetProfiles, store: TableStore) -> Frame:
    """Leave to Python the topics that fall into parts that never match, where a check reports that."""
    if len(set(judge.table["part"][1])) <= 1:
        return topics
    parts = topics.group_by("system", "topic").agg(nw.len().alias("parts"), nw.col("route").max().alias("worst"))
    several = parts.filter(nw.col("parts") > 1)
    if "note" not in profiles.severities:
        several = several.filter(nw.col("worst") == ALONE)
    found = topics.join(several, on=["system", "topic"], how="left")
    route = nw.when(nw.col("parts").is_null()).then(nw.col("route")).otherwise(PYTHON)
    return store.keep("split", found.with_columns(route.alias("route")).select(*topics.collect_schema().names()))


def _similar(topics: Frame, profiles: FleetProfiles, store: TableStore) -> Frame:
    """Return the topics whose names may be meant by those with one side, and the latter."""
    no_publisher, no_subscriber = (nw.col(each) == 0 for each in COUNTS)
    kinds = {OFFERED: no_subscriber, REQUESTED: no_publisher, BUSY: ~no_publisher & ~no_subscriber}
    return keep_similar(
        {sides: topics.filter(which) for sides, which in kinds.items()}, profiles.pack.topic_matching, store
    )


def _grouped(found: _Topics, wanted: Frame) -> Frame:
    """Return the endpoints of some topics, as groups of one profile."""
    ends = found.ends(wanted, None).join(wanted, on=TOPIC)
    return ends.group_by(*TOPIC, "route", "p").agg(*summed(*COUNTS))


def _of_one_side(topics: Frame, profiles: FleetProfiles) -> Iterator[Frame]:
    """Yield the findings about topics that have one side, and a name like no other; by convention some have their partners elsewhere."""
    external = [at for at, each in enumerate(profiles.known) if each.resolved.external]
    if external:
        topics = topics.filter(~nw.col("example").is_in(external))
    for code, end, count in (("CQ401", "subscriber", "subscribers"), ("CQ402", "publisher", "publishers")):
        severity = str(CODES[code].severity)
        if severity in profiles.severities:
            other = "publisher" if end == "subscriber" else "subscriber"
            said: dict[str, str | int] = {
                "code": code,
                "severity": severity,
                "verdict": "",
                "help": "",
                other: -1,
                "pairs": 0,
            }
            yield topics.filter(nw.col(count) > 0).with_columns(nw.col("example").alias(end), *literals(said))


def _of_ends(found: _Topics, profiles: FleetProfiles, store: TableStore, remarked: Sequence[int]) -> Frame:
    """Return the findings about single profiles, by topic."""
    rows = [*dict.fromkeys((at, each.code, each.severity) for at in remarked for each in profiles.known[at].remarks)]
    said = store.put(
        "remarks",
        {
            "p": ("number", [each[0] for each in rows]),
            "code": ("text", [each[1] for each in rows]),
            "severity": ("text", [each[2] for each in rows]),
        },
    )
    counted = (
        found.ends(None, said)
        .join(said, on="p")
        .group_by("system", "topic", "p", "code", "severity")
        .agg(*summed(*COUNTS))
    )
    return counted.with_columns(
        *literals({"verdict": "", "help": "", "pairs": 0}),
        *[
            nw.when(nw.col(count) > 0).then(nw.col("p")).otherwise(-1).alias(count.removesuffix("s"))
            for count in COUNTS
        ],
    )


def _totals(found: _Topics, said: Frame, verdicts: Mapping[str, int], profiles: int) -> dict[str, int]:
    """Return how many endpoints, topics and profiles there are, and how many pairs have which verdict."""
    count = nw.col("publishers") * nw.col("subscribers")
    in_columns = nw.when(nw.col("route") < PYTHON).then(count).otherwise(0)
    (row,) = rows_of(
        found.topics.select(
            (nw.col("publishers") + nw.col("subscribers")).sum().cast(nw.Int64).alias("endpoints"),
            nw.len().alias("topics"),
            in_columns.sum().cast(nw.Int64).alias("pairs"),
        )
    )
    totals = {"endpoints": int(row["endpoints"] or 0), "topics": int(row["topics"]), "profiles": profiles}
    by_rank = verdicts_of(said, found.judge)
    for verdict in (Verdict.INCOMPATIBLE, Verdict.UNKNOWN):
        totals[verdict.value] = by_rank.get(verdict.rank, 0) + verdicts.get(verdict.value, 0)
    decided = by_rank.get(Verdict.INCOMPATIBLE.rank, 0) + by_rank.get(Verdict.UNKNOWN.rank, 0)
    compatible = int(row["pairs"] or 0) - decided + verdicts.get(Verdict.COMPATIBLE.value, 0)
    return {**totals, Verdict.COMPATIBLE.value: compatible}
