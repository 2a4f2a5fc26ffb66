"""Small CSV tables that people write: points, fiducials, colour samples."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from hil.core.errors import BadInput
from hil.core.files import RECORD_BYTES, read_text

MM = 1e-3


def read_numbers(
    path: Path, needed: Sequence[str], optional: Sequence[str] = ()
) -> list[dict[str, float]]:
    """Return the rows of a CSV as numbers by column; raises BadInput with the line at fault.

    Columns may stand in any order, be separated by commas or semicolons, and give lengths in mm
    where the name asked for ends in _m (x_mm for x_m); lines that begin with # are left out.
    """
    rows = []
    for number, row in _read_rows(path, needed, optional):
        values = {}
        for name, (text, factor) in row.items():
            values[name] = _number(text, factor, f"{path}: line {number}, {name}")
        rows.append(values)
    return rows


def read_table(path: Path, numbers: Sequence[str], text: str) -> list[dict[str, float | str]]:
    """Return rows with one column of text besides the numbers; raises BadInput."""
    rows: list[dict[str, float | str]] = []
    for line, row in _read_rows(path, (text, *numbers), ()):
        values: dict[str, float | str] = {text: row[text][0]}
        for name in numbers:
            values[name] = _number(*row[name], f"{path}: line {line}, {name}")
        rows.append(values)
    return rows


def _number(text: str, factor: float, where: str) -> float:
    try:
        value = float(text) * factor
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f"{where} = {text!r}: not a number")
    return value


def _read_rows(
    path: Path, needed: Sequence[str], optional: Sequence[str]
) -> list[tuple[int, dict[str, tuple[str, float]]]]:
    """Return (line number, column -> (text, factor to SI)) of every row."""
    try:
        content = read_text(path, RECORD_BYTES, "utf-8-sig")
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadInput(f"{path}: not a text file; a CSV was expected") from None
    lines = [
        (number, line)
        for number, line in enumerate(content.splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    separator = ";" if lines and ";" in lines[0][1] else ","
    cells = [next(csv.reader([line], delimiter=separator)) for _, line in lines]
    header = [name.strip() for name in cells[0]] if cells else []
    columns = {name: _find_column(header, name) for name in (*needed, *optional)}
    missing = [name for name in needed if columns[name] is None]
    if missing:
        raise BadInput(
            f"{path}: column {missing[0]} is missing; the first line must name {', '.join(needed)}"
        )
    if len(cells) < 2:
        raise BadInput(f"{path}: no rows in it")
    rows = []
    for (number, _), row in zip(lines[1:], cells[1:], strict=True):
        taken = {}
        for name, column in columns.items():
            if column is not None:
                index, factor = column
                taken[name] = (row[index].strip() if index < len(row) else "", factor)
        rows.append((number, taken))
    return rows


def _find_column(header: list[str], name: str) -> tuple[int, float] | None:
    """Return the place of a column and the factor to SI, None when it is not there."""
    if name in header:
        return header.index(name), 1.0
    if name.endswith("_m") and f"{name}m" in header:
        return header.index(f"{name}m"), MM
    return None
