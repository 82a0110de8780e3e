"""Tables that Python writes row by row, a bounded number of them in memory."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_bulk.engines import TableStore

_ROWS: Final = 100_000


class Spool:
    """A table that is being written."""

    def __init__(self, writer: Any) -> None:
        """Write to a Parquet file."""
        self._writer = writer
        self._rows: list[tuple[Any, ...]] = []

    def add(self, *row: Any) -> None:
        """Add a row, in the order of the columns."""
        self._rows.append(row)
        if len(self._rows) >= _ROWS:
            self.write()

    def write(self) -> None:
        """Write the rows that wait."""
        import pyarrow as pa

        schema = self._writer.schema
        columns = zip(*self._rows, strict=True) if self._rows else ([],) * len(schema)
        arrays = [pa.array(column, kind) for column, kind in zip(columns, schema.types, strict=True)]
        self._writer.write_table(pa.table(arrays, schema))
        self._rows = []


@contextmanager
def spooled(store: TableStore, name: str, kinds: Mapping[str, str]) -> Iterator[Spool]:
    """Write a table with columns of ``kinds``, ``text`` or ``number``; it appears in its store when all of it is there."""
    import pyarrow as pa
    from pyarrow import parquet

    types = {"text": pa.string(), "number": pa.int64()}
    part = store.folder / f"{name}.part"
    with parquet.ParquetWriter(part, pa.schema([(key, types[kind]) for key, kind in kinds.items()])) as writer:
        spool = Spool(writer)
        yield spool
        spool.write()
    store.path(name).unlink(missing_ok=True)
    part.rename(store.path(name))
