"""Fit of wheel commands to wheel speeds: scale of each side, lag, dead time, dead zone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hil.study.log_fit.estimate import Found, Parameter, estimate, first_values
from hil.study.log_fit.model import CELL_S, Grid, dead_zone, held_means, lagged

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from hil.study.log_fit.signals import Pair2

    Array = NDArray[np.float64]

_WINDOW_S = 1.5
_FITTED_SHARE = 0.7
_LEAST_WINDOWS = 5
_MOVING_RAD_S = 0.2
_SIGMA_RAD_S, _LEAST_SIGMA_RAD_S = 0.3, 1e-3
_MOST_SAMPLES = 20_000


def fit_wheels(command: Pair2, wheels: Pair2, grid: Grid, holes: Sequence[tuple[float, float]]
               ) -> Found | None:  # fmt: skip
    """Fit wheel commands to wheel speeds: scale of each side, lag, dead time, dead zone."""
    most = max(float(np.abs(np.concatenate((command.first, command.second))).max()), 1e-3)
    parameters = (
        Parameter("wheel_scale_left_ratio", "ratio", "left wheel speed over what was asked", 1.0,
                  -60.0, 60.0, 0.1, 1e-3, share=0.1, main=True),
        Parameter("wheel_scale_right_ratio", "ratio", "right wheel speed over what was asked", 1.0,
                  -60.0, 60.0, 0.1, 1e-3, share=0.1, main=True),
        Parameter("wheel_lag_s", "s", "first-order time constant of the wheel speeds", 0.0, 0.0,
                  3.0, 0.05, 2e-3, share=0.3, could_be=0.5),
        Parameter("wheel_dead_time_s", "s", "from a wheel command as logged to its effect as logged",
                  0.0, -0.3, 1.5, 0.05, 2e-3, share=0.3, could_be=0.5),
        Parameter("wheel_dead_zone_rad_s", "rad/s", "wheel command up to which nothing turns", 0.0,
                  0.0, 0.8 * most, 0.08 * most, 0.002 * most, share=0.5, could_be=0.2 * most),
    )  # fmt: skip

    def model(point: dict[str, float]) -> tuple[Array, Array]:
        edges = grid.edges_s - point["wheel_dead_time_s"]
        sides = []
        for values, scale in ((command.first, "wheel_scale_left_ratio"),
                              (command.second, "wheel_scale_right_ratio")):  # fmt: skip
            asked = point[scale] * dead_zone(values, point["wheel_dead_zone_rad_s"])
            means = held_means(command.t_s, asked, edges)
            sides.append(lagged(means, grid.cell_s, point["wheel_lag_s"])[1])
        return sides[0], sides[1]

    starts = [
        {"wheel_lag_s": lag, "wheel_dead_time_s": dead}
        for lag in (0.03, 0.2, 0.6)
        for dead in (0.0, 0.1, 0.3)
    ]
    floor = {"wheel_scale_left_ratio": 2e-4, "wheel_scale_right_ratio": 2e-4,
             "wheel_lag_s": 0.1 * CELL_S, "wheel_dead_time_s": 0.1 * CELL_S,
             "wheel_dead_zone_rad_s": 1e-3}  # fmt: skip
    return _fit(parameters, model, command, wheels, grid, holes, starts, floor)


def _fit(
    parameters: tuple[Parameter, ...],
    model: Callable[[dict[str, float]], tuple[Array, Array]],
    source: Pair2,
    wheels: Pair2,
    grid: Grid,
    holes: Sequence[tuple[float, float]],
    starts: list[dict[str, float]],
    floor: dict[str, float],
) -> Found | None:
    """Return the fit over the first part of the log, None when too little happens in it."""
    stride = max(math.ceil(wheels.t_s.size / _MOST_SAMPLES), 1)
    t_s, seen = wheels.t_s[::stride], (wheels.first[::stride], wheels.second[::stride])
    at, window = lively_part(t_s, seen, source, holes)
    if not at.any():
        return None
    rows, sigma = t_s[at], _SIGMA_RAD_S

    def residual(point: dict[str, float]) -> Array:
        both = model(point)
        return np.concatenate([
            (np.interp(rows, grid.edges_s, side) - part[at]) / sigma
            for side, part in zip(both, seen, strict=True)
        ])  # fmt: skip

    groups = np.tile(window[at], 2)
    values = first_values(parameters, residual, starts)
    rest = residual(values) * sigma
    sigma = max(1.4826 * float(np.median(np.abs(rest))), _LEAST_SIGMA_RAD_S)
    return estimate(parameters, residual, groups, [values], floor)


def lively_part(
    t_s: Array, seen: tuple[Array, Array], source: Pair2, holes: Sequence[tuple[float, float]]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return which samples of wheel speeds are fitted, and the window of each.

    The first part of the windows in which wheels turn, `source` is there and no hole is near; none
    when there are too few.
    """
    window = (t_s / _WINDOW_S).astype(np.intp)
    usable = (t_s >= source.t_s[0]) & (t_s <= source.t_s[-1] + _WINDOW_S)
    for begin, end in holes:
        usable &= (t_s < begin) | (t_s > end + _WINDOW_S)
    lively = (np.abs(seen[0]) > _MOVING_RAD_S) | (np.abs(seen[1]) > _MOVING_RAD_S)
    names = [n for n in np.unique(window[usable]) if lively[window == n].any()]
    if len(names) < _LEAST_WINDOWS:
        return np.zeros_like(usable), window
    return usable & np.isin(window, names[: math.ceil(_FITTED_SHARE * len(names))]), window
