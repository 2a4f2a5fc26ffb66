"""What laws on the linearised chain have in common: the start, and the backstepping stages.

World frame, SI. delta_i = z_i - z_i* throughout, powers and signs componentwise.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from hil.config.base import Section, quantity
from hil.control.laws.chain import Chain, ChainState, restrict
from hil.control.laws.trace import make_trace
from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.control.laws.chain import ChainCommand
    from hil.core.types import Estimate, ReferenceState, Vec2

# Below this error the exponents p and p - 1 are continued as at it: |d|^(p-2) has no bound at 0.
_SMALL = 1e-3

# The start is part of every law's search: what a law gains by it alone is no merit of its feedback.
START_BOX = {"zeta_start_m_s2": (0.02, 0.1, 1.0)}
# Trace of a law whose sliding term is not alpha s/(||s|| + eps).
TERM = {
    "slide_x_m_s3": ("m/s^3", "sliding term in the jerk wanted, world X"),
    "slide_y_m_s3": ("m/s^3", "sliding term in the jerk wanted, world Y"),
}


class StartGains(Section):
    """How a law starts; every law has this."""

    zeta_start_m_s2: float | None = quantity(
        "m/s^2", "start of zeta at standstill; absent: that of control.limits", None, ge=0, le=5
    )


class StageGains(StartGains):
    """The first two backstepping stages (8.6), (8.11) at p = 1."""

    k1_s: float = quantity("1/s", "position error to speed", gt=0, le=100)
    k2_s: float = quantity("1/s", "speed error to acceleration", gt=0, le=100)


Own = TypeVar("Own", bound=StageGains)  # the gains of a law made of the first two stages

STAGE_BOX = {"k1_s": (0.2, 1.0, 5.0), "k2_s": (0.5, 2.0, 20.0)}


class Stage(NamedTuple):
    """Delta3 and d z3*/dt: what is left for the last stage."""

    delta3: Vec2
    z3_dot: Vec2


class Wish(NamedTuple):
    """The jerk that a law wants (world), and the terms of its trace."""

    jerk: Vec2
    terms: dict[str, float]


def begin(
    chain: Chain, reference: ReferenceState, estimate: Estimate, zeta_start_m_s2: float | None
) -> None:
    """Start the chain towards the reference: the first tick is the same for every law."""
    z1, z1_ref = estimate.z1_m, reference.z1_m
    chain.reset(estimate, (z1_ref[0] - z1[0], z1_ref[1] - z1[1]), zeta_start_m_s2)


def power(d: float, d_dot: float, d_ddot: float, k: float, p: float) -> tuple[float, float, float]:
    """Return k |d|^p sgn(d) and its first two time derivatives."""
    if p == 1.0:
        return k * d, k * d_dot, k * d_ddot
    size = max(abs(d), _SMALL)
    slope = k * p * size ** (p - 1.0)
    bend = slope * (p - 1.0) / size * math.copysign(1.0, d) if abs(d) > _SMALL else 0.0
    value = k * abs(d) ** p
    return math.copysign(value, d), slope * d_dot, bend * d_dot * d_dot + slope * d_ddot


def backstep(
    reference: ReferenceState,
    estimate: Estimate,
    state: ChainState,
    *,
    k1_s: float,
    k2_s: float,
    limits: OuterLimits,
    p: float = 1.0,
) -> Stage:
    """Return delta3 and d z3*/dt through the stages (8.6), (8.11) with restrictions."""
    (x, y), (x_ref, y_ref) = estimate.z1_m, reference.z1_m
    (vx, vy), (vx_ref, vy_ref) = state.z2, reference.z1_dot_m_s
    (ax, ay), (ax_ref, ay_ref) = state.z3, reference.z1_ddot_m_s2
    px, px_dot, px_ddot = power(x - x_ref, vx - vx_ref, ax - ax_ref, k1_s, p)
    py, py_dot, py_ddot = power(y - y_ref, vy - vy_ref, ay - ay_ref, k1_s, p)
    g, g_dot, g_ddot = restrict(
        (px, py), (px_dot, py_dot), (px_ddot, py_ddot), limits.approach_speed_m_s
    )
    # z2* = z1*_dot - g, so delta2 = z2 - z1*_dot + g (8.9) and z3* = z2*_dot - r (8.11)
    qx, qx_dot, _ = power(vx - vx_ref + g[0], ax - ax_ref + g_dot[0], 0.0, k2_s, p)
    qy, qy_dot, _ = power(vy - vy_ref + g[1], ay - ay_ref + g_dot[1], 0.0, k2_s, p)
    r, r_dot, _ = restrict((qx, qy), (qx_dot, qy_dot), (0.0, 0.0), limits.approach_accel_m_s2)
    jx_ref, jy_ref = reference.z1_dddot_m_s3
    delta3 = (ax - ax_ref + g_dot[0] + r[0], ay - ay_ref + g_dot[1] + r[1])
    return Stage(delta3, (jx_ref - g_ddot[0] - r_dot[0], jy_ref - g_ddot[1] - r_dot[1]))


class StagedLaw(Generic[Own]):
    """A law whose last stage alone is its own: `_wish`, `_advance`, and `_begin` where it keeps something.

    The chain, its restrictions and the start are those of every law.
    """

    def __init__(self, gains: Own, limits: OuterLimits, d0_m: float) -> None:
        self._gains = gains
        self._limits = limits
        self._d0 = d0_m
        self._chain = Chain(limits)
        self._begin((0.0, 0.0), self._zero())

    @staticmethod
    def _zero() -> ChainState:
        return ChainState((0.0, 0.0), (0.0, 0.0), 1.0, 0.0, 0.0, 0.0)

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew."""
        begin(self._chain, reference, estimate, self._gains.zeta_start_m_s2)
        state = self._chain.state(estimate)
        self._begin(self._stage(reference, estimate, state).delta3, state)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the command for the next `dt_s`."""
        state = self._chain.state(estimate)
        wish = self._wish(self._stage(reference, estimate, state), state, dt_s)
        out = self._chain.command(wish.jerk, state, dt_s)
        self._advance(state, out, dt_s)
        return OuterCommand(out.eta1, out.w, make_trace(state, out, self._d0) | wish.terms)

    def retune(self, gains: Own) -> None:
        """Go on with other gains; whatever is integrated stays."""
        self._gains = gains
        self._retuned()

    def _retuned(self) -> None:
        """Work out anew what was made of the gains."""

    def _stage(self, reference: ReferenceState, estimate: Estimate, state: ChainState) -> Stage:
        gains = self._gains
        return backstep(
            reference, estimate, state, k1_s=gains.k1_s, k2_s=gains.k2_s, limits=self._limits
        )

    def _begin(self, delta3: Vec2, state: ChainState) -> None:
        """Forget what the last stage keeps."""

    def _wish(self, stage: Stage, state: ChainState, dt_s: float) -> Wish:
        """Return the jerk wanted."""
        raise NotImplementedError

    def _advance(self, state: ChainState, out: ChainCommand, dt_s: float) -> None:
        """Move on what the last stage keeps, knowing what the limits left of its wish."""


def projected(vector: Vec2, radius: float) -> Vec2:
    """Return the point of the ball of that radius that is nearest to the vector."""
    length = math.hypot(*vector)
    if length <= radius:
        return vector
    share = radius / length
    return share * vector[0], share * vector[1]


def sliding_terms(s: Vec2, eps: float, term: Vec2) -> dict[str, float]:
    """Return what a sliding law adds to its trace: s, its layer, and the term in the jerk."""
    return {
        "s_x": s[0],
        "s_y": s[1],
        "eps": eps,
        "in_layer": float(math.hypot(*s) <= eps) if math.isfinite(eps) else math.nan,
        "slide_x_m_s3": term[0],
        "slide_y_m_s3": term[1],
    }
