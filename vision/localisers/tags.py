"""The robot found by one ArUco or AprilTag on its plate; the alternative to the colour marks.

OpenCV finds the tag and reads its number; the place comes from its outline: edges are measured
across the sides of the square as the camera model projects it, their rays are met with the mark's
plane, and (x, y, theta) and the side are fitted there. A general pose solver on four corners is not
used: seen from above a tag's tilt flips between two answers, and the tilt is known to be none.

Tag frame: x to the right of the printed tag, y up, origin in its middle; it lies along body x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.config.camera import CameraConfig, TagConfig
from hil.core.registries import LOCALISERS
from hil.core.types import Pose, PoseMeasurement, wrap_pi
from hil.core.wording import past
from vision.camera import CameraModel, longest_px
from vision.camera_setup import camera_model
from vision.pose_fit import fit_pose
from vision.tag_claim import covariance_m2, of_body

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Window = tuple[int, int, int, int]  # left, top, right, bottom, px

CORNERS = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
NORMALS = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])
ALONG = np.array([[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 1.0]])
SIDE_READABLE_PX = 50.0
STRIP_PX = 80_000  # searched in some 5 ms, twice that where the picture is enlarged
SAMPLES_PER_SIDE = 24
# Profiles across a side stay within the black border, one cell of six wide, and the white margin.
PROFILE_SHARE = 0.6
PROFILE_MAX_PX = 5.0
PROFILE_STEPS = 21
REFINEMENTS = 3
SIDE_TOLERANCE = 0.08
CONTRAST_MIN_DN = 15.0
RESIDUAL_MAX_PX = 0.8
POINTS_MIN = 40
SIGMA_FREE_PX = 0.02
QUALITY_RESIDUAL_PX = 0.3
QUALITY_CONTRAST_DN = 80.0
IN_VIEW = "in view"  # how the reason ends where there are too many


@dataclass(frozen=True, slots=True)
class _Outline:
    """A fitted square: pose of its middle, side, and how well it fits."""

    pose: Pose
    side_m: float
    residual_m: float
    points: int
    contrast_dn: float
    covariance_m2: Array  # of (dx, dy, dtheta), (3, 3), in its own frame


class TagLocaliser:
    """Finds one tag, known by dictionary and number, at a known height over the floor."""

    def __init__(self, camera: CameraModel, tag: TagConfig, height_m: float) -> None:
        from vision import cv_compat  # noqa: PLC0415 - loads OpenCV, where there are pictures only

        self._camera = camera
        self._tag = tag
        self._height_m = height_m
        middle = camera.floor_point(0.5 * camera.width_px, 0.5 * camera.height_px, height_m)
        self._middle = Pose(*middle, 0.0)
        # An unknown name fails here and not in the loop.
        self._cells = cv_compat.dictionary(tag.dictionary).markerSize + 2

    def locate(
        self, image_bgr: Image, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose of the centre of mass seen in an image, (H, W, 3) uint8 BGR.

        With a prediction the search stays in a window of `search_radius_m` around it, and falls
        back to the whole frame when the tag is not there.
        """
        seen = None if predicted is None else self.near(image_bgr, predicted, search_radius_m)
        if seen is not None:
            return seen
        return self.inside(image_bgr, (0, 0, image_bgr.shape[1], image_bgr.shape[0]))

    def near(
        self, image_bgr: Image, predicted: Pose, search_radius_m: float
    ) -> PoseMeasurement | None:
        """Return the pose within `search_radius_m` of a prediction, None if not there."""
        height, width = image_bgr.shape[:2]
        window = self._window((width, height), predicted, search_radius_m)
        if window is None:
            return None
        found = self._search(image_bgr, window, predicted, search_radius_m)
        return None if found.pose is None else found

    def inside(
        self, image_bgr: Image, window: Window, predicted: Pose | None = None
    ) -> PoseMeasurement:
        """Return the pose seen in a part of the image; one tag has one place, whatever is expected."""
        del predicted
        return self._search(image_bgr, window, None, 0.0)

    def ours(self, finds: list[PoseMeasurement], predicted: Pose | None) -> PoseMeasurement | None:
        """Return the only find; None for none, "not seen" for several: no two tags have a number."""
        del predicted
        if len(finds) < 2:
            return finds[0] if finds else None
        return _not_seen(
            f"{len(finds)} tags with number {self._tag.tag_id} {IN_VIEW}", {"window": 0.0}
        )

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the frames."""
        return self._camera.width_px, self._camera.height_px

    @property
    def span_px(self) -> int:
        """How long the tag and its margin are in the image, at most: across its corners."""
        side_m = self._tag.size_m * (1.0 + 2.0 * self._tag.margin_ratio)
        return longest_px(self._camera, self._height_m, math.sqrt(2.0) * side_m)

    @property
    def strip_px(self) -> int:
        """How many pixels are searched in one frame where the search is spread over several."""
        return STRIP_PX

    def _search(
        self, image: Image, window: Window, predicted: Pose | None, radius_m: float
    ) -> PoseMeasurement:
        """Return the tag seen in the window; near the prediction if there is one."""
        from vision import cv_compat  # noqa: PLC0415 - loads OpenCV, where there are pictures only

        u0, v0, u1, v1 = window
        level = cv_compat.grey(image[v0:v1, u0:u1])
        ours = self._corners(level) + np.array([u0, v0])
        details = {"window": float(predicted is not None), "candidates": float(len(ours))}
        if not len(ours):
            return _not_seen(f"tag {self._tag.tag_id} not found", details)
        outlines = [self._outline(level, (u0, v0), four) for four in ours]
        good = [o for o in outlines if o is not None and self._reason(o) == ""]
        if len(good) > 1 and predicted is None:
            return _not_seen(f"{len(good)} tags with number {self._tag.tag_id} {IN_VIEW}", details)
        if not good:
            whole = [o for o in outlines if o is not None]
            return _not_seen(self._reason(whole[0]) if whole else "outline hidden", details)
        return self._judge(good, predicted, radius_m, details)

    def _corners(self, level: Image) -> Array:
        """Return the corner pixels, (N, 4, 2), of every tag with our number."""
        from vision import cv_compat  # noqa: PLC0415 - loads OpenCV, where there are pictures only

        side_px = self._tag.size_m / self._scale_m_px(self._middle)
        enlarge = 2 if side_px < SIDE_READABLE_PX else 1
        detector = cv_compat.tag_detector(self._tag.dictionary, side_px, max(level.shape))
        numbers, corners = cv_compat.detect_tags(detector, level, enlarge)
        ours: Array = corners[numbers == self._tag.tag_id]
        return ours

    def _window(
        self, size_px: tuple[int, int], predicted: Pose, search_radius_m: float
    ) -> Window | None:
        """Return the part to look at, None when the predicted place is not in the image."""
        middle = self._tag_pose(predicted)
        reach = search_radius_m + self._tag.size_m * (0.5 * math.sqrt(2) + self._tag.margin_ratio)
        corners = CORNERS * reach + (middle.x_m, middle.y_m)
        px = self._camera.project(np.column_stack((corners, np.full(4, self._height_m))))
        if np.isnan(px).any():
            return None
        u0, v0 = np.maximum(np.floor(px.min(axis=0)), 0).astype(int)
        u1, v1 = np.minimum(np.ceil(px.max(axis=0)) + 1, size_px).astype(int)
        return (int(u0), int(v0), int(u1), int(v1)) if u1 - u0 > 8 and v1 - v0 > 8 else None

    def _tag_pose(self, body: Pose) -> Pose:
        """Return where the tag's middle is for a pose of the centre of mass."""
        c, s = math.cos(body.theta_rad), math.sin(body.theta_rad)
        x, y = self._tag.x_m, self._tag.y_m
        return Pose(body.x_m + c * x - s * y, body.y_m + s * x + c * y, body.theta_rad)

    def _body_pose(self, tag: Pose) -> Pose:
        """Return the pose of the centre of mass for one of the tag's middle."""
        c, s = math.cos(tag.theta_rad), math.sin(tag.theta_rad)
        x, y = self._tag.x_m, self._tag.y_m
        return Pose(tag.x_m - c * x + s * y, tag.y_m - s * x - c * y, tag.theta_rad)

    def _outline(self, level: Image, origin: tuple[int, int], four: Array) -> _Outline | None:
        """Return the square fitted to the edges around four corner pixels, None if hidden."""
        side_m = self._tag.size_m
        floor = self._camera.floor_points(four, self._height_m)
        if np.isnan(floor).any():
            return None
        pose, _ = fit_pose(CORNERS * 0.5 * side_m, floor)
        seen_m = float(np.mean(np.linalg.norm(np.diff(floor, axis=0, append=floor[:1]), axis=1)))
        outline: _Outline | None = _Outline(pose, seen_m, math.inf, 0, 0.0, np.eye(3))
        if not abs(seen_m / side_m - 1.0) < 2.0 * SIDE_TOLERANCE:
            return outline
        for _ in range(REFINEMENTS):
            assert outline is not None
            outline = self._refined(level, origin, outline)
            if outline is None:
                return None
        return outline

    def _refined(self, level: Image, origin: tuple[int, int], square: _Outline) -> _Outline | None:
        """Return the square fitted to edge points measured across the sides of `square`."""
        half = 0.5 * square.side_m
        steps = np.linspace(-0.85, 0.85, SAMPLES_PER_SIDE)
        on_side = (NORMALS[:, None] + ALONG[:, None] * steps[None, :, None]).reshape(-1, 2) * half
        normals = np.repeat(NORMALS, SAMPLES_PER_SIDE, axis=0)
        cell_m = square.side_m / self._cells
        inner = self._pixels(square.pose, on_side)
        outer = self._pixels(square.pose, on_side + normals * cell_m)
        across = outer - inner
        cell_px = np.linalg.norm(across, axis=1)
        reach_px = np.minimum(PROFILE_SHARE * cell_px, PROFILE_MAX_PX)
        across /= cell_px[:, None]
        shift_px, contrast = _edge_shifts(level, inner - origin, across, reach_px)
        good = (contrast > CONTRAST_MIN_DN) & (np.abs(shift_px) < 0.8 * reach_px)
        if good.sum() < POINTS_MIN:
            return None
        px = inner[good] + across[good] * shift_px[good, None]
        points = _into(square.pose, self._camera.floor_points(px, self._height_m))
        contrast_dn = float(np.median(contrast[good]))
        free_m = SIGMA_FREE_PX * self._scale_m_px(square.pose)
        return _fit_square(square, points, np.flatnonzero(good), contrast_dn, free_m)

    def _pixels(self, pose: Pose, tag_m: Array) -> Array:
        c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
        world = tag_m @ np.array([[c, s], [-s, c]]) + (pose.x_m, pose.y_m)
        return self._camera.project(np.column_stack((world, np.full(len(world), self._height_m))))

    def _scale_m_px(self, pose: Pose) -> float:
        """Return the size of a pixel on the mark's plane."""
        u, v = self._camera.project_point(pose.x_m, pose.y_m, self._height_m)
        jacobian = self._camera.floor_jacobian(u, v, self._height_m)
        return math.sqrt(abs(float(np.linalg.det(jacobian))))

    def _reason(self, outline: _Outline) -> str:
        """Return why an outline cannot be the tag, "" when it can."""
        off = outline.side_m / self._tag.size_m - 1.0
        if not abs(off) < SIDE_TOLERANCE:
            return f"side {outline.side_m * 1e3:.1f} mm, tag has {self._tag.size_m * 1e3:.1f} mm"
        residual_px = outline.residual_m / self._scale_m_px(outline.pose)
        if residual_px > RESIDUAL_MAX_PX:
            text = past(residual_px, RESIDUAL_MAX_PX, ".2f")
            return f"outline off by {text} px RMS, limit {RESIDUAL_MAX_PX} px"
        return ""

    def _judge(
        self,
        outlines: list[_Outline],
        predicted: Pose | None,
        search_radius_m: float,
        details: dict[str, float],
    ) -> PoseMeasurement:
        """Return the measurement of the outline next to the prediction, gated by the radius."""
        poses = [self._body_pose(outline.pose) for outline in outlines]
        best = 0
        if predicted is not None:
            jumps = [math.hypot(p.x_m - predicted.x_m, p.y_m - predicted.y_m) for p in poses]
            best = int(np.argmin(jumps))
            if jumps[best] > search_radius_m:
                jump_mm = past(jumps[best] * 1e3, search_radius_m * 1e3, ".0f")
                text = f"jump of {jump_mm} mm, limit {search_radius_m * 1e3:.4g} mm"
                return _not_seen(text, details)
        outline, pose = outlines[best], poses[best]
        if predicted is not None:
            turn = wrap_pi(pose.theta_rad - predicted.theta_rad)
            pose = Pose(pose.x_m, pose.y_m, predicted.theta_rad + turn)
        scale = self._scale_m_px(outline.pose)
        residual_px = outline.residual_m / scale
        details |= {
            "residual_px": residual_px,
            "contrast_dn": outline.contrast_dn,
            "side_m": outline.side_m,
            "points": float(outline.points),
        } | self._edges(outline, pose)
        claimed = of_body(outline.covariance_m2, pose.theta_rad, self._tag.x_m, self._tag.y_m)
        quality = min(1.0, outline.contrast_dn / QUALITY_CONTRAST_DN) * math.exp(
            -((residual_px / QUALITY_RESIDUAL_PX) ** 2)
        )
        sigma_xy_m = math.sqrt(0.5 * (claimed[0] + claimed[3]))
        return PoseMeasurement(
            pose, quality, "", sigma_xy_m, math.sqrt(claimed[5]), details, claimed
        )

    def _edges(self, outline: _Outline, pose: Pose) -> dict[str, float]:
        """Return where the middles of the edges towards the robot's front and rear lie in the image, px."""
        found: dict[str, float] = {}
        for name, way in (("front", 0.5), ("rear", -0.5)):
            ahead_m = way * outline.side_m
            x_m = outline.pose.x_m + ahead_m * math.cos(pose.theta_rad)
            y_m = outline.pose.y_m + ahead_m * math.sin(pose.theta_rad)
            u, v = self._camera.project_point(x_m, y_m, self._height_m)
            found |= {f"{name}_u_px": u, f"{name}_v_px": v}
        return found


