"""Small worlds for the tests of the outer laws."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil.core.types import Estimate, OuterLaw, Pose, ReferenceState, Vec2

D0_M = 0.03


def estimate(x=0.0, y=0.0, theta=0.0, eta1=0.0, *, w=0.0, t=0.0, z3=None) -> Estimate:
    """Return a perfect estimate of a robot whose flat output point is (x, y)."""
    c, s = math.cos(theta), math.sin(theta)
    pose = Pose(x - D0_M * c, y - D0_M * s, theta)
    return Estimate(t, pose, eta1, w, (x, y), (eta1 * c, eta1 * s), z3)


def point(x: float, y: float) -> ReferenceState:
    """Return a reference at rest."""
    return ReferenceState((x, y), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


@dataclass(slots=True)
class FloorRun:
    """Path of the flat output point, headings and commands of a run."""

    z1: list[Vec2]
    theta: list[float]
    eta1: list[float]
    w: list[float]
    saturated: list[float]

    def error(self, goal: Vec2, index: int = -1) -> float:
        """Return the distance to the goal at a tick."""
        return math.hypot(self.z1[index][0] - goal[0], self.z1[index][1] - goal[1])


def drive_to(
    law: OuterLaw, start: tuple[float, float, float], goal: Vec2, *, seconds=20.0, push=0.0
) -> FloorRun:
    """Run a unicycle that follows commands at once, at 30 Hz, from rest; `push` adds m/s ahead."""
    dt = 1.0 / 30.0
    x, y, theta = start
    eta1 = w = 0.0
    run = FloorRun([], [], [], [], [])
    reference = point(*goal)
    law.reset(reference, estimate(x, y, theta))
    for tick in range(round(seconds / dt)):
        command = law.step(reference, estimate(x, y, theta, eta1, w=w, t=tick * dt), dt)
        eta1, w = command.eta1_m_s + push, command.theta_dot_rad_s
        middle = theta + 0.5 * w * dt
        x, y = x + eta1 * math.cos(middle) * dt, y + eta1 * math.sin(middle) * dt
        theta += w * dt
        run.z1.append((x, y))
        run.theta.append(theta)
        run.eta1.append(command.eta1_m_s)
        run.w.append(command.theta_dot_rad_s)
        run.saturated.append(command.trace["saturated"])
    return run
