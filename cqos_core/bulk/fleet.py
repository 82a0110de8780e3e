"""An audit from its source to its result: which protocols a table has, where stages are kept, what the result says."""

from __future__ import annotations

import hashlib
import json
import tempfile
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import narwhals as nw

from cqos_core.bulk.audit import Audited, audit
from cqos_core.bulk.engines import DuckDB, Polars, Spark, TableStore
from cqos_core.bulk.profiles import NO_SETTINGS, FleetProfiles
from cqos_core.model.installed import headers
from cqos_core.model.problems import CqosError
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Setting
from cqos_core.packs.parts import nothing_follows, nothing_summed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_core.bulk.engines import Engine
    from cqos_core.matching.pipeline import Context
    from cqos_core.packs.pack import RulePack

_ROLES: Final = (PUBLISHER, SUBSCRIBER)
_MOST_EXAMPLES: Final = 3


class WantedAudit(NamedTuple):
    """What is asked of an audit.

    Attributes:
        path: of the table, or its name on a cluster.
        table: within a database.
        spark: the URL of a cluster, or nothing.
        engine: ``duckdb`` or ``polars``.
        memory: the most that DuckDB may use; empty: its own default.
        work: where stages are kept; None: in a folder that is removed.
        output: where findings are written as Parquet; None: nowhere.
        protocol: of rows that state none.
        severity: the least that is reported.
        options: of packs, by id.
        skip: columns that are left out.
    """

    path: str
    table: str = "endpoints"
    spark: str = ""
    engine: str = "duckdb"
    memory: str = ""
    work: Path | None = None
    output: Path | None = None
    protocol: str | None = None
    severity: str = "warning"
    options: Mapping[str, Mapping[str, Setting]] = {}
    skip: tuple[str, ...] = ()


class Cause(NamedTuple):
    """What a rule found: on how many topics and pairs, how many of these are between versions, and some of the topics."""

    code: str
    severity: str
    topics: int
    pairs: int
    endpoints: int
    between_versions: int
    examples: tuple[tuple[str, Mapping[str, str], Mapping[str, str]], ...]


class FleetResult(NamedTuple):
    """What an audit found."""

    totals: Mapping[str, int]
    causes: tuple[Cause, ...]


def run_audit(wanted: WantedAudit, where: Context, step: Callable[[str], None] = lambda _: None) -> FleetResult:
    """Check a table of endpoints.

    Raises:
        CqosError: the table cannot be read, has no such columns, or a protocol has no pack or no column form.
    """
    kept = tempfile.TemporaryDirectory(prefix="cqos-audit-") if wanted.work is None else nullcontext(str(wanted.work))
    with kept as folder, _engine(wanted, Path(folder)) as engine:
        source = _read(engine.source(wanted.path, wanted.table), wanted)
        store = TableStore(engine, _stages(Path(folder), wanted, source))
        protocols = store.keep("protocols", source.select("protocol").unique())
        names = sorted(row["protocol"] for row in protocols.collect("pyarrow").to_native().to_pylist())
        totals: dict[str, int] = {}
        causes: list[Cause] = []
        for name in names:
            pack = _pack(name, names, where)
            profiles = FleetProfiles(pack, where, wanted.severity, wanted.options.get(pack.id, {}))
            own = source.filter(nw.col("protocol") == name).drop("protocol")
            inner = TableStore(engine, store.folder / _edition(pack))
            inner.folder.mkdir(exist_ok=True)
            found = audit(own, profiles, inner, step)
            for key, number in found.totals.items():
                totals[key] = totals.get(key, 0) + number
            causes += _causes(found, inner)
            if wanted.output is not None:
                _write(
                    found, inner, wanted.output if len(names) == 1 else wanted.output.with_suffix(f".{name}.parquet")
                )
        order = {"error": 0, "warning": 1, "note": 2}
        return FleetResult(totals, tuple(sorted(causes, key=lambda each: (order[each.severity], each.code))))


@contextmanager
def _engine(wanted: WantedAudit, folder: Path) -> Iterator[Engine]:
    folder.mkdir(parents=True, exist_ok=True)
    engine: Engine
    if wanted.spark:
        engine = Spark(wanted.spark)
    else:
        engine = Polars() if wanted.engine == "polars" else DuckDB(folder, wanted.memory)
    try:
        yield engine
    finally:
        engine.close()


