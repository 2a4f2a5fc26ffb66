"""A rigid pattern of marks on the robot, found again on the floor: the planar pose that fits best."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.types import Pose, wrap_pi

Array = NDArray[np.float64]

WEIGHTED_STEPS = 2  # of Gauss and Newton from the unweighted pose


def fit_pose(body_m: ArrayLike, world_m: ArrayLike) -> tuple[Pose, float]:
    """Return the pose that takes body points, (N, 2), closest to world points, (N, 2), and the RMS.

    Least squares in closed form (planar Procrustes, no scale): theta is the angle of the sum of
    the products of centred points taken as complex numbers.
    """
    body = np.asarray(body_m, dtype=np.float64)
    world = np.asarray(world_m, dtype=np.float64)
    pose, turn, b, w = _fitted(body, world)
    return pose, float(np.sqrt(np.mean(np.sum((b @ turn.T - w) ** 2, axis=1))))


def _fitted(body: Array, world: Array) -> tuple[Pose, Array, Array, Array]:
    """Return the pose, its rotation, and both patterns about their middles."""
    b0, w0 = np.add.reduce(body) / len(body), np.add.reduce(world) / len(world)
    b, w = body - b0, world - w0
    across = np.add.reduce(b[:, 0] * w[:, 1] - b[:, 1] * w[:, 0])
    theta = math.atan2(float(across), float(np.add.reduce(b * w, axis=None)))
    c, s = math.cos(theta), math.sin(theta)
    turn = np.array([[c, -s], [s, c]])
    x, y = (w0 - turn @ b0).tolist()
    return Pose(x, y, theta), turn, b, w


def weighted_pose(
    body_m: ArrayLike, world_m: ArrayLike, covariances_m2: ArrayLike
) -> tuple[Pose, Array, float]:
    """Return the pose that takes body points, (N, 2), to world points of known covariance.

    `covariances_m2` is (N, 2, 2). Also returned: the covariance of (x_m, y_m, theta_rad), (3, 3),
    and the weighted sum of squares that is left, with 2 N - 3 degrees of freedom.
    """
    body, world = np.asarray(body_m, np.float64), np.asarray(world_m, np.float64)
    weight = np.linalg.inv(np.asarray(covariances_m2, np.float64))
    start = _fitted(body, world)[0]
    x_m, y_m, theta_rad = start.x_m, start.y_m, start.theta_rad
    slopes = np.zeros((len(body), 2, 3))
    slopes[:, 0, 0] = slopes[:, 1, 1] = 1.0
    rest = covariance = np.empty(0)
    for step in range(WEIGHTED_STEPS + 1):
        c, s = math.cos(theta_rad), math.sin(theta_rad)
        arms = body @ np.array([[c, s], [-s, c]])
        rest = world - arms - (x_m, y_m)
        if step == WEIGHTED_STEPS:
            break
        slopes[:, 0, 2], slopes[:, 1, 2] = -arms[:, 1], arms[:, 0]
        turned = slopes.transpose(0, 2, 1) @ weight
        covariance = np.linalg.inv((turned @ slopes).sum(axis=0))
        dx, dy, turn = (covariance @ (turned @ rest[..., None]).sum(axis=0))[:, 0].tolist()
        x_m, y_m, theta_rad = x_m + dx, y_m + dy, theta_rad + turn
    left = float(np.sum(rest[:, None] @ weight @ rest[..., None]))
    return Pose(x_m, y_m, wrap_pi(theta_rad)), covariance, left
