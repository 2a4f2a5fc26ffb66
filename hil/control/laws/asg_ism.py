"""Backstepping with the averaged sub-gradient integral sliding mode, (8.2)-(8.22) as corrected.

World frame, SI. Powers and signs are componentwise, delta_i = z_i - z_i* throughout. The symbols
are the thesis's own; equation numbers stand beside them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil import control
from hil.config.base import Section, quantity
from hil.control.laws.chain import Chain, ChainState, restrict
from hil.control.laws.trace import make_trace
from hil.core.registries import OUTER_LAWS
from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.core.types import Estimate, ReferenceState, Vec2

# Below this error the exponents p and p - 1 are continued as at it: |d|^(p-2) has no bound at 0.
_SMALL = 1e-3


class AsgIsmGains(Section):
    """Gains of backstepping with ASG-ISM (8.6)-(8.22), docs/control.md."""

    k1_s: float = quantity("1/s", "at p = 1, position error to speed", gt=0, le=100)
    k2_s: float = quantity("1/s", "at p = 1, speed error to acceleration", gt=0, le=100)
    p: float = quantity("", "exponent 1 + epsilon of (8.6), (8.11)", 1.0, ge=1, le=3)
    alpha_m_s3: float = quantity("m/s^3", "gain of the sliding term", ge=0, le=1e4)
    eps0_m_s2: float = quantity("m/s^2", "layer eps0/(t+mu0)^(1+beta)", 0.0, ge=0, le=100)
    beta: float = quantity("", "rate at which the layer shrinks, (4.20)", 0.5, gt=0, lt=1)
    eps_min_m_s2: float = quantity("m/s^2", "floor of the layer", gt=0, le=100)
    mu0_s: float = quantity("s", "mu = 1/(t + mu0)", gt=0, le=100)
    sigma_m_s2: float = quantity("m/s^2", "scale of the cost H in Psi", ge=0, le=100)


# Bounds and start of a search: poles at -1, -2, -3 to begin with, as for every law (inside its layer
# the sliding stage has the pole -alpha/eps).
SEARCH = {
    "k1_s": (0.2, 1.0, 5.0),
    "k2_s": (0.5, 3.0, 20.0),
    "alpha_m_s3": (0.01, 1.0, 30.0),
    "eps0_m_s2": (1e-3, 0.5, 5.0),
    "eps_min_m_s2": (0.01, 0.5, 5.0),
    "mu0_s": (0.2, 1.0, 30.0),
    "sigma_m_s2": (1e-3, 0.01, 1.0),
}


def power(d: float, d_dot: float, d_ddot: float, k: float, p: float) -> tuple[float, float, float]:
    """Return k |d|^p sgn(d) and its first two time derivatives."""
    if p == 1.0:
        return k * d, k * d_dot, k * d_ddot
    size = max(abs(d), _SMALL)
    slope = k * p * size ** (p - 1.0)
    bend = slope * (p - 1.0) / size * math.copysign(1.0, d) if abs(d) > _SMALL else 0.0
    value = k * abs(d) ** p
    return math.copysign(value, d), slope * d_dot, bend * d_dot * d_dot + slope * d_ddot


@OUTER_LAWS.register(
    "asg-ism",
    settings=AsgIsmGains,
    search=SEARCH,
    summary="backstepping with an averaged sub-gradient integral sliding mode",
    colour="#d55e00",
)
class AsgIsm:
    """The proposed outer law; one instance runs one robot."""

    def __init__(self, gains: AsgIsmGains, limits: OuterLimits, d0_m: float) -> None:
        self._gains = gains
        self._limits = limits
        self._d0 = d0_m
        self._chain = Chain(limits)
        self._t = 0.0
        self._delta4 = (0.0, 0.0)
        self._block = control.AsgIsm(
            k=[gains.alpha_m_s3] * 2,
            eps_min=[gains.eps_min_m_s2],
            eps0=gains.eps0_m_s2,
            beta=gains.beta,
            mu0_s=gains.mu0_s,
            sigma=gains.sigma_m_s2,
        )

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew: integrals to zero, gamma = -mu0 delta3(0) so that s(0) = 0."""
        z1, z1_ref = estimate.z1_m, reference.z1_m
        self._chain.reset(estimate, (z1_ref[0] - z1[0], z1_ref[1] - z1[1]))
        self._t = 0.0
        self._delta4 = (0.0, 0.0)
        delta3, _ = self._backstep(reference, estimate, self._chain.state(estimate))
        self._block.reset(self._delta4, delta3)

    @property
    def delta4_m_s(self) -> Vec2:
        """Return the integral of delta3 (8.13), the argument of the cost H."""
        return self._delta4

    @property
    def gamma_m_s(self) -> Vec2:
        """Return gamma of (8.17)."""
        x, y = self._block.eta
        return x, y

    def _backstep(
        self, reference: ReferenceState, estimate: Estimate, state: ChainState
    ) -> tuple[Vec2, Vec2]:
        """Return delta3 and d z3*/dt through the stages (8.6), (8.11) with restrictions."""
        gains, limits = self._gains, self._limits
        (x, y), (x_ref, y_ref) = estimate.z1_m, reference.z1_m
        (vx, vy), (vx_ref, vy_ref) = state.z2, reference.z1_dot_m_s
        (ax, ay), (ax_ref, ay_ref) = state.z3, reference.z1_ddot_m_s2
        px, px_dot, px_ddot = power(x - x_ref, vx - vx_ref, ax - ax_ref, gains.k1_s, gains.p)
        py, py_dot, py_ddot = power(y - y_ref, vy - vy_ref, ay - ay_ref, gains.k1_s, gains.p)
        g, g_dot, g_ddot = restrict(
            (px, py), (px_dot, py_dot), (px_ddot, py_ddot), limits.approach_speed_m_s
        )
        # z2* = z1*_dot - g, so delta2 = z2 - z1*_dot + g (8.9) and z3* = z2*_dot - r (8.11)
        qx, qx_dot, _ = power(vx - vx_ref + g[0], ax - ax_ref + g_dot[0], 0.0, gains.k2_s, gains.p)
        qy, qy_dot, _ = power(vy - vy_ref + g[1], ay - ay_ref + g_dot[1], 0.0, gains.k2_s, gains.p)
        r, r_dot, _ = restrict((qx, qy), (qx_dot, qy_dot), (0.0, 0.0), limits.approach_accel_m_s2)
        jx_ref, jy_ref = reference.z1_dddot_m_s3
        delta3 = (ax - ax_ref + g_dot[0] + r[0], ay - ay_ref + g_dot[1] + r[1])
        return delta3, (jx_ref - g_ddot[0] - r_dot[0], jy_ref - g_ddot[1] - r_dot[1])

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the command for the next `dt_s`."""
        gains = self._gains
        state = self._chain.state(estimate)
        (d3x, d3y), (jx, jy) = self._backstep(reference, estimate, state)
        d4x, d4y = self._delta4
        # (8.17), (8.20) corrected, with p = delta4 and q = delta3
        (sx, sy), kappa, psi, _, (eps, _) = self._block.terms(self._t, (d4x, d4y), (d3x, d3y))
        norm = math.hypot(sx, sy)
        pull = gains.alpha_m_s3 / (norm + eps)
        out = self._chain.command(
            (jx - kappa[0] - pull * sx, jy - kappa[1] - pull * sy), state, dt_s
        )  # (8.22) corrected: static, v = B^-1 [...]
        self._t += dt_s
        if not out.saturated:
            self._delta4 = (d4x + d3x * dt_s, d4y + d3y * dt_s)  # (8.13)
            self._block.advance(dt_s)
        trace = make_trace(
            state, out, self._d0, s=(sx, sy), psi=(psi[0], psi[1]), eps=eps, in_layer=norm <= eps
        )
        return OuterCommand(out.eta1, out.w, trace)
