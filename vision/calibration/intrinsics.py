"""Lens calibration from views of a board: outlier views dropped by name, hold-out error, coverage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision import cv_compat
from vision.calibration.boards import BoardView
from vision.camera import CameraModel

Array = NDArray[np.float64]

VIEWS_MIN = 5
# A view is an outlier when its error stands this many robust deviations, and this factor, above
# the median: near-equal views have a tiny spread, in which plain chance makes "outliers".
OUTLIER_DEVIATIONS = 4.0
OUTLIER_FACTOR = 2.0
DROP_RATIO_MAX = 0.34
GRID_COLUMNS, GRID_ROWS = 8, 6
TILT_WANTED_DEG = 20.0
COVERAGE_WANTED = 0.7


@dataclass(frozen=True, slots=True)
class ViewResult:
    """How well one view fits: RMS residual in px, tilt of the board against the image plane."""

    name: str
    corners: int
    error_px: float
    held_out_px: float
    tilt_deg: float
    dropped: bool


@dataclass(frozen=True, slots=True)
class LensCalibration:
    """A lens with what is known about its worth.

    `lens` is (fx, fy, cx, cy, k1, k2, p1, p2, k3) and `sigma` its standard deviations. `held_out_px`
    is the RMS residual over views the lens was not fitted to, their pose being solved anew.
    `corners_px` and `residuals_px` (seen minus projected) are (N, 2), over all views kept.
    """

    width_px: int
    height_px: int
    lens: Array
    sigma: Array
    error_px: float
    held_out_px: float
    coverage_ratio: float
    views: tuple[ViewResult, ...]
    advice: tuple[str, ...]
    corners_px: Array
    residuals_px: Array

    def model(self) -> CameraModel:
        """Return the lens as a camera at the world's origin that looks along world z."""
        fx, fy, cx, cy, k1, k2, p1, p2, k3 = map(float, self.lens)
        dist = (k1, k2, p1, p2, k3)
        size = (self.width_px, self.height_px)
        return CameraModel(*size, fx, fy, cx, cy, dist, np.eye(3), np.zeros(3))


def calibrate_lens(views: Sequence[BoardView], size_px: tuple[int, int]) -> LensCalibration:
    """Fit the lens to the views, at least 5, dropping outlier views one by one; raises BadInput."""
    kept = list(views)
    dropped: list[tuple[BoardView, float]] = []
    while True:
        if len(kept) < VIEWS_MIN:
            raise BadInput(
                f"lens: {len(kept)} usable views of the board, at least {VIEWS_MIN} are needed;"
                " add views from other sides and tilts"
            )
        lens, sigma, errors, places = _fit(kept, size_px)
        worst = int(np.argmax(errors))
        if not _is_outlier(errors, worst):
            break
        dropped.append((kept.pop(worst), float(errors[worst])))
        if len(dropped) > DROP_RATIO_MAX * len(views):
            names = ", ".join(view.name for view, _ in dropped)
            raise BadInput(
                f"lens: {len(dropped)} of {len(views)} views do not agree with the rest ({names});"
                " is the board flat, and its size as said?"
            )
    _check_lens(lens, size_px)
    held_out = _held_out(kept, size_px)
    tilts = [_tilt_deg(place) for place in places]
    results = [
        ViewResult(view.name, len(view.px), float(error), held, tilt, dropped=False)
        for view, error, held, tilt in zip(kept, errors, held_out, tilts, strict=True)
    ]
    results += [_judge_dropped(view, error, lens) for view, error in dropped]
    covered = coverage([view.px for view in kept], size_px)
    return LensCalibration(
        *size_px,
        lens,
        sigma,
        _rms(errors, kept),
        _rms(np.array(held_out), kept),
        float(np.mean(covered > 0)),
        tuple(results),
        tuple(advise(covered, tilts)),
        np.vstack([view.px for view in kept]),
        np.vstack([residuals(v, lens, place) for v, place in zip(kept, places, strict=True)]),
    )


def _fit(views: Sequence[BoardView], size_px: tuple[int, int]) -> tuple[Array, Array, Array, Array]:
    try:
        return cv_compat.calibrate([v.board_m for v in views], [v.px for v in views], size_px)
    except cv_compat.CvError as error:
        text = str(error).split("error:")[-1].split("\n")[0].strip()
        raise BadInput(f"lens: the views do not determine one ({text}); tilt the board") from None


def _is_outlier(errors: Array, index: int) -> bool:
    median = float(np.median(errors))
    spread = 1.4826 * float(np.median(np.abs(errors - median)))
    limit = max(median + OUTLIER_DEVIATIONS * spread, OUTLIER_FACTOR * median)
    return bool(errors[index] > limit)


