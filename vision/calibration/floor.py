"""Camera pose over the floor (the thesis's R and t) from points with known places.

The lens is known, or is fitted along with the pose. One plane seen from above does not tell focal
length from height, so a fit without a known lens wants the camera's height measured with a tape:
on the floor itself the pair does not matter, for marks above the floor it does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hil.core.errors import BadInput
from hil.core.wording import past
from vision import cv_compat
from vision.calibration.points import PointPairs
from vision.camera import CameraModel, distort
from vision.correction import corrected

Array = NDArray[np.float64]

# One more than a pose needs, so that each can be held out once.
POINTS_MIN = 5
POINTS_MIN_WITH_LENS = 12
HALVES_FROM, HALVES_FROM_WITH_LENS = 16, 30
SIGMA_HEIGHT_M = 0.003
# What a lens is like before anything was measured: the spread of ordinary cameras. With many
# points these say nothing; with few they keep the fit from following the noise.
PRIOR_NOISE_PX = 0.3
PRIOR_SIGMA = {"f": 0.5, "aspect": 0.01, "centre": 0.05, "k": 0.5, "p": 0.003, "k3": 0.2}
OUTLIER_DEVIATIONS = 6.0
OUTLIER_MIN_PX = 1.0
# Of the distance over which the points lie: good surveys leave 0.1 to 0.5 %, a board of other size 4.
RESIDUAL_MAX_RATIO, RESIDUAL_MAX_MM = 0.02, 20.0


@dataclass(frozen=True, slots=True)
class FloorCalibration:
    """A camera over the floor; residuals are floor distances in mm, `held_out_mm` cross-validated.

    `pairs` are the points used, `dropped` names those left out as outliers with their error in mm.
    `sigma_height_m` is the doubt of the camera's height from the fit itself.
    """

    camera: CameraModel
    pairs: PointPairs
    residual_mm: Array
    held_out_mm: Array
    dropped: tuple[tuple[str, float], ...]
    sigma_height_m: float

    @property
    def rms_mm(self) -> float:
        """RMS residual of the fit."""
        return float(np.sqrt(np.mean(np.square(self.residual_mm))))

    @property
    def held_out_rms_mm(self) -> float:
        """RMS residual on points the pose was not fitted to."""
        return float(np.sqrt(np.mean(np.square(self.held_out_mm))))


@dataclass(frozen=True, slots=True)
class FloorOptions:
    """What is known beforehand: the lens, the camera's height, the degree of the correction."""

    lens: CameraModel | None = None
    camera_height_m: float | None = None
    correction_degree: int = 0


def calibrate_floor(
    pairs: PointPairs, size_px: tuple[int, int], options: FloorOptions
) -> FloorCalibration:
    """Return pose, and lens where it is not known, from world-image pairs; raises BadInput."""
    _check_pairs(pairs, size_px, options)
    fit = _fit(pairs, _start(pairs, size_px, options), options, robust=True)
    errors_px = np.linalg.norm(fit.camera.project(pairs.world_m) - pairs.px, axis=1)
    spread = 1.4826 * float(np.median(errors_px))
    good = errors_px <= max(OUTLIER_DEVIATIONS * spread, OUTLIER_MIN_PX)
    if np.mean(good) < 0.6 or good.sum() < POINTS_MIN:
        raise BadInput(
            f"floor: {int((~good).sum())} of {len(good)} points do not fit one plane (median error"
            f" {np.median(errors_px):.1f} px); are world and image columns in the right order?"
        )
    errors_mm = floor_errors_mm(fit.camera, pairs)
    named = zip(pairs.names, errors_mm, good, strict=True)
    dropped = tuple((name, float(error)) for name, error, keep in named if not keep)
    kept = pairs.take(np.flatnonzero(good))
    fit = _fit(kept, fit.pinhole, options)
    residual_mm = floor_errors_mm(fit.camera, kept)
    held_out_mm = _held_out_mm(kept, fit.pinhole, options)
    return FloorCalibration(fit.camera, kept, residual_mm, held_out_mm, dropped, fit.sigma_height_m)


