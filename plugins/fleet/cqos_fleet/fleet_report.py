"""What an audit says: findings summed up by rule, the order of updates, as text, JSON and Parquet."""

from __future__ import annotations

import json
import re
from itertools import combinations
from secrets import token_hex
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import narwhals as nw

from cqos_core.model.finding import Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_fleet.profiles import NO_SETTINGS, setting_name
from cqos_fleet.topic_frames import rows_of, summed

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from cqos_core.matching.pipeline import CheckContext
    from cqos_fleet.audit import Audited
    from cqos_fleet.table_store import TableStore

    Frame = nw.LazyFrame[Any]

_ROLES: Final = (PUBLISHER, SUBSCRIBER)
_MOST_EXAMPLES: Final = 3
_MOST_VERSIONS: Final = 12


class Cause(NamedTuple):
    """What a rule found: on how many topics and pairs, how many of these are between versions, and some of the topics.

    ``endpoints`` counts those of findings that are about endpoints and no pairs.
    """

    code: str
    severity: str
    topics: int
    pairs: int
    endpoints: int
    between_versions: int
    examples: tuple[tuple[str, Mapping[str, str], Mapping[str, str], str], ...]


class Update(NamedTuple):
    """In which order to update topics from one version to another; each is a number of topics.

    Attributes:
        old, new: the versions.
        publishers_first: a subscriber of the new version is incompatible with a publisher of the old one.
        subscribers_first: the other way round.
        at_once: both.
        unavoidable: two ends of the new version are incompatible, too.
    """

    old: str
    new: str
    publishers_first: int
    subscribers_first: int
    at_once: int
    unavoidable: int


class FleetResult(NamedTuple):
    """What an audit found."""

    totals: Mapping[str, int]
    causes: tuple[Cause, ...]
    updates: tuple[Update, ...] = ()


def summed_up(found: Audited, store: TableStore) -> FleetResult:
    """Return findings summed up by rule, and the order of updates."""
    versions = store.put(
        "versions",
        {
            "number": ("number", [*range(-1, len(found.texts))]),
            "version": ("text", ["", *[each.get("version", "") for each in found.texts]]),
        },
    )
    order = {"error": 0, "warning": 1, "note": 2}
    several = len({each.get("version", "") for each in found.texts}) > 1
    both = found.findings
    for end in _ROLES:
        if several:
            both = both.join(versions.rename({"number": end, "version": f"{end}_version"}), on=end, how="left")
        else:
            both = both.with_columns(nw.lit("").alias(f"{end}_version"))
    causes = sorted(_causes(found, both, store), key=lambda each: (order[each.severity], each.code))
    return FleetResult(found.totals, tuple(causes), tuple(_updates(both, store)) if several else ())


def _causes(found: Audited, both: Frame, store: TableStore) -> Iterator[Cause]:
    """Yield what each rule found."""
    mixed = (nw.col("publisher") >= 0) & (nw.col("subscriber") >= 0)
    mixed = mixed & (nw.col("publisher_version") != nw.col("subscriber_version"))
    counted = both.with_columns(nw.when(mixed).then(nw.col("pairs")).otherwise(0).alias("mixed"))
    ends = nw.col("publishers") + nw.col("subscribers")
    by_topic = counted.group_by("code", "severity", "system", "topic").agg(
        *summed("pairs", "mixed"),
        nw.when(nw.col("pairs") == 0).then(ends).otherwise(0).sum().cast(nw.Int64).alias("endpoints"),
        nw.col("help").max(),
    )
    by_topic = store.keep("by_topic", by_topic)
    sums = by_topic.group_by("code", "severity").agg(nw.len().alias("topics"), *summed("pairs", "mixed", "endpoints"))
    shown = {}
    for row in rows_of(sums):
        here = by_topic.filter((nw.col("code") == row["code"]) & (nw.col("severity") == row["severity"]))
        by = ("help", "pairs", "endpoints", "topic", "system")
        rows = here.sort(*by, descending=[True, True, True, False, False]).head(_MOST_EXAMPLES)
        shown[row["code"], row["severity"]] = row, [tuple([each[name] for name in _SHOWN]) for each in rows_of(rows)]
    profiles = _examples(found, [each for _, listed in shown.values() for each in listed], store)
    for (code, severity), (row, listed) in shown.items():
        examples = tuple(
            (
                f"{each[2]}: {each[3]}" if each[2] else each[3],
                *(_stated(found.texts, number) for number in profiles[each]),
                each[4],
            )
            for each in listed
        )
        topics, pairs, endpoints, mixed_pairs = (int(row[each]) for each in ("topics", "pairs", "endpoints", "mixed"))
        yield Cause(code, severity, topics, pairs, endpoints, mixed_pairs, examples)


