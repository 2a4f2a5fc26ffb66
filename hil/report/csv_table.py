"""The figures of runs as CSV, one row a run, for tools that read nothing else."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hil.analysis.metrics import all_metrics
from hil.core.files import replace_file, unwritable
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

# What begins a formula for some spreadsheet.
_FORMULA = ("=", "+", "-", "@")
_ABOUT = ("scenario_name", "target", "camera", "outer", "inner", "seed", "outcome")


def _cell(value: object) -> object:
    """Return text as a spreadsheet shows it: no control characters, and no formula that it would run."""
    if not isinstance(value, str):
        return value
    text = visible(value)
    return f"'{text}" if text.startswith(_FORMULA) else text


def write_csv(path: Path, runs: Sequence[RunRecord]) -> None:
    """Write who each run was and its figures in their own units; a missing figure is empty.

    Raises BadInput where the file cannot be written.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    found = [run.figures() for run in runs]
    names = [metric.name for metric in all_metrics(found)]
    writer.writerow(["record", *_ABOUT, "basis", *names])
    for run, figures in zip(runs, found, strict=True):
        values = [figures.values.get(name, math.nan) for name in names]
        about = [_cell(getattr(run.manifest, name)) for name in _ABOUT]
        numbers = [repr(value) if math.isfinite(value) else "" for value in values]
        writer.writerow([_cell(str(run.path)), *about, figures.basis, *numbers])
    try:
        replace_file(path, out.getvalue().encode())
    except OSError as error:
        raise unwritable(f"--csv {path}", error) from None
