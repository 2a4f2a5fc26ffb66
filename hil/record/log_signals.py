"""What the readers of foreign logs share: signals on one time, counters, and time that falls back."""

from __future__ import annotations

import bisect
import importlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil.core.errors import BadInput
from hil.record.log_mapping import Disorder, Source

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Places = NDArray[np.intp]

POSE = ("est_x_m", "est_y_m", "est_theta_rad")
MOST_BYTES = 256_000_000
_STRAY_SHARE = 0.01
_COUNTERS = (2.0**16, 2.0**24, 2.0**31, 2.0**32)


@dataclass(frozen=True, slots=True)
class Signals:
    """Columns read from a log, all on the ascending times `t_s`, and the frames to keep.

    `notes` say in one line each what was left out, repaired or assumed.
    """

    t_s: Array
    columns: dict[str, Array]
    frames: tuple[tuple[float, bytes], ...] = ()
    notes: tuple[str, ...] = ()


def read_bytes(path: Path) -> bytes:
    """Return a log's bytes; raises BadInput for one that is too large or cannot be read."""
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise BadInput(
                f"{path}: {size / 1e6:.0f} MB, the limit is {MOST_BYTES / 1e6:.0f} MB; cut out the "
                "part that is the run"
            )
        return path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None


def read_format(path: Path, package: str, kind: str, magic: bytes, named: str) -> bytes:
    """Return the bytes of a log whose reader is a package of an extra; raises BadInput.

    `named` is how a file of the kind is called where another one is refused.
    """
    try:
        importlib.import_module(package)
    except ImportError:
        raise BadInput(
            f"{path}: reading {kind} needs the package {package}: pip install 'skid-steer-hil[logs]'"
        ) from None
    data = read_bytes(path)
    if not data.startswith(magic):
        raise BadInput(f"{path}: does not begin as {named} does")
    return data


def counted_on(raw: Array, wraps_at: float) -> Array:
    """Return the readings of a counter that starts again from 0 at `wraps_at`, counted on.

    The step between two readings is taken as the one below half of the range. NaN stays NaN.
    """
    result = raw.copy()
    known = np.flatnonzero(np.isfinite(raw))
    if wraps_at > 0.0 and known.size:
        values = raw[known]
        steps = (np.diff(values) + wraps_at / 2.0) % wraps_at - wraps_at / 2.0
        result[known] = values[0] + np.concatenate(([0.0], np.cumsum(steps)))
    return result


def scaled(raw: Array, source: Source) -> Array:
    """Return raw readings in the unit of their column."""
    return counted_on(raw, source.wraps_at) * source.scale + source.offset


def in_order(
    t_s: Array, disorder: Disorder, refusal: Callable[[int], str], what: str
) -> tuple[Places, list[str]]:
    """Return the places of finite times in ascending order, and what was done to have it.

    `refusal(k)` is the line for time falling back at place k. A single time outside those of its
    neighbours is left out (a damaged stamp), unless there are many. Raises BadInput.
    """
    places = np.flatnonzero(np.isfinite(t_s))
    if disorder == "sort":
        falls = int(np.count_nonzero(np.diff(t_s[places]) < 0.0))
        ordered: Places = places[np.argsort(t_s[places], kind="stable")]
        said = f"time falls back {falls} times: {what} sorted by their time"
        return ordered, [said] if falls else []
    if disorder == "skip":
        kept = places[ascending(t_s[places])]
        left = places.size - kept.size
        said = f"{left} of {places.size} {what} have a time before one already read: left out"
        return kept, [said] if left else []
    stray = _strays(t_s[places])
    notes = []
    if 0 < stray.size <= max(1.0, _STRAY_SHARE * places.size):
        where = t_s[places[stray[0]]]
        notes.append(
            f"{stray.size} of {places.size} {what} have a time outside those of their neighbours "
            f"(the first {where:.6g} s): left out"
        )
        places = np.delete(places, stray)
    falls_at = np.flatnonzero(np.diff(t_s[places]) < 0.0)
    if not falls_at.size:
        return places, notes
    if disorder == "refuse":
        raise BadInput(refusal(int(places[falls_at[0] + 1])))
    kept = places[: falls_at[0] + 1]
    left = places.size - kept.size
    notes.append(f"time falls back: cut there, {left} of {places.size} {what} left out")
    return kept, notes


