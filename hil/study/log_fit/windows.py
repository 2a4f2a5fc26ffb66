"""Poses cut into windows; within each, where the model starts is free, and only its motion is judged."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.study.log_fit.model import Grid, Track
    from hil.study.log_fit.signals import Poses

    Array = NDArray[np.float64]
    Places = NDArray[np.intp]

WINDOW_S = 2.0
SHORTEST_S = 0.5
_LEAST_POSES = 6
_FITTED_SHARE = 0.7
_MOVED_M, _MOVED_RAD = 0.01, 0.03


@dataclass(frozen=True, slots=True)
class Windows:
    """Spans [start, stop) of poses; those held out come after all that are fitted."""

    fitted: tuple[slice, ...]
    held_out: tuple[slice, ...]
    length_s: float


def cut(poses: Poses, avoid: Sequence[tuple[float, float]], active: NDArray[np.bool_]) -> Windows:
    """Return windows in which something happens, none across a hole in the poses or over `avoid`.

    `active` says at each pose whether the robot is being told to move. The last third by number is
    held out.
    """
    length_s = _length(poses, active)
    holes = [
        (float(poses.t_s[k]), float(poses.t_s[k + 1]))
        for k in np.flatnonzero(np.diff(poses.t_s) > _hole_s(poses))
    ]
    found: list[slice] = []
    borders = [float(poses.t_s[0]), *(b for _, b in holes), math.inf]
    ends = [*(a for a, _ in holes), float(poses.t_s[-1])]
    for begin_s, end_s in zip(borders, ends, strict=False):
        count = max(int((end_s - begin_s) / length_s), 1)
        step_s = min((end_s - begin_s) / count, 1.5 * length_s)
        for k in range(count):
            start_s = begin_s + k * step_s
            inside = (poses.t_s >= start_s) & (poses.t_s < start_s + step_s)
            at = np.flatnonzero(inside)
            if at.size < _LEAST_POSES or poses.t_s[at[-1]] - poses.t_s[at[0]] < SHORTEST_S / 2:
                continue
            clear = all(b <= start_s or a >= start_s + step_s for a, b in avoid)
            span = slice(int(at[0]), int(at[-1]) + 1)
            if clear and (active[span].any() or _moves(poses, span)):
                found.append(span)
    fitted = max(math.ceil(_FITTED_SHARE * len(found)), 1)
    return Windows(tuple(found[:fitted]), tuple(found[fitted:]), length_s)


def _length(poses: Poses, active: NDArray[np.bool_]) -> float:
    """Return 2 s, or less where the robot is told to move for a short time, for some 14 windows."""
    steps_s = np.minimum(np.diff(poses.t_s), _hole_s(poses))
    told_s = float(steps_s[active[1:]].sum()) or float(steps_s.sum())
    # Without headings the direction of each window is free too: longer ones hold it better.
    factor = 1.0 if poses.theta_rad is not None else 2.0
    return max(min(factor * WINDOW_S, told_s / 14.0), SHORTEST_S)


def _hole_s(poses: Poses) -> float:
    return max(10.0 * float(np.median(np.diff(poses.t_s))), 0.6)


def _moves(poses: Poses, span: slice) -> bool:
    x, y = poses.x_m[span], poses.y_m[span]
    if math.hypot(float(np.ptp(x)), float(np.ptp(y))) > _MOVED_M:
        return True
    return poses.theta_rad is not None and float(np.ptp(poses.theta_rad[span])) > _MOVED_RAD


@dataclass(frozen=True, slots=True)
class Mount:
    """Where on the robot the pose is taken: ahead and left of the middle of the axle, and turned."""

    ahead_m: float = 0.0
    left_m: float = 0.0
    turned_rad: float = 0.0


class Eye:
    """Compares a motion with poses seen in some windows."""

    def __init__(self, poses: Poses, spans: Sequence[slice]) -> None:
        self.at = np.concatenate([np.arange(span.start, span.stop) for span in spans])
        sizes = np.array([span.stop - span.start for span in spans])
        self.first = np.concatenate(([0], np.cumsum(sizes)[:-1]))
        self.sizes = sizes
        self.window = np.repeat(np.arange(sizes.size), sizes)
        self.t_s = poses.t_s[self.at]
        self.x_m, self.y_m = poses.x_m[self.at], poses.y_m[self.at]
        self.theta_rad = None if poses.theta_rad is None else poses.theta_rad[self.at]

    def modelled(self, track: Track, grid: Grid, mount: Mount) -> tuple[Array, Array, Array]:
        """Return x, y, heading of the model's mount at the times of the poses."""
        x, y, theta = (
            np.interp(self.t_s, grid.edges_s, values)
            for values in (track.x_m, track.y_m, track.theta_rad)
        )
        cos, sin = np.cos(theta), np.sin(theta)
        return (
            x + mount.ahead_m * cos - mount.left_m * sin,
            y + mount.ahead_m * sin + mount.left_m * cos,
            theta,
        )

    def residuals(
        self, track: Track, grid: Grid, mount: Mount, sigma_m: float, sigma_rad: float
    ) -> tuple[Array, Array, Array | None]:
        """Return model - seen along, across (m) and in heading (rad), each window laid on at its best.

        Along and across are of the model's heading: how the world lies must not matter.
        """
        x, y, theta = self.modelled(track, grid, mount)
        return self.laid_on(x, y, theta, mount.turned_rad, sigma_m, sigma_rad)

    def laid_on(
        self, x: Array, y: Array, theta: Array, turned_rad: float, sigma_m: float, sigma_rad: float
    ) -> tuple[Array, Array, Array | None]:
        """Lay the model's points on the poses, window by window, and return what is left."""
        px, py = x - self._mean(x), y - self._mean(y)
        mx, my = self.x_m - self._mean(self.x_m), self.y_m - self._mean(self.y_m)
        if self.theta_rad is None:
            across = self._sum(px * my - py * mx)
            along = self._sum(px * mx + py * my)
            phi = np.arctan2(across, along)[self.window]
            cos, sin = np.cos(phi), np.sin(phi)
            return *_along(cos * px - sin * py - mx, sin * px + cos * py - my, theta + phi), None
        off = self.theta_rad - turned_rad - theta
        phi = self._mean(off)
        for _ in range(2):
            cos, sin = np.cos(phi), np.sin(phi)
            qx, qy = cos * px - sin * py, sin * px + cos * py
            pull = self._sum(qx * my - qy * mx) / sigma_m**2 + self._sum(off - phi) / sigma_rad**2
            stiff = self._sum(qx * mx + qy * my) / sigma_m**2 + self.sizes / sigma_rad**2
            phi = phi + (pull / np.maximum(stiff, 1e-9))[self.window]
        cos, sin = np.cos(phi), np.sin(phi)
        dx, dy = cos * px - sin * py - mx, sin * px + cos * py - my
        return *_along(dx, dy, theta + phi), phi - off

    def _sum(self, values: Array) -> Array:
        return np.asarray(np.add.reduceat(values, self.first))

    def _mean(self, values: Array) -> Array:
        return np.asarray((self._sum(values) / self.sizes)[self.window])


def _along(dx: Array, dy: Array, heading: Array) -> tuple[Array, Array]:
    cos, sin = np.cos(heading), np.sin(heading)
    return cos * dx + sin * dy, cos * dy - sin * dx