def _check_lens(lens: Array, size_px: tuple[int, int]) -> None:
    """Raise BadInput for a lens no camera has: the sign of views that are all alike."""
    width_px, height_px = size_px
    fx, fy, cx, cy = lens[:4]
    inside = 0.0 < cx < width_px and 0.0 < cy < height_px
    if not (0.2 * width_px < fx < 20.0 * width_px and 0.8 < fx / fy < 1.25 and inside):
        raise BadInput(
            f"lens: fitted focal lengths {fx:.0f} x {fy:.0f} px and centre ({cx:.0f}, {cy:.0f}) px"
            f" are not those of a camera of {width_px} x {height_px} px; tilt the board by 20 to 40"
            " deg in several views"
        )


def _held_out(views: Sequence[BoardView], size_px: tuple[int, int]) -> list[float]:
    """Return each view's RMS residual in px under a lens fitted to the other half of the views."""
    errors = [float("nan")] * len(views)
    for fold in (0, 1):
        train = [view for k, view in enumerate(views) if k % 2 != fold]
        lens = _fit(train, size_px)[0]
        for k in range(fold, len(views), 2):
            errors[k] = _view_error(views[k], lens)
    return errors


def _view_error(view: BoardView, lens: Array) -> float:
    place = cv_compat.board_place(lens, view.board_m, view.px)
    return float(np.sqrt(np.mean(np.sum(residuals(view, lens, place) ** 2, axis=1))))


def residuals(view: BoardView, lens: Array, place: Array) -> Array:
    """Return seen minus projected corners, (N, 2), px."""
    difference: Array = view.px - cv_compat.project(lens, place, view.board_m)
    return difference


def _judge_dropped(view: BoardView, error_px: float, lens: Array) -> ViewResult:
    place = cv_compat.board_place(lens, view.board_m, view.px)
    held_out_px = _view_error(view, lens)
    return ViewResult(
        view.name, len(view.px), error_px, held_out_px, _tilt_deg(place), dropped=True
    )


def _tilt_deg(place: Array) -> float:
    """Return the angle between the board's normal and the optical axis, 0 to 90 deg."""
    return float(np.degrees(np.arccos(min(1.0, abs(cv_compat.rotation(place[:3])[2, 2])))))


def slant_deg(view: BoardView) -> float:
    """Return roughly the tilt of a board before any lens is known.

    A tilted board is foreshortened: the cosine of the tilt is the ratio of the extents of the best
    affine map from board to image.
    """
    board = view.board_m[:, :2] - view.board_m[:, :2].mean(axis=0)
    affine = np.linalg.lstsq(board, view.px - view.px.mean(axis=0), rcond=None)[0]
    long, short = np.linalg.svd(affine, compute_uv=False)
    return float(np.degrees(np.arccos(min(1.0, short / long))))


def _rms(errors: Array, views: Sequence[BoardView]) -> float:
    """Return the RMS over all corners of per-view RMS errors."""
    weights = np.array([len(view.px) for view in views], dtype=np.float64)
    return float(np.sqrt(np.average(np.square(errors), weights=weights)))


def coverage(corners_px: Sequence[Array], size_px: tuple[int, int]) -> NDArray[np.int64]:
    """Return how many corners fell into each of 6 x 8 cells of the image, (rows, columns)."""
    every = np.vstack([*corners_px, np.empty((0, 2))])
    edges_v = np.linspace(-0.5, size_px[1] - 0.5, GRID_ROWS + 1)
    edges_u = np.linspace(-0.5, size_px[0] - 0.5, GRID_COLUMNS + 1)
    counts, _, _ = np.histogram2d(every[:, 1], every[:, 0], bins=(edges_v, edges_u))
    return counts.astype(np.int64)


def advise(covered: NDArray[np.int64], tilts_deg: Sequence[float]) -> list[str]:
    """Return what to show the camera next, most useful first; empty when the views suffice."""
    advice = []
    empty = covered == 0
    if np.mean(~empty) < COVERAGE_WANTED:
        thirds = {"upper": slice(0, 2), "middle": slice(2, 4), "lower": slice(4, 6)}
        sides = {"left": slice(0, 3), "centre": slice(3, 5), "right": slice(5, 8)}
        share = {
            f"{down} {across}": float(np.mean(empty[rows, columns]))
            for down, rows in thirds.items()
            for across, columns in sides.items()
        }
        bare = sorted((name for name in share if share[name] > 0.5), key=lambda n: -share[n])
        advice.append(f"hold the board to the {', '.join(bare[:3]) or 'edges'} of the image")
    tilted = sum(tilt > TILT_WANTED_DEG for tilt in tilts_deg)
    if tilted < 3:
        advice.append(f"tilt the board by 20 to 40 deg ({tilted} of 3 such views)")
    if len(tilts_deg) < 10:
        advice.append(f"take {10 - len(tilts_deg)} more views (10 make the error figures stable)")
    return advice
