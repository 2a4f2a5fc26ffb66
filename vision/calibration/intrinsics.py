"""Lens calibration from views of a board: outlier views dropped by name, hold-out error, coverage."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from hil.core.wording import past
from vision import cv_compat
from vision.calibration.boards import BoardView
from vision.calibration.plausible import check_lens
from vision.camera import CameraModel

Array = NDArray[np.float64]

VIEWS_MIN = 5
# Views whose corners lie this close (RMS, share of the image's width) show the board in one place:
# they count once, as copies of a picture or a burst of a board at rest say nothing new. In public
# sets the closest two views are 2 % apart.
ALIKE_RATIO = 0.01
HELD_OUT_MAX_PX = 1.0
# Corners this much further from the lens's centre than any that it was fitted to are extrapolated.
REACH_FACTOR = 1.02
ALONE_CORNERS_RATIO = 0.3
ALONE_VIEWS_RATIO = 0.1
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
    """How well one view fits: RMS residual in px, tilt of the board against the image plane.

    `alone_px` is the RMS on held-out corners without those that this view alone reaches, further
    out than any of the other half; NaN where it is judged by all of its corners.
    """

    name: str
    corners: int
    error_px: float
    held_out_px: float
    tilt_deg: float
    dropped: bool
    alone_px: float = math.nan

    @property
    def judged_px(self) -> float:
        """RMS residual on held-out corners by which the lens is judged."""
        return self.held_out_px if math.isnan(self.alone_px) else self.alone_px


@dataclass(frozen=True, slots=True)
class LensCalibration:
    """A lens with what is known about its worth.

    `lens` is (fx, fy, cx, cy, k1, k2, p1, p2, k3) and `sigma` its standard deviations. `held_out_px`
    is the RMS residual over views the lens was not fitted to, their pose being solved anew.
    `corners_px` and `residuals_px` (seen minus projected) are (N, 2), over all views kept.
    `alike` names views that show the board where another does, with that other one.
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
    alike: tuple[tuple[str, str], ...] = ()

    def model(self) -> CameraModel:
        """Return the lens as a camera at the world's origin that looks along world z."""
        fx, fy, cx, cy, k1, k2, p1, p2, k3 = map(float, self.lens)
        dist = (k1, k2, p1, p2, k3)
        size = (self.width_px, self.height_px)
        return CameraModel(*size, fx, fy, cx, cy, dist, np.eye(3), np.zeros(3))


def calibrate_lens(views: Sequence[BoardView], size_px: tuple[int, int]) -> LensCalibration:
    """Fit the lens to the views, at least 5 that differ; raises BadInput for one not to be believed.

    Views alike count once, outlier views are dropped one by one. Refused are a lens that no camera
    has, one whose focal length is uncertain, and one that misses views it was not fitted to.
    """
    differing, alike = _differing(views, size_px)
    kept, dropped, (lens, sigma, errors, places) = _fit_without_outliers(differing, alike, size_px)
    tilts = [_tilt_deg(place) for place in places]
    check_lens(lens, sigma, size_px, tilts)
    results = _results(kept, errors, tilts, size_px)
    held_out_px = _rms(np.array([result.judged_px for result in results]), kept)
    _check_held_out(held_out_px, results)
    covered = coverage([view.px for view in kept], size_px)
    return LensCalibration(
        *size_px,
        lens,
        sigma,
        _rms(errors, kept),
        held_out_px,
        float(np.mean(covered > 0)),
        (*results, *(_judge_dropped(view, error, lens) for view, error in dropped)),
        (*_advise_alone(results), *advise(covered, tilts)),
        np.vstack([view.px for view in kept]),
        np.vstack([residuals(v, lens, place) for v, place in zip(kept, places, strict=True)]),
        alike,
    )


def _differing(
    views: Sequence[BoardView], size_px: tuple[int, int]
) -> tuple[list[BoardView], tuple[tuple[str, str], ...]]:
    """Return the views that show the board in places of their own, and (name, like which) of others."""
    kept: list[BoardView] = []
    alike: list[tuple[str, str]] = []
    for view in views:
        near = (k for k in kept if distance_px(view, k) < ALIKE_RATIO * size_px[0])
        like = next(near, None)
        if like is None:
            kept.append(view)
        else:
            alike.append((view.name, like.name))
    return kept, tuple(alike)


def distance_px(a: BoardView, b: BoardView) -> float:
    """Return the RMS distance of the corners both views show, infinite without common ones."""
    places = {tuple(p): px for p, px in zip(a.board_m.round(6).tolist(), a.px, strict=True)}
    pairs = [
        px - places[tuple(p)]
        for p, px in zip(b.board_m.round(6).tolist(), b.px, strict=True)
        if tuple(p) in places
    ]
    return float(np.sqrt(np.mean(np.sum(np.square(pairs), axis=1)))) if pairs else float("inf")


Fit = tuple[Array, Array, Array, Array]


