"""Lens calibration from views of a board: outlier views dropped by name, hold-out error, coverage.

Which kind of lens it is is told by evidence: the error on views that it was not fitted to.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from hil.core.wording import past
from vision import cv_compat
from vision.calibration.advice import Sight, advise, coverage
from vision.calibration.boards import BoardView
from vision.calibration.lens_fit import KINDS, Kind, Lens, LensFit, fit_lens
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
# A view is an outlier when its error under the lens of all others stands this many robust
# deviations, and this factor, above the median: near-equal views have a tiny spread, in which plain
# chance makes "outliers". Of many views only those that fit worst are left out to be judged.
OUTLIER_DEVIATIONS = 4.0
OUTLIER_FACTOR = 2.0
DROP_RATIO_MAX = 0.34
JUDGED_MAX = 24
# Another kind of lens than the plainer is taken where it misses held-out views less by this and so much.
KIND_FACTOR = 1.15
KIND_GAIN_PX = 0.02


@dataclass(frozen=True, slots=True)
class ViewResult:
    """How well one view fits: RMS residual in px, tilt of the board against the image plane.

    `left_out_px` is the residual under the lens of all other views, by which outliers are told.
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
    left_out_px: float = math.nan

    @property
    def judged_px(self) -> float:
        """RMS residual on held-out corners by which the lens is judged."""
        return self.held_out_px if math.isnan(self.alone_px) else self.alone_px


@dataclass(frozen=True, slots=True)
class LensCalibration:
    """A lens with what is known about its worth.

    `lens` is (fx, fy, cx, cy, k1, k2, p1, p2, k3), of a rational lens also k4, k5, k6, and `sigma`
    its standard deviations. `evidence_px` has the median view's error on held-out views for each of
    KINDS, infinite where there is none, empty where it was not asked. `held_out_px` is the RMS
    residual over views the lens was not fitted to, their pose being solved anew.
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
    fisheye: bool = False
    evidence_px: tuple[float, ...] = ()

    @property
    def kind(self) -> Kind:
        """Pinhole, fisheye or rational."""
        return Lens(self.lens, self.fisheye).kind

    def model(self) -> CameraModel:
        """Return the lens as a camera at the world's origin that looks along world z."""
        return Lens(self.lens, self.fisheye).camera((self.width_px, self.height_px))


def calibrate_lens(
    views: Sequence[BoardView], size_px: tuple[int, int], kind: Kind | Literal["auto"] = "auto"
) -> LensCalibration:
    """Fit the lens to the views, at least 5 that differ; raises BadInput for one not to be believed.

    `kind` is one of KINDS, or "auto": what held-out views say.
    Views alike count once, outlier views are dropped one by one. Refused are a lens that no camera
    has, one whose focal length is uncertain, and one that misses views it was not fitted to.
    """
    differing, alike = _differing(views, size_px)
    evidence_px = _evidence(differing, size_px) if kind == "auto" else ()
    kind = _told_kind(evidence_px) if kind == "auto" else kind
    kept, dropped, fit, left_out = _fit_without_outliers(differing, alike, size_px, kind)
    tilts = [_tilt_deg(place) for place in fit.places]
    check_lens(fit.lens.numbers, fit.sigma, size_px, tilts)
    results = _results(kept, fit, left_out, tilts, size_px)
    held_out_px = _rms(np.array([result.judged_px for result in results]), kept)
    _check_held_out(held_out_px, results)
    covered = coverage([view.px for view in kept], size_px)
    pairs = list(zip(kept, fit.places, strict=True))
    return LensCalibration(
        *size_px,
        fit.lens.numbers,
        fit.sigma,
        _rms(fit.errors, kept),
        held_out_px,
        float(np.mean(covered > 0)),
        (*results, *(_judge_dropped(*gone, fit.lens) for gone in dropped)),
        (*_advise_alone(results), *advise(covered, tilts, sights(pairs, size_px))),
        np.vstack([view.px for view in kept]),
        np.vstack([fit.lens.residuals(view, place) for view, place in pairs]),
        alike,
        fit.lens.fisheye,
        evidence_px,
    )


