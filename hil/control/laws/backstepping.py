"""Backstepping alone: three stages of (8.6)-(8.11), and nothing of the sliding mode.

    jerk = d z3*/dt - k3 delta3

Krstic, Kanellakopoulos and Kokotovic, "Nonlinear and Adaptive Control Design" (1995), section 2.2. The
third stage is linear: ASG-ISM with alpha = 0 would leave ds/dt = d, an integrator with nothing that
pulls s back. A disturbance d is left standing as delta3 = d/k3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.config.base import quantity
from hil.control.laws.stages import (
    STAGE_BOX,
    START_BOX,
    Stage,
    StagedLaw,
    StageGains,
    Wish,
)
from hil.core.registries import OUTER_LAWS

if TYPE_CHECKING:
    from hil.control.laws.chain import ChainState


class BacksteppingGains(StageGains):
    """Gains of backstepping alone; poles -k1, -k2, -k3 where no restriction acts."""

    k3_s: float = quantity("1/s", "acceleration error to jerk", gt=0, le=100)


@OUTER_LAWS.register(
    "backstepping",
    settings=BacksteppingGains,
    search=STAGE_BOX | {"k3_s": (0.5, 3.0, 30.0)} | START_BOX,
    summary="backstepping alone, the third stage linear",
    colour="#666666",
)
class Backstepping(StagedLaw[BacksteppingGains]):
    """The law; one instance runs one robot."""

    def _wish(self, stage: Stage, state: ChainState, dt_s: float) -> Wish:  # noqa: ARG002 - of all laws
        (x, y), (jx, jy), k3 = stage.delta3, stage.z3_dot, self._gains.k3_s
        return Wish((jx - k3 * x, jy - k3 * y), {})
