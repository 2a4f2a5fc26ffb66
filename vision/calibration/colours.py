"""The two mark colours learned from samples under the present light.

Colours are compared as chromaticity, (b, g, r) over their sum, because brightness changes over the
floor and with the exposure. Two colours are told apart by their Mahalanobis distance d' under the
pooled scatter of the samples: with equal Gaussians d' = 6 leaves 0.13 % of pixels on the wrong side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from hil.core.wording import past
from vision.calibration.tables import read_table
from vision.cv_compat import read_image

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Pixel = tuple[float, float]

SEPARATION_MIN = 6.0
# A pixel looks like a mark within this many standard deviations of its chromaticity.
LIKENESS = 4.0
BACKGROUND_ALIKE_MAX = 0.02
SEED_RADIUS_PX = 2
# Chromaticity steps of sensor noise and of JPEG: no colour is known better than this.
NOISE_FLOOR = 0.012
GROW_TOLERANCE = 0.06
AREA_MIN_PX = 12
AREA_MAX_RATIO = 0.02
CLIPPED_DN = 250
DARK_DN = 25.0
CLIPPED_SHARE_MAX = 0.2
BACKGROUND_STEP = 7


@dataclass(frozen=True, slots=True)
class Sample:
    """One image with a pixel inside each mark."""

    name: str
    image: Image
    front_px: Pixel
    rear_px: Pixel


@dataclass(frozen=True, slots=True)
class MarkColour:
    """One learned colour: mean (b, g, r) as a share of full scale, chromaticity mean and scatter."""

    bgr: tuple[float, float, float]
    chroma: Array
    covariance: Array
    pixels: int


@dataclass(frozen=True, slots=True)
class ColourCalibration:
    """Both colours and how well they stand apart.

    `separation` is d' between the marks; `alike_front_ratio` and `alike_rear_ratio` are the shares
    of all other pixels that look like a mark.
    """

    front: MarkColour
    rear: MarkColour
    separation: float
    alike_front_ratio: float
    alike_rear_ratio: float


def read_samples(table: Path) -> list[Sample]:
    """Return the samples of a CSV: image, front_u_px, front_v_px, rear_u_px, rear_v_px."""
    columns = ("front_u_px", "front_v_px", "rear_u_px", "rear_v_px")
    samples = []
    for row in read_table(table, columns, text="image"):
        path = table.parent / str(row["image"])
        at = [float(row[name]) for name in columns]
        samples.append(Sample(path.name, read_image(path), (at[0], at[1]), (at[2], at[3])))
    return samples


def chromaticity(bgr: Array) -> Array:
    """Return (b, g) over b + g + r, (N, 2); black counts as grey."""
    total = bgr.sum(axis=1, keepdims=True)
    share = np.where(total > 0.0, bgr / np.maximum(total, 1.0), 1.0 / 3.0)
    return np.asarray(share[:, :2], dtype=np.float64)


def learn_colours(samples: Sequence[Sample]) -> ColourCalibration:
    """Return the colours of both marks; raises BadInput when they could be confused."""
    if not samples:
        raise BadInput("colours: no samples; give at least one image with both marks")
    fronts, rears, others = [], [], []
    for sample in samples:
        front = grow(sample.image, sample.front_px, f"{sample.name}: front mark")
        rear = grow(sample.image, sample.rear_px, f"{sample.name}: rear mark")
        if (front & rear).any():
            raise BadInput(f"{sample.name}: front and rear pixels lie in one patch of one colour")
        fronts.append(sample.image[front])
        rears.append(sample.image[rear])
        others.append(sample.image[_away_from(front | rear)][::BACKGROUND_STEP])
    front_colour = _colour(np.vstack(fronts), "front")
    rear_colour = _colour(np.vstack(rears), "rear")
    other = chromaticity(np.vstack(others).astype(np.float64))
    result = ColourCalibration(
        front_colour,
        rear_colour,
        separation(front_colour, rear_colour),
        float(np.mean(looks_like(other, front_colour))),
        float(np.mean(looks_like(other, rear_colour))),
    )
    _check(result)
    return result


def _check(result: ColourCalibration) -> None:
    if result.separation < SEPARATION_MIN:
        raise BadInput(
            f"colours: front and rear are too alike: separation d' ="
            f" {past(result.separation, SEPARATION_MIN, '.1f')}, limit"
            f" {SEPARATION_MIN:g}; take marks of other colours, or lower gain and light reflexes"
        )
    for name, ratio in (("front", result.alike_front_ratio), ("rear", result.alike_rear_ratio)):
        if ratio > BACKGROUND_ALIKE_MAX:
            raise BadInput(
                f"colours: {past(ratio, BACKGROUND_ALIKE_MAX, '.1%')} of the other pixels look"
                f" like the {name} mark, limit {BACKGROUND_ALIKE_MAX:.0%}; take a colour that floor"
                " and robot do not have"
            )


def grow(image: Image, seed_px: Pixel, what: str) -> Mask:
    """Return the pixels, (H, W), of the evenly coloured patch around a pixel; raises BadInput."""
    height, width = image.shape[:2]
    u, v = round(seed_px[0]), round(seed_px[1])
    r = SEED_RADIUS_PX
    if not (r <= u < width - r and r <= v < height - r):
        raise BadInput(
            f"{what}: pixel ({seed_px[0]:g}, {seed_px[1]:g}) is not inside the image of"
            f" {width} x {height} px"
        )
    seed = np.median(image[v - r : v + r + 1, u - r : u + r + 1].reshape(-1, 3), axis=0)
    if seed.max() < DARK_DN:
        raise BadInput(
            f"{what}: too dark at ({u}, {v}): {past(seed.max(), DARK_DN, '.0f')} of 255, limit"
            f" {DARK_DN:g}; lengthen the exposure or add light"
        )
    # Noise would make holes: neighbours are averaged to find the patch, not to learn its colour.
    flat = cv2.blur(image, (3, 3)).reshape(-1, 3).astype(np.float64)
    near = np.abs(chromaticity(flat) - chromaticity(seed[None])).max(axis=1) < GROW_TOLERANCE
    near &= np.abs(flat.sum(axis=1) - seed.sum()) < 0.6 * seed.sum()
    labels = cv2.connectedComponents(near.reshape(height, width).astype(np.uint8))[1]
    under = np.bincount(labels[v - r : v + r + 1, u - r : u + r + 1].ravel())
    patch: Mask = labels == (1 + int(np.argmax(under[1:])) if len(under) > 1 else -1)
    area = int(patch.sum())
    if not AREA_MIN_PX <= area <= AREA_MAX_RATIO * width * height:
        raise BadInput(
            f"{what}: the patch of one colour around ({u}, {v}) has {area} px; a mark has"
            f" {AREA_MIN_PX} to {AREA_MAX_RATIO * width * height:.0f} px: is the pixel on the mark?"
        )
    return patch


def _away_from(marks: Mask) -> Mask:
    """Return the pixels that are not on a mark nor on its blurred rim."""
    rim = cv2.dilate(marks.astype(np.uint8), np.ones((9, 9), dtype=np.uint8))
    return np.asarray(rim == 0)


def _colour(bgr: NDArray[np.uint8], name: str) -> MarkColour:
    """Return the colour of a mark's pixels; raises BadInput where the sensor lost it."""
    clipped = float(np.mean((bgr >= CLIPPED_DN).any(axis=1)))
    if clipped > CLIPPED_SHARE_MAX:
        raise BadInput(
            f"colours: {past(clipped, CLIPPED_SHARE_MAX, '.0%')} of the {name} mark is overexposed, limit"
            f" {CLIPPED_SHARE_MAX:.0%}; shorten the exposure"
        )
    mean = np.median(bgr.astype(np.float64), axis=0)
    chroma = chromaticity(bgr.astype(np.float64))
    centre = np.median(chroma, axis=0)
    covariance = np.cov(chroma.T) + NOISE_FLOOR**2 * np.eye(2)
    blue, green, red = (float(x) / 255.0 for x in mean)
    return MarkColour((blue, green, red), centre, covariance, len(bgr))


def separation(a: MarkColour, b: MarkColour) -> float:
    """Return d', the distance of two colours in pooled standard deviations."""
    pooled = 0.5 * (a.covariance + b.covariance)
    apart = a.chroma - b.chroma
    return float(np.sqrt(apart @ np.linalg.solve(pooled, apart)))


def looks_like(chroma: Array, colour: MarkColour) -> Mask:
    """Return which chromaticities, (N, 2), could belong to the mark."""
    apart = chroma - colour.chroma
    square = np.sum(apart * np.linalg.solve(colour.covariance, apart.T).T, axis=1)
    return np.asarray(square < LIKENESS**2)