def _not_seen(reason: str, details: dict[str, float]) -> PoseMeasurement:
    return PoseMeasurement(None, 0.0, reason, details=details)


def _into(pose: Pose, world: Array) -> Array:
    """Return floor points, (N, 2), in the frame of a pose."""
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    turned: Array = (world - (pose.x_m, pose.y_m)) @ np.array([[c, -s], [s, c]])
    return turned


def _edge_shifts(level: Image, at: Array, across: Array, reach_px: Array) -> tuple[Array, Array]:
    """Return how far outward of `at` the dark-to-light edge lies, px, and its step, DN; (N,) each.

    The place is the mean of the slope along the profile, so even blur does not move it.
    """
    t = np.linspace(-1.0, 1.0, PROFILE_STEPS)
    places = at[:, None] + across[:, None] * (reach_px[:, None, None] * t[None, :, None])
    profile = _bilinear(level, places.reshape(-1, 2)).reshape(len(at), -1)
    dark = profile[:, :3].mean(axis=1)
    light = profile[:, -3:].mean(axis=1)
    step = light - dark
    safe = np.where(step > 1.0, step, np.inf)
    filled = np.trapezoid((profile - dark[:, None]) / safe[:, None], t, axis=1)
    return np.where(step > 1.0, (1.0 - filled) * reach_px, np.inf), step


