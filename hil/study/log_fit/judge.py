"""How well a twin foretells what it was not fitted to, beside plain odometry and standing still."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.study.log_fit.windows import Eye, Mount

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from hil.study.log_fit.model import Grid, Track
    from hil.study.log_fit.signals import Poses

    Array = NDArray[np.float64]

# A foretelling is laid on what was seen in this time at its beginning, and left alone after that.
LAID_ON_S = 0.25


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of one foreteller over windows, root mean squares; heading NaN where none was seen."""

    position_m: float
    position_end_m: float
    heading_end_rad: float
    per_window_end_m: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the score for a JSON document."""
        heading = self.heading_end_rad
        return {
            "position_rms_m": self.position_m,
            "position_rms_at_end_m": self.position_end_m,
            "heading_rms_at_end_rad": heading if math.isfinite(heading) else None,
            "position_at_end_m": list(self.per_window_end_m),
        }

    def text(self) -> str:
        """Return the score in words."""
        heading = ""
        if math.isfinite(self.heading_end_rad):
            heading = f", heading {math.degrees(self.heading_end_rad):.2f} deg at its end"
        return f"{1e3 * self.position_m:.1f} mm ({1e3 * self.position_end_m:.1f} mm){heading}"


def scores(
    poses: Poses,
    spans: Sequence[slice],
    foretellers: Mapping[str, tuple[Track | None, Mount]],
    grid: Grid,
) -> dict[str, Score]:
    """Return the score of each; a track of None stands still."""
    return {
        name: _score(poses, spans, track, mount, grid)
        for name, (track, mount) in foretellers.items()
        if spans
    }


def _score(
    poses: Poses, spans: Sequence[slice], track: Track | None, mount: Mount, grid: Grid
) -> Score:
    squares, ends, turns = [], [], []
    for span in spans:
        error_m, error_rad = window_error(poses, span, track, mount, grid)
        squares.append(error_m**2)
        ends.append(float(error_m[-1]))
        turns.append(error_rad)
    return Score(
        float(np.sqrt(np.concatenate(squares).mean())),
        float(np.sqrt(np.mean(np.square(ends)))),
        float(np.sqrt(np.mean(np.square(turns)))),
        tuple(ends),
    )


def window_error(
    poses: Poses, span: slice, track: Track | None, mount: Mount, grid: Grid
) -> tuple[Array, float]:
    """Return the distance from what was seen at each pose of a window, and the heading's at its end."""
    x, y, turned = foretold(poses, span, track, mount, grid)
    error_m = np.hypot(x - poses.x_m[span], y - poses.y_m[span])
    if poses.theta_rad is None:
        return error_m, math.nan
    return error_m, float(turned[-1] - poses.theta_rad[span][-1])


def foretold(
    poses: Poses, span: slice, track: Track | None, mount: Mount, grid: Grid
) -> tuple[Array, Array, Array]:
    """Return x, y, heading as foretold in a window, laid on the poses at its beginning."""
    eye = Eye(poses, [span])
    early = eye.t_s <= eye.t_s[0] + LAID_ON_S
    if early.sum() < 3:
        early = np.arange(eye.t_s.size) < 3
    seen_x, seen_y = float(eye.x_m[early].mean()), float(eye.y_m[early].mean())
    if track is None:
        still = np.ones_like(eye.t_s)
        heading = 0.0 if eye.theta_rad is None else float(eye.theta_rad[early].mean())
        return seen_x * still, seen_y * still, heading * still
    x, y, theta = eye.modelled(track, grid, mount)
    if eye.theta_rad is None:
        # No heading was seen: the direction is that of the whole window at its best.
        mx, my = eye.x_m - eye.x_m.mean(), eye.y_m - eye.y_m.mean()
        px, py = x - x.mean(), y - y.mean()
        phi = math.atan2(float((px * my - py * mx).sum()), float((px * mx + py * my).sum()))
    else:
        phi = float((eye.theta_rad - mount.turned_rad - theta)[early].mean())
    cos, sin = math.cos(phi), math.sin(phi)
    px, py = x - x[early].mean(), y - y[early].mean()
    return (
        seen_x + cos * px - sin * py,
        seen_y + sin * px + cos * py,
        theta + phi + mount.turned_rad,
    )
