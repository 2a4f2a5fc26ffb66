"""A small floor for laws: a robot that follows its commands at once, and what a law is shown there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from hil.config.control import CircleReference, PointReference
from hil.config.scenario import Scenario
from hil.control.references import Circle, Point, Reference
from hil.core.types import Estimate, Pose, ReferenceState, Vec2

_TICKS = 90
# Start of z1 (m, m), heading and forward speed: each side of the point, beside it, behind, at it, moving.
_STARTS = (
    ("left of the point", (-0.6, -0.35, 1.57, 0.0)),
    ("right of the point", (0.65, -0.3, 1.5, 0.0)),
    ("beside the point", (-0.5, 0.35, 1.2, 0.1)),
    ("behind the point", (0.4, 0.6, 0.9, 0.0)),
    ("at the point", (0.05, 0.35, -0.4, 0.0)),
    ("moving", (-0.2, -0.4, 0.3, 0.35)),
)


@dataclass(frozen=True, slots=True)
class Episode:
    """What a law is shown, tick by tick."""

    name: str
    references: tuple[ReferenceState, ...]
    estimates: tuple[Estimate, ...]


def episodes(scenario: Scenario, ticks: int = _TICKS) -> tuple[Episode, ...]:
    """Return points reached from all sides, and a circle, at the scenario's rate.

    The path is that of a plain pursuit with a weave, not of the law under test: every law is shown
    the same, whatever it commands.
    """
    dt_s, d0_m = 1.0 / scenario.control.rate_hz, scenario.robot.d0_m
    point = Point(PointReference(x_m=0.05, y_m=0.35))
    circle = Circle(CircleReference(radius_m=0.4, rate_rad_s=0.6, d0_m=d0_m))
    shown = [_episode(name, point, start, d0_m, dt_s, ticks) for name, start in _STARTS]
    shown.append(_episode("on a circle", circle, (0.0, 0.45, 0.2, 0.1), d0_m, dt_s, ticks))
    return tuple(shown)


def _episode(
    name: str,
    reference: Reference,
    start: tuple[float, float, float, float],
    d0_m: float,
    dt_s: float,
    ticks: int,
) -> Episode:
    x, y, theta, speed = start
    references, estimates = [], []
    for tick in range(ticks):
        goal = reference.at(tick * dt_s)
        c, s = math.cos(theta), math.sin(theta)
        ex, ey = goal.z1_m[0] - x, goal.z1_m[1] - y
        wish = min(0.4, math.hypot(ex, ey))
        speed += 0.2 * (wish * (1.0 if c * ex + s * ey > 0.0 else -0.5) - speed)
        turn = 3.0 * (c * ey - s * ex) + 0.4 * math.sin(2.0 * tick * dt_s)
        pose = Pose(x - d0_m * c, y - d0_m * s, theta)
        velocity = (speed * c, speed * s)
        references.append(goal)
        estimates.append(Estimate(tick * dt_s, pose, speed, turn, (x, y), velocity))
        x, y, theta = x + velocity[0] * dt_s, y + velocity[1] * dt_s, theta + turn * dt_s
    return Episode(name, tuple(references), tuple(estimates))


def mirrored(episode: Episode) -> Episode:
    """Return the episode mirrored left to right: Y, heading and turn rate change their sign."""
    return Episode(
        f"{episode.name}, mirrored",
        tuple(_mirrored_reference(reference) for reference in episode.references),
        tuple(mirrored_estimate(estimate) for estimate in episode.estimates),
    )


def _flip(value: Vec2) -> Vec2:
    return value[0], -value[1]


def _mirrored_reference(state: ReferenceState) -> ReferenceState:
    return ReferenceState(
        _flip(state.z1_m),
        _flip(state.z1_dot_m_s),
        _flip(state.z1_ddot_m_s2),
        _flip(state.z1_dddot_m_s3),
    )


def mirrored_pose(pose: Pose) -> Pose:
    """Return a pose mirrored left to right."""
    return Pose(pose.x_m, -pose.y_m, -pose.theta_rad)


def mirrored_estimate(estimate: Estimate) -> Estimate:
    """Return an estimate mirrored left to right."""
    z3 = estimate.z3_m_s2
    return replace(
        estimate,
        pose=mirrored_pose(estimate.pose),
        theta_dot_rad_s=-estimate.theta_dot_rad_s,
        z1_m=_flip(estimate.z1_m),
        z2_m_s=_flip(estimate.z2_m_s),
        z3_m_s2=None if z3 is None else _flip(z3),
    )
