"""Where the robot may be: pairs of coarse places scored together, best first.

The image is shrunk so that a mark is 4 to 8 px wide; where the lens shows marks of very different
sizes (a camera at an angle), far and near floor are looked at in pictures of their own. A place is
a peak of a mark's colour against its surroundings. Around each, points inside and outside the rim
that a mark would have there, on the marks' plane, say whether it is round, of the right size and on
dark ground. Two places are a hypothesis; its score adds colour, rim, ground and distance, and no
place is given up for its own figures alone.

The grid of a window is that of the whole image, so a place found in a window is, to the last digit,
that found in the whole image: a prediction says where to look and cannot pull what is found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.camera import CameraModel

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Image = NDArray[np.uint8]
Point = tuple[float, float]
Centres = tuple[Point, Point]
Window = tuple[int, int, int, int]  # left, top, right, bottom, px

# A mark is this wide at least in the picture it is looked for in, and less than twice that, px.
COARSE_DIAMETER_PX = 4.0
# Marks narrower than that in the full image are not looked for.
LEAST_DIAMETER_PX = 5.0
LEVELS_MAX = 3
MEAN_PX, ABOUT_PX = 5, 15
# Rise of the mean response over a mark against its surroundings, DN: a third of a dim green mark's.
RISE_MIN_DN = 3.0
# Blue, green and red as two chromas, orthonormal and zero for grey.
CHROMA_BASIS = np.array(
    [
        [-math.sqrt(0.5), math.sqrt(0.5), 0.0],
        [-math.sqrt(1 / 6), -math.sqrt(1 / 6), math.sqrt(2 / 3)],
    ]
)
HUE_COS_MIN = 0.8  # 37 deg: coloured light, white balance and what lies beside the mark
PLACES_MAX = 250  # a mark and level
KEPT_MAX = 40  # of them, those that look most like a mark
PAIRS_MAX = 12
# Where inside and outside are tried, radii from the centre.
INSIDE, OUTSIDE = 0.6, 1.5
# How far off a coarse distance may be, and its standard deviation, share of a mark's radius.
DISTANCE_LIMIT, DISTANCE_SIGMA = 1.2, 0.3
# What a hypothesis loses: a rim half wrong, ground as bright as the mark, a hue 37 deg off.
SHAPE_LOSS, GROUND_LOSS, HUE_LOSS = 8.0, 2.0, 10.0
SHAPE_MIN = 0.3
CENTROID_STEPS = 1
# A peak must fall to a half this far from it, in 7 of 8 directions at least.
_AROUND = np.rint(
    7.0 * np.stack((np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)), axis=1)
).astype(np.int64)
AROUND_MIN = 7


def _disc_points() -> tuple[Array, Array, Array]:
    """Return points inside, points outside and points all over, (N, 2), in radii."""
    turn = 2.0 * np.pi * np.arange(16) / 16
    circle = np.column_stack((np.cos(turn), np.sin(turn)))
    inner = np.vstack(((0.0, 0.0), INSIDE * circle[::2]))
    steps = np.linspace(-1.3, 1.3, 9)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return inner, OUTSIDE * circle, grid[np.hypot(*grid.T) <= 1.31]


INNER, OUTER, OVER = _disc_points()


@dataclass(frozen=True, slots=True)
class _Level:
    """One shrunk picture: `rows` are those of the full image in which a mark has its size."""

    shrink: int
    rows: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Places:
    """Places of one mark: (N, 2) m on the marks' plane and what each loses in score, (N,)."""

    centres_m: Array
    loss: Array


NONE = Places(np.empty((0, 2)), np.empty(0))


