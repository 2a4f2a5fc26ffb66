"""Classical sliding mode of first order, with a boundary layer.

    s = delta3,    jerk = d z3*/dt - alpha s/(||s|| + eps)

On s = 0 the error has the poles -k1, -k2. Utkin, "Sliding Modes in Control and Optimization" (1992);
the unit vector is that of Gutman (1979), the layer that of Burton and Zinober (1986). s(0) is what the
start makes it: the surface has to be reached first, and until then nothing of the promise holds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.config.base import quantity
from hil.control.laws.stages import (
    STAGE_BOX,
    START_BOX,
    TERM,
    Stage,
    StagedLaw,
    StageGains,
    Wish,
    sliding_terms,
)
from hil.core.registries import OUTER_LAWS

if TYPE_CHECKING:
    from hil.control.laws.chain import ChainState


class SlidingModeGains(StageGains):
    """Gains of the classical sliding mode."""

    alpha_m_s3: float = quantity("m/s^3", "gain of the sliding term", ge=0, le=1e4)
    eps_m_s2: float = quantity("m/s^2", "boundary layer", gt=0, le=100)


@OUTER_LAWS.register(
    "sliding-mode",
    settings=SlidingModeGains,
    search=STAGE_BOX | {"alpha_m_s3": (0.1, 3.0, 30.0), "eps_m_s2": (0.01, 1.0, 5.0)} | START_BOX,
    sliding=True,
    summary="classical first-order sliding mode with a boundary layer",
    colour="#e69f00",
    trace=TERM,
)
class SlidingMode(StagedLaw[SlidingModeGains]):
    """The law; one instance runs one robot."""

    def _wish(self, stage: Stage, state: ChainState, dt_s: float) -> Wish:  # noqa: ARG002 - of all laws
        gains, (x, y), (jx, jy) = self._gains, stage.delta3, stage.z3_dot
        pull = -gains.alpha_m_s3 / (math.hypot(x, y) + gains.eps_m_s2)
        term = (pull * x, pull * y)
        return Wish((jx + term[0], jy + term[1]), sliding_terms(stage.delta3, gains.eps_m_s2, term))
