"""World axes of its own for a law: what it says must not depend on them.

A law that knows no direction gives the same run in all axes, up to rounding; one whose cost has a sign by
component does not (docs/outer-laws.md). Nothing of robot, floor or camera turns with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from random import Random
from typing import TYPE_CHECKING

from hil.control.laws.hold import HoldAtGoal
from hil.core.types import OuterCommand, Pose, ReferenceState

if TYPE_CHECKING:
    from hil.core.types import Estimate, OuterLaw, Vec2


def drawn_axes_rad(name: str) -> float:
    """Return an angle in (-pi, pi), drawn by a name: every law gets the same for it."""
    return Random(f"axes of {name}").uniform(-math.pi, math.pi)


class TurnedAxes:
    """Runs a law in axes turned by `angle_rad` about Z, and turns the vectors of its trace back."""

    def __init__(self, law: OuterLaw, angle_rad: float) -> None:
        self._law = law
        self._angle_rad = angle_rad
        self._cos, self._sin = math.cos(angle_rad), math.sin(angle_rad)

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._law.reset(self._reference(reference), self._estimate(estimate))

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command; speeds of the body are the same in all axes."""
        out = self._law.step(self._reference(reference), self._estimate(estimate), dt_s)
        return OuterCommand(out.eta1_m_s, out.theta_dot_rad_s, self._back(out.trace))

    def _into(self, vector: Vec2) -> Vec2:
        x, y = vector
        return self._cos * x + self._sin * y, self._cos * y - self._sin * x

    def _reference(self, reference: ReferenceState) -> ReferenceState:
        return ReferenceState(
            self._into(reference.z1_m),
            self._into(reference.z1_dot_m_s),
            self._into(reference.z1_ddot_m_s2),
            self._into(reference.z1_dddot_m_s3),
        )

    def _estimate(self, estimate: Estimate) -> Estimate:
        pose, z3 = estimate.pose, estimate.z3_m_s2
        x, y = self._into((pose.x_m, pose.y_m))
        turned = replace(
            estimate,
            pose=Pose(x, y, pose.theta_rad - self._angle_rad),
            z1_m=self._into(estimate.z1_m),
            z2_m_s=self._into(estimate.z2_m_s),
        )
        return turned if z3 is None else replace(turned, z3_m_s2=self._into(z3))

    def _back(self, trace: Mapping[str, float]) -> dict[str, float]:
        """Return the trace with each pair of terms NAME_x..., NAME_y... in the axes of the world."""
        found = dict(trace)
        for name, other in _pairs(tuple(trace)):
            x, y = float(trace[name]), float(trace[other])  # whatever a law calculates in
            found[name] = self._cos * x - self._sin * y
            found[other] = self._sin * x + self._cos * y
        return found


def is_of_a_vector(name: str) -> bool:
    """Say whether a name of a trace is one that X or Y of a vector has."""
    return any(f"_{axis}_" in name or name.endswith(f"_{axis}") for axis in "xy")


@cache
def _pairs(names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return which terms of a trace are X and Y of one vector."""
    found = []
    for name in names:
        other = name.replace("_x_", "_y_") if "_x_" in name else f"{name[:-1]}y"
        if ("_x_" in name or name.endswith("_x")) and other in names:
            found.append((name, other))
    return tuple(found)


def in_axes(law: OuterLaw, angle_rad: float) -> OuterLaw:
    """Return the law working in axes turned by `angle_rad`; itself at 0.

    The rest at the goal knows no axes and stays around it, so that a robot at rest asks no law.
    """
    if not angle_rad:
        return law
    if type(law) is HoldAtGoal:
        law._law = TurnedAxes(law._law, angle_rad)
        return law
    return TurnedAxes(law, angle_rad)
