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
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.camera import CameraModel

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Point = tuple[float, float]
Marks = tuple["Disc", "Disc"]

RAYS = 48
# Rays over which an edge's two levels are averaged: a sixth of the rim follows a shadow's edge.
LEVEL_RAYS = 7
# How far from the rim an edge is looked for, and how far beyond that its two levels are taken, in
# radii. The longer, the more noise gets in; motion blur at 0.5 m/s over 20 ms is 0.17 each way.
Reach = tuple[float, float]
WIDE, NEAR, FINE = (0.55, 0.15), (0.35, 0.15), (0.18, 0.3)
REACH_MIN_PX = 1.6
STEPS_MAX = 2
BLURRED_SHARE = 0.8  # of the step seen by long profiles, where a blurred edge fills short ones
SETTLED_PX = 0.2  # a step ends within a few % of its length of the answer
CELL_PX = 8.0
# A ray counts when its step is this share of the disc's typical one, and its edge within the profile.
STEP_SHARE = 0.3
SHIFT_SHARE = 0.8
RESPONSE_MIN_DN = 6.0
OUTLIER_SIGMAS = 3.0
EDGE_SIGMA_MIN_PX = 0.05
# Doubt of the radius before the fit, relative, as a pull towards the known one.
RADIUS_SIGMA = 0.02
RADIUS_PULL = (0.15 / RADIUS_SIGMA) ** 2
# Neighbouring rays share pixels, so their errors are not independent; noise that is large against
# the mark moves levels as well as edges. Both fitted to errors seen on rendered sequences.
CORRELATION = 1.6
ROUGHNESS = 8.0


@dataclass(frozen=True, slots=True)
class Disc:
    """One fitted disc.

    (u_px, v_px) is the image of its centre, `growth` its radius over the known one less 1, `share`
    the part of its rim that was seen, `residual_px` the RMS of those edges, `sigma_px` the standard
    deviation per axis, `ground_ratio` the brightness beside it over its own.
    """

    u_px: float
    v_px: float
    radius_px: float
    growth: float
    share: float
    residual_px: float
    sigma_px: float
    contrast_dn: float
    ground_ratio: float


@dataclass(frozen=True, slots=True)
class _Shape:
    """The rim of one disc as seen around one place of the image, and where its profiles run.

    `maps` is (2 axes, RAYS, samples) px from the image of the centre; `rows`, (RAYS, 3), how far an
    edge moves along its profile per px in u, per px in v and per unit of growth; `room_px` what the
    profiles need about the centre; `level_samples` how many samples at each end of a profile give
    its levels.
    """

    radius_px: float
    reach_px: float
    room_px: float
    level_samples: int
    maps: NDArray[np.float32]
    rows: Array


Shapes = tuple[_Shape, _Shape]


