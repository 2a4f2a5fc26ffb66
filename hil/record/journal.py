"""Append-only table on disk that stays readable when the process dies at any instant.

One JSON line names the columns; every further row is one little-endian float64 per column. A reader
takes the whole rows and leaves a torn last one, so no index or footer is needed. A Parquet file
has its index at the end, which is why rows go here first and become Parquet when the run ends.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hil.core.errors import BadInput
from hil.core.files import replacing
from hil.record.schema import Column
from hil.record.writing import GuardedFile, Keeping

if TYPE_CHECKING:
    from numpy.typing import NDArray

Columns = dict[str, "NDArray[np.float64]"]
_FORMAT = "hil-journal-1"
_MAX_HEADER = 65_536


class Journal:
    """Writer of one table; `write` only packs and buffers, `flush` hands rows to the system."""

    def __init__(self, path: Path, names: Sequence[str], keeping: Keeping) -> None:
        self.path = path
        self._file = GuardedFile(path, keeping)
        self._pack = struct.Struct(f"<{len(names)}d").pack
        self._file.write(json.dumps({"format": _FORMAT, "columns": list(names)}).encode() + b"\n")
        self._file.flush()

    def write(self, row: Sequence[float]) -> None:
        """Append one row, values in column order; NaN stands for "does not exist"."""
        self._file.write(self._pack(*row))

    def flush(self) -> None:
        """Make the rows so far survive the death of this process."""
        self._file.flush()

    def close(self) -> None:
        """Flush and close; safe to call twice."""
        self._file.close()


def read_journal(path: Path) -> Columns:
    """Return every whole row of a journal, cut off or not; raises BadInput for another file."""
    data = path.read_bytes()
    end = data.find(b"\n", 0, _MAX_HEADER)
    if end < 0:
        return {}  # cut off before the first row could be written
    try:
        header = json.loads(data[:end])
        names = [str(name) for name in header["columns"]]
        known = header["format"] == _FORMAT
    except (ValueError, KeyError, TypeError):
        known = False
    if not known:
        raise BadInput(f"{path}: damaged: the first line is not that of a {_FORMAT} file")
    width = 8 * len(names)
    rows = (len(data) - end - 1) // width
    table = np.frombuffer(data, "<f8", rows * len(names), end + 1).reshape(rows, len(names))
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def write_parquet(path: Path, columns: Columns, schema: Sequence[Column]) -> None:
    """Write the table atomically; equal values give an equal file (no time or host inside)."""
    with replacing(path) as part:
        pq.write_table(arrow_table(columns, schema), part, compression="zstd", use_dictionary=False)


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
    missing = np.isnan(values)
    if column.kind == "float64":
        return pa.array(values, pa.float64(), mask=missing)
    whole = np.where(missing, 0.0, values)
    target = np.bool_ if column.kind == "bool" else np.int32
    return pa.array(whole.astype(target), mask=missing)


def read_parquet(path: Path) -> Columns:
    """Return every column as float64, NaN where the file has null; raises BadInput."""
    try:
        table = pq.read_table(path)
        return {
            name: table.column(name).combine_chunks().cast(pa.float64()).to_numpy(False)
            for name in table.column_names
        }
    except (OSError, pa.ArrowException) as error:
        first = str(error).splitlines()[0]
        raise BadInput(f"{path}: damaged, not readable as Parquet: {first}") from None
