"""Engines of tables: each reads a source, and keeps tables as Parquet files of a folder. All else is Narwhals."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from cqos_core.model.problems import CqosError

if TYPE_CHECKING:
    import narwhals as nw

FORMATS: Final = (".parquet", ".csv", ".ndjson", ".jsonl", ".duckdb", ".db")


class Engine(Protocol):
    """What an engine has of its own."""

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:
        """Open the table of endpoints."""

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet."""

    def close(self) -> None:
        """Let go of it."""


class DuckDB:
    """DuckDB, embedded; what exceeds its memory goes to files in the folder."""

    def __init__(self, folder: Path, memory: str) -> None:
        """Open an own database in memory."""
        import duckdb

        settings: dict[str, Any] = {"temp_directory": str(folder / "spill"), "preserve_insertion_order": "false"}
        if memory:
            settings["memory_limit"] = memory
        try:
            self.database = duckdb.connect(config=settings)
        except duckdb.Error as error:
            raise CqosError(f"`--memory {memory}`: {str(error).splitlines()[0]}; expected a size such as 4GB") from None
        self.database.execute("SET enable_progress_bar = false")

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:
        """Open a file of `FORMATS`."""
        import duckdb
        import narwhals as nw

        suffix = Path(path).suffix.lower()
        try:
            if suffix in {".duckdb", ".db"}:
                self.database.execute(f"ATTACH '{_quoted(path)}' AS fleet (READ_ONLY)")
                found = self.database.table(f"fleet.{table}")
            elif suffix == ".parquet":
                found = self.database.read_parquet(path)
            elif suffix == ".csv":
                found = self.database.read_csv(path, all_varchar=True, header=True)
            else:
                found = self.database.read_json(path, format="newline_delimited")
        except duckdb.Error as error:
            raise CqosError(f"`{path}` cannot be read: {str(error).splitlines()[0]}") from None
        return nw.from_native(found)

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""
        import narwhals as nw

        return nw.from_native(self.database.read_parquet(str(path)))

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet."""
        frame.to_native().write_parquet(str(path))

    def close(self) -> None:
        """Close the database."""
        self.database.close()


class Polars:
    """Polars, in this process."""

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:  # noqa: ARG002 - a database has tables
        """Open a file; a database is none that it reads."""
        import narwhals as nw
        import polars as pl

        suffix = Path(path).suffix.lower()
        if suffix == ".parquet":
            return nw.from_native(pl.scan_parquet(path))
        if suffix == ".csv":
            return nw.from_native(pl.scan_csv(path, infer_schema=False))
        if suffix in {".ndjson", ".jsonl"}:
            return nw.from_native(pl.scan_ndjson(path))
        raise CqosError(f"`{path}`: Polars reads no such file; use DuckDB")

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""
        import narwhals as nw
        import polars as pl

        return nw.from_native(pl.scan_parquet(path))

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet."""
        frame.to_native().sink_parquet(path)

    def close(self) -> None:
        """Nothing stays open."""


class Spark:
    """A Spark cluster that is there; its workers read and write the folder."""

    def __init__(self, url: str) -> None:
        """Connect to ``spark://host:port``, or to ``local[2]``."""
        from pyspark.sql import SparkSession

        builder = SparkSession.builder.master(url).appName("cqos audit").config("spark.ui.enabled", "false")
        self.session = builder.config("spark.sql.ansi.enabled", "true").getOrCreate()

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:
        """Open a file, or a table that the cluster knows by name."""
        import narwhals as nw

        suffix = Path(path).suffix.lower()
        reader = self.session.read
        if suffix == ".parquet":
            found = reader.parquet(path)
        elif suffix == ".csv":
            found = reader.csv(path, header=True)
        elif suffix in {".ndjson", ".jsonl"}:
            found = reader.json(path)
        else:
            found = self.session.table(path if suffix == "" else table)
        return nw.from_native(found)

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""
        import narwhals as nw

        return nw.from_native(self.session.read.parquet(str(path)))

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet, a folder of files."""
        frame.to_native().write.mode("overwrite").parquet(str(path))

    def close(self) -> None:
        """End the application."""
        self.session.stop()


class TableStore:
    """The tables of one audit, as Parquet in a folder; a table that is there already is not made again."""

    def __init__(self, engine: Engine, folder: Path) -> None:
        """Keep tables of an engine in a folder."""
        self.engine = engine
        self.folder = folder

    def path(self, name: str) -> Path:
        """Return where a table is kept."""
        return self.folder / f"{name}.parquet"

    def keep(self, name: str, frame: nw.LazyFrame[Any]) -> nw.LazyFrame[Any]:
        """Keep a table; it appears under its name only when it is complete."""
        path = self.path(name)
        if not path.exists():
            part = self.folder / f"{name}.part"
            _remove(part)
            self.engine.write(frame, part)
            part.rename(path)
        return self.engine.scan(path)

    def put(self, name: str, columns: dict[str, tuple[str, list[Any]]]) -> nw.LazyFrame[Any]:
        """Keep a table of values from Python; each column with its kind, ``text`` or ``number``."""
        import pyarrow as pa
        from pyarrow import parquet

        kinds = {"text": pa.string(), "number": pa.int64()}
        fields = {key: pa.array(values, type=kinds[kind]) for key, (kind, values) in columns.items()}
        part = self.folder / f"{name}.part"
        _remove(part)
        parquet.write_table(pa.table(fields), part)
        _remove(self.path(name))
        part.rename(self.path(name))
        return self.engine.scan(self.path(name))

    def rows(self, name: str) -> Any:
        """Yield the rows of a kept table, as dictionaries, a bounded number at a time."""
        from pyarrow import dataset

        for batch in dataset.dataset(self.path(name), format="parquet").to_batches(batch_size=50_000):
            yield from batch.to_pylist()


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)


def _quoted(path: str) -> str:
    return path.replace("'", "''")