def _evidence(views: Sequence[BoardView], size_px: tuple[int, int]) -> tuple[float, ...]:
    """Return the median view's error under the other half's lens, px, for each of KINDS."""
    if len(views) < 2 * VIEWS_MIN:
        return ()
    found = []
    for kind in KINDS:
        try:
            found.append(float(np.median(_held_out(views, size_px, kind)[0])))
        except BadInput:
            found.append(math.inf)
    return tuple(found)


def _told_kind(evidence_px: tuple[float, ...]) -> Kind:
    """Return the plainest kind that no other beats by the factor and the pixels needed."""
    chosen, least_px = KINDS[0], evidence_px[0] if evidence_px else math.nan
    for kind, px in zip(KINDS[1:], evidence_px[1:], strict=False):
        if px * KIND_FACTOR < least_px and px + KIND_GAIN_PX < least_px:
            chosen, least_px = kind, px
    return chosen


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


Dropped = tuple[BoardView, float, float]  # with its errors in the fit and left out of it, px


def _fit_without_outliers(
    views: list[BoardView],
    alike: tuple[tuple[str, str], ...],
    size_px: tuple[int, int],
    kind: Kind,
) -> tuple[list[BoardView], list[Dropped], LensFit, Array]:
    """Return the views kept, those dropped, the fit, and the errors of kept views left out of it."""
    kept = list(views)
    dropped: list[Dropped] = []
    while True:
        if len(kept) < VIEWS_MIN:
            same = f" ({len(alike)} more show it in the same places)" if alike else ""
            raise BadInput(
                f"lens: {len(kept)} usable views of the board that differ{same}, at least {VIEWS_MIN}"
                " are needed; add views from other sides and tilts"
            )
        fit = fit_lens(kept, size_px, kind)
        left_out, rest_px = _left_out(kept, fit, size_px)
        outliers = [k for k in range(len(kept)) if _is_outlier(left_out, k)]
        if not outliers:
            return kept, dropped, fit, left_out
        # One bad view sets good ones apart too: the one without which the others agree best is it.
        worst = min(outliers, key=lambda k: (rest_px[k], -left_out[k]))
        dropped.append((kept.pop(worst), float(fit.errors[worst]), float(left_out[worst])))
        if len(dropped) > DROP_RATIO_MAX * len(views):
            names = ", ".join(gone[0].name for gone in dropped)
            raise BadInput(
                f"lens: {len(dropped)} of {len(views)} views do not agree with the rest ({names});"
                " is the board flat, and its size as said?"
            )


def _left_out(
    views: Sequence[BoardView], fit: LensFit, size_px: tuple[int, int]
) -> tuple[Array, Array]:
    """Return each view's RMS residual under the lens of all others, px, in their reach.

    The second has the RMS residual of the others among themselves, infinite where not known.
    A view that is off pulls the lens to itself and so hides in the fit's own residuals.
    """
    errors, rest_px = fit.errors.copy(), np.full(len(views), math.inf)
    if len(views) <= VIEWS_MIN:
        return errors, rest_px
    for k in np.argsort(-errors)[:JUDGED_MAX]:
        others = [*views[:k], *views[k + 1 :]]
        try:
            start = fit.lens, np.delete(fit.places, k, axis=0)
            without = fit_lens(others, size_px, fit.lens.kind, start=start)
        except BadInput:  # the others alone determine none: the view is judged in the fit
            continue
        lens, rest_px[k] = without.lens, _rms(without.errors, others)
        inside = _out_px(views[k], lens) <= _reach_px(others, lens)
        if np.mean(~inside) <= ALONE_CORNERS_RATIO:
            errors[k] = lens.error_px(_part(views[k], inside))
    return errors, rest_px


def _reach_px(views: Sequence[BoardView], lens: Lens) -> float:
    """Return how far from the centre a lens fitted to views is not extrapolated."""
    return REACH_FACTOR * max(float(_out_px(view, lens).max()) for view in views)


def _part(view: BoardView, corners: NDArray[np.bool_]) -> BoardView:
    return replace(view, board_m=view.board_m[corners], px=view.px[corners])


