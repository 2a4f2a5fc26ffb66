"""CSV of other programs: columns by a mapping, whatever marks the columns and the decimals.

A row is made for each pose; a signal whose cell is empty there holds its latest value, as in the
usual export of several topics on one time column.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil.core.errors import BadInput
from hil.record.log_mapping import LogMapping, Source
from hil.record.log_signals import (
    POSE,
    Signals,
    counter_hint,
    fall_text,
    in_order,
    read_bytes,
    scaled,
    whole_poses,
)
from hil.record.schema import SAMPLE_NAMES

if TYPE_CHECKING:
    from hil.record.log_signals import Array

_DELIMITERS = (",", ";", "\t", "|")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")
_GROUPED_COMMA = re.compile(r"[+-]?\d{1,3}(\.\d{3})+(,\d*)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_MISSING = frozenset({"nan", "n/a", "#n/a", "na", "null", "none", "nil", "-", "--", "?"})
_WORDS = {"true": 1.0, "false": 0.0}


@dataclass(frozen=True, slots=True)
class Table:
    """The cells of a file; `lines[k]` is the line of the file that row k ends on."""

    path: Path
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def place(self, row: int) -> str:
        """Return how a message names a row: the first after the heading is row 1."""
        return f"{self.path}: row {row + 1} (line {self.lines[row]})"

    def number_of(self, column: str, what: str) -> int:
        """Return which column has a name; raises BadInput when none or more than one has it."""
        count = self.names.count(column)
        if count == 1:
            return self.names.index(column)
        if count:
            raise BadInput(f"{self.path}: {count} columns are called {column!r}, {what} needs one")
        raise BadInput(
            f"{self.path}: has no column {column!r} for {what}; it has {_listed(self.names)}"
        )


def wanted_columns(settings: LogMapping) -> dict[str, Source]:
    """Return what is taken from columns of the file, by the name it gets."""
    return {name: source for name, source in settings.columns.items() if source.column}


def timed_cells(path: Path, settings: LogMapping) -> tuple[_Cells, Array, Callable[[int], str]]:
    """Return cells, times in s, and what says why a row's time is refused; raises BadInput."""
    used = [
        settings.t.column,
        *settings.only,
        *(source.column for source in wanted_columns(settings).values()),
    ]
    table = _chosen(_read_table(path, used), settings)
    cells = _Cells(table, settings.decimal)
    raw_t = cells.column(settings.t.column, "t")
    t_s = scaled(raw_t, settings.t)

    def refusal(row: int) -> str:
        before = int(np.flatnonzero(np.isfinite(t_s[:row]))[-1])
        hint = "" if settings.t.wraps_at else counter_hint(raw_t[before], raw_t[row])
        return f"{table.place(row)}: {fall_text(t_s[before], t_s[row])}{hint}"

    return cells, t_s, refusal


def read_csv(path: Path, settings: LogMapping) -> Signals:
    """Return a row per pose of a CSV file; raises BadInput.

    Without a mapping of columns those are taken that bear the names of `samples.parquet`.
    """
    if not settings.columns:
        settings = settings.model_copy(update={"columns": _own_columns(path, settings)})
    wanted = wanted_columns(settings)
    cells, t_s, refusal = timed_cells(path, settings)
    order, notes = in_order(t_s, settings.disorder, refusal, "rows")
    untimed = int(np.count_nonzero(~np.isfinite(t_s)))
    if untimed:
        notes.append(f"{untimed} of {t_s.size} rows have no time: left out")
    columns = {
        name: scaled(cells.column(source.column, name)[order], source)
        for name, source in wanted.items()
    }
    times = t_s[order]
    if all(name in columns for name in POSE):
        times, columns, more = _row_per_pose(times, columns)
        notes += more
    signals = whole_poses(times, columns, str(path))
    return Signals(signals.t_s, signals.columns, notes=(*cells.notes(), *notes, *signals.notes))


