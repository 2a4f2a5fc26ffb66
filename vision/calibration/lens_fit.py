"""One lens fitted to views of a board: OpenCV's pinhole of five terms or rational of eight, or a fisheye.

The fisheye is that of `vision.camera`, three terms of the ray's angle. It and the rational lens,
which OpenCV's steps lead to poles within the image now and then, are fitted here by Levenberg and
Marquardt over lens and board places, starting from the pinhole, or the best of some focal lengths:
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

# What of the lens numbers a fit moves: of a fisheye all but the decentring p1 and p2.
FREE = {"fisheye": np.array([0, 1, 2, 3, 4, 5, 8]), "rational": np.arange(12)}
# The terms of a quotient balance each other: where the corners leave them open they stay near 0,
# as if each had been measured as 0 +- 1 beside corners of 0.1 px.
RIDGE = {
    "fisheye": np.zeros(7),
    "rational": np.r_[np.zeros(4), 0.1, 0.1, 0.0, 0.0, np.full(4, 0.1)],
}
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
        return self.pixels(board_m @ cv_compat.rotation(place[:3]).T + place[3:])

    def pixels(self, seen: Array) -> Array:
        """Return the pixels, (N, 2), of points in the camera's axes, (N, 3), m."""
        z = np.maximum(seen[:, 2], 1e-6)
        fx, fy, cx, cy, *dist = self.numbers
        u, v = distort(seen[:, 0] / z, seen[:, 1] / z, (*dist,), fisheye=self.fisheye)
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

    `start` is a fisheye or rational lens near the answer, with the views' places.
    """
    try:
        if kind == "fisheye":
            if start is not None:
                return _fit_steps(views, *start, STEPS_FROM_NEAR)
            return _fit_steps(views, *_start(views, size_px), STEPS_MAX)
        if kind == "rational" and start is not None:
            return _fit_steps(views, *start, STEPS_FROM_NEAR)
        fit = cv_compat.calibrate([v.board_m for v in views], [v.px for v in views], size_px)
        if kind == "rational":
            found = _fit_steps(views, Lens(np.r_[fit[0], np.zeros(3)]), fit[3], STEPS_MAX)
            check_rational(found.lens.numbers, np.vstack([view.px for view in views]))
            return found
    except (cv_compat.CvError, np.linalg.LinAlgError) as error:
        text = str(error).split("error:")[-1].split("\n")[0].strip()
        raise BadInput(f"lens: the views do not determine one ({text}); tilt the board") from None
    return LensFit(Lens(fit[0]), *fit[1:])


def _fit_steps(views: Sequence[BoardView], lens: Lens, places: Array, steps_max: int) -> LensFit:
    free = FREE[lens.kind]
    damping, cost = 1e-3, _cost(lens, views, places)
    for _ in range(steps_max):
        rest, slopes = _system(lens, views, places)
        normal, right = slopes.T @ slopes, slopes.T @ rest
        before = cost
        while damping < DAMPING_MAX:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), right)
            numbers = lens.numbers.copy()
            numbers[free] += step[: len(free)]
            tried, moved = Lens(numbers, lens.fisheye), places + step[len(free) :].reshape(-1, 6)
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
    noise = float(np.sum(rest**2)) / max(1, len(rest) - len(RIDGE[lens.kind]) - slopes.shape[1])
    covariance = noise * np.linalg.pinv(slopes.T @ slopes)
    free, sigma = FREE[lens.kind], np.zeros(len(lens.numbers))
    sigma[free] = np.sqrt(np.maximum(np.diag(covariance)[: len(free)], 0.0))
    pairs = zip(views, places, strict=True)
    errors = np.array([_rms(lens.residuals(view, place)) for view, place in pairs])
    return LensFit(lens, sigma, errors, places)


@dataclass(frozen=True, slots=True)
class _Corners:
    """The corners of all views under one another: on the board, seen, and of which view, (N,)."""

    board_m: Array
    px: Array
    view: NDArray[np.int64]

    @classmethod
    def of(cls, views: Sequence[BoardView]) -> _Corners:
        counts = [len(view.px) for view in views]
        board_m = np.vstack([view.board_m for view in views])
        return cls(
            board_m, np.vstack([v.px for v in views]), np.repeat(np.arange(len(views)), counts)
        )

    def project(self, lens: Lens, places: Array) -> Array:
        """Return the pixels, (N, 2), of all corners, the boards being at their places, (V, 6)."""
        turns = np.array([cv_compat.rotation(place[:3]) for place in places])
        seen = np.einsum("nij,nj->ni", turns[self.view], self.board_m) + places[self.view, 3:]
        return lens.pixels(seen)

    def rest(self, lens: Lens, places: Array) -> Array:
        """Return seen minus projected pixels, (2 N,)."""
        return np.asarray((self.px - self.project(lens, places)).ravel())


def _cost(lens: Lens, views: Sequence[BoardView], places: Array) -> float:
    ridge = RIDGE[lens.kind] * lens.numbers[FREE[lens.kind]]
    return float(np.sum(_Corners.of(views).rest(lens, places) ** 2) + np.sum(ridge**2))


def _system(lens: Lens, views: Sequence[BoardView], places: Array) -> tuple[Array, Array]:
    """Return residuals and the slopes of the projections by lens and places, all views stacked."""
    corners, free, ridge = _Corners.of(views), FREE[lens.kind], RIDGE[lens.kind]
    count = len(free)
    rows = np.arange(2 * len(corners.px))
    slopes = np.zeros((len(rows), count + 6 * len(views)))
    for column, k in enumerate(free):
        step = STEP_RATIO * max(1.0, abs(float(lens.numbers[k])))
        ends = []
        for sign in (1.0, -1.0):
            numbers = lens.numbers.copy()
            numbers[k] += sign * step
            ends.append(corners.project(Lens(numbers, lens.fisheye), places))
        slopes[:, column] = (ends[0] - ends[1]).ravel() / (2.0 * step)
    for k in range(6):  # of all boards at once: a corner moves with its own alone
        step_6 = np.zeros(6)
        step_6[k] = STEP_RATIO
        moved = corners.project(lens, places + step_6) - corners.project(lens, places - step_6)
        slopes[rows, count + 6 * np.repeat(corners.view, 2) + k] = moved.ravel() / (
            2.0 * STEP_RATIO
        )
    held = np.hstack((np.diag(ridge), np.zeros((count, 6 * len(views)))))
    rest = np.concatenate((corners.rest(lens, places), -ridge * lens.numbers[free]))
    return rest, np.vstack((slopes, held))


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