def _bilinear(level: Image, px: Array) -> Array:
    """Return grey levels between pixels, (N,); outside the image the nearest border's."""
    height, width = level.shape
    u = np.clip(px[:, 0], 0.0, width - 1.001)
    v = np.clip(px[:, 1], 0.0, height - 1.001)
    i, j = u.astype(np.intp), v.astype(np.intp)
    fu, fv = u - i, v - j
    flat = level.ravel()
    k = j * width + i
    top = flat[k] * (1.0 - fu) + flat[k + 1] * fu
    low = flat[k + width] * (1.0 - fu) + flat[k + width + 1] * fu
    mixed: Array = top * (1.0 - fv) + low * fv
    return mixed


def _fit_square(
    square: _Outline, points: Array, edges: NDArray[np.intp], contrast_dn: float, free_m: float
) -> _Outline:
    """Return the square moved, turned and sized to edge points given in its own frame.

    `edges` are their numbers, SAMPLES_PER_SIDE a side. Distances to the sides are linear in (dx, dy,
    dtheta, dhalf); one pass leaves out points that lie far from the first fit (something across the tag).
    """
    normals = NORMALS[edges // SAMPLES_PER_SIDE]
    lever = normals[:, 1] * points[:, 0] - normals[:, 0] * points[:, 1]
    A = np.column_stack((normals, lever, np.ones(len(points))))
    distance = np.sum(normals * points, axis=1) - 0.5 * square.side_m
    keep = np.ones(len(points), dtype=bool)
    for _ in range(2):
        change = np.linalg.lstsq(A[keep], distance[keep], rcond=None)[0]
        rest = distance - A @ change
        spread = 1.4826 * float(np.median(np.abs(rest)))
        inside = np.abs(rest) <= 3.0 * spread
        keep = inside if inside.sum() >= POINTS_MIN // 2 else keep
    dx, dy, dtheta, dhalf = map(float, change)
    theta = square.pose.theta_rad
    c, s = math.cos(theta), math.sin(theta)
    pose = Pose(
        square.pose.x_m + c * dx - s * dy, square.pose.y_m + s * dx + c * dy, theta + dtheta
    )
    residual = float(np.sqrt(np.mean(rest[keep] ** 2)))
    side, along = np.divmod(edges[keep], SAMPLES_PER_SIDE)
    along = 2.0 * along / (SAMPLES_PER_SIDE - 1) - 1.0
    claimed = covariance_m2(A[keep], rest[keep], side, along, free_m)
    side_m = square.side_m + 2.0 * dhalf
    return _Outline(pose, side_m, residual, int(keep.sum()), contrast_dn, claimed)


@LOCALISERS.register("tags", summary="one ArUco or AprilTag of a stated size on the robot's plate")
def make_tags(camera: CameraConfig) -> TagLocaliser:
    """Return the localiser of the tag that a camera's file describes."""
    return TagLocaliser(camera_model(camera), camera.tag or TagConfig(), camera.marks.height_m)
