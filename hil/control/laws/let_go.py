"""A robot that stands is not pressed against its floor, around any law.

About its goal a law asks for less and less of wheels that stick, and what the wheel loops have gathered to
move them stays on the motors: they heat up, press against each other, and the board takes it for a stall.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.control.vehicles.vehicle import Vehicle
    from hil.core.types import Estimate, OuterLaw, ReferenceState


# A wheel that breaks loose is driven hard for less than this; the board calls it a stall after 0.5 s.
_WAIT_S = 0.09


class LetGo:
    """Commands rest once a side is driven hard for a while with no wheel asked for over `least_rad_s`.

    At a set-point of zero the board takes its bridge off a slow wheel and begins its integrals anew. None is
    never. Driven hard is what the board would call a stall if the wheel stood (`Estimate.driven_hard`).
    """

    def __init__(self, law: OuterLaw, vehicle: Vehicle, least_rad_s: float | None) -> None:
        self._law = law
        self._vehicle = vehicle
        self._least_rad_s = least_rad_s
        self._pressed_s = 0.0

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._pressed_s = 0.0
        self._law.reset(reference, estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command, or rest."""
        command = self._law.step(reference, estimate, dt_s)
        self._pressed_s = self._pressed_s + dt_s if self._presses(command, estimate) else 0.0
        if self._pressed_s < _WAIT_S:
            return command
        return OuterCommand(0.0, 0.0, command.trace)

    def _presses(self, command: OuterCommand, estimate: Estimate) -> bool:
        if self._least_rad_s is None or not estimate.driven_hard:
            return False
        left, right = self._vehicle.wheels(command.eta1_m_s, command.theta_dot_rad_s)
        return max(abs(left), abs(right)) <= self._least_rad_s
