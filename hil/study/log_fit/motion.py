"""Fits of what is seen in poses: commands to motion (the twin), and wheels to motion (odometry)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hil.study.log_fit.estimate import Found, Parameter, estimate, first_values
from hil.study.log_fit.model import CELL_S, Grid, Track, body_track, held_means, odometry_track
from hil.study.log_fit.windows import Eye, Mount

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.study.log_fit.signals import Pair2, Poses
    from hil.study.log_fit.windows import Windows

    Array = NDArray[np.float64]
    Motion = Callable[[Pair2, Grid, dict[str, float]], Track]

# Noise of poses at first; then what the first fit leaves.
_SIGMA_M, _SIGMA_RAD = 0.005, 0.02
_LEAST_SIGMA_M, _LEAST_SIGMA_RAD = 1e-4, 1e-4
# Largest share of a command that a dead zone may be, and how long a robot may take to answer.
_MOST_ZONE = 0.8
_STANDS = 0.005  # scales below this are of a robot that stands
_LONGEST_LAG_S, _LONGEST_DEAD_S = 3.0, 1.5
# What the cells of 10 ms leave unknown.
_FLOOR_S, _FLOOR_RATIO = 0.1 * CELL_S, 2e-4

MOUNT = (
    Parameter("pose_ahead_m", "m", "where the pose is taken, ahead of the wheels' middle", 0.0,
              -0.6, 0.6, 0.02, 1e-3, could_be=0.15),
    Parameter("pose_left_m", "m", "the same, to the left", 0.0, -0.6, 0.6, 0.02, 1e-3,
              could_be=0.03),
    Parameter("heading_offset_rad", "rad", "heading seen less the direction of driving", 0.0, -1.6,
              1.6, 0.02, 1e-3, could_be=0.03),
)  # fmt: skip
SCALES = (
    Parameter("distance_scale_ratio", "ratio", "way driven over way asked", 1.0, -60.0, 60.0, 0.15,
              1e-3, share=0.15, main=True),
    Parameter("turn_scale_ratio", "ratio", "turn made over turn asked", 1.0, -60.0, 60.0, 0.15,
              1e-3, share=0.15, main=True),
    Parameter("veer_rad_m", "rad/m", "turn to the left per way driven straight", 0.0, -5.0, 5.0,
              0.2, 1e-3, could_be=0.05),
)  # fmt: skip


def body_parameters(command: Pair2) -> tuple[Parameter, ...]:
    """Return what commands of the body may tell; dead zones are bounded by the commands given."""
    forward = max(_MOST_ZONE * float(np.abs(command.first).max()), 1e-3)
    turn = max(_MOST_ZONE * float(np.abs(command.second).max()), 1e-3)
    return (
        *SCALES,
        Parameter("forward_lag_s", "s", "first-order time constant of the forward speed", 0.0, 0.0,
                  _LONGEST_LAG_S, 0.06, 2e-3, share=0.3, could_be=0.2),
        Parameter("turn_lag_s", "s", "first-order time constant of the turn rate", 0.0, 0.0,
                  _LONGEST_LAG_S, 0.06, 2e-3, share=0.3, could_be=0.2),
        Parameter("dead_time_s", "s", "from a command as logged to its effect as seen", 0.0, 0.0,
                  _LONGEST_DEAD_S, 0.06, 2e-3, share=0.3, could_be=0.2),
        Parameter("forward_dead_zone_m_s", "m/s", "command up to which nothing drives; more is less "
                  "by as much", 0.0, 0.0, forward, 0.1 * forward, 0.002 * forward,
                  share=0.5, could_be=0.06 * forward),
        Parameter("turn_dead_zone_rad_s", "rad/s", "the same for turning", 0.0, 0.0, turn,
                  0.1 * turn, 0.002 * turn, share=0.5, could_be=0.06 * turn),
        *MOUNT,
    )  # fmt: skip


def odometry_parameters() -> tuple[Parameter, ...]:
    """Return what wheel speeds and poses together may tell."""
    delay = Parameter(
        "pose_delay_s", "s", "pose as logged behind the wheel speeds as logged", 0.0, -1.0, 1.0,
        0.06, 2e-3, share=0.3, could_be=0.2,
    )  # fmt: skip
    return (*SCALES, delay, *MOUNT)


@dataclass(frozen=True, slots=True)
class MotionFit:
    """Parameters found, and the motion over the whole log that they give."""

    kind: str
    found: Found
    track: Track
    mount: Mount
    sigma_m: float
    sigma_rad: float


def fit_body(command: Pair2, poses: Poses, windows: Windows, grid: Grid) -> MotionFit:
    """Fit the twin: commands of the body to poses."""
    parameters = body_parameters(command)
    starts = [
        {"forward_lag_s": lag, "turn_lag_s": lag, "dead_time_s": dead}
        for lag in (0.02, 0.2, 0.6)
        for dead in (0.0, 0.1, 0.25, 0.5, 0.9)
    ]
    return _fit("body", body_track, parameters, starts, command, poses, windows, grid)


def fit_odometry(odometry: Pair2, poses: Poses, windows: Windows, grid: Grid) -> MotionFit:
    """Fit the odometry: body speeds of the wheels to poses."""
    starts = [{"pose_delay_s": delay} for delay in (0.0, -0.2, -0.1, 0.1, 0.2, 0.4)]
    return _fit(
        "odometry", odometry_track, odometry_parameters(), starts, odometry, poses, windows, grid
    )


def _fit(
    kind: str,
    motion: Motion,
    parameters: tuple[Parameter, ...],
    starts: list[dict[str, float]],
    source: Pair2,
    poses: Poses,
    windows: Windows,
    grid: Grid,
) -> MotionFit:
    eye = Eye(poses, windows.fitted)
    sigma_m, sigma_rad = _SIGMA_M, _SIGMA_RAD
    signs = [
        {"distance_scale_ratio": scale, "turn_scale_ratio": turn}
        for scale, turn in _first_scales(source, grid, eye)
    ]
    begin = [start | scales for start in starts for scales in signs]
    floor = {
        "distance_scale_ratio": _FLOOR_RATIO, "turn_scale_ratio": _FLOOR_RATIO,
        "forward_lag_s": _FLOOR_S, "turn_lag_s": _FLOOR_S, "dead_time_s": _FLOOR_S,
        "pose_delay_s": _FLOOR_S, "pose_ahead_m": 2e-4, "pose_left_m": 2e-4,
        "heading_offset_rad": 2e-4, "veer_rad_m": 2e-4,
        "forward_dead_zone_m_s": 2e-4, "turn_dead_zone_rad_s": 5e-4,
    }  # fmt: skip
    if poses.theta_rad is None:
        # Backwards and turned round looks the same without a heading: forward is taken.
        parameters = tuple(
            replace(item, low=0.0) if item.name == "distance_scale_ratio" else item
            for item in parameters
            if item.name != "heading_offset_rad"
        )
        begin = [start for start in begin if start["distance_scale_ratio"] > 0.0]
    usual = {"heading_offset_rad": 0.0}

    def parts(point: dict[str, float]) -> tuple[Array, Array, Array | None]:
        track = motion(source, grid, point)
        return eye.residuals(track, grid, mount_of(point), sigma_m, sigma_rad)

    def residual(point: dict[str, float]) -> Array:
        dx, dy, dtheta = parts(usual | point)
        rows = [dx / sigma_m, dy / sigma_m]
        if dtheta is not None:
            rows.append(dtheta / sigma_rad)
        return np.concatenate(rows)

    window = np.tile(eye.window, 2 if poses.theta_rad is None else 3)
    values = first_values(parameters, residual, begin)
    dx, dy, dtheta = parts(usual | values)
    sigma_m = max(_spread(np.concatenate((dx, dy))), _LEAST_SIGMA_M)
    if dtheta is not None:
        sigma_rad = max(_spread(dtheta), _LEAST_SIGMA_RAD)
    found = estimate(parameters, residual, window, [values], floor)
    point = usual | found.values
    track = motion(source, grid, point)
    return MotionFit(kind, found, track, mount_of(point), sigma_m, sigma_rad)


def mount_of(point: dict[str, float]) -> Mount:
    """Return where the pose is taken."""
    return Mount(point["pose_ahead_m"], point["pose_left_m"], point["heading_offset_rad"])


def _spread(values: Array) -> float:
    """Return a standard deviation that outliers do not move."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _first_scales(source: Pair2, grid: Grid, eye: Eye) -> list[tuple[float, float]]:
    """Return scales to begin with: 1, and those of the whole turn and way in each window.

    So that a log in another unit, or with another sign, is still found and said.
    """
    turn = 1.0
    driven, turned = (
        np.concatenate(([0.0], np.cumsum(held_means(source.t_s, part, grid.edges_s)) * grid.cell_s))
        for part in (source.first, source.second)
    )
    if eye.theta_rad is not None:
        made = _over_windows(eye, eye.theta_rad)
        asked = _over_windows(eye, np.interp(eye.t_s, grid.edges_s, turned))
        if float(asked @ asked) > 1e-9:
            turn = float(made @ asked) / float(asked @ asked)
    chords = np.hypot(_over_windows(eye, eye.x_m), _over_windows(eye, eye.y_m))
    ways = np.abs(_over_windows(eye, np.interp(eye.t_s, grid.edges_s, driven)))
    way = float(chords.sum() / ways.sum()) if ways.sum() > 1e-9 else 1.0
    turn = turn if 0.01 < abs(turn) < 50.0 else 1.0
    way = min(max(way, 0.02), 50.0)
    found = [(1.0, 1.0), (way, turn), (-way, turn), (1.0, turn)]
    return list(dict.fromkeys(found))


def _over_windows(eye: Eye, values: Array) -> Array:
    last = eye.first + eye.sizes - 1
    return np.asarray(values[last] - values[eye.first])


def odd_signs(found: Found) -> list[str]:
    """Return a line for each scale that is negative or far from 1: a sign or unit of the mapping."""
    said = []
    for name, what in (("distance_scale_ratio", "forward"), ("turn_scale_ratio", "turn")):
        value = found.values[name]
        if not found.told(name):
            continue
        if abs(value) < _STANDS:
            said.append(f"{what} does not happen, though it is asked for: wheels off the ground?")
        elif value < 0.0:
            said.append(f"{what} goes the other way than asked ({value:.3g}): turn the sign of its "
                        "scale in the mapping, or left and right are swapped")  # fmt: skip
        elif not 0.25 < value < 4.0:
            close = min((math.pi / 180.0, 180.0 / math.pi, 1e-3, 1e3), key=lambda u: abs(
                math.log(value / u)))  # fmt: skip
            said.append(f"{what} is {value:.3g} times what was asked: another unit? "
                        f"{close:.4g} is near" )  # fmt: skip
    return said
