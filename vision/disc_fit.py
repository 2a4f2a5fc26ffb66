"""Round colour marks measured at their rims: where a disc of known size lies, to hundredths of a px.

Across the rim of each disc, as the camera model projects it, profiles of the colour response run
from inside to outside. A profile's edge is found against its own two ends, so light that differs
round the rim (a gradient, a shadow's edge, a lamp's reflection) does not pull it; even blur does
not move it either. Discs of free centre and size are fitted to the edges; profiles that something
covers fall out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.camera import CameraModel
from vision.rim_profiles import RAYS, REACH_MIN_PX, REACHES, Edges, Profiles

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Point = tuple[float, float]
Marks = tuple["Disc", "Disc"]

STEPS_MAX = 6
# Before them the centroid of the response, twice: of points in rings up to 1.5 radii.
CENTROIDS = 2
CENTRED_PX = 1.0  # after a move shorter than that one is enough
POLAR_RAYS = 16
POLAR_RADII = np.array((0.3, 0.6, 0.85, 1.05, 1.25, 1.5))
CENTROID_LEVEL = 0.4  # of the way from the surroundings to the highest response
SETTLED_PX = 0.03  # a step this short ends the fit; after one longer than that all rays count again
REKEEP_PX = 0.5
CELL_PX = 8.0
OUTLIER_SIGMAS = 3.0
BESIDE_MIN = 3  # of five rays side by side, more of which must have an edge for that in the middle
EDGE_SIGMA_MIN_PX = 0.05
# Doubt of the radius before the fit, relative, as a pull towards the known one.
RADIUS_SIGMA = 0.02
RADIUS_PULL = (0.15 / RADIUS_SIGMA) ** 2
# Two to four turns of the rim, (RAYS, 6), and how much more noise there is in one turn.
_TURNS = np.outer(np.arange(RAYS) * (2.0 * np.pi / RAYS), (2, 3, 4))
ROUND = np.hstack((np.cos(_TURNS), np.sin(_TURNS)))
NOISE_RATIO = 1.3
# The more so, the more of it is shared by neighbouring rays; that which varies twice may be blur.
NOISE_SLOPE = 0.4
ODD = [1, 2, 4, 5]
# What no residual shows: lens model, interpolation, light within a profile.
FREE_RATIO = 0.001  # of the radius
FREE_PX = 0.004


@dataclass(frozen=True, slots=True)
class Disc:
    """One fitted disc.

    (u_px, v_px) is the image of its centre, `growth` its radius over the known one less 1, `share`
    the part of its rim that was seen, `residual_px` the RMS of those edges, `covariance_px2` that
    of (u, v): uu, uv, vv, `ground_ratio` the brightness beside it over its own.
    """

    u_px: float
    v_px: float
    radius_px: float
    growth: float
    share: float
    residual_px: float
    covariance_px2: tuple[float, float, float]
    contrast_dn: float
    ground_ratio: float


@dataclass(frozen=True, slots=True)
class _Shape:
    """The rim of one disc as seen around one place of the image, and where its profiles run.

    `maps` is (2 axes, RAYS, samples) px from the image of the centre; `rows`, (RAYS, 3), how far an
    edge moves along its profile per px in u, per px in v and per unit of growth; `room_px` what the
    profiles need about the centre; `step_px` how far apart their samples are; `polar` are points
    all over the disc and around it, (N, 2) px from its centre, ring by ring.
    """

    radius_px: float
    step_px: float
    room_px: float
    maps: NDArray[np.float32]
    rows: Array
    polar: NDArray[np.float32]


Shapes = tuple[_Shape, _Shape]


@dataclass(frozen=True, slots=True)
class _Fit:
    """One step of the fit of both discs.

    `centres_px` are those after the step; `rows`, (2, RAYS, 3), and `shift`, (2, RAYS), the
    equations solved, each divided by its expected noise; `scale_px`, (2,), what a unit of them is.
    """

    centres_px: list[Point]
    shapes: Shapes
    move: Array
    keep: Mask
    rows: Array
    shift: Array
    scale_px: Array
    edges: Edges
    colours: NDArray[np.float32]


class RimFitter:
    """Fits both marks at once, at one height over the floor; holds no past but projected rims.

    `weights` is (2, 3): response of each mark as a sum of blue, green and red.
    """

    def __init__(
        self, model: CameraModel, radius_m: float, height_m: float, weights: Array
    ) -> None:
        self._model = model
        self._height_m = height_m
        self._weights = weights.astype(np.float32)[:, :, None]
        angles = np.arange(RAYS) * (2.0 * np.pi / RAYS)
        circle = radius_m * np.stack((np.cos(angles), np.sin(angles)), axis=1)
        self._circle_m = np.vstack((circle, (0.0, 0.0)))
        ray = np.arange(RAYS)
        self._after, self._before = (ray + 1) % RAYS, (ray - 1) % RAYS
        self._beside = (ray[:, None] + np.arange(-2, 3)) % RAYS
        self._polar_area = np.repeat(POLAR_RADII, POLAR_RAYS).astype(np.float32)
        self._shapes: dict[tuple[int, int], _Shape | None] = {}
        middle = self._rim(0.5 * model.width_px, 0.5 * model.height_px)
        self._profiles = Profiles(middle[2] if middle[2] > 1.0 else 1.0)

    def fit(self, image: Image, centres_m: Sequence[Point]) -> Marks | None:
        """Return both discs, front first, from guesses of their centres (x, y), m on their plane.

        The guess may be off by half of the radius. None where a disc is out of view or has no edge.
        """
        centres_px = [self._model.project_point(x, y, self._height_m) for x, y in centres_m]
        for _ in range(CENTROIDS):
            moved = self._centred(image, centres_px)
            if moved is None:
                return None
            far_px = max(
                abs(b - a)
                for one, other in zip(centres_px, moved, strict=True)
                for a, b in zip(one, other, strict=True)
            )
            centres_px = moved
            if far_px < CENTRED_PX:
                break
        keep = found = None
        for _ in range(STEPS_MAX):
            found = self._step(image, centres_px, keep)
            if found is None:
                return None
            centres_px, keep = found.centres_px, found.keep
            if float(np.abs(found.move[:, :2]).max()) < SETTLED_PX:
                break
            if float(np.abs(found.move[:, :2]).max()) > REKEEP_PX:
                keep = None
        assert found is not None
        return self._discs(found)

    def _centred(self, image: Image, centres_px: list[Point]) -> list[Point] | None:
        """Return the centroids of the response about the centres: what the fit starts from.

        A guess leaves next to nothing of its own error in them, and so none in the answer.
        """
        front, rear = (self._shape(u, v) for u, v in centres_px)
        if front is None or rear is None:
            return None
        arms = np.stack((front.polar, rear.polar))
        at = (arms + np.array(centres_px, np.float32)[:, None]).reshape(2, -1, 2)
        colours = cv2.remap(
            image, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        response = (colours.astype(np.float32) @ self._weights)[..., 0]
        base = np.sort(response[:, -POLAR_RAYS:], axis=1)[:, POLAR_RAYS // 2, None]
        level = base + CENTROID_LEVEL * (response.max(axis=1, keepdims=True) - base)
        weight = np.maximum(response - level, 0.0) * self._polar_area
        weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-6)
        moves = (weight[:, None] @ arms)[:, 0].tolist()
        return [(u + du, v + dv) for (u, v), (du, dv) in zip(centres_px, moves, strict=True)]

    def _step(self, image: Image, centres_px: list[Point], keep: Mask | None) -> _Fit | None:
        front, rear = (self._shape(u, v) for u, v in centres_px)
        if front is None or rear is None:
            return None
        shapes = (front, rear)
        colours, edges, usable = self._edges(image, centres_px, shapes)
        step_px = np.array([[shape.step_px] for shape in shapes])
        noise = edges.noise * step_px
        scale_px = 1.0 / np.sqrt(np.mean(noise**-2, axis=1))
        weight = scale_px[:, None] / noise
        rows = np.stack((front.rows, rear.rows)) * (edges.gain * weight)[..., None]
        shift = edges.shift * step_px * weight
        fitted = _robust(rows, shift, usable, keep)
        if fitted is None:
            return None
        move, keep = fitted
        moved = [
            (u + du, v + dv)
            for (u, v), (du, dv) in zip(centres_px, move[:, :2].tolist(), strict=True)
        ]
        return _Fit(moved, shapes, move, keep, rows, shift, scale_px, edges, colours)

    def _shape(self, u_px: float, v_px: float) -> _Shape | None:
        """Return the rim seen at a pixel, taken from the middle of its cell of the image.

        Over half a cell the lens and the distance change a rim's size by 1 % and its middle by
        0.001 px.
        """
        if not math.isfinite(u_px + v_px):
            return None
        key = (math.floor(u_px / CELL_PX), math.floor(v_px / CELL_PX))
        if key not in self._shapes:
            self._shapes[key] = self._projected((key[0] + 0.5) * CELL_PX, (key[1] + 0.5) * CELL_PX)
        return self._shapes[key]

    def _rim(self, u_px: float, v_px: float) -> tuple[Array, Array, float]:
        """Return the rim about the image of its centre, its normals (RAYS, 2), and its radius."""
        floor = self._model.floor_point(u_px, v_px, self._height_m)
        points = np.column_stack((self._circle_m + floor, np.full(RAYS + 1, self._height_m)))
        px = self._model.project(points)
        arms = px[:-1] - px[-1]
        along = arms[self._after] - arms[self._before]
        # Seen from above a circle keeps its turning sense, and image rows run down.
        normals = np.column_stack((-along[:, 1], along[:, 0])) / np.hypot(*along.T)[:, None]
        return arms, normals, float(np.sum(normals * arms, axis=1).mean())

    def _projected(self, u_px: float, v_px: float) -> _Shape | None:
        """Return the rim of a disc with its centre seen at a pixel; None out of sight."""
        arms, normals, radius = self._rim(u_px, v_px)
        if not radius > 1.0:
            return None
        profiles = self._profiles
        reach_px = min(max(REACHES[-1][0] * radius, REACH_MIN_PX), 0.8 * radius)
        step_px = reach_px / profiles.edge
        steps = step_px * np.arange(-profiles.half, profiles.half + 1)
        maps = arms.T[..., None] + normals.T[..., None] * steps
        room = float(np.abs(arms).max() + steps[-1]) + 1.0
        rows = np.column_stack((normals, np.sum(normals * arms, axis=1)))
        polar = (POLAR_RADII[:, None, None] * arms[:: RAYS // POLAR_RAYS]).reshape(-1, 2)
        return _Shape(
            radius, step_px, room, maps.astype(np.float32), rows, polar.astype(np.float32)
        )

    def _edges(
        self, image: Image, centres_px: list[Point], shapes: Shapes
    ) -> tuple[NDArray[np.float32], Edges, Mask]:
        """Return the colours along the profiles about the centres, their edges, and which count."""
        maps = np.stack([shape.maps for shape in shapes], axis=1)
        maps += np.array(centres_px, np.float32).T[:, :, None, None]
        samples = maps.shape[-1]
        u, v = maps.reshape(2, 2 * RAYS, samples)
        colours = cv2.remap(
            image, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT
        ).astype(np.float32)  # fmt: skip
        response = colours.reshape(2, RAYS * samples, 3) @ self._weights
        edges = self._profiles.edges(response.reshape(2, RAYS, samples))
        usable = edges.usable
        height, width = image.shape[:2]
        if not all(
            shape.room_px < at[0] < width - 1 - shape.room_px
            and shape.room_px < at[1] < height - 1 - shape.room_px
            for at, shape in zip(centres_px, shapes, strict=True)
        ):
            within = (u >= 0.0) & (u <= width - 1.0) & (v >= 0.0) & (v <= height - 1.0)
            usable = usable & within.all(axis=1).reshape(2, RAYS)
        if not usable.all():
            # Levels of a ray beside a covered one are half the cover's.
            beside = usable[:, self._beside].sum(axis=2)
            usable = usable & (beside > BESIDE_MIN)
        return colours.reshape(2, RAYS, samples, 3), edges, usable

    def _discs(self, fit: _Fit) -> Marks:
        """Return the figures of both fitted discs."""
        colours = fit.colours.sum(axis=-1)
        ground, own = colours[..., self._profiles.ground], colours[..., self._profiles.own]
        ratio = ground.sum(axis=-1) / np.maximum(own.sum(axis=-1), 1.0)
        covariances = _covariances(fit)
        front, rear = (
            self._disc(fit, i, covariances[i], _median(ratio[i][fit.keep[i]])) for i in (0, 1)
        )
        return front, rear

    def _disc(self, fit: _Fit, i: int, covariance: Array, ground: float) -> Disc:
        keep = fit.keep[i]
        rest = (fit.shift[i] - fit.rows[i] @ fit.move[i]) * keep
        count = int(keep.sum())
        (uu, uv), (_, vv) = covariance.tolist()
        return Disc(
            *fit.centres_px[i], fit.shapes[i].radius_px, float(fit.move[i, 2]), count / RAYS,
            math.sqrt(float(rest @ rest) / count), (uu, uv, vv),
            float(fit.edges.typical_dn[i]), ground,
        )  # fmt: skip


def _median(values: NDArray[np.float32]) -> float:
    return float(np.sort(values)[len(values) // 2])


def _covariances(fit: _Fit) -> Array:
    """Return the covariances of both centres, (2, 2, 2), px^2.

    The noise that moves a disc is that which varies once round its rim; the fit has taken it up.
    What is left has that which varies two to four times, noise of nearly the same kind: pixels and
    blocks shared by neighbouring rays, light, cover.
    """
    weighted = fit.rows * fit.keep[..., None]
    normal = weighted.transpose(0, 2, 1) @ fit.rows
    normal[:, 2, 2] += RADIUS_PULL
    rest = (fit.shift - (fit.rows @ fit.move[..., None])[..., 0]) * fit.keep
    count = fit.keep.sum(axis=1)
    power = (rest @ ROUND) ** 2 * (2.0 / count[:, None])
    slow, shared = power.mean(axis=1), power[:, ODD].mean(axis=1)
    fast = np.sum(rest * rest, axis=1) / np.maximum(count - 3, 1)
    own = NOISE_RATIO * np.maximum(slow, fast)
    own *= np.maximum(shared / np.maximum(fast, 1e-12), 1.0) ** NOISE_SLOPE
    variance = np.maximum(own, 0.5 * (own + own.mean()))
    radius = np.array([shape.radius_px for shape in fit.shapes])
    free = (FREE_RATIO * radius) ** 2 + FREE_PX**2
    centre = np.linalg.inv(normal)[:, :2, :2]
    covariance: Array = centre * variance[:, None, None] + free[:, None, None] * np.eye(2)
    return covariance


def _robust(
    rows: Array, shift: Array, usable: Mask, keep: Mask | None
) -> tuple[Array, Mask] | None:
    """Return (du, dv, growth), (2, 3), without the rays far off the fit, and those that count.

    None when too little of a rim is left.
    """
    tries = 2 if keep is None else 1
    keep = usable if keep is None else usable & keep
    for _ in range(tries):
        move = _solve(rows, shift, keep)
        if move is None:
            return None
        rest = np.abs(shift - (rows @ move[..., None])[..., 0])
        within = usable & (rest < OUTLIER_SIGMAS * _spread(rest, keep))
        if np.array_equal(within, keep):
            return move, keep
        keep = within
    move = _solve(rows, shift, keep)
    return None if move is None else (move, keep)


def _solve(rows: Array, shift: Array, keep: Mask) -> Array | None:
    """Return (du, dv, growth), (2, 3), by least squares; None when too little of a rim is left."""
    if int(keep.sum(axis=1).min()) < RAYS // 6:
        return None
    weighted = (rows * keep[..., None]).transpose(0, 2, 1)
    normal = weighted @ rows
    normal[:, 2, 2] += RADIUS_PULL
    try:
        solution = np.linalg.solve(normal, weighted @ shift[..., None])
    except np.linalg.LinAlgError:
        return None
    return np.asarray(solution[..., 0], dtype=np.float64)


def _spread(rest: Array, keep: Mask) -> Array:
    """Return a robust standard deviation of kept residuals, (2, 1): 1.48 of their median."""
    ordered = np.sort(np.where(keep, rest, np.inf), axis=1)
    middle = ordered[(0, 1), keep.sum(axis=1) // 2]
    return np.maximum(1.4826 * middle, EDGE_SIGMA_MIN_PX)[:, None]
