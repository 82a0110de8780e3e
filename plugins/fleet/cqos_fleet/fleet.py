"""An audit from its source to its result: which protocols a table has, how each is checked, where stages are kept."""

from __future__ import annotations

import hashlib
import json
import re
import tempfile
from collections import Counter
from contextlib import contextmanager, nullcontext
from glob import glob
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import narwhals as nw

from cqos_core.files.atomic_writes import is_same_file
from cqos_core.files.folder_walk import walk
from cqos_core.files.ignore_patterns import read_ignore_patterns
from cqos_core.files.path_loader import load_paths
from cqos_core.matching.pipeline import with_options
from cqos_core.model.finding import plural
from cqos_core.model.problems import CqosError
from cqos_core.model.spelling import nearest
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.completion import nothing_follows, nothing_summed
from cqos_fleet.audit import STAGES, Audited, audit
from cqos_fleet.cross_protocol import crossing_topics
from cqos_fleet.engines import DOT, FORMATS, DuckDB, Polars, Spark
from cqos_fleet.fleet_report import OUTPUTS, FleetResult, summed_up, write_findings
from cqos_fleet.folded_audit import FOLDED_STAGES, audit_folded
from cqos_fleet.profiles import NO_SETTINGS, FleetProfiles, pack_knows, setting_name
from cqos_fleet.table_store import TableStore
from cqos_fleet.topic_frames import FINDING, finding_columns
from cqos_fleet.whole_systems import NamedSystem, WholeSystems, systems_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.settings import Setting
    from cqos_core.packs.pack import RulePack

    Frame = nw.LazyFrame[Any]

_ROLES: Final = (PUBLISHER, SUBSCRIBER)


