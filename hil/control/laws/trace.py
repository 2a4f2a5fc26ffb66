"""The internal terms of a law that are worth plotting, under the names of the run record."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.control.laws.chain import ChainCommand, ChainState
    from hil.core.types import Vec2

_NONE = (math.nan, math.nan)


def make_trace(
    state: ChainState,
    out: ChainCommand,
    d0_m: float,
    *,
    s: Vec2 = _NONE,
    psi: Vec2 = _NONE,
    eps: float = math.nan,
    in_layer: float = math.nan,
) -> dict[str, float]:
    """Return the trace of one step; terms that the law does not have are NaN.

    zeta is its value at the tick (the one z3 was formed from) and v1 its rate from there on;
    u2 = d eta2/dt = -d0 w_dot. Flags are 0 or 1. All in world axes, SI.
    """
    return {
        "z2_x_m_s": state.z2[0],
        "z2_y_m_s": state.z2[1],
        "z3_x_m_s2": state.z3[0],
        "z3_y_m_s2": state.z3[1],
        "s_x": s[0],
        "s_y": s[1],
        "psi_x": psi[0],
        "psi_y": psi[1],
        "zeta_m_s2": out.zeta,
        "v1_m_s3": out.v1,
        "u2_m_s2": -d0_m * out.w_dot,
        "eps": eps,
        "in_layer": float(in_layer),
        "saturated": 1.0 if out.saturated else 0.0,
    }
