"""A campaign's rows on disk: parts put in order a row group at a time, columns read when asked for.

A campaign may have a million rows of 1.8 kB. Of where each row lies 12 bytes are held; of the rows
themselves those of one row group, or one column.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from hil.core.files import replacing

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Rows of a row group of results.parquet: some 60 MB while it is put together.
GROUP_ROWS = 1 << 15
_NO_SOURCE = -1


class Table(Protocol):
    """The rows of a campaign, in memory or on disk."""

    @property
    def num_rows(self) -> int:
        """Return how many rows there are."""

    def column(self, name: str) -> pa.ChunkedArray:
        """Return one column."""


class Results:
    """The rows in a finished results.parquet."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with pq.ParquetFile(path) as file:
            self.num_rows: int = file.metadata.num_rows

    def column(self, name: str) -> pa.ChunkedArray:
        """Return one column, read now."""
        with pq.ParquetFile(self.path, pre_buffer=False) as file:
            return file.read([name], use_threads=False).column(name)


class Places:
    """Where each row of a campaign is: of its sources, row groups of files, and of its rows in there."""

    def __init__(self, rows: int) -> None:
        self._source = np.full(rows, _NO_SOURCE, np.int32)
        self._row = np.zeros(rows, np.int32)
        self._again = np.zeros(rows, np.bool_)
        self._sources: list[tuple[Path, int]] = []

    def add(self, file: Path, group: int, index: pa.ChunkedArray, again: pa.ChunkedArray) -> None:
        """Take note of a source's rows: their indices, and which of them are to be run again.

        Of several rows of one index the first that need not be run again counts, else the last.
        """
        places, bad = index.to_numpy(), again.to_numpy()
        own = len(self._sources)
        self._sources.append((file, group))
        if len(np.unique(places)) < len(places):
            for row, place in enumerate(places.tolist()):
                if self._source[place] == _NO_SOURCE or self._again[place]:
                    self._source[place], self._row[place], self._again[place] = own, row, bad[row]
            return
        free = (self._source[places] == _NO_SOURCE) | self._again[places]
        taken = places[free]
        self._source[taken], self._row[taken] = own, np.flatnonzero(free)
        self._again[taken] = bad[free]

    @property
    def done(self) -> NDArray[np.bool_]:
        """Say of each row whether it need not be run (again)."""
        done: NDArray[np.bool_] = (self._source != _NO_SOURCE) & ~self._again
        return done

    def tables(self, schema: pa.Schema) -> Iterator[pa.Table]:
        """Yield the rows there are, in order, each once, a row group at a time."""
        there = np.flatnonzero(self._source != _NO_SOURCE)
        if not there.size:
            yield schema.empty_table()
        for first in range(0, there.size, GROUP_ROWS):
            yield self._taken(there[first : first + GROUP_ROWS], schema)

    def _taken(self, wanted: NDArray[np.intp], schema: pa.Schema) -> pa.Table:
        tables = []
        for source in np.unique(self._source[wanted]).tolist():
            file, group = self._sources[source]
            rows = self._row[wanted[self._source[wanted] == source]]
            tables.append(read_group(file, group, schema).take(pa.array(rows)))
        whole = pa.concat_tables(tables)
        order = np.argsort(whole.column("index").to_numpy(), kind="stable")
        return whole.take(pa.array(order)).combine_chunks()


_UNKNOWN = "unknown"


def read_group(file: Path, group: int, schema: pa.Schema, names: Sequence[str] = ()) -> pa.Table:
    """Return a row group of a part or of results; raises OSError, ArrowException, ValueError.

    Rows that do not say which program made them are of an unknown one.
    """
    wanted = list(names) or schema.names
    with pq.ParquetFile(file, page_checksum_verification=True, pre_buffer=False) as parquet:
        there = set(parquet.schema_arrow.names)
        known = [name for name in wanted if name in there]
        table = parquet.read_row_group(group, known, use_threads=False)
    if "program" in wanted and "program" not in known:
        table = table.append_column("program", pa.array([_UNKNOWN] * table.num_rows, pa.string()))
    fields = [schema.field(name) for name in wanted]
    return table.select(wanted).cast(pa.schema(fields, metadata=schema.metadata))


def group_count(file: Path) -> int:
    """Return how many row groups a file has; raises OSError, ArrowException."""
    with pq.ParquetFile(file) as parquet:
        return int(parquet.num_row_groups)


def is_text(column: pa.ChunkedArray, text: str) -> pa.ChunkedArray:
    """Say of each value whether it is `text`."""
    return pc.equal(column, text)


def write_tables(path: Path, tables: Iterator[pa.Table], schema: pa.Schema) -> None:
    """Write tables as row groups of one file, atomically; raises OSError."""
    with (
        replacing(path) as part,
        pq.ParquetWriter(part, schema, compression="zstd", write_page_checksum=True) as writer,
    ):
        for table in tables:
            writer.write_table(table, row_group_size=max(table.num_rows, 1))
