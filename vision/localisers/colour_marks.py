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
    key = camera.model_dump_json()
    if key not in _kept:
        _kept.clear()
        _kept[key] = MarkLocaliser(camera_model(camera), camera.marks)
    return _kept[key]


# That of the last camera, by its configuration: the next run mostly has the same, and it holds no past.
_kept: dict[str, MarkLocaliser] = {}
