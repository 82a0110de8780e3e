"""The check of a fleet: a first pass finds topics on which a rule may report, a second one confirms, with exact counts.

All tables are Narwhals frames, so an engine needs nothing of its own but reading and writing. The first pass asks every rule about the
extremes of all endpoints of a topic. The second asks it about each two profiles of the topics that are left. Topics on which more
decides than the rules of pairs are judged in Python, profile by profile.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import narwhals as nw

from cqos_core.bulk.judging import Judge, column_name, judge_of
from cqos_core.bulk.profiles import NO_SETTINGS, FleetProfiles
from cqos_core.bulk.slow_topics import ALONE, PYTHON, SlowTopics
from cqos_core.bulk.writers import expression, pattern_of
from cqos_core.matching.judge import verdict_by
from cqos_core.model.problems import CqosError
from cqos_core.model.report import Verdict
from cqos_core.model.spelling import nearest
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cqos_core.bulk.engines import TableStore
    from cqos_core.bulk.forms import Column, RuleForm

    Frame = nw.LazyFrame[Any]

TOPIC: Final = ["system", "topic", "part"]
FINDING: Final = {
    "code": "text",
    "severity": "text",
    "verdict": "text",
    "system": "text",
    "topic": "text",
    "publisher": "number",
    "subscriber": "number",
    "publishers": "number",
    "subscribers": "number",
    "pairs": "number",
}
"""The columns of findings: `publisher` and `subscriber` are numbers of profiles, the others counts of endpoints and pairs."""
_QUIET, _COLUMNS = range(2)


class Audited(NamedTuple):
    """What an audit of one protocol found.

    Attributes:
        findings: table with the columns `FINDING`.
        totals: numbers of endpoints, topics and profiles, and of pairs by verdict.
    """

    profiles: FleetProfiles
    findings: Frame
    totals: dict[str, int]


def audit(source: Frame, profiles: FleetProfiles, store: TableStore, step: Callable[[str], None]) -> Audited:
    """Check the endpoints of one protocol.

    Args:
        source: a row for each endpoint, all columns as text.
        profiles: empty; it is filled.
        store: keeps what each stage found.
        step: called before each stage, with what it does.
    """
    settings = _settings(source, profiles)
    keys = ["system", "version", "role", *settings]
    step("reading profiles")
    special = _special_topics(source, profiles, store)
    plain = source.join(special, on="topic", how="anti")
    numbered = _numbered(plain.select(*keys).unique(), profiles, store, "profiles")
    named = source.join(special, on="topic", how="semi")
    exact = _numbered(named.select(*keys, "topic", "participant").unique(), profiles, store, "named")
    judge = judge_of(profiles)
    table = store.put("values", judge.table)
    wide = numbered.drop("key").join(table, on="p")
    ends = plain.join(wide.drop("system"), on=keys[1:], how="inner")
    few = named.join(exact, on=[*keys, "topic", "participant"]).drop("topic").rename({"key": "topic"})
    few = few.group_by("system", "topic", "p").agg(nw.len().alias("number"))
    few = store.keep("named_groups", few).filter(~nw.col("topic").is_null()).join(table, on="p")
    few = few.with_columns(*[nw.col(each) * nw.col("number") for each in ("publishers", "subscribers")])
    step("finding candidates")
    of_plain = store.keep("topics", _topics(ends, judge))
    of_named = store.keep("named_topics", _topics(few, judge))
    topics = store.keep("routes", _routed(nw.concat([of_plain, of_named], how="vertical"), profiles))
    step("counting pairs")
    both = ["system", "topic", "p", "publishers", "subscribers", "part"]
    wanted = topics.filter(nw.col("route") > _QUIET).select(*TOPIC, "route")
    groups = nw.concat([ends.select(*both), few.select(*both)], how="vertical").join(wanted, on=TOPIC)
    groups = groups.group_by(*TOPIC, "route", "p").agg(
        nw.col("publishers").sum().cast(nw.Int64), nw.col("subscribers").sum().cast(nw.Int64)
    )
    groups = store.keep("groups", groups)
    said = store.keep("said", _confirmed(groups.filter(nw.col("route") == _COLUMNS), table, judge))
    step("judging the rest")
    store.keep("slow", groups.filter(nw.col("route") >= PYTHON).sort("system", "topic", "part", "p"))
    rest = SlowTopics(profiles)
    rest.judge(store.rows("slow"))
    slow = store.put("rest", {name: (kind, [row[name] for row in rest.rows]) for name, kind in FINDING.items()})
    parts = [*_of_pairs(said, judge), slow]
    alone = [at for at, each in enumerate(profiles.known) if each.remarks]
    if alone:
        every = nw.concat([ends.select(*both), few.select(*both)], how="vertical")
        parts.append(_of_ends(every, profiles, store, alone))
    findings = store.keep("findings", nw.concat([each.select(*map(_typed, FINDING)) for each in parts], how="vertical"))
    return Audited(profiles, findings, _totals(topics, said, judge, rest.verdicts, profiles))


def _typed(name: str) -> nw.Expr:
    return nw.col(name).cast(nw.String if FINDING[name] == "text" else nw.Int64)


def _settings(source: Frame, profiles: FleetProfiles) -> list[str]:
    """Return the columns that decide values; refuse those that name no policy."""
    names = source.collect_schema().names()
    found = [name for name in names if name in {"type", "profile"} or name not in NO_SETTINGS]
    pack = profiles.pack
    for name in found:
        if name not in NO_SETTINGS and all(
            pack.find(level, name) is None for level in ("endpoint", "participant", "option")
        ):
            near = nearest(name, [each.name for each in pack.policies])
            meant = f"; did you mean `{near}`?" if near else ""
            raise CqosError(f"column `{name}` names no policy of {pack.title}{meant} (`--skip {name}` leaves it out)")
    return found


def _special_topics(source: Frame, profiles: FleetProfiles, store: TableStore) -> Frame:
    """Return the topics whose name has to be resolved, and those about which the pack has conventions."""
    topics = source.select("topic").unique()
    plain, pack = profiles.pack.meeting.plain, profiles.pack
    if plain:
        known = "|".join(pattern_of(each.pattern) for each in pack.conventions)
        name = nw.col("topic")
        is_special = ~name.str.contains(rf"(?s)\A(?:{plain})\z")
        topics = topics.filter(is_special | name.str.contains(rf"(?s)\A(?:{known})\z") if known else is_special)
    return store.keep("special", topics)


def _numbered(rows: Frame, profiles: FleetProfiles, store: TableStore, name: str) -> Frame:
    """Resolve distinct rows of texts; return them with the number of their profile."""
    store.keep(f"{name}_texts", rows)
    columns = rows.collect_schema().names()
    found: dict[str, list[Any]] = {each: [] for each in (*columns, "p", "key")}
    batch: list[dict[str, str]] = []
    plain = next((each for each in _PLAIN_TOPICS if re.fullmatch(profiles.pack.meeting.plain, each)), "topic")

    def resolve() -> None:
        whole = [{"participant": "participant", "topic": plain, **row} for row in batch]
        for row, (number, key) in zip(batch, profiles.add(whole), strict=True):
            for each in columns:
                found[each].append(row[each])
            found["p"].append(number)
            found["key"].append(key)
        batch.clear()

    for row in store.rows(f"{name}_texts"):
        batch.append(row)
        if len(batch) >= _BATCH:
            resolve()
    resolve()
    kinds = {each: "number" if each == "p" else "text" for each in found}
    return store.put(name, {each: (kinds[each], cells) for each, cells in found.items()})


_PLAIN_TOPICS: Final = ("/topic", "topic")
_BATCH: Final = 20_000


def _topics(ends: Frame, judge: Judge) -> Frame:
    """Return the topics, with what has to be asked about each: nothing, its pairs in columns, or all of it in Python."""
    extremes = [
        (nw.col(name).max() if column.most else nw.col(name).min())
        for columns, matching in ((judge.columns, False), (judge.matching_columns, True))
        for column in columns
        for name in (column_name(judge, column, matching=matching),)
        if matching or any(column in set(rule.quiet.columns()) for rule in judge.rules)
    ]
    found = ends.group_by(*TOPIC).agg(
        nw.col("publishers").sum().cast(nw.Int64),
        nw.col("subscribers").sum().cast(nw.Int64),
        nw.col("python").max(),
        *[
            each
            for name in ("offering", "requesting")
            for each in (nw.col(name).min().alias(f"{name}_least"), nw.col(name).max().alias(f"{name}_most"))
        ],
        *extremes,
    )

    def column(each: Column) -> nw.Expr:
        return nw.col(column_name(judge, each))

    def matching(each: Column) -> nw.Expr:
        return nw.col(column_name(judge, each, matching=True))

    slow = nw.col("python") == 1
    for name in ("offering", "requesting"):
        slow = slow | (nw.col(f"{name}_least") != nw.col(f"{name}_most")).fill_null(value=False)
    for rule in judge.matching:
        slow = slow | ~expression(rule.quiet, matching).fill_null(value=True)
    loud = nw.lit(value=False)
    for rule in judge.rules:
        loud = loud | ~expression(rule.quiet, column).fill_null(value=True)
    alone = (nw.col("publishers") == 0) | (nw.col("subscribers") == 0)
    route = (
        nw.when(slow)
        .then(PYTHON)
        .otherwise(nw.when(alone).then(ALONE).otherwise(nw.when(loud).then(_COLUMNS).otherwise(_QUIET)))
    )
    return found.with_columns(route.alias("route")).select(*TOPIC, "publishers", "subscribers", "route")


def _confirmed(groups: Frame, table: Frame, judge: Judge) -> Frame:
    """Return the pairs of profiles of a topic on which a rule reports: per rule 0, 1, or 2 where it is not decided."""
    names = [column_name(judge, column) for column in judge.columns]
    ends = [
        groups.filter(nw.col(count) > 0)
        .select(*TOPIC, "p", count)
        .join(table.select("p", *[n for n, c in zip(names, judge.columns, strict=True) if c.second is second]), on="p")
        .rename({"p": end})
        for end, count, second in ((PUBLISHER, "publishers", False), (SUBSCRIBER, "subscribers", True))
    ]
    pairs = ends[0].join(ends[1], on=TOPIC)

    def column(each: Column) -> nw.Expr:
        return nw.col(column_name(judge, each))

    asked = []
    for at, rule in enumerate(judge.rules):
        undecided = nw.when(expression(rule.unknown, column)).then(2).otherwise(0)
        asked.append(nw.when(expression(rule.reports, column)).then(1).otherwise(undecided).alias(f"r{at}"))
    found = pairs.with_columns(*asked) if asked else pairs
    count = nw.col("publishers").cast(nw.Int64) * nw.col("subscribers").cast(nw.Int64)
    found = found.with_columns(count.alias("pairs"))
    answered = [nw.col(f"r{at}") > 0 for at in range(len(asked))]
    worth = nw.any_horizontal(*answered, ignore_nulls=False) if answered else nw.col("pairs") < 0
    answers = [f"r{at}" for at in range(len(asked))]
    return found.filter(worth).select(*TOPIC, PUBLISHER, SUBSCRIBER, "publishers", "subscribers", "pairs", *answers)


def _verdict(rule: RuleForm, *, unknown: bool) -> Verdict:
    return verdict_by(rule.bound.rule, unknown=unknown)


def _of_pairs(said: Frame, judge: Judge) -> Iterator[Frame]:
    """Yield the findings of each rule."""
    for at, rule in enumerate(judge.rules):
        for answer in (1, 2):
            severity = str(rule.bound.severity)
            verdict = _verdict(rule, unknown=answer == 2)  # noqa: PLR2004 - not decided
            yield said.filter(nw.col(f"r{at}") == answer).with_columns(
                nw.lit(rule.bound.rule.code).alias("code"),
                nw.lit("warning" if answer == 2 and severity == "error" else severity).alias("severity"),  # noqa: PLR2004 - likewise
                nw.lit(verdict.value).alias("verdict"),
            )


def _of_ends(every: Frame, profiles: FleetProfiles, store: TableStore, alone: Sequence[int]) -> Frame:
    """Return the findings about single profiles, by topic."""
    rows = [(at, each) for at in alone for each in profiles.known[at].remarks]
    said = store.put(
        "remarks",
        {
            "p": ("number", [at for at, _ in rows]),
            "code": ("text", [each.code for _, each in rows]),
            "severity": ("text", [each.severity for _, each in rows]),
        },
    )
    counted = every.join(said, on="p").group_by("system", "topic", "p", "code", "severity")
    found = counted.agg(nw.col("publishers").sum().cast(nw.Int64), nw.col("subscribers").sum().cast(nw.Int64))
    return found.with_columns(
        nw.lit("").alias("verdict"),
        nw.lit(0).alias("pairs"),
        *[
            nw.when(nw.col(count) > 0).then(nw.col("p")).otherwise(-1).alias(end)
            for end, count in ((PUBLISHER, "publishers"), (SUBSCRIBER, "subscribers"))
        ],
    )


def _routed(topics: Frame, profiles: FleetProfiles) -> Frame:
    """Leave to Python the topics that fall into parts that never match, where a check reports that."""
    parts = topics.group_by("system", "topic").agg(nw.len().alias("parts"), nw.col("route").max().alias("worst"))
    several = parts.filter(nw.col("parts") > 1)
    if "note" not in profiles.severities:
        several = several.filter(nw.col("worst") == ALONE)
    found = topics.join(several, on=["system", "topic"], how="left")
    route = nw.when(nw.col("parts").is_null()).then(nw.col("route")).otherwise(PYTHON)
    return found.with_columns(route.alias("route")).select(*TOPIC, "publishers", "subscribers", "route")


def _totals(
    topics: Frame, said: Frame, judge: Judge, verdicts: dict[str, int], profiles: FleetProfiles
) -> dict[str, int]:
    """Return how many endpoints, topics and profiles there are, and how many pairs have which verdict."""
    count = nw.col("publishers").cast(nw.Int64) * nw.col("subscribers").cast(nw.Int64)
    in_columns = nw.when(nw.col("route") < PYTHON).then(count).otherwise(0)
    sums = topics.select(
        (nw.col("publishers") + nw.col("subscribers")).sum().cast(nw.Int64).alias("endpoints"),
        nw.len().alias("topics"),
        in_columns.sum().cast(nw.Int64).alias("pairs"),
    )
    row = sums.collect("pyarrow").to_native().to_pylist()[0]
    found = {"endpoints": int(row["endpoints"] or 0), "topics": int(row["topics"]), "profiles": len(profiles.known)}
    ranks = [
        nw.when(nw.col(f"r{at}") == answer).then(_verdict(rule, unknown=answer == 2).rank).otherwise(0)  # noqa: PLR2004 - not decided
        for at, rule in enumerate(judge.rules)
        for answer in (1, 2)
    ]
    ranked = (
        said.with_columns(nw.max_horizontal(nw.lit(0), *ranks).alias("rank"))
        .group_by("rank")
        .agg(nw.col("pairs").sum().cast(nw.Int64))
    )
    by_rank = {int(each["rank"]): int(each["pairs"]) for each in ranked.collect("pyarrow").to_native().to_pylist()}
    for verdict in (Verdict.INCOMPATIBLE, Verdict.UNKNOWN):
        found[verdict.value] = by_rank.get(verdict.rank, 0) + verdicts.get(verdict.value, 0)
    decided = by_rank.get(Verdict.INCOMPATIBLE.rank, 0) + by_rank.get(Verdict.UNKNOWN.rank, 0)
    found[Verdict.COMPATIBLE.value] = int(row["pairs"] or 0) - decided + verdicts.get(Verdict.COMPATIBLE.value, 0)
    return found
