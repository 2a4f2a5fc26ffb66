"""Turn before speed where the motors give no more, around any law.

On a floor with much grip a skid-steered robot needs most of its torque to turn. While a side stands at
the board's limit and the turn asked for is not made, a forward speed on top makes the two wheel loops work
against each other: one side pushes at its limit, the other brakes to keep its own speed. Forward speed then
gives way until the turn is made.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.core.types import Estimate, OuterLaw, ReferenceState

# Forward speed gives way within the first, and comes back within the second: a side leaves its limit as soon
# as less is asked, and the two would take turns otherwise.
_GIVE_WAY_S, _COME_BACK_S = 0.1, 1.0
# A robot that cannot turn on the spot may still turn on an arc: some forward speed is left.
_LEAST_SHARE = 0.2


class TurnFirst:
    """Scales the forward speed down while turn is missing and a side is at its limit.

    `missing_rad_s` of the turn rate missing begins it, twice that leaves the least share; None is never.
    """

    def __init__(self, law: OuterLaw, missing_rad_s: float | None) -> None:
        self._law = law
        self._missing_rad_s = missing_rad_s
        self._share = 1.0

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        self._share = 1.0
        self._law.reset(reference, estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the law's command, with less forward speed where the turn needs the torque."""
        command = self._law.step(reference, estimate, dt_s)
        if self._missing_rad_s is None:
            return command
        wanted = self._wanted_share(command, estimate, self._missing_rad_s)
        if wanted < self._share:
            self._share = max(wanted, self._share - dt_s / _GIVE_WAY_S)
        else:
            self._share = min(wanted, self._share + dt_s / _COME_BACK_S)
        if self._share >= 1.0:
            return command
        return OuterCommand(
            self._share * command.eta1_m_s,
            command.theta_dot_rad_s,
            command.trace | {"saturated": 1.0},
        )

    @staticmethod
    def _wanted_share(command: OuterCommand, estimate: Estimate, least_rad_s: float) -> float:
        if estimate.sides_at_limit == (0, 0):
            return 1.0
        asked = command.theta_dot_rad_s
        missing = abs(asked) - math.copysign(1.0, asked) * estimate.theta_dot_rad_s
        return min(max(2.0 - missing / least_rad_s, _LEAST_SHARE), 1.0)
