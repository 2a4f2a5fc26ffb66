"""Outer laws: from reference and estimate to body speeds; pure, one registry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.state_feedback import StateFeedback
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from hil.config.control import Gains, OuterLimits
    from hil.core.types import OuterLaw

OUTER_LAWS = ("asg-ism", "pid")


def make_outer_law(name: str, gains: Gains, limits: OuterLimits, d0_m: float) -> OuterLaw:
    """Return the outer law `name` with its part of `gains`; `d0_m` is as believed (2.31)."""
    if name == "asg-ism":
        return HoldAtGoal(AsgIsm(gains.asg_ism, limits, d0_m), limits)
    if name == "pid":
        return HoldAtGoal(StateFeedback(gains.pid, limits, d0_m), limits)
    raise BadInput(f"outer law {name!r} is unknown; choose one of {', '.join(OUTER_LAWS)}")
