"""Which localiser finds the colour marks that a camera's file describes: two of them, or more."""

from __future__ import annotations

from hil.config.camera import CameraConfig
from hil.core.registries import LOCALISERS
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser
from vision.many_marks import ManyMarks
from vision.tracker import Localiser


@LOCALISERS.register("marks", summary="colour marks on the robot's plate, as in the thesis")
def make_marks(camera: CameraConfig) -> Localiser:
    """Return the localiser of the colour marks that a camera's file describes."""
    if camera.marks.more:
        return ManyMarks(camera)
    return MarkLocaliser(camera_model(camera), camera.marks)