def _read(frame: nw.LazyFrame[Any], wanted: WantedAudit) -> nw.LazyFrame[Any]:
    """Return the columns as text, with the ones that have to be there."""
    names = [each for each in frame.collect_schema().names() if each not in wanted.skip]
    missing = [each for each in ("role", "topic") if each not in names]
    if missing:
        raise CqosError(f"`{wanted.path}` has no column `{missing[0]}`; it has {', '.join(names) or 'none'}")
    blank = {"system": "", "version": "", "participant": "participant", "protocol": wanted.protocol or ""}
    if "protocol" not in names and wanted.protocol is None:
        raise CqosError(f"`{wanted.path}` has no column `protocol`; state the protocol with `--protocol`")
    texts = [nw.col(each).cast(nw.String).fill_null("").alias(each) for each in names if each != "id"]
    added = [nw.lit(text).alias(each) for each, text in blank.items() if each not in names]
    found = frame.select(*texts, *added)
    wrong = (
        found.filter(~nw.col("role").is_in(_ROLES)).select("role").head(1).collect("pyarrow").to_native().to_pylist()
    )
    if wrong:
        raise CqosError(f"`{wanted.path}`: role `{wrong[0]['role']}`, expected publisher or subscriber")
    return found


def _stages(folder: Path, wanted: WantedAudit, source: nw.LazyFrame[Any]) -> Path:
    """Return the folder of the stages of exactly this audit."""
    path = Path(wanted.path)
    stamp = [path.stat().st_mtime_ns, path.stat().st_size] if path.exists() else []
    said = [
        wanted.path,
        stamp,
        wanted.table,
        wanted.protocol,
        wanted.severity,
        wanted.skip,
        source.collect_schema().names(),
    ]
    options = {pack: {name: each.text for name, each in listed.items()} for pack, listed in wanted.options.items()}
    name = hashlib.sha256(json.dumps([said, options, wanted.engine, wanted.spark], default=str).encode()).hexdigest()[
        :16
    ]
    found = folder / f"stages-{name}"
    found.mkdir(exist_ok=True)
    return found


def _edition(pack: RulePack) -> str:
    """Return the folder of a pack's stages: another version of C-QoS, or of the pack's rules and defaults, has another one."""
    rules = [repr(each) for each in pack.rules]
    policies = [(each.name, *map(each.default_for, ("publisher", "subscriber"))) for each in pack.policies]
    stated = json.dumps([headers("cqos-core")["Version"], rules, policies])
    return f"{pack.id}-{hashlib.sha256(stated.encode()).hexdigest()[:16]}"


def _pack(name: str, names: Sequence[str], where: Context) -> RulePack:
    """Return the pack of a protocol, where endpoints of it can be checked without what follows from all of them together."""
    pack = where.find_pack(name) if name else None
    if pack is None:
        known = ", ".join(sorted(where.known_packs))
        raise CqosError(f"no rule pack `{name}`; installed: {known}. `--protocol` states that of rows without one")
    if pack.complete is not nothing_follows or pack.sum_up is not nothing_summed or pack.meeting.match is not None:
        raise CqosError(
            f"{pack.title} has values that follow from all endpoints of a participant together, and no column form for them; "
            "check its systems with `cqos check`"
        )
    if pack.wire is not None and pack.wire.protocol in names:
        raise CqosError(
            f"endpoints of `{name}` and `{pack.wire.protocol}` in one table may match; check them with `cqos check`"
        )
    return pack


