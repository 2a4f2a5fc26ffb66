"""The rows of the camera's frames, in the order of hil/record/schema.py."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hil.core.rig import Frame
    from hil.core.types import PoseMeasurement

_NAN = math.nan
COVARIANCE = (
    "cov_xx_m2", "cov_xy_m2", "cov_xt_m_rad", "cov_yy_m2", "cov_yt_m_rad", "cov_tt_rad2",
)  # fmt: skip
MARKS = ("front_u_px", "front_v_px", "rear_u_px", "rear_v_px")
_NO_MARKS = (_NAN,) * len(MARKS)
_NO_COVARIANCE = (_NAN,) * len(COVARIANCE)


def frame_row(
    frame: Frame, t_arrival_s: float, t_exposure_s: float, measurement: PoseMeasurement
) -> tuple[float, ...]:
    """Return one camera frame in the order of schema.FRAME_NAMES."""
    pose, details = measurement.pose, measurement.details
    return (
        t_arrival_s,
        t_exposure_s,
        frame.t_cam_s,
        frame.index,
        pose is not None,
        *((pose.x_m, pose.y_m, pose.theta_rad) if pose else (_NAN, _NAN, _NAN)),
        measurement.quality,
        measurement.sigma_xy_m,
        measurement.sigma_theta_rad,
        *(measurement.covariance or _NO_COVARIANCE),
        *(marks_of(details) if details else _NO_MARKS),
    )


def marks_of(details: Mapping[str, float]) -> tuple[float, ...]:
    """Return where a measurement's details say that the marks are, px; NaN for what they do not say."""
    return tuple([details.get(name, _NAN) for name in MARKS])
