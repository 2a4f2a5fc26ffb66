"""Backstepping with the averaged sub-gradient integral sliding mode, (8.2)-(8.22) as corrected.

World frame, SI. Powers and signs are componentwise, delta_i = z_i - z_i* throughout. The symbols
are the thesis's own; equation numbers stand beside them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from hil import control
from hil.config.base import quantity
from hil.control.bounds import disturbance_bound
from hil.control.laws.chain import Chain, ChainState
from hil.control.laws.stages import START_BOX, Stage, StartGains, backstep, begin
from hil.control.laws.trace import make_trace
from hil.core.registries import OUTER_LAWS
from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.core.types import Estimate, ReferenceState, Vec2

# H = sigma sum |delta4_i| as printed (4.10), or H = sigma ||delta4||: its sub-gradient
# delta4/||delta4|| does not depend on the axes of the world, and the lemma's bound holds for it too.
Cost = Annotated[
    Literal["sum", "norm"],
    Field(description="cost H: sum of |delta4_i| (printed), or the norm, alike in all directions"),
]


class AsgIsmGains(StartGains):
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
    cost: Cost = "sum"
    gamma0_m_s3: float = quantity(
        "m/s^3", "F+ of (2.9), which alpha grows by 2 F+ (4.14)", 0.0, ge=0, le=1e4
    )
    gamma1_s3: float = quantity("1/s^3", "F+ per distance of z1 from the goal", 0.0, ge=0, le=1e4)
    gamma2_s2: float = quantity("1/s^2", "F+ per speed of z1", 0.0, ge=0, le=1e4)


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
} | START_BOX


def is_norm(cost: str) -> bool:
    """Say whether the cost H is sigma ||delta4||, and not sigma sum |delta4_i|."""
    return cost == "norm"


def _block(gains: AsgIsmGains) -> control.AsgIsm:
    return control.AsgIsm(
        k=[gains.alpha_m_s3] * 2,
        eps_min=[gains.eps_min_m_s2],
        eps0=gains.eps0_m_s2,
        beta=gains.beta,
        mu0_s=gains.mu0_s,
        sigma=gains.sigma_m_s2,
        radial=is_norm(gains.cost),
    )


@OUTER_LAWS.register(
    "asg-ism",
    settings=AsgIsmGains,
    search=SEARCH,
    sliding=True,
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
        self._block = _block(gains)
        self._anew = False  # the sliding stage starts with the next step

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew: integrals to zero, gamma = -mu0 delta3(0) so that s(0) = 0."""
        begin(self._chain, reference, estimate, self._gains.zeta_start_m_s2)
        self._t = 0.0
        self._anew = False
        self._delta4 = (0.0, 0.0)
        delta3, _ = self._backstep(reference, estimate, self._chain.state(estimate))
        self._block.reset(self._delta4, delta3)

    def retune(self, gains: AsgIsmGains) -> None:
        """Go on with other gains: the sliding stage starts anew from s = 0, delta4 and the chain stay."""
        self._gains = gains
        self._block = _block(gains)
        self._anew = True

    @property
    def delta4_m_s(self) -> Vec2:
        """Return the integral of delta3 (8.13), the argument of the cost H."""
        return self._delta4

    @property
    def gamma_m_s(self) -> Vec2:
        """Return gamma of (8.17)."""
        x, y = self._block.eta
        return x, y

    def _backstep(self, reference: ReferenceState, estimate: Estimate, state: ChainState) -> Stage:
        """Return delta3 and d z3*/dt through the stages (8.6), (8.11) with restrictions."""
        gains = self._gains
        return backstep(
            reference,
            estimate,
            state,
            k1_s=gains.k1_s,
            k2_s=gains.k2_s,
            p=gains.p,
            limits=self._limits,
        )

    def _bound(self, reference: ReferenceState, estimate: Estimate) -> float:
        """Return F+ (2.9); the norm of the position counts from the goal, so that no origin matters."""
        gains = self._gains
        return disturbance_bound(
            (gains.gamma0_m_s3, gains.gamma1_s3, gains.gamma2_s2),
            (estimate.z1_m[0] - reference.z1_m[0], estimate.z1_m[1] - reference.z1_m[1]),
            estimate.z2_m_s,
        )

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the command for the next `dt_s`."""
        gains = self._gains
        state = self._chain.state(estimate)
        (d3x, d3y), (jx, jy) = self._backstep(reference, estimate, state)
        d4x, d4y = self._delta4
        if self._anew:
            self._t, self._anew = 0.0, False
            self._block.reset((d4x, d4y), (d3x, d3y))
        # (8.17), (8.20) corrected, with p = delta4 and q = delta3
        (sx, sy), kappa, psi, _, (eps, _) = self._block.terms(self._t, (d4x, d4y), (d3x, d3y))
        norm = math.hypot(sx, sy)
        pull = (gains.alpha_m_s3 + 2.0 * self._bound(reference, estimate)) / (norm + eps)
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
