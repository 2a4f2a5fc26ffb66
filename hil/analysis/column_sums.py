"""What figures are made of: sums, integrals and changes of columns, a piece at a time (`pieces`)."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hil.analysis import sliding
from hil.analysis.pieces import percentiles, pieces

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Columns = Mapping[str, NDArray[np.float64]]


def ends(columns: Columns, name: str) -> tuple[float, float]:
    """Return the first and the last value of a column."""
    parts = [piece[name] for piece in pieces(columns, [name])]
    return float(parts[0][0]), float(parts[-1][-1])


def total(parts: Iterable[float]) -> float:
    """Add up the sums of the pieces; that of one piece is left as it is."""
    return float(functools.reduce(operator.add, parts))


def held_integral(columns: Columns, one: str, other: str) -> float:
    """Integrate the squares of two signals that are held from tick to tick; unknown ones are zero."""
    sums, known = [], False
    for piece in pieces(columns, ["t_s", one, other], before=1):
        squares = piece[one] ** 2 + piece[other] ** 2
        held = squares[:-1] * np.diff(piece["t_s"])
        sums.append(np.nansum(held))
        known = known or bool(np.isfinite(held).any())
    return total(sums) if known else math.nan


def variation(columns: Columns, name: str) -> float:
    """Return the sum of |change| between successive known values."""
    sums, before = [], np.empty(0)
    for piece in pieces(columns, [name]):
        values = piece[name]
        known = np.concatenate((before, values[np.isfinite(values)]))
        sums.append(np.abs(np.diff(known)).sum())
        before = known[-1:]
    return total(sums) if before.size else math.nan


def sign_changes(columns: Columns, name: str) -> int:
    """Count the changes of sign while the law ran, passing over zeros and unknown values."""
    count, before = 0, np.empty(0)
    for piece in pieces(columns, [name, *sliding.of_ran(columns)]):
        values = piece[name][sliding.law_ran(piece)]
        signs = np.sign(values[np.isfinite(values) & (values != 0.0)])
        signs = np.concatenate((before, signs))
        count += int(np.count_nonzero(np.diff(signs)))
        before = signs[-1:]
    return count


def mean_while_ran(columns: Columns, name: str) -> float:
    """Return the mean of the known values while the law ran."""
    sums, count = [], 0
    for piece in pieces(columns, [name, *sliding.of_ran(columns)]):
        values = piece[name][sliding.law_ran(piece)]
        known = values[np.isfinite(values)]
        sums.append(known.sum())
        count += known.size
    return total(sums) / count if count else math.nan


def percentiles_of(columns: Columns, name: str) -> list[float]:
    """Return median and 99th percentile of the known values."""
    return percentiles(lambda: (piece[name] for piece in pieces(columns, [name])), [50, 99])
