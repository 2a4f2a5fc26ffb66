"""The default estimator with an observed acceleration, so that z3 holds what disturbs the robot.

Without it a law forms z3 from its own zeta, which no disturbance enters: the invariance that integral sliding
modes are for ends at stage 3. A difference of the estimated speed, low-passed, has the acceleration but late.
Here the wheel loop is a model, with its input and the disturbance as states,

    dv/dt = (u - v)/tau + d,    dd/dt = 0

with u the forward speed commanded and in effect, tau `wheel_lag_s`, v the estimated speed at each wheel
report (across the heading z3 is eta1 theta_dot, both estimated). The acceleration (u - v)/tau + d follows
a command at once; what is late is the disturbance alone, found by an observer whose two poles lie at -w.
docs/outer-laws.md has noise and lag as measured. World frame, SI.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

from hil.config.base import Section, quantity
from hil.control.estimators.fused import Fused
from hil.core.registries import ESTIMATORS

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig
    from hil.control.estimators.geometry import BelievedGeometry
    from hil.core.types import Estimate, WheelSample


class ObservedSettings(Section):
    """How fast the disturbance is found."""

    observer_s: float = quantity(
        "1/s", "both poles of the observer of the disturbance", 15.0, gt=0, le=200
    )


class LagObserver:
    """The disturbance of one first-order loop; a current estimator with both poles at exp(-w h)."""

    def __init__(self, tau_s: float, rate_s: float) -> None:
        self._tau_s, self._rate_s = tau_s, rate_s
        self._speed = math.nan
        self.disturbance = 0.0

    def see(self, speed: float, command: float, dt_s: float) -> None:
        """Take the speed seen now, and the command that was in effect for `dt_s` before."""
        if math.isnan(self._speed) or dt_s <= 0.0:
            self._speed = speed
            return
        # over the step v moves to its target u + tau d by the share 1 - a
        stay = math.exp(-dt_s / self._tau_s)
        q = math.exp(-self._rate_s * dt_s)
        target = command + self._tau_s * self.disturbance
        miss = speed - (target + stay * (self._speed - target))
        self._speed = speed - (q * q / stay) * miss
        self.disturbance += (1.0 - q) ** 2 / (self._tau_s * (1.0 - stay)) * miss

    def rate(self, speed: float, command: float) -> float:
        """Return the rate of the speed under a command."""
        return (command - speed) / self._tau_s + self.disturbance


@ESTIMATORS.register(
    "observed-acceleration",
    settings=ObservedSettings,
    summary="as fused, with an acceleration observed by a model of the wheel loop (z3)",
)
class ObservedAcceleration(Fused):
    """Adds z3 to the estimate of `fused`."""

    def __init__(
        self, config: EstimatorConfig, geometry: BelievedGeometry, settings: ObservedSettings
    ) -> None:
        super().__init__(config, geometry)
        self._loop = LagObserver(config.wheel_lag_s, settings.observer_s)
        self._commands: deque[tuple[float, float]] = deque([(-math.inf, 0.0)])
        self._t_s = math.nan

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds commanded to be in effect from `t_effect_s` on."""
        super().on_command(t_effect_s, eta1_m_s, theta_dot_rad_s)
        self._commands.append((t_effect_s, eta1_m_s))

    def on_wheels(self, sample: WheelSample) -> None:
        """Take one wheel report; the observer moves on to it."""
        super().on_wheels(sample)
        now_s = sample.t_host_s
        estimate = super().estimate_at(now_s)
        if estimate is None:
            return
        dt_s = 0.0 if math.isnan(self._t_s) else now_s - self._t_s
        if dt_s < 0.0:
            return
        self._loop.see(estimate.eta1_m_s, self._command_at(now_s - 0.5 * dt_s), dt_s)
        self._t_s = now_s
        while len(self._commands) > 1 and self._commands[1][0] <= now_s - dt_s:
            self._commands.popleft()

    def _command_at(self, t_s: float) -> float:
        """Return the forward speed commanded that is in effect at a time."""
        return next((speed for since_s, speed in reversed(self._commands) if since_s <= t_s), 0.0)

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state at `t_host_s` with z3 = e d eta1/dt + n eta1 theta_dot."""
        estimate = super().estimate_at(t_host_s)
        if estimate is None:
            return None
        accel = self._loop.rate(estimate.eta1_m_s, self._command_at(t_host_s))
        across = estimate.eta1_m_s * estimate.theta_dot_rad_s
        c, s = math.cos(estimate.pose.theta_rad), math.sin(estimate.pose.theta_rad)
        return replace(estimate, z3_m_s2=(c * accel - s * across, s * accel + c * across))
