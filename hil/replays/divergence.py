"""Where a replay leaves its record: per channel, the first difference in time and its size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.record.tlog import LoggedFrame
from hil.wire import dialect
from hil.wire.framing import BOARD_SYSTEM

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.record.journal import Columns


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel compared bit for bit over `rows` rows; `different` of them differ.

    `first_s`, `recorded` and `replayed` tell of the first difference; `largest` is the largest
    |recorded - replayed|, NaN where a value exists on one side only. `rms` is the root mean square of
    the difference over all rows that have both values, NaN when there is none.
    """

    name: str
    rows: int
    different: int = 0
    first_s: float = math.nan
    recorded: float | str = math.nan
    replayed: float | str = math.nan
    largest: float = 0.0
    rms: float = 0.0

    @property
    def same(self) -> bool:
        """Say whether every row agrees to the last bit."""
        return self.different == 0

    def text(self) -> str:
        """Return one line for a person."""
        if self.same:
            return f"{self.name}: identical in {self.rows} rows"
        size = f", at most {self.largest:.3g} apart" if math.isfinite(self.largest) else ""
        return (
            f"{self.name}: first differs at t = {self.first_s:.4f} s "
            f"({self.recorded} recorded, {self.replayed} replayed), "
            f"{self.different} of {self.rows} rows{size}"
        )

    def to_json(self) -> dict[str, Any]:
        """Return the channel for a JSON document, NaN as null."""
        tree = {"name": self.name, "rows": self.rows, "different": self.different}
        if not self.same:
            tree |= {
                "first_t_s": _plain(self.first_s),
                "recorded": _plain(self.recorded),
                "replayed": _plain(self.replayed),
                "largest": _plain(self.largest),
                "rms": _plain(self.rms),
            }
        return tree


def _plain(value: float | str) -> float | str | None:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def compare_columns(
    recorded: Columns, replayed: Columns, names: Sequence[str], t_s: NDArray[np.float64]
) -> list[Channel]:
    """Compare the named columns over the rows that both have; `t_s` dates the recorded rows."""
    return [_compare(name, recorded[name], replayed[name], t_s) for name in names]


def _compare(
    name: str, one: NDArray[np.float64], two: NDArray[np.float64], t_s: NDArray[np.float64]
) -> Channel:
    rows = min(one.size, two.size)
    one, two = one[:rows], two[:rows]
    # Bits, not values: 0.0 and -0.0 are two things; any NaN means "does not exist".
    same = (one.view(np.int64) == two.view(np.int64)) | (np.isnan(one) & np.isnan(two))
    where = np.flatnonzero(~same)
    if where.size == 0:
        return Channel(name, rows)
    at = int(where[0])
    return Channel(
        name,
        rows,
        int(where.size),
        float(t_s[at]),
        float(one[at]),
        float(two[at]),
        float(np.abs(one[where] - two[where]).max()),
        _rms(one - two),
    )


def _rms(difference: NDArray[np.float64]) -> float:
    known = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else math.nan


def compare_link(
    recorded: Iterable[LoggedFrame], replayed: Iterable[LoggedFrame], start_unix_us: int
) -> list[Channel]:
    """Compare the frames of each direction, their bytes and times, over those that both have."""
    there, here = list(recorded), list(replayed)
    return [
        _compare_frames(
            name,
            [frame for frame in there if (frame.frame[5] == BOARD_SYSTEM) == from_board],
            [frame for frame in here if (frame.frame[5] == BOARD_SYSTEM) == from_board],
            start_unix_us,
        )
        for name, from_board in (("link received", True), ("link sent", False))
    ]


def _compare_frames(
    name: str, one: Sequence[LoggedFrame], two: Sequence[LoggedFrame], start_unix_us: int
) -> Channel:
    rows = min(len(one), len(two))
    different = [(a, b) for a, b in zip(one[:rows], two[:rows], strict=True) if a != b]
    if not different:
        return Channel(name, rows)
    first, other = different[0]
    return Channel(
        name,
        rows,
        len(different),
        (first.unix_us - start_unix_us) * 1e-6,
        _frame_text(first.frame),
        _frame_text(other.frame),
        math.nan,
        math.nan,
    )


def _frame_text(frame: bytes) -> str:
    """Return message name, sequence number and payload of a frame."""
    entry = dialect.mavlink_map.get(int.from_bytes(frame[7:10], "little"))
    name = entry.msgname if entry else "unknown message"
    return f"{name} #{frame[4]} {frame[10:-2].hex()}"
