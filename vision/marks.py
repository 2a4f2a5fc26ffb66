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
    """One candidate of a mark: centroid of its response, size against what it should be, place.

    (x_m, y_m) is where the centroid's ray meets the plane of the marks.
    """

    u_px: float
    v_px: float
    area_px: float
    area_ratio: float
    peak_dn: float
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class _Found:
    """A pair of candidates taken for the robot; `misfit` is 0 for a perfect one."""

    front: _Blob
    rear: _Blob
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
        angles = np.arange(RIM_POINTS + 1) * (2.0 * np.pi / RIM_POINTS)
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
            reach_px = reach_m * self._scale(u, v)[2]
            corners.append((u - reach_px, v - reach_px, u + reach_px, v + reach_px))
        height, width = image.shape[:2]
        left = max(0, int(min(corner[0] for corner in corners)))
        top = max(0, int(min(corner[1] for corner in corners)))
        right = min(width, int(max(corner[2] for corner in corners)) + 2)
        bottom = min(height, int(max(corner[3] for corner in corners)) + 2)
        return (left, top, right, bottom) if right - left > 8 and bottom - top > 8 else None

    def _scale(self, u_px: float, v_px: float) -> tuple[float, float, float, float]:
        """Return (x, y) m on the marks' plane, px per m (the larger way), and px^2 per m^2."""
        project, height_m = self._model.project_point, self._height_m
        x, y = self._model.floor_point(u_px, v_px, height_m)
        if not math.isfinite(x):
            return math.nan, math.nan, math.nan, math.nan
        ux, vx = project(x + _STEP_M, y, height_m)
        uy, vy = project(x, y + _STEP_M, height_m)
        ax, bx, ay, by = ux - u_px, vx - v_px, uy - u_px, vy - v_px
        linear = max(math.hypot(ax, bx), math.hypot(ay, by)) / _STEP_M
        return x, y, linear, abs(ax * by - ay * bx) / _STEP_M**2

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
            centroid = _centroid(part, self._mix[index], (x, y, w, h))
            if centroid is not None:
                u_px, v_px, area_px, peak_dn = centroid
                blob = self._blob(u_px + left, v_px + top, area_px, peak_dn)
                if AREA_RATIO[0] <= blob.area_ratio <= AREA_RATIO[1]:
                    blobs.append(blob)
        return blobs

    def _blob(self, u_px: float, v_px: float, area_px: float, peak_dn: float) -> _Blob:
        x, y, _, area_scale = self._scale(u_px, v_px)
        expected_px = math.pi * self._radius_m**2 * area_scale
        ratio = area_px / expected_px if expected_px > 0.0 else math.inf
        return _Blob(u_px, v_px, area_px, ratio, peak_dn, x, y)

    def _centre(self, blob: _Blob) -> tuple[float, float]:
        """Return (X, Y) of the disc whose image has its centroid at the blob.

        The centroid of a disc's image lies off the image of its centre, by perspective and lens.
        """
        rim = np.empty((RIM_POINTS + 1, 3))
        rim[:, :2] = self._rim_m
        rim[:, 0] += blob.x_m
        rim[:, 1] += blob.y_m
        rim[:, 2] = self._height_m
        u, v = (self._model.project(rim) - (blob.u_px, blob.v_px)).T
        cross = u[:-1] * v[1:] - u[1:] * v[:-1]
        six_areas = 3.0 * float(cross.sum())
        du = float((u[:-1] + u[1:]) @ cross) / six_areas
        dv = float((v[:-1] + v[1:]) @ cross) / six_areas
        return self._model.floor_point(blob.u_px - du, blob.v_px - dv, self._height_m)

    def _pair(self, front: _Blob, rear: _Blob) -> _Found | None:
        """Return the pair as the robot's marks, None when their distance is not the robot's."""
        gap = math.hypot(front.x_m - rear.x_m, front.y_m - rear.y_m) / self._distance_m - 1.0
        if not abs(gap) <= DISTANCE_TOLERANCE:
            return None
        sizes = abs(math.log(front.area_ratio)) + abs(math.log(rear.area_ratio))
        return _Found(front, rear, sizes + 10.0 * abs(gap))

    def _measurement(self, found: _Found, *, in_window: bool) -> PoseMeasurement:
        """Return pose, quality (1: sizes and distance as expected) and claimed deviations."""
        centres = (self._centre(found.front), self._centre(found.rear))
        pose, residual_m = fit_pose(self._body_m, centres)
        scale_m = self._distance_m / math.hypot(
            found.front.u_px - found.rear.u_px, found.front.v_px - found.rear.v_px
        )
        sigma_m = SIGMA_PX * scale_m * (1.0 + 2.0 * found.misfit)
        return PoseMeasurement(
            pose,
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
                "residual_m": residual_m,
                "window": float(in_window),
            },
        )


_DISC = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
_STEP_M = 0.01


def _centroid(
    part: Image, mix: NDArray[np.float32], box: tuple[int, int, int, int]
) -> tuple[float, float, float, float] | None:
    """Return (u, v, area, peak) of the response in and just around a component's box, or None."""
    x, y, w, h = box
    x0, y0 = max(0, x - MARGIN_PX), max(0, y - MARGIN_PX)
    near = part[y0 : y + h + MARGIN_PX, x0 : x + w + MARGIN_PX]
    response = cv2.transform(near.astype(np.float32), mix[None, :])
    peak = cv2.minMaxLoc(cv2.blur(response, (3, 3)))[1]
    if peak < RESPONSE_MIN_DN:
        return None
    _, core = cv2.threshold(response, EDGE_SHARE * peak, 255, cv2.THRESH_BINARY)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(core.astype(np.uint8), connectivity=8)
    label = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    # Two pixels beyond the edge: the mark's own blurred rim, with its share of coverage.
    reach = cv2.dilate(cv2.compare(labels, label, cv2.CMP_EQ), _DISC)
    weight = cv2.max(response, 0.0)
    weight[reach == 0] = 0.0
    level = cv2.mean(weight, cv2.compare(weight, 0.7 * peak, cv2.CMP_GT))[0]
    moments = cv2.moments(weight)
    mass = moments["m00"]
    return moments["m10"] / mass + x0, moments["m01"] / mass + y0, mass / level, level


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
