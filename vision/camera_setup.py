"""The camera model that a configuration describes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vision.camera import CameraModel, look_at
from vision.correction import with_shift

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig


def camera_model(config: CameraConfig) -> CameraModel:
    """Return the camera model at the configured resolution (world frame, m; pixels of the image)."""
    lens, pose = config.lens, config.pose
    below = (lens.k4, lens.k5, lens.k6)
    rotation = (
        look_at(pose.eye_m, pose.target_m)
        if pose.R_world_cam is None
        else np.array(pose.R_world_cam)
    )
    reference = CameraModel(
        lens.at_width_px,
        lens.at_height_px,
        lens.fx_px,
        lens.fy_px,
        lens.cx_px,
        lens.cy_px,
        (lens.k1, lens.k2, lens.p1, lens.p2, lens.k3, *(below if any(below) else ())),
        rotation,
        np.array(pose.eye_m),
        fisheye=lens.fisheye,
    )
    if lens.shift_degree:
        shift = np.column_stack((lens.shift_u, lens.shift_v))
        reference = with_shift(reference, lens.shift_degree, shift)
    return reference.scaled(config.width_px, config.height_px)
