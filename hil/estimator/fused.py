"""Camera poses and wheel counts fused at the exposure time, predicted to the actuation time.

An extended Kalman filter on [z1_x, z1_y, theta, k_d, k_t] lives at the last exposure ("anchor").
k_d and k_t scale distance and turn from wheel counts, so wheel radius and track need not be known
well. Wheel reports since then are kept: a pose moves the anchor forward over them and updates it;
between poses dead reckoning over them gives the present, and the wheel loop's lag model with the
commands under way gives the actuation time. World frame, SI.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from hil.estimator.odometry import (
    BelievedGeometry,
    CommandHistory,
    WheelSpeeds,
    counts_between,
    predict,
)
from hil.types import Estimate, Pose, PoseMeasurement, WheelSample, wrap_pi

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.control import EstimatorConfig

# A wheel never turns this fast: a larger step of the counter is a restarted board.
_OMEGA_IMPOSSIBLE_RAD_S = 200.0
# Without reports for longer the board has stopped by itself: predict no further on commands.
_HORIZON_S = 0.3


class Fused:
    """The default estimator."""

    def __init__(self, config: EstimatorConfig, geometry: BelievedGeometry) -> None:
        self._config = config
        self._geometry = geometry
        self._speeds = WheelSpeeds(
            config.wheel_lag_s, config.sigma_accel_rad_s2, geometry.rad_per_count
        )
        self._commands = CommandHistory()
        self._last: WheelSample | None = None
        # Increments after the anchor: (begin, end, forward, turn) in believed units.
        self._path: deque[tuple[float, float, float, float]] = deque()
        self._t_anchor = -math.inf
        self._x: list[float] = [0.0, 0.0, 0.0, 1.0, 1.0]
        self._P: NDArray[np.float64] = np.zeros((5, 5))
        self._head = (0.0, 0.0, 0.0)
        self._t_pose: float | None = None
        self._gated_innovation: NDArray[np.float64] | None = None
        self._gated_run = 0
        self.gated_total = 0

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Return the covariance of [z1_x, z1_y, theta, k_d, k_t] at the last exposure."""
        return self._P.copy()

    @property
    def scales(self) -> tuple[float, float]:
        """Return (k_d, k_t): true over believed distance and turn of the same wheel counts."""
        return self._x[3], self._x[4]

    def pose_age_s(self, t_host_s: float) -> float:
        """Return the time since the last exposure that was believed; inf before the first."""
        return math.inf if self._t_pose is None else t_host_s - self._t_pose

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds commanded to be in effect from `t_effect_s` on."""
        self._commands.add(t_effect_s, *self._geometry.wheels(eta1_m_s, theta_dot_rad_s))

    def on_wheels(self, sample: WheelSample) -> None:
        """Take one wheel report (in time order; a stale one is dropped)."""
        last, self._last = self._last, sample
        if last is None:
            return
        dt = sample.t_host_s - last.t_host_s
        if dt <= 0.0:
            self._last = last
            return
        unit = self._geometry.rad_per_count
        left = unit * counts_between(last.counts_left, sample.counts_left)
        right = unit * counts_between(last.counts_right, sample.counts_right)
        if max(abs(left), abs(right)) > _OMEGA_IMPOSSIBLE_RAD_S * dt:
            self._speeds.restart()
            return
        pieces = self._commands.segments(last.t_host_s, sample.t_host_s)
        self._speeds.step(dt, (left, right), pieces)
        self._commands.forget_before(sample.t_host_s)
        forward, turn = self._geometry.body(left, right)
        begin = max(last.t_host_s, self._t_anchor)
        if begin >= sample.t_host_s:
            return
        part = (sample.t_host_s - begin) / dt
        self._path.append((begin, sample.t_host_s, part * forward, part * turn))
        self._head = self._moved(self._head, part * forward, part * turn)
        if self._path[0][0] < sample.t_host_s - self._config.history_s:
            self._advance(self._path[0][1])

    def _moved(
        self, at: tuple[float, float, float], forward: float, turn: float
    ) -> tuple[float, float, float]:
        """Return (z1_x, z1_y, theta) after believed increments, scaled."""
        step, d_theta = self._x[3] * forward, self._x[4] * turn
        middle = at[2] + 0.5 * d_theta
        return at[0] + step * math.cos(middle), at[1] + step * math.sin(middle), at[2] + d_theta

    def _advance(self, t_s: float) -> None:
        """Move the anchor to t_s over the wheel increments, the last one cut at t_s."""
        path = self._path
        forward = turn = path_length = path_turn = 0.0
        begin = self._t_anchor
        if self._last is not None and t_s > self._last.t_host_s:
            self._bridge(t_s)
        while path and path[0][0] < t_s:
            start, end, step, angle = path.popleft()
            if end > t_s:
                part = (t_s - start) / (end - start)
                path.appendleft((t_s, end, step * (1.0 - part), angle * (1.0 - part)))
                step, angle = step * part, angle * part
            forward, turn = forward + step, turn + angle
            path_length, path_turn = path_length + abs(step), path_turn + abs(angle)
        self._t_anchor = t_s
        if begin > -math.inf:
            self._propagate(t_s - begin, forward, turn, path_length, path_turn)

    def _bridge(self, t_s: float) -> None:
        """Extend the path to t_s beyond the last report, on the commands under way."""
        left, right, _, _ = self._ahead(t_s)
        begin = self._t_head
        if begin < t_s:
            self._path.append((begin, t_s, *self._geometry.body(left, right)))

    @property
    def _t_head(self) -> float:
        """Return the time up to which motion is known from reports (or from the last pose)."""
        reported = -math.inf if self._last is None else self._last.t_host_s
        return max(reported, self._t_anchor)

    def _ahead(self, t_s: float) -> tuple[float, float, float, float]:
        """Return wheel angles turned since the head and wheel speeds at t_s, by the lag model."""
        begin = self._t_head
        pieces = self._commands.segments(begin, min(t_s, begin + _HORIZON_S))
        left, right = self._speeds.omega
        return predict(pieces, left, right, self._config.wheel_lag_s)

    def _propagate(
        self, dt_s: float, forward: float, turn: float, length: float, angle: float
    ) -> None:
        """Move state and covariance at the anchor over one increment."""
        x, config = self._x, self._config
        middle = x[2] + 0.5 * x[4] * turn
        c, s = math.cos(middle), math.sin(middle)
        step = x[3] * forward
        F = np.eye(5)
        F[0, 2:] = (-step * s, forward * c, -0.5 * step * s * turn)
        F[1, 2:] = (step * c, forward * s, 0.5 * step * c * turn)
        F[2, 4] = turn
        self._P = F @ self._P @ F.T
        slip2 = config.slip_ratio**2
        noise = self._P.diagonal().copy()
        noise[:2] += slip2 * length + config.drift_m_s05**2 * dt_s
        noise[2] += slip2 * (angle + length) + config.drift_rad_s05**2 * dt_s
        np.fill_diagonal(self._P, noise)
        x[0], x[1], x[2] = x[0] + step * c, x[1] + step * s, x[2] + x[4] * turn

    def on_pose(self, t_exposure_s: float, measurement: PoseMeasurement) -> None:
        """Take the pose seen at `t_exposure_s` in the past; older than the last one is dropped."""
        pose = measurement.pose
        if pose is None or t_exposure_s <= self._t_anchor:
            return
        self._advance(t_exposure_s)
        if self._t_pose is None:
            self._start(t_exposure_s, pose, measurement)
        else:
            self._update(t_exposure_s, pose, measurement)
        self._head = (self._x[0], self._x[1], self._x[2])
        for _, _, forward, turn in self._path:
            self._head = self._moved(self._head, forward, turn)

    def _start(self, t_s: float, pose: Pose, measurement: PoseMeasurement) -> None:
        """Set the anchor on a pose; the scales keep what is known of them."""
        d0, theta = self._geometry.d0_m, pose.theta_rad
        if self._t_pose is not None:
            theta = self._x[2] + wrap_pi(theta - self._x[2])
        self._x[0] = pose.x_m + d0 * math.cos(theta)
        self._x[1] = pose.y_m + d0 * math.sin(theta)
        self._x[2] = theta
        scales = (
            self._P[3:, 3:].diagonal()
            if self._t_pose is not None
            else np.full(2, self._config.sigma_scale**2)
        )
        s_xy, s_theta = measurement.sigma_xy_m, measurement.sigma_theta_rad
        self._P = np.diag((s_xy**2, s_xy**2, s_theta**2, *scales))
        self._t_pose = t_s
        self._gated_run = 0

    def _update(self, t_s: float, pose: Pose, measurement: PoseMeasurement) -> None:
        """Correct the anchor by a pose, unless it lies outside the gate."""
        x, P, config = self._x, self._P, self._config
        d0 = self._geometry.d0_m
        c, s = math.cos(x[2]), math.sin(x[2])
        innovation = np.array(
            (
                pose.x_m - (x[0] - d0 * c),
                pose.y_m - (x[1] - d0 * s),
                wrap_pi(pose.theta_rad - x[2]),
            )
        )
        # h(x) = [z1 - d0 e(theta), theta], so H is the identity but for the theta column.
        HP = P[:3] + np.outer((d0 * s, -d0 * c, 0.0), P[2])
        S = HP[:, :3].copy()
        S += np.outer(HP[:, 2], (d0 * s, -d0 * c, 0.0))
        eta1, w = self._geometry.body(*self._speeds.omega)
        blur_xy2 = (config.sigma_time_s * eta1) ** 2
        R_xy = measurement.sigma_xy_m**2 + blur_xy2
        S[0, 0] += R_xy
        S[1, 1] += R_xy
        S[2, 2] += measurement.sigma_theta_rad**2 + (config.sigma_time_s * w) ** 2
        S_inv_HP = np.linalg.solve(S, HP)
        if float(innovation @ np.linalg.solve(S, innovation)) > config.gate_chi2:
            self._gate(t_s, pose, measurement, innovation)
            return
        gain_step = innovation @ S_inv_HP
        for index in range(5):
            x[index] += float(gain_step[index])
        P = P - HP.T @ S_inv_HP
        self._P = 0.5 * (P + P.T)
        self._t_pose = t_s
        self._gated_run = 0

    def _gate(
        self,
        t_s: float,
        pose: Pose,
        measurement: PoseMeasurement,
        innovation: NDArray[np.float64],
    ) -> None:
        """Count a gated pose; a run of them that agree with each other moves the anchor there."""
        self.gated_total += 1
        previous, self._gated_innovation = self._gated_innovation, innovation
        agree = (
            self._gated_run > 0
            and previous is not None
            and bool(np.all(np.abs(innovation - previous) < (0.02, 0.02, 0.1)))
        )
        self._gated_run = self._gated_run + 1 if agree else 1
        if self._gated_run >= self._config.reacquire_poses:
            self._start(t_s, pose, measurement)

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state predicted to `t_host_s`; None before the first pose."""
        if self._t_pose is None:
            return None
        geometry = self._geometry
        turned_left, turned_right, left, right = self._ahead(t_host_s)
        x, y, theta = self._moved(self._head, *geometry.body(turned_left, turned_right))
        forward, turn = geometry.body(left, right)
        eta1, w = self._x[3] * forward, self._x[4] * turn
        c, s = math.cos(theta), math.sin(theta)
        pose = Pose(x - geometry.d0_m * c, y - geometry.d0_m * s, theta)
        return Estimate(t_host_s, pose, eta1, w, (x, y), (eta1 * c, eta1 * s))