def _own_columns(path: Path, settings: LogMapping) -> dict[str, Source]:
    """Return the columns of a file that are called as in a record; raises BadInput."""
    names = _read_table(path, [settings.t.column, *POSE]).names
    return {
        name: Source(column=name)
        for name in SAMPLE_NAMES
        if name in names and name not in {"t_s", settings.t.column}
    }


def _row_per_pose(
    t_s: Array, columns: dict[str, Array]
) -> tuple[Array, dict[str, Array], list[str]]:
    """Return the rows that have a pose; signals that are empty there hold their latest value.

    An empty cell is first filled from the rows of the same time.
    """
    has_pose = np.isfinite(columns["est_x_m"])
    rows = np.flatnonzero(has_pose)
    if rows.size == t_s.size and all(np.isfinite(values).all() for values in columns.values()):
        return t_s, columns, []
    filled = {name: _held_rows(t_s, values)[rows] for name, values in columns.items()}
    left = t_s.size - rows.size
    said = f"{left} of {t_s.size} rows have no pose: left out, what they say is held until the next"
    return t_s[rows], filled, [said] if left else []


def _held_rows(t_s: Array, values: Array) -> Array:
    """Return a column with empty cells filled: from the same time if possible, else from before."""
    known = np.flatnonzero(np.isfinite(values))
    if not known.size or known.size == values.size:
        return values
    at = np.searchsorted(known, np.arange(values.size), side="right") - 1
    later = np.clip(at + 1, 0, known.size - 1)
    same = (known[later] > np.arange(values.size)) & (t_s[known[later]] == t_s)
    source = np.where(same & ~np.isfinite(values), known[later], known[np.clip(at, 0, None)])
    result = values[source]
    result[(at < 0) & ~same] = math.nan
    return result


def _chosen(table: Table, settings: LogMapping) -> Table:
    """Return the rows that `only` asks for."""
    if not settings.only:
        return table
    wanted = [(table.number_of(name, "only"), text) for name, text in settings.only.items()]
    kept = [k for k, row in enumerate(table.rows) if all(row[at] == text for at, text in wanted)]
    if not kept:
        asked = ", ".join(f"{name} = {text!r}" for name, text in settings.only.items())
        found = _listed(tuple(sorted({row[wanted[0][0]] for row in table.rows})))
        raise BadInput(f"{table.path}: no row has {asked}; the first of them has: {found}")
    return Table(
        table.path,
        table.names,
        tuple(table.rows[k] for k in kept),
        tuple(table.lines[k] for k in kept),
    )


def _text(path: Path) -> str:
    data = read_bytes(path)
    if b"\0" in data[:4096] and data[:2] not in {b"\xff\xfe", b"\xfe\xff"}:
        raise BadInput(f"{path}: is binary, not CSV; a MAVLink log needs a name ending in .tlog")
    if data[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        coding = "utf-16"
    else:
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError:
            coding = "cp1252"
    try:
        return data.decode(coding)
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: cannot be read as CSV: {error}") from None


def _read_table(path: Path, used: list[str]) -> Table:
    """Return the cells of a file, its columns parted by whichever mark gives the wanted ones."""
    text = _text(path)
    told = re.match(r"sep=(.)\r?\n", text)
    skipped = 0
    if told:
        text, skipped = text[told.end() :], 1
    head = _cells_of(path, text, told.group(1) if told else _delimiter(text, used))
    names, _ = next(head, ((), 0))
    if not any(names):
        raise BadInput(f"{path}: is empty; a heading and rows are needed")
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for row, line in head:
        if not any(row):
            continue
        if any(row[len(names) :]):
            raise BadInput(
                f"{path}: row {len(rows) + 1} (line {line + skipped}): {len(row)} cells, the heading"
                f" has {len(names)}: {', '.join(row)[:60]!r}; decimal commas between commas?"
            )
        rows.append((*row[: len(names)], *[""] * (len(names) - len(row))))
        lines.append(line + skipped)
    if not rows:
        raise BadInput(f"{path}: has a heading ({_listed(names)}) and no rows below it")
    return Table(path, names, tuple(rows), tuple(lines))


def _listed(names: tuple[str, ...]) -> str:
    """Return the names of columns for a message: on one line, control characters visible."""
    shown = [repr(name[:30])[1:-1] for name in names[:20] if name]
    return ", ".join(shown) + (", ..." if len(names) > 20 else "")


def _cells_of(path: Path, text: str, delimiter: str) -> Iterator[tuple[tuple[str, ...], int]]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True)
    try:
        for row in reader:
            yield tuple(cell.strip() for cell in row), reader.line_num
    except csv.Error as error:
        raise BadInput(f"{path}: line {reader.line_num}: cannot be read as CSV: {error}") from None