class MarkSearch:
    """Looks for pairs of marks; holds no past.

    `hues` is (2, 2): chroma direction of the front and rear mark.
    """

    def __init__(
        self, model: CameraModel, radius_m: float, height_m: float, distance_m: float, hues: Array
    ) -> None:
        self._model = model
        self._radius_m, self._height_m, self._distance_m = radius_m, height_m, distance_m
        self._hues = hues.astype(np.float32)
        self._levels = self._levels_of()
        self.grid_px = max(level.shrink for level in self._levels)

    def _levels_of(self) -> list[_Level]:
        """Return the pictures to look at, from the diameter of a mark along the rows."""
        model = self._model
        rows = np.linspace(0.0, model.height_px - 1.0, 25)
        across = np.linspace(0.02, 0.98, 7) * model.width_px
        least = []
        for v in rows:
            ways = [model.floor_jacobian(u, v, self._height_m) for u in across]
            widths = [
                2.0 * self._radius_m / float(np.linalg.norm(way, 2))
                for way in ways if np.isfinite(way).all()
            ]  # fmt: skip
            least.append(min(widths, default=0.0))
        narrow = np.array(least)
        seen = narrow >= LEAST_DIAMETER_PX
        if not seen.any():
            return [_Level(1, (0, model.height_px))]
        factor = math.floor(math.log2(max(float(narrow[seen].min()) / COARSE_DIAMETER_PX, 1.0)))
        top = math.floor(math.log2(max(float(narrow.max()) / COARSE_DIAMETER_PX, 1.0)))
        levels = []
        for power in range(factor, min(top, factor + LEVELS_MAX - 1) + 1):
            low = COARSE_DIAMETER_PX * 2**power
            high = 2.0 * low if power < top else math.inf
            own = seen & (narrow >= (0.0 if power == factor else 0.9 * low)) & (narrow < high)
            if own.any():
                at = rows[own]
                step = rows[1]
                bounds = (max(0, int(at.min() - step)), min(model.height_px, int(at.max() + step)))
                levels.append(_Level(2**power, bounds))
        return levels

    def pairs(self, image: Image, window: Window) -> tuple[list[Centres], str]:
        """Return hypotheses (front, rear centre in m), likeliest first; if none, the reason."""
        found: list[list[Places]] = [[], []]
        left, top = (edge // self.grid_px * self.grid_px for edge in window[:2])
        picture, shrink = image[top : window[3], left : window[2]], 1
        for level in self._levels:
            while shrink < level.shrink:
                picture, shrink = _halved(picture), 2 * shrink
            if min(picture.shape[:2]) < 4:
                break
            for mark, places in enumerate(self._places(picture, (left, top), level)):
                found[mark].append(places)
        front, rear = (_merged(places) for places in found)
        for name, places in (("front", front), ("rear", rear)):
            if not len(places.loss):
                return [], f"{name} mark not found"
        return self._paired(front, rear), "marks found, but none the robot's distance apart"

    def _paired(self, front: Places, rear: Places) -> list[Centres]:
        away = front.centres_m[:, None] - rear.centres_m
        misfit = (np.hypot(away[..., 0], away[..., 1]) - self._distance_m) / self._radius_m
        loss = front.loss[:, None] + rear.loss + 0.5 * (misfit / DISTANCE_SIGMA) ** 2
        loss = np.where(np.abs(misfit) < DISTANCE_LIMIT, loss, np.inf)
        best = np.argsort(loss, axis=None, kind="stable")[:PAIRS_MAX]
        first, second = np.unravel_index(best[np.isfinite(loss.ravel()[best])], loss.shape)
        return [
            ((float(f[0]), float(f[1])), (float(r[0]), float(r[1])))
            for f, r in zip(front.centres_m[first], rear.centres_m[second], strict=True)
        ]

    def _places(
        self, picture: Image, corner_px: tuple[int, int], level: _Level
    ) -> tuple[Places, Places]:
        """Return the places of both marks in the rows of a shrunk picture that are a level's."""
        shrink, margin = level.shrink, ABOUT_PX // 2 + 1
        first, last = ((row - corner_px[1]) // shrink for row in level.rows)
        first, last = max(first - margin, 0), min(last + margin, len(picture))
        if last - first < 4:
            return NONE, NONE
        part = picture[first:last]
        at, mark, cosine = self._peaks(part)
        origin = np.array(corner_px) + 0.5 * (shrink - 1) + np.array((0, first * shrink))
        front, rear = (
            self._examined(part, at[mark == k], cosine[mark == k], k, shrink, origin)
            for k in (0, 1)
        )
        return front, rear

    def _peaks(self, part: Image) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
        """Return peaks (N, 2) u, v of a shrunk picture, whose mark each is, and its hue's cosine."""
        chroma = cv2.transform(part.astype(np.float32), CHROMA_BASIS)
        mean = cv2.blur(chroma, (MEAN_PX, MEAN_PX), borderType=cv2.BORDER_REPLICATE)
        about = cv2.blur(chroma, (ABOUT_PX, ABOUT_PX), borderType=cv2.BORDER_REPLICATE)
        # Against its surroundings, so that a coloured floor is not a mark.
        chroma = cv2.subtract(mean, about)
        rise = np.asarray(cv2.transform(chroma, self._hues), np.float32)
        highest = cv2.dilate(rise, np.ones((MEAN_PX, MEAN_PX), np.uint8))
        flat = np.flatnonzero((rise == highest) & (rise > RISE_MIN_DN))
        cell, mark = np.divmod(flat, 2)
        v, u = np.divmod(cell, rise.shape[1])
        strength = rise.ravel()[flat]
        own = np.asarray(chroma, np.float32)[v, u]
        cosine = strength / np.maximum(np.hypot(own[:, 0], own[:, 1]), 1e-6)
        good = (cosine > HUE_COS_MIN) & _round(rise, u, v, mark, strength)
        at, mark, strength, cosine = (
            np.column_stack((u, v))[good], mark[good], strength[good], cosine[good],
        )  # fmt: skip
        keep = []
        for k in (0, 1):
            own_mark = np.flatnonzero(mark == k)
            order = np.argsort(-strength[own_mark], kind="stable")[:PLACES_MAX]
            keep.append(own_mark[order])
        index = np.concatenate(keep)
        return at[index], mark[index], np.asarray(cosine[index], np.float32)

    def _examined(
        self, part: Image, at: NDArray[np.int64], cosine: Floats, mark: int, shrink: int,
        origin: Array,
    ) -> Places:  # fmt: skip
        """Return the peaks that may be marks: centred, and judged inside and outside their rims."""
        if not len(at):
            return NONE
        px = at * shrink + origin
        floor, affine = self._affine(px)
        seen = np.isfinite(affine).all(axis=(1, 2)) & np.isfinite(floor).all(axis=1)
        px, floor, affine, cosine = px[seen], floor[seen], affine[seen], cosine[seen]
        if not len(px):
            return NONE
        weights = (self._hues[mark] @ CHROMA_BASIS).astype(np.float32)
        sampler = _Sampler(part, origin, shrink, weights)
        for _ in range(CENTROID_STEPS):
            value = sampler.response(px, affine, OVER)
            base = np.median(sampler.response(px, affine, OUTER), axis=1, keepdims=True)
            top = np.max(value, axis=1, keepdims=True)
            weight = np.clip(value - (0.6 * base + 0.4 * top), 0.0, None)
            weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-6)
            px = px + np.einsum("nij,nj->ni", affine, weight @ OVER)
        inside = sampler.response(px, affine, INNER)
        outside = sampler.response(px, affine, OUTER)
        low = np.median(outside, axis=1, keepdims=True)
        high = np.sort(inside, axis=1)[:, 5:6]
        middle = 0.5 * (low + high)
        shape = np.mean(inside > middle, axis=1) + np.mean(outside < middle, axis=1) - 1.0
        bright = sampler.brightness(px, affine, INNER).mean(axis=1)
        ground = sampler.brightness(px, affine, OUTER).mean(axis=1) / np.maximum(bright, 1.0)
        loss = (
            SHAPE_LOSS * (1.0 - shape)
            + GROUND_LOSS * np.clip(ground - 0.5, 0.0, 3.0)
            + HUE_LOSS * (1.0 - cosine)
        )
        good = (shape > SHAPE_MIN) & (high[:, 0] - low[:, 0] > RISE_MIN_DN)
        order = np.flatnonzero(good)[np.argsort(loss[good], kind="stable")][:KEPT_MAX]
        return Places(self._model.floor_points(px[order], self._height_m), loss[order])

    def _affine(self, px: Array) -> tuple[Array, Array]:
        """Return floor points (N, 2), and d(px) per radius on the marks' plane, (N, 2, 2)."""
        floor = self._model.floor_points(px, self._height_m)
        axes = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]) * self._radius_m
        points = (floor[:, None] + axes).reshape(-1, 2)
        at = self._model.project(np.column_stack((points, np.full(len(points), self._height_m))))
        at = at.reshape(-1, 3, 2)
        return floor, np.stack((at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=-1)


class _Sampler:
    """Values of a shrunk picture at points about places, the nearest pixel's."""

    def __init__(self, part: Image, origin: Array, shrink: int, weights: Floats) -> None:
        self._part, self._origin, self._shrink, self._weights = part, origin, shrink, weights

    def _colours(self, px: Array, affine: Array, points: Array) -> Floats:
        at = px[:, None] + np.einsum("nij,pj->npi", affine, points)
        cell = np.rint((at - self._origin) / self._shrink).astype(np.intp)
        height, width = self._part.shape[:2]
        u, v = np.clip(cell[..., 0], 0, width - 1), np.clip(cell[..., 1], 0, height - 1)
        return np.asarray(self._part[v, u], np.float32)

    def response(self, px: Array, affine: Array, points: Array) -> Floats:
        """Return the mark's response, (N, P), at points in radii about places."""
        return np.asarray(self._colours(px, affine, points) @ self._weights, np.float32)

    def brightness(self, px: Array, affine: Array, points: Array) -> Floats:
        """Return the mean of the colours, (N, P)."""
        return np.asarray(self._colours(px, affine, points).mean(axis=-1), np.float32)


def _halved(picture: Image) -> Image:
    """Return a picture of half the size; an odd last row or column falls away."""
    size = (picture.shape[1] // 2, picture.shape[0] // 2)
    even = picture[: 2 * size[1], : 2 * size[0]]
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), np.uint8)


def _round(
    rise: Floats, u: NDArray[np.int64], v: NDArray[np.int64], mark: NDArray[np.int64],
    strength: Floats,
) -> NDArray[np.bool_]:  # fmt: skip
    """Return which peaks fall off in nearly all directions: no lines, no edges of large things."""
    height, width = rise.shape[:2]
    at_v = np.clip(v[:, None] + _AROUND[:, 1], 0, height - 1)
    at_u = np.clip(u[:, None] + _AROUND[:, 0], 0, width - 1)
    low = rise[at_v, at_u, mark[:, None]] < 0.5 * strength[:, None]
    return np.asarray(low.sum(axis=1) >= AROUND_MIN, np.bool_)


def _merged(places: list[Places]) -> Places:
    centres = np.concatenate([p.centres_m for p in places])
    return Places(centres, np.concatenate([p.loss for p in places]))
