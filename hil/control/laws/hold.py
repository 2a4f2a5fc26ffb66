"""The control stop of the thesis's program (8.10.3), around either law: rest at the goal.

Near the point neither law has lateral authority (det B = -eta1/d0), and what is left to command is
below the friction of wheels and floor: the wheel loops would creep and break loose by turns.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.core.types import Estimate, OuterLaw, ReferenceState

# Slower than this the robot counts as arrived: stopping from it moves it by less than 1 mm.
_ETA1_M_S = 0.02
_THETA_DOT_RAD_S = 0.2


class HoldAtGoal:
    """Commands rest once the law has brought the robot to a reference at rest.

    Rest begins within `hold_enter_m` and ends beyond `hold_leave_m`, or when the reference moves;
    the law then starts anew from there, as at the beginning of a run.
    """

    def __init__(self, law: OuterLaw, limits: OuterLimits) -> None:
        self._law = law
        self._enter, self._leave = limits.hold_enter_m, limits.hold_leave_m
        self._holding = False
        self._trace: dict[str, float] = {}

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._holding = False
        self._law.reset(reference, estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command, or rest."""
        (x, y), (x_ref, y_ref) = estimate.z1_m, reference.z1_m
        distance = math.hypot(x - x_ref, y - y_ref)
        at_rest = reference.z1_dot_m_s == (0.0, 0.0)
        if self._holding:
            if distance <= self._leave and at_rest:
                return self._rest(estimate)
            self.reset(reference, estimate)
        command = self._law.step(reference, estimate, dt_s)
        self._trace = command.trace
        self._holding = (
            at_rest
            and distance <= self._enter
            and abs(estimate.eta1_m_s) < _ETA1_M_S
            and abs(estimate.theta_dot_rad_s) < _THETA_DOT_RAD_S
        )
        return self._rest(estimate) if self._holding else command

    def _rest(self, estimate: Estimate) -> OuterCommand:
        """Return zero speeds; sliding terms stay as they were when the hold began."""
        now = {
            "z2_x_m_s": estimate.z2_m_s[0],
            "z2_y_m_s": estimate.z2_m_s[1],
            "z3_x_m_s2": 0.0,
            "z3_y_m_s2": 0.0,
            "zeta_m_s2": 0.0,
            "v1_m_s3": 0.0,
            "u2_m_s2": 0.0,
            "saturated": 0.0,
        }
        return OuterCommand(0.0, 0.0, {**self._trace, **now})