def require_fit(result: FloorCalibration) -> None:
    """Raise BadInput for points that do not lie where they are said to, against their extent."""
    world_m = result.pairs.world_m[:, :2]
    extent_mm = float(np.linalg.norm(np.ptp(world_m, axis=0))) * 1e3
    limit_mm = min(RESIDUAL_MAX_MM, RESIDUAL_MAX_RATIO * extent_mm)
    for rms_mm, where in ((result.rms_mm, ""), (result.held_out_rms_mm, " on held-out points")):
        if not rms_mm <= limit_mm:
            raise BadInput(
                f"floor: {past(rms_mm, limit_mm, '.1f')} mm RMS{where}, limit {limit_mm:.4g} mm for"
                f" points over {extent_mm:.0f} mm; nothing written: check the board's size, places"
                " and units"
            )


def floor_errors_mm(camera: CameraModel, pairs: PointPairs) -> Array:
    """Return how far each pixel's ray passes from its point, on the point's own plane, in mm."""
    errors = np.empty(len(pairs.px))
    for height_m in np.unique(pairs.world_m[:, 2]):
        here = pairs.world_m[:, 2] == height_m
        floor = camera.floor_points(pairs.px[here], float(height_m))
        errors[here] = np.linalg.norm(floor - pairs.world_m[here, :2], axis=1) * 1e3
    return errors


def _check_pairs(pairs: PointPairs, size_px: tuple[int, int], options: FloorOptions) -> None:
    least = POINTS_MIN if options.lens is not None else POINTS_MIN_WITH_LENS
    if len(pairs.px) < least:
        hint = "" if options.lens is not None else " to fit the lens too (or give a camera file)"
        raise BadInput(f"floor: {len(pairs.px)} points, at least {least} are needed{hint}")
    outside = ((pairs.px < -0.5) | (pairs.px > np.array(size_px) - 0.5)).any(axis=1)
    if outside.any():
        first = int(np.argmax(outside))
        u, v = pairs.px[first]
        raise BadInput(
            f"floor: point {pairs.names[first]} at pixel ({u:.1f}, {v:.1f}) lies outside the image"
            f" of {size_px[0]} x {size_px[1]} px; are the pairs from another resolution?"
        )
    centred = pairs.world_m[:, :2] - pairs.world_m[:, :2].mean(axis=0)
    extent = np.linalg.svd(centred, compute_uv=False)
    if extent[1] < 0.02 * extent[0] or extent[0] == 0.0:
        raise BadInput("floor: the points lie on one line; spread them over the floor")


@dataclass(frozen=True, slots=True)
class _Fit:
    """The camera, the same before its pixel correction, and the doubt of its height."""

    camera: CameraModel
    pinhole: CameraModel
    sigma_height_m: float


def _fit(
    pairs: PointPairs, start: CameraModel, options: FloorOptions, *, robust: bool = False
) -> _Fit:
    """Fit pose (and lens) by the reprojection error, then the pixel correction if wanted."""
    size_px = (start.width_px, start.height_px)
    own_lens = options.lens is None

    def errors(parameters: Array) -> Array:
        camera = _camera(parameters, start, own_lens)
        px = _project(camera, pairs.world_m)
        rows = [(px - pairs.px).ravel()]
        if own_lens:
            rows.append(_prior_errors(parameters[6:], size_px))
        if options.camera_height_m is not None:
            off = camera.t_world_cam_m[2] - options.camera_height_m
            rows.append(np.array([off / SIGMA_HEIGHT_M * PRIOR_NOISE_PX]))
        return np.concatenate(rows)

    parameters = np.concatenate((np.zeros(6), _lens_parameters(start) if own_lens else np.empty(0)))
    # The robust pass only tells outliers and is the start of the next.
    loss, tolerance = ("soft_l1", 1e-3) if robust else ("linear", 1e-8)
    result = least_squares(
        errors, parameters, x_scale="jac", loss=loss, ftol=tolerance, max_nfev=200
    )
    camera = pinhole = _camera(result.x, start, own_lens)
    if options.correction_degree:
        camera = corrected(pinhole, pairs.world_m, pairs.px, options.correction_degree)
    return _Fit(camera, pinhole, _height_sigma(result.jac, result.fun))


