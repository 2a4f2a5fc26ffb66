"""The default estimator as the session sees it; the filter itself is C++ (hil/control/estimators/native)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.control.estimators import _fused
from hil.core.registries import ESTIMATORS
from hil.core.types import Estimate, Pose, PoseMeasurement, WheelSample

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig
    from hil.control.estimators.geometry import BelievedGeometry


NO_EXCESS = (0.0,) * 6


def assumptions(config: EstimatorConfig) -> _fused.Assumptions:
    """Return what the estimator assumes, as the native parts take it."""
    native = _fused.Assumptions()
    for name in _fused.ASSUMPTIONS:
        setattr(native, name, getattr(config, name))
    return native


@ESTIMATORS.register(
    "fused", summary="camera poses and wheel counts fused, predicted to the actuation"
)
class Fused(_fused.Fused):
    """Camera poses and wheel counts fused at the exposure time, predicted to the actuation time.

    World frame, SI. How it works: hil/control/estimators/native/fused.hpp.
    """

    def __init__(self, config: EstimatorConfig, geometry: BelievedGeometry) -> None:
        believed = _fused.Geometry(
            geometry.wheel_radius_m,
            geometry.track_width_m,
            geometry.d0_m,
            geometry.rad_per_count,
            geometry.omega_max_rad_s,
        )
        super().__init__(assumptions(config), believed)
        self._wheels = geometry.wheels

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds commanded to be in effect from `t_effect_s` on."""
        left, right = self._wheels(eta1_m_s, theta_dot_rad_s)
        self.take_command(t_effect_s, left, right)

    def on_wheels(self, sample: WheelSample) -> None:
        """Take one wheel report (in time order; a stale one is dropped)."""
        self.take_wheels(sample.t_host_s, sample.counts_left, sample.counts_right)

    def on_pose(self, t_exposure_s: float, measurement: PoseMeasurement) -> bool:
        """Take the pose seen at `t_exposure_s` in the past; older than the last one is dropped.

        Return whether it was believed: it passed the gate, or ended a run of refused ones that
        agree with each other (the robot was moved, or slides).
        """
        pose = measurement.pose
        self.expect(excess(measurement))
        return pose is not None and self.take_pose(
            t_exposure_s,
            pose.x_m,
            pose.y_m,
            pose.theta_rad,
            measurement.sigma_xy_m,
            measurement.sigma_theta_rad,
        )

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state at `t_host_s`, past the last exposure; None before the first pose.

        Speeds are predicted; for a time already passed they are those of the latest report.
        """
        state = self.state_at(t_host_s)
        if state is None:
            return None
        x_m, y_m, theta_rad, eta1_m_s, theta_dot_rad_s, z1_m, z2_m_s = state
        pose = Pose(x_m, y_m, theta_rad)
        return Estimate(t_host_s, pose, eta1_m_s, theta_dot_rad_s, z1_m, z2_m_s)


def excess(measurement: PoseMeasurement) -> tuple[float, ...]:
    """Return (xx, xy, xt, yy, yt, tt): the covariance claimed less that of the two sigmas."""
    claimed = measurement.covariance
    if claimed is None or not all(map(math.isfinite, claimed)):
        return NO_EXCESS
    xx, xy, xt, yy, yt, tt = claimed
    var_xy, var_theta = measurement.sigma_xy_m**2, measurement.sigma_theta_rad**2
    return xx - var_xy, xy, xt, yy - var_xy, yt, tt - var_theta
