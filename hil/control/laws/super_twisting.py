"""Super-twisting control: a continuous last stage that needs no layer.

    s = delta3,   jerk = d z3*/dt - l1 sqrt(L) s/||s||^(1/2) + w,   dw/dt = -l0 L s/||s||

Levant, "Sliding order and sliding accuracy in sliding mode control" (1993); in two dimensions the unit
vector form of Nagesh and Edwards, "A multivariable super-twisting sliding mode approach", Automatica 50
(2014), which no turn of the axes changes. L bounds the rate of the disturbance; l1 = 1.5 and l0 = 1.1 are
Levant's, and do not meet (6.15): they work and its proof does not cover them (docs/outer-laws.md).

The step is implicit (Brogliato, Polyakov and Efimov, "The implicit discretization of the super-twisting
sliding-mode control algorithm", IEEE TAC 65, 2020): with b = s + h w the next s+ obeys

    s+ + h l1 sqrt(L) s+/||s+||^(1/2) + h^2 l0 L Sgn(s+) = b

whose length has one root: s+ = 0 where ||b|| <= h^2 l0 L, and along b else. Nothing switches; under a
disturbance d the surface is kept to h d.
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
    from hil.control.laws.chain import ChainCommand, ChainState
    from hil.core.types import Vec2


class SuperTwistingGains(StageGains):
    """Gains of super-twisting control."""

    bound_m_s4: float = quantity("m/s^4", "L: bound of the disturbance's rate", gt=0, le=1e4)
    l1: float = quantity("", "on sqrt(L) ||s||^(1/2)", 1.5, gt=0, le=100, source="Levant 1993")
    l0: float = quantity("", "on L, integrated", 1.1, gt=0, le=100, source="Levant 1993")


@OUTER_LAWS.register(
    "super-twisting",
    settings=SuperTwistingGains,
    search=STAGE_BOX | {"bound_m_s4": (0.1, 5.0, 300.0)} | START_BOX,
    sliding=True,
    summary="super-twisting: a continuous sliding mode of second order, implicit step",
    colour="#56b4e9",
    trace=TERM,
)
class SuperTwisting(StagedLaw[SuperTwistingGains]):
    """The law; one instance runs one robot."""

    def _begin(self, delta3: Vec2, state: ChainState) -> None:  # noqa: ARG002 - of all laws
        self._w = self._w_next = (0.0, 0.0)

    def _wish(self, stage: Stage, state: ChainState, dt_s: float) -> Wish:  # noqa: ARG002 - of all laws
        gains, (jx, jy) = self._gains, stage.z3_dot
        u, self._w_next = twisted(
            stage.delta3, self._w, dt_s, bound=gains.bound_m_s4, l1=gains.l1, l0=gains.l0
        )
        return Wish((jx + u[0], jy + u[1]), sliding_terms(stage.delta3, math.nan, u))

    def _advance(self, state: ChainState, out: ChainCommand, dt_s: float) -> None:  # noqa: ARG002 - of all laws
        if not out.saturated:
            self._w = self._w_next


def twisted(
    s: Vec2, w: Vec2, dt_s: float, *, bound: float, l1: float, l0: float
) -> tuple[Vec2, Vec2]:
    """Return (u, w at the end of the step) of the implicit super-twisting step; s+ = s + h u."""
    b = (s[0] + dt_s * w[0], s[1] + dt_s * w[1])
    length, hold = math.hypot(*b), dt_s * dt_s * l0 * bound
    if length <= hold:
        u = (-s[0] / dt_s, -s[1] / dt_s)
        return u, u
    e = (b[0] / length, b[1] / length)
    half = 0.5 * dt_s * l1 * math.sqrt(bound)
    root = math.sqrt(half * half + length - hold) - half  # of ||s+||
    moved = (w[0] - dt_s * l0 * bound * e[0], w[1] - dt_s * l0 * bound * e[1])
    pull = l1 * math.sqrt(bound) * root
    return (moved[0] - pull * e[0], moved[1] - pull * e[1]), moved