def _causes(found: Audited, store: TableStore) -> list[Cause]:
    """Sum findings up by rule."""
    versions = store.put(
        "versions",
        {
            "number": ("number", [*range(-1, len(found.profiles.known))]),
            "version": ("text", ["", *[each.version for each in found.profiles.known]]),
        },
    )
    both = found.findings
    for end in _ROLES:
        both = both.join(versions.rename({"number": end, "version": f"{end}_version"}), on=end, how="left")
    mixed = (nw.col("publisher") >= 0) & (nw.col("subscriber") >= 0)
    mixed = mixed & (nw.col("publisher_version") != nw.col("subscriber_version"))
    counted = both.with_columns(nw.when(mixed).then(nw.col("pairs")).otherwise(0).alias("mixed"))
    by_topic = counted.group_by("code", "severity", "system", "topic").agg(
        nw.col("pairs").sum().cast(nw.Int64),
        nw.col("mixed").sum().cast(nw.Int64),
        (nw.col("publishers") + nw.col("subscribers")).sum().cast(nw.Int64).alias("endpoints"),
        nw.col("publisher").max(),
        nw.col("subscriber").max(),
    )
    by_topic = store.keep("by_topic", by_topic)
    sums = by_topic.group_by("code", "severity").agg(
        nw.len().alias("topics"),
        *[nw.col(each).sum().cast(nw.Int64) for each in ("pairs", "mixed", "endpoints")],
    )
    causes = []
    for row in sums.collect("pyarrow").to_native().to_pylist():
        here = by_topic.filter((nw.col("code") == row["code"]) & (nw.col("severity") == row["severity"]))
        rows = here.sort("pairs", "endpoints", "topic", descending=[True, True, False]).head(_MOST_EXAMPLES)
        examples = tuple(
            (each["topic"], _stated(found.profiles, each["publisher"]), _stated(found.profiles, each["subscriber"]))
            for each in rows.collect("pyarrow").to_native().to_pylist()
        )
        topics, pairs, endpoints, mixed_pairs = (int(row[each]) for each in ("topics", "pairs", "endpoints", "mixed"))
        causes.append(Cause(row["code"], row["severity"], topics, pairs, endpoints, mixed_pairs, examples))
    return causes


def _stated(profiles: FleetProfiles, number: int) -> dict[str, str]:
    """Return what a profile states, as texts by name."""
    if number < 0:
        return {}
    texts = profiles.known[number].texts
    return {name: text for name, text in texts.items() if text and (name == "profile" or name not in NO_SETTINGS)}


def _write(found: Audited, store: TableStore, output: Path) -> None:
    """Write the findings as one Parquet file, with what their profiles state as JSON."""
    import pyarrow as pa
    from pyarrow import dataset, parquet

    texts = [json.dumps(_stated(found.profiles, at), sort_keys=True) for at in range(len(found.profiles.known))]
    part = output.with_name(f"{output.name}.part")
    writer = None
    try:
        for batch in dataset.dataset(store.path("findings"), format="parquet").to_batches(batch_size=100_000):
            table = pa.Table.from_batches([batch])
            for end in _ROLES:
                said = [texts[at] if at >= 0 else "" for at in table[end].to_pylist()]
                table = table.append_column(f"{end}_settings", pa.array(said, pa.string()))
            writer = writer or parquet.ParquetWriter(part, table.schema)
            writer.write_table(table)
    finally:
        if writer is not None:
            writer.close()
    if writer is not None:
        part.rename(output)


def as_text(result: FleetResult, where: Context) -> str:
    """Return a result for people."""
    lines = []
    for each in result.causes:
        rule = where.find_rule(each.code)
        name = f" {rule.name}" if rule is not None else ""
        pairs = _count(each.pairs, "pair") if each.pairs else _count(each.endpoints, "endpoint")
        mixed = f", {each.between_versions:,} of them between versions" if each.between_versions else ""
        lines.append(f"{each.severity} {each.code}{name}: {_count(each.topics, 'topic')}, {pairs}{mixed}")
        for topic, offered, requested in each.examples:
            ends = [f"{end} {_listed(texts)}" for end, texts in zip(_ROLES, (offered, requested), strict=True) if texts]
            lines.append(f"    {topic}{': ' if ends else ''}{'; '.join(ends)}")
    totals = result.totals
    sums = ", ".join(f"{totals.get(each, 0):,} {each}" for each in ("compatible", "incompatible", "unknown"))
    counts = ", ".join(_count(totals.get(each + "s", 0), each) for each in ("endpoint", "topic", "profile"))
    return "\n".join([*lines, f"{counts}; pairs: {sums}"]) + "\n"


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def _listed(texts: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {text}" for name, text in texts.items()) or "with defaults"


def as_json(result: FleetResult) -> str:
    """Return a result for programs, version 1."""
    findings = [
        {**each._asdict(), "examples": [dict(zip(("topic", *_ROLES), e, strict=True)) for e in each.examples]}
        for each in result.causes
    ]
    return json.dumps({"version": 1, "totals": dict(result.totals), "findings": findings}, indent=2) + "\n"
