"""What a run asks for the robot's pose: takes pictures that are drawn only where they are looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hil.core.rig import whole
from vision.localisers.marks import MarkLocaliser
from vision.spread import SpreadSearch, spread

if TYPE_CHECKING:
    from hil.core.rig import Picture
    from hil.core.types import Pose, PoseMeasurement
    from vision.tracker import Localiser


class Looker(Protocol):
    """A localiser that may be given a drawing in place of an image."""

    def locate(
        self, image_bgr: Picture, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return the pose seen in a picture, (H, W, 3) uint8 BGR, searched near the prediction."""


def looker(localiser: Localiser) -> Looker:
    """Return a localiser for the frames of a run, which all take it about as long."""
    made = spread(localiser)
    if isinstance(localiser, MarkLocaliser) and isinstance(made, MarkLocaliser | SpreadSearch):
        return made
    return _OfWhole(made)


class _OfWhole:
    """Gives a localiser whole images."""

    def __init__(self, localiser: Localiser) -> None:
        self._localiser = localiser

    def locate(
        self, image_bgr: Picture, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return what the localiser says."""
        return self._localiser.locate(whole(image_bgr), predicted, search_radius_m)