_SHOWN: Final = ("code", "severity", "system", "topic", "help")


def _examples(
    found: Audited, shown: Sequence[tuple[str, ...]], store: TableStore
) -> dict[tuple[str, ...], tuple[int, int]]:
    """Return the profiles of one finding for each of some topics: both of one row, for those of two rows may well fit."""
    if not shown:
        return {}
    # One number for the two, as the largest of a number is what any engine has.
    many = len(found.texts) + 1
    both = ((nw.col("publisher") + 1) * many + nw.col("subscriber") + 1).max().alias("both")
    columns = dict(zip(_SHOWN, zip(*shown, strict=True), strict=True))
    wanted = store.put("shown", {name: ("text", [*texts]) for name, texts in columns.items()})
    rows = found.findings.join(wanted, on=[*_SHOWN], how="semi").group_by(*_SHOWN).agg(both)
    return {
        tuple([row[name] for name in _SHOWN]): (row["both"] // many - 1, row["both"] % many - 1)
        for row in rows_of(rows)
    }


def _updates(both: Frame, store: TableStore) -> Iterator[Update]:
    """Yield in which order to update, for each two versions between which pairs are incompatible."""
    ends = ["publisher_version", "subscriber_version"]
    broken = both.filter((nw.col("verdict") == Verdict.INCOMPATIBLE.value) & (nw.col("publisher") >= 0))
    broken = broken.filter(nw.col("subscriber") >= 0).group_by("system", "topic", *ends).agg(nw.len().alias("number"))
    broken = store.keep("broken", broken)
    named = {row[end] for row in rows_of(broken.group_by(*ends).agg(nw.len().alias("number"))) for end in ends}
    topic = ["system", "topic"]

    def between(offered: str, requested: str) -> Frame:
        here = (nw.col(ends[0]) == offered) & (nw.col(ends[1]) == requested)
        return broken.filter(here).select(*topic)

    def count(frame: Frame) -> int:
        return int(rows_of(frame.select(nw.len().alias("number")))[0]["number"])

    for old, new in combinations(sorted(named, key=_natural)[-_MOST_VERSIONS:], 2):
        forward, backward, always = between(old, new), between(new, old), between(new, new)
        either = nw.concat([forward, backward], how="vertical").group_by(*topic).agg(nw.len().alias("number"))
        left, right = (each.join(always, on=topic, how="anti") for each in (forward, backward))
        found = Update(
            old,
            new,
            count(left.join(right, on=topic, how="anti")),
            count(right.join(left, on=topic, how="anti")),
            count(left.join(right, on=topic, how="semi")),
            count(either.join(always, on=topic, how="semi")),
        )
        if any(found[2:]):
            yield found


def _natural(version: str) -> list[tuple[int, str]]:
    """Sort versions by their numbers."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.findall(r"\d{1,18}|\D+", version)]


def _stated(known: Sequence[Mapping[str, str]], number: int) -> dict[str, str]:
    """Return what a profile states, as texts by name."""
    if number < 0:
        return {}
    stated = {name: text for name, text in known[number].items() if text}
    return {setting_name(name): text for name, text in stated.items() if name == "profile" or name not in NO_SETTINGS}


OUTPUTS: Final = (".parquet", ".csv", ".ndjson", ".jsonl")
"""Endings of files for findings; each is a format."""


def write_findings(found: Audited, store: TableStore, output: Path) -> None:
    """Write the findings as one file, whole or not at all, with what their profiles state as JSON; the ending decides the format."""
    import pyarrow as pa

    store.keep("written", found.findings)
    texts = [json.dumps(_stated(found.texts, at), sort_keys=True) for at in range(len(found.texts))]
    target = output.resolve()  # a link stays a link
    part = target.with_name(f".{target.name[:100]}.{token_hex(8)}.part")
    writer = None
    try:
        for table in store.tables("written"):
            for end in _ROLES:
                said = [texts[at] if at >= 0 else "" for at in table[end].to_pylist()]
                table = table.append_column(f"{end}_settings", pa.array(said, pa.string()))  # noqa: PLW2901 - with more columns
            writer = writer or _writer(output.suffix.lower(), part, table.schema)
            writer.write_table(table)
        if writer is not None:
            writer.close()
            part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def _writer(suffix: str, path: Path, schema: Any) -> Any:
    from pyarrow import csv, parquet

    if suffix == ".parquet":
        return parquet.ParquetWriter(path, schema)
    return csv.CSVWriter(path, schema) if suffix == ".csv" else _Lines(path)


class _Lines:
    """Writes a JSON object for each row."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("x", encoding="utf-8", newline="\n")

    def write_table(self, table: Any) -> None:
        self._file.writelines(f"{json.dumps(row)}\n" for row in table.to_pylist())

    def close(self) -> None:
        self._file.close()


def as_text(result: FleetResult, where: CheckContext) -> str:
    """Return a result for people."""
    lines = []
    for each in result.causes:
        rule = where.find_rule(each.code)
        name = f" {rule.name}" if rule is not None else ""
        pairs = _count(each.pairs, "pair") if each.pairs else _count(each.endpoints, "endpoint")
        mixed = f", {each.between_versions:,} of them between versions" if each.between_versions else ""
        lines.append(f"{each.severity} {each.code}{name}: {_count(each.topics, 'topic')}, {pairs}{mixed}")
        for topic, offered, requested, meant in each.examples:
            ends = [f"{end} {_listed(texts)}" for end, texts in zip(_ROLES, (offered, requested), strict=True) if texts]
            said = "; ".join([*ends, *([meant] if meant else [])])
            lines.append(f"    {topic}{': ' if said else ''}{said}")
    lines += _orders(result.updates)
    totals = result.totals
    sums = ", ".join(f"{totals.get(each, 0):,} {each}" for each in ("compatible", "incompatible", "unknown"))
    counts = ", ".join(_count(totals.get(each + "s", 0), each) for each in ("endpoint", "topic", "profile"))
    return "\n".join([*lines, f"{counts}; pairs: {sums}"]) + "\n"


def _orders(updates: Iterable[Update]) -> Iterator[str]:
    for each in updates:
        said = [
            f"{words} {_count(number, 'topic')}"
            for number, words in (
                (each.publishers_first, "update publishers first on"),
                (each.subscribers_first, "update subscribers first on"),
                (each.at_once, "update both ends at once on"),
                (each.unavoidable, "no order helps on"),
            )
            if number
        ]
        yield f"from version {each.old or '(none)'} to {each.new or '(none)'}: {'; '.join(said)}"


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def _listed(texts: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {text}" for name, text in texts.items()) or "with defaults"


def as_json(result: FleetResult) -> str:
    """Return a result for programs, version 1."""
    names = ("topic", *_ROLES, "help")
    findings = [
        {**each._asdict(), "examples": [dict(zip(names, e, strict=True)) for e in each.examples]}
        for each in result.causes
    ]
    updates = [each._asdict() for each in result.updates]
    stated = {"version": 1, "totals": dict(result.totals), "findings": findings, "updates": updates}
    return json.dumps(stated, indent=2) + "\n"
