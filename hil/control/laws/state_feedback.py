"""The benchmark: state feedback in PID form on the same linearised chain (docs/control.md section 1).

    jerk = z1*_dddot - K_i int delta1 - K_p delta1 - K_d1 delta1_dot - K_d2 delta1_ddot

Written as nested stages so that the restrictions on approach speed and acceleration act on it
exactly as on the backstepping law; with the restrictions off it is the line above.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hil.config.base import quantity
from hil.control.laws.chain import Chain, authority, restrict
from hil.control.laws.stages import START_BOX, StartGains, begin
from hil.control.laws.trace import make_trace
from hil.core.registries import OUTER_LAWS
from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.control.laws.chain import ChainState
    from hil.core.types import Estimate, ReferenceState, Vec2

_ZERO = (0.0, 0.0)


class PidGains(StartGains):
    """Gains of the state feedback in PID form on the linearised chain (docs/control.md)."""

    kp_s3: float = quantity("1/s^3", "on delta1", gt=0, le=1e6)
    ki_s4: float = quantity("1/s^4", "on the integral of delta1", 0.0, ge=0, le=1e6)
    kd1_s2: float = quantity("1/s^2", "on d delta1/dt", gt=0, le=1e6)
    kd2_s: float = quantity("1/s", "on d2 delta1/dt2", gt=0, le=1e4)


# Bounds and start of a search: poles at -1, -2, -3 to begin with, as for every law.
SEARCH = {
    "kp_s3": (0.3, 6.0, 200.0),
    "ki_s4": (1e-4, 0.01, 20.0),
    "kd1_s2": (1.0, 11.0, 200.0),
    "kd2_s": (1.0, 6.0, 40.0),
} | START_BOX


@OUTER_LAWS.register(
    "pid",
    settings=PidGains,
    search=SEARCH,
    summary="state feedback in PID form on the linearised chain",
    colour="#0072b2",
)
class StateFeedback:
    """The PID law; one instance runs one robot."""

    def __init__(self, gains: PidGains, limits: OuterLimits, d0_m: float) -> None:
        self._gains = gains
        self._limits = limits
        self._d0 = d0_m
        self._chain = Chain(limits)
        self._integral = _ZERO

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew: integral to zero, zeta to its start."""
        begin(self._chain, reference, estimate, self._gains.zeta_start_m_s2)
        self._integral = _ZERO

    def retune(self, gains: PidGains) -> None:
        """Go on with other gains; what the integral commands stays (with a gain of 0 it starts anew)."""
        share = self._gains.ki_s4 / gains.ki_s4 if gains.ki_s4 else 0.0
        self._integral = (self._integral[0] * share, self._integral[1] * share)
        self._gains = gains

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the command for the next `dt_s`."""
        gains, limits = self._gains, self._limits
        state = self._chain.state(estimate)
        jerk, position = nested_jerk(
            reference, estimate, state, gains=gains, ki_s4=gains.ki_s4, integral=self._integral,
            limits=limits,
        )  # fmt: skip
        out = self._chain.command(jerk, state, dt_s)
        if not out.saturated:
            (x, y), (x_ref, y_ref), (ix, iy) = estimate.z1_m, reference.z1_m, self._integral
            grow = dt_s * authority(position, limits.approach_speed_m_s)
            self._integral = (ix + (x - x_ref) * grow, iy + (y - y_ref) * grow)
        return OuterCommand(out.eta1, out.w, make_trace(state, out, self._d0))


class FeedbackGains(Protocol):
    """The gains on delta1 and its first two derivatives."""

    @property
    def kp_s3(self) -> float:
        """On delta1."""

    @property
    def kd1_s2(self) -> float:
        """On its rate."""

    @property
    def kd2_s(self) -> float:
        """On its second derivative."""


def nested_jerk(
    reference: ReferenceState,
    estimate: Estimate,
    state: ChainState,
    *,
    gains: FeedbackGains,
    ki_s4: float,
    integral: Vec2,
    limits: OuterLimits,
) -> tuple[Vec2, Vec2]:
    """Return the jerk of the nested stages, and what the position error asks for before its restriction."""
    (x, y), (x_ref, y_ref) = estimate.z1_m, reference.z1_m
    (vx, vy), (vx_ref, vy_ref) = state.z2, reference.z1_dot_m_s
    (ax, ay), (ax_ref, ay_ref) = state.z3, reference.z1_ddot_m_s2
    d1x, d1y = x - x_ref, y - y_ref
    ix, iy = integral
    kd1, kd2 = gains.kd1_s2, gains.kd2_s
    position = ((gains.kp_s3 * d1x + ki_s4 * ix) / kd1, (gains.kp_s3 * d1y + ki_s4 * iy) / kd1)
    g, _, _ = restrict(position, _ZERO, _ZERO, limits.approach_speed_m_s)
    ratio = kd1 / kd2
    velocity = (ratio * (vx - vx_ref + g[0]), ratio * (vy - vy_ref + g[1]))
    r, _, _ = restrict(velocity, _ZERO, _ZERO, limits.approach_accel_m_s2)
    jx_ref, jy_ref = reference.z1_dddot_m_s3
    jerk = (jx_ref - kd2 * (ax - ax_ref + r[0]), jy_ref - kd2 * (ay - ay_ref + r[1]))
    return jerk, position
