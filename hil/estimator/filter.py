"""The extended Kalman filter of the default estimator, in plain floats (it runs every frame).

State x = [z1_x, z1_y, theta, k_d, k_t, d0]: flat output point and heading in the world, scales of the
distance and turn that wheel counts claim, and how far the point lies ahead of the centre of mass that
the camera gives. d0 shows in how the centre of mass moves aside in a turn (2.31). World frame, SI.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.types import Pose, wrap_pi

if TYPE_CHECKING:
    from hil.config.control import EstimatorConfig

Row = list[float]
THETA, DISTANCE, TURN, OFFSET = 2, 3, 4, 5


class PoseFilter:
    """Mean `x` and covariance `P` at one instant."""

    def __init__(self, config: EstimatorConfig, d0_m: float) -> None:
        self._config = config
        self.x: Row = [0.0, 0.0, 0.0, 1.0, 1.0, d0_m]
        self.P: list[Row] = [[0.0] * 6 for _ in range(6)]
        self.P[DISTANCE][DISTANCE] = self.P[TURN][TURN] = config.sigma_scale**2
        self.P[OFFSET][OFFSET] = config.sigma_d0_m**2

    def place(self, pose: Pose, sigma_xy_m: float, sigma_theta_rad: float) -> None:
        """Start at a pose; scales and d0 keep what is known of them, theta stays unwrapped."""
        x, P = self.x, self.P
        theta, d0 = x[THETA] + wrap_pi(pose.theta_rad - x[THETA]), x[OFFSET]
        c, s = math.cos(theta), math.sin(theta)
        x[:3] = (pose.x_m + d0 * c, pose.y_m + d0 * s, theta)
        var_xy, var_theta, var_d0 = sigma_xy_m**2, sigma_theta_rad**2, P[OFFSET][OFFSET]
        for i in (0, 1, THETA):
            P[i] = [0.0] * 6
        for row in P:
            row[:3] = (0.0, 0.0, 0.0)
        P[THETA][THETA] = var_theta
        P[0][0] = P[1][1] = var_xy
        # z1 = pose + d0 e(theta) carries the errors of theta and d0.
        for i, by_theta, by_d0 in ((0, -d0 * s, c), (1, d0 * c, s)):
            P[i][THETA] = P[THETA][i] = by_theta * var_theta
            P[i][OFFSET] = P[OFFSET][i] = by_d0 * var_d0
            for j, other_theta, other_d0 in ((0, -d0 * s, c), (1, d0 * c, s)):
                P[i][j] += by_theta * other_theta * var_theta + by_d0 * other_d0 * var_d0

    def move(
        self, dt_s: float, forward_m: float, turn_rad: float, path: tuple[float, float]
    ) -> None:
        """Carry mean and covariance over one increment of odometry (believed units).

        The point moves along the heading half-way through the turn. `path` is the distance and the
        turn with all signs positive: noise grows with what was travelled, not with the net of it.
        """
        x, P, config = self.x, self.P, self._config
        middle = x[THETA] + 0.5 * x[TURN] * turn_rad
        c, s = math.cos(middle), math.sin(middle)
        step = x[DISTANCE] * forward_m
        # F = 1 + G, with G the rows below on the columns theta, k_d, k_t.
        rows = (
            (0, -step * s, forward_m * c, -0.5 * step * s * turn_rad),
            (1, step * c, forward_m * s, 0.5 * step * c * turn_rad),
            (THETA, 0.0, 0.0, turn_rad),
        )
        for i, g2, g3, g4 in rows:
            P[i] = [
                a + g2 * b + g3 * d + g4 * e
                for a, b, d, e in zip(P[i], P[THETA], P[DISTANCE], P[TURN], strict=True)
            ]
        for i, g2, g3, g4 in rows:
            for row in P:
                row[i] += g2 * row[THETA] + g3 * row[DISTANCE] + g4 * row[TURN]
        slip2 = config.slip_ratio**2
        position_noise = slip2 * path[0] + config.drift_m_s05**2 * dt_s
        P[0][0] += position_noise
        P[1][1] += position_noise
        P[THETA][THETA] += slip2 * (path[0] + path[1]) + config.drift_rad_s05**2 * dt_s
        P[OFFSET][OFFSET] += config.d0_walk_m_rad05**2 * path[1]
        x[0] += step * c
        x[1] += step * s
        x[THETA] += x[TURN] * turn_rad

    def innovation(self, pose: Pose) -> tuple[float, float, float]:
        """Return the pose seen minus the pose expected: h(x) = [z1 - d0 e(theta), theta]."""
        x = self.x
        return (
            pose.x_m - x[0] + x[OFFSET] * math.cos(x[THETA]),
            pose.y_m - x[1] + x[OFFSET] * math.sin(x[THETA]),
            wrap_pi(pose.theta_rad - x[THETA]),
        )

    def correct(
        self, innovation: tuple[float, float, float], var_xy: float, var_theta: float, gate: float
    ) -> bool:
        """Take the innovation unless its squared Mahalanobis distance exceeds `gate`.

        The three components are independent, so they are taken one after the other; the sum of
        their normalised squares is the distance of the whole.
        """
        d0, c, s = self.x[OFFSET], math.cos(self.x[THETA]), math.sin(self.x[THETA])
        P = self.P
        change = [0.0] * 6
        distance2 = 0.0
        # Beside the identity, dh/dtheta and dh/dd0.
        rows = ((var_xy, d0 * s, -c), (var_xy, -d0 * c, -s), (var_theta, 0.0, 0.0))
        for i, (variance, by_theta, by_d0) in enumerate(rows):
            ph = [row[i] + by_theta * row[THETA] + by_d0 * row[OFFSET] for row in P]
            total = ph[i] + by_theta * ph[THETA] + by_d0 * ph[OFFSET] + variance
            left = innovation[i] - change[i] - by_theta * change[THETA] - by_d0 * change[OFFSET]
            distance2 += left * left / total
            if distance2 > gate:
                return False
            gain = [value / total for value in ph]
            change = [a + k * left for a, k in zip(change, gain, strict=True)]
            p0, p1, p2, p3, p4, p5 = ph  # written out: this runs for every frame
            P = [
                [a - k * p0, b - k * p1, c_ - k * p2, d - k * p3, e - k * p4, f - k * p5]
                for (a, b, c_, d, e, f), k in zip(P, gain, strict=True)
            ]
        self.P = P
        self.x = [a + b for a, b in zip(self.x, change, strict=True)]
        return True
