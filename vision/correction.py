"""A camera whose lens model is corrected by a smooth polynomial shift of its pixels.

Five distortion terms leave about 1 px on a wide-angle lens, on a sensor that is not quite flat or
behind a window. A polynomial fitted to what is left takes that down to the noise of the points. As
it acts on pixels and not on floor points, heights above the floor stay right.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.errors import BadInput
from vision.camera import CameraModel

Array = NDArray[np.float64]

DEGREE_MAX = 7
INVERSE_STEPS = 12


@cache
def _exponents(degree: int) -> tuple[tuple[int, int], ...]:
    return tuple((i, j) for i in range(degree + 1) for j in range(degree + 1 - i))


def _monomials(px: Array, width_px: int, height_px: int, degree: int) -> Array:
    """Return the monomials, (N, T), of pixels measured from the middle in half widths."""
    half = 0.5 * width_px
    x = (px[:, 0] - 0.5 * (width_px - 1)) / half
    y = (px[:, 1] - 0.5 * (height_px - 1)) / half
    return np.stack([x**i * y**j for i, j in _exponents(degree)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedCamera(CameraModel):
    """A camera model that sees pixel p at p + shift(p).

    `shift` is (T, 2): coefficients of the monomials x^i y^j, i + j <= degree, for u and v, in half
    widths of the image, so that it holds at every resolution of the same sensor.
    """

    degree: int
    shift: Array

    def _ideal(self, px: ArrayLike) -> Array:
        """Return where the uncorrected model has what is seen at `px`, (N, 2)."""
        seen = np.asarray(px, dtype=np.float64).reshape(-1, 2)
        terms = _monomials(seen, self.width_px, self.height_px, self.degree)
        moved: Array = seen + (terms @ self.shift) * (0.5 * self.width_px)
        return moved

    def _seen(self, ideal: Array) -> Array:
        """Return the pixels at which ideal ones are seen: the fixed point of a small shift."""
        px = ideal
        for _ in range(INVERSE_STEPS):
            px = ideal - (self._ideal(px) - px)
        return px

    def project(self, points_world_m: ArrayLike) -> Array:
        """Return pixels, (N, 2), of world points, (N, 3); NaN for points behind the camera."""
        return self._seen(CameraModel.project(self, points_world_m))

    def project_point(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float]:
        """Return the pixel (u, v) of one world point; NaN when it lies behind the camera."""
        u, v = self.project([(x_m, y_m, z_m)])[0]
        return float(u), float(v)

    def normalise(self, px: ArrayLike) -> Array:
        """Return undistorted normalised coordinates, (N, 2), of pixels, (N, 2)."""
        return CameraModel.normalise(self, self._ideal(px))

    def normalise_point(self, u_px: float, v_px: float) -> tuple[float, float]:
        """Return undistorted normalised coordinates of one pixel."""
        u, v = self._ideal([(u_px, v_px)])[0]
        return CameraModel.normalise_point(self, float(u), float(v))


def corrected(camera: CameraModel, world_m: Array, px: Array, degree: int) -> CorrectedCamera:
    """Return the camera with a shift fitted to points (N, 3) in m seen at pixels (N, 2).

    Raises BadInput for a degree out of bounds, and for too few points.
    """
    if not 1 <= degree <= DEGREE_MAX:
        raise BadInput(f"correction degree {degree}: the limit is 1 to {DEGREE_MAX}")
    terms = _monomials(px, camera.width_px, camera.height_px, degree)
    if len(px) < 3 * terms.shape[1]:
        raise BadInput(
            f"correction of degree {degree} has {terms.shape[1]} terms and needs"
            f" {3 * terms.shape[1]} points; there are {len(px)}: take a lower degree"
        )
    wanted = (camera.project(world_m) - px) / (0.5 * camera.width_px)
    shift: Array = np.linalg.lstsq(terms, wanted, rcond=None)[0].astype(np.float64)
    return with_shift(camera, degree, shift)


def with_shift(camera: CameraModel, degree: int, shift: Array) -> CorrectedCamera:
    """Return the camera with a known shift, (T, 2) in half widths."""
    own = {f.name: getattr(camera, f.name) for f in fields(CameraModel) if f.init}
    return CorrectedCamera(**own, degree=degree, shift=shift)
