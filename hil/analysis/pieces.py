"""Tables longer than memory should hold: gone through in pieces, their percentiles exact.

A table of up to PIECE_ROWS rows is one piece. What is worked out in pieces is the same for a table in
memory and for one on disk: the pieces are the same. Nothing here holds more than a few pieces.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Columns = Mapping[str, Array]

# Rows of a piece: 4.5 minutes at 30 Hz, 64 kB a column. It is the row group of samples.parquet too.
PIECE_ROWS = 1 << 13

_DIGIT_BITS = 16
_TOP_SHIFT = 48


@runtime_checkable
class OnDisk(Protocol):
    """A table whose columns are on disk."""

    @property
    def rows(self) -> int:
        """Return how many rows there are."""

    def groups(self, names: Sequence[str]) -> Iterator[Columns]:
        """Yield some of the columns, a row group at a time."""


def _on_disk(columns: Columns) -> OnDisk | None:
    """Return the table where its columns are on disk."""
    # A dictionary is asked first: whether something keeps to a protocol is a long question.
    return None if isinstance(columns, dict) or not isinstance(columns, OnDisk) else columns


def row_count(columns: Columns) -> int:
    """Return how many rows a table of samples has; 0 for one without a time."""
    stored = _on_disk(columns)
    if stored is not None:
        return stored.rows
    return int(columns["t_s"].size) if "t_s" in columns else 0


def pieces(columns: Columns, names: Sequence[str], before: int = 0) -> Iterator[dict[str, Array]]:
    """Yield some of the columns in pieces, each after the first led by the `before` rows before it."""
    led: dict[str, Array] = {}
    for piece in _pieces(columns, names):
        whole = {name: np.concatenate((led[name], piece[name])) for name in names} if led else piece
        yield whole
        led = {name: whole[name][-before:] for name in names} if before else {}


def _pieces(columns: Columns, names: Sequence[str]) -> Iterator[dict[str, Array]]:
    stored = _on_disk(columns)
    if stored is None and len(columns[names[0]]) <= PIECE_ROWS:
        yield {name: columns[name] for name in names}
        return
    tables = stored.groups(names) if stored is not None else iter((columns,))
    for table in tables:
        some = {name: table[name] for name in names}
        rows = len(next(iter(some.values())))
        for first in range(0, max(rows, 1), PIECE_ROWS):
            yield {name: values[first : first + PIECE_ROWS] for name, values in some.items()}


def percentiles(parts: Callable[[], Iterator[Array]], percents: Sequence[float]) -> list[float]:
    """Return what numpy.percentile gives for all finite values of `parts()` together, bit for bit.

    `parts` is called several times and must give the same values each time. NaN without any value.
    """
    total, held = _held(values[np.isfinite(values)] for values in parts())
    if total == 0:
        return [math.nan] * len(percents)
    places = [(total - 1) * (percent / 100.0) for percent in percents]
    low = [min(math.floor(place), total - 1) for place in places]
    wanted = sorted({rank for first in low for rank in (first, min(first + 1, total - 1))})
    found = _ranked(held, wanted) if total <= PIECE_ROWS else _of_ranks(parts, wanted)
    ranked = dict(zip(wanted, found, strict=True))
    return [
        _between(ranked[first], ranked[min(first + 1, total - 1)], place - first)
        for place, first in zip(places, low, strict=True)
    ]


def median(parts: Callable[[], Iterator[Array]]) -> float:
    """Return the median of all values of `parts()` together; NaN without any value.

    As numpy.median where they fit a piece; of more, those that are finite.
    """
    total, held = _held(parts())
    if total > PIECE_ROWS:
        return percentiles(parts, [50])[0]
    if not total or any(np.isnan(values).any() for values in held):
        return math.nan
    half, odd = divmod(total, 2)
    middle = _ranked(held, [half] if odd else [half - 1, half])
    return sum(middle) / len(middle)


def _ranked(held: Sequence[Array], ranks: Sequence[int]) -> list[float]:
    """Return the values at these places of the sorted whole."""
    values = held[0] if len(held) == 1 else np.concatenate(held)
    found: list[float] = np.partition(values, ranks)[ranks].tolist()
    return found


def _held(parts: Iterable[Array]) -> tuple[int, list[Array]]:
    """Return how many values there are, and the arrays themselves as far as they fit a piece."""
    total, held = 0, []
    for values in parts:
        total += values.size
        if total <= PIECE_ROWS:
            held.append(values)
    return total, held


def _between(low: float, high: float, share: float) -> float:
    """Interpolate as numpy.percentile does."""
    step = high - low
    return high - step * (1.0 - share) if share >= 0.5 else low + step * share


def _of_ranks(parts: Callable[[], Iterator[Array]], ranks: Sequence[int]) -> list[float]:
    """Return the values at these places of the sorted whole.

    Values are found digit by digit of their bits, from the top: how many values have each next digit
    says in which of them a place lies.
    """
    found = [0] * len(ranks)  # leading digits
    left = list(ranks)  # place among the values with those
    for shift in range(_TOP_SHIFT, -1, -_DIGIT_BITS):
        counts = {prefix: np.zeros(1 << _DIGIT_BITS, np.int64) for prefix in set(found)}
        for values in parts():
            keys = _keys(values[np.isfinite(values)])
            for prefix, histogram in counts.items():
                own = (
                    keys if shift == _TOP_SHIFT else keys[(keys >> np.uint64(shift + 16)) == prefix]
                )
                digits = (own >> np.uint64(shift)) & np.uint64(0xFFFF)
                counted = np.bincount(digits.astype(np.int64), minlength=1 << _DIGIT_BITS)
                np.add(histogram, counted, out=histogram)
        for which, prefix in enumerate(found.copy()):
            below = np.cumsum(counts[prefix])
            digit = int(np.searchsorted(below, left[which], "right"))
            left[which] -= int(below[digit - 1]) if digit else 0
            found[which] = prefix << _DIGIT_BITS | digit
    return [_value(key) for key in found]


_SIGN = 1 << 63


def _keys(values: Array) -> NDArray[np.uint64]:
    """Return whole numbers in the order of the values."""
    bits = (values + 0.0).view(np.uint64)  # -0.0 is 0.0
    negative = bits >= np.uint64(_SIGN)
    return np.where(negative, ~bits, bits | np.uint64(_SIGN))


def _value(key: int) -> float:
    bits = key & ~_SIGN if key & _SIGN else ~key & (1 << 64) - 1
    return float(np.array(bits, np.uint64).view(np.float64))
