"""A localiser run along a sequence of frames: predicted windows, and implausible jumps refused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hil.core.types import Pose, PoseMeasurement, wrap_pi

Image = NDArray[np.uint8]

# Twice the robot's limits (0.5 m/s, 2.5 rad/s), so that a push by hand is still believed.
SPEED_MAX_M_S = 1.0
TURN_MAX_RAD_S = 5.0
JUMP_FREE_M = 0.01
JUMP_FREE_RAD = 0.1
LOST_S = 0.5
AGREEING_POSES = 3
AGREE_M = 0.03


class Localiser(Protocol):
    """What finds the robot in one frame: colour marks or a tag."""

    def locate(
        self, image_bgr: Image, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose seen in an image, (H, W, 3) uint8 BGR, searched near the prediction."""


class Tracker:
    """Predicts with the speed between the last two poses; time is an argument.

    A pose further from the last one than the robot can drive is refused, until three in a row
    agree with each other: then the robot was carried, and they are believed.
    """

    def __init__(self, localiser: Localiser, search_radius_m: float) -> None:
        self._localiser = localiser
        self._radius_m = search_radius_m
        self._last: tuple[float, Pose] | None = None
        self._rate = (0.0, 0.0, 0.0)
        self._refused: list[Pose] = []

    def step(self, t_s: float, image: Image) -> PoseMeasurement:
        """Return what is seen in the frame exposed at `t_s`; theta continues that of the last."""
        if self._last is not None and t_s - self._last[0] > LOST_S:
            self._last, self._rate = None, (0.0, 0.0, 0.0)
        seen = self._localiser.locate(image, self._predicted(t_s), self._radius_m)
        if seen.pose is None:
            return seen
        if self._last is not None and not self._believable(t_s, seen.pose):
            return replace(
                seen, pose=None, quality=0.0, reason=f"jump of {self._jump_m(seen.pose):.2f} m"
            )
        return replace(seen, pose=self._take(t_s, seen.pose))

    def _predicted(self, t_s: float) -> Pose | None:
        if self._last is None:
            return None
        t_last_s, pose = self._last
        dt_s = t_s - t_last_s
        vx, vy, w = self._rate
        return Pose(pose.x_m + vx * dt_s, pose.y_m + vy * dt_s, pose.theta_rad + w * dt_s)

    def _jump_m(self, pose: Pose) -> float:
        assert self._last is not None
        return math.hypot(pose.x_m - self._last[1].x_m, pose.y_m - self._last[1].y_m)

    def _believable(self, t_s: float, pose: Pose) -> bool:
        """Return whether the robot can have got there, or was seen there several times running."""
        assert self._last is not None
        dt_s = t_s - self._last[0]
        turn_rad = abs(wrap_pi(pose.theta_rad - self._last[1].theta_rad))
        if (
            self._jump_m(pose) <= JUMP_FREE_M + SPEED_MAX_M_S * dt_s
            and turn_rad <= JUMP_FREE_RAD + TURN_MAX_RAD_S * dt_s
        ):
            return True
        near = [
            p for p in self._refused if math.hypot(p.x_m - pose.x_m, p.y_m - pose.y_m) < AGREE_M
        ]
        self._refused = [*near, pose]
        if len(self._refused) < AGREEING_POSES:
            return False
        self._rate = (0.0, 0.0, 0.0)
        return True

    def _take(self, t_s: float, pose: Pose) -> Pose:
        """Make the pose the last one, its heading unwrapped, and learn the speed from it."""
        moved = bool(self._refused)
        self._refused = []
        if self._last is not None:
            t_last_s, last = self._last
            dt_s = t_s - t_last_s
            turn_rad = wrap_pi(pose.theta_rad - last.theta_rad)
            pose = Pose(pose.x_m, pose.y_m, last.theta_rad + turn_rad)
            if dt_s > 0.0 and not moved:
                dx, dy = pose.x_m - last.x_m, pose.y_m - last.y_m
                self._rate = (dx / dt_s, dy / dt_s, turn_rad / dt_s)
        self._last = (t_s, pose)
        return pose