def _delimiter(text: str, used: list[str]) -> str:
    """Return the mark that gives the heading the most of the wanted names, then most columns."""
    line = text.splitlines()[0] if text else ""

    def found(mark: str) -> tuple[int, int]:
        names = [name.strip() for name in next(csv.reader([line], delimiter=mark), [])]
        return sum(name in names for name in used), len(names)

    return max(_DELIMITERS, key=found)


class _Cells:
    """Reads columns as numbers; what is no number is refused with its row, column and text."""

    def __init__(self, table: Table, decimal: str) -> None:
        self._table = table
        self._decimal = decimal
        self._missing: Counter[str] = Counter()
        self._commas: set[str] = set()
        self._taken: dict[str, Array] = {}

    def column(self, name: str, what: str) -> Array:
        """Return the numbers of a column, NaN where a cell is empty; raises BadInput."""
        at = self._table.number_of(name, what)
        if name not in self._taken:
            texts = [row[at] for row in self._table.rows]
            comma = self._has_commas(name, texts)
            values = [self._number(name, k, text, comma) for k, text in enumerate(texts)]
            self._taken[name] = np.array(values, dtype=np.float64)
        return self._taken[name]

    def notes(self) -> list[str]:
        """Return what was taken for granted in reading cells."""
        said = [
            f"{count} cells of {name!r} say that there is no value: taken as empty"
            for name, count in self._missing.items()
        ]
        if self._commas:
            names = ", ".join(sorted(self._commas))
            said.append(f"decimal commas in {names}")
        return said

    def _has_commas(self, name: str, texts: list[str]) -> bool:
        """Return whether a column has decimal commas; raises BadInput when that cannot be told."""
        with_comma = [k for k, text in enumerate(texts) if _COMMA.fullmatch(text)]
        if self._decimal or not with_comma:
            return self._decimal == ","
        pointed = any("." in text and _NUMBER.fullmatch(text) for text in texts)
        if pointed or all(_THOUSANDS.fullmatch(texts[k]) for k in with_comma):
            row = with_comma[0]
            raise BadInput(
                f"{self._table.place(row)}, column {name!r}: {texts[row]!r} may have a decimal comma"
                ' or one between thousands; say decimal = "," or "." in the mapping'
            )
        self._commas.add(name)
        return True

    def _number(self, name: str, row: int, text: str, comma: bool) -> float:
        if not text:
            return math.nan
        if text.casefold() in _MISSING:
            self._missing[name] += 1
            return math.nan
        if text.casefold() in _WORDS:
            return _WORDS[text.casefold()]
        plain = text
        if comma and (_COMMA.fullmatch(text) or _GROUPED_COMMA.fullmatch(text)):
            plain = text.replace(".", "").replace(",", ".")
        elif self._decimal == "." and re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?", text):
            plain = text.replace(",", "")
        value = float(plain) if _NUMBER.fullmatch(plain) else math.nan
        if not math.isfinite(value):
            raise BadInput(
                f"{self._table.place(row)}, column {name!r}: {text[:40]!r} is not a number; leave"
                " the cell empty where there is no value"
            )
        return value
