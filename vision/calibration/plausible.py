"""Whether a fitted lens can be that of a camera, and whether the views determine it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hil.config.camera import LensConfig
from hil.core.errors import BadInput
from hil.core.wording import past

Array = NDArray[np.float64]

LENS_NAMES = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3")
# The fit's own standard deviation over the focal length; the true error may be four times that.
FOCAL_SIGMA_MAX_RATIO = 0.02
TILT_NEEDED_DEG = 20.0


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
    for name, value in zip(LENS_NAMES, map(float, lens), strict=True):
        bounds = LensConfig.model_fields[name].metadata
        low = next((b.ge for b in bounds if hasattr(b, "ge")), -np.inf)
        high = next((b.le for b in bounds if hasattr(b, "le")), np.inf)
        if not low <= value <= high:
            yield name, value, low, high