def ascending(t_s: Array) -> Places:
    """Return the places of the longest sequence of times of which none falls back."""
    if not (np.diff(t_s) < 0.0).any():
        return np.arange(t_s.size)
    lasts: list[float] = []  # [k]: the least last time of a sequence of k + 1
    at: list[int] = []
    before = np.full(t_s.size, -1, dtype=np.intp)
    for place, value in enumerate(t_s.tolist()):
        length = bisect.bisect_right(lasts, value)
        before[place] = at[length - 1] if length else -1
        lasts[length : length + 1] = [value]
        at[length : length + 1] = [place]
    found = [at[-1]]
    while before[found[-1]] >= 0:
        found.append(int(before[found[-1]]))
    return np.array(found[::-1], dtype=np.intp)


def _strays(t_s: Array) -> Places:
    """Return the places of single times that lie outside those before and after them."""
    if t_s.size < 3:
        return np.zeros(0, dtype=np.intp)
    before, here, after = t_s[:-2], t_s[1:-1], t_s[2:]
    stray = (after >= before) & ((here > after) | (here < before))
    stray[1:] &= ~stray[:-1]
    return np.flatnonzero(stray) + 1


def fall_text(before_s: float, after_s: float) -> str:
    """Return the words for a clock that went back, and what can be done."""
    return (
        f"time falls back by {before_s - after_s:.6g} s, from {before_s:.6g} s to {after_s:.6g} s "
        '(clock set back?); in a mapping, disorder = "cut" ends the log there and "sort" sorts it'
    )


def counter_hint(before: float, after: float) -> str:
    """Return a hint when two raw readings look like a counter that started again."""
    for wraps_at in _COUNTERS:
        if 0.9 * wraps_at < before < wraps_at and 0.0 <= after < 0.1 * wraps_at:
            return f"; a counter that wrapped? say wraps_at = {wraps_at:.0f} in t"
    return ""


def one_stamp_each(t_s: Array) -> tuple[Places, list[str]]:
    """Return the places of the first of equal times in a row, and a note on the others."""
    first = np.concatenate(([True], np.diff(t_s) > 0.0)) if t_s.size else np.zeros(0, dtype=bool)
    places = np.flatnonzero(first)
    left = t_s.size - places.size
    said = f"{left} of {t_s.size} poses have the time of the one before: left out"
    return places, [said] if left else []


def whole_poses(t_s: Array, columns: dict[str, Array], where: str) -> Signals:
    """Return the rows whose pose is whole, from t = 0 on, one for each time; raises BadInput."""
    missing = [name for name in POSE if name not in columns]
    if missing:
        raise BadInput(
            f"{where}: gives no {missing[0]}: a record needs the pose {', '.join(POSE)}; say in a "
            "mapping where it is"
        )
    whole = np.all([np.isfinite(columns[name]) for name in POSE], axis=0)
    notes = []
    if not whole.all():
        empty = next(name for name in POSE if not np.isfinite(columns[name]).all())
        notes.append(
            f"{np.count_nonzero(~whole)} of {t_s.size} rows have no whole pose ({empty}): left out"
        )
    rows = np.flatnonzero(whole)
    places, said = one_stamp_each(t_s[rows])
    rows = rows[places]
    if rows.size < 2:
        raise BadInput(
            f"{where}: {rows.size} poses with a time of their own, at least 2 are needed"
            + "".join(f" ({note})" for note in (*notes, *said))
        )
    kept = {name: values[rows] for name, values in columns.items()}
    return Signals(t_s[rows] - t_s[rows[0]], kept, notes=(*notes, *said))


def held(times: Sequence[float], values: Sequence[float], at: Sequence[float]) -> Array:
    """Return the latest value at or before each time; NaN before the first. `times` ascend."""
    places = [bisect.bisect_right(times, t_s) - 1 for t_s in at]
    return np.array([values[place] if place >= 0 else math.nan for place in places])
