"""How sharp a picture of a board is: how wide its edges are, along rows and along columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

# Half of the window in which an edge has its two levels.
REACH_PX = 20
# Edges with at least this share of the picture's own contrast count, and so many of them.
CONTRAST_RATIO = 0.4
EDGES_MIN = 200
# A Gaussian edge has 10 to 90 % of its height over 2.56 sigma, and its slope is 1 / (2.51 sigma).
WIDTH, SLOPE = 2.56, 2.51
# Sharp pictures of boards give 4 to 8 px here, weak edges among them; a blur of 3 px RMS, or by 10 px of
# motion, 9 and more.
WIDTH_MAX_PX = 9.0


def blurred_hint(image: NDArray[np.uint8]) -> str:
    """Return that a picture in which no board was found is blurred, "" where it is not."""
    width_px = edge_width_px(image)
    if not width_px > WIDTH_MAX_PX:
        return ""
    return (
        f"; the pictures are blurred (edges {width_px:.0f} px wide, a sharp one's are below"
        f" {WIDTH_MAX_PX:.0f}): focus, hold the board still, or give more light"
    )


def edge_width_px(image: NDArray[np.uint8]) -> float:
    """Return the 10 to 90 % width of a picture's strong edges, px, the worse of both directions.

    NaN where there are hardly any. `image` is grey, (H, W).
    """
    grey = image.astype(np.float32)
    span = float(np.quantile(grey, 0.98) - np.quantile(grey, 0.02))
    widths = [_along_rows(part, CONTRAST_RATIO * span) for part in (grey, grey.T)]
    return max(widths) if np.isfinite(widths).all() else float("nan")


def _along_rows(grey: Array, least_dn: float) -> float:
    """Return the median width of edges that rows cross."""
    rows = grey[:: max(1, len(grey) // 200)]
    slope = np.abs(0.5 * (rows[:, 2:] - rows[:, :-2]))
    windows = np.lib.stride_tricks.sliding_window_view(rows, 2 * REACH_PX + 1, axis=1)
    height = windows.max(axis=2) - windows.min(axis=2)
    slope = slope[:, REACH_PX - 1 : REACH_PX - 1 + height.shape[1]]
    peaks = np.lib.stride_tricks.sliding_window_view(slope, 7, axis=1).max(axis=2)
    slope, height = slope[:, 3:-3], height[:, 3:-3]
    edge = (slope == peaks) & (height > max(least_dn, 10.0)) & (slope > height / 40.0)
    if int(edge.sum()) < EDGES_MIN:
        return float("nan")
    return float(np.median(WIDTH / SLOPE * height[edge] / slope[edge]))
