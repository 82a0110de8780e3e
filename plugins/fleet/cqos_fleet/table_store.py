"""The tables of one audit, as Parquet in a folder, and the tables that Python writes row by row."""

from __future__ import annotations

import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    import narwhals as nw

    from cqos_fleet.engines import DuckDB, Spark

_ROWS_READ: Final = 50_000
_ROWS_WRITTEN: Final = 100_000


class TableStore:
    """The tables of one audit; a table that is there already is not made again, unless it comes from Python."""

    def __init__(self, engine: DuckDB | Spark, folder: Path) -> None:
        """Keep tables of an engine in a folder."""
        self.engine = engine
        self.folder = folder

    def path(self, name: str) -> Path:
        """Return where a table is kept."""
        return self.folder / f"{name}.parquet"

    def scan(self, name: str) -> nw.LazyFrame[Any]:
        """Open a kept table."""
        return self.engine.scan(self.path(name))

    @contextmanager
    def _part(self, name: str) -> Iterator[Path]:
        """Give the path to write a table to; it appears under its name only when it is complete."""
        part = self.folder / f"{name}.part"
        _remove(part)
        yield part
        _remove(self.path(name))
        part.rename(self.path(name))

    def keep(self, name: str, frame: nw.LazyFrame[Any]) -> nw.LazyFrame[Any]:
        """Keep a table of the engine."""
        if not self.path(name).exists():
            with self._part(name) as part:
                self.engine.write(frame, part)
        return self.scan(name)

    def put(self, name: str, columns: dict[str, tuple[str, list[Any]]]) -> nw.LazyFrame[Any]:
        """Keep a table of values from Python; each column with its kind: ``text``, ``number``, or ``small`` for a number as small as can be."""
        import pyarrow as pa
        from pyarrow import parquet

        fields = {
            key: pa.array(values, type=_number_type(values) if kind == "small" else _types()[kind])
            for key, (kind, values) in columns.items()
        }
        with self._part(name) as part:
            parquet.write_table(pa.table(fields), part)
        return self.scan(name)

    @contextmanager
    def spooled(self, name: str, kinds: Mapping[str, str]) -> Iterator[Spool]:
        """Write a table with columns of ``kinds``, ``text`` or ``number``, row by row."""
        import pyarrow as pa
        from pyarrow import parquet

        schema = pa.schema([(key, _types()[kind]) for key, kind in kinds.items()])
        with self._part(name) as part, parquet.ParquetWriter(part, schema) as writer:
            spool = Spool(writer)
            yield spool
            spool.write()

    def fill(self, name: str, kinds: Mapping[str, str], rows: Iterable[Mapping[str, Any]]) -> nw.LazyFrame[Any]:
        """Keep a table of rows from Python; what a row lacks is null."""
        with self.spooled(name, kinds) as out:
            for row in rows:
                out.add(*map(row.get, kinds))
        return self.scan(name)

    def tables(self, name: str) -> Iterator[Any]:
        """Yield a kept table as parts in Arrow, of a bounded number of rows."""
        import pyarrow as pa
        from pyarrow import dataset

        for batch in dataset.dataset(self.path(name), format="parquet").to_batches(batch_size=_ROWS_READ):
            yield pa.Table.from_batches([batch])

    def batches(self, name: str) -> Iterator[list[list[Any]]]:
        """Yield the columns of a kept table, a bounded number of rows at a time."""
        for table in self.tables(name):
            yield [column.to_pylist() for column in table.columns]

    def tuples(self, name: str) -> Iterator[tuple[Any, ...]]:
        """Yield the rows of a kept table, in the order of its columns."""
        for columns in self.batches(name):
            yield from zip(*columns, strict=True)

    def rows(self, name: str) -> Iterator[dict[str, Any]]:
        """Yield the rows of a kept table, as dictionaries."""
        for table in self.tables(name):
            names = table.column_names
            for row in zip(*(column.to_pylist() for column in table.columns), strict=True):
                yield dict(zip(names, row, strict=True))


class Spool:
    """A table that Python writes row by row, a bounded number of them in memory."""

    def __init__(self, writer: Any) -> None:
        """Write to a Parquet file."""
        self._writer = writer
        self._rows: list[tuple[Any, ...]] = []

    def add(self, *row: Any) -> None:
        """Add a row, in the order of the columns."""
        self._rows.append(row)
        if len(self._rows) >= _ROWS_WRITTEN:
            self.write()

    def write(self) -> None:
        """Write the rows that wait."""
        import pyarrow as pa

        schema = self._writer.schema
        columns = zip(*self._rows, strict=True) if self._rows else ([],) * len(schema)
        arrays = [pa.array(column, kind) for column, kind in zip(columns, schema.types, strict=True)]
        self._writer.write_table(pa.table(arrays, schema))
        self._rows = []


def _types() -> dict[str, Any]:
    import pyarrow as pa

    return {"text": pa.string(), "number": pa.int64()}


def _number_type(values: Iterable[int | None]) -> Any:
    """Return the smallest type that has room for some numbers."""
    import pyarrow as pa

    largest = max((abs(each) for each in values if each is not None), default=0)
    return next(kind for kind, bits in ((pa.int16(), 15), (pa.int32(), 31), (pa.int64(), 64)) if largest < 1 << bits)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
