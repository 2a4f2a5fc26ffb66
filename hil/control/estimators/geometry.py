"""The robot's geometry as the host believes it; plain Python, since session and tools need it too.

Body frame x forward, y left; theta_dot > 0 means the right wheel is faster.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig

# The file may be off by a fifth, and a robot pushed or on a slope drives its motors.
_OVER_NO_LOAD_RATIO = 1.3


@dataclass(frozen=True, slots=True)
class BelievedGeometry:
    """The robot as the host believes it to be; the truth may differ by some 10 %."""

    wheel_radius_m: float
    track_width_m: float
    d0_m: float
    counts_per_turn: int
    # No wheel turns faster; the default is that of the thesis's robot.
    omega_max_rad_s: float = 40.0

    @classmethod
    def of(cls, robot: RobotConfig) -> BelievedGeometry:
        """Return what the robot's file says."""
        return cls(
            robot.wheel_radius_m,
            robot.track_m,
            robot.d0_m,
            robot.encoder_counts_per_turn,
            _OVER_NO_LOAD_RATIO * robot.no_load_rad_s,
        )

    @property
    def rad_per_count(self) -> float:
        """Return the wheel angle of one count."""
        return 2.0 * math.pi / self.counts_per_turn

    def body(self, left: float, right: float) -> tuple[float, float]:
        """Return (forward, turn) of a pair of wheel angles or speeds: m and rad, or per s."""
        r = self.wheel_radius_m
        return 0.5 * r * (left + right), r * (right - left) / self.track_width_m

    def wheels(self, eta1_m_s: float, theta_dot_rad_s: float) -> tuple[float, float]:
        """Return the (left, right) wheel speeds in rad/s that give the body speeds."""
        half = 0.5 * self.track_width_m * theta_dot_rad_s
        r = self.wheel_radius_m
        return (eta1_m_s - half) / r, (eta1_m_s + half) / r