def _height_sigma(jacobian: Array, errors: Array) -> float:
    """Return the standard deviation of the camera's height, the sixth parameter, in m."""
    noise = float(np.sum(np.square(errors))) / max(1, len(errors) - jacobian.shape[1])
    return float(np.sqrt(noise * np.linalg.pinv(jacobian.T @ jacobian)[5, 5]))


def _start(pairs: PointPairs, size_px: tuple[int, int], options: FloorOptions) -> CameraModel:
    """Return a first camera from the best projective map of the floor (z left out)."""
    lens = options.lens if options.lens is not None else _ordinary_lens(*size_px)
    rays = lens.normalise(pairs.px)
    if np.isnan(rays).any():
        raise BadInput("floor: the lens file has no ray for some of the points' pixels")
    H = _homography(pairs.world_m[:, :2], rays)
    scale = 0.5 * (np.linalg.norm(H[:, 0]) + np.linalg.norm(H[:, 1]))
    H = H / (scale if H[2] @ np.append(pairs.world_m[:, :2].mean(axis=0), 1.0) > 0 else -scale)
    normal = np.cross(H[:, 0], H[:, 1])
    u, _, vt = np.linalg.svd(np.column_stack((H[:, 0], H[:, 1], normal)))
    R_cam_world = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    centre = -R_cam_world.T @ H[:, 2]
    if centre[2] < 0.0:
        raise BadInput(
            "floor: seen in the image the world axes run clockwise (x, then y), so z would point"
            " into the floor; change the sign of one axis, or exchange x and y"
        )
    camera = replace(lens, R_world_cam=R_cam_world.T, t_world_cam_m=centre)
    if options.lens is None and options.camera_height_m is not None:
        # Focal length and height grow together: start the pair from the height that was measured.
        f = lens.fx_px * options.camera_height_m / centre[2]
        eye = np.array([centre[0], centre[1], options.camera_height_m])
        camera = replace(camera, fx_px=f, fy_px=f, t_world_cam_m=eye)
    return camera


def _ordinary_lens(width_px: int, height_px: int) -> CameraModel:
    """Return a lens without distortion, 53 deg across: where a fit starts from."""
    f_px = float(width_px)
    cx_px, cy_px = 0.5 * (width_px - 1), 0.5 * (height_px - 1)
    straight = (0.0, 0.0, 0.0, 0.0, 0.0)
    return CameraModel(
        width_px, height_px, f_px, f_px, cx_px, cy_px, straight, np.eye(3), np.zeros(3)
    )


def _homography(floor_m: Array, rays: Array) -> Array:
    """Return the (3, 3) map from floor (X, Y) to normalised coordinates, by normalised DLT."""
    T_floor, a = _normaliser(floor_m)
    T_rays, b = _normaliser(rays)
    ones, zero = np.ones(len(a)), np.zeros((len(a), 3))
    p = np.column_stack((a, ones))
    rows = np.vstack((np.hstack((p, zero, -b[:, :1] * p)), np.hstack((zero, p, -b[:, 1:] * p))))
    H = np.linalg.svd(rows, full_matrices=False)[2][-1].reshape(3, 3)
    result: Array = np.linalg.inv(T_rays) @ H @ T_floor
    return result


def _normaliser(points: Array) -> tuple[Array, Array]:
    """Return a similarity that centres points with mean distance sqrt 2, and the moved points."""
    centre = points.mean(axis=0)
    scale = np.sqrt(2.0) / np.mean(np.linalg.norm(points - centre, axis=1))
    T = np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1.0]])
    return T, (points - centre) * scale


def _lens_parameters(camera: CameraModel) -> Array:
    """Return ln f, ln of the aspect ratio, centre and distortion of a camera."""
    return np.array(
        [
            np.log(camera.fx_px),
            np.log(camera.fy_px / camera.fx_px),
            camera.cx_px / camera.width_px,
            camera.cy_px / camera.width_px,
            *camera.dist,
        ]
    )


