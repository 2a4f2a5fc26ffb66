"""An estimator of your own: where the robot is now, from late poses and wheel counts.

    hil run scenario-1 --set control.estimator=./my-thing.py
    hil check estimator my-thing.py

World frame: X right and Y up on the floor; theta counter-clockwise from +X; SI units and radians. All
times are host times and arguments: no clock is read here.
"""

import math

import hil


class Settings(hil.Section):
    """What may be set with --set control.estimator_settings.KEY=VALUE."""

    share: float = hil.quantity(
        "(ratio)", "of a pose's error that is taken at once", 0.3, gt=0, le=1
    )


@hil.estimator("my-thing", settings=Settings)
class MyThing:
    """Counts wheel turns on from pose to pose, and draws what it counted towards each pose."""

    def __init__(
        self, config: hil.EstimatorConfig, geometry: hil.BelievedGeometry, settings: Settings
    ) -> None:
        self._config, self._geometry, self._settings = config, geometry, settings
        self._path: list[tuple[float, float, float, float]] = []  # t_s, x_m, y_m, theta_rad of z1
        self._counts: tuple[int, int] | None = None
        self._speeds = (0.0, 0.0)

    def on_wheels(self, sample: hil.WheelSample) -> None:
        """Take one wheel report: roll on by the counts since the last one."""
        counts = (sample.counts_left, sample.counts_right)
        before, self._counts = self._counts or counts, counts
        self._speeds = self._geometry.body(sample.omega_left_rad_s, sample.omega_right_rad_s)
        if not self._path or sample.t_host_s <= self._path[-1][0]:
            return
        unit = self._geometry.rad_per_count
        turned = [unit * _wrapped(new - old) for new, old in zip(counts, before, strict=True)]
        forward_m, turn_rad = self._geometry.body(*turned)
        _, x_m, y_m, theta = self._path[-1]
        middle = theta + 0.5 * turn_rad
        x_m, y_m = x_m + forward_m * math.cos(middle), y_m + forward_m * math.sin(middle)
        self._path.append((sample.t_host_s, x_m, y_m, theta + turn_rad))
        self._path = [row for row in self._path if row[0] > sample.t_host_s - 1.0]

    def on_pose(self, t_exposure_s: float, measurement: hil.PoseMeasurement) -> None:
        """Take a pose seen in the past: move the whole path by a share of its error there."""
        pose = measurement.pose
        if pose is None:
            return
        d0_m = self._geometry.d0_m
        if not self._path:
            x_m = pose.x_m + d0_m * math.cos(pose.theta_rad)
            y_m = pose.y_m + d0_m * math.sin(pose.theta_rad)
            self._path = [(t_exposure_s, x_m, y_m, pose.theta_rad)]
            return
        _, x_m, y_m, theta = min(self._path, key=lambda row: abs(row[0] - t_exposure_s))
        turn = math.remainder(pose.theta_rad - theta, 2.0 * math.pi)
        dx_m = pose.x_m + d0_m * math.cos(theta + turn) - x_m
        dy_m = pose.y_m + d0_m * math.sin(theta + turn) - y_m
        share = self._settings.share
        self._path = [
            (t, x + share * dx_m, y + share * dy_m, th + share * turn) for t, x, y, th in self._path
        ]

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds in effect from `t_effect_s` on: not used here."""

    def estimate_at(self, t_host_s: float) -> hil.Estimate | None:
        """Return the state at `t_host_s`, rolled on at the speeds of the last report."""
        if not self._path:
            return None
        t_s, x_m, y_m, theta = self._path[-1]
        (eta1, turn_rate), ahead_s = self._speeds, t_host_s - t_s
        middle = theta + 0.5 * ahead_s * turn_rate
        theta += ahead_s * turn_rate
        z1 = (x_m + ahead_s * eta1 * math.cos(middle), y_m + ahead_s * eta1 * math.sin(middle))
        cos, sin, d0_m = math.cos(theta), math.sin(theta), self._geometry.d0_m
        pose = hil.Pose(z1[0] - d0_m * cos, z1[1] - d0_m * sin, theta)
        return hil.Estimate(t_host_s, pose, eta1, turn_rate, z1, (eta1 * cos, eta1 * sin))


def _wrapped(counts: int) -> int:
    """Return a difference of the board's 32-bit counters."""
    return (counts + 2**31) % 2**32 - 2**31
