"""One lens fitted to views of a board: OpenCV's pinhole of five terms or rational of eight, or a fisheye.

The fisheye is that of `vision.camera`, three terms of the ray's angle. It is fitted here by
Levenberg and Marquardt over lens and board places, starting from the best of some focal lengths:
`cv2.fisheye.calibrate` gives no standard deviations, gives up on good views now and then, and its
settings moved between OpenCV 4 and 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision import cv_compat
from vision.calibration.boards import BoardView
from vision.calibration.plausible import RATIONAL_NAMES, check_rational
from vision.camera import CameraModel, distort

Array = NDArray[np.float64]
Size = tuple[int, int]
Kind = Literal["pinhole", "fisheye", "rational"]
KINDS: tuple[Kind, ...] = get_args(Kind)  # the plainer first

# What of the nine lens numbers a fisheye fit moves: all but the decentring p1 and p2.
FREE = np.array([0, 1, 2, 3, 4, 5, 8])
STARTS_F_RATIO = (0.2, 0.3, 0.45, 0.7, 1.0, 1.6)  # focal lengths over the image's width
START_VIEWS = 5
STEPS_MAX = 40
STEPS_FROM_NEAR = 3
STEP_RATIO = 1e-6
SETTLED = 1e-6
DAMPING_MAX = 1e4
RAY_MAX = 12.0  # tan 85 deg: corners further out say nothing of a board's place


@dataclass(frozen=True, slots=True)
class Lens:
    """(fx, fy, cx, cy, k1, k2, p1, p2, k3), px and plain numbers; a rational one also k4, k5, k6."""

    numbers: Array
    fisheye: bool = False

    @property
    def kind(self) -> Kind:
        """Pinhole, fisheye or rational."""
        if self.fisheye:
            return "fisheye"
        return "rational" if len(self.numbers) == len(RATIONAL_NAMES) else "pinhole"

    def camera(self, size_px: Size) -> CameraModel:
        """Return the lens as a camera at the world's origin that looks along world z."""
        fx, fy, cx, cy, *dist = map(float, self.numbers)
        at = (np.eye(3), np.zeros(3))
        return CameraModel(*size_px, fx, fy, cx, cy, tuple(dist), *at, fisheye=self.fisheye)

    def project(self, place: Array, board_m: Array) -> Array:
        """Return the pixels, (N, 2), of board points, (N, 3), at a place, (6,)."""
        if not self.fisheye:
            return cv_compat.project(self.numbers, place, board_m)
        seen = board_m @ cv_compat.rotation(place[:3]).T + place[3:]
        z = np.maximum(seen[:, 2], 1e-6)
        fx, fy, cx, cy, *dist = self.numbers
        u, v = distort(seen[:, 0] / z, seen[:, 1] / z, (*dist,), fisheye=True)
        return np.column_stack((fx * u + cx, fy * v + cy))

    def place(self, view: BoardView, steps: int = 3) -> Array:
        """Return the rotation and translation vectors, (6,), of a view's board; BadInput for none."""
        if not self.fisheye:
            return cv_compat.board_place(self.numbers, view.board_m, view.px)
        with np.errstate(all="ignore"):  # corners beyond what a lens tried can see
            rays = self.camera((1, 1)).normalise(view.px)
            good = np.isfinite(rays).all(axis=1) & (np.abs(rays) < RAY_MAX).all(axis=1)
        if good.sum() < cv_compat.PLACE_POINTS_MIN:
            raise BadInput(f"lens: {view.name} has too few corners that a fisheye lens can see")
        straight = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        place = cv_compat.board_place(straight, view.board_m[good], rays[good])
        for _ in range(steps):
            slopes = _place_slopes(self, view, place)
            rest = self.residuals(view, place).ravel()
            place = place + np.linalg.lstsq(slopes, rest, rcond=None)[0]
        return place

    def residuals(self, view: BoardView, place: Array) -> Array:
        """Return seen minus projected corners, (N, 2), px."""
        difference: Array = view.px - self.project(place, view.board_m)
        return difference

    def error_px(self, view: BoardView) -> float:
        """Return a view's RMS residual, its place being solved anew, px."""
        return _rms(self.residuals(view, self.place(view)))


@dataclass(frozen=True, slots=True)
class LensFit:
    """A lens, the deviations of its numbers, and for each view its RMS residual and place, (V, 6)."""

    lens: Lens
    sigma: Array
    errors: Array
    places: Array


def fit_lens(
    views: Sequence[BoardView],
    size_px: Size,
    kind: Kind = "pinhole",
    *,
    start: tuple[Lens, Array] | None = None,
) -> LensFit:
    """Return the lens fitted to the views; raises BadInput where they do not determine one.

    `start` is a fisheye lens near the answer, with the views' places.
    """
    try:
        if kind == "fisheye":
            if start is not None:
                return _fit_fisheye(views, *start, STEPS_FROM_NEAR)
            return _fit_fisheye(views, *_start(views, size_px), STEPS_MAX)
        boards, seen = [v.board_m for v in views], [v.px for v in views]
        fit = cv_compat.calibrate(boards, seen, size_px, rational=kind == "rational")
    except (cv_compat.CvError, np.linalg.LinAlgError) as error:
        text = str(error).split("error:")[-1].split("\n")[0].strip()
        raise BadInput(f"lens: the views do not determine one ({text}); tilt the board") from None
    if kind == "rational":
        check_rational(fit[0], np.vstack(seen))
    return LensFit(Lens(fit[0]), *fit[1:])


