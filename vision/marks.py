"""The robot found by its two colour marks (front and rear), as in the thesis, to sub-pixel centroids.

The sensor is linear, so a pixel that a mark covers in part is a mixture of two colours. Each mark
has a *response*: a weighted sum of blue, green and red that is zero for grey and for the other
mark's colour. The response then grows in proportion to the share of the pixel that the mark covers
and to the light, whatever lies beside it, and its centroid is that of the mark.

A mark is found where its response stands out; a pair of marks is the robot when sizes and distance
are those of the robot on the floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.config.camera import MarkConfig, MarksConfig
from hil.types import Pose, PoseMeasurement
from vision.camera import CameraModel
from vision.rigid import fit_pose

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Gray = NDArray[np.float32]

# A response below this (DN, colours scaled to unit noise gain) is noise: some six sigma of a webcam.
RESPONSE_MIN_DN = 10.0
# Share of a pixel's brightness that must be response: a third of the mark's own leaves room for
# coloured light and a white-balance error and still keeps out floors that are nearly grey.
PURITY_SHARE = 0.33
# A component's edge lies where its response is this share of its peak.
EDGE_SHARE = 0.35
AREA_RATIO = (0.25, 1.7)
DISTANCE_TOLERANCE = 0.12
MARGIN_PX = 3
CANDIDATES_MAX = 12
RIM_POINTS = 12
SIGMA_PX = 0.03
AREA_MIN_PX = 6


@dataclass(frozen=True, slots=True)
class _Blob:
    """One candidate of a mark: centroid (u, v), area and peak of its response."""

    u_px: float
    v_px: float
    area_px: float
    peak_dn: float


@dataclass(frozen=True, slots=True)
class _Found:
    """A pair of candidates taken for the robot; `misfit` is 0 for a perfect one."""

    front: _Blob
    rear: _Blob
    pose: Pose
    residual_m: float
    misfit: float


class MarkLocaliser:
    """Finds the robot's two colour marks; holds the configuration, not the past."""

    def __init__(self, model: CameraModel, marks: MarksConfig) -> None:
        self._model = model
        self._height_m = marks.height_m
        self._radius_m = 0.5 * marks.diameter_m
        self._body_m = np.array([[m.x_m, m.y_m] for m in (marks.front, marks.rear)])
        self._distance_m = float(np.linalg.norm(self._body_m[0] - self._body_m[1]))
        self._mix = np.stack(
            [_response(marks.front, marks.rear), _response(marks.rear, marks.front)]
        ).astype(np.float32)
        self._purity = [
            _purity(mix, m) for mix, m in zip(self._mix, (marks.front, marks.rear), strict=True)
        ]
        angles = np.arange(RIM_POINTS) * (2.0 * np.pi / RIM_POINTS)
        self._rim_m = self._radius_m * np.stack((np.cos(angles), np.sin(angles)), axis=1)

    def locate(
        self, image_bgr: Image, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose seen in an image, (H, W, 3) uint8 BGR.

        With a prediction the search stays in a window of `search_radius_m` around it, and falls
        back to the whole frame when the robot is not there.
        """
        if predicted is not None:
            window = self._window(image_bgr, predicted, search_radius_m)
            if window is not None:
                found, _ = self._search(image_bgr, window)
                if found is not None:
                    return self._measurement(found, in_window=True)
        found, reason = self._search(image_bgr, (0, 0, image_bgr.shape[1], image_bgr.shape[0]))
        if found is None:
            return PoseMeasurement(None, 0.0, reason)
        return self._measurement(found, in_window=False)

    def _window(
        self, image: Image, pose: Pose, radius_m: float
    ) -> tuple[int, int, int, int] | None:
        """Return (left, top, right, bottom) px around the predicted marks, None if out of view."""
        c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
        reach_m = radius_m + self._radius_m
        corners = []
        for x, y in self._body_m:
            u, v = self._model.project_point(
                pose.x_m + c * x - s * y, pose.y_m + s * x + c * y, self._height_m
            )
            if not math.isfinite(u):
                return None
            reach_px = reach_m * self._px_per_m(u, v)
            corners.append((u - reach_px, v - reach_px, u + reach_px, v + reach_px))
        height, width = image.shape[:2]
        left = max(0, int(min(corner[0] for corner in corners)))
        top = max(0, int(min(corner[1] for corner in corners)))
        right = min(width, int(max(corner[2] for corner in corners)) + 2)
        bottom = min(height, int(max(corner[3] for corner in corners)) + 2)
        return (left, top, right, bottom) if right - left > 8 and bottom - top > 8 else None

    def _px_per_m(self, u_px: float, v_px: float) -> float:
        """Return the scale on the plane of the marks, the larger of both directions."""
        x, y = self._model.floor_point(u_px, v_px, self._height_m)
        u1, v1 = self._model.project_point(x + 0.01, y, self._height_m)
        u2, v2 = self._model.project_point(x, y + 0.01, self._height_m)
        return 100.0 * max(math.hypot(u1 - u_px, v1 - v_px), math.hypot(u2 - u_px, v2 - v_px))

    def _search(self, image: Image, window: tuple[int, int, int, int]) -> tuple[_Found | None, str]:
        """Return the best pair in the window, or None and the reason."""
        left, top, right, bottom = window
        part = image[top:bottom, left:right]
        blobs = [self._candidates(part, index, left, top) for index in (0, 1)]
        for name, found in zip(("front", "rear"), blobs, strict=True):
            if not found:
                return None, f"{name} mark not found"
        best: _Found | None = None
        for front, rear in product(*blobs):
            pair = self._pair(front, rear)
            if pair is not None and (best is None or pair.misfit < best.misfit):
                best = pair
        return best, "" if best else "marks found, but none the robot's distance apart"

    def _candidates(self, part: Image, index: int, left: int, top: int) -> list[_Blob]:
        """Return what may be mark `index` in a part of the image, largest response first."""
        pure = cv2.transform(part, self._purity[index][None, :])
        _, mask = cv2.threshold(pure, 0.5 * RESPONSE_MIN_DN, 255, cv2.THRESH_BINARY)
        count, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        order = sorted(range(1, count), key=lambda i: -stats[i, cv2.CC_STAT_AREA])
        blobs = []
        for label in order[:CANDIDATES_MAX]:
            x, y, w, h, area = (int(value) for value in stats[label])
            if area < AREA_MIN_PX:
                break
            blob = self._measure(part, index, (x, y, w, h))
            if blob is not None:
                moved = _Blob(blob.u_px + left, blob.v_px + top, blob.area_px, blob.peak_dn)
                if self._right_size(moved):
                    blobs.append(moved)
        return blobs

    def _measure(self, part: Image, index: int, box: tuple[int, int, int, int]) -> _Blob | None:
        """Return the centroid of the response in and just around a component's box."""
        x, y, w, h = box
        x0, y0 = max(0, x - MARGIN_PX), max(0, y - MARGIN_PX)
        near = part[y0 : y + h + MARGIN_PX, x0 : x + w + MARGIN_PX]
        response = cv2.transform(near.astype(np.float32), self._mix[index][None, :])
        peak = float(np.quantile(response, 0.9)) if min(w, h) > 4 else float(response.max())
        peak = max(peak, 0.5 * float(response.max()))
        if peak < RESPONSE_MIN_DN:
            return None
        _, core = cv2.threshold(response, EDGE_SHARE * peak, 255, cv2.THRESH_BINARY)
        core8 = core.astype(np.uint8)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(core8, connectivity=8)
        if count < 2:
            return None
        label = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
        # Two pixels beyond the edge: the mark's own blurred rim, with its share of coverage.
        reach = cv2.dilate((labels == label).astype(np.uint8), _DISC)
        weight = np.where(reach > 0, np.maximum(response, 0.0), 0.0).astype(np.float32)
        moments = cv2.moments(weight)
        mass = moments["m00"]
        inside = response[labels == label]
        level = float(np.median(inside[inside > 0.8 * inside.max()])) if inside.size else 0.0
        if mass <= 0.0 or level <= 0.0:
            return None
        return _Blob(moments["m10"] / mass + x0, moments["m01"] / mass + y0, mass / level, level)

    def _right_size(self, blob: _Blob) -> bool:
        expected_px = self._disc(blob)[2]
        return AREA_RATIO[0] * expected_px <= blob.area_px <= AREA_RATIO[1] * expected_px

    def _disc(self, blob: _Blob) -> tuple[float, float, float]:
        """Return (du, dv, area) px of the mark's image at a blob.

        (du, dv) is how far the centroid of the projected disc lies from its projected centre.
        """
        x, y = self._model.floor_point(blob.u_px, blob.v_px, self._height_m)
        if not math.isfinite(x):
            return 0.0, 0.0, math.inf
        rim = np.empty((RIM_POINTS, 3))
        rim[:, :2] = self._rim_m + np.array((x, y))
        rim[:, 2] = self._height_m
        u, v = (self._model.project(rim) - (blob.u_px, blob.v_px)).T
        cross = u * np.roll(v, -1) - np.roll(u, -1) * v
        area = 0.5 * float(cross.sum())
        if not abs(area) > 0.0:
            return 0.0, 0.0, math.inf
        du = float(((u + np.roll(u, -1)) * cross).sum()) / (6.0 * area)
        dv = float(((v + np.roll(v, -1)) * cross).sum()) / (6.0 * area)
        return du, dv, abs(area)

    def _pair(self, front: _Blob, rear: _Blob) -> _Found | None:
        """Return the pair as the robot's marks, None when their distance is not the robot's."""
        world, misfit = [], 0.0
        for blob in (front, rear):
            du, dv, expected_px = self._disc(blob)
            world.append(self._model.floor_point(blob.u_px - du, blob.v_px - dv, self._height_m))
            misfit += abs(math.log(blob.area_px / expected_px))
        gap = math.dist(*world) / self._distance_m - 1.0
        if not abs(gap) <= DISTANCE_TOLERANCE:
            return None
        pose, residual_m = fit_pose(self._body_m, world)
        return _Found(front, rear, pose, residual_m, misfit + 10.0 * abs(gap))

    def _measurement(self, found: _Found, *, in_window: bool) -> PoseMeasurement:
        """Return pose, quality (1: sizes and distance as expected) and claimed deviations."""
        scale_m = self._distance_m / math.hypot(
            found.front.u_px - found.rear.u_px, found.front.v_px - found.rear.v_px
        )
        sigma_m = SIGMA_PX * scale_m * (1.0 + 2.0 * found.misfit)
        return PoseMeasurement(
            found.pose,
            quality=math.exp(-found.misfit),
            sigma_xy_m=max(sigma_m / math.sqrt(2.0), 2e-4),
            sigma_theta_rad=max(sigma_m * math.sqrt(2.0) / self._distance_m, 1e-3),
            details={
                "front_u_px": found.front.u_px,
                "front_v_px": found.front.v_px,
                "rear_u_px": found.rear.u_px,
                "rear_v_px": found.rear.v_px,
                "front_area_px": found.front.area_px,
                "rear_area_px": found.rear.area_px,
                "contrast_dn": min(found.front.peak_dn, found.rear.peak_dn),
                "residual_m": found.residual_m,
                "window": float(in_window),
            },
        )


_DISC = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))


def _response(mark: MarkConfig, other: MarkConfig) -> Array:
    """Return weights (b, g, r): zero for grey and for the other mark, unit noise gain."""
    weights = np.cross(np.ones(3), np.asarray(other.colour))
    weights /= np.linalg.norm(weights)
    return weights if float(weights @ np.asarray(mark.colour)) > 0.0 else -weights


def _purity(mix: NDArray[np.float32], mark: MarkConfig) -> NDArray[np.float32]:
    """Return weights that are positive only where enough of the brightness is response."""
    colour = np.asarray(mark.colour)
    own = float(mix @ colour) / float(colour.sum())
    return np.asarray(mix - PURITY_SHARE * own, dtype=np.float32)