def _is_outlier(errors: Array, index: int) -> bool:
    median = float(np.median(errors))
    spread = 1.4826 * float(np.median(np.abs(errors - median)))
    limit = max(median + OUTLIER_DEVIATIONS * spread, OUTLIER_FACTOR * median)
    return bool(errors[index] > limit)


def _results(
    kept: list[BoardView],
    fit: LensFit,
    left_out: Array,
    tilts: Sequence[float],
    size_px: tuple[int, int],
) -> list[ViewResult]:
    """Return each view's figures; where the hold-out fails, without corners one view alone reaches."""
    held_out, alone = _held_out(kept, size_px, fit.lens.kind)
    enough = _rms(np.array(held_out), kept) <= HELD_OUT_MAX_PX
    if enough or np.sum(np.isfinite(alone)) > max(1.0, ALONE_VIEWS_RATIO * len(kept)):
        alone = [math.nan] * len(kept)
    rows = zip(kept, fit.errors, held_out, tilts, alone, left_out, strict=True)
    return [
        ViewResult(view.name, len(view.px), float(error), held, tilt, False, out, float(left))
        for view, error, held, tilt, out, left in rows
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
    views: Sequence[BoardView], size_px: tuple[int, int], kind: Kind
) -> tuple[list[float], list[float]]:
    """Return each view's RMS residual in px under a lens fitted to the other half of the views.

    The second list has the same without the corners that lie further out than all of that half's,
    where these are few of the view's; NaN for other views.
    """
    errors, alone = [math.nan] * len(views), [math.nan] * len(views)
    for fold in (0, 1):
        train = [view for k, view in enumerate(views) if k % 2 != fold]
        lens = fit_lens(train, size_px, kind).lens
        reach_px = _reach_px(train, lens)
        for k in range(fold, len(views), 2):
            errors[k] = lens.error_px(views[k])
            inside = _out_px(views[k], lens) <= reach_px
            if 0.0 < np.mean(~inside) <= ALONE_CORNERS_RATIO:
                alone[k] = lens.error_px(_part(views[k], inside))
    return errors, alone


def _out_px(view: BoardView, lens: Lens) -> Array:
    """Return how far a view's corners lie from the lens's centre."""
    return np.asarray(np.linalg.norm(view.px - lens.numbers[2:4], axis=1))


def off_lens_px(others: Sequence[BoardView], view: BoardView, size_px: tuple[int, int]) -> float:
    """Return a view's RMS residual in px under the lens of other views; raises BadInput for few."""
    if len(others) < VIEWS_MIN:
        raise BadInput(
            f"lens: {view.name} is turned by 90 deg against {len(others)} others, at least"
            f" {VIEWS_MIN} are needed to see which way; turn all of them alike"
        )
    return fit_lens(others, size_px).lens.error_px(view)


def _judge_dropped(view: BoardView, error_px: float, left_out_px: float, lens: Lens) -> ViewResult:
    tilt_deg = _tilt_deg(lens.place(view))
    held_out_px = lens.error_px(view)
    return ViewResult(
        view.name,
        len(view.px),
        error_px,
        held_out_px,
        tilt_deg,
        dropped=True,
        left_out_px=left_out_px,
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


def sights(pairs: Sequence[tuple[BoardView, Array]], size_px: tuple[int, int]) -> list[Sight]:
    """Return what each view, with its board's place, says: tilt, distance, how far out it reaches."""
    half_px = 0.5 * np.array(size_px, dtype=np.float64)
    found = []
    for view, place in pairs:
        middle = cv_compat.rotation(place[:3]) @ view.board_m.mean(axis=0) + place[3:]
        reach = float(np.max(np.abs(view.px - half_px) / half_px))
        found.append(Sight(view.name, _tilt_deg(place), float(middle[2]), reach))
    return found


def _rms(errors: Array, views: Sequence[BoardView]) -> float:
    """Return the RMS over all corners of per-view RMS errors."""
    return float(np.sqrt(np.average(np.square(errors), weights=[len(view.px) for view in views])))
