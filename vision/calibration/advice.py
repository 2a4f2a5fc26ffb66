"""What views of a board leave open, which of them say little, and what to show the camera next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRID_COLUMNS, GRID_ROWS = 8, 6
TILT_WANTED_DEG = 20.0
TILTED_WANTED = 3
COVERAGE_WANTED = 0.7
VIEWS_WANTED = 10
# Views whose farthest board is less than this factor further than the nearest are of one distance.
DISTANCE_FACTOR = 1.3
# A board that reaches less far than this, of the way from the middle to an edge, is in the middle.
MIDDLE_REACH = 0.6
FRONTAL_DEG = 10.0
NAMES_SHOWN = 5


@dataclass(frozen=True, slots=True)
class Sight:
    """What one view says: tilt, distance of the board in m, reach (1 at an edge of the image)."""

    name: str
    tilt_deg: float
    distance_m: float
    reach: float


def coverage(corners_px: Sequence[Array], size_px: tuple[int, int]) -> NDArray[np.int64]:
    """Return how many corners fell into each of 6 x 8 cells of the image, (rows, columns)."""
    every = np.vstack([*corners_px, np.empty((0, 2))])
    edges_v = np.linspace(-0.5, size_px[1] - 0.5, GRID_ROWS + 1)
    edges_u = np.linspace(-0.5, size_px[0] - 0.5, GRID_COLUMNS + 1)
    counts, _, _ = np.histogram2d(every[:, 1], every[:, 0], bins=(edges_v, edges_u))
    return counts.astype(np.int64)


def advise(
    covered: NDArray[np.int64], tilts_deg: Sequence[float], sights: Sequence[Sight] = ()
) -> list[str]:
    """Return what to show the camera next, most useful first; empty when the views suffice.

    With `sights` the views that say little are named.
    """
    advice = []
    if np.mean(covered > 0) < COVERAGE_WANTED:
        inside = [sight.name for sight in sights if sight.reach < MIDDLE_REACH]
        named = _named("only the middle is seen in", inside)
        advice.append(f"hold the board to the {_bare(covered)} of the image{named}")
    tilted = sum(tilt > TILT_WANTED_DEG for tilt in tilts_deg)
    if tilted < TILTED_WANTED:
        frontal = [sight.name for sight in sights if sight.tilt_deg < FRONTAL_DEG]
        named = _named("the board faces the camera in", frontal)
        advice.append(
            f"tilt the board by 20 to 40 deg ({tilted} of {TILTED_WANTED} such views){named}"
        )
    advice += _one_distance(sights)
    if len(tilts_deg) < VIEWS_WANTED:
        more = VIEWS_WANTED - len(tilts_deg)
        advice.append(f"take {more} more views ({VIEWS_WANTED} make the error figures stable)")
    return advice


def _bare(covered: NDArray[np.int64]) -> str:
    """Return the parts of the image that are least covered, in words."""
    thirds = {"upper": slice(0, 2), "middle": slice(2, 4), "lower": slice(4, 6)}
    sides = {"left": slice(0, 3), "centre": slice(3, 5), "right": slice(5, 8)}
    share = {
        f"{down} {across}": float(np.mean(covered[rows, columns] == 0))
        for down, rows in thirds.items()
        for across, columns in sides.items()
    }
    bare = sorted((name for name in share if share[name] > 0.5), key=lambda n: -share[n])
    return ", ".join(bare[:3]) or "edges"


def _one_distance(sights: Sequence[Sight]) -> list[str]:
    """Return the advice to move the board along the axis, where all views are of one distance."""
    if not sights:
        return []
    distances_m = [sight.distance_m for sight in sights]
    near_m, far_m = min(distances_m), max(distances_m)
    if far_m > DISTANCE_FACTOR * near_m:
        return []
    return [
        f"bring the board nearer and further: it is {near_m:.2f} to {far_m:.2f} m away in all"
        f" {len(sights)} views"
    ]


def _named(what: str, names: Sequence[str]) -> str:
    if not names:
        return ""
    more = len(names) - NAMES_SHOWN
    listed = ", ".join(names[:NAMES_SHOWN]) + (f" and {more} more" if more > 0 else "")
    return f"; {what} {listed}"
