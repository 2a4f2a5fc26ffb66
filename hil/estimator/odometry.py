"""Wheel side of the estimators: geometry the host believes, wheel speeds, lag prediction.

Body frame x forward, y left; theta_dot > 0 means the right wheel is faster. The path is kept for
the flat output point z1 = X + d0 e, which moves exactly along the heading e (control.md section 1).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BelievedGeometry:
    """The robot as the host believes it to be; the truth may differ by some 10 %."""

    wheel_radius_m: float
    track_width_m: float
    d0_m: float
    counts_per_turn: int

    @property
    def rad_per_count(self) -> float:
        """Return the wheel angle of one count."""
        return 2.0 * math.pi / self.counts_per_turn

    def body(self, left: float, right: float) -> tuple[float, float]:
        """Return (forward, turn) of a pair of wheel angles or speeds: m and rad, or per s."""
        r = self.wheel_radius_m
        return 0.5 * r * (left + right), r * (right - left) / self.track_width_m

    def wheels(self, eta1_m_s: float, theta_dot_rad_s: float) -> tuple[float, float]:
        """Return the (left, right) wheel speeds in rad/s that give the body speeds."""
        half = 0.5 * self.track_width_m * theta_dot_rad_s
        r = self.wheel_radius_m
        return (eta1_m_s - half) / r, (eta1_m_s + half) / r


def counts_between(old: int, new: int) -> int:
    """Return new - old of a signed 32-bit counter that may have wrapped in between."""
    return (new - old + 0x80000000) % 0x100000000 - 0x80000000


class CommandHistory:
    """Wheel speeds commanded, each from its time of effect on."""

    def __init__(self) -> None:
        self._items: deque[tuple[float, float, float]] = deque([(-math.inf, 0.0, 0.0)])

    def add(self, t_s: float, left: float, right: float) -> None:
        """Add a command; one that takes effect before an earlier one replaces it."""
        items = self._items
        while len(items) > 1 and items[-1][0] >= t_s:
            items.pop()
        items.append((t_s, left, right))

    def forget_before(self, t_s: float) -> None:
        """Drop what was superseded before t_s."""
        items = self._items
        while len(items) > 1 and items[1][0] <= t_s:
            items.popleft()

    def segments(self, t0_s: float, t1_s: float) -> list[tuple[float, float, float]]:
        """Return (duration, left, right) of the constant pieces between two times, in order."""
        out: list[tuple[float, float, float]] = []
        items = self._items
        last = len(items) - 1
        for index, (start, left, right) in enumerate(items):
            begin = max(start, t0_s)
            end = t1_s if index == last else min(items[index + 1][0], t1_s)
            if end > begin:
                out.append((end - begin, left, right))
        return out


class WheelSpeeds:
    """Both wheel speeds by a Kalman filter on the counts, with the wheel loop's lag as the model.

    Per wheel the state is [angle, speed], speed_dot = (command - speed)/lag + noise; the wheels
    share one covariance because they share times and noise. Quantisation enters as count^2/12.
    """

    def __init__(self, lag_s: float, sigma_accel_rad_s2: float, rad_per_count: float) -> None:
        self._lag = lag_s
        self._q = sigma_accel_rad_s2 * sigma_accel_rad_s2
        self._r = rad_per_count * rad_per_count / 12.0
        self._offset = [0.0, 0.0]  # filtered angle minus counted angle, left and right
        self.omega = [0.0, 0.0]
        self._p00, self._p01, self._p11 = self._r, 0.0, 1.0

    def step(
        self, dt_s: float, turned: tuple[float, float], pieces: list[tuple[float, float, float]]
    ) -> None:
        """Take the angles turned (rad, left and right) in dt_s under the commands `pieces`."""
        expected = predict(pieces, self.omega[0], self.omega[1], self._lag)
        decay = math.exp(-dt_s / self._lag)
        reach = self._lag * (1.0 - decay)
        q = self._q * dt_s * dt_s
        p00 = self._p00 + reach * (2.0 * self._p01 + reach * self._p11) + 0.25 * q * dt_s * dt_s
        p01 = decay * (self._p01 + reach * self._p11) + 0.5 * q * dt_s
        p11 = decay * decay * self._p11 + q
        gain = 1.0 / (p00 + self._r)
        for side in (0, 1):
            ahead = self._offset[side] + expected[side] - turned[side]
            self._offset[side] = ahead * (1.0 - p00 * gain)
            self.omega[side] = expected[2 + side] - p01 * gain * ahead
        self._p00, self._p01, self._p11 = (
            p00 * (1.0 - p00 * gain),
            p01 * (1.0 - p00 * gain),
            p11 - p01 * p01 * gain,
        )

    def restart(self) -> None:
        """Forget the speeds: the counter has jumped (board restarted)."""
        self._offset = [0.0, 0.0]
        self.omega = [0.0, 0.0]
        self._p00, self._p01, self._p11 = self._r, 0.0, 1.0


def predict(
    pieces: list[tuple[float, float, float]], left: float, right: float, lag_s: float
) -> tuple[float, float, float, float]:
    """Return angles turned and final speeds (left, right each) through first-order wheel loops."""
    angle_left = angle_right = 0.0
    for duration, goal_left, goal_right in pieces:
        fade = math.exp(-duration / lag_s)
        reach = lag_s * (1.0 - fade)
        angle_left += goal_left * duration + (left - goal_left) * reach
        angle_right += goal_right * duration + (right - goal_right) * reach
        left = goal_left + (left - goal_left) * fade
        right = goal_right + (right - goal_right) * fade
    return angle_left, angle_right, left, right