def _fit_fisheye(views: Sequence[BoardView], lens: Lens, places: Array, steps_max: int) -> LensFit:
    damping, cost = 1e-3, _cost(lens, views, places)
    for _ in range(steps_max):
        rest, slopes = _system(lens, views, places)
        normal, right = slopes.T @ slopes, slopes.T @ rest
        before = cost
        while damping < DAMPING_MAX:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), right)
            numbers = lens.numbers.copy()
            numbers[FREE] += step[: len(FREE)]
            tried, moved = Lens(numbers, True), places + step[len(FREE) :].reshape(-1, 6)
            new = _cost(tried, views, moved)
            if new < cost:
                lens, places, cost, damping = tried, moved, new, 0.1 * damping
                break
            damping *= 10.0
        if before - cost <= SETTLED * cost:
            break
    return _judged(lens, views, places)


def _start(views: Sequence[BoardView], size_px: Size) -> tuple[Lens, Array]:
    """Return the equidistant lens that fits best of some focal lengths, with the boards' places."""
    some = views[:: max(1, len(views) // START_VIEWS)]
    best: tuple[float, Lens] | None = None
    for ratio in STARTS_F_RATIO:
        f_px, middle = ratio * size_px[0], (0.5 * (size_px[0] - 1), 0.5 * (size_px[1] - 1))
        lens = Lens(np.array([f_px, f_px, *middle, 0.0, 0.0, 0.0, 0.0, 0.0]), True)
        try:
            cost = _cost(lens, some, np.array([lens.place(view, 0) for view in some]))
        except (BadInput, cv_compat.CvError, np.linalg.LinAlgError):
            continue
        if np.isfinite(cost) and (best is None or cost < best[0]):
            best = cost, lens
    if best is None:
        raise BadInput("lens: the views do not determine a fisheye lens; tilt the board")
    return best[1], np.array([best[1].place(view, 0) for view in views])


def _judged(lens: Lens, views: Sequence[BoardView], places: Array) -> LensFit:
    rest, slopes = _system(lens, views, places)
    noise = float(np.sum(rest**2)) / max(1, len(rest) - slopes.shape[1])
    covariance = noise * np.linalg.pinv(slopes.T @ slopes)
    sigma = np.zeros(9)
    sigma[FREE] = np.sqrt(np.maximum(np.diag(covariance)[: len(FREE)], 0.0))
    pairs = zip(views, places, strict=True)
    errors = np.array([_rms(lens.residuals(view, place)) for view, place in pairs])
    return LensFit(lens, sigma, errors, places)


def _cost(lens: Lens, views: Sequence[BoardView], places: Array) -> float:
    pairs = zip(views, places, strict=True)
    return float(sum(np.sum(lens.residuals(view, place) ** 2) for view, place in pairs))


def _system(lens: Lens, views: Sequence[BoardView], places: Array) -> tuple[Array, Array]:
    """Return residuals and the slopes of the projections by lens and places, all views stacked."""
    count = len(FREE)
    slopes = np.zeros((2 * sum(len(view.px) for view in views), count + 6 * len(views)))
    rest, row = [], 0
    for k, (view, place) in enumerate(zip(views, places, strict=True)):
        end = row + 2 * len(view.px)
        at = count + 6 * k
        slopes[row:end, :count] = _lens_slopes(lens, view, place)
        slopes[row:end, at : at + 6] = _place_slopes(lens, view, place)
        rest.append(lens.residuals(view, place).ravel())
        row = end
    return np.concatenate(rest), slopes


def _lens_slopes(lens: Lens, view: BoardView, place: Array) -> Array:
    columns = []
    for k in FREE:
        step = STEP_RATIO * max(1.0, abs(float(lens.numbers[k])))
        ends = []
        for sign in (1.0, -1.0):
            numbers = lens.numbers.copy()
            numbers[k] += sign * step
            ends.append(Lens(numbers, lens.fisheye).project(place, view.board_m))
        columns.append((ends[0] - ends[1]).ravel() / (2.0 * step))
    return np.column_stack(columns)


def _place_slopes(lens: Lens, view: BoardView, place: Array) -> Array:
    columns = []
    for k in range(6):
        step = np.zeros(6)
        step[k] = STEP_RATIO
        moved = lens.project(place + step, view.board_m) - lens.project(place - step, view.board_m)
        columns.append(moved.ravel() / (2.0 * STEP_RATIO))
    return np.column_stack(columns)


def _rms(residuals: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))
