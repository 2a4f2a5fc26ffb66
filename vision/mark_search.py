"""Where the robot may be: pairs of coarse places scored together, best first.

The image is shrunk so that a mark is 4 to 8 px wide; where the lens shows marks of very different
sizes (a camera at an angle), far and near floor are looked at in pictures of their own. A place is
a peak of a mark's colour against its surroundings. Around each, points inside and outside the rim
that a mark would have there, on the marks' plane, say whether it is round, of the right size and on
dark ground. Two places are a hypothesis; its score adds colour, rim, ground and distance, and no
place is given up for its own figures alone.

The grid of a window is that of the whole image, so a place found in a window is, to the last digit,
that found in the whole image: a prediction says where to look and cannot pull what is found.

Places and pairs are found in compiled code (vision/native/search.cpp).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision import _marks
from vision.camera import CameraModel
from vision.disc_fit import compiled

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Point = tuple[float, float]
Centres = tuple[Point, Point]
Window = tuple[int, int, int, int]  # left, top, right, bottom, px

# A mark is this wide at least in the picture it is looked for in, and less than twice that, px.
COARSE_DIAMETER_PX = 4.0
# Marks narrower than that in the full image are not looked for.
LEAST_DIAMETER_PX = 5.0
LEVELS_MAX = 3
# Rows beyond those of a level that the surroundings of its marks need.
MARGIN_PX = 8
# Blue, green and red as two chromas, orthonormal and zero for grey.
CHROMA_BASIS = np.array(
    [
        [-math.sqrt(0.5), math.sqrt(0.5), 0.0],
        [-math.sqrt(1 / 6), -math.sqrt(1 / 6), math.sqrt(2 / 3)],
    ]
)


@dataclass(frozen=True, slots=True)
class _Level:
    """One shrunk picture: `rows` are those of the full image in which a mark has its size."""

    shrink: int
    rows: tuple[int, int]


class MarkSearch:
    """Looks for pairs of marks; holds no past.

    `hues` is (2, 2): chroma direction of the front and rear mark.
    """

    def __init__(
        self, model: CameraModel, radius_m: float, height_m: float, distance_m: float, hues: Array
    ) -> None:
        self._model = model
        self._radius_m, self._height_m = radius_m, height_m
        self._search = _marks.MarkSearch(
            compiled(model), radius_m, height_m, distance_m, hues.tolist()
        )
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

    def seen(self, window: Window) -> Window:
        """Return the part of the image that a search of a window looks at."""
        left, top = (edge // self.grid_px * self.grid_px for edge in window[:2])
        return left, top, window[2], window[3]

    def pairs(self, image: Image, window: Window) -> tuple[list[Centres], str]:
        """Return hypotheses (front, rear centre in m), likeliest first; if none, the reason."""
        front: list[_marks.Place] = []
        rear: list[_marks.Place] = []
        left, top, right, bottom = self.seen(window)
        picture, shrink = image[top:bottom, left:right], 1
        for level in self._levels:
            while shrink < level.shrink:
                picture, shrink = _halved(picture), 2 * shrink
            if min(picture.shape[:2]) < 4:
                break
            first, last = ((row - top) // shrink for row in level.rows)
            first, last = max(first - MARGIN_PX, 0), min(last + MARGIN_PX, len(picture))
            if last - first < 4:
                continue
            middle = 0.5 * (shrink - 1)
            origin_px = (left + middle, top + middle + first * shrink)
            found = self._search.places(picture[first:last], origin_px, shrink)
            front.extend(found[0])
            rear.extend(found[1])
        for name, places in (("front", front), ("rear", rear)):
            if not places:
                return [], f"{name} mark not found"
        pairs = self._search.pairs(front, rear)
        return pairs, "marks found, but none the robot's distance apart"


def _halved(picture: Image) -> Image:
    """Return a picture of half the size; an odd last row or column falls away."""
    import cv2  # noqa: PLC0415 - a tenth of a second, where there are pictures only

    size = (picture.shape[1] // 2, picture.shape[0] // 2)
    even = picture[: 2 * size[1], : 2 * size[0]]
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), np.uint8)
