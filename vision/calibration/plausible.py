"""Whether a fitted lens can be that of a camera, and whether the views determine it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hil.config.camera import PLAIN_LIMITS, LensConfig
from hil.core.errors import BadInput
from hil.core.wording import past

Array = NDArray[np.float64]

LENS_NAMES = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3")
RATIONAL_NAMES = (*LENS_NAMES, "k4", "k5", "k6")
# The fit's own standard deviation over the focal length; the true error may be four times that.
FOCAL_SIGMA_MAX_RATIO = 0.02
TILT_NEEDED_DEG = 20.0
RADIUS_MAX = 12.0  # tan 85 deg
RADII = 12001


def named(lens: Sequence[float] | Array) -> dict[str, float]:
    """Return the numbers of a lens, 9 or of a rational one 12, by the names of the camera file."""
    names = LENS_NAMES if len(lens) == len(LENS_NAMES) else RATIONAL_NAMES
    return dict(zip(names, map(float, lens), strict=True))


def check_rational(lens: Array, px: Array) -> None:
    """Raise BadInput for a rational lens beyond the camera file, or one that folds the image.

    Its eight terms balance each other where the views are few: then the quotient has a pole or
    bends back, and a pixel within reach of those seen, (N, 2), has two rays or none.
    """
    where = next(_outside(lens), None)
    if where is not None:
        name, value, low, high = where
        raise BadInput(
            f"lens: a rational one has {name} = {value:.3g}, the limits are {low:g} to {high:g}: the"
            " views do not determine it"
        )
    fx, fy, cx, cy = lens[:4]
    reach = float(np.max(np.hypot((px[:, 0] - cx) / fx, (px[:, 1] - cy) / fy)))
    k1, k2, _, _, k3, k4, k5, k6 = lens[4:]
    r = np.linspace(0.0, RADIUS_MAX, RADII)
    below = 1.0 + k4 * r**2 + k5 * r**4 + k6 * r**6
    out = r * (1.0 + k1 * r**2 + k2 * r**4 + k3 * r**6) / below
    fault = np.nonzero((below <= 0.0) | (np.gradient(out) <= 0.0))[0]
    last = int(fault[0]) if fault.size else RADII - 1
    if float(np.max(out[:last], initial=0.0)) < reach:
        raise BadInput(
            "lens: a rational one folds the image where the board was seen: the views do not determine"
            " it; take more, out to the corners"
        )


def check_lens(
    lens: Array, sigma: Array, size_px: tuple[int, int], tilts_deg: Sequence[float]
) -> None:
    """Raise BadInput for a lens no camera has, or one that the views leave open."""
    width_px, height_px = size_px
    fx, fy, cx, cy = lens[:4]
    inside = 0.0 < cx < width_px and 0.0 < cy < height_px
    if not (0.2 * width_px < fx < 20.0 * width_px and 0.8 < fx / fy < 1.25 and inside):
        raise BadInput(
            f"lens: fitted focal lengths {fx:.0f} x {fy:.0f} px and centre ({cx:.0f}, {cy:.0f}) px"
            f" are not those of a camera of {width_px} x {height_px} px; {_hint(tilts_deg)}"
        )
    for name, value, low, high in _outside(lens):
        limit = low if value < low else high
        raise BadInput(
            f"lens: the views give {name} = {past(value, limit, '.2f')}, the limits are {low:g} to"
            f" {high:g}: they do not determine the distortion; {_hint(tilts_deg)}, and bring it to"
            " the corners of the image"
        )
    ratio = float(np.max(sigma[:2] / lens[:2]))
    if not ratio <= FOCAL_SIGMA_MAX_RATIO:
        raise BadInput(
            f"lens: focal length {fx:.1f} x {fy:.1f} px uncertain by"
            f" {past(ratio, FOCAL_SIGMA_MAX_RATIO, '.1%')} (1 sigma), limit"
            f" {FOCAL_SIGMA_MAX_RATIO:.0%}; {_hint(tilts_deg)}"
        )


def _hint(tilts_deg: Sequence[float]) -> str:
    if sum(tilt > TILT_NEEDED_DEG for tilt in tilts_deg) < 3:
        return "tilt the board by 20 to 40 deg in several views"
    return (
        "is its size as said (squares, not corners), is it flat, and do the views differ? Take more"
    )


def _outside(lens: Array) -> Iterator[tuple[str, float, float, float]]:
    """Yield (name, value, low, high) of the distortion terms that a camera file does not take."""
    for name, value in named(lens).items():
        bounds = LensConfig.model_fields[name].metadata
        low = next((b.ge for b in bounds if hasattr(b, "ge")), -np.inf)
        high = next((b.le for b in bounds if hasattr(b, "le")), np.inf)
        if name in PLAIN_LIMITS and len(lens) == len(LENS_NAMES):
            low, high = -PLAIN_LIMITS[name], PLAIN_LIMITS[name]
        if not low <= value <= high:
            yield name, value, low, high
