"""Append-only table on disk that stays readable when the process dies at any instant.

One JSON line names the columns; every further row is one little-endian float64 per column. A reader
takes the whole rows and leaves a torn last one, so no index or footer is needed. A Parquet file
has its index at the end, which is why rows go here first and become Parquet when the run ends.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hil.analysis.pieces import PIECE_ROWS
from hil.core.errors import BadInput
from hil.core.files import replacing
from hil.record.schema import Column

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.record.writing import GuardedFile

Columns = Mapping[str, "NDArray[np.float64]"]
# Rows of a Parquet row group. A table that fits one is held in memory whole; of a longer one there is
# never more than that at a time, or one column where somebody asks for it (an hour of 30 Hz: 0.9 MB).
GROUP_ROWS = PIECE_ROWS
_FORMAT = "hil-journal-1"
# What a damaged Parquet file raises; ValueError for names that are no UTF-8.
_UNREADABLE = (OSError, ValueError, pa.ArrowException)
_MAX_HEADER = 65_536


class Journal:
    """Writer of one table to a new file; `write` only packs and buffers."""

    def __init__(self, file: GuardedFile, names: Sequence[str]) -> None:
        self._write = file.write
        self._pack = struct.Struct(f"<{len(names)}d").pack
        file.write(json.dumps({"format": _FORMAT, "columns": list(names)}).encode() + b"\n")
        file.flush()

    def write(self, row: Sequence[float]) -> None:
        """Append one row, values in column order; NaN stands for "does not exist"."""
        self._write(self._pack(*row))


def read_journal(path: Path) -> dict[str, NDArray[np.float64]]:
    """Return every whole row of a journal, cut off or not; raises BadInput for another file."""
    whole: dict[str, NDArray[np.float64]] = {}
    for columns in _journal_groups(path, None):
        whole = columns
    return whole


def _journal_groups(path: Path, rows: int | None) -> Iterator[dict[str, NDArray[np.float64]]]:
    """Yield a journal's whole rows, so many at a time (all at once for None); raises BadInput."""
    with path.open("rb") as file:
        head = file.readline(_MAX_HEADER)
        if not head.endswith(b"\n"):
            return  # cut off before the first row could be written
        names = _names_of(head, path)
        width = 8 * len(names)
        first = True
        while True:
            data = file.read(-1 if rows is None else rows * width)
            found = len(data) // width
            if not found and not first:
                return
            first = False
            table = np.frombuffer(data, "<f8", found * len(names)).reshape(found, len(names))
            yield {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}
            if rows is None or found < rows:
                return


def _names_of(head: bytes, path: Path) -> list[str]:
    try:
        header = json.loads(head)
        names = [str(name) for name in header["columns"]]
        known = header["format"] == _FORMAT
    except (ValueError, KeyError, TypeError):
        known = False
    if not known:
        raise BadInput(f"{path}: damaged: the first line is not that of a {_FORMAT} file")
    return names


def journal_to_parquet(journal: Path, parquet: Path, schema: Sequence[Column]) -> Columns:
    """Write a journal's rows as a Parquet file, a row group at a time, and return the table."""
    rows = 0
    columns: Columns = {}
    with replacing(parquet) as part:
        writer: pq.ParquetWriter | None = None
        try:
            for columns in _journal_groups(journal, GROUP_ROWS):
                table = arrow_table(columns, schema)
                rows += table.num_rows
                if writer is None:
                    writer = pq.ParquetWriter(part, table.schema, **_PARQUET)
                writer.write_table(table)
        finally:
            if writer is not None:
                writer.close()
        if writer is None:
            pq.write_table(arrow_table({}, schema), part, **_PARQUET)
    return columns if rows <= GROUP_ROWS else ColumnsOnDisk(parquet)


_PARQUET: dict[str, Any] = {"compression": "zstd", "use_dictionary": False}


def write_parquet(path: Path, columns: Columns, schema: Sequence[Column]) -> None:
    """Write the table atomically; equal values give an equal file (no time or host inside)."""
    with replacing(path) as part:
        pq.write_table(arrow_table(columns, schema), part, **_PARQUET)


