"""A rigid pattern of marks on the robot, found again on the floor: the planar pose that fits best."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.types import Pose, wrap_pi
from vision import _marks

if TYPE_CHECKING:
    from hil.core.types import Covariance
    from vision._marks import Spot

Array = NDArray[np.float64]

Point = tuple[float, float]


def fit_pose(body_m: ArrayLike, world_m: ArrayLike) -> tuple[Pose, float]:
    """Return the pose that takes body points, (N, 2), closest to world points, (N, 2), and the RMS.

    Least squares in closed form (planar Procrustes, no scale): theta is the angle of the sum of
    the products of centred points taken as complex numbers.
    """
    body = np.asarray(body_m, dtype=np.float64)
    world = np.asarray(world_m, dtype=np.float64)
    b0, w0 = np.add.reduce(body) / len(body), np.add.reduce(world) / len(world)
    b, w = body - b0, world - w0
    across = np.add.reduce(b[:, 0] * w[:, 1] - b[:, 1] * w[:, 0])
    theta = math.atan2(float(across), float(np.add.reduce(b * w, axis=None)))
    c, s = math.cos(theta), math.sin(theta)
    turn = np.array([[c, -s], [s, c]])
    x, y = (w0 - turn @ b0).tolist()
    return Pose(x, y, theta), float(np.sqrt(np.mean(np.sum((b @ turn.T - w) ** 2, axis=1))))


def weighted_pose(
    body_m: tuple[Point, Point], one: Spot, other: Spot
) -> tuple[Pose, Covariance, float]:
    """Return the pose that takes two points of the robot, (x, y), to spots of known covariance.

    Also returned: the covariance of (x_m, y_m, theta_rad), and the weighted sum of squares that is left,
    with one degree of freedom. Two steps of Gauss and Newton from the unweighted pose.
    """
    x_m, y_m, theta_rad, covariance, left = _marks.weighted_pose(body_m, one, other)
    return Pose(x_m, y_m, wrap_pi(theta_rad)), covariance, left
