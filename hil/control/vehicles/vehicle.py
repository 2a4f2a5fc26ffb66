"""What every vehicle answers: its wheels for a motion, its flat output, where it stands on the floor.

Body frame x forward, y left, origin at the centre of mass; theta_dot > 0 means the right wheel is
faster. Both built-in vehicles have two driven sides and a point d0 ahead of the centre of mass that
has no lateral speed (2.31), so the laws and the estimator serve either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from hil.control.estimators.geometry import BelievedGeometry
from hil.core.registries import VEHICLES

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig
    from hil.core.types import Pose, Vec2


@dataclass(frozen=True, slots=True)
class Contacts:
    """Where the robot stands: distances of both contacts' lines from the centre of mass, m.

    `castor_friction_ratio` is None where the rear line is an axle with driven wheels; else a castor
    stands there, with this friction over its load.
    """

    front_m: float
    rear_m: float
    castor_friction_ratio: float | None = None

    @property
    def rear_load_ratio(self) -> float:
        """Return the share of the weight that the rear line carries."""
        return self.front_m / (self.front_m + self.rear_m)


class Vehicle(Protocol):
    """A robot's wheels as the host believes them to be."""

    @property
    def geometry(self) -> BelievedGeometry:
        """The numbers that odometry needs."""

    @property
    def contacts(self) -> Contacts:
        """Where the robot stands on the floor, for the simulated one."""

    def body(self, left: float, right: float) -> tuple[float, float]:
        """Return (forward, turn) of a pair of wheel angles or speeds: m and rad, or per s."""

    def wheels(self, eta1_m_s: float, theta_dot_rad_s: float) -> tuple[float, float]:
        """Return the (left, right) wheel speeds in rad/s that give the body speeds."""

    def flat_output(self, pose: Pose) -> Vec2:
        """Return z1 (2.35) in m, world axes: the point that has no lateral speed."""


class TwoSided:
    """What vehicles with a left and a right side that roll without slip share (2.30)-(2.36)."""

    def __init__(self, robot: RobotConfig) -> None:
        self.geometry = BelievedGeometry.of(robot)

    def body(self, left: float, right: float) -> tuple[float, float]:
        """Return (forward, turn) of a pair of wheel angles or speeds: m and rad, or per s."""
        return self.geometry.body(left, right)

    def wheels(self, eta1_m_s: float, theta_dot_rad_s: float) -> tuple[float, float]:
        """Return the (left, right) wheel speeds in rad/s that give the body speeds."""
        return self.geometry.wheels(eta1_m_s, theta_dot_rad_s)

    def flat_output(self, pose: Pose) -> Vec2:
        """Return z1 = [X + d0 c, Y + d0 s] (2.35)."""
        d0_m = self.geometry.d0_m
        return (
            pose.x_m + d0_m * math.cos(pose.theta_rad),
            pose.y_m + d0_m * math.sin(pose.theta_rad),
        )


def make_vehicle(robot: RobotConfig) -> Vehicle:
    """Return the vehicle of a robot's file; raises BadInput for a kind that is not known."""
    made: Vehicle = VEHICLES.get(robot.vehicle.kind).factory(robot)
    return made
