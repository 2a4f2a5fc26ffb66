"""ASG-ISM with the sliding term discretised implicitly: no layer, no chatter, exact without disturbance.

The sign law is ds/dt = u_s + d, u_s in -alpha Sgn(s). Over a tick h with the rest cancelled exactly,

    s+ = s + h u_s + h d,    u_s in -alpha Sgn(s + h u_s)    (the sign at the end of the undisturbed tick)

which has one solution, by the proximal map of alpha h ||.||:  u_s = -P(s)/h with P the projection on the
ball of radius alpha h. So s+ = s - P(s) + h d: from ||s(0)|| the surface is reached in
ceil(||s||/(alpha h)) ticks, s = 0 is a fixed point, and from there on u_s is minus the disturbance of the
tick before and ||s|| <= h D for any D < alpha (tests/laws/test_implicit.py). Acary, Brogliato and Orlov,
"Chattering-free digital sliding-mode control with state observer and disturbance rejection", IEEE TAC 57
(2012); Huber, Acary and Brogliato, "Lyapunov stability and performance analysis of the implicit
discretization of sliding mode control", IEEE TAC 61 (2016).

"Cancelled exactly" is kappa in differences, so that what mu, delta4 and the averaged sub-gradient do to s
within the tick is met as it will be: kappa h = mu+ (delta4+ + gamma + I+) - mu (delta4 + gamma + I), with
delta4+ = delta4 + h delta3, I+ = I + h dH, mu+ at the end of the tick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil import control
from hil.config.base import quantity
from hil.control.laws.asg_ism import Cost, is_norm
from hil.control.laws.stages import (
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


class AsgIsmImplicitGains(StageGains):
    """Gains of ASG-ISM with the implicit step; there is no layer to choose."""

    alpha_m_s3: float = quantity("m/s^3", "gain of the sliding term", ge=0, le=1e4)
    mu0_s: float = quantity("s", "mu = 1/(t + mu0)", gt=0, le=100)
    sigma_m_s2: float = quantity("m/s^2", "scale of the cost H in Psi", ge=0, le=100)
    cost: Cost = "norm"


@OUTER_LAWS.register(
    "asg-ism-implicit",
    settings=AsgIsmImplicitGains,
    search={
        "k1_s": (0.2, 1.0, 5.0),
        "k2_s": (0.5, 3.0, 20.0),
        "alpha_m_s3": (0.01, 1.0, 30.0),
        "mu0_s": (0.2, 1.0, 30.0),
        "sigma_m_s2": (1e-3, 0.01, 1.0),
    }
    | START_BOX,
    sliding=True,
    summary="ASG-ISM with an implicit (proximal) sliding term: no layer",
    colour="#882255",
    trace=TERM,
)
class AsgIsmImplicit(StagedLaw[AsgIsmImplicitGains]):
    """The law; one instance runs one robot."""

    def _begin(self, delta3: Vec2, state: ChainState) -> None:  # noqa: ARG002 - of all laws
        self._delta4 = (0.0, 0.0)
        self._start(delta3)

    def _start(self, delta3: Vec2) -> None:
        """Start the sliding stage from s = 0."""
        gains = self._gains
        self._block = control.AsgIsm(
            k=[gains.alpha_m_s3] * 2,
            eps_min=[1.0],  # of no account: the layer's term is not taken from the block
            mu0_s=gains.mu0_s,
            sigma=gains.sigma_m_s2,
            radial=is_norm(gains.cost),
        )
        self._t, self._anew = 0.0, False
        self._delta3 = delta3
        self._block.reset(self._delta4, delta3)

    def _retuned(self) -> None:
        self._anew = True

    def _wish(self, stage: Stage, state: ChainState, dt_s: float) -> Wish:  # noqa: ARG002 - of all laws
        gains = self._gains
        if self._anew:
            self._start(stage.delta3)
        self._delta3 = stage.delta3
        s, _, psi, dh, _ = self._block.terms(self._t, self._delta4, stage.delta3)
        mu, mu_next = 1.0 / (self._t + gains.mu0_s), 1.0 / (self._t + dt_s + gains.mu0_s)
        radius = gains.alpha_m_s3 * dt_s
        inside = projected((s[0], s[1]), radius)
        term = (-inside[0] / dt_s, -inside[1] / dt_s)
        pulled = [s[i] - stage.delta3[i] for i in range(2)]  # mu (delta4 + gamma + I)
        kappa = [
            (mu_next * (pulled[i] / mu + dt_s * (stage.delta3[i] + dh[i])) - pulled[i]) / dt_s
            for i in range(2)
        ]
        jerk = tuple(stage.z3_dot[i] - kappa[i] + term[i] for i in range(2))
        terms = sliding_terms((s[0], s[1]), radius, term) | {"psi_x": psi[0], "psi_y": psi[1]}
        return Wish((jerk[0], jerk[1]), terms)

    def _advance(self, state: ChainState, out: ChainCommand, dt_s: float) -> None:  # noqa: ARG002 - of all laws
        self._t += dt_s
        if not out.saturated:
            (x, y), (dx, dy) = self._delta4, self._delta3
            self._delta4 = (x + dx * dt_s, y + dy * dt_s)
            self._block.advance(dt_s)