@dataclass(frozen=True, slots=True)
class _Edges:
    """Edges found along the profiles of both discs, (2, RAYS), and whether each can count.

    `colours` is (2, RAYS, 3 samples); `typical` the response of the discs, (2,); `rise_dn` that
    from outside to inside, (2, RAYS).
    """

    colours: NDArray[np.float32]
    shift_px: Array
    usable: Mask
    typical: Array
    rise_dn: NDArray[np.float32]


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
        apart = np.abs((ray[:, None] - ray + RAYS // 2) % RAYS - RAYS // 2)
        self._smooth = ((apart <= LEVEL_RAYS // 2) / LEVEL_RAYS).astype(np.float32)
        self._shapes: dict[tuple[int, int, Reach], _Shape | None] = {}
        self._layouts = {reach: self._layout_of(reach) for reach in (WIDE, NEAR, FINE)}

    def fit(self, image: Image, centres_m: Sequence[Point], *, wide: bool) -> Marks | None:
        """Return both discs, front first, from guesses of their centres (x, y), m on their plane.

        The guess may be off by a quarter of the radius, with `wide` by half of it. None where a
        disc is out of view or has no edge.
        """
        centres_px = [self._model.project_point(x, y, self._height_m) for x, y in centres_m]
        if wide:
            rough = self._settled(image, centres_px, WIDE)
            if rough is None:
                return None
            centres_px = rough[0]
        near = self._settled(image, centres_px, NEAR)
        if near is None:
            return None
        fine = self._settled(image, near[0], FINE)
        return None if fine is None else self._discs(*(near if _blurred(near[4], fine[4]) else fine))

    def _settled(
        self, image: Image, centres_px: list[Point], reach: Reach
    ) -> tuple[list[Point], Shapes, Array, Mask, _Edges] | None:
        """Return the centres, px, with the rims, last move (2, 3), rays that count and edges."""
        keep = found = None
        for _ in range(STEPS_MAX):
            front, rear = (self._shape(u, v, reach) for u, v in centres_px)
            if front is None or rear is None:
                return None
            edges = self._edges(image, centres_px, (front, rear))
            rows = np.stack((front.rows, rear.rows))
            fitted = _robust(rows, edges.shift_px, edges.usable, keep)
            if fitted is None:
                return None
            move, keep = fitted
            (du0, dv0), (du1, dv1) = moves = move[:, :2].tolist()
            (u0, v0), (u1, v1) = centres_px
            centres_px = [(u0 + du0, v0 + dv0), (u1 + du1, v1 + dv1)]
            found = centres_px, (front, rear), move, keep, edges
            if max(abs(d) for way in moves for d in way) < SETTLED_PX:
                break
        return found

    def _layout_of(self, reach: Reach) -> tuple[int, int]:
        """Return how many samples a profile has on each side for the edge and for a level.

        They are about a pixel apart in the middle of the image.
        """
        model = self._model
        shape = self._projected(0.5 * model.width_px, 0.5 * model.height_px, reach, (1, 1))
        radius = shape.radius_px if shape else 1.0
        edge_px = max(reach[0] * radius, REACH_MIN_PX)
        return math.ceil(edge_px), max(2, round(reach[1] * radius))

    def _shape(self, u_px: float, v_px: float, reach: Reach) -> _Shape | None:
        """Return the rim seen at a pixel, taken from the middle of its cell of the image.

        Over half a cell the lens and the distance change a rim's size by 1 % and its middle by
        0.001 px.
        """
        if not math.isfinite(u_px + v_px):
            return None
        key = (math.floor(u_px / CELL_PX), math.floor(v_px / CELL_PX), reach)
        if key not in self._shapes:
            u, v = (key[0] + 0.5) * CELL_PX, (key[1] + 0.5) * CELL_PX
            self._shapes[key] = self._projected(u, v, reach, self._layouts[reach])
        return self._shapes[key]

    def _projected(
        self, u_px: float, v_px: float, reach: Reach, layout: tuple[int, int]
    ) -> _Shape | None:
        """Return the rim of a disc with its centre seen at a pixel; None out of sight."""
        floor = self._model.floor_point(u_px, v_px, self._height_m)
        points = np.column_stack((self._circle_m + floor, np.full(RAYS + 1, self._height_m)))
        px = self._model.project(points)
        arms = px[:-1] - px[-1]
        along = arms[self._after] - arms[self._before]
        # Seen from above a circle keeps its turning sense, and image rows run down.
        normals = np.column_stack((-along[:, 1], along[:, 0])) / np.hypot(*along.T)[:, None]
        support = np.sum(normals * arms, axis=1)
        radius = float(support.mean())
        if not radius > 1.0:
            return None
        edge, level = layout
        reach_px = min(max(reach[0] * radius, REACH_MIN_PX), 0.8 * radius)
        steps = reach_px / edge * np.arange(-edge - level, edge + level + 1)
        maps = arms.T[..., None] + normals.T[..., None] * steps
        room = float(np.abs(arms).max() + steps[-1]) + 1.0
        rows = np.column_stack((normals, support))
        return _Shape(radius, reach_px, room, level, maps.astype(np.float32), rows)

    def _edges(self, image: Image, centres_px: list[Point], shapes: Shapes) -> _Edges:
        """Return the edges found across the rims about the centres."""
        maps = np.stack([shape.maps for shape in shapes], axis=1)
        maps += np.array(centres_px, np.float32).T[:, :, None, None]
        samples = maps.shape[-1]
        u, v = maps.reshape(2, 2 * RAYS, samples)
        colours = cv2.remap(
            image, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT
        ).astype(np.float32)  # fmt: skip
        response = colours.reshape(2, RAYS * samples, 3) @ self._weights
        sums = response.reshape(2, RAYS, samples) @ _sums(samples, shapes[0].level_samples)
        inside = sums[..., 0]
        inner, outer = (self._smooth @ sums[..., :2]).transpose(2, 0, 1)
        rise = inner - outer
        typical = np.sort(inside, axis=1)[:, (3 * RAYS) // 4]
        least = np.maximum(STEP_SHARE * typical, RESPONSE_MIN_DN)[:, None]
        swing = 2.0 * (sums[..., 2] - outer) / np.maximum(rise, 1.0) - 1.0
        usable = (np.minimum(rise, inside) > least) & (np.abs(swing) < SHIFT_SHARE)
        height, width = image.shape[:2]
        if not all(
            shape.room_px < at[0] < width - 1 - shape.room_px
            and shape.room_px < at[1] < height - 1 - shape.room_px
            for at, shape in zip(centres_px, shapes, strict=True)
        ):
            within = (u >= 0.0) & (u <= width - 1.0) & (v >= 0.0) & (v <= height - 1.0)
            usable &= within.all(axis=1).reshape(2, RAYS)
        reach = np.array([[shape.reach_px] for shape in shapes])
        return _Edges(colours.reshape(2, RAYS, -1), swing * reach, usable, typical, rise)

    def _discs(
        self, centres_px: list[Point], shapes: Shapes, move: Array, keep: Mask, edges: _Edges
    ) -> Marks:
        """Return the figures of both fitted discs."""
        seen = np.matmul(keep[:, None].astype(np.float32), edges.colours)[:, 0]
        dark, bright = seen[:, -6:].sum(axis=1).tolist(), seen[:, :6].sum(axis=1).tolist()
        growth, typical = move[:, 2].tolist(), edges.typical.tolist()
        front, rear = (
            self._disc(
                centres_px[i], shapes[i], edges.shift_px[i][keep[i]], shapes[i].rows[keep[i]],
                move[i], (growth[i], typical[i], dark[i] / max(bright[i], 1.0)),
            )
            for i in (0, 1)
        )  # fmt: skip
        return front, rear

    def _disc(
        self,
        centre_px: Point,
        shape: _Shape,
        shift: Array,
        rows: Array,
        move: Array,
        figures: tuple[float, float, float],
    ) -> Disc:
        rest = shift - rows @ move
        residual = math.sqrt(float(rest @ rest) / len(rest))
        sigma = max(residual, EDGE_SIGMA_MIN_PX) * math.sqrt(CORRELATION * _variance(rows))
        sigma *= 1.0 + ROUGHNESS * residual / shape.radius_px
        share = len(rest) / RAYS
        growth, typical, ground = figures
        return Disc(*centre_px, shape.radius_px, growth, share, residual, sigma, typical, ground)


@cache
def _sums(samples: int, level: int) -> NDArray[np.float32]:
    """Return the sums taken over a profile, (samples, 3): its inner end, outer end, mean between."""
    sums = np.zeros((samples, 3), np.float32)
    sums[:level, 0] = sums[-level:, 1] = 1.0 / level
    between = sums[level:-level, 2]
    between[:] = 1.0 / (len(between) - 1)
    between[[0, -1]] *= 0.5
    return sums


def _blurred(near: _Edges, fine: _Edges) -> bool:
    """Return whether blur reaches the ends of the short profiles: they lose much of the step."""
    kept = np.sort(fine.rise_dn / np.maximum(near.rise_dn, 1.0), axis=1)[:, RAYS // 8]
    return bool(kept.min() < BLURRED_SHARE)


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


def _variance(rows: Array) -> float:
    """Return the mean variance of u and v for edges of variance 1."""
    normal = rows.T @ rows
    normal[2, 2] += RADIUS_PULL
    (a, b, c), (_, d, e), (_, _, f) = normal.tolist()
    det = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
    return 0.5 * ((d * f - e * e) + (a * f - c * c)) / det if det > 0.0 else math.inf


def _spread(rest: Array, keep: Mask) -> Array:
    """Return a robust standard deviation of kept residuals, (2, 1): 1.48 of their median."""
    ordered = np.sort(np.where(keep, rest, np.inf), axis=1)
    middle = ordered[(0, 1), keep.sum(axis=1) // 2]
    return np.maximum(1.4826 * middle, EDGE_SIGMA_MIN_PX)[:, None]