def _fit_without_outliers(
    views: list[BoardView], alike: tuple[tuple[str, str], ...], size_px: tuple[int, int]
) -> tuple[list[BoardView], list[tuple[BoardView, float]], Fit]:
    """Return the views kept, those dropped with their error in px, and the fit."""
    kept = list(views)
    dropped: list[tuple[BoardView, float]] = []
    while True:
        if len(kept) < VIEWS_MIN:
            same = f" ({len(alike)} more show it in the same places)" if alike else ""
            raise BadInput(
                f"lens: {len(kept)} usable views of the board that differ{same}, at least {VIEWS_MIN}"
                " are needed; add views from other sides and tilts"
            )
        fit = _fit(kept, size_px)
        errors = fit[2]
        worst = int(np.argmax(errors))
        if not _is_outlier(errors, worst):
            return kept, dropped, fit
        dropped.append((kept.pop(worst), float(errors[worst])))
        if len(dropped) > DROP_RATIO_MAX * len(views):
            names = ", ".join(view.name for view, _ in dropped)
            raise BadInput(
                f"lens: {len(dropped)} of {len(views)} views do not agree with the rest ({names});"
                " is the board flat, and its size as said?"
            )


def _fit(views: Sequence[BoardView], size_px: tuple[int, int]) -> Fit:
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


def _results(
    kept: list[BoardView], errors: Array, tilts: Sequence[float], size_px: tuple[int, int]
) -> list[ViewResult]:
    """Return each view's figures; where the hold-out fails, without corners one view alone reaches."""
    held_out, alone = _held_out(kept, size_px)
    enough = _rms(np.array(held_out), kept) <= HELD_OUT_MAX_PX
    if enough or np.sum(np.isfinite(alone)) > max(1.0, ALONE_VIEWS_RATIO * len(kept)):
        alone = [math.nan] * len(kept)
    rows = zip(kept, errors, held_out, tilts, alone, strict=True)
    return [
        ViewResult(view.name, len(view.px), float(error), held, tilt, False, out)
        for view, error, held, tilt, out in rows
    ]


def _check_held_out(held_out_px: float, results: Sequence[ViewResult]) -> None:
    if held_out_px <= HELD_OUT_MAX_PX:
        return
    worst = sorted(results, key=lambda result: -result.judged_px)
    usual_px = float(np.median([result.judged_px for result in results]))
    what = f"lens: {past(held_out_px, HELD_OUT_MAX_PX, '.2f')} px RMS on held-out views, limit"
    if held_out_px > 100.0:
        what = "lens: more than 100 px RMS on held-out views, limit"
    if usual_px <= HELD_OUT_MAX_PX:
        hint = (
            f"{worst[0].name} has {worst[0].judged_px:.2f} px where half of the views have at most"
            f" {usual_px:.2f} px: take it anew, or more views that reach as far out"
        )
    else:
        hint = "is the board flat and held still, and its size as said (squares, not corners)?"
    raise BadInput(f"{what} {HELD_OUT_MAX_PX:g} px; nothing written: {hint}")


def _advise_alone(results: Sequence[ViewResult]) -> list[str]:
    return [
        f"take another view that reaches as far out as {view.name}: the lens is judged without the"
        f" corners that it alone reaches ({view.held_out_px:.2f} px with, {view.alone_px:.2f} px"
        " without them)"
        for view in results
        if math.isfinite(view.alone_px)
    ]


def _held_out(
    views: Sequence[BoardView], size_px: tuple[int, int]
) -> tuple[list[float], list[float]]:
    """Return each view's RMS residual in px under a lens fitted to the other half of the views.

    The second list has the same without the corners that lie further out than all of that half's,
    where these are few of the view's; NaN for other views.
    """
    errors, alone = [math.nan] * len(views), [math.nan] * len(views)
    for fold in (0, 1):
        train = [view for k, view in enumerate(views) if k % 2 != fold]
        lens = _fit(train, size_px)[0]
        reach_px = REACH_FACTOR * max(_out_px(view, lens).max() for view in train)
        for k in range(fold, len(views), 2):
            errors[k] = _view_error(views[k], lens)
            inside = _out_px(views[k], lens) <= reach_px
            if 0.0 < np.mean(~inside) <= ALONE_CORNERS_RATIO:
                part = replace(views[k], board_m=views[k].board_m[inside], px=views[k].px[inside])
                alone[k] = _view_error(part, lens)
    return errors, alone


def _out_px(view: BoardView, lens: Array) -> Array:
    """Return how far a view's corners lie from the lens's centre."""
    return np.asarray(np.linalg.norm(view.px - lens[2:4], axis=1))


def _view_error(view: BoardView, lens: Array) -> float:
    place = cv_compat.board_place(lens, view.board_m, view.px)
    return float(np.sqrt(np.mean(np.sum(residuals(view, lens, place) ** 2, axis=1))))


def off_lens_px(others: Sequence[BoardView], view: BoardView, size_px: tuple[int, int]) -> float:
    """Return a view's RMS residual in px under the lens of other views; raises BadInput for few."""
    if len(others) < VIEWS_MIN:
        raise BadInput(
            f"lens: {view.name} is turned by 90 deg against {len(others)} others, at least"
            f" {VIEWS_MIN} are needed to see which way; turn all of them alike"
        )
    return _view_error(view, _fit(others, size_px)[0])


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
