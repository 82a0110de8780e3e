"""The two passes over topics as frames: extremes of all endpoints of a topic, and the pairs of its profiles."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import narwhals as nw

from cqos_core.matching.judge import verdict_by
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_fleet.rule_evaluation import Judge, column_name
from cqos_fleet.slow_topics import ALONE, COLUMNS, PYTHON, QUIET
from cqos_fleet.writers import expression

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_fleet.forms import Column

    Frame = nw.LazyFrame[Any]

TOPIC: Final = ["system", "topic", "part"]
COUNTS: Final = ["publishers", "subscribers"]
FINDING: Final = {
    "protocol": "text",
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
    "help": "text",
}
"""The columns of findings: `publisher` and `subscriber` are numbers of profiles, the others counts of endpoints and pairs."""
_REPORTS, _UNDECIDED = 1, 2


def finding_columns() -> list[nw.Expr]:
    """Return the columns of findings, each of its kind."""
    return [nw.col(name).cast(nw.String if kind == "text" else nw.Int64) for name, kind in FINDING.items()]


def summed(*names: str) -> list[nw.Expr]:
    """Return the sums of columns, as 64-bit numbers."""
    return [nw.col(each).sum().cast(nw.Int64) for each in names]


def routed_topics(ends: Frame, judge: Judge, *, one_system: bool = False, weighted: bool = False) -> Frame:
    """Return the topics, with what has to be asked about each: nothing, its pairs in columns, or all of it in Python.

    Column `example` is one of the profiles. An aggregate costs as much as a quarter of the bare grouping, so what is
    alike for all profiles has no aggregate.

    Args:
        ends: the endpoints, or groups of them, with the columns of their profiles.
        judge: the rules.
        one_system: all of them are of one system.
        weighted: they are groups, so that their numbers have to be added; to count rows takes half of that.
    """
    sides = [each for each in ("offering", "requesting") if _differs(judge, each)]
    asked = {column for rule in judge.rules for column in rule.quiet.reads()}
    named = [
        *[(column, column_name(judge, column)) for column in judge.columns if column in asked],
        *[(column, column_name(judge, column, matching=True)) for column in judge.matching_columns],
    ]
    fixed = {name: value for column, name in named for value in _constant(judge, name, column)}
    alike = {"system": ""} if one_system else {}
    if not _differs(judge, "part"):
        alike["part"] = judge.table["part"][1][0]
    found = ends.group_by(*[each for each in TOPIC if each not in alike]).agg(
        *(summed(*COUNTS) if weighted else _numbers_of_rows()),
        nw.col("example").max(),
        *[nw.col(name).min().alias(f"{name}_least") for name in sides],
        *[nw.col(name).max().alias(f"{name}_most") for name in sides],
        *[nw.col(name).max() if column.most else nw.col(name).min() for column, name in named if name not in fixed],
    )
    if alike:
        found = found.with_columns(*literals(alike))

    def column(each: Column, *, matching: bool = False) -> nw.Expr:
        name = column_name(judge, each, matching=matching)
        return fixed[name] if name in fixed else _value(judge, name)

    slow = nw.col("example") >= len(judge.table["p"][1])
    for name in sides:
        slow = slow | (nw.col(f"{name}_least") != nw.col(f"{name}_most")).fill_null(value=False)
    for rule in judge.matching:
        slow = slow | ~expression(rule.quiet, partial(column, matching=True)).fill_null(value=True)
    loud = nw.lit(value=False)
    for rule in judge.rules:
        loud = loud | ~expression(rule.quiet, column).fill_null(value=True)
    alone = (nw.col("publishers") == 0) | (nw.col("subscribers") == 0)
    in_columns = nw.when(alone).then(ALONE).otherwise(nw.when(loud).then(COLUMNS).otherwise(QUIET))
    route = nw.when(slow).then(PYTHON).otherwise(in_columns)
    example = nw.col("example").cast(nw.Int64) % len(judge.table["p"][1])
    part = nw.col("part").cast(nw.Int64)
    found = found.with_columns(route.alias("route"), example.alias("example"), part.alias("part"))
    return found.select(*TOPIC, *COUNTS, "example", "route")


def _numbers_of_rows() -> list[nw.Expr]:
    """Return how many rows have a value that only one end has."""
    ends = zip(("offering", "requesting"), COUNTS, strict=True)
    return [nw.col(each).count().cast(nw.Int64).alias(count) for each, count in ends]


def _differs(judge: Judge, name: str) -> bool:
    """Whether profiles have several known values in a column."""
    return len({each for each in judge.table[name][1] if each is not None}) > 1


def _value(judge: Judge, name: str) -> nw.Expr:
    """Return a column of values with room for sums."""
    return nw.col(name) if judge.table[name][0] == "text" else nw.col(name).cast(nw.Int64)


def _constant(judge: Judge, name: str, column: Column) -> Iterator[nw.Expr]:
    """Yield the value of a column, where all profiles of its end have the same, or none."""
    kind, cells = judge.table[name]
    own = {
        cell for cell, second in zip(cells, judge.table["subscribers"][1], strict=True) if bool(second) is column.second
    }
    if len(own) <= 1:
        value = next(iter(own), None)
        yield nw.lit(value).cast(nw.String if kind == "text" else nw.Int64)


def confirmed(groups: Frame, table: Frame, judge: Judge) -> Frame:
    """Return the pairs of profiles of a topic on which a rule reports: per rule 0, 1, or 2 where it is not decided.

    Profiles that all rules see alike are put together; the first of them stands for all.
    """
    names = [column_name(judge, column) for column in judge.columns]
    of_topic = groups.join(table.select("p", "alike"), on="p").group_by(*TOPIC, "alike")
    alike = of_topic.agg(*summed(*COUNTS), nw.col("p").min())
    ends = [
        alike.filter(nw.col(count) > 0)
        .select(*TOPIC, "p", count)
        .join(table.select("p", *[n for n, c in zip(names, judge.columns, strict=True) if c.second is second]), on="p")
        .rename({"p": end})
        for end, count, second in ((PUBLISHER, "publishers", False), (SUBSCRIBER, "subscribers", True))
    ]
    pairs = ends[0].join(ends[1], on=TOPIC)

    def column(each: Column) -> nw.Expr:
        return _value(judge, column_name(judge, each))

    asked = []
    for at, rule in enumerate(judge.rules):
        undecided = nw.when(expression(rule.unknown, column)).then(_UNDECIDED).otherwise(0)
        asked.append(nw.when(expression(rule.reports, column)).then(_REPORTS).otherwise(undecided).alias(f"r{at}"))
    found = pairs.with_columns(*asked) if asked else pairs
    found = found.with_columns((nw.col("publishers") * nw.col("subscribers")).alias("pairs"))
    answers = [f"r{at}" for at in range(len(asked))]
    answered = [nw.col(each) > 0 for each in answers]
    worth = nw.any_horizontal(*answered, ignore_nulls=False) if answered else nw.col("pairs") < 0
    return found.filter(worth).select(*TOPIC, PUBLISHER, SUBSCRIBER, *COUNTS, "pairs", *answers)


def of_pairs(said: Frame, judge: Judge) -> Iterator[Frame]:
    """Yield the findings of each rule."""
    for at, rule in enumerate(judge.rules):
        for answer in (_REPORTS, _UNDECIDED):
            severity, undecided = str(rule.bound.severity), answer == _UNDECIDED
            texts = {
                "code": rule.bound.rule.code,
                "severity": "warning" if undecided and severity == "error" else severity,
                "verdict": verdict_by(rule.bound.rule, unknown=undecided).value,
                "help": "",
            }
            yield said.filter(nw.col(f"r{at}") == answer).with_columns(*literals(texts))


def literals(values: Mapping[str, str | int]) -> list[nw.Expr]:
    """Return columns of one value each."""
    return [nw.lit(each).alias(name) for name, each in values.items()]


def verdicts_of(said: Frame, judge: Judge) -> dict[int, int]:
    """Return the pairs on which a rule reports, by rank of their verdict."""
    ranks = [
        nw.when(nw.col(f"r{at}") == answer)
        .then(verdict_by(rule.bound.rule, unknown=answer == _UNDECIDED).rank)
        .otherwise(0)
        for at, rule in enumerate(judge.rules)
        for answer in (_REPORTS, _UNDECIDED)
    ]
    # Two constants, as Spark knows no largest of one column.
    ranked = said.with_columns(nw.max_horizontal(nw.lit(0), nw.lit(0), *ranks).alias("rank"))
    return {int(each["rank"]): int(each["pairs"]) for each in rows_of(ranked.group_by("rank").agg(*summed("pairs")))}


def rows_of(frame: Frame) -> list[dict[str, Any]]:
    """Return the rows of a small table."""
    found: list[dict[str, Any]] = frame.collect("pyarrow").to_native().to_pylist()
    return found
