"""Integral sliding mode of Utkin and Shi, with the equivalent control taken by a filter.

Around the nominal law w0 = d z3*/dt - k3 delta3 (backstepping alone). A model runs beside the robot,

    s = z3 - m,   dm/dt = A + B v + alpha Sgn(s),   m(0) = z3(0)

so that s(0) = 0 and ds/dt = d - alpha Sgn(s). What the sliding term must be on s = 0, the disturbance
d, is taken from it by a first-order filter:

    tau d d_eq/dt + d_eq = alpha Sgn(s),    jerk = w0 - d_eq

Utkin and Shi, "Integral sliding mode in systems operating under uncertainty conditions", CDC 1996,
section IV: the switching stays inside the model, the robot is given its average alone. Sgn is solved
implicitly (the projection of s on the ball of radius alpha h, over h), so that the model does not chatter.
A + B v is what the limits left of the wish; while one holds, m follows z3.

z3 of an estimator that does not observe it is formed from the law's own zeta: s then holds what disturbs
the turn and not what disturbs the forward acceleration.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.config.base import quantity
from hil.control.laws.chain import executed_jerk
from hil.control.laws.stages import (
    STAGE_BOX,
    START_BOX,
    TERM,
    Stage,
    StagedLaw,
    StageGains,
    Wish,
    projected,
    sliding_terms,
)
from hil.core.registries import OUTER_LAWS

if TYPE_CHECKING:
    from hil.control.laws.chain import ChainCommand, ChainState
    from hil.core.types import Vec2


class IntegralSlidingModeGains(StageGains):
    """Gains of the integral sliding mode."""

    k3_s: float = quantity("1/s", "acceleration error to jerk, of the nominal law", gt=0, le=100)
    alpha_m_s3: float = quantity("m/s^3", "gain of the sliding term", ge=0, le=1e4)
    filter_s: float = quantity("s", "time constant that averages the sliding term", gt=0, le=10)


@OUTER_LAWS.register(
    "integral-sliding-mode",
    settings=IntegralSlidingModeGains,
    search=STAGE_BOX
    | {
        "k3_s": (0.5, 3.0, 30.0),
        "alpha_m_s3": (0.1, 3.0, 30.0),
        "filter_s": (0.03, 0.3, 3.0),
    }
    | START_BOX,
    sliding=True,
    summary="Utkin and Shi's integral sliding mode with a filter for the equivalent control",
    colour="#cc79a7",
    trace=TERM,
)
class IntegralSlidingMode(StagedLaw[IntegralSlidingModeGains]):
    """The law; one instance runs one robot."""

    def _begin(self, delta3: Vec2, state: ChainState) -> None:  # noqa: ARG002 - of all laws
        self._model = state.z3
        self._average = (0.0, 0.0)
        self._pull = (0.0, 0.0)

    def _wish(self, stage: Stage, state: ChainState, dt_s: float) -> Wish:
        gains, (x, y), (jx, jy) = self._gains, stage.delta3, stage.z3_dot
        s = (state.z3[0] - self._model[0], state.z3[1] - self._model[1])
        radius = gains.alpha_m_s3 * dt_s
        inside = projected(s, radius)
        self._pull = (inside[0] / dt_s, inside[1] / dt_s)
        share = -math.expm1(-dt_s / gains.filter_s)
        (ex, ey), (px, py) = self._average, self._pull
        self._average = (ex + share * (px - ex), ey + share * (py - ey))
        ex, ey = self._average
        jerk = (jx - gains.k3_s * x - ex, jy - gains.k3_s * y - ey)
        return Wish(jerk, sliding_terms(s, radius, (-ex, -ey)))

    def _advance(self, state: ChainState, out: ChainCommand, dt_s: float) -> None:
        jx, jy = executed_jerk(state, out, self._chain.zeta, dt_s)
        if out.saturated:
            self._model = (state.z3[0] + dt_s * jx, state.z3[1] + dt_s * jy)
            return
        (mx, my), (px, py) = self._model, self._pull
        self._model = (mx + dt_s * (jx + px), my + dt_s * (jy + py))