class WantedAudit(NamedTuple):
    """What is asked of an audit.

    Attributes:
        path: of the table, or its name on a cluster; or of a system file or a folder of them.
        table: within a database.
        spark: the URL of a cluster, or nothing.
        engine: ``duckdb`` or ``polars``.
        memory: the most that DuckDB may use; empty: its own default.
        work: where stages are kept; None: in a folder that is removed.
        output: where findings are written, as its ending says; None: nowhere.
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


def run_audit(
    wanted: WantedAudit, where: CheckContext, step: Callable[[str, int], None] = lambda _, __: None
) -> FleetResult:
    """Check a table of endpoints, or the systems of files.

    Args:
        wanted: what is asked.
        where: the packs.
        step: called before each stage, with what it does and how many there are.

    Raises:
        CqosError: the source cannot be read, has no such columns, or a protocol has no pack.
    """
    _refuse_unusable(wanted, where)
    kept = tempfile.TemporaryDirectory(prefix="cqos-audit-") if wanted.work is None else nullcontext(str(wanted.work))
    with kept as folder, _engine(wanted, Path(folder)) as engine:
        suffix = Path(wanted.path).suffix.lower()
        if not wanted.spark and Path(wanted.path).exists() and suffix not in FORMATS:
            store = TableStore(engine, _stages(Path(folder), wanted, ()))
            step("checking systems", 1)
            parts = [_as_wholes("of_systems", _systems_of_files(wanted, where), wanted, where, store)]
        else:
            opened = engine.source(wanted.path, wanted.table)
            source, stated = _read(opened, wanted)
            files = opened.to_native().inputFiles() if wanted.spark else []
            store = TableStore(engine, _stages(Path(folder), wanted, [*stated, *sorted(files)]))
            if suffix in _READ_ONCE and not wanted.spark:
                source = store.keep("rows", source)
            parts = _audited(source, stated, wanted, where, store, step)
        found = _together(parts, store)
        if wanted.output is not None:
            write_findings(found, store, wanted.output)
        return summed_up(found, store)


def _refuse_unusable(wanted: WantedAudit, where: CheckContext) -> None:
    """Refuse paths and options that cannot work before anything is read."""
    path, output, work = Path(wanted.path), wanted.output, wanted.work
    if not (wanted.spark or path.exists() or "*" in wanted.path):
        raise CqosError(f"`{path}`: there is no such file or folder")
    if wanted.spark and not _MASTER.fullmatch(wanted.spark):
        raise CqosError(
            f"`--spark {wanted.spark}` is no cluster", "write spark://HOST:PORT, k8s://HOST:PORT, yarn or local[N]"
        )
    if path.is_file() and not path.stat().st_size:
        raise CqosError(f"`{path}` is empty", "write a first line with the names of columns")
    if output is not None and not output.absolute().parent.is_dir():
        raise CqosError(f"`--findings {output}`: there is no folder `{output.parent}`", "make the folder")
    if output is not None and output.is_dir():
        raise CqosError(f"`--findings {output}` is a folder", "name a file")
    if output is not None and output.suffix.lower() not in OUTPUTS:
        kind = f"`{output.suffix}`" if output.suffix else "a name without an ending"
        raise CqosError(
            f"`--findings {output}`: no format of findings has {kind}", f"write one of {', '.join(OUTPUTS)}"
        )
    if output is not None and _is_read(output, wanted.path):
        raise CqosError(f"`--findings {output}` is a part of `{path}` and would be overwritten", "name another file")
    if work is not None and work.exists() and not work.is_dir():
        raise CqosError(f"`--work {work}` is a file", "name a folder")
    for name in wanted.options:
        _pack(name, where)


_MASTER: Final = re.compile(r"(spark|k8s)://.+|yarn|local(\[.+\])?")
_READ_ONCE: Final = (".csv", ".tsv", ".ndjson", ".jsonl")
"""Formats that take longer to read than Parquet; what they hold is kept as that."""


def _audited(
    source: Frame,
    stated: Sequence[str],
    wanted: WantedAudit,
    where: CheckContext,
    store: TableStore,
    step: Callable[[str, int], None],
) -> list[Audited]:
    """Check each protocol of a table in its own way; ``stated`` are the columns that the table has itself."""
    names = [name for name in source.collect_schema().names() if name not in _NOT_RESOLVED]
    keys = ["protocol", *[name for name in names if name != "protocol"]]
    texts = _texts(source, keys, where, store)
    packs, used = _protocols(store, wanted, where)
    _refuse_without_topic(source, wanted, store)
    crossing = crossing_topics(source, packs, wanted.options, where, store)
    in_columns = [name for name, pack in packs.items() if _has_column_form(pack)]
    folded = [name for name, pack in packs.items() if name not in in_columns and pack.system_facts.folding is not None]
    rest = [name for name in packs if name not in {*in_columns, *folded}]
    stages = len(STAGES) * len(in_columns) + len(FOLDED_STAGES) * len(folded) + bool(rest or crossing is not None)
    for name in [*folded, *rest] if "participant" not in stated else ():
        raise CqosError(
            f"{packs[name].title} needs a column `participant`: values follow from all endpoints of a client",
            "add the column",
        )
    found = []
    for name in [*in_columns, *folded]:
        pack = packs[name]
        own = source if len(packs) == 1 else source.filter(nw.col("protocol") == name)
        if crossing is not None:
            own = own.join(crossing, on=["protocol", "system", "topic"], how="anti")
        other = [each for each in names if each.startswith(DOT) and each not in used[name]]
        known = [each for each in other if pack_knows(pack, each)]
        inner = TableStore(store.engine, store.folder / _edition(pack))
        inner.folder.mkdir(exist_ok=True)
        own = own.drop("protocol", *[each for each in other if each not in known])
        options = wanted.options.get(name, {})
        if name in folded:
            found.append(
                audit_folded(own, pack, where, options, wanted.severity, inner, lambda what: step(what, stages))
            )
            continue
        profiles = FleetProfiles(pack, where, wanted.severity, options)
        of_pack = texts.filter(nw.col("protocol") == name)
        one_system = "system" not in stated
        found.append(audit(own, of_pack, profiles, inner, lambda what: step(what, stages), one_system=one_system))
    if rest or crossing is not None:
        step("checking systems", stages)
    wholes: dict[str, Frame] = {}
    if rest:
        wholes["rest"] = source.filter(nw.col("protocol").is_in(rest))
    if crossing is not None:
        wholes["crossing"] = source.join(crossing, on=["protocol", "system", "topic"], how="semi")
    for kind, rows in wholes.items():
        store.keep(f"{kind}_rows", rows.sort("system"))
        systems = systems_of(store.rows(f"{kind}_rows"), packs.__getitem__, wanted.options)
        found.append(_as_wholes(f"{kind}_findings", systems, wanted, where, store))
    return found


_NOT_RESOLVED: Final = ("id", "system", "participant", "topic")


def _as_wholes(
    name: str, systems: Iterable[NamedSystem], wanted: WantedAudit, where: CheckContext, store: TableStore
) -> Audited:
    """Check what has no column form, system by system; keep the findings as a table of this name."""
    whole = WholeSystems(where, wanted.severity)
    findings = store.fill(name, FINDING, whole.findings(systems))
    return Audited(whole.texts, findings, whole.totals)


def _together(parts: Sequence[Audited], store: TableStore) -> Audited:
    """Put findings of several audits into one table; the numbers of profiles follow each other."""
    if len(parts) == 1:
        return parts[0]
    texts: list[Mapping[str, str]] = []
    totals = Counter[str]()
    frames = []
    for each in parts:
        ends = [nw.when(nw.col(end) < 0).then(-1).otherwise(nw.col(end) + len(texts)).alias(end) for end in _ROLES]
        frames.append(each.findings.with_columns(*ends).select(*finding_columns()))
        texts += each.texts
        totals.update(each.totals)
    return Audited(texts, store.keep("all_findings", nw.concat(frames, how="vertical")), totals)


# Sources


@contextmanager
def _engine(wanted: WantedAudit, folder: Path) -> Iterator[DuckDB | Spark]:
    folder.mkdir(parents=True, exist_ok=True)
    kind = Polars if wanted.engine == "polars" else DuckDB
    engine = Spark(wanted.spark) if wanted.spark else kind(folder, wanted.memory)
    try:
        yield engine
    finally:
        engine.close()


def _read(frame: Frame, wanted: WantedAudit) -> tuple[Frame, list[str]]:
    """Return the columns as text, with the ones that have to be there; and those that the table has itself."""
    every = frame.collect_schema().names()
    names = [each for each in every if setting_name(each) not in wanted.skip]
    if absent := sorted({*wanted.skip} - {*map(setting_name, every)}):
        raise CqosError(
            f"`--exclude-column {absent[0]}`: `{wanted.path}` has no such column", f"it has {_listed(names)}"
        )
    missing = [each for each in ("role", "topic") if each not in names]
    if missing:
        like = [each for each in names if each.strip().lower() == missing[0]]
        meant = f"; did you write `{like[0]}`?" if like else ""
        raise CqosError(f"`{wanted.path}` has no column `{missing[0]}`", f"it has {_listed(names)}{meant}")
    blank = {"system": "", "version": "", "participant": "participant", "protocol": wanted.protocol or ""}
    if "protocol" not in names and wanted.protocol is None:
        raise CqosError(f"`{wanted.path}` has no column `protocol`", "write --protocol ID")
    texts = {each: nw.col(each).cast(nw.String).fill_null("") for each in names if each != "id"}
    if "protocol" in texts and wanted.protocol is not None:
        given = texts["protocol"]
        texts["protocol"] = nw.when(given == "").then(nw.lit(wanted.protocol)).otherwise(given)
    added = [nw.lit(text).alias(each) for each, text in blank.items() if each not in names]
    kept = [each.alias(name if name in NO_SETTINGS else f"{DOT}{name}") for name, each in texts.items()]
    return frame.select(*kept, *added), names


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(setting_name, names)) or "none"


def _refuse_without_topic(source: Frame, wanted: WantedAudit, store: TableStore) -> None:
    """Refuse rows that have no topic: nothing would say that they were left out."""
    # Few names begin with no letter, digit or sign of ASCII: only they are worth a look at each letter.
    topic = nw.col("topic")
    blank = source.filter(((topic < "!") | (topic > "~")) & (topic.str.strip_chars() == ""))
    store.keep("without_topic", blank.select(nw.len().cast(nw.Int64).alias("number")))
    for row in store.rows("without_topic"):
        if row["number"]:
            raise CqosError(
                f"`{wanted.path}`: no topic in {plural(row['number'], 'row')}", "fill it in, or leave such rows out"
            )


def _is_read(output: Path, path: str) -> bool:
    """Whether an output would replace a file that a path names, or become one of the files of a table."""
    source = Path(path)
    table = not source.is_dir() or source.suffix.lower() in FORMATS
    if table and source.is_dir() and source.resolve() in output.resolve().parents:
        return True
    # Findings of an earlier run may stand in a folder of systems: nothing reads them there.
    read = [str(each) for each in _files(path) if table or each.suffix.lower() not in OUTPUTS]
    return any(is_same_file(str(output), each) for each in read)


def _files(path: str) -> list[Path]:
    """Return the files of this machine that a path names."""
    named = [Path(path)] if Path(path).exists() else map(Path, glob(path))  # noqa: PTH207 - it may be absolute
    return sorted(each for one in named for each in ([one] if one.is_file() else _files_below(one)) if each.is_file())


def _files_below(folder: Path) -> Iterator[Path]:
    for inner, _, names in walk(str(folder), []):
        yield from (Path(inner, name) for name in names)


def _stamps(path: str) -> list[str]:
    """Return which files of this machine a path names, and when they were written."""
    return [f"{each} {each.stat().st_mtime_ns} {each.stat().st_size}" for each in _files(path)]


def _systems_of_files(wanted: WantedAudit, where: CheckContext) -> Iterator[NamedSystem]:
    """Yield the systems of files: those of a folder together, then each folder in it when its turn comes."""
    path, some = Path(wanted.path), False
    folders = (each for each in path.iterdir() if each.is_dir() and each.name[0] != ".") if path.is_dir() else ()
    # As in a check, links to folders are not followed: one may lead anywhere.
    inner = sorted(each for each in folders if not each.is_symlink())
    for each in (path, *inner):
        excluded = [read_ignore_patterns(["*/"], str(path))] if each == path and inner else []
        loaded = load_paths([str(each)], protocol=wanted.protocol, excluded=excluded)
        if loaded.problems:
            more = f" (and {len(loaded.problems) - 1} more)" if len(loaded.problems) > 1 else ""
            first = loaded.problems[0]
            raise CqosError(f"{first.place or each}: {first.message}{more}")
        for name, system in loaded.systems:
            some = True
            options = {pack: {key: one.text for key, one in given.items()} for pack, given in wanted.options.items()}
            yield NamedSystem(name, with_options(system, options, where))
    if not some:
        raise CqosError(f"`{wanted.path}` has no table ({', '.join(FORMATS)}) and no file that C-QoS reads")


# Protocols


def _texts(source: Frame, keys: Sequence[str], where: CheckContext, store: TableStore) -> Frame:
    """Return what rows of protocols in columns state, each once; keep which settings the rows of each protocol and role have."""
    store.keep("protocols", source.group_by("protocol").agg(nw.len().alias("number")))
    packs = {row["protocol"]: where.find_pack(row["protocol"]) for row in store.rows("protocols") if row["protocol"]}
    listed = [name for name, pack in packs.items() if pack is not None and _has_column_form(pack)]
    in_columns = nw.col("protocol").is_in(listed)
    every = len(listed) == len(packs)
    texts = source if every else source.filter(in_columns)
    parts = [] if every and listed else [source.filter(~in_columns)]
    if listed:
        texts = store.keep("texts", texts.group_by(*keys).agg(nw.len().alias("number")))
        parts.append(texts)
    settings = [name for name in keys if name.startswith(DOT)]
    stated = nw.concat([each.select("protocol", "role", *settings) for each in parts], how="vertical")
    store.keep("stated", stated.group_by("protocol", "role").agg(*[nw.col(each).max() for each in settings]))
    return texts


def _protocols(
    store: TableStore, wanted: WantedAudit, where: CheckContext
) -> tuple[dict[str, RulePack], dict[str, set[str]]]:
    """Return by protocol the pack and the columns of settings that its rows use."""
    packs: dict[str, RulePack] = {}
    used: dict[str, set[str]] = {}
    for row in store.rows("stated"):
        if row["role"] not in _ROLES:
            raise CqosError(f"`{wanted.path}`: role `{row['role']}`", "write publisher or subscriber")
        name = row["protocol"]
        if name not in packs:
            packs[name] = _pack(name, where)
            used[name] = set()
        columns = [each for each in row if each.startswith(DOT)]
        used[name].update(each for each in columns if row[each])
    for name, pack in packs.items():
        for column in columns:
            if not pack_knows(pack, column) and (
                column in used[name] or not any(pack_knows(p, column) for p in packs.values())
            ):
                shown = setting_name(column)
                near = nearest(shown, [each.name for each in pack.policies])
                meant = f"did you mean `{near}`? " if near else ""
                raise CqosError(
                    f"column `{shown}` names no policy of {pack.title}",
                    f"{meant}`--exclude-column {shown}` leaves it out",
                )
    if not packs:
        raise CqosError(f"`{wanted.path}` has no rows")
    return dict(sorted(packs.items())), used


def _pack(name: str, where: CheckContext) -> RulePack:
    pack = where.find_pack(name) if name else None
    if pack is None:
        known = ", ".join(sorted(where.known_packs))
        raise CqosError(f"no rule pack `{name}`", f"installed: {known}; --protocol ID states that of rows without one")
    return pack


def _has_column_form(pack: RulePack) -> bool:
    """Whether nothing follows from all endpoints of a participant together, and only equal names match."""
    return (
        pack.system_facts.complete is nothing_follows
        and pack.system_facts.sum_up is nothing_summed
        and pack.topic_matching.match is None
    )


# Stages


def _stages(folder: Path, wanted: WantedAudit, names: Sequence[str]) -> Path:
    """Return the folder of the stages of exactly this audit; ``names`` are those of columns, and of the files of a cluster."""
    said = [wanted.path, _stamps(wanted.path), wanted.table, wanted.protocol, wanted.severity, wanted.skip, names]
    options = {pack: {name: each.text for name, each in listed.items()} for pack, listed in wanted.options.items()}
    stated = json.dumps([said, options, wanted.engine, wanted.spark], default=str)
    found = folder / f"stages-{hashlib.sha256(stated.encode()).hexdigest()[:16]}"
    found.mkdir(exist_ok=True)
    return found


def _edition(pack: RulePack) -> str:
    """Return the folder of a pack's stages: another version of C-QoS, or of the pack's rules and defaults, has another one."""
    rules = [repr(each) for each in pack.rules]
    policies = [(each.name, *map(each.default_for, ("publisher", "subscriber"))) for each in pack.policies]
    stated = json.dumps([version("cqos-core"), rules, policies])
    return f"{pack.id}-{hashlib.sha256(stated.encode()).hexdigest()[:16]}"
