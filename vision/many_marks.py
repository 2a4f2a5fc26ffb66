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
from vision.localisers.marks import MarkLocaliser
from vision.pose_fit import fit_pose

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig, MarkConfig

# Pairs of one robot agree within these; a find elsewhere is another thing.
SAME_PLACE_M = 0.02
SAME_HEADING_RAD = 0.15

Point = tuple[float, float]
Image = NDArray[np.uint8]
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
                MarkLocaliser(model, marks.model_copy(update=_two(marks.all[i], marks.all[j]))),
            )
            for i, j in combinations(range(len(marks.all)), 2)
        ]

    def locate(
        self, image_bgr: Image, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose seen in an image, (H, W, 3) uint8 BGR, as a pair's localiser does.

        Pairs are looked for about `predicted`, else about the first one found in the whole image.
        """
        around = None if predicted is None else self._around(image_bgr, predicted, search_radius_m)
        found: list[Find] = []
        if predicted is not None and around is not None:
            found, _ = self._pairs_in(around, predicted, search_radius_m)
        if not found:
            found, reason = self._anywhere(image_bgr, search_radius_m)
        if not found:
            return PoseMeasurement(None, 0.0, reason, details={"window": 0.0, "marks": 0.0})
        return self._fitted(found)

    def _anywhere(self, image_bgr: Image, search_radius_m: float) -> tuple[list[Find], str]:
        """Return the pairs of the whole image: the first one found says where the others are."""
        reason = ""
        for _, localiser in self._pairs:
            seen = localiser.locate(image_bgr, None, search_radius_m)
            if seen.pose is not None:
                around = self._around(image_bgr, seen.pose, search_radius_m)
                within = image_bgr if around is None else around
                return self._pairs_in(within, seen.pose, search_radius_m)
            reason = reason or seen.reason
        return [], reason

    def _pairs_in(
        self, image_bgr: Image, predicted: Pose, search_radius_m: float
    ) -> tuple[list[Find], str]:
        found: list[Find] = []
        reason = ""
        for pair, localiser in self._pairs:
            seen = localiser.locate(image_bgr, predicted, search_radius_m)
            if seen.pose is not None:
                found.append((pair, seen))
            reason = reason or seen.reason
        return found, reason

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
            details=details,
        )

    def _where(self, seen: PoseMeasurement, mark: int) -> Point:
        """Return where a mark is on its plane, world axes, m, for a pair's pose."""
        assert seen.pose is not None
        x, y = self._places[mark]
        c, s = math.cos(seen.pose.theta_rad), math.sin(seen.pose.theta_rad)
        return seen.pose.x_m + c * x - s * y, seen.pose.y_m + s * x + c * y


def _two(one: MarkConfig, other: MarkConfig) -> dict[str, object]:
    """Return the change that makes a robot of two of its marks."""
    return {"front": one, "rear": other, "more": ()}


def _same(one: PoseMeasurement, other: PoseMeasurement) -> bool:
    a, b = one.pose, other.pose
    assert a is not None
    assert b is not None
    near = math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) < SAME_PLACE_M
    return near and abs(wrap_pi(a.theta_rad - b.theta_rad)) < SAME_HEADING_RAD
