"""A rigid pattern of marks on the robot, found again on the floor: the planar pose that fits best."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.types import Pose

Array = NDArray[np.float64]


def fit_pose(body_m: ArrayLike, world_m: ArrayLike) -> tuple[Pose, float]:
    """Return the pose that takes body points, (N, 2), closest to world points, (N, 2), and the RMS.

    Least squares in closed form (planar Procrustes, no scale): theta is the angle of the sum of
    the products of centred points taken as complex numbers.
    """
    body = np.asarray(body_m, dtype=np.float64)
    world = np.asarray(world_m, dtype=np.float64)
    b0, w0 = body.mean(axis=0), world.mean(axis=0)
    b, w = body - b0, world - w0
    theta = math.atan2(float(np.sum(b[:, 0] * w[:, 1] - b[:, 1] * w[:, 0])), float(np.sum(b * w)))
    c, s = math.cos(theta), math.sin(theta)
    turn = np.array([[c, -s], [s, c]])
    x, y = w0 - turn @ b0
    rms = float(np.sqrt(np.mean(np.sum((b @ turn.T - w) ** 2, axis=1))))
    return Pose(float(x), float(y), theta), rms
