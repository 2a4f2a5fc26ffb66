"""The thesis's variant: z2, z3 by super-twisting from the camera's z1 alone, predicted linearly.

Two differentiators in cascade per axis (z1 -> z2 -> z3) and one on the heading, the firmware core's
own (docs/control.md section 4), stepped at the exposures; wheel counts and commands are not used.
World frame, SI.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.board._firmware import SuperTwisting
from hil.core.registries import ESTIMATORS
from hil.core.types import Estimate, Pose, PoseMeasurement, WheelSample, wrap_pi

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig
    from hil.control.estimators.geometry import BelievedGeometry

# After a longer gap between poses the differentiators start anew.
_GAP_S = 0.5


@ESTIMATORS.register(
    "camera-only", summary="the thesis's variant: differentiators on camera poses alone"
)
class CameraOnly:
    """Selectable for comparison with the default."""

    def __init__(self, config: EstimatorConfig, geometry: BelievedGeometry) -> None:
        self._config = config
        self._d0 = geometry.d0_m
        self._t: float | None = None
        self._theta = 0.0
        self._z1 = self._z2 = self._z3 = (0.0, 0.0)
        self._theta_dot = 0.0
        self._make_differentiators()

    def _make_differentiators(self) -> None:
        """Start the five differentiators anew."""
        config = self._config
        self._first = [SuperTwisting(config.st_accel_m_s2) for _ in range(2)]
        self._second = [SuperTwisting(config.st_jerk_m_s3) for _ in range(2)]
        self._turn = SuperTwisting(config.st_theta_ddot_rad_s2)

    def pose_age_s(self, t_host_s: float) -> float:
        """Return the time since the last exposure; inf before the first."""
        return math.inf if self._t is None else t_host_s - self._t

    def agreement_age_s(self, t_host_s: float) -> float:
        """Return the same: without wheels every pose is believed."""
        return self.pose_age_s(t_host_s)

    @property
    def refused(self) -> tuple[float, float, float]:
        """The last pose refused minus the pose expected then: none ever is."""
        return 0.0, 0.0, 0.0

    @property
    def scales(self) -> tuple[float, float]:
        """What the camera sees of what the wheels turn: not asked here."""
        return 1.0, 1.0

    def on_wheels(self, sample: WheelSample) -> None:
        """Ignore the report: this variant sees with the camera alone."""

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Ignore the command: this variant sees with the camera alone."""

    def on_pose(self, t_exposure_s: float, measurement: PoseMeasurement) -> bool:
        """Take the pose seen at `t_exposure_s`; older than the last one is dropped.

        Return whether it was taken.
        """
        pose = measurement.pose
        if pose is None or (self._t is not None and t_exposure_s <= self._t):
            return False
        if self._t is None or t_exposure_s - self._t > _GAP_S:
            self._make_differentiators()
            dt = 0.0
        else:
            dt = t_exposure_s - self._t
        theta = self._theta + wrap_pi(pose.theta_rad - self._theta)
        z1 = (pose.x_m + self._d0 * math.cos(theta), pose.y_m + self._d0 * math.sin(theta))
        (x, vx), (y, vy) = (st.step(z, dt) for st, z in zip(self._first, z1, strict=True))
        (vx, ax), (vy, ay) = (st.step(v, dt) for st, v in zip(self._second, (vx, vy), strict=True))
        self._theta, self._theta_dot = self._turn.step(theta, dt)
        self._t, self._z1, self._z2, self._z3 = t_exposure_s, (x, y), (vx, vy), (ax, ay)
        return True

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state carried on linearly to `t_host_s`; None before the first pose."""
        if self._t is None:
            return None
        ahead = t_host_s - self._t
        (x, y), (vx, vy) = self._z1, self._z2
        z1 = (x + ahead * vx, y + ahead * vy)
        theta = self._theta + ahead * self._theta_dot
        c, s = math.cos(theta), math.sin(theta)
        pose = Pose(z1[0] - self._d0 * c, z1[1] - self._d0 * s, theta)
        eta1 = c * vx + s * vy
        return Estimate(t_host_s, pose, eta1, self._theta_dot, z1, (vx, vy), self._z3)
