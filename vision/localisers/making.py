"""A localiser made ready for a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.registries import LOCALISERS

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from vision.tracker import Localiser


def make_localiser(camera: CameraConfig) -> Localiser:
    """Return the localiser that a camera's file asks for, with its settings; raises BadInput."""
    entry = LOCALISERS.get(camera.localiser)
    own = camera.own_settings
    made: Localiser = entry.factory(camera) if own is None else entry.factory(camera, own)
    return made
