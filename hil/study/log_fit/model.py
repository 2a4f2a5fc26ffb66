"""The twin that a log can tell: a unicycle behind dead zone, dead time and first-order lag.

Everything is linear filtering on a fine grid of equal cells, so that a log of minutes takes
milliseconds and the result is smooth in every parameter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import lfilter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.study.log_fit.signals import Pair2

    Array = NDArray[np.float64]

CELL_S = 0.01
_MOST_CELLS = 400_000
_LEAST_LAG_S = 1e-5


@dataclass(frozen=True, slots=True)
class Grid:
    """Equal cells from `start_s` on; `edges_s` has one more entry than there are cells."""

    edges_s: Array
    cell_s: float


def grid_over(end_s: float) -> Grid:
    """Return cells of 10 ms, or wider ones for a log of hours, from 0 to beyond `end_s`."""
    cell_s = max(CELL_S, end_s / _MOST_CELLS)
    count = int(end_s / cell_s) + 2
    return Grid(np.asarray(cell_s * np.arange(count + 1), dtype=np.float64), cell_s)


def dead_zone(values: Array, width: float) -> Array:
    """Return values drawn towards zero by `width`, zero within it."""
    return np.asarray(np.sign(values) * np.maximum(np.abs(values) - width, 0.0))


def held_means(t_s: Array, values: Array, edges_s: Array) -> Array:
    """Return the mean over each cell of a signal that holds its value until the next; 0 before."""
    whole = np.concatenate(([0.0], np.cumsum(values[:-1] * np.diff(t_s))))
    after = np.maximum(edges_s - t_s[-1], 0.0) * values[-1]
    return np.asarray(np.diff(np.interp(edges_s, t_s, whole) + after) / np.diff(edges_s))


def joined_means(t_s: Array, values: Array, edges_s: Array) -> Array:
    """Return the mean over each cell of a signal that runs straight between its values."""
    at = np.interp(edges_s, t_s, values)
    return 0.5 * (at[:-1] + at[1:])


def lagged(means: Array, cell_s: float, lag_s: float) -> tuple[Array, Array]:
    """Return the first-order response from rest: its mean over each cell, its value at each edge."""
    if lag_s < _LEAST_LAG_S:
        return means, np.concatenate(([0.0], means))
    keep = float(np.exp(-cell_s / lag_s))
    ends = np.concatenate(([0.0], lfilter([1.0 - keep], [1.0, -keep], means)))
    return means + (ends[:-1] - means) * (lag_s / cell_s) * (1.0 - keep), ends


@dataclass(frozen=True, slots=True)
class Track:
    """Where the model is at the edges of the grid: axle in m, heading in rad, from 0, 0, 0."""

    x_m: Array
    y_m: Array
    theta_rad: Array
    forward_m_s: Array
    turn_rad_s: Array


def drive(forward: Array, turn: Array, cell_s: float) -> Track:
    """Integrate mean speeds of cells; each cell is driven as an arc."""
    theta = np.concatenate(([0.0], np.cumsum(turn) * cell_s))
    middle = 0.5 * (theta[:-1] + theta[1:])
    chord = forward * cell_s * np.sinc(turn * cell_s / (2.0 * np.pi))
    x = np.concatenate(([0.0], np.cumsum(chord * np.cos(middle))))
    y = np.concatenate(([0.0], np.cumsum(chord * np.sin(middle))))
    return Track(x, y, theta, forward, turn)


def body_track(command: Pair2, grid: Grid, point: dict[str, float]) -> Track:
    """Return the motion that commands of the body give with these parameters (body.py)."""
    edges = grid.edges_s - point["dead_time_s"]
    speeds = []
    for values, zone, scale, lag in (
        (command.first, "forward_dead_zone_m_s", "distance_scale_ratio", "forward_lag_s"),
        (command.second, "turn_dead_zone_rad_s", "turn_scale_ratio", "turn_lag_s"),
    ):
        asked = point[scale] * dead_zone(values, point[zone])
        speeds.append(lagged(held_means(command.t_s, asked, edges), grid.cell_s, point[lag])[0])
    turn = speeds[1] + point["veer_rad_m"] * speeds[0]
    return drive(speeds[0], turn, grid.cell_s)


def odometry_track(wheels: Pair2, grid: Grid, point: dict[str, float]) -> Track:
    """Return the motion that body speeds of the wheels (odometry) give with these parameters."""
    edges = grid.edges_s - point["pose_delay_s"]
    forward = point["distance_scale_ratio"] * joined_means(wheels.t_s, wheels.first, edges)
    turn = point["turn_scale_ratio"] * joined_means(wheels.t_s, wheels.second, edges)
    return drive(forward, turn + point["veer_rad_m"] * forward, grid.cell_s)
