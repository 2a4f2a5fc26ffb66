"""Rendered frames with known truth, shared by the tests of the localiser."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from hil.config.camera import CameraConfig
from hil.core.types import Pose, wrap_pi
from sim_twin.camera_sim import RenderedCamera
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser

# Two views, far apart in tilt: the default one and one at 45 degrees.
DEFAULT = CameraConfig()


@cache
def rendered(camera: CameraConfig = DEFAULT, seed: int = 1) -> RenderedCamera:
    """Return a renderer; kept, as the background costs a quarter of a second."""
    return RenderedCamera(camera, seed)


def localiser(camera: CameraConfig = DEFAULT) -> MarkLocaliser:
    return MarkLocaliser(camera_model(camera), camera.marks)


def at_rest(pose: Pose, camera: CameraConfig = DEFAULT, index: int = 0) -> np.ndarray:
    return rendered(camera).make(index, [(pose.x_m, pose.y_m, pose.theta_rad)] * 2)


def moving(pose: Pose, camera: CameraConfig, index: int, speed_m_s: float = 0.5) -> np.ndarray:
    """Return a frame of the robot driving forward; `pose` is at the middle of the exposure."""
    steps = [speed_m_s * camera.exposure_s * (i / 4 - 0.5) for i in range(5)]
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    poses = [(pose.x_m + c * d, pose.y_m + s * d, pose.theta_rad) for d in steps]
    return rendered(camera).make(index, poses)


def random_poses(count: int, seed: int = 3) -> list[Pose]:
    """Return poses all over the floor that the default camera sees."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-0.75, 0.75, count), rng.uniform(-0.45, 0.45, count)
    theta = rng.uniform(-math.pi, math.pi, count)
    return [Pose(*map(float, p)) for p in zip(x, y, theta, strict=True)]


def near(pose: Pose, rng: np.random.Generator) -> Pose:
    """Return a prediction as an estimator gives it: off by 2 mm and 0.6 deg."""
    dx, dy, turn = rng.normal(0.0, (0.002, 0.002, 0.01))
    return Pose(pose.x_m + dx, pose.y_m + dy, pose.theta_rad + turn)


def errors(seen: Pose, truth: Pose) -> tuple[float, float, float]:
    """Return errors in x and y, m, and theta, rad."""
    turn_rad = wrap_pi(seen.theta_rad - truth.theta_rad)
    return seen.x_m - truth.x_m, seen.y_m - truth.y_m, turn_rad


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
