"""Wheel side of the estimators: geometry the host believes, wheel speeds, lag prediction.

Body frame x forward, y left; theta_dot > 0 means the right wheel is faster. The path is kept for
the flat output point z1 = X + d0 e, which moves exactly along the heading e (control.md section 1).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

# A piece of constant command: duration in s, left and right wheel speed in rad/s.
Piece = tuple[float, float, float]


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

    def segments(self, t0_s: float, t1_s: float) -> list[Piece]:
        """Return the constant pieces between two times, in order."""
        out: list[Piece] = []
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

    Per wheel the state is [angle, speed, shortfall]: speed_dot = (command - shortfall - speed)/lag
    + noise. The shortfall is what the wheel loop leaves standing (friction, a blocked wheel), a
    random walk; without it a wheel that does not obey would be taken to turn. The wheels share one
    covariance because they share times and noise. Quantisation enters as count^2/12.
    """

    def __init__(
        self, lag_s: float, sigma_accel_rad_s2: float, sigma_short_rad_s15: float, unit_rad: float
    ) -> None:
        self._lag = lag_s
        self._q_speed = sigma_accel_rad_s2 * sigma_accel_rad_s2
        self._q_short = sigma_short_rad_s15 * sigma_short_rad_s15
        self._r = unit_rad * unit_rad / 12.0
        self.restart()

    def restart(self) -> None:
        """Forget what was learned: at the start, and when the counters have jumped."""
        self._offset = [0.0, 0.0]  # filtered angle minus counted angle, left and right
        self._omega = [0.0, 0.0]
        self._short = [0.0, 0.0]
        self._p = (self._r, 0.0, 0.0, 1.0, 0.0, 1.0)  # upper triangle, row by row

    def ahead(self, pieces: list[Piece]) -> tuple[float, float, float, float]:
        """Return angles turned under the commands `pieces` and final speeds (left, right each)."""
        angle_left = angle_right = 0.0
        left, right = self._omega
        short_left, short_right = self._short
        lag = self._lag
        for duration, goal_left, goal_right in pieces:
            fade = math.exp(-duration / lag)
            reach = lag * (1.0 - fade)
            to_left, to_right = goal_left - short_left, goal_right - short_right
            angle_left += to_left * duration + (left - to_left) * reach
            angle_right += to_right * duration + (right - to_right) * reach
            left = to_left + (left - to_left) * fade
            right = to_right + (right - to_right) * fade
        return angle_left, angle_right, left, right

    @property
    def omega(self) -> tuple[float, float]:
        """Return the speeds (left, right) at the latest report."""
        return self._omega[0], self._omega[1]

    def step(self, dt_s: float, turned: tuple[float, float], pieces: list[Piece]) -> None:
        """Take the angles turned (rad, left and right) in dt_s under the commands `pieces`."""
        expected = self.ahead(pieces)
        f = math.exp(-dt_s / self._lag)
        g = self._lag * (1.0 - f)  # angle from one unit of speed, and dt - g from a shortfall
        b = -(dt_s - g)
        c = -(1.0 - f)
        p00, p01, p02, p11, p12, p22 = self._p
        # F = [[1, g, b], [0, f, c], [0, 0, 1]]; P = F P F' + Q
        r0, r1, r2 = p00 + g * p01 + b * p02, p01 + g * p11 + b * p12, p02 + g * p12 + b * p22
        t1, t2 = f * p11 + c * p12, f * p12 + c * p22
        q = self._q_speed * dt_s * dt_s
        n00 = r0 + g * r1 + b * r2 + 0.25 * q * dt_s * dt_s
        n01 = f * r1 + c * r2 + 0.5 * q * dt_s
        n11 = f * t1 + c * t2 + q
        n22 = p22 + self._q_short * dt_s
        k = 1.0 / (n00 + self._r)
        for side in (0, 1):
            error = self._offset[side] + expected[side] - turned[side]
            self._offset[side] = error * (1.0 - n00 * k)
            self._omega[side] = expected[2 + side] - n01 * k * error
            self._short[side] -= r2 * k * error
        self._p = (
            n00 * (1.0 - n00 * k),
            n01 * (1.0 - n00 * k),
            r2 * (1.0 - n00 * k),
            n11 - n01 * n01 * k,
            t2 - n01 * r2 * k,
            n22 - r2 * r2 * k,
        )
