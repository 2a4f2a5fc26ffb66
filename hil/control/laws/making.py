"""An outer law made ready for a run: with its gains, and the rest at the goal that all laws share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.control.laws.hold import HoldAtGoal
from hil.core.registries import OUTER_LAWS

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.config.gains import Gains
    from hil.core.types import OuterLaw


def make_outer_law(name: str, gains: Gains, limits: OuterLimits, d0_m: float) -> OuterLaw:
    """Return the outer law `name` with its part of `gains`; `d0_m` is as believed (2.31).

    Raises BadInput when there is no such law.
    """
    entry = OUTER_LAWS.get(name)
    return HoldAtGoal(entry.factory(gains.of(entry), limits, d0_m), limits)
