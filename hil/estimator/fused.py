"""Camera poses and wheel counts fused at the exposure time, predicted to the actuation time.

The filter lives at the last exposure ("anchor"). Wheel reports since then are kept: a pose moves the
anchor forward over them and corrects it there; between poses dead reckoning over them gives the
latest report ("head"), and the wheel loop's lag model with the commands under way gives the
actuation time. World frame, SI.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from hil.estimator.filter import DISTANCE, OFFSET, THETA, TURN, PoseFilter
from hil.estimator.odometry import (
    BelievedGeometry,
    CommandHistory,
    WheelSpeeds,
    counts_between,
)
from hil.types import Estimate, Pose, PoseMeasurement, WheelSample

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig

# A wheel never turns this fast: a larger step of the counter is a restarted board.
_OMEGA_IMPOSSIBLE_RAD_S = 200.0
# Without reports for longer the board has stopped by itself: predict no further on commands.
_HORIZON_S = 0.3
# Gated poses whose innovations differ by less than this agree with each other (m, m, rad).
_AGREE = (0.02, 0.02, 0.1)


class Increment(NamedTuple):
    """Odometry between two instants, in believed units."""

    begin_s: float
    end_s: float
    forward_m: float
    turn_rad: float


class Fused:
    """The default estimator."""

    def __init__(self, config: EstimatorConfig, geometry: BelievedGeometry) -> None:
        self._config = config
        self._geometry = geometry
        self._filter = PoseFilter(config, geometry.d0_m)
        self._speeds = WheelSpeeds(
            config.wheel_lag_s,
            config.sigma_accel_rad_s2,
            config.sigma_short_rad_s15,
            geometry.rad_per_count,
        )
        self._commands = CommandHistory()
        self._last: WheelSample | None = None
        self._path: deque[Increment] = deque()  # after the anchor
        self._t_anchor = -math.inf
        self._head = (0.0, 0.0, 0.0)
        self._t_pose: float | None = None
        self._gated_innovation = (0.0, 0.0, 0.0)
        self._gated_run = 0
        self.gated_total = 0

    @property
    def covariance(self) -> list[list[float]]:
        """Return the covariance of [z1_x, z1_y, theta, k_d, k_t, d0] at the last exposure."""
        return [row.copy() for row in self._filter.P]

    @property
    def scales(self) -> tuple[float, float]:
        """Return (k_d, k_t): true over believed distance and turn of the same wheel counts."""
        return self._filter.x[DISTANCE], self._filter.x[TURN]

    @property
    def d0_m(self) -> float:
        """Return how far the point without lateral speed lies ahead of the centre of mass."""
        return self._filter.x[OFFSET]

    def pose_age_s(self, t_host_s: float) -> float:
        """Return the time since the last exposure that was believed; inf before the first."""
        return math.inf if self._t_pose is None else t_host_s - self._t_pose

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds commanded to be in effect from `t_effect_s` on."""
        self._commands.add(t_effect_s, *self._geometry.wheels(eta1_m_s, theta_dot_rad_s))

    def on_wheels(self, sample: WheelSample) -> None:
        """Take one wheel report (in time order; a stale one is dropped)."""
        last = self._last
        if last is None:
            self._last = sample
            return
        dt = sample.t_host_s - last.t_host_s
        if dt <= 0.0:
            return
        self._last = sample
        unit = self._geometry.rad_per_count
        left = unit * counts_between(last.counts_left, sample.counts_left)
        right = unit * counts_between(last.counts_right, sample.counts_right)
        if max(abs(left), abs(right)) > _OMEGA_IMPOSSIBLE_RAD_S * dt:
            self._speeds.restart()
            return
        pieces = self._commands.segments(last.t_host_s, sample.t_host_s)
        self._speeds.step(dt, (left, right), pieces)
        self._commands.forget_before(sample.t_host_s)
        self._extend(last.t_host_s, sample.t_host_s, *self._geometry.body(left, right))
        if self._path and self._path[0].begin_s < sample.t_host_s - self._config.history_s:
            self._advance(self._path[0].end_s)

    def _extend(self, begin_s: float, end_s: float, forward: float, turn: float) -> None:
        """Append the part of an increment that lies after the anchor, and move the head over it."""
        start = max(begin_s, self._t_anchor)
        if start >= end_s:
            return
        part = (end_s - start) / (end_s - begin_s)
        forward, turn = part * forward, part * turn
        self._path.append(Increment(start, end_s, forward, turn))
        self._head = self._moved(self._head, forward, turn)

    def _moved(
        self, at: tuple[float, float, float], forward: float, turn: float
    ) -> tuple[float, float, float]:
        """Return (z1_x, z1_y, theta) after believed increments, scaled."""
        x = self._filter.x
        step, d_theta = x[DISTANCE] * forward, x[TURN] * turn
        middle = at[2] + 0.5 * d_theta
        return at[0] + step * math.cos(middle), at[1] + step * math.sin(middle), at[2] + d_theta

    @property
    def _t_head(self) -> float:
        """Return the time up to which motion is known, from a report or a pose."""
        reported = -math.inf if self._last is None else self._last.t_host_s
        return max(reported, self._t_anchor)

    def _ahead(self, t_s: float) -> tuple[float, float, float, float]:
        """Return wheel angles turned since the head and wheel speeds at t_s, by the lag model."""
        begin = self._t_head
        return self._speeds.ahead(self._commands.segments(begin, min(t_s, begin + _HORIZON_S)))

    def _advance(self, t_s: float) -> None:
        """Move the anchor to t_s over the increments, the last one cut there."""
        if self._t_anchor > -math.inf and t_s > self._t_head:
            left, right, _, _ = self._ahead(t_s)
            self._extend(self._t_head, t_s, *self._geometry.body(left, right))
        path = self._path
        forward = turn = length = angle = 0.0
        while path and path[0].begin_s < t_s:
            first = path.popleft()
            step, d_theta = first.forward_m, first.turn_rad
            if first.end_s > t_s:
                part = (t_s - first.begin_s) / (first.end_s - first.begin_s)
                rest = 1.0 - part
                path.appendleft(Increment(t_s, first.end_s, step * rest, d_theta * rest))
                step, d_theta = step * part, d_theta * part
            forward, turn = forward + step, turn + d_theta
            length, angle = length + abs(step), angle + abs(d_theta)
        if self._t_pose is not None:
            self._filter.move(t_s - self._t_anchor, forward, turn, (length, angle))
        self._t_anchor = t_s

    def on_pose(self, t_exposure_s: float, measurement: PoseMeasurement) -> None:
        """Take the pose seen at `t_exposure_s` in the past; older than the last one is dropped."""
        pose = measurement.pose
        if pose is None or t_exposure_s <= self._t_anchor:
            return
        self._advance(t_exposure_s)
        if self._t_pose is None:
            self._place(t_exposure_s, pose, measurement)
        else:
            self._correct(t_exposure_s, pose, measurement)
        x = self._filter.x
        self._head = (x[0], x[1], x[THETA])
        for increment in self._path:
            self._head = self._moved(self._head, increment.forward_m, increment.turn_rad)

    def _place(self, t_s: float, pose: Pose, measurement: PoseMeasurement) -> None:
        """Set the anchor on a pose."""
        self._filter.place(pose, measurement.sigma_xy_m, measurement.sigma_theta_rad)
        self._t_pose = t_s
        self._gated_run = 0

    def _correct(self, t_s: float, pose: Pose, measurement: PoseMeasurement) -> None:
        """Correct the anchor by a pose; a run of gated poses that agree moves it there instead."""
        config = self._config
        eta1, w = self._geometry.body(*self._speeds.omega)
        innovation = self._filter.innovation(pose)
        # An exposure dated wrongly by sigma_time looks like an error along the motion.
        var_xy = measurement.sigma_xy_m**2 + (config.sigma_time_s * eta1) ** 2
        var_theta = measurement.sigma_theta_rad**2 + (config.sigma_time_s * w) ** 2
        if self._filter.correct(innovation, var_xy, var_theta, config.gate_chi2):
            self._t_pose = t_s
            self._gated_run = 0
            return
        self.gated_total += 1
        previous, self._gated_innovation = self._gated_innovation, innovation
        agree = self._gated_run > 0 and all(
            abs(a - b) < limit for a, b, limit in zip(innovation, previous, _AGREE, strict=True)
        )
        self._gated_run = self._gated_run + 1 if agree else 1
        if self._gated_run >= config.reacquire_poses:
            self._place(t_s, pose, measurement)

    def _back_at(self, t_s: float) -> tuple[float, float, float]:
        """Return (z1_x, z1_y, theta) at a time before the head, not before the anchor."""
        x = self._filter.x
        at = (x[0], x[1], x[THETA])
        for begin, end, forward, turn in self._path:
            if begin >= t_s:
                break
            part = min((t_s - begin) / (end - begin), 1.0)
            at = self._moved(at, part * forward, part * turn)
        return at

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state at `t_host_s`, past the last exposure; None before the first pose.

        Speeds are predicted; for a time already passed they are those of the latest report.
        """
        if self._t_pose is None:
            return None
        geometry, state = self._geometry, self._filter.x
        turned_left, turned_right, left, right = self._ahead(t_host_s)
        if t_host_s < self._t_head:
            x, y, theta = self._back_at(t_host_s)
        else:
            x, y, theta = self._moved(self._head, *geometry.body(turned_left, turned_right))
        forward, turn = geometry.body(left, right)
        eta1, w = state[DISTANCE] * forward, state[TURN] * turn
        c, s = math.cos(theta), math.sin(theta)
        pose = Pose(x - state[OFFSET] * c, y - state[OFFSET] * s, theta)
        return Estimate(t_host_s, pose, eta1, w, (x, y), (eta1 * c, eta1 * s))
