"""A robot with wheels, encoders and a delayed camera, for the tests of the estimators."""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass

from hil.control.estimators.geometry import BelievedGeometry
from hil.core.types import Estimator, Pose, PoseMeasurement, WheelSample, wrap_pi

TRUE = BelievedGeometry(0.0482, 0.2166, 0.03, 1920)
LAG_S = 0.06
STEP_S = 0.001


@dataclass(frozen=True, slots=True)
class Conditions:
    """What the sensors do; the defaults are those of the three experiments."""

    camera_delay_s: float = 0.06
    camera_jitter_s: float = 0.01
    link_delay_s: float = 0.02
    sigma_xy_m: float = 0.001
    sigma_theta_rad: float = 0.005
    exact: bool = False  # no noise, no jitter


@dataclass(slots=True)
class Moment:
    """Truth and estimate at the instant that the estimate was asked for."""

    t_s: float
    x: float
    y: float
    theta: float
    eta1: float
    w: float
    estimate: object


class World:
    """Drives the true robot by commands in the host's believed geometry and feeds an estimator."""

    def __init__(
        self,
        estimator: Estimator,
        believed: BelievedGeometry,
        conditions: Conditions,
        seed: int = 1,
    ) -> None:
        self.estimator, self.believed, self.conditions = estimator, believed, conditions
        self.rng = random.Random(seed)
        self.t = 0.0
        self.z = [0.0, 0.0, 0.3]
        self.wheel = [0.0, 0.0]
        self.angle = [0.0, 0.0]
        self.goal = (0.0, 0.0)
        self.poses, self.reports, self.goals = deque(), deque(), deque()
        self.camera_on, self.link_on = True, True
        self.jump = (0.0, 0.0, 0.0)  # added to what the camera sees
        self.board_restarts_at = math.inf

    def run(self, seconds, command, on_tick=None, lead_s=0.02):
        """Run with `command(t) -> (eta1, w)` at 30 Hz; returns a Moment per tick, at its lead."""
        asked: deque = deque()
        moments = []
        for step in range(round(seconds / STEP_S)):
            if step % 33 == 0:
                self.expose()
            if step % 20 == 0:
                self.report()
            self.deliver()
            if step % 33 == 16:
                eta1, w = command(self.t)
                effect = self.t + lead_s
                estimate = self.estimator.estimate_at(effect)
                asked.append((effect, estimate))
                self.estimator.on_command(effect, eta1, w)
                self.goals.append((effect, self.believed.wheels(eta1, w)))
            self.advance()
            while asked and asked[0][0] <= self.t + STEP_S / 2:
                _, estimate = asked.popleft()
                eta1, w = TRUE.body(*self.wheel)
                moments.append(Moment(self.t, *self.z, eta1, w, estimate))
                if on_tick is not None:
                    on_tick(moments[-1])
        return moments

    def expose(self):
        c, rng = self.conditions, self.rng
        x, y, theta = self.z
        noise = 0.0 if c.exact else 1.0
        pose = Pose(
            x - TRUE.d0_m * math.cos(theta) + self.jump[0] + noise * rng.gauss(0, c.sigma_xy_m),
            y - TRUE.d0_m * math.sin(theta) + self.jump[1] + noise * rng.gauss(0, c.sigma_xy_m),
            wrap_pi(theta + self.jump[2] + noise * rng.gauss(0, c.sigma_theta_rad)),
        )
        delay = c.camera_delay_s + noise * rng.uniform(-c.camera_jitter_s, c.camera_jitter_s)
        if self.camera_on:
            seen = PoseMeasurement(pose, 1.0, "", c.sigma_xy_m, c.sigma_theta_rad)
            self.poses.append((self.t + delay, self.t, seen))

    def report(self):
        if self.t >= self.board_restarts_at:
            self.angle = [0.0, 0.0]
            self.board_restarts_at = math.inf
        unit = TRUE.rad_per_count
        # The 32-bit counters start near their end, so that every run wraps them.
        counts = [math.floor(a / unit) + 0x7FFFFFF0 for a in self.angle]
        wrapped = [(n + 0x80000000) % 0x100000000 - 0x80000000 for n in counts]
        if self.link_on:
            sample = WheelSample(self.t, wrapped[0], wrapped[1], *self.wheel)
            self.reports.append((self.t + self.conditions.link_delay_s, sample))

    def deliver(self):
        while self.poses and self.poses[0][0] <= self.t:
            _, exposure, seen = self.poses.popleft()
            self.estimator.on_pose(exposure, seen)
        while self.reports and self.reports[0][0] <= self.t:
            self.estimator.on_wheels(self.reports.popleft()[1])
        while self.goals and self.goals[0][0] <= self.t:
            self.goal = self.goals.popleft()[1]

    def advance(self):
        fade = math.exp(-STEP_S / LAG_S)
        for side in (0, 1):
            goal = self.goal[side]
            self.wheel[side] = goal + (self.wheel[side] - goal) * fade
            self.angle[side] += self.wheel[side] * STEP_S
        eta1, w = TRUE.body(*self.wheel)
        middle = self.z[2] + 0.5 * w * STEP_S
        self.z[0] += eta1 * math.cos(middle) * STEP_S
        self.z[1] += eta1 * math.sin(middle) * STEP_S
        self.z[2] += w * STEP_S
        self.t += STEP_S
