"""Records for other programs: the table as CSV, everything as MCAP (Foxglove), signals as ULog (PX4)."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.errors import BadInput
from hil.core.files import replace_file, unwritable
from hil.record.schema import SAMPLE_COLUMNS

if TYPE_CHECKING:
    from hil.record.reader import RunRecord
    from hil.record.schema import Column

FORMATS = ("csv", "mcap", "ulog")


def export(run: RunRecord, form: str, path: Path) -> None:
    """Write a run to `path` in one of FORMATS, atomically.

    Raises BadInput when the file cannot be written, or the package for the format is not there, RigFault
    when the disk is full.
    """
    try:
        replace_file(path, _bytes_of(run, form))
    except OSError as error:
        raise unwritable(f"--out {path}", error) from None


def _bytes_of(run: RunRecord, form: str) -> bytes:
    if form == "csv":
        return samples_csv(run)
    try:
        if form == "mcap":
            from hil.record.export_mcap import run_mcap  # noqa: PLC0415 - needs an extra

            return run_mcap(run)
        from hil.record.export_ulog import run_ulog  # noqa: PLC0415 - needs an extra

        return run_ulog(run)
    except ImportError as error:
        raise BadInput(
            f"--to {form}: needs the package {error.name}: pip install 'skid-steer-hil[logs]'"
        ) from None


def samples_csv(run: RunRecord) -> bytes:
    """Return samples.parquet as CSV: a heading of column names, a row a tick, empty for no value."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([column.name for column in SAMPLE_COLUMNS])
    columns = [run.samples[column.name].tolist() for column in SAMPLE_COLUMNS]
    for row in zip(*columns, strict=True):
        writer.writerow([_cell(*cell) for cell in zip(row, SAMPLE_COLUMNS, strict=True)])
    return out.getvalue().encode()


def _cell(value: float, column: Column) -> str:
    if not math.isfinite(value):
        return ""
    return repr(value) if column.kind == "float64" else str(int(value))
