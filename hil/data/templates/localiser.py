"""A localiser of your own: where the robot is, from one picture.

    hil run scenario-1 --set camera.localiser=./my-thing.py
    hil check localiser my-thing.py

World frame: X right and Y up on the floor; theta counter-clockwise from +X. A picture is (H, W, 3)
uint8, blue, green, red.
"""

import math

import cv2
import numpy as np

import hil


class Settings(hil.Section):
    """What may be set with --set camera.localiser_settings.KEY=VALUE."""

    rise_dn: float = hil.quantity("DN", "a mark's colour above the other two", 25.0, gt=0, le=255)
    least_px: float = hil.quantity("px", "smallest area of a mark", 20.0, gt=0, le=1e5)


@hil.localiser("my-thing", settings=Settings)
class MyThing:
    """Finds the red mark in front and the green one behind; it keeps nothing of earlier pictures."""

    def __init__(self, camera: hil.CameraConfig, settings: Settings) -> None:
        self._model = hil.camera_model(camera)
        self._marks = camera.marks
        self._settings = settings

    def locate(
        self,
        image_bgr: np.ndarray,
        predicted: hil.Pose | None,  # noqa: ARG002 - where it should be; here the whole is searched
        search_radius_m: float,  # noqa: ARG002
    ) -> hil.PoseMeasurement:
        """Return the pose of the centre of mass, or None with the reason."""
        blue, green, red = cv2.split(image_bgr)
        front = self._centre(cv2.subtract(red, cv2.max(green, blue)))  # nothing below zero
        rear = self._centre(cv2.subtract(green, cv2.max(red, blue)))
        if front is None or rear is None:
            which = "front" if front is None else "rear"
            return hil.PoseMeasurement(None, 0.0, f"{which} mark not found")
        marks = self._marks
        (bfx, bfy), (brx, bry) = ((m.x_m, m.y_m) for m in (marks.front, marks.rear))
        gap_m, own_m = math.dist(front, rear), math.hypot(bfx - brx, bfy - bry)
        if abs(gap_m - own_m) > 0.1 * own_m:
            return hil.PoseMeasurement(None, 0.0, f"marks {gap_m:.3f} m apart, not {own_m:.3f} m")
        theta = math.atan2(front[1] - rear[1], front[0] - rear[0]) - math.atan2(
            bfy - bry, bfx - brx
        )
        cos, sin = math.cos(theta), math.sin(theta)
        middle_x, middle_y = 0.5 * (bfx + brx), 0.5 * (bfy + bry)
        x_m = 0.5 * (front[0] + rear[0]) - (cos * middle_x - sin * middle_y)
        y_m = 0.5 * (front[1] + rear[1]) - (sin * middle_x + cos * middle_y)
        pose = hil.Pose(x_m, y_m, math.remainder(theta, 2.0 * math.pi))
        return hil.PoseMeasurement(pose, 1.0, "", sigma_xy_m=0.002, sigma_theta_rad=0.02)

    def _centre(self, rise: np.ndarray) -> tuple[float, float] | None:
        """Return where the largest patch of a colour lies on the marks' plane, m."""
        mask = (rise > self._settings.rise_dn).astype(np.uint8)
        count, _, stats, _ = found = cv2.connectedComponentsWithStats(mask)
        if count < 2:
            return None
        best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
        if stats[best, cv2.CC_STAT_AREA] < self._settings.least_px:
            return None
        u_px, v_px = map(float, found[3][best])
        point = self._model.floor_point(u_px, v_px, self._marks.height_m)
        return float(point[0]), float(point[1])
