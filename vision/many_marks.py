"""The robot found by three or more colour marks: every pair of them, and one fit over all that were seen.

A pair is found as two marks are (`vision.localisers.marks`), so a covered mark costs its pairs and not the
robot. Pairs that agree with the best one count; each says where its two marks are, and the pose is the one
that fits all marks best. The claim is the best pair's: more marks make it no worse.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hil.core.types import Pose, PoseMeasurement, wrap_pi
from vision.camera_setup import camera_model
from vision.localisers.marks import STRIP_PX, MarkLocaliser
from vision.mark_search import Window
from vision.pose_fit import fit_pose

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig, MarkConfig

# Pairs of one robot agree within these; a find elsewhere is another thing.
SAME_PLACE_M = 0.02
SAME_HEADING_RAD = 0.15
# A prediction is not further off than this.
TURNED_RAD = 0.6

Point = tuple[float, float]
Image = NDArray[np.uint8]
Covariance = tuple[float, float, float, float, float, float]
Find = tuple[tuple[int, int], PoseMeasurement]  # numbers of two marks, and what they gave


class ManyMarks:
    """Finds a robot with N >= 3 colour marks; holds the configuration, not the past."""

    def __init__(self, camera: CameraConfig) -> None:
        self._model = model = camera_model(camera)
        marks = camera.marks
        self._radius_m, self._height_m = 0.5 * marks.diameter_m, marks.height_m
        self._places: list[Point] = [(mark.x_m, mark.y_m) for mark in marks.all]
        self._pairs = [
            (
                (i, j),
                MarkLocaliser(
                    model, marks.model_copy(update=_two(marks.all[i], marks.all[j])), alone=False
                ),
            )
            for i, j in combinations(range(len(marks.all)), 2)
        ]

    def locate(
        self, image_bgr: Image, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose seen in an image, (H, W, 3) uint8 BGR, as a pair's localiser does.

        Pairs are looked for about `predicted`, and in the whole image when none is there.
        """
        seen = None if predicted is None else self.near(image_bgr, predicted, search_radius_m)
        if seen is not None:
            return seen
        return self.inside(image_bgr, (0, 0, image_bgr.shape[1], image_bgr.shape[0]), None)

    def near(
        self, image_bgr: Image, predicted: Pose, search_radius_m: float
    ) -> PoseMeasurement | None:
        """Return the pose at a prediction or within `search_radius_m` of it, None if not there."""
        around = self._around(image_bgr, predicted, search_radius_m)
        if around is None:
            return None
        found = self._pairs_near(around, predicted, search_radius_m)
        return self._fitted(found) if found else None

    def inside(
        self, image_bgr: Image, window: Window, predicted: Pose | None = None
    ) -> PoseMeasurement:
        """Return the pose seen in a part of the image."""
        seen = [
            (pair, localiser.inside(image_bgr, window, predicted))
            for pair, localiser in self._pairs
        ]
        found = [(pair, one) for pair, one in seen if one.pose is not None]
        if found:
            return self._fitted(found)
        reason = next((one.reason for _, one in seen if one.pose is None), "")
        return PoseMeasurement(None, 0.0, reason, details={"window": 0.0, "marks": 0.0})

    def ours(self, finds: list[PoseMeasurement], predicted: Pose | None) -> PoseMeasurement | None:
        """Return which of several finds is our robot, as a pair's localiser does."""
        return self._pairs[0][1].ours(finds, predicted)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the frames."""
        return self._model.width_px, self._model.height_px

    @property
    def span_px(self) -> int:
        """How long the robot's marks and their rims are together in the image, at most."""
        return max(localiser.span_px for _, localiser in self._pairs)

    @property
    def strip_px(self) -> int:
        """How many pixels are searched in one frame: every pair looks at them."""
        return STRIP_PX // len(self._pairs)

    def _pairs_near(self, image_bgr: Image, predicted: Pose, search_radius_m: float) -> list[Find]:
        """Return the pairs found; one with a mark that is known to be covered is not looked for."""
        found: list[Find] = []
        failed: list[tuple[int, int]] = []
        covered: set[int] = set()
        reach_m = search_radius_m + SAME_PLACE_M
        for pair, localiser in self._pairs:
            if covered.intersection(pair):
                continue
            seen = localiser.locate(image_bgr, predicted, search_radius_m)
            if seen.pose is not None and _near(seen.pose, predicted, reach_m, TURNED_RAD):
                found.append((pair, seen))
            else:
                failed.append(pair)
            shown = {mark for known, _ in found for mark in known}
            covered = {mark for lost in failed if shown & {*lost} for mark in {*lost} - shown}
        return found

    def _around(self, image_bgr: Image, pose: Pose, search_radius_m: float) -> Image | None:
        """Return the image, black but for where the robot's marks may be; None when out of view.

        A pair that is not there is then not looked for all over the floor.
        """
        reach_m = search_radius_m + 3.0 * self._radius_m
        c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
        corners = [
            (pose.x_m + c * x - s * y + dx, pose.y_m + s * x + c * y + dy, self._height_m)
            for x, y in self._places
            for dx in (-reach_m, reach_m)
            for dy in (-reach_m, reach_m)
        ]
        px = self._model.project(np.array(corners))
        if not np.isfinite(px).all():
            return None
        height, width = image_bgr.shape[:2]
        left, top = np.maximum(px.min(axis=0).astype(int), 0).tolist()
        right, bottom = np.minimum(px.max(axis=0).astype(int) + 2, (width, height)).tolist()
        if right <= left or bottom <= top:
            return None
        alone = np.zeros_like(image_bgr)
        alone[top:bottom, left:right] = image_bgr[top:bottom, left:right]
        return alone

    def _fitted(self, found: list[Find]) -> PoseMeasurement:
        """Return the pose over all marks of the largest group of pairs that agree."""
        groups = [[item for item in found if _same(item[1], other)] for _, other in found]
        group = max(groups, key=lambda items: (len(items), max(seen.quality for _, seen in items)))
        best = max((seen for _, seen in group), key=lambda seen: seen.quality)
        said: dict[int, list[Point]] = {}
        for pair, seen in group:
            for mark in pair:
                said.setdefault(mark, []).append(self._where(seen, mark))
        marks = sorted(said)
        body = [self._places[mark] for mark in marks]
        pose, residual_m = fit_pose(body, [np.mean(said[mark], axis=0) for mark in marks])
        details = best.details | {"marks": float(len(marks)), "residual_m": residual_m}
        return replace(
            best,
            pose=pose,
            sigma_xy_m=math.hypot(best.sigma_xy_m, residual_m),
            covariance=_widened(best.covariance, residual_m),
            details=details,
        )

    def _where(self, seen: PoseMeasurement, mark: int) -> Point:
        """Return where a mark is on its plane, world axes, m, for a pair's pose."""
        assert seen.pose is not None
        x, y = self._places[mark]
        c, s = math.cos(seen.pose.theta_rad), math.sin(seen.pose.theta_rad)
        return seen.pose.x_m + c * x - s * y, seen.pose.y_m + s * x + c * y


def _widened(covariance: Covariance | None, residual_m: float) -> Covariance | None:
    """Return a claim (xx, xy, xt, yy, yt, tt) to which what the marks disagree by is added."""
    if covariance is None:
        return None
    xx, xy, xt, yy, yt, tt = covariance
    return xx + residual_m**2, xy, xt, yy + residual_m**2, yt, tt


def _two(one: MarkConfig, other: MarkConfig) -> dict[str, object]:
    """Return the change that makes a robot of two of its marks."""
    return {"front": one, "rear": other, "more": ()}


def _same(one: PoseMeasurement, other: PoseMeasurement) -> bool:
    assert one.pose is not None
    assert other.pose is not None
    return _near(one.pose, other.pose, SAME_PLACE_M, SAME_HEADING_RAD)


def _near(a: Pose, b: Pose, within_m: float, within_rad: float) -> bool:
    apart_m = math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
    return apart_m < within_m and abs(wrap_pi(a.theta_rad - b.theta_rad)) < within_rad
