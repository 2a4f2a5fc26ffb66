"""What the host asks is scaled to what the board takes, around either law.

The limits on forward speed and turn rate are those of the body; together they may ask more of the
outer wheels than the board accepts (its W_MAX), and a set-point beyond that is refused as a whole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.control.vehicles.vehicle import Vehicle
    from hil.core.types import Estimate, OuterLaw, ReferenceState

# Set-points go out as 32-bit floats, whose rounding must not lift them over the bound.
_BELOW = 1.0 - 1e-6


class WithinWheelSpeed:
    """Scales forward speed and turn rate by one factor, so that the path keeps its curvature.

    `omega_max_rad_s` bounds the wheel speeds. A command within the bound passes as it is.
    """

    def __init__(self, law: OuterLaw, vehicle: Vehicle, omega_max_rad_s: float) -> None:
        self._law = law
        self._vehicle = vehicle
        self._omega_max_rad_s = omega_max_rad_s

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._law.reset(reference, estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command, scaled where a wheel would be asked more than the bound."""
        command = self._law.step(reference, estimate, dt_s)
        left, right = self._vehicle.wheels(command.eta1_m_s, command.theta_dot_rad_s)
        fastest = max(abs(left), abs(right))
        if not fastest > self._omega_max_rad_s:
            return command
        share = self._omega_max_rad_s / fastest * _BELOW
        return OuterCommand(
            share * command.eta1_m_s,
            share * command.theta_dot_rad_s,
            command.trace | {"saturated": 1.0},
        )
