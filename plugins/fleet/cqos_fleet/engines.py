"""Engines of tables: each reads a source, and writes tables as Parquet files. All else is Narwhals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.problems import CqosError

if TYPE_CHECKING:
    import narwhals as nw

_TEXTS_OF_JSON: Final = "SELECT json_extract_string(COLUMNS(*), '$') FROM read_json('{path}', format='newline_delimited', maximum_depth=1, sample_size=-1)"
_PARQUET: Final = "SELECT * FROM read_parquet('{path}', hive_types_autocast = false)"
"""All values as they are written: DuckDB would take some for numbers and dates."""
DOT: Final = "\u2024"
"""What stands for a dot in the name of a column: engines take a dotted name for one column within another."""
FORMATS: Final = (".parquet", ".csv", ".tsv", ".ndjson", ".jsonl", ".duckdb", ".db")
_CSV: Final[dict[str, Any]] = {"all_varchar": True, "header": True, "skiprows": 0, "quotechar": '"', "comment": ""}
"""What DuckDB would guess: a `#` may begin a filter of MQTT."""
_SPARK: Final = {
    "ui.enabled": "false",
    "ui.showConsoleProgress": "false",
    "log.level": "ERROR",
    "sql.ansi.enabled": "true",
    "sql.csv.parser.columnPruning.enabled": "false",
}


class DuckDB:
    """DuckDB, embedded; what exceeds its memory goes to files in the folder."""

    def __init__(self, folder: Path, memory: str) -> None:
        """Open an own database in memory."""
        import duckdb

        self.folder = folder
        settings: dict[str, Any] = {"temp_directory": str(folder / "spill"), "preserve_insertion_order": "false"}
        if memory:
            settings["memory_limit"] = memory
        try:
            self.database = duckdb.connect(config=settings)
        except duckdb.Error as error:
            raise CqosError(f"`--memory {memory}`: {str(error).splitlines()[0]}", "write a size such as 4GB") from None
        self.database.execute("SET enable_progress_bar = false")

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:
        """Open a file of `FORMATS`, or a folder of Parquet files."""
        import duckdb
        import narwhals as nw

        suffix = Path(path).suffix.lower()
        try:
            if suffix in {".duckdb", ".db"}:
                self.database.execute(f"ATTACH '{_quoted(path)}' AS fleet (READ_ONLY)")
                found = self.database.table(f"fleet.{table}")
            elif suffix == ".parquet":
                files = f"{path}/**/*.parquet" if Path(path).is_dir() else path
                found = self.database.sql(_PARQUET.format(path=_quoted(files)))
            elif suffix in {".csv", ".tsv"}:
                found = self.database.read_csv(path, sep=_separator(path), **_CSV)
            else:
                found = self.database.sql(_TEXTS_OF_JSON.format(path=_quoted(path)))
                if found.columns == ["json"]:
                    raise CqosError(
                        f"`{path}` cannot be read: a line is no JSON object", "write a JSON object in each line"
                    )
            names = ", ".join(f'"{_inner(name)}" AS "{_inner(name.replace(".", DOT))}"' for name in found.columns)
            return nw.from_native(found.project(names))
        except duckdb.Error as error:
            raise CqosError(f"`{path}` cannot be read: {_reason(error)}") from None

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""
        import narwhals as nw

        return nw.from_native(self.database.read_parquet(str(path)))

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet."""
        import duckdb

        try:
            frame.to_native().write_parquet(str(path))
        except duckdb.OutOfMemoryException as error:
            raise CqosError(f"DuckDB needs more than `--memory` allows: {str(error).splitlines()[0]}") from None
        except (duckdb.DataError, duckdb.OperationalError, duckdb.InvalidInputException) as error:
            raise CqosError(f"a row of the table cannot be read: {_reason(error)}") from None

    def close(self) -> None:
        """Close the database."""
        self.database.close()


class Polars(DuckDB):
    """Polars, in this process; DuckDB reads the source for it, so that a file means the same to both."""

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:
        """Open what DuckDB opens."""
        read = self.folder / "source.parquet"
        super().write(super().source(path, table), read)
        return self.scan(read)

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""
        import narwhals as nw
        import polars as pl

        return nw.from_native(pl.scan_parquet(path))

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet."""
        frame.to_native().sink_parquet(path)


class Spark:
    """A Spark cluster that is there; its workers read and write the folder."""

    def __init__(self, url: str) -> None:
        """Connect to ``spark://host:port``, or to ``local[2]``."""
        from pyspark.sql import SparkSession

        builder = SparkSession.builder.master(url).appName("cqos audit")
        for name, value in _SPARK.items():
            builder = builder.config(f"spark.{name}", value)
        try:
            self.session = builder.getOrCreate()
        except _spark_errors() as error:
            raise CqosError(f"`--spark {url}`: {_reason(error)}") from None

    def source(self, path: str, table: str) -> nw.LazyFrame[Any]:  # noqa: ARG002 - the path is the name of a table
        """Open a file, or a table that the cluster knows by name."""
        import narwhals as nw

        suffix = Path(path).suffix.lower()
        reader = self.session.read.option("mode", "FAILFAST")
        try:
            if suffix == ".parquet":
                found = reader.parquet(path)
            elif suffix in {".csv", ".tsv"}:
                found = reader.csv(path, header=True, sep=_separator(path), escape='"')
            elif suffix in {".ndjson", ".jsonl"}:
                found = reader.json(path, primitivesAsString=True)
            else:
                found = self.session.table(path)
        except _spark_errors() as error:
            raise CqosError(f"`{path}` cannot be read: {_reason(error)}") from None
        return nw.from_native(found.toDF(*[name.replace(".", DOT) for name in found.columns]))

    def scan(self, path: Path) -> nw.LazyFrame[Any]:
        """Open a Parquet file that was kept."""
        import narwhals as nw

        return nw.from_native(self.session.read.parquet(str(path)))

    def write(self, frame: nw.LazyFrame[Any], path: Path) -> None:
        """Write a table as Parquet, a folder of files."""
        try:
            frame.to_native().write.mode("overwrite").parquet(str(path))
        except _spark_errors() as error:
            raise CqosError(f"the cluster cannot go on: {_reason(error)}") from None

    def close(self) -> None:
        """End the application."""
        self.session.stop()


def _separator(path: str) -> str:
    """Return what separates columns in the first line; where rows differ in length, DuckDB would guess another one."""
    if not Path(path).is_file():
        return ","
    with Path(path).open(encoding="utf-8", errors="replace") as file:
        return max(",;\t|", key=file.readline(_FIRST_LINE).count)


_FIRST_LINE: Final = 1_000_000
_SHOWN: Final = 200
"""Characters of a line of an error."""


def _spark_errors() -> tuple[type[Exception], ...]:
    """Return what Spark raises, in Python and in Java."""
    from py4j.protocol import Py4JError  # type: ignore[import-untyped]
    from pyspark.errors import PySparkException

    return PySparkException, Py4JError


def _reason(error: Exception) -> str:
    """Return the first lines of an error that say where and what; the row itself may be as long as the file."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Original Line")]
    if "sniffing file" in lines[0]:
        return "rows have other numbers of columns than the first line, or a quote is not closed"
    return " ".join(line[:_SHOWN] for line in lines[:2])


def _inner(name: str) -> str:
    return name.replace('"', '""')


def _quoted(path: str) -> str:
    return path.replace("'", "''")
