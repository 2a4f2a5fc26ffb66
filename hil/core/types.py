"""Values passed between localisation, estimator, laws and link.

Frames: world is right-handed, X right and Y up on the floor, z up. Body is x forward, y left.
theta is counter-clockwise from world +X and unwrapped (wrap only for display).
SI units and radians throughout.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

__all__ = [
    "Estimate",
    "Estimator",
    "OuterCommand",
    "OuterLaw",
    "Pose",
    "PoseMeasurement",
    "ReferenceState",
    "Vec2",
    "WheelSample",
    "wrap_pi",
]

Vec2 = tuple[float, float]


def wrap_pi(angle_rad: float) -> float:
    """Return the angle wrapped to [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of the centre of mass on the floor (2.30): world X, Y in m, heading in rad."""

    x_m: float
    y_m: float
    theta_rad: float


# Upper triangle of a symmetric 3 x 3 matrix of (x_m, y_m, theta_rad): xx, xy, xt, yy, yt, tt.
Covariance = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class PoseMeasurement:
    """What the localiser says of one frame.

    `pose` is None when the robot was not seen, and `reason` then says why. `quality` is 0 to 1.
    `sigma_xy_m` and `sigma_theta_rad` are the standard deviations the localiser claims;
    `covariance`, where it knows more, is the upper triangle (xx, xy, xt, yy, yt, tt) of that of
    (x_m, y_m, theta_rad), whose diagonal they sum up.
    `details` holds figures worth recording (mark areas, contrast, window or full frame, residual).
    """

    pose: Pose | None
    quality: float
    reason: str = ""
    sigma_xy_m: float = 0.001
    sigma_theta_rad: float = 0.005
    details: dict[str, float] = field(default_factory=dict)
    covariance: Covariance | None = None


@dataclass(frozen=True, slots=True)
class WheelSample:
    """One wheel-state report of the board; `t_host_s` is its board time tied to the host clock."""

    t_host_s: float
    counts_left: int
    counts_right: int
    omega_left_rad_s: float
    omega_right_rad_s: float


@dataclass(frozen=True, slots=True)
class Estimate:
    """State of the robot at `t_host_s` (normally the instant the next command takes effect).

    `z1`, `z2` are the flat output (2.35) and its rate in world axes. `z3` is given only by an
    estimator that observes acceleration; None means the law forms it from its own zeta.
    `sides_at_limit` (left, right) is 1 or -1 for a side whose motor gives all it can forward or
    backward and lacks speed; `driven_hard` says that a side is driven with a duty with which a wheel
    that stands is a stall. The harness fills both in from what the board reports.
    """

    t_host_s: float
    pose: Pose
    eta1_m_s: float
    theta_dot_rad_s: float
    z1_m: Vec2
    z2_m_s: Vec2
    z3_m_s2: Vec2 | None = None
    sides_at_limit: tuple[int, int] = (0, 0)
    driven_hard: bool = False


@dataclass(frozen=True, slots=True)
class ReferenceState:
    """Desired flat output z1* and its first three time derivatives, world axes."""

    z1_m: Vec2
    z1_dot_m_s: Vec2
    z1_ddot_m_s2: Vec2
    z1_dddot_m_s3: Vec2


@dataclass(frozen=True, slots=True)
class OuterCommand:
    """Body speeds wanted of the robot, and every internal term worth plotting in `trace`."""

    eta1_m_s: float
    theta_dot_rad_s: float
    trace: dict[str, float]


class OuterLaw(Protocol):
    """A pure outer law: no clock, no I/O; state changes only in reset and step."""

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew from this estimate (integrals to zero, zeta to its start value)."""

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the command for the next `dt_s`."""


class Estimator(Protocol):
    """Fuses delayed poses and wheel reports; all times are host times in s, passed in."""

    def on_wheels(self, sample: WheelSample) -> None:
        """Take one wheel report (in time order)."""

    def on_pose(self, t_exposure_s: float, measurement: PoseMeasurement) -> bool:
        """Take the pose seen at exposure time `t_exposure_s`, which lies in the past.

        Return whether it was believed.
        """

    def agreement_age_s(self, t_host_s: float) -> float:
        """Return the time since a pose last agreed with the wheels; inf before the first pose."""

    @property
    def refused(self) -> tuple[float, float, float]:
        """The last pose not believed minus the pose expected then: m, m, rad; zero before one."""

    @property
    def scales(self) -> tuple[float, float]:
        """What the camera sees of a metre and of a radian that the wheels turn."""

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds commanded to be in effect from `t_effect_s` on."""

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state predicted to `t_host_s`; None before the first pose."""
