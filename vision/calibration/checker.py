"""Whether corners found are those of the chessboard described, judged by the squares between them.

A detector that looks for 4 x 3 corners can take every second corner of a larger board, or leave out
rows of it: a clean lens or floor of the wrong size comes of it. So the squares are looked at: each
cell between four corners must be of one colour, the next one of the other, and where the board is
said to end there must be no further squares.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.cv_compat import mapped, plane_map

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SAMPLES = 6
# Share of samples of the colour expected, in the worst row or column of cells: 0.96 and more on sharp
# and blurred photographs of the right board, 0.3 to 0.76 on those of a board of other size.
AGREEMENT_MIN = 0.85
# Cells beyond the board's rim count as further squares with this share and contrast.
BEYOND_AGREEMENT = 0.9
BEYOND_CONTRAST = 0.4
BEYOND_CELLS_MIN = 3


def checker_fault(grey: Image, corners: Array) -> str:
    """Return why inner corners, (rows, columns, 2) px, cannot be the board's, "" when they can."""
    rows, columns = corners.shape[0] - 1, corners.shape[1] - 1
    if rows < 1 or columns < 1:
        return ""
    sides = np.concatenate(
        [np.linalg.norm(np.diff(corners, axis=axis), axis=2).ravel() for axis in (0, 1)]
    )
    level = grey.astype(np.float32)
    window = 2 * max(1, round(float(np.median(sides)))) + 1
    contrast = level - cv2.blur(level, (window, window), borderType=cv2.BORDER_REPLICATE)
    cells = _sample(contrast, _lattice(corners)) * _signs(rows, columns)[:, :, None]
    if float(np.mean(cells > 0.0)) < 0.5:
        cells = -cells
    right = cells > 0.0
    if min(right.mean(axis=(1, 2)).min(), right.mean(axis=(0, 2)).min()) < AGREEMENT_MIN:
        return "between its corners lie others"
    for side, name in enumerate(("below", "at the right", "above", "at the left")):
        if _goes_on(contrast, np.rot90(corners, side), float(np.mean(np.abs(cells)))):
            return f"its squares go on {name}"
    return ""


def _signs(rows: int, columns: int) -> Array:
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    return np.asarray(1.0 - 2.0 * ((i + j) % 2))


def _lattice(corners: Array) -> Array:
    """Return sample places, (rows, columns, N, 2), inside each cell of the corners."""
    t = (np.arange(SAMPLES) + 0.5) / SAMPLES
    a, b = (w.ravel()[None, None, :, None] for w in np.meshgrid(t, t))
    top = corners[:-1, :-1, None] * (1 - a) + corners[:-1, 1:, None] * a
    low = corners[1:, :-1, None] * (1 - a) + corners[1:, 1:, None] * a
    places: Array = top * (1 - b) + low * b
    return places


def _sample(picture: NDArray[np.float32], places: Array) -> Array:
    height, width = picture.shape
    u = np.clip(np.rint(places[..., 0]).astype(int), 0, width - 1)
    v = np.clip(np.rint(places[..., 1]).astype(int), 0, height - 1)
    return np.asarray(picture[v, u], dtype=np.float64)


def _goes_on(contrast: NDArray[np.float32], corners: Array, usual: float) -> bool:
    """Return whether a second row of squares follows after the last corners.

    The first row beyond them is the board's own outer one.
    """
    rows, columns = corners.shape[:2]
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).astype(np.float64)
    if columns - 1 < BEYOND_CELLS_MIN:
        return False
    to_image = plane_map(grid.reshape(-1, 2), np.ascontiguousarray(corners).reshape(-1, 2))
    middle = np.array([(a, b) for a in (0.35, 0.5, 0.65) for b in (0.35, 0.5, 0.65)])
    beyond = np.arange(columns - 1)[:, None, None] * [1.0, 0.0] + middle + [0.0, float(rows)]
    own = beyond - [0.0, 1.0]
    height, width = contrast.shape
    levels = []
    for places in (own, beyond):
        px = mapped(to_image, places.reshape(-1, 2)).reshape(columns - 1, -1, 2)
        if (px < 0).any() or (px > (width - 1, height - 1)).any():
            return False
        levels.append(_sample(contrast, px).mean(axis=1))
    against = -levels[0] * levels[1]
    strong = np.minimum(np.abs(levels[0]), np.abs(levels[1])) > BEYOND_CONTRAST * usual
    return bool(np.mean((against > 0.0) & strong) >= BEYOND_AGREEMENT)