def arrow_table(columns: Columns, schema: Sequence[Column]) -> pa.Table:
    """Return the columns as an Arrow table; each field's metadata has unit, group and meaning."""
    fields, arrays = [], []
    for column in schema:
        values = columns.get(column.name, np.empty(0))
        array = _arrow_array(values, column)
        notes = {"unit": column.unit, "group": column.group, "meaning": column.meaning}
        fields.append(pa.field(column.name, array.type, metadata=notes))
        arrays.append(array)
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _arrow_array(values: NDArray[np.float64], column: Column) -> pa.Array:
    # From buffers: pa.array() has to look at masks of numpy's, whose code takes longer to load than this.
    missing = np.isnan(values)
    known = pa.py_buffer(_bits(~missing)) if missing.any() else None
    if column.kind == "float64":
        data = pa.py_buffer(np.ascontiguousarray(values, np.float64))
        return pa.Array.from_buffers(pa.float64(), len(values), [known, data])
    whole = np.where(missing, 0.0, values)
    if column.kind == "bool":
        data = pa.py_buffer(_bits(whole != 0.0))
        return pa.Array.from_buffers(pa.bool_(), len(values), [known, data])
    data = pa.py_buffer(whole.astype(np.int32))
    return pa.Array.from_buffers(pa.int32(), len(values), [known, data])


def _bits(flags: NDArray[np.bool_]) -> NDArray[np.uint8]:
    return np.packbits(flags, bitorder="little")


def read_parquet(path: Path) -> Columns:
    """Return every column as float64, NaN where the file has null; raises BadInput."""
    try:
        with pq.ParquetFile(
            path
        ) as file:  # pq.read_table loads code for tables of many files first
            if file.metadata.num_rows > GROUP_ROWS:
                return ColumnsOnDisk(path)
            table = file.read()
        return {name: _floats(table.column(name)) for name in table.column_names}
    except _UNREADABLE as error:
        raise _damaged(path, error) from None


def _floats(column: pa.ChunkedArray) -> NDArray[np.float64]:
    values: NDArray[np.float64] = column.combine_chunks().cast(pa.float64()).to_numpy(False)
    return values


def _damaged(path: Path, error: Exception) -> BadInput:
    first = next(iter(str(error).splitlines()), type(error).__name__)
    return BadInput(f"{path}: damaged, not readable as Parquet: {first}")


class ColumnsOnDisk(Mapping[str, "NDArray[np.float64]"]):
    """The columns of a Parquet file, each read when it is asked for; raises BadInput where it cannot."""

    def __init__(self, path: Path) -> None:
        with pq.ParquetFile(path) as file:
            self._names = list(file.schema_arrow.names)
            self.rows = int(file.metadata.num_rows)
        self._path = path

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Return one column; raises KeyError for one that there is not."""
        if name not in self._names:
            raise KeyError(name)
        try:
            with pq.ParquetFile(self._path, pre_buffer=False) as file:
                return _floats(file.read(columns=[name]).column(name))
        except _UNREADABLE as error:
            raise _damaged(self._path, error) from None

    def groups(self, names: Sequence[str]) -> Iterator[Columns]:
        """Yield some of the columns, a row group at a time; raises KeyError, BadInput."""
        for name in names:
            if name not in self._names:
                raise KeyError(name)
        try:
            with pq.ParquetFile(self._path, pre_buffer=False) as file:
                for number in range(file.num_row_groups):
                    wanted = list(dict.fromkeys(names))
                    table = file.read_row_group(number, wanted, use_threads=False)
                    yield {name: _floats(table.column(name)) for name in names}
        except (OSError, pa.ArrowException) as error:
            raise _damaged(self._path, error) from None

    def __iter__(self) -> Iterator[str]:
        """Return the names in the order of the file."""
        return iter(self._names)

    def __len__(self) -> int:
        """Return how many columns there are."""
        return len(self._names)
