"""A rolling shutter corrected: rows are exposed one after the other, so the two marks are not seen at once.

A frame's time is that of its middle row. Each mark is taken back, or on, to that time at the speed the
estimator gives, and the pose fitted anew.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from vision.pose_fit import fit_pose

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig, MarkConfig
    from hil.core.types import Estimate, Pose, PoseMeasurement

Point = tuple[float, float]


def unrolled(
    seen: PoseMeasurement, camera: CameraConfig, moving: Estimate | None
) -> PoseMeasurement:
    """Return what was seen as if all rows had been exposed at once.

    `moving` is the state at the frame's time; without it, or without a robot of two marks, nothing is
    corrected.
    """
    places = ("front_v_px", "rear_v_px")
    unknown = camera.line_time_s == 0.0 or seen.pose is None or moving is None
    if unknown or camera.marks.more or not all(place in seen.details for place in places):
        return seen
    assert seen.pose is not None
    assert moving is not None
    middle_px = 0.5 * (camera.height_px - 1)
    world = []
    for mark, place in zip((camera.marks.front, camera.marks.rear), places, strict=True):
        late_s = (seen.details[place] - middle_px) * camera.line_time_s
        at = _where(seen.pose, mark)
        speed = _speed(moving, at)
        world.append((at[0] - speed[0] * late_s, at[1] - speed[1] * late_s))
    body = [(mark.x_m, mark.y_m) for mark in (camera.marks.front, camera.marks.rear)]
    pose, _ = fit_pose(body, world)
    return replace(seen, pose=pose)


def _where(pose: Pose, mark: MarkConfig) -> Point:
    """Return where a mark is on the floor plan, m."""
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    return pose.x_m + c * mark.x_m - s * mark.y_m, pose.y_m + s * mark.x_m + c * mark.y_m


def _speed(moving: Estimate, at: Point) -> Point:
    """Return the speed of a point of the robot, world axes, m/s: that of the flat output and the turn."""
    dx, dy = at[0] - moving.z1_m[0], at[1] - moving.z1_m[1]
    turn = moving.theta_dot_rad_s
    return moving.z2_m_s[0] - turn * dy, moving.z2_m_s[1] + turn * dx
