"""A localiser made ready for a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.registries import LOCALISERS
from vision.looking import looker

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from hil.core.rig import Picture
    from hil.core.types import Pose, PoseMeasurement
    from vision.looking import Looker
    from vision.tracker import Localiser


def make_localiser(camera: CameraConfig) -> Localiser:
    """Return the localiser that a camera's file asks for, with its settings; raises BadInput."""
    entry = LOCALISERS.get(camera.localiser)
    own = camera.own_settings
    made: Localiser = entry.factory(camera) if own is None else entry.factory(camera, own)
    return made


def localiser_of_frames(camera: CameraConfig, *, drawn: bool) -> Looker:
    """Return the localiser of a run; raises BadInput.

    Where poses are `drawn` its projections need not be worked out until an image comes after all.
    """
    if drawn:
        return _WhenAsked(camera)
    localiser = make_localiser(camera)
    return looker(localiser)


class _WhenAsked:
    """The localiser of a run whose frames bring their poses: made when an image comes after all."""

    def __init__(self, camera: CameraConfig) -> None:
        self._camera = camera
        self._made: Looker | None = None

    def locate(
        self, image_bgr: Picture, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return what the camera's localiser says."""
        self._made = self._made or looker(make_localiser(self._camera))
        return self._made.locate(image_bgr, predicted, search_radius_m)
