"""Round colour marks measured at their rims: where a disc of known size lies, to hundredths of a px.

Across the rim of each disc, as the camera model projects it, profiles of the colour response run
from inside to outside. A profile's edge is found against its own two ends, so light that differs
round the rim (a gradient, a shadow's edge, a lamp's reflection) does not pull it; even blur does
not move it either. Discs of free centre and size are fitted to the edges; profiles that something
covers fall out. Before that the centroid of the response is taken, twice where a guess was far off,
so that a guess leaves next to nothing of its own error in the answer.

The sums are compiled from vision/native (`vision._marks`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision import _marks
from vision._marks import Disc as Disc  # noqa: PLC0414 - what a fit returns
from vision.camera import TERMS, CameraModel

if TYPE_CHECKING:
    from hil.core.rig import Picture

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Point = tuple[float, float]
Marks = tuple[Disc, Disc]


def check_colour(image: Picture) -> None:
    """Raise BadInput for an image that is not (H, W, 3) uint8: colour marks need colours."""
    if isinstance(image, np.ndarray) and (
        image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size
    ):
        what = "grey" if image.ndim == 2 else f"of shape {image.shape}"
        raise BadInput(
            f"image: {what}, {image.dtype}, must be (H, W, 3) uint8, blue, green and red; a grey"
            " one does not show colour marks: open it in colour, or use a tag"
        )


def compiled(model: CameraModel) -> _marks.Camera:
    """Return a camera model for the compiled parts."""
    return _marks.Camera(
        (model.fx_px, model.fy_px, model.cx_px, model.cy_px),
        model.dist[:TERMS],
        model.R_world_cam.ravel().tolist(),
        model.t_world_cam_m.tolist(),
        model.fisheye,
        model.dist[TERMS:] or (0.0, 0.0, 0.0),
    )


class RimFitter:
    """Fits both marks at once, at one height over the floor; holds no past.

    `weights` is (2, 3): response of each mark as a sum of blue, green and red.
    """

    def __init__(
        self, model: CameraModel, radius_m: float, height_m: float, weights: Array
    ) -> None:
        middle_px = (0.5 * model.width_px, 0.5 * model.height_px)
        self._fitter = _marks.RimFitter(
            compiled(model), radius_m, height_m, weights.tolist(), middle_px
        )

    def fit(self, image: Picture, centres_m: Sequence[Point]) -> Marks | None:
        """Return both discs, front first, from guesses of their centres (x, y), m on their plane.

        The guess may be off by half of the radius. None where a disc is out of view or has no edge.
        Of a drawing the parts about the guesses are drawn, and the whole where a fit looks elsewhere.
        """
        if isinstance(image, np.ndarray):
            return self._fitter.fit(image, centres_m)
        height, width, _ = image.shape
        windows = [self._fitter.window(centre, width, height) for centre in centres_m]
        front, rear = windows
        if front is None or rear is None:
            return self._fitter.fit(image.whole(), centres_m)
        image.part(front)
        marks, missed = self._fitter.fit_within(image.part(rear), centres_m, (front, rear))
        return self._fitter.fit(image.whole(), centres_m) if missed else marks
