"""PD on the linearised chain with a disturbance observer in place of the integral.

What a practitioner would try: an extended state observer of speed, acceleration and disturbance,

    z2' = z3,   z3' = A + B v + d,   d' = 0,      from the estimated z2

whose d is taken off the jerk that PD wants, and whose z3 is the one PD stands on, since it holds what
disturbs the acceleration. All its poles at -w: in discrete form (a current estimator) with q = exp(-w h)
the gains are 1 - q^3, 1.5 (1 - q)^2 (1 + q)/h and (1 - q)^3/h^2.

Han, "From PID to active disturbance rejection control", IEEE TIE 56 (2009); Miklosovic, Radke and Gao,
"Discrete implementation and generalization of the extended state observer", ACC 2006. A + B v is what
the limits left of the wish, so that the observer does not take a limit for a disturbance.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.config.base import quantity
from hil.control.laws.chain import Chain, executed_jerk
from hil.control.laws.stages import START_BOX, StartGains, begin
from hil.control.laws.state_feedback import nested_jerk
from hil.control.laws.trace import make_trace
from hil.core.registries import OUTER_LAWS
from hil.core.types import OuterCommand

if TYPE_CHECKING:
    from hil.config.control import OuterLimits
    from hil.core.types import Estimate, ReferenceState


class DobPidGains(StartGains):
    """Gains of PD with a disturbance observer."""

    kp_s3: float = quantity("1/s^3", "on delta1", gt=0, le=1e6)
    kd1_s2: float = quantity("1/s^2", "on d delta1/dt", gt=0, le=1e6)
    kd2_s: float = quantity("1/s", "on d2 delta1/dt2", gt=0, le=1e4)
    observer_s: float = quantity("1/s", "w: all three poles of the observer", gt=0, le=200)


@OUTER_LAWS.register(
    "dob-pid",
    settings=DobPidGains,
    search={
        "kp_s3": (0.3, 6.0, 200.0),
        "kd1_s2": (1.0, 11.0, 200.0),
        "kd2_s": (1.0, 6.0, 40.0),
        "observer_s": (0.3, 3.0, 30.0),
    }
    | START_BOX,
    summary="state feedback with a disturbance observer in place of the integral",
    colour="#117733",
    trace={
        "disturbance_x_m_s3": ("m/s^3", "disturbance observed, world X"),
        "disturbance_y_m_s3": ("m/s^3", "disturbance observed, world Y"),
    },
)
class DobPid:
    """The law; one instance runs one robot."""

    def __init__(self, gains: DobPidGains, limits: OuterLimits, d0_m: float) -> None:
        self._gains = gains
        self._limits = limits
        self._d0 = d0_m
        self._chain = Chain(limits)
        self._axes = (Observer(gains.observer_s), Observer(gains.observer_s))

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew: no disturbance, acceleration from the start of zeta."""
        begin(self._chain, reference, estimate, self._gains.zeta_start_m_s2)
        state = self._chain.state(estimate)
        for axis, speed, accel in zip(self._axes, state.z2, state.z3, strict=True):
            axis.reset(speed, accel)

    def retune(self, gains: DobPidGains) -> None:
        """Go on with other gains; what was observed stays."""
        self._gains = gains
        for axis in self._axes:
            axis.rate_s = gains.observer_s

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the command for the next `dt_s`."""
        gains = self._gains
        state = self._chain.state(estimate)
        for axis, speed in zip(self._axes, state.z2, strict=True):
            axis.see(speed, dt_s)
        first, second = self._axes
        seen = state._replace(z3=(first.accel, second.accel))
        (jx, jy), _ = nested_jerk(
            reference, estimate, seen, gains=gains, ki_s4=0.0, integral=(0.0, 0.0),
            limits=self._limits,
        )  # fmt: skip
        out = self._chain.command((jx - first.disturbance, jy - second.disturbance), seen, dt_s)
        for axis, jerk in zip(
            self._axes, executed_jerk(seen, out, self._chain.zeta, dt_s), strict=True
        ):
            axis.move(jerk, dt_s)
        observed = {
            "disturbance_x_m_s3": first.disturbance,
            "disturbance_y_m_s3": second.disturbance,
        }
        return OuterCommand(out.eta1, out.w, make_trace(seen, out, self._d0) | observed)


class Observer:
    """Speed, acceleration and disturbance of one world axis."""

    def __init__(self, rate_s: float) -> None:
        self.rate_s = rate_s
        self.reset(0.0, 0.0)

    def reset(self, speed: float, accel: float) -> None:
        """Start from what is known, without disturbance."""
        self._speed, self.accel, self.disturbance = speed, accel, 0.0

    def see(self, speed: float, dt_s: float) -> None:
        """Take the speed measured at this tick."""
        q = math.exp(-self.rate_s * dt_s)
        miss, off = speed - self._speed, 1.0 - q
        self._speed += (1.0 - q * q * q) * miss
        self.accel += 1.5 * off * off * (1.0 + q) / dt_s * miss
        self.disturbance += off * off * off / (dt_s * dt_s) * miss

    def move(self, jerk: float, dt_s: float) -> None:
        """Move on by a tick under the jerk commanded."""
        rate = jerk + self.disturbance
        self._speed += dt_s * (self.accel + 0.5 * dt_s * rate)
        self.accel += dt_s * rate