def _prior_errors(lens: Array, size_px: tuple[int, int]) -> Array:
    """Return the lens's distance from an ordinary one, weighted like pixel errors."""
    width_px, height_px = size_px
    middle = (0.5 * (width_px - 1) / width_px, 0.5 * (height_px - 1) / width_px)
    usual = np.array([np.log(width_px), 0.0, *middle, 0.0, 0.0, 0.0, 0.0, 0.0])
    s = PRIOR_SIGMA
    sigma = [s["f"], s["aspect"], s["centre"], s["centre"], s["k"], s["k"], s["p"], s["p"], s["k3"]]
    return np.asarray((lens - usual) / sigma * PRIOR_NOISE_PX, dtype=np.float64)


def _camera(parameters: Array, start: CameraModel, own_lens: bool) -> CameraModel:
    """Return the camera turned and moved from `start` by the first six parameters."""
    turn = cv_compat.rotation(parameters[:3])
    camera = replace(
        start,
        R_world_cam=turn @ start.R_world_cam,
        t_world_cam_m=start.t_world_cam_m + parameters[3:6],
    )
    if not own_lens:
        return camera
    f, aspect, cx, cy = np.exp(parameters[6]), np.exp(parameters[7]), *parameters[8:10]
    k1, k2, p1, p2, k3 = map(float, parameters[10:15])
    width = start.width_px
    return replace(
        camera,
        fx_px=float(f),
        fy_px=float(f * aspect),
        cx_px=float(cx * width),
        cy_px=float(cy * width),
        dist=(k1, k2, p1, p2, k3),
    )


def _project(camera: CameraModel, world_m: Array) -> Array:
    """Return pixels as `project` does, but far away in place of NaN behind the camera."""
    cam = (world_m - camera.t_world_cam_m) @ camera.R_world_cam
    z = np.maximum(cam[:, 2], 1e-3)
    xd, yd = distort(cam[:, 0] / z, cam[:, 1] / z, camera.dist, fisheye=camera.fisheye)
    return np.stack((camera.fx_px * xd + camera.cx_px, camera.fy_px * yd + camera.cy_px), axis=1)


def _held_out_mm(pairs: PointPairs, start: CameraModel, options: FloorOptions) -> Array:
    """Return each point's error under a fit to the other half; few points are left out singly."""
    count = len(pairs.px)
    if count >= (HALVES_FROM if options.lens is not None else HALVES_FROM_WITH_LENS):
        order = np.random.default_rng(0).permutation(count)
        folds = [order[0::2], order[1::2]]
    else:
        folds = [np.array([k]) for k in range(count)]
    errors = np.full(count, np.nan)
    for fold in folds:
        rest = pairs.take(np.setdiff1d(np.arange(count), fold))
        errors[fold] = floor_errors_mm(_fit(rest, start, options).camera, pairs.take(fold))
    return errors


def error_budget(camera: CameraModel, mark_height_m: float) -> dict[str, float]:
    """Return what 0.1 px and 3 mm of mark height cost on the floor, in mm.

    Once for the middle of the image and once for its worst corner that sees the floor.
    """
    right, bottom = camera.width_px - 1.0, camera.height_px - 1.0
    corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
    budget = {"height_m": mark_height_m}
    places = {"centre": [(0.5 * right, 0.5 * bottom)], "corner": corners}
    for name, pixels in places.items():
        # A corner above the horizon sees no floor and has no error there.
        jacobians = [camera.floor_jacobian(u, v, mark_height_m) for u, v in pixels]
        slopes = [float(np.linalg.norm(j, 2)) for j in jacobians if np.isfinite(j).all()]
        leans = [float(np.hypot(*camera.lean(u, v))) for u, v in pixels]
        budget[f"pixel_{name}_mm"] = max(slopes, default=0.0) * 0.1e3
        budget[f"height_{name}_mm"] = max((x for x in leans if np.isfinite(x)), default=0.0) * 3.0
    return budget
